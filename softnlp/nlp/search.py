"""Looking for the least value of a problem with IPOPT: where to begin, and in short steps where it is lost at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from softnlp.nlp.solver import Engine, Solution

Array = NDArray[np.float64]

_STEPS = 15
_SMALL = 1e-3  # a scaled quantity below this moves by parts of this
_MOST = 300  # iterations of all steps from all starts: what is found at all is found sooner
_NEAR = 0.2  # part by which a free quantity may move in one step


@dataclass(frozen=True, eq=False)
class Start:
    """Where a search begins: x of a problem at its fixed values p, and what solves it."""

    engine: Engine
    p: Array
    x: Array


def minima(starts: Sequence[Start], tolerance: float) -> list[Solution]:
    """Return where the starts lead; where none of them leads to a solution, behind these where they lead in steps.

    tolerance : within which equations and bounds hold at a solution.
    """
    found = [start.engine.solve(start.p, start.x) for start in starts]
    left = _MOST
    for start in starts if not any(solution.holds(tolerance) for solution in found) else ():
        found.append(in_steps(start, tolerance, left))
        left -= found[-1].iterations
    return found


def in_steps(start: Start, tolerance: float, most: int = _MOST) -> Solution:
    """Return where solves lead that keep the free quantities near the last solution: slower, and more robust.

    most : iterations, after which no step is begun but the first. Its residual is infinite where a bound of the last
    step still holds it.
    """
    x, n = start.x, start.engine.problem.free_size
    near, spent = _NEAR, 0
    for _ in range(_STEPS):
        size = np.maximum(np.abs(x[:n]), _SMALL)
        found = start.engine.solve(start.p, x, room=near * size)
        spent += found.iterations
        if not found.holds(tolerance):
            near /= 2
        elif np.all(np.abs(found.x[:n] - x[:n]) < 0.99 * near * size):
            return replace(found, iterations=spent)
        else:
            x = found.x
        if spent >= most:
            break
    return replace(found, residual=np.inf, iterations=spent)


def spread(lower: Array, upper: Array, count: int) -> Array:
    """Return points of a low-discrepancy sequence in a box, (count, d); the first is its middle.

    The additive recurrence with the powers of the root of g^(d+1) = g + 1, always the same.
    """
    d = lower.size
    g = 2.0
    for _ in range(64):
        g = (1 + g) ** (1 / (d + 1))
    step = g ** -np.arange(1, d + 1)
    unit = (0.5 + np.arange(count)[:, None] * step) % 1.0
    points: Array = lower + unit * (upper - lower)
    return points
