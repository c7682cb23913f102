"""The weight W_L with which the paper's method gives a force that is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from softnlp import Loads
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.wall import standing_wall

Array = NDArray[np.float64]

_FIRST = (0.03, 0.2)  # of the weight that is given: where the search begins
_HIGHEST = 2.0  # of it: where it gives up
_CLOSE = 5e-4  # of the force
_NARROW = 0.08  # of the square of the weight: a jump or a fold lies between
_TRIES = 20
ROUGH = 1e-3  # accuracy [L_0] that is enough to look for a weight


def with_length_weight(solver: BlockedSolver, length: float) -> BlockedSolver:
    """Return a solver of `weighted` with another W_L [1/m]."""
    return solver.with_contact(replace(solver.contact, weights=replace(solver.contact.weights, length=length)))


def force_at(solver: BlockedSolver, pressure: Array) -> float:
    """Return the force at a pressure (sets,) [Pa], followed from zero [N]; infinite past the end of its branch."""
    wall = standing_wall(solver.poses, solver.contact, pressure[None], Loads())
    step, _ = solver.solve(pressure, Loads(), wall)
    return step.contact.force if step.contact is not None and step.status.has_solution else np.inf


def length_weight_for(solver: BlockedSolver, pressure: Array, force: float) -> float:
    """Return the W_L [1/m] that gives a force at a pressure, the other weights as they are; NaN where none does.

    The force grows with W_L from that of `free`, at first as its square, until the branch folds, which may be before
    the force is reached. So this is a secant in the square, kept between weights that give too little and too much.
    """
    start = solver.contact.weights.length
    assert start is not None

    def at(square: float) -> float:
        return force_at(with_length_weight(solver, float(np.sqrt(square))), pressure)

    known = [((part * start) ** 2, at((part * start) ** 2)) for part in _FIRST]  # (square, force)
    if known[0][1] > force:
        return float("nan")
    low = max(square for square, f in known if f <= force)
    high, folds = min((square for square, f in known if f > force), default=(_HIGHEST * start) ** 2), False
    for _ in range(_TRIES):
        new = _secant([k for k in known if np.isfinite(k[1])][-2:], force)
        if not low < new < high:
            new = (low + high) / 2
        found = at(new)
        known.append((new, found))
        if abs(found / force - 1) < _CLOSE:
            return float(np.sqrt(new))
        if found < force:
            low = new
        else:
            high, folds = new, not np.isfinite(found)
        if folds and high - low < _NARROW * high:
            break
    return float("nan")


def _secant(points: list[tuple[float, float]], force: float) -> float:
    """Return where the line through two points (square, force) has a force; NaN where that is not to be had."""
    if len(points) < 2 or points[0][1] == points[1][1]:
        return float("nan")
    (a, f_a), (b, f_b) = points
    return b + (force - f_b) * (b - a) / (f_b - f_a)
