"""The witness's blocked tip force: planar contact with a wall, the four closures, numpy and scipy only.

Unknowns are n(0), m(0), the wall's force F_b along x and, for `rigid`, the common chamber reaction T, in the full
three-dimensional state, from the equations as printed (Eqs. (14) to (18)). The equilibrium is followed from zero
pressure with the wall in place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi

import numpy as np
from scipy.optimize import least_squares
from witness import (
    NoConvergence,
    Scaled,
    arc_start,
    integrate,
    newton,
    scaled,
    solve_base,
    tip_imbalance,
)
from witness_section import REPRODUCTION, Array, Body, Choices, NoRoot, Rubber, Section, section

_UNKNOWN = (float("nan"), float("nan"))
CLOSURES = ("free", "weighted", "rigid", "compliant")


class Fold(ArithmeticError):
    """The branch followed from zero pressure could not be followed to this pressure; `reached` is the last fraction."""

    def __init__(self, reached: float) -> None:
        super().__init__(f"the branch ends at {reached:.4f} of the pressure")
        self.reached = reached


@dataclass(frozen=True)
class Weights:
    """W_n [1/N], W_m [1/(N m)], W_L [1/m], W_h [1/m] of the weighted closure; W_h None holds the wall exactly."""

    n: float = 1.0
    m: float = 1.0
    L: float = 1.0
    h: float | None = None


@dataclass(frozen=True)
class Wall:
    """The contact: offset h [m], tip cap L_t [m], the closure, k_c and weights."""

    closure: str = "compliant"
    h: float = 0.0
    L_t: float = 0.0
    k_c: float = 1.45
    weights: Weights = Weights()


@dataclass(frozen=True)
class Loads:
    """Dead loads in the plane: force [N], moment [N m], gravity [m/s^2], density [kg/m^3]."""

    tip_force: Sequence[float] = (0.0, 0.0, 0.0)
    tip_moment: Sequence[float] = (0.0, 0.0, 0.0)
    gravity: Sequence[float] = (0.0, 0.0, 0.0)
    density: float = 1070.0


@dataclass(frozen=True)
class Blocked:
    """A blocked robot in SI units. force >= 0. reaction : (N,) T_i [N]. e_n [N], e_m [N m] : (3,); e_L, e_h [m].

    free_lengths, lengths : (N,) [m]. base : n(0), m(0) (6,). x_contact : horizontal position of the contact point, and
    x_free of the free shape's. determinants : of the dimensionless Jacobian in the plane (0 at a fold) and out of it (0
    where the robot may slide sideways along the wall); nan without contact or for `weighted`.
    """

    force: float
    contact: bool
    reaction: Array
    free_lengths: Array
    lengths: Array
    tip_position: Array
    tip_rotation: Array
    e_n: Array
    e_m: Array
    e_L: float
    e_h: float
    x_contact: float
    x_free: float
    base: Array
    determinants: tuple[float, float]
    section: Section


class _Contact:
    """The equations at one pressure, dimensionless; columns are n(0), m(0), F_b (signed, along +x), T."""

    def __init__(self, sec: Section, problem: Scaled, wall: Wall, base: Array, free_tip: Array) -> None:
        self.sec, self.problem, self.wall, self.base = sec, problem, wall, base
        self.h, self.L_t = wall.h / problem.length, wall.L_t / problem.length
        self.free = free_tip[20:, 0]
        self.pressed = problem.sec.PA > 0
        self.x_free = float(self.contact_point(free_tip)[0, 0])

    def contact_point(self, tip: Array) -> Array:
        return tip[0:3] + self.L_t * tip[3:12].reshape(3, 3, -1)[:, 2]

    def reaction(self, tip: Array, T: Array) -> Array:
        """T_i (N, K)."""
        mask = self.pressed[:, None]
        if self.wall.closure == "rigid":
            return np.where(mask, T, 0.0)
        if self.wall.closure == "compliant":
            sec = self.problem.sec
            stiffness = self.wall.k_c * sec.E_t * pi * sec.r_co**2 / self.problem.force
            free = self.free[:, None]
            return np.where(mask, stiffness * (free - tip[20:]) / free, 0.0)
        return np.zeros_like(tip[20:])

    def errors(self, columns: Array, tip: Array) -> tuple[Array, Array, Array, Array]:
        """e_n (3, K), e_m (3, K), e_L (K,), e_h (K,) of the unknowns and the tip states they lead to."""
        F_b = columns[6]
        T = columns[7] if len(columns) > 7 else np.zeros_like(F_b)
        r = tip_imbalance(self.problem, tip, 1.0, self.reaction(tip, T))
        e3 = tip[3:12].reshape(3, 3, -1)[:, 2]
        e_n, e_m = r[:3].copy(), r[3:].copy()
        e_n[0] -= F_b
        # L_t e3 x (F_b, 0, 0) = L_t F_b (0, e3_z, -e3_y)
        e_m[1] -= self.L_t * F_b * e3[2]
        e_m[2] += self.L_t * F_b * e3[1]
        e_L = (self.free[self.pressed, None] - tip[20:][self.pressed]).sum(axis=0)
        return e_n, e_m, e_L, self.contact_point(tip)[0] - self.h

    def residual(self, columns: Array, rtol: float) -> Array:
        """Return the square system of `free`, `compliant` and `rigid`."""
        e_n, e_m, e_L, e_h = self.errors(columns, integrate(self.problem, columns[:6], rtol=rtol))
        rows = [e_n, e_m, e_h[None]]
        if self.wall.closure == "rigid":
            rows.append(e_L[None])
        return np.vstack(rows)

    def weighted(self, x: Array, rtol: float) -> Array:
        """Minimise the weighted squares from x (7,) over the unknowns in the plane; a hard e_h is a very large W_h.

        In the plane only: out of it the sum of squares has lower minima once the planar shape may slide sideways.
        """
        w, scale = self.wall.weights, self.problem
        W_n, W_m, W_L = w.n * scale.force, w.m * scale.moment, w.L * scale.length
        W_h = w.h * scale.length if w.h is not None else 1e5 * max(W_n, W_m, W_L)
        inside = [0, 2, 4, 6]

        def stacked(columns: Array) -> Array:
            full = np.zeros((7, columns.shape[1]))
            full[inside] = columns
            e_n, e_m, e_L, e_h = self.errors(full, integrate(self.problem, full[:6], rtol=rtol))
            return np.vstack([W_n * e_n, W_m * e_m, W_L * e_L[None], W_h * e_h[None]])

        def slopes(x: Array) -> Array:
            step = 1e-6 * np.maximum(1.0, np.abs(x))
            r = stacked(np.concatenate([x[:, None] + np.diag(step), x[:, None] - np.diag(step)], axis=1))
            return (r[:, :4] - r[:, 4:]) / (2 * step)

        found = least_squares(
            lambda x: stacked(x[:, None])[:, 0], x[inside], jac=slopes, method="lm", xtol=1e-12, ftol=1e-14, gtol=1e-14
        )
        if found.status <= 0:
            raise NoConvergence(found.message)
        y = np.zeros(7)
        y[inside] = found.x
        return y


def planar(body: Body, rubber: Rubber, pressures: Array, choices: Choices, loads: Loads) -> bool:
    """Whether the pressures and loads keep the robot in the plane y = 0 of the wall's normal."""
    sec = section(body, rubber, pressures, choices)
    out = [sec.M_P[0], loads.tip_force[1], loads.tip_moment[0], loads.tip_moment[2], loads.gravity[1]]
    return bool(np.abs(out).max() < 1e-9)


def follow(
    body: Body,
    rubber: Rubber,
    pressures: Sequence[float],
    fractions: Sequence[float],
    wall: Wall,
    *,
    choices: Choices = REPRODUCTION,
    loads: Loads = Loads(),
    first_step: float = 0.05,
    smallest_step: float = 1e-4,
    tolerance: float = 1e-10,
) -> list[Blocked]:
    """Follow the blocked robot from zero to `fractions` (rising, of `pressures` [Pa, one a set]); one result each.

    Raises
    ------
    Fold
        The branch could not be followed further, with steps down to `smallest_step`.
    """
    P = np.asarray(pressures, float)
    if not planar(body, rubber, P, choices, loads):
        raise ValueError("not planar")

    def at(fraction: float) -> _Contact:
        return _at(body, rubber, fraction * P, wall, choices, loads, rtol=tolerance / 100)

    contact = at(fractions[-1])
    side = float(np.sign(contact.x_free))  # where the free shape goes

    def unilateral(contact: _Contact) -> bool:
        return bool(side * (contact.x_free - contact.h) > 0)

    # every target ends a step, so `contact` is the target's when its result is made
    results: list[Blocked] = []
    # path points in SI: n(0), m(0), F_b, T
    done, before = (0.0, None), None
    step = first_step
    for target in fractions:
        if target == done[0]:
            contact = at(target)
        while done[0] < target:
            now = min(target, done[0] + step)
            contact = at(now)
            scale = _scale(contact)
            if not unilateral(contact):
                before, done = None, (now, None)
                continue
            if done[1] is None:
                x = np.concatenate([contact.base, [0.0, 0.0]])[: len(scale)]
            elif before is None or before[1] is None:
                x = done[1] / scale
            else:
                slope = (done[1] - before[1]) / (done[0] - before[0])
                x = (done[1] + (now - done[0]) * slope) / scale
            try:
                y, _ = _solve(contact, x, tolerance=1e-5, rtol=1e-7, most=5)
                if done[1] is not None and before is not None and np.abs(y - x).max() > 0.3 * max(1, np.abs(x).max()):
                    raise NoConvergence("far from the prediction")
            except (NoConvergence, np.linalg.LinAlgError):
                step /= 2
                if step < smallest_step:
                    raise Fold(done[0]) from None
                continue
            before, done = done, (now, y * scale)
            step = min(step * 1.4, first_step)
        results.append(_result(contact, done[1], side, tolerance))
    return results


def _at(body: Body, rubber: Rubber, P: Array, wall: Wall, choices: Choices, loads: Loads, *, rtol: float) -> _Contact:
    sec = section(body, rubber, P, choices)
    problem = scaled(sec, loads.tip_force, loads.tip_moment, loads.gravity, loads.density)
    base = arc_start(problem)
    if np.any(problem.f_e) or np.any(problem.F_e) or np.any(problem.M_e):
        base, _ = solve_base(problem)
    return _Contact(sec, problem, wall, base, integrate(problem, base[:, None], rtol=rtol))


def _scale(contact: _Contact) -> Array:
    force, moment = contact.problem.force, contact.problem.moment
    full = np.array([force] * 3 + [moment] * 3 + [force, force])
    return full if contact.wall.closure == "rigid" else full[:7]


def _solve(
    contact: _Contact, x: Array, *, tolerance: float, rtol: float, most: int
) -> tuple[Array, tuple[float, float]]:
    if contact.wall.closure == "weighted":
        return contact.weighted(x, rtol), _UNKNOWN
    y, J = newton(contact.residual, x, tolerance=tolerance, rtol=rtol, most=most)
    # n_y, m_x, m_z are the three unknowns and the three equations out of the plane, and do not couple with the others
    out = [1, 3, 5]
    inside = [k for k in range(len(y)) if k not in out]
    return y, (float(np.linalg.det(J[np.ix_(inside, inside)])), float(np.linalg.det(J[np.ix_(out, out)])))


def _result(contact: _Contact, point: Array | None, side: float, tolerance: float) -> Blocked:
    problem, scale, determinants = contact.problem, _scale(contact), _UNKNOWN
    x = np.concatenate([contact.base, [0.0, 0.0]])[: len(scale)]
    if point is not None:
        x, determinants = _solve(contact, point / scale, tolerance=tolerance, rtol=tolerance / 100, most=8)
        if side * x[6] > 0:  # the wall would have to pull
            x, point, determinants = np.concatenate([contact.base, [0.0, 0.0]])[: len(scale)], None, _UNKNOWN
    tip = integrate(problem, x[:6, None], rtol=tolerance / 100)
    T = contact.reaction(tip, x[7:8] if len(x) > 7 else np.zeros(1))[:, 0]
    e_n, e_m, e_L, e_h = (e[..., 0] for e in contact.errors(x[:, None], tip))
    length, force = problem.length, problem.force
    return Blocked(
        force=float(-side * x[6] * force) if point is not None else 0.0,
        contact=point is not None,
        reaction=T * force,
        free_lengths=contact.free * length,
        lengths=tip[20:, 0] * length,
        tip_position=tip[0:3, 0] * length,
        tip_rotation=tip[3:12, 0].reshape(3, 3),
        e_n=e_n * force,
        e_m=e_m * problem.moment,
        e_L=float(e_L) * length,
        e_h=float(e_h) * length,
        x_contact=float(contact.contact_point(tip)[0, 0]) * length,
        x_free=contact.x_free * length,
        base=x[:6] * scale[:6],
        determinants=determinants,
        section=contact.sec,
    )


__all__ = ["CLOSURES", "Blocked", "Fold", "Loads", "NoConvergence", "NoRoot", "Wall", "Weights", "follow", "planar"]
