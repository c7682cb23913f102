"""The ladder of attempts at one pose on one grid: which first guesses and which paths, in which order.

Newton's method from the neighbour, then along the path from it, from the unloaded arc, with the loads applied after the
pressure, with the loads applied after part of the pressure; IPOPT last.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.model.quantities import LOADS
from softnlp.nlp.continuation import Followed, Path, around_folds, follow, straight_path
from softnlp.nlp.solver import Solution
from softnlp.statics.pose_grid import Grid

Array = NDArray[np.float64]
Values = Mapping[str, Any]

_PRESSURE_PARTS = (0.0, 0.5, 0.25, 0.75)
_ROUNDING = 1e-12  # of the length or of a load
_MOST_STEPS = 12  # of one try of Newton's method
_REFERENCE = 150  # what a try of IPOPT costs, in iterations of Newton's method


class Work:
    """What the attempts at one pose may still cost, over all its grids; in intervals of one iteration (see `Grid`)."""

    def __init__(self, most: float, kept_to_show: float = 0.0) -> None:
        self.left = most
        self._kept_to_show = kept_to_show

    @property
    def used_up(self) -> bool:
        """Whether nothing is left."""
        return self.left <= 0

    def iterations_left(self, grid: Grid) -> int:
        """Return how many iterations on a grid that is."""
        return max(int(self.left / grid.iteration_cost), 0)

    def newton_steps(self, grid: Grid) -> int:
        """Return how many steps one try of Newton's method may take, at least one."""
        return int(min(max((self.left + self._kept_to_show) / grid.iteration_cost, 1), _MOST_STEPS))

    def spend(self, grid: Grid, iterations: int) -> None:
        """Take off iterations on a grid, and one more for the step or the residual that told that an attempt ended."""
        self.left -= (iterations + 1) * grid.iteration_cost


@dataclass(frozen=True, eq=False)
class Neighbour:
    """A known solution of another pose, or of this one on another grid, on the grid of the goal.

    x : its unknowns. p : its fixed values. moved : x moved by what the unloaded arc moves between the two poses.
    """

    x: Array
    p: Array
    moved: Array
    stable: bool


@dataclass(frozen=True, eq=False)
class Goal:
    """A pose to reach on a grid. arc : x of the unloaded arc at given values; the first guess without a neighbour.

    last_by_ipopt : whether IPOPT may try what nothing else solves.
    """

    grid: Grid
    values: Values
    arc: Callable[[Values], Array]
    near: Neighbour | None
    last_by_ipopt: bool = True

    @property
    def is_loaded(self) -> bool:
        """Whether the shape is another than the arc."""
        return any(np.any(self.values[name]) for name in LOADS)

    @property
    def is_a_column(self) -> bool:
        """Whether nothing but rounding bends the robot: the arc is straight and every load is along it."""
        tip = self.arc(self.values)[self.grid.tip]
        loads = np.array([self.values[name] for name in LOADS], dtype=float)
        sideways = np.abs(loads[:, :2]).max(axis=1)
        straight = np.abs(tip[:2]).max() <= _ROUNDING
        return bool(straight and np.all(sideways <= _ROUNDING * np.abs(loads).max(axis=1)))


@dataclass(frozen=True, eq=False)
class Attempt:
    """How an attempt ended. iterations : of it alone.

    fraction : of the path, below 1 where it did not arrive. on_path : whether the solution was reached along a load
    path from a stable pose, as the robot reaches it.
    """

    solution: Solution
    fraction: float = 1.0
    on_path: bool = False


def from_near(goal: Goal, work: Work) -> Iterator[Attempt]:
    """Make the attempts from the neighbour that cost the least: Newton's method, where there is one."""
    grid, near = goal.grid, goal.near
    if near is None:
        return
    p = grid.problem.pack(goal.values)
    yield Attempt(grid.engine.solve(p, near.moved, work.newton_steps(grid)))
    if goal.is_loaded and np.any(near.p != p):
        yield Attempt(grid.engine.solve(p, near.x, work.newton_steps(grid)))


def attempts(goal: Goal, work: Work) -> Iterator[Attempt]:
    """Make one attempt after another; whoever asks for them takes their iterations off `work`."""
    grid, values, near = goal.grid, goal.values, goal.near
    p = grid.problem.pack(values)
    yield from from_near(goal, work)
    if near is not None and goal.is_loaded and np.any(near.p != p):
        yield _along_from_near(grid, near, p, work)
    arc = goal.arc(values)
    yield Attempt(grid.engine.solve(p, arc, work.newton_steps(grid)))
    if not goal.is_loaded:
        return  # the arc is the answer; a grid that does not show it is too coarse
    no_loads = {name: np.zeros(3) for name in LOADS}
    yield from _along(goal, [{**values, **no_loads}, values], work)
    for part in () if goal.is_a_column else _PRESSURE_PARTS:  # every path keeps a column straight
        partly = {**values, "pressure": part * values["pressure"]}
        yield from _along(goal, [{**partly, **no_loads}, partly, values], work)
    if goal.last_by_ipopt and work.iterations_left(grid) >= _REFERENCE:
        work.spend(grid, _REFERENCE)
        yield Attempt(grid.reference.solve(p, arc if near is None else near.moved))


def _along_from_near(grid: Grid, near: Neighbour, p: Array, work: Work) -> Attempt:
    """Follow the neighbour's solution along the straight line between its values and these."""

    def path(t: float) -> Array:
        return p if t >= 1.0 else near.p + t * (p - near.p)

    most = work.iterations_left(grid) // 4  # the other attempts shall have their turn
    followed = _follow(grid, path, near.x, most, (0.5, 1 / 64))
    spent = followed.iterations
    if not followed.arrived:
        return Attempt(replace(followed.solution, iterations=spent), followed.fraction)
    final = grid.engine.solve(p, followed.solution.x)
    return Attempt(replace(final, iterations=final.iterations + spent), on_path=near.stable)


def _along(goal: Goal, waypoints: list[Values], work: Work) -> Iterator[Attempt]:
    """Follow the solution along straight lines between values, the first of them unloaded.

    Where the branch turns back before the end the robot snaps through: the curve is followed around its folds, and
    every equilibrium at the end that it passes is offered.
    """
    grid = goal.grid
    problem = grid.problem
    x = goal.arc(waypoints[0])
    p_end = problem.pack(waypoints[-1])
    legs = len(waypoints) - 1
    spent = 0
    for k in range(legs):
        path = straight_path(problem, waypoints[k], waypoints[k + 1])
        left = work.iterations_left(grid) - spent
        followed = _follow(grid, path, x, left)
        spent += followed.iterations
        x = followed.solution.x
        if not followed.arrived:
            yield Attempt(replace(followed.solution, iterations=spent), (k + followed.fraction) / legs)
            if k == legs - 1:
                yield from _snapped(grid, path, followed.solution, followed.fraction, work)
            return
    final = grid.engine.solve(p_end, x)
    yield Attempt(replace(final, iterations=spent + final.iterations), on_path=True)


def _follow(
    grid: Grid, path: Path, start: Array, most: int, steps: tuple[float, float] = (1 / 8, 1 / 1024)
) -> Followed:
    """Follow a solution along a path within a number of iterations. steps : the first and the smallest."""
    return follow(
        grid.stepper,
        path,
        start,
        distance=grid.distance,
        most_iterations=most,
        first_step=steps[0],
        smallest_step=steps[1],
    )


def _snapped(grid: Grid, path: Path, start: Solution, fraction: float, work: Work) -> Iterator[Attempt]:
    """Follow the curve of solutions around its folds; offer what is found at the end of the path."""
    linear = grid.engine.linear
    assert linear is not None
    most = min(1500, work.iterations_left(grid))
    for x, iterations in around_folds(
        grid.stepper, linear, path, start, fraction, weight=grid.weight(start.x), most_solves=most
    ):
        if x is None:  # the last: the curve leads to no other end
            yield Attempt(replace(start, iterations=iterations), fraction)
        else:
            final = grid.engine.solve(path(1.0), x)
            yield Attempt(replace(final, iterations=final.iterations + iterations), on_path=True)
