"""Solving one pose after another among obstacles: the path there, sharper contact, nodes at contacts, finer grids."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.model.obstacles import Obstacle
from softnlp.model.rod import STATE_SIZE, Loads
from softnlp.nlp.continuation import follow
from softnlp.nlp.solver import Solution, discretisation_correction
from softnlp.statics.closing import DisputedError, closed
from softnlp.statics.obstacle_grid import SHARP, ObstacleGrid, Touched, compiled_obstacles, sharpened, touched
from softnlp.statics.obstacle_nodes import depth, moved_nodes, resampled
from softnlp.statics.obstacle_step import obstacle_step
from softnlp.statics.obstructed import SMOOTHING, STEPS
from softnlp.statics.pose_grid import next_size
from softnlp.statics.solver import PoseSolver
from softnlp.statics.step import Step

Array = NDArray[np.float64]

_FIRST, _FINEST = 40, 320  # intervals
_PATH_TAU = 1e-3  # tau along a path: a gap of 6 um under a push of 1/100
_TAUS = (1e-5, SHARP)
_LARGEST_JUMP = 0.1  # between points of a path, in scaled positions and direction cosines
_SMALLEST_STEP = 1 / 1024
_THROUGH = 5e-3  # of L_0: an overlap half-way between two points of a path from which that went through an obstacle
_MOVES = 4  # of nodes to contacts
_STEEPER = 4.0  # growth of what a step changes from which a path that ends has turned
_ORDER = 2  # of the tip's error where contacts spread over nodes


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
        found: Touched | None = None
        spent, reached, turned = 0, 0.0, False
        for start in [near, None] if near is not None else [None]:
            found, more, reached, turned = self._followed(pressure, loads, start, first)
            spent += more
            if found is not None:
                break
        if found is None:
            status = Status.FOLD if turned else Status.DIVERGED
            message = f"{status.advice}; among the obstacles continuation came {100 * reached:.3g} % of the way"
            seconds = time.perf_counter() - began
            return Step(pressure, status, message, iterations=spent, solve_time=seconds), None
        found, more, error = self._refined(found)
        spent += more
        try:
            solution = closed(found.grid.reference, found.solution, self.numerics, found.grid.tip)
        except DisputedError as disputed:
            seconds = time.perf_counter() - began
            return Step(pressure, Status.DISPUTED, str(disputed), iterations=spent, solve_time=seconds), None
        if solution is not found.solution:
            found = touched(found.grid, solution, found.values)
        if not found.solution.holds(self.numerics.tolerance):
            seconds = time.perf_counter() - began
            message = Status.DIVERGED.advice
            return Step(pressure, Status.DIVERGED, message, iterations=spent, solve_time=seconds), None
        return obstacle_step(self.poses, self.obstacles, pressure, loads, found, error, spent, began), found

    def _followed(
        self, pressure: Array, loads: Loads, near: Touched | None, intervals: int
    ) -> tuple[Touched | None, int, float, bool]:
        """Follow the branch from a neighbour, or from rest, to a pose; also the iterations, how far, and if it turned."""
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
        points: list[tuple[float, Array]] = []

        def passed(t: float, solution: Solution) -> bool:
            if points and self._through(grid, points[-1][1], solution):
                return False
            points.append((t, solution.x))
            return True

        started = grid.stepper.solve(a, x)
        if not started.holds(10 * grid.stepper.tolerance):
            return None, started.iterations, 0.0, False
        passed(0.0, started)
        way = follow(
            grid.stepper,
            lambda t: b if t >= 1.0 else a + t * (b - a),
            started.x,
            distance=grid.distance,
            first_step=0.5 if near is not None else 0.25,
            smallest_step=_SMALLEST_STEP,
            largest_jump=_LARGEST_JUMP,
            same_branch=passed,
        )
        spent = started.iterations + way.iterations
        if not way.arrived:
            return None, spent, way.fraction, self._turned(grid, points)
        solution = way.solution
        for tau in _TAUS:
            values = sharpened(end, tau)
            trial = grid.engine.solve(grid.problem.pack(values), solution.x)
            spent += trial.iterations
            if not trial.holds(self.numerics.tolerance):
                return None, spent, 1.0, False
            solution, end = trial, values
        return touched(grid, solution, end), spent, 1.0, False

    def _through(self, grid: ObstacleGrid, before: Array, solution: Solution) -> bool:
        """Whether half-way between two points of a path the robot is inside an obstacle: it went through it."""
        K, count = grid.intervals, len(self.obstacles)
        case = np.asarray(grid.problem.case_constants(solution.x, solution.p)).ravel()
        nc = grid.case.functions.field.size1_in(1)
        radius, numbers = case[nc : nc + count], case[nc + count : case.size - STATE_SIZE * (K + 1)]
        wide = [np.tile(part[:, None], K + 1) for part in (radius, numbers)]
        a, b = grid.nodes(before), grid.nodes(solution.x)
        for t in (0.25, 0.5, 0.75):
            gaps = np.asarray(grid.pushed(a + t * (b - a), np.zeros((count, K + 1)), *wide)[1])
            for j, obstacle in enumerate(self.obstacles):
                own = gaps[j, 1:] if obstacle.part == "body" else gaps[j, -1:]
                if np.min(own) < -_THROUGH:
                    return True
        return False

    def _turned(self, grid: ObstacleGrid, points: Sequence[tuple[float, Array]]) -> bool:
        """Whether the changes along a path grew as they do before a fold."""
        rates = [
            grid.distance(b[1] - a[1]) / (b[0] - a[0]) for a, b in zip(points[:-1], points[1:], strict=True) if b[0] > a[0]
        ]
        return len(rates) > 2 and rates[-1] > _STEEPER * float(np.median(rates))

    def _refined(self, found: Touched) -> tuple[Touched, int, float]:
        """Put nodes at contacts and refine the grid until its accuracy is met; also the iterations and the error."""
        found, spent = self._placed(found)
        accuracy, given = self.numerics.accuracy, self.numerics.intervals is not None
        error = self._own_error(found)
        while True:
            finer = self._finer(found, min(2 * found.grid.intervals, 2 * _FINEST))
            if finer is None:
                return found, spent, error
            finer, more = self._placed(finer)
            spent += more + finer.solution.iterations
            tips = [f.before[:3, -1] for f in (found, finer)]
            change = float(np.linalg.norm(tips[1] - tips[0]))
            if given:
                return found, spent, max(error, change * 2**_ORDER / (2**_ORDER - 1))
            found, error = finer, max(self._own_error(finer), change / (2**_ORDER - 1))
            if error <= accuracy or 2 * found.grid.intervals > _FINEST:
                return found, spent, error

    def _own_error(self, found: Touched) -> float:
        """Return how far the tip moves with half the steps on the same nodes, over L_0."""
        try:
            correction = discretisation_correction(found.grid.problem, found.solution, found.grid.engine.linear)
        except np.linalg.LinAlgError:
            return float("inf")
        moved = found.grid.nodes(correction)[:3, -1]
        return float(np.linalg.norm(moved)) * 16 / 15

    def _finer(self, found: Touched, intervals: int) -> Touched | None:
        """Return a solution on more intervals, None where that leads elsewhere."""
        grid = self.grid(intervals)
        parts = intervals // found.grid.intervals
        s = np.append((found.s[:-1, None] + np.diff(found.s)[:, None] * np.arange(parts) / parts).ravel(), 1.0)
        return self._on(grid, found, s)

    def _placed(self, found: Touched) -> tuple[Touched, int]:
        """Move nodes to where obstacles touch at one point."""
        spent = 0
        for _ in range(_MOVES):
            s = moved_nodes(self.poses.shape, found)
            if s is None:
                break
            trial = self._on(found.grid, found, s)
            if trial is None:
                break
            spent += trial.solution.iterations
            found = trial
        return found, spent

    def _on(self, grid: ObstacleGrid, found: Touched, s: Array) -> Touched | None:
        """Solve a solution again on nodes s of a grid; None where that leads elsewhere."""
        x = resampled(self.poses.shape, found, grid, s)
        values: Mapping[str, Any] = {**found.values, STEPS: np.diff(s)}
        for taus in ((SHARP,), (_PATH_TAU, *_TAUS)):
            solution = Solution(x, np.zeros(0), np.inf, 0, "")
            for tau in taus:
                solution = grid.engine.solve(grid.problem.pack({**values, SMOOTHING: tau}), solution.x)
            near = grid.distance(solution.x - x) <= _LARGEST_JUMP
            if solution.holds(self.numerics.tolerance) and near:
                return touched(grid, solution, {**values, SMOOTHING: SHARP})
        return None


