"""The response of robots whose proportions vary: polynomials between finite-element solutions, for symbols.

A response depends on proportions alone, not on size. The solutions stand on the sparse grid of Chebyshev's points of
S. A. Smolyak, Doklady Akademii Nauk SSSR 148 (1963) 1042; one mesh is deformed to all of them, so that the noise of
meshing is in none of the differences.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations, product
from typing import Any

import casadi as ca
import numpy as np
from scipy.sparse import csc_array
from scipy.sparse.linalg import splu

from softnlp.model.robot import Robot
from softnlp.rings.curve import Curve, fitted, nodes
from softnlp.rings.elements import elements
from softnlp.rings.mesher import Mesh, mesh
from softnlp.rings.outline import Array, Circle, PlaneSection, RingError, of_robot
from softnlp.rings.response import RingResponse, response_on

PROPORTIONS = ("ring", "lumen", "circle", "angle")
"""r_co / r_cp, r_i / r_r, r_cp / r_r and alpha_1 [rad]."""
STRETCHES = (0.8, 2.5)
_NODES, _ORDER = 8, 5  # of each solution
_CHECKS = 3  # solutions inside that the polynomials have not seen


def proportions(robot: Robot) -> dict[str, Any]:
    """Return the `PROPORTIONS` of a robot of numbers or symbols."""
    r_cp, r_r = robot.chamber_circle_radius, robot.outer_radius
    shares = (robot.chamber_radius / r_cp, robot.lumen_radius / r_r, r_cp / r_r, robot.chamber_angle)
    return dict(zip(PROPORTIONS, shares, strict=True))


def ranges(robot: Robot, dimensions: Mapping[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
    """Return the ranges of the proportions that dimensions of a robot lead through.

    dimensions : by `Robot` field, its least and its largest value [m, rad].
    """
    corners = []
    for corner in product(*dimensions.values()):
        changed: dict[str, Any] = dict(zip(dimensions, corner, strict=True))
        corners.append(proportions(replace(robot, **changed)))
    found = {name: [float(corner[name]) for corner in corners] for name in PROPORTIONS}
    return {name: (min(of), max(of)) for name, of in found.items() if max(of) - min(of) > 1e-12}


@dataclass(frozen=True)
class RingSurrogate:
    """Responses over ranges of proportions.

    Attributes
    ----------
    vary
        By proportion, (low, high).
    error
        Largest distance of an exponent from finite elements on a mesh of their own, at `_CHECKS` places within.
    centre
        The response in the middle of the ranges.
    """

    vary: Mapping[str, tuple[float, float]]
    error: float
    centre: RingResponse
    _terms: tuple[tuple[int, ...], ...]
    _weights: Array  # (terms, curves, coefficients)

    def at(self, robot: Robot) -> RingResponse:
        """Return the response of a robot; of one with symbols, its coefficients are expressions.

        Outside the ranges the polynomials go on; `margin` says where.
        """
        given = proportions(robot)
        chebyshev = []
        for name, (low, high) in self.vary.items():
            z = (2 * given[name] - low - high) / (high - low)
            chebyshev.append([1.0, z, 2 * z**2 - 1, 4 * z**3 - 3 * z, 8 * z**4 - 8 * z**2 + 1])
        basis = []
        for term in self._terms:
            value: Any = 1.0
            for k, order in enumerate(term):
                value = value * chebyshev[k][order] if order else value
            basis.append(value)
        curves = [
            Curve(
                tuple(sum(float(w) * b for w, b in zip(weights, basis, strict=True)) for weights in of.T),
                self.centre.low,
                self.centre.high,
            )
            for of in np.moveaxis(self._weights, 1, 0)
        ]
        return replace(
            self.centre, error=self.error, shear=curves[0], arms=tuple(curves[1::2]), turns=tuple(curves[2::2])
        )

    def margin(self, robot: Robot) -> Any:
        """Return how far a robot is within the ranges, of their half widths; negative outside, a number or symbol."""
        given = proportions(robot)
        least: Any = 1.0
        for name, (low, high) in self.vary.items():
            least = ca.fmin(least, 1 - ca.fabs((2 * given[name] - low - high) / (high - low)))
        return least


def ring_surrogate(
    robot: Robot,
    vary: Mapping[str, tuple[float, float]],
    stretches: tuple[float, float] = STRETCHES,
    level: int = 2,
) -> RingSurrogate:
    """Return polynomials of the response in the proportions that vary; kept in memory.

    Parameters
    ----------
    robot
        Of numbers: its other proportions stay, and its numbers of chambers.
    vary
        By name of `PROPORTIONS`, least and largest value; `ranges` finds them from dimensions.
    stretches
        Range around 1.
    level
        1: of second order in each proportion alone, from 1 + 2 p solutions for p proportions. 2: of fourth order in
        each and of second in each pair, from 1 + 2 p (p + 1).

    Returns
    -------
    RingSurrogate
        Over the stretches that all solutions reach.

    Raises
    ------
    RingError
        Where a robot of the grid cannot be meshed; the text names its proportions.
    """
    unknown = set(vary) - set(PROPORTIONS)
    if unknown or level not in (1, 2) or not all(low < high for low, high in vary.values()):
        raise RingError(f"expected level 1 or 2 and ranges (low, high) of {', '.join(PROPORTIONS)}, got {dict(vary)}")
    given = tuple((name, float(value)) for name, value in proportions(robot).items())
    boxes = tuple((name, (float(low), float(high))) for name, (low, high) in sorted(vary.items()))
    return _surrogate(given, boxes, robot.chamber_sets, robot.chambers_per_set, stretches, level)


@lru_cache(maxsize=32)
def _surrogate(
    given: tuple[tuple[str, float], ...],
    vary: tuple[tuple[str, tuple[float, float]], ...],
    sets: int,
    per_set: int,
    stretches: tuple[float, float],
    level: int,
) -> RingSurrogate:
    low, high = (np.array([box[k] for _, box in vary]) for k in (0, 1))

    def section(place: Array) -> PlaneSection:
        moved = dict(zip((name for name, _ in vary), (low + high + place * (high - low)) / 2, strict=True))
        shape = {**dict(given), **moved}
        wide = 2 * shape["circle"]
        round_ = Robot("", 2.0, 2 * shape["lumen"], wide, shape["ring"] * wide, 0.0, 1.0, sets, per_set, shape["angle"])
        try:
            return of_robot(round_)
        except RingError as error:
            named = ", ".join(f"{name} {value:.4g}" for name, value in shape.items())
            raise RingError(f"within the ranges, at {named}: {error.message}; narrow the ranges") from None

    places, terms = _grid(len(vary), level)
    sections = [section(place) for place in places]  # all are known to be there before the first is solved
    base = mesh(sections[0])
    solved = [response_on(of, deformed(base, sections[0], of), stretches, _NODES) for of in sections]
    ends = max(r.low for r in solved), min(r.high for r in solved)
    stops = "; ".join(sorted({r.stops for r in solved} - {""}))
    values = np.array([_coefficients(r, *ends) for r in solved])
    chebyshev = np.polynomial.chebyshev.chebvander(places, 4)  # (places, proportions, order)
    matrix = np.array([[np.prod([of[k, order] for k, order in enumerate(term)]) for term in terms] for of in chebyshev])
    weights = np.linalg.solve(matrix, values.reshape(len(places), -1)).reshape(len(terms), *values.shape[1:])
    made = RingSurrogate(dict(vary), 0.0, replace(solved[0], low=ends[0], high=ends[1], stops=stops), terms, weights)
    errors = [solved[0].error]
    for k in range(1, _CHECKS + 1):  # places of an additive sequence
        place = 2 * ((0.5 + k * np.sqrt(np.array([2.0, 3.0, 5.0, 7.0])[: len(vary)])) % 1) - 1
        own = section(place)
        seen = response_on(own, mesh(own), ends, _NODES)
        basis = np.array([np.prod([np.cos(o * np.arccos(z)) for o, z in zip(t, place, strict=True)]) for t in terms])
        at = nodes(*ends, 9)
        for mine, curve in zip(np.tensordot(basis, weights, 1), _curves(seen), strict=True):
            errors.append(float(np.abs(Curve(tuple(mine), *ends)(at) - curve(at)).max()))
    return replace(made, error=max(errors))


def _curves(response: RingResponse) -> list[Curve]:
    return [response.shear, *(c for pair in zip(response.arms, response.turns, strict=True) for c in pair)]


def _coefficients(response: RingResponse, low: float, high: float) -> Array:
    """Return (curves, coefficients) over a common range of stretch."""
    at = nodes(low, high, 2 * _NODES)
    return np.array([fitted(at, np.asarray(curve(at)), low, high, _ORDER).coefficients for curve in _curves(response)])


def _grid(count: int, level: int) -> tuple[Array, tuple[tuple[int, ...], ...]]:
    """Return as many places in [-1, 1]^count as products of Chebyshev polynomials, the middle first."""
    along = (-1.0, 1.0) if level == 1 else (-1.0, -(0.5**0.5), 0.5**0.5, 1.0)
    middle = np.zeros(count)
    places, terms = [middle], [(0,) * count]

    def put(**at: float) -> Any:
        return [at.get(f"_{k}", 0) for k in range(count)]

    for k in range(count):
        places += [np.array(put(**{f"_{k}": z})) for z in along]
        terms += [tuple(put(**{f"_{k}": order})) for order in range(1, len(along) + 1)]
    for a, b in combinations(range(count), 2) if level == 2 else ():
        places += [np.array(put(**{f"_{a}": y, f"_{b}": z})) for y, z in product((-1.0, 1.0), repeat=2)]
        terms += [tuple(put(**{f"_{a}": i, f"_{b}": j})) for i, j in product((1, 2), repeat=2)]
    return np.array(places), tuple(terms)


def deformed(base: Mesh, before: PlaneSection, after: PlaneSection) -> Mesh:
    """Return a mesh led to a section of other proportions, or a new one where its triangles would turn over.

    ln(r) and the angle of its nodes move as harmonic functions; nodes on outlines go with these, those on mirror
    lines along them.
    """
    places = base.nodes.copy()
    for loop, side in base.sides.items():
        if loop >= 0:
            old, new = before.loops[loop], after.loops[loop]
            assert isinstance(old, Circle)
            assert isinstance(new, Circle)
            places[side] = np.array(new.centre) + new.radius / old.radius * (base.nodes[side] - np.array(old.centre))
    polar = [np.column_stack([np.log(np.hypot(*of.T)), np.arctan2(of[:, 1], of[:, 0])]) for of in (base.nodes, places)]
    move = polar[1] - polar[0]
    el = elements(base)
    blocks = np.einsum("mq,mqni,mqki->mnk", el.weight, el.gradient, el.gradient)
    rows = np.broadcast_to(base.triangles[:, :, None], blocks.shape).ravel()
    columns = np.broadcast_to(base.triangles[:, None, :], blocks.shape).ravel()
    stiffness = csc_array((blocks.ravel(), (rows, columns)), shape=(len(places), len(places)))
    for axis in (0, 1):
        held = np.zeros(len(places), bool)
        for loop, side in base.sides.items():
            held[side] |= loop >= 0 or axis == 1
        inner = stiffness[~held]
        move[~held, axis] = splu(csc_array(inner[:, ~held])).solve(-(inner[:, held] @ move[held, axis]))
    r, angle = (polar[0] + move).T
    made = replace(base, nodes=np.exp(r)[:, None] * np.column_stack([np.cos(angle), np.sin(angle)]))
    return made if float(elements(made).weight.min()) > 0 else mesh(after)
