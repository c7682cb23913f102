"""The weight W_L with which the paper's method gives a force that is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from softnlp import Loads
from softnlp.studies.blocked import BlockedSolver
from softnlp.studies.wall import standing_wall

Array = NDArray[np.float64]

_LOWEST, _HIGHEST = 0.03, 1.2  # of the weight given: where the search looks
_CLOSE = 2e-3  # of the weight


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

    The force grows with W_L from that of `free` until the branch folds, which may be before the force is reached.
    """
    from scipy.optimize import brentq

    start = solver.contact.weights.length
    assert start is not None

    def off(logarithm: float) -> float:
        found = force_at(with_length_weight(solver, start * np.exp(logarithm)), pressure)
        return min(found, 2 * force) / force - 1  # a force past a fold is too large

    low, high = np.log(_LOWEST), np.log(_HIGHEST)
    if off(low) > 0 or off(high) < 0:
        return float("nan")
    found = start * float(np.exp(brentq(off, low, high, xtol=_CLOSE)))
    return found if abs(off(np.log(found / start))) < 20 * _CLOSE else np.nan
