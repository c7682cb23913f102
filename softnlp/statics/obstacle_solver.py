"""Solving one pose after another among obstacles: the path there, sharper contact, nodes at contacts, finer grids."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.status import Status
from softnlp.base.units import MILLIMETRE
from softnlp.model.obstacles import Obstacle
from softnlp.model.rod import STATE_SIZE, Loads
from softnlp.model.segments import SegmentedRobot
from softnlp.nlp.continuation import around_folds, follow
from softnlp.nlp.solver import Solution, discretisation_correction
from softnlp.statics.closing import DisputedError, closed
from softnlp.statics.obstacle_grid import SHARP, ObstacleGrid, Touched, compiled_obstacles, sharpened, touched
from softnlp.statics.obstacle_nodes import deepest, fewest_touching, halved, regraded, resampled
from softnlp.statics.obstacle_step import OVERLAP, is_minimum, names_of, obstacle_step
from softnlp.statics.obstructed import SMOOTHING, STEPS
from softnlp.statics.solver import PoseSolver
from softnlp.statics.step import Step

Array = NDArray[np.float64]

_FIRST, _FINEST = 20, 320  # intervals
_FEWEST = 4
_REST, _TOUCHING = 400, 1e-9  # points of the unpressurised robot that are looked at, and the overlap that counts
_PATH_TAU = 1e-2  # tau along a path: a gap of 6 um under a push of 1/100
_SHARPER, _LEAST_SHARPER = 0.01, 0.8  # by what tau falls at once, and at least
_LARGEST_JUMP = 0.1  # between points of a path, in scaled positions and direction cosines
_SMALLEST_STEP = 1 / 1024
_THROUGH = 5e-3  # of L_0: an overlap half-way between two points of a path from which that went through an obstacle
_AROUND: dict[str, Any] = {"first_step": 0.02, "largest_step": 0.2}
_MOST_AROUND, _ONWARDS = 400, 5e-3  # solves around one fold, and how far beyond it the path is taken again
_MOST = 1500  # iterations to find one pose
_PASSES, _ENOUGH = 3, 6  # of putting nodes where obstacles touch, and how many are to be there
_SETTLED = 0.2  # of the accuracy: a tip that moves by less when nodes are placed anew stays where it is
_STEEPER = 4.0  # growth of what a step changes from which a path that ends has turned
_ORDER = 2  # of the tip's error, since pushes are those of nodes


def among_obstacles(poses: PoseSolver, obstacles: Sequence[Obstacle]) -> ObstacleSolver:
    """Return a solver of poses among obstacles.

    Raises
    ------
    InputError
        For a robot of several segments, another transcription than multiple shooting, two obstacles of one name, and a
        robot that overlaps one at rest.
    """
    if isinstance(poses.model.robot, SegmentedRobot):
        raise InputError("a robot of several segments, or one that varies along s, takes none so far", table="obstacle")
    if poses.numerics.transcription != "multiple-shooting":
        raise InputError('obstacles are solved by "multiple-shooting" only', table="solver", key="transcription")
    if (given := poses.numerics.intervals) is not None and given < _FEWEST:
        raise InputError(f"obstacles take at least {_FEWEST}, got {given}", table="solver", key="intervals")
    names = names_of(obstacles)
    for k, name in enumerate(names):
        if name in names[:k]:
            raise InputError(f"two obstacles are called {name!r}", table=f"obstacle.{k + 1}", key="name")
    solver = ObstacleSolver(poses, obstacles)
    for k, (name, deep) in enumerate(zip(names, solver.overlaps_at_rest(), strict=True)):
        if deep > 0:
            text = f"the robot overlaps {name} by {deep / MILLIMETRE:.3g} mm at rest; move the obstacle away"
            raise InputError(text, table=f"obstacle.{k + 1}")
    return solver


@dataclass(frozen=True, eq=False)
class _Path:
    """The straight way between two columns of values, or the end of it."""

    first: Array
    last: Array
    start: float = 0.0

    def __call__(self, t: float) -> Array:
        whole = self.of_whole(t)
        return self.last if t == 1.0 else self.first + whole * (self.last - self.first)

    def of_whole(self, t: float) -> float:
        """Return the fraction of the whole at one of what is left."""
        return self.start + t * (1.0 - self.start)

    def after(self, start: float) -> _Path:
        """Return what is left from a fraction on."""
        return replace(self, start=start)


@dataclass(frozen=True, eq=False)
class _Way:
    """Where following a path ended. fraction : of the whole. turned : whether changes grew as before a fold."""

    solution: Solution
    fraction: float
    iterations: int
    arrived: bool
    turned: bool


class ObstacleSolver:
    """Solves poses of one model among obstacles; compiled grids are kept between poses.

    poses : of the same model without obstacles. obstacles : at least one.
    """

    def __init__(self, poses: PoseSolver, obstacles: Sequence[Obstacle]) -> None:
        self.poses, self.obstacles = poses, tuple(obstacles)
        self.numerics = poses.numerics

    def grid(self, intervals: int) -> ObstacleGrid:
        """Return what is compiled for so many intervals."""
        kinds = tuple((o.kind, o.part) for o in self.obstacles)
        key = ("obstacles", kinds, intervals, self.numerics.engine, self.numerics.ipopt)
        equations = self.poses.equations
        return equations.kept(key, lambda: compiled_obstacles(equations, self.numerics, self.obstacles, intervals))

    def values(self, pressure: Array, loads: Loads, s: Array) -> dict[str, Any]:
        """Return the quantities of a pose with nodes s (K + 1,)."""
        own = {f"obstacle.{j + 1}": o.numbers for j, o in enumerate(self.obstacles)}
        return {**self.poses.values(pressure, loads), **own, SMOOTHING: _PATH_TAU, STEPS: np.diff(s)}

    def overlaps_at_rest(self) -> list[float]:
        """Return how deep the unpressurised robot is in each obstacle, 0 where it is not [m]."""
        s = np.linspace(0, 1, _REST + 1)
        grid = self.grid(_FIRST)
        values = self.poses.values(np.zeros(self.poses.model.sets), Loads())
        column = self.poses.column(values)
        straight = np.asarray(self.poses.functions.arc(column, 1.0, s[None, :]))[:, 1:]
        nodes = np.zeros((STATE_SIZE, _FIRST + 1))
        p = grid.problem.pack(self.values(np.zeros(self.poses.model.sets), Loads(), np.linspace(0, 1, _FIRST + 1)))
        count = len(self.obstacles)
        _, radius, numbers = grid.taken(grid.packed(1.0, nodes, np.zeros((count, _FIRST + 1))), p)
        _, gaps = grid.case.touching.at(straight, np.zeros((count, _REST)), radius, numbers)
        L_0 = float(np.asarray(grid.problem.units(np.ones(grid.problem.nlp["x"].numel()), p)).ravel()[0])
        least = [np.min(own) if o.part == "body" else own[-1] for o, own in zip(self.obstacles, gaps, strict=True)]
        return [max(0.0, -float(gap)) * L_0 if gap < -_TOUCHING else 0.0 for gap in least]

    def solve(self, pressure: Array, loads: Loads, near: Touched | None = None) -> tuple[Step, Touched | None]:
        """Solve one pose, followed from a neighbouring one or from the unpressurised shape.

        pressure : (sets,) [Pa], not negative. Never raises for a pose that cannot be solved.
        """
        began = time.perf_counter()
        pressure = np.asarray(pressure, dtype=float)
        branch = self.poses.branch_at(self.poses.values(pressure, loads))
        if branch.status is not Status.SOLVED:
            return Step(pressure, branch.status, branch.message, solve_time=time.perf_counter() - began), None
        first = self.numerics.intervals or _FIRST
        grids = [first] if self.numerics.intervals else [first, 2 * first, 4 * first]
        best: tuple[int, Touched, float] | None = None
        spent, reached, turned = 0, 0.0, False
        for intervals, start in ((k, start) for k in grids for start in ([near, None] if near else [None])):
            rough, more, came, folded = self._followed(pressure, loads, start, intervals, _MOST - spent)
            spent, reached, turned = spent + more, max(reached, came), turned or folded
            if rough is not None:
                refined, more, error = self._refined(rough)
                spent += more
                flaws = int(not self._fits(refined, error))
                flaws += int(refined.snapped and not is_minimum(self.poses, refined))
                if best is None or flaws < best[0]:
                    best = flaws, refined, error
            if spent >= _MOST or (best is not None and not best[0]):
                break
        if best is None:
            status = Status.FOLD if turned else Status.DIVERGED
            message = f"{status.advice}; among the obstacles continuation came {100 * reached:.3g} % of the way"
            seconds = time.perf_counter() - began
            return Step(pressure, status, message, iterations=spent, solve_time=seconds), None
        _, found, error = best
        try:
            solution = closed(found.grid.reference, found.solution, self.numerics, found.grid.tip)
        except DisputedError as disputed:
            seconds = time.perf_counter() - began
            return Step(pressure, Status.DISPUTED, str(disputed), iterations=spent, solve_time=seconds), None
        if solution is not found.solution:
            found = replace(touched(found.grid, solution, found.values), snapped=found.snapped)
        if not found.solution.holds(self.numerics.tolerance):
            seconds = time.perf_counter() - began
            message = Status.DIVERGED.advice
            return Step(pressure, Status.DIVERGED, message, iterations=spent, solve_time=seconds), None
        step = obstacle_step(self.poses, self.obstacles, pressure, loads, found, error, spent, began)
        if not self._fits(found, error):
            deep = -min(contact.gap for contact in step.contacts)
            message = f"{Status.INACCURATE.advice}; with {found.grid.intervals} intervals the body is"
            message += f" {max(deep, 0.0) / MILLIMETRE:.2g} mm inside an obstacle between nodes"
            status = Status.INACCURATE
            return Step(
                pressure, status, message, residual=step.residual, iterations=spent, solve_time=step.solve_time
            ), None
        return step, found

    def _fits(self, found: Touched, error: float) -> bool:
        """Whether a solution is as accurate as it has to be, and outside of obstacles between nodes as well."""
        outside = self.numerics.intervals is not None or deepest(self.poses.shape, found) * found.units[0] <= OVERLAP
        return bool(np.isfinite(error)) and outside

    def _followed(
        self, pressure: Array, loads: Loads, near: Touched | None, intervals: int, most: int
    ) -> tuple[Touched | None, int, float, bool]:
        """Follow the branch from a neighbour or from rest; also the iterations, how far it came, and if it turned.

        most : iterations after which it is given up.
        """
        grid, s = self.grid(intervals), np.linspace(0, 1, intervals + 1)
        shape = self.poses.shape
        end = self.values(pressure, loads, s)
        if near is None:
            begin = self.values(np.zeros_like(pressure), Loads(), s)
            column = self.poses.column(begin)
            straight = np.asarray(self.poses.functions.arc(column, 1.0, s[None, :]))
            x = grid.packed(1.0, straight, np.zeros((len(self.obstacles), s.size)))
        else:
            begin = {**near.values, STEPS: np.diff(s), SMOOTHING: _PATH_TAU}
            x = resampled(shape, near, grid, s)
        a, b = grid.problem.pack(begin), grid.problem.pack(end)
        way = self._way(grid, _Path(a, b), x, 0.5 if near is not None else 0.25, most)
        spent, snapped = way.iterations, False
        while not way.arrived and spent < most:
            beyond, more = self._beyond(grid, _Path(a, b), way, most - spent)
            spent += more
            if beyond is None:
                break
            way, snapped = beyond, True
        if not way.arrived:
            return None, spent, way.fraction, way.turned
        found, more = self._sharp(grid, way.solution.x, end)
        spent += more
        return None if found is None else replace(found, snapped=snapped), spent, 1.0, False

    def _way(self, grid: ObstacleGrid, path: _Path, x: Array, first_step: float, most: int) -> _Way:
        """Follow a path by steps of its fraction from a guess at its beginning."""
        points: list[tuple[float, Array]] = []

        def passed(t: float, solution: Solution) -> bool:
            if points and self._through(grid, points[-1][1], solution):
                return False
            points.append((t, solution.x))
            return True

        started = grid.stepper.solve(path(0.0), x)
        if not started.holds(10 * grid.stepper.tolerance):
            return _Way(started, path.start, started.iterations, False, False)
        passed(0.0, started)
        way = follow(
            grid.stepper,
            path,
            started.x,
            distance=grid.distance,
            first_step=first_step,
            smallest_step=_SMALLEST_STEP,
            largest_jump=_LARGEST_JUMP,
            same_branch=passed,
            most_iterations=most,
        )
        spent, reached = started.iterations + way.iterations, path.of_whole(way.fraction)
        rates = [grid.distance(b[1] - a[1]) / (b[0] - a[0]) for a, b in pairwise(points) if b[0] > a[0]]
        turned = len(rates) > 2 and rates[-1] > _STEEPER * float(np.median(rates))
        return _Way(way.solution, reached, spent, way.arrived, turned)

    def _sharp(self, grid: ObstacleGrid, x: Array, values: dict[str, Any]) -> tuple[Touched | None, int]:
        """Solve with less and less smoothing, and return the solution, None where one is lost, and the iterations."""
        spent, tau, ratio = 0, _PATH_TAU, _SHARPER
        while True:
            following = max(tau * ratio, SHARP)
            solution = grid.engine.solve(grid.problem.pack(sharpened(values, following)), x)
            spent += solution.iterations
            if solution.holds(self.numerics.tolerance):
                tau, x = following, solution.x
                if tau <= 1.01 * SHARP:  # but for round-off
                    return touched(grid, solution, sharpened(values, SHARP)), spent
            else:
                ratio = ratio**0.5
                if ratio > _LEAST_SHARPER:
                    return None, spent

    def _beyond(self, grid: ObstacleGrid, path: _Path, way: _Way, most: int) -> tuple[_Way | None, int]:
        """Go on around the fold at which a path ended, to where it goes forward again; None where it does not."""
        if grid.stepper.linear is None or not way.solution.holds(10 * grid.stepper.tolerance):
            return None, 0
        weight = np.zeros(way.solution.x.size)
        states = np.zeros((grid.intervals + 1, STATE_SIZE))
        states[:, :12] = 1.0 / len(states)
        weight[1 : 1 + states.size] = states.ravel()
        spent, onwards = 0, min(way.fraction + _ONWARDS, 1.0)
        passages = around_folds(
            grid.stepper,
            grid.stepper.linear,
            path,
            way.solution,
            way.fraction,
            weight=weight,
            target=onwards,
            most_solves=min(most, _MOST_AROUND),
            **_AROUND,
        )
        for x, more in passages:
            spent += more
            if x is None:
                break
            further = self._way(grid, path.after(onwards), x, 0.1, most - spent)
            spent += further.iterations
            if further.fraction > onwards + _ONWARDS or further.arrived:
                return further, spent
        return None, spent

    def _through(self, grid: ObstacleGrid, before: Array, solution: Solution) -> bool:
        """Whether half-way between two points of a path the robot is inside an obstacle: it went through it."""
        K, count = grid.intervals, len(self.obstacles)
        _, radius, numbers = grid.taken(solution.x, solution.p)
        a, b = grid.nodes(before), grid.nodes(solution.x)
        for t in (0.25, 0.5, 0.75):
            _, gaps = grid.case.touching.at(a + t * (b - a), np.zeros((count, K + 1)), radius, numbers)
            for j, obstacle in enumerate(self.obstacles):
                own = gaps[j, 1:] if obstacle.part == "body" else gaps[j, -1:]
                if np.min(own) < -_THROUGH:
                    return True
        return False

    def _refined(self, found: Touched) -> tuple[Touched, int, float]:
        """Put nodes where obstacles touch and refine until the accuracy is met; also the iterations and the error."""
        accuracy, given = self.numerics.accuracy, self.numerics.intervals is not None
        found, spent = self._graded(found, found.grid.intervals)
        error = self._own_error(found)
        if not found.active.any() and (given or error <= accuracy):
            return found, spent, error
        while True:
            finer, more = self._graded(found, 2 * found.grid.intervals)
            spent += more
            if finer is found:
                return found, spent, error if given or not found.active.any() else float("inf")
            change = float(np.linalg.norm(finer.before[:3, -1] - found.before[:3, -1]))
            if given:
                return found, spent, max(error, change * 2**_ORDER / (2**_ORDER - 1))
            found, error = finer, max(self._own_error(finer), change / (2**_ORDER - 1))
            if (error <= accuracy and self._fits(found, error)) or 2 * found.grid.intervals > _FINEST:
                return found, spent, error

    def _graded(self, found: Touched, intervals: int) -> tuple[Touched, int]:
        """Return a solution on so many intervals, half of them where it touches, and the iterations.

        Where no such grid leads to the same pose the one that was given comes back.
        """
        spent = 0
        for _ in range(_PASSES):
            if not found.active.any() and found.grid.intervals == intervals:
                break
            grid = self.grid(intervals)
            trial = self._on(grid, found, regraded(self.poses.shape, found, intervals))
            if trial is None and intervals > found.grid.intervals:
                trial = self._on(grid, found, halved(found))
            if trial is None:
                break
            same = trial.grid is found.grid
            moved = float(np.linalg.norm(trial.before[:3, -1] - found.before[:3, -1]))
            spent, found = spent + trial.solution.iterations, trial
            if fewest_touching(found) >= _ENOUGH or (same and moved <= _SETTLED * self.numerics.accuracy):
                break
        return found, spent

    def _own_error(self, found: Touched) -> float:
        """Return how far the tip moves with half the steps on the same nodes, over L_0."""
        try:
            correction = discretisation_correction(found.grid.problem, found.solution, found.grid.engine.linear)
        except np.linalg.LinAlgError:
            return float("inf")
        moved = found.grid.nodes(correction)[:3, -1]
        return float(np.linalg.norm(moved)) * 16 / 15

    def _on(self, grid: ObstacleGrid, found: Touched, s: Array) -> Touched | None:
        """Solve a solution again on nodes s of a grid; None where that leads elsewhere."""
        x = resampled(self.poses.shape, found, grid, s)
        values: dict[str, Any] = {**found.values, STEPS: np.diff(s)}
        solution = grid.engine.solve(grid.problem.pack({**values, SMOOTHING: SHARP}), x)
        if solution.holds(self.numerics.tolerance) and grid.distance(solution.x - x) <= _LARGEST_JUMP:
            return replace(touched(grid, solution, {**values, SMOOTHING: SHARP}), snapped=found.snapped)
        smooth = grid.engine.solve(grid.problem.pack({**values, SMOOTHING: _PATH_TAU}), x)
        again = self._sharp(grid, smooth.x, values)[0] if smooth.holds(self.numerics.tolerance) else None
        if again is not None and grid.distance(again.solution.x - x) <= _LARGEST_JUMP:
            return replace(again, snapped=found.snapped)
        return None
