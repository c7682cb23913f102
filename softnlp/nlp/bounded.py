"""Least squares and least norm within linear limits, for a few unknowns: trust regions around an active-set step.

Knows no rod. A *measured* map gives residuals r (m,) and their exact Jacobian J (m, n) at z (n,); what J leaves out of
the second derivatives is measured by differences of J where residuals or multipliers stay large.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MET = 1e-11  # residual below which nothing is left to gain
_NOISE = 1e-11  # what round-off leaves in a residual
_STEPS = 60
_FIRST_RADIUS, _LARGEST_RADIUS, _LEAST_RADIUS = 0.3, 2.0, 1e-9
_DIFFERENCE = 1e-4
_AT_BOUND = 1e-11
_ENOUGH = 1e-8  # a step shorter than this has arrived


@dataclass(frozen=True, eq=False)
class Limits:
    """lower <= z <= upper and sum(z) <= largest_sum."""

    lower: Array
    upper: Array
    largest_sum: float

    def rows(self, z: Array, radius: float) -> tuple[Array, Array]:
        """Return A, b with A d <= b for steps d from z that stay within the limits and a box of this radius."""
        n = z.size
        A = np.vstack([np.eye(n), -np.eye(n), np.ones((1, n))])
        ahead, behind = np.minimum(self.upper - z, radius), np.minimum(z - self.lower, radius)
        return A, np.maximum(np.concatenate([ahead, behind, [self.largest_sum - z.sum()]]), 0.0)

    def clip(self, z: Array) -> Array:
        """Return z within the limits to the last bit, and on a bound where round-off leaves it beside one."""
        inside = np.where(z < self.lower + _AT_BOUND, self.lower, np.where(z > self.upper - _AT_BOUND, self.upper, z))
        excess = float(inside.sum()) - self.largest_sum
        if excess > 0:
            room = inside - self.lower
            inside = np.maximum(self.lower, inside - room * min(1.0, excess * (1 + 1e-12) / room.sum()))
        return inside


@dataclass(frozen=True, eq=False)
class Measured:
    """Residuals and Jacobian at z; `memo` is what the map needs to go on from here."""

    z: Array
    r: Array
    J: Array
    memo: Any

    @property
    def cost(self) -> float:
        """Half the sum of squares."""
        return float(self.r @ self.r) / 2


Map = Callable[[Array, Measured], Measured | None]
"""From z and a measured point nearby to the point at z; None where there is none."""


def quadratic_step(H: Array, g: Array, A: Array, b: Array, E: Array | None = None, start: Array | None = None) -> Array:
    """Return d that minimises d H d / 2 + g d with A d <= b and E d = E start, from a feasible start (0 by default).

    H : positive definite. The primal active-set method; b is not negative.
    """
    n = g.size
    d = np.zeros(n) if start is None else start.copy()
    fixed = np.zeros((0, n)) if E is None else E
    active: list[int] = []
    for _ in range(20 * (n + 1)):
        C = np.vstack([fixed, A[active]])
        K = np.block([[H, C.T], [C, np.zeros((len(C), len(C)))]])
        solved = np.linalg.lstsq(K, np.concatenate([-(H @ d + g), np.zeros(len(C))]), rcond=None)[0]
        p, multipliers = solved[:n], solved[n + len(fixed) :]
        if np.max(np.abs(p)) <= 1e-13 * (1 + np.max(np.abs(d))):
            if not active or np.min(multipliers) >= -1e-12 * (1 + np.max(np.abs(g))):
                break
            del active[int(np.argmin(multipliers))]
            continue
        slope, room = A @ p, np.maximum(b - A @ d, 0.0)
        blocking = [k for k in range(len(b)) if k not in active and slope[k] > 1e-14]
        length, hit = 1.0, None
        for k in blocking:
            if room[k] / slope[k] < length:
                length, hit = float(room[k] / slope[k]), k
        d = d + length * p
        if hit is not None:
            active.append(hit)
    return d


def curvature(measure: Map, here: Measured, weights: Array, limits: Limits) -> Array:
    """Return the sum of weights times second derivatives of r, by differences of J; 0 where the map ends."""
    n = here.z.size
    S = np.zeros((n, n))
    for j in range(n):
        h = _DIFFERENCE if here.z[j] + _DIFFERENCE <= limits.upper[j] else -_DIFFERENCE
        there = measure(here.z + h * np.eye(n)[j], here)
        if there is None:
            return np.zeros((n, n))
        S[:, j] = (there.J - here.J).T @ weights / h
    symmetric: Array = (S + S.T) / 2
    return symmetric


def could_gain(here: Measured, limits: Limits, *, meets: bool) -> float:
    """Return what the first-order conditions leave at a point, evaluated anew: 0 at an optimum.

    It is the longest step by which a plain quadratic model with the true gradient would move within the limits: that
    of |z|^2 / 2 along r = 0 where the target is met, over the size of z; else that of |r| along the scaled pressures.
    """
    n = here.z.size
    A, b = limits.rows(here.z, 1.0)
    if meets:
        step, size = quadratic_step(np.eye(n), here.z, A, b, here.J), max(1.0, float(np.max(np.abs(here.z))))
    else:
        size = max(float(np.linalg.norm(here.J, 2) * np.linalg.norm(here.r)), MET)
        step, size = quadratic_step(np.eye(n), here.J.T @ here.r / size, A, b), 1.0
    return float(np.max(np.abs(step), initial=0.0)) / size


def _definite(H: Array) -> Array:
    """Return H with its negative curvatures turned, and none of them 0."""
    sizes, axes = np.linalg.eigh(H)
    least = 1e-10 * max(float(np.max(np.abs(sizes))), 1e-12)
    made: Array = (axes * np.maximum(np.abs(sizes), least)) @ axes.T
    return made


def nearest(measure: Map, start: Measured, limits: Limits, second: Array | None = None) -> tuple[Measured, Array]:
    """Return the point of least sum of squares near a start, and the curvature of its residuals there (n, n).

    second : that curvature, taken as it is. None: measured where the residuals stay large, else 0.
    """
    here, radius, slow = start, _FIRST_RADIUS, False
    S = np.zeros((start.z.size, start.z.size)) if second is None else second
    for _ in range(_STEPS):
        size = float(np.linalg.norm(here.r))
        if size <= MET:
            break
        if second is None and slow and size > 1e-4:
            S = curvature(measure, here, here.r, limits)
        g = here.J.T @ here.r
        H = _definite(here.J.T @ here.J + S)
        d = quadratic_step(H, g, *limits.rows(here.z, radius))
        predicted = -float(g @ d + d @ H @ d / 2)
        length = float(np.max(np.abs(d)))
        if predicted <= 0.01 * _NOISE * size or length < 1e-12:
            break
        there = measure(limits.clip(here.z + d), here)
        gained = -np.inf if there is None else here.cost - there.cost
        # Where the target can be met, Gauss and Newton's steps soon leave little; where not, they need the curvature.
        slow = length < 0.9 * radius and gained < 0.75 * here.cost
        if there is not None and gained > 1e-4 * predicted:
            here = there
            if gained > 0.75 * predicted and length > 0.9 * radius:
                radius = min(2 * radius, _LARGEST_RADIUS)
        if gained < 0.25 * predicted:
            radius = length / 4
        if radius < _LEAST_RADIUS:
            break
    return here, S


def least_norm(measure: Map, start: Measured, limits: Limits, second: Array | None = None) -> tuple[Measured, Array]:
    """Return the point of least |z| that keeps r = 0, near a start that has r = 0; otherwise as `nearest`.

    J must have full row rank. second : of the residuals weighed by their multipliers.
    """
    here, radius = start, _FIRST_RADIUS
    n = here.z.size
    S = np.zeros((n, n)) if second is None else second
    multipliers: Array = np.zeros(here.r.size)
    for _ in range(_STEPS):
        if second is None and np.any(multipliers):
            S = curvature(measure, here, multipliers, limits)
        A, b = limits.rows(here.z, radius)
        back = quadratic_step(_definite(here.J.T @ here.J), here.J.T @ here.r, A, b)
        H = _definite(np.eye(n) + S)
        d = quadratic_step(H, here.z, A, b, here.J, back)
        # Limits that hold d take their share of the gradient, so only free directions tell the multipliers.
        free = (A @ d < b - 1e-12)[: 2 * n].reshape(2, n).all(axis=0)
        gradient = here.z + H @ d
        multipliers = np.asarray(np.linalg.lstsq(here.J[:, free].T, -gradient[free], rcond=None)[0], dtype=float)
        length = float(np.max(np.abs(d)))
        if length < _ENOUGH:
            break
        there = measure(limits.clip(here.z + d), here)
        weight = 2 * float(np.max(np.abs(multipliers), initial=0.0)) + 1.0

        def merit(point: Measured, weight: float = weight) -> float:
            return float(point.z @ point.z) / 2 + weight * float(np.sum(np.abs(point.r)))

        if there is not None and merit(there) < merit(here) + 1e-14:
            here = there
            radius = min(1.5 * radius, _LARGEST_RADIUS) if length > 0.9 * radius else radius
        else:
            radius = length / 4
    return here, S
