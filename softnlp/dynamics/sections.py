"""The sections at the Gauss points under pressures that change: stretch, compliance, mass and inertia, as numbers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.dynamics.grid import Grid
from softnlp.model.body import Body
from softnlp.model.model import Model
from softnlp.model.section import STIFFNESSES, RodSection, Section, SectionRadii
from softnlp.statics.branch import branch_function, stretch_on_branch

Array = NDArray[np.float64]

_ROOT = 1e-7  # of the stretch: a correction of this size leaves a millionth of it
_KEPT = 3  # sets of pressures: those of a step that ends, and of the next one
_MOST = 12  # iterations on it
_TINY = 1e-6  # step of a difference quotient by the stretch
_RAY = np.polynomial.legendre.leggauss(6)  # of an energy along a ray of resultants


class Failed(Exception):
    """Ends a run: a status, and what is to be said beside its advice."""

    def __init__(self, status: Status, message: str) -> None:
        self.status = status
        self.message = message
        super().__init__(message)


@dataclass(frozen=True, eq=False)
class Numbers:
    """Sections of n points at one set of pressures, per length as cast; body frame, resultants (force, moment).

    stretch : (n,) of the pressure alone. rest : (n, 6) strains V, U without a load [1], [1/m]. compliance : (n, 6, 6)
    their slope by the resultants without a load. stiffness : (n, 6, 6) its inverse. own : what `Law.strains` takes.
    """

    stretch: Array
    rest: Array
    compliance: Array
    stiffness: Array
    own: tuple[Array, ...]


@dataclass(frozen=True, eq=False)
class Stations:
    """The sections of one segment: at one point where it is uniform, else at each Gauss point.

    rows : of the Gauss points. columns : (numbers, stations) of the section. values : (pressures, numbers, stretch) ->
    its state. strains : (state, stretch, resultants) -> strains and slope; None where they are linear.
    """

    model: Model
    pressures: slice
    rows: NDArray[np.intp]
    columns: Array
    branch: ca.Function
    values: ca.Function
    strains: ca.Function | None
    chambers: int

    @property
    def uniform(self) -> bool:
        """Whether one station stands for all points."""
        return bool(self.columns.shape[1] == 1)

    def spread(self, found: Array) -> Array:
        """Return what is known at stations (stations, ...) at every point."""
        return np.broadcast_to(found, (self.rows.size, *found.shape[1:])) if self.uniform else found


_STATE = 1 + len(STIFFNESSES) + 4  # imbalance, stiffnesses, F_P, M_P, mass; then centres and own
_EA, _EI_X, _EI_Y, _GA, _GJ = range(2, 7)


@lru_cache(maxsize=16)
def _functions(model: Model) -> tuple[ca.Function, ca.Function, ca.Function | None, int]:
    """Return what is compiled of a model's section: its branch, state and strains; and its number of chambers."""
    section = model.section
    declared = section.quantities()
    symbols = {q.name: ca.SX.sym(q.name, q.size) for q in declared}
    P, stretch = ca.SX.sym("P", max(model.sets, 1)), ca.SX.sym("stretch")
    state = section.at(symbols, P, stretch)
    own = [value for value, _ in state.own]
    centres = [x for pair in state.centres for x in pair]
    every = ca.vertcat(state.imbalance, *state.stiffnesses, state.pressure_force, *state.pressure_moment,
                       state.line_density, *centres, *own)  # fmt: skip
    numbers = ca.vertcat(*symbols.values())
    values = ca.Function("values", [P, numbers, stretch], [every], {"cse": True})
    linear = type(section).strains is Section.strains
    strains = None if linear else _strains(model, len(state.own), len(centres))
    return branch_function(model), values, strains, len(state.centres)


def _stations(body: Body, grid: Grid, k: int) -> Stations:
    model, rows = body.models[k], np.flatnonzero(grid.segment == k)
    tables, declared = body.segments[k].tables, model.section.quantities()
    branch, values, strains, chambers = _functions(model)
    where = [0.0] if not tables else grid.fraction[rows]
    columns = []
    for s in where:
        there = {**model.numbers, **{key: float(np.interp(s, *table)) for key, table in tables.items()}}
        columns.append(np.concatenate([np.ravel(np.asarray(there[q.name], float)) for q in declared]))
    return Stations(
        model=model,
        pressures=body._pressures[k],
        rows=rows,
        columns=np.array(columns).T,
        branch=branch,
        values=values,
        strains=strains,
        chambers=chambers,
    )


def _strains(model: Model, own: int, centres: int) -> ca.Function:
    """Return (state of a section, stretch, resultants) -> strains per length as cast (6,), their slope (36,)."""
    given, stretch, e = ca.SX.sym("given", _STATE + centres + own), ca.SX.sym("stretch"), ca.SX.sym("e", 6)
    F_P, M_x, M_y, mass = (given[7 + j] for j in range(4))
    state = RodSection(
        given[_GA], given[_EA], given[_EI_X], given[_EI_Y], given[_GJ], F_P, M_x, M_y, mass, stretch * model.length
    )
    v, u = model.section.strains(state, ca.vertsplit(given[_STATE + centres :]) if own else [], e[:3], e[3:])
    found = stretch * ca.vertcat(v, u)
    return ca.Function("strains", [given, stretch, e], [found, ca.reshape(ca.jacobian(found, e).T, 36, 1)])


class Sections:
    """The sections of a body at the Gauss points of a grid.

    mass : (n,) rho A_0, per length as cast [kg/m]. inertia : (n, 3) rho times the second moments of area of the
    silicone as cast, about the body axes [kg m].
    """

    def __init__(self, body: Body, grid: Grid) -> None:
        self.body, self.size = body, grid.size
        self.stations = [_stations(body, grid, k) for k in range(len(body.segments))]
        self.mass, self.inertia = np.empty(self.size), np.empty((self.size, 3))
        for own in self.stations:
            found = self._state(own, np.zeros(max(own.model.sets, 1)), np.ones(own.columns.shape[1]))
            self.mass[own.rows] = own.spread(found[10])
            gyration = found[[_EI_X, _EI_Y]] / found[_EA]  # the silicone alone: the square of the radius of gyration
            both = np.stack([*gyration, gyration.sum(axis=0)], axis=1)
            self.inertia[own.rows] = own.spread(found[10][:, None] * both)
        turns = np.cumsum([segment.turn for segment in body.segments])
        c, s = np.cos(turns), np.sin(turns)
        axes = np.zeros((len(turns), 3, 3))
        axes[:, 0, 0], axes[:, 0, 1], axes[:, 1, 0], axes[:, 1, 1], axes[:, 2, 2] = c, -s, s, c, 1.0
        self.axes = axes
        """(segments, 3, 3) of each segment's axes in those of the base, which the rod's frame keeps."""
        self._turned = bool(np.any(turns))
        self._kept: dict[bytes, Numbers] = {}
        self._stretches: list[Array | None] = [None] * len(self.stations)

    @property
    def linear(self) -> bool:
        """Whether all strains are linear in the resultants."""
        return all(own.strains is None for own in self.stations)

    def _state(self, own: Stations, P: Array, stretch: Array) -> Array:
        return np.asarray(own.values(P, own.columns, stretch[None, :]))

    def at(self, pressures: Array) -> Numbers:
        """Return the sections at pressures (sets,) [Pa]. Raises `Failed` where there is no equilibrium, or no sign."""
        key = pressures.tobytes()
        if key in self._kept:
            return self._kept[key]
        n = self.size
        stretch, rest, slope = np.empty(n), np.empty((n, 6)), np.zeros((n, 6, 6))
        kept = []
        for k, own in enumerate(self.stations):
            P = pressures[own.pressures] if own.model.sets else np.zeros(1)
            found = self._stretch(k, P)
            state = self._state(own, P, found)
            if not np.all(state[1:7] > 0):
                lost = STIFFNESSES[int(np.argmin(np.all(state[1:7] > 0, axis=1)))]
                raise Failed(Status.UNSTABLE_MATERIAL, f"the section of segment {k + 1} has no positive {lost}")
            kept += [own.spread(state.T), own.spread(found)]
            stretch[own.rows] = own.spread(found)
            epsilon, C = self._unloaded(own, state, found)
            rest[own.rows], slope[own.rows] = own.spread(epsilon), own.spread(C)
        if self._turned:
            rest, slope = self._to_base(rest), self._both_to_base(slope)
        made = Numbers(stretch, rest, slope, np.asarray(np.linalg.inv(slope), float), tuple(kept))
        self._kept[key] = made
        while len(self._kept) > _KEPT:
            del self._kept[next(iter(self._kept))]
        return made

    def _unloaded(self, own: Stations, state: Array, stretch: Array) -> tuple[Array, Array]:
        """Return strains (stations, 6) without a load and their slope (stations, 6, 6)."""
        stations = stretch.size
        if own.strains is not None:
            found, by_e = own.strains(state, stretch[None, :], np.zeros((6, stations)))
            return np.asarray(found).T, np.asarray(by_e).T.reshape(-1, 6, 6)
        stiff = state[[_GA, _GA, _EA, _EI_X, _EI_Y, _GJ]]
        epsilon = np.zeros((stations, 6))
        epsilon[:, 2] = stretch
        epsilon[:, 3], epsilon[:, 4] = stretch * state[8] / stiff[3], stretch * state[9] / stiff[4]
        C = np.zeros((stations, 6, 6))
        C[:, range(6), range(6)] = (stretch / stiff).T
        return epsilon, C

    def _stretch(self, k: int, P: Array) -> Array:
        """Return the stretch of each station on its branch from zero pressure, by Newton's method from the last one."""
        own, last = self.stations[k], self._stretches[k]
        if last is not None:
            now = last
            for _ in range(_MOST):
                both = self._two(own, P, now)
                slope = (both[1] - both[0]) / _TINY
                with np.errstate(divide="ignore", invalid="ignore"):
                    change = np.where(slope > 0, both[0] / slope, np.inf)
                if not np.all(np.abs(change) < 0.02):
                    break
                now = now - change
                if np.all(np.abs(change) < _ROOT):
                    self._stretches[k] = now
                    return now
        found = np.empty(own.columns.shape[1])
        loads = np.zeros(9)
        for j, column in enumerate(own.columns.T):
            given = np.concatenate([P[: own.model.sets], loads, column])
            point = stretch_on_branch(own.branch, given, P[: own.model.sets])
            if point.status is not Status.SOLVED:
                raise Failed(point.status, point.message)
            found[j] = point.stretch
        self._stretches[k] = found
        return found

    def _two(self, own: Stations, P: Array, stretch: Array) -> Array:
        """Return the imbalance at a stretch and a little beyond, (2, stations)."""
        m = stretch.size
        columns = np.hstack([own.columns, own.columns])
        found: Array = np.asarray(own.values(P, columns, np.concatenate([stretch, stretch + _TINY])[None, :]), float)
        both: Array = found[0].reshape(2, m)
        return both

    def _to_base(self, a: Array) -> Array:
        """Turn vectors (n, 6, ...) of the segments' axes into those of the base."""
        found = np.array(a)
        for k, own in enumerate(self.stations):
            found[own.rows, :3] = np.einsum("ij,nj...->ni...", self.axes[k], a[own.rows, :3])
            found[own.rows, 3:] = np.einsum("ij,nj...->ni...", self.axes[k], a[own.rows, 3:])
        return found

    def _both_to_base(self, C: Array) -> Array:
        """Turn matrices (n, 6, 6) in the same way, rows and columns."""
        return self._to_base(self._to_base(C).swapaxes(1, 2)).swapaxes(1, 2)

    def _to_own(self, a: Array) -> Array:
        found = np.array(a)
        for k, own in enumerate(self.stations):
            found[own.rows, :3] = a[own.rows, :3] @ self.axes[k]
            found[own.rows, 3:] = a[own.rows, 3:] @ self.axes[k]
        return found

    def strains(self, numbers: Numbers, e: Array) -> tuple[Array, Array]:
        """Return V, U (n, 6) of resultants (n, 6), and their slope (n, 6, 6)."""
        if self.linear:
            return numbers.rest + np.matmul(numbers.compliance, e[:, :, None])[:, :, 0], numbers.compliance
        own_e = self._to_own(e) if self._turned else e
        found, slope = np.empty((self.size, 6)), np.empty((self.size, 6, 6))
        for k, own in enumerate(self.stations):
            if own.strains is not None:
                given, stretch = numbers.own[2 * k], numbers.own[2 * k + 1]
                a, b = own.strains(given.T, stretch[None, :], own_e[own.rows].T)
                found[own.rows], slope[own.rows] = np.asarray(a).T, np.asarray(b).T.reshape(-1, 6, 6)
        if self._turned:
            found, slope = self._to_base(found), self._both_to_base(slope)
        for own in self.stations:
            if own.strains is None:
                C = slope[own.rows] = numbers.compliance[own.rows]
                found[own.rows] = numbers.rest[own.rows] + np.matmul(C, e[own.rows, :, None])[:, :, 0]
        return found, slope

    def resultants(self, numbers: Numbers, strains: Array) -> Array:
        """Return the resultants (n, 6) of strains (n, 6), by Newton's method."""
        e: Array = np.matmul(numbers.stiffness, (strains - numbers.rest)[:, :, None])[:, :, 0]
        for _ in range(0 if self.linear else 30):
            found, slope = self.strains(numbers, e)
            change = np.linalg.solve(slope, (strains - found)[:, :, None])[:, :, 0]
            e = e + change
            if np.max(np.abs(change)) <= 1e-13 * (1e-12 + np.max(np.abs(e))):
                break
        return e

    def complement(self, numbers: Numbers, e: Array) -> Array:
        """Return (n,) the integral of the strains by the resultants from 0 to e, per length [N]."""
        if self.linear:
            found, _ = self.strains(numbers, e)
            half: Array = ((found + numbers.rest) / 2 * e).sum(axis=1)
            return half
        total = np.zeros(self.size)
        for x, w in zip(*_RAY, strict=True):
            total += w / 2 * (self.strains(numbers, (1 + x) / 2 * e)[0] * e).sum(axis=1)
        return total

    def centres(self, numbers: Numbers) -> list[Array]:
        """Return of each segment d_i at its points (points, N, 2) in its own axes [m]."""
        return [
            numbers.own[2 * k][:, _STATE : _STATE + 2 * own.chambers].reshape(-1, own.chambers, 2)
            for k, own in enumerate(self.stations)
        ]

    def pressure_resultants(self, numbers: Numbers) -> Array:
        """Return F_P e3 and M_P (n, 6), which the fluid takes; axes of the base."""
        found = np.zeros((self.size, 6))
        for k, own in enumerate(self.stations):
            state = numbers.own[2 * k]
            found[own.rows, 2], found[own.rows, 3], found[own.rows, 4] = state[:, 7], state[:, 8], state[:, 9]
        return self._to_base(found) if self._turned else found

    def outline(self, k: int, fraction: Any, stretch: Any) -> SectionRadii:
        """Return the radii of a segment at fractions of its length."""
        own, tables = self.stations[k], self.body.segments[k].tables
        there = {**own.model.numbers, **{key: np.interp(fraction, *table) for key, table in tables.items()}}
        return own.model.section.outline(there, stretch)
