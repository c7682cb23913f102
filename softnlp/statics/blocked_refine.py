"""A blocked solution on finer grids: solved again at once, or by grids a little finer each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from softnlp.nlp.solver import Solution
from softnlp.statics.blocked_grid import Blocked, BlockedGrid, transferred, unjudged
from softnlp.statics.blocked_resume import LARGEST_JUMP
from softnlp.statics.free_shape import Free
from softnlp.statics.grid_size import MOST_INTERVALS
from softnlp.statics.pose import Mapped
from softnlp.statics.wall import Situation

Array = NDArray[np.float64]

_SAME = 0.05  # scaled change of a solution on a finer grid below which it is the same one
_CONTRACTION = 0.1  # share of a larger change that Newton's first step leaves where it is the same one as well
_SLOWLY = 2**0.25  # by what grids grow where a jump leads elsewhere, and its root where that does too
_FINE = 2e-3  # estimated error from which the jump is tried again


def examined(
    grid: BlockedGrid,
    solution: Solution,
    situation: Situation,
    pressed: Array,
    aside: tuple[float | None, tuple[float, float]],
    free: Free,
) -> Blocked:
    """Return a solution with its discretisation error. aside : slips and determinants, see `Blocked`."""
    position, rotation, force = grid.refinement(solution)
    found = unjudged(grid, solution, situation, pressed, aside, free)
    return replace(found, error=position, refinement_error=max(position, rotation / 5, force / 5))


def refined(
    found: Blocked, grid: BlockedGrid, p: Array, shape: Mapped, tolerance: float, plane: Array | None
) -> Blocked | None:
    """Return a solution solved again on a finer grid, or None where that leads elsewhere.

    A change that is not small has to be that of Newton's first step, and the determinant keeps its sign: the solution
    is then that which the coarse one belongs to, and the change its discretisation error.
    """
    guess = transferred(found, grid.case, shape)
    solution = grid.engine.solve(p, guess)
    moved = grid.distance(solution.x - guess)
    if not solution.holds(tolerance) or not moved <= LARGEST_JUMP:
        return None
    if moved > _SAME:
        if not grid.has_tangent or grid.distance(solution.x - grid.predicted(guess, p)) > _CONTRACTION * moved:
            return None
        if grid.determinants(solution, plane)[0] * found.determinants[0] <= 0:
            return None
    return examined(grid, solution, found.situation, found.pressed, (found.slips, found.determinants), found.free)


def stepwise(
    found: Blocked,
    grid: BlockedGrid,
    finer: Callable[[int], BlockedGrid],
    refine: Callable[[Blocked, BlockedGrid], Blocked | None],
) -> Blocked | None:
    """Return a solution on a finer grid, by way of grids between where it does not lead there at once, or None.

    finer : the grid of so many intervals, of the kind whose steps are cheap. refine : a solution on a grid.
    """
    at, ratio = refine(found, grid), _SLOWLY
    while at is None and found.grid.intervals * ratio < grid.intervals:
        size = round(found.grid.intervals * ratio)
        between = refine(found, finer(size)) if size > found.grid.intervals else None
        if between is not None:
            found = between
            if found.refinement_error <= _FINE or size * ratio >= grid.intervals:
                return refine(found, grid)
        elif ratio < _SLOWLY:
            return None
        else:
            ratio = ratio**0.5
    return at


def to_accuracy(
    found: Blocked,
    wanted: Callable[[float, int], int | None],
    refine: Callable[[Blocked, int], Blocked | None],
) -> tuple[Blocked, int]:
    """Return a solution on a grid that meets the accuracy, or on the finest that has it, and the iterations.

    wanted : the intervals for an error on so many, None where they do. refine : a solution on so many intervals.
    """
    spent = 0
    while found.grid.intervals < MOST_INTERVALS:
        intervals = wanted(found.refinement_error, found.grid.intervals)
        finer = None if intervals is None else refine(found, min(intervals, MOST_INTERVALS))
        if finer is None:
            break
        spent += finer.solution.iterations
        found = finer
    return found, spent
