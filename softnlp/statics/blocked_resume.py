"""Going on with a branch on another grid, from a point before the place where one lost it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softnlp.nlp.solver import Solution
from softnlp.statics.blocked_grid import Blocked, BlockedGrid, transferred, unjudged
from softnlp.statics.free_shape import Free
from softnlp.statics.pose import Mapped
from softnlp.statics.wall import Situation

Array = NDArray[np.float64]
Trace = list[tuple[float, tuple[float, float]]]
"""Fractions of the way, and the determinants in and out of the plane there."""

LARGEST_JUMP = 0.3
"""Between points of a branch, in scaled positions and direction cosines."""
MOST_STEPS = 5
"""To a point of a path; what takes more leads off it."""
_BACK = 0.9  # of where a grid lost the branch: the next one goes on from there


@dataclass(frozen=True, eq=False)
class Reached:
    """A point of a branch: the fraction of the way, its solution, the determinants up to there and the last step.

    sound : the same for the last point that was far from a fold, where the error of a shape is its own.
    """

    fraction: float
    solution: Blocked
    trace: Trace
    step: float
    sound: tuple[float, Blocked] | None = None


@dataclass(frozen=True, eq=False)
class Ended:
    """Where a branch was lost, whether it had turned, the iterations, the error there and whether work ran out.

    before : a point well before that, from which a finer grid may go on. fraction : of the way, where it was lost.
    """

    situation: Situation
    folded: bool
    iterations: int
    error: float = 0.0
    stopped: bool = False
    before: Reached | None = None
    fraction: float = 0.0


def point_before(
    grid: BlockedGrid,
    trace: Trace,
    points: list[Solution | None],
    sound: list[tuple[float, Solution]],
    lost: float,
    way: tuple[Situation, Situation],
    pressed: Array,
    free: Free,
) -> Reached | None:
    """Return the last point of a branch that is well before a fraction where it is lost; None where there is none.

    points : of the trace, None where they are of another grid. way : from where to where.
    """
    known = [k for k, (u, _) in enumerate(trace) if k and u <= _BACK * lost and points[k - 1] is not None]
    if not known or grid.is_minimum:
        return None
    k = known[-1]
    (u, determinants), solution = trace[k], points[k]
    assert solution is not None

    def at(u: float, solution: Solution) -> Blocked:
        return unjudged(grid, solution, way[0].towards(way[1], u), pressed, (None, determinants), free)

    far = sound[-1] if sound else None
    return Reached(u, at(u, solution), trace[: k + 1], u - trace[k - 1][0], far and (far[0], at(*far)))


def sound_error(
    grid: BlockedGrid,
    shape: Mapped,
    path: Callable[[float], Array],
    sound: list[tuple[float, Solution]],
    before: Reached | None,
) -> float:
    """Return the error of the last shape that was far from a fold; 1 where none is known.

    It is one of this grid, or that of the grid before, solved again on this one.
    """
    if sound:
        return max(grid.refinement(sound[-1][1]))
    if before is None or before.sound is None:
        return 1.0
    u, there = before.sound
    x = transferred(there, grid.case, shape)
    again = grid.stepper.solve(path(u), x, MOST_STEPS)
    if not again.holds(10 * grid.stepper.tolerance) or not grid.distance(again.x - x) <= LARGEST_JUMP:
        return 1.0
    return max(grid.refinement(again))


def resumed(
    grid: BlockedGrid, shape: Mapped, path: Callable[[float], Array], plane: Array | None, before: Reached | None
) -> Solution | None:
    """Return the point of a branch that another grid came to; None where this grid has it not, or elsewhere.

    shape : between nodes. path : the values at a fraction of the way.
    """
    if before is None or grid.is_minimum:
        return None
    for u, _ in before.trace:  # each free shape is found from the last
        path(u)
    x = transferred(before.solution, grid.case, shape)
    begun = grid.stepper.solve(path(before.fraction), x, MOST_STEPS)
    if not begun.holds(10 * grid.stepper.tolerance) or not grid.distance(begun.x - x) <= LARGEST_JUMP:
        return None
    same = grid.determinants(begun, plane)[0] * before.solution.determinants[0] > 0
    return begun if same else None
