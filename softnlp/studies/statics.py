"""Solving one pose after another for one robot: guesses, refinement, and what to try when a solve fails."""

from __future__ import annotations

import time
from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.branch import BranchPoint, branch_function, stretch_on_branch
from softnlp.condensed import CondensedSolver
from softnlp.continuation import around_folds, follow, straight_path
from softnlp.loadcase import LoadCase, load_case, rod_functions
from softnlp.numerics import Numerics
from softnlp.problem import CompiledProblem, compile_problem
from softnlp.quantities import Model, quantities
from softnlp.rod import STATE_SIZE, Loads
from softnlp.solver import (
    Engine,
    Solution,
    certificate,
    discretisation_correction,
    outputs,
)
from softnlp.stability import conjugate_points, transition_functions
from softnlp.status import Status
from softnlp.studies.pose import SHAPE_POINTS, between_nodes, pose_of, pose_warnings, shape_function, shape_of
from softnlp.studies.step import Step
from softnlp.transcription import MultipleShooting, method_named

Array = NDArray[np.float64]

FIRST_INTERVALS = {"multiple-shooting": 10, "collocation": 5}
MOST_INTERVALS = 1810
_TURN = 0.25  # largest angle [rad] of the unloaded arc within one RK4 interval of a first grid
_FINER = 4  # how much finer a grid is tried where a coarse one finds no solution
_MOST_WORK = 200_000  # iterations times intervals on one grid, which is some ten seconds
_PRESSURE_PARTS = (0.0, 0.5, 0.25, 0.75)
_LOADS = ("tip_force", "tip_moment", "gravity")
# Without loads the exact answer is a circular arc; a solution is good enough to show it.
UNLOADED_ACCURACY = 5e-9


@dataclass(frozen=True, eq=False)
class Grid:
    """Everything compiled for one number of intervals."""

    case: LoadCase
    engine: Engine
    stepper: Engine
    transition: ca.Function

    @property
    def problem(self) -> CompiledProblem:
        """The compiled problem, with every quantity fixed."""
        return self.engine.problem

    def nodes(self, x: Array) -> Array:
        """Return the scaled node states (18, K + 1) in x."""
        states = x[1:].reshape(-1, STATE_SIZE).T
        return np.ascontiguousarray(states[:, self.case.transcribed.node_index])

    def constants(self, solution: Solution) -> Array:
        """Return what the field takes beside the state."""
        return np.asarray(self.problem.case_constants(solution.x, solution.p)).ravel()


@dataclass(frozen=True, eq=False)
class Solved:
    """A solution on a grid and what was found of it.

    nodes : (18, K + 1) scaled states. constants : what the field takes beside them. error : estimated tip position
    error over L_0. rotation_error : the same for the tip's orientation [rad]. stable : no conjugate point.
    """

    grid: Grid
    solution: Solution
    nodes: Array
    constants: Array
    error: float
    rotation_error: float
    stable: bool

    @property
    def intervals(self) -> int:
        """The number of intervals."""
        return int(self.nodes.shape[1]) - 1

    @property
    def refinement_error(self) -> float:
        """What refinement holds against the accuracy: a rotation is allowed five times as much as a position."""
        return max(self.error, self.rotation_error / 5)


def next_size(wanted: float) -> int:
    """Return the first grid size of at least `wanted`; sizes grow by the square root of 2, so that few are compiled."""
    k = 0
    while (size := 5 * round(2 ** (k / 2))) < wanted:
        k += 1
    return size


def pose_weight(x: Array) -> Array:
    """Return the weight of each entry of x in an arc length that is the mean over the nodes of the change of pose."""
    states = np.zeros((x.size // STATE_SIZE, STATE_SIZE))
    states[:, :12] = 1.0 / len(states)
    return np.concatenate([[0.0], states.ravel()])


def pose_distance(change: Array) -> float:
    """Return the largest change of a scaled position or of a direction cosine between two x."""
    states = change[1:].reshape(-1, STATE_SIZE)
    return float(np.max(np.abs(states[:, :12])))


class PoseSolver:
    """Solves poses of one model; compiled grids are kept between poses, so a sequence pays for each once.

    model : robot, silicone, coefficients, conventions, all numbers. unloaded_accuracy : estimate to aim for, times 3,
    where no load acts, if it is below that of the numerics.
    """

    def __init__(self, model: Model, numerics: Numerics, *, unloaded_accuracy: float = UNLOADED_ACCURACY * 3) -> None:
        self.model = model
        self.numerics = numerics
        self._unloaded_accuracy = unloaded_accuracy
        self.quantities = quantities(model)
        self.branch = branch_function(model)
        self.functions = rod_functions(model)
        self.shape = shape_function(self.functions.field)
        self._transition, self._tip_variation = transition_functions(self.functions.field)
        self._grids: dict[int, Grid] = {}
        self._numbers: dict[str, Any] = {}

    def with_model(self, model: Model) -> PoseSolver:
        """Return a solver for a model of the same chambers, law and conventions; it shares what is compiled."""
        other = copy(self)
        other.model = model
        other._numbers = {name: q.nominal for name, q in quantities(model).items()}
        return other

    def grid(self, intervals: int) -> Grid:
        """Return the compiled problem on a grid, building it at first use."""
        if intervals not in self._grids:
            method = method_named(self.numerics.transcription, intervals)
            case = load_case("pose", self.functions, self.quantities, method)
            problem = compile_problem(list(self.quantities.values()), [case])
            linear = CondensedSolver(self.functions, method) if isinstance(method, MultipleShooting) else None
            self._grids[intervals] = Grid(
                case=case,
                engine=Engine(problem, linear=linear),
                stepper=Engine(
                    problem, linear=linear, newton_only=linear is not None, max_iterations=8, tolerance=1e-7
                ),
                transition=self._transition.map(intervals),
            )
        return self._grids[intervals]

    def values(self, pressure: Array, loads: Loads) -> dict[str, Any]:
        """Return the quantities that a step sets."""
        return {
            **self._numbers,
            "pressure": pressure,
            "tip_force": loads.tip_force,
            "tip_moment": loads.tip_moment,
            "gravity": loads.gravity,
        }

    def solve(self, pressure: Array, loads: Loads, warm: Solved | None = None) -> tuple[Step, Solved | None]:
        """Solve one pose, from a neighbouring solution where there is one; the step says how it ended.

        pressure : (sets,) [Pa], not negative. Never raises for a pose that cannot be solved.
        """
        began = time.perf_counter()
        pressure = np.asarray(pressure, dtype=float)
        values = self.values(pressure, loads)
        column = self.column(values)
        branch = stretch_on_branch(self.branch, column, pressure)
        if branch.status is not Status.SOLVED:
            return Step(pressure, branch.status, branch.message, solve_time=time.perf_counter() - began), None

        target = self.target_accuracy(loads)
        unloaded = not any(np.any(values[name]) for name in _LOADS)
        first = self.numerics.intervals or self.first_intervals(column, branch.stretch, target if unloaded else None)
        intervals = max(warm.intervals, first) if warm else first
        iterations = 0
        found: Solved | None = warm
        while True:
            refining = found is not None and found is not warm
            attempt, spent, reached = self._solve_on(intervals, values, branch, found, refining=refining)
            iterations += spent
            if attempt is None and self.numerics.intervals is None and intervals < _FINER * first:
                intervals, found = _FINER * intervals, None
                continue
            if attempt is None:
                step = Step(
                    pressure,
                    Status.DIVERGED,
                    f"{Status.DIVERGED.advice}; continuation came {100 * reached:.3g} % of the way",
                    iterations=iterations,
                    solve_time=time.perf_counter() - began,
                )
                return step, None
            found = attempt
            wanted = self.next_intervals(found.refinement_error, intervals, target)
            if wanted is None:
                break
            if intervals >= MOST_INTERVALS:
                step = Step(
                    pressure,
                    Status.INACCURATE,
                    f"{Status.INACCURATE.advice}; with {intervals} intervals it is {found.error:.2g} L_0",
                    residual=found.solution.residual,
                    iterations=iterations,
                    solve_time=time.perf_counter() - began,
                )
                return step, None
            intervals = min(wanted, MOST_INTERVALS)
        return self._finished(pressure, loads, found, iterations, began), found

    def first_intervals(self, column: Array, stretch: float, arc_target: float | None = None) -> int:
        """Return a grid coarse enough to be quick and fine enough for the curl of the unloaded robot.

        arc_target : for a robot without loads, the error to meet at once: RK4 turns a circular arc of angle a by
        a (a / K)^4 / 120 too little, of which the tip's position shows about 0.6.
        """
        first = FIRST_INTERVALS[self.numerics.transcription]
        straight = np.asarray(self.functions.arc(column, stretch, 0.01)).ravel()
        curl = 100 * float(np.hypot(straight[9], straight[10]))  # of the axis, R e3, over the first hundredth
        turn = _TURN * FIRST_INTERVALS["multiple-shooting"] / first
        wanted = max(first, curl / turn)
        if arc_target is not None and self.numerics.transcription == "multiple-shooting":
            wanted = max(wanted, curl * (0.6 * curl / (120 * arc_target)) ** 0.25)
        return min(next_size(wanted), MOST_INTERVALS)

    def target_accuracy(self, loads: Loads) -> float:
        """Return the estimate to aim for: a third of the accuracy, since estimates are good to a factor of 3."""
        accuracy = self.numerics.accuracy
        if not np.any([loads.tip_force, loads.tip_moment, loads.gravity]):
            accuracy = min(accuracy, self._unloaded_accuracy)
        return accuracy / 3

    def next_intervals(self, error: float, intervals: int, target: float) -> int | None:
        """Return the finer grid that should meet the target, or None where this one does or the grid is given."""
        if self.numerics.intervals is not None or error <= target:
            return None
        order = method_named(self.numerics.transcription, 1).order
        factor = 1.1 * (error / target) ** (1 / order)
        return next_size(max(factor, 1.3) * intervals)

    def _solve_on(
        self, intervals: int, values: dict[str, Any], branch: BranchPoint, near: Solved | None, *, refining: bool
    ) -> tuple[Solved | None, int, float]:
        """Try, in order: the neighbour, the unloaded arc, loads applied after the pressure, and after part of it.

        The first stable solution wins; an unstable one is kept in case there is no other. When refining, `near` is this
        pose on a coarser grid, and its like is the answer. Returns it, the iterations spent and how far continuation
        came.
        """
        grid = self.grid(intervals)
        p = grid.problem.pack(values)
        no_loads = {name: np.zeros(3) for name in _LOADS}
        unloaded = values | no_loads
        spent, reached = 0, 0.0
        unstable: Solved | None = None

        def attempts() -> Iterator[tuple[Solution, float]]:
            if near is not None:
                yield grid.engine.solve(p, self._transfer(near, grid, p, branch.stretch)), 1.0
            yield grid.engine.solve(p, self.arc_guess(grid, p, branch.stretch)), 1.0
            if not any(np.any(values[name]) for name in _LOADS):
                return  # the arc is the answer; a grid that does not show it is too coarse
            yield from self._along(grid, [unloaded, values])
            for part in _PRESSURE_PARTS:
                partly = values | {"pressure": part * values["pressure"]}
                yield from self._along(grid, [partly | no_loads, partly, values])

        for solution, fraction in attempts():
            spent += solution.iterations
            reached = max(reached, fraction) if fraction < 1.0 else reached
            if fraction >= 1.0 and solution.holds(self.numerics.tolerance):
                solved = self._examine(grid, solution)
                if solved.stable or refining:
                    return solved, spent, 1.0
                unstable = solved
            if spent * intervals > _MOST_WORK:
                break
        return unstable, spent, reached

    def _along(self, grid: Grid, waypoints: list[dict[str, Any]]) -> Iterator[tuple[Solution, float]]:
        """Follow the solution along straight lines between values; yield solutions at the end and the fraction reached.

        Where the branch turns back before the end the robot snaps through: the curve is followed around its folds, and
        every equilibrium at the end that it passes is offered.
        """
        problem = grid.problem
        x = self.arc_guess(grid, problem.pack(waypoints[0]), self._stretch(waypoints[0]))
        p_end = problem.pack(waypoints[-1])
        legs = len(waypoints) - 1
        spent = 0
        for k in range(legs):
            path = straight_path(problem, waypoints[k], waypoints[k + 1])
            followed = follow(grid.stepper, path, x, distance=pose_distance)
            spent += followed.iterations
            x = followed.solution.x
            if not followed.arrived:
                yield replace(followed.solution, iterations=spent), (k + followed.fraction) / legs
                if k == legs - 1 and grid.engine.linear is not None:
                    weight = pose_weight(x)
                    passages = around_folds(
                        grid.stepper, grid.engine.linear, path, followed.solution, followed.fraction, weight=weight
                    )
                    for x_end, iterations in passages:
                        final = grid.engine.solve(p_end, x_end)
                        yield replace(final, iterations=final.iterations + iterations), 1.0
                return
        final = grid.engine.solve(p_end, x)
        yield replace(final, iterations=spent + final.iterations), 1.0

    def column(self, values: dict[str, Any]) -> Array:
        """Return every quantity in its order, SI."""
        return np.concatenate([np.ravel(values.get(name, q.nominal)) for name, q in self.quantities.items()])

    def _stretch(self, values: dict[str, Any]) -> float:
        """Return the stretch on the branch from zero pressure at the pressure in `values`."""
        return stretch_on_branch(self.branch, self.column(values), values["pressure"]).stretch

    def arc_guess(self, grid: Grid, p: Array, stretch: float) -> Array:
        """Return x of the unloaded circular arc at this pressure."""
        s = grid.case.transcribed.points
        states = np.asarray(self.functions.arc(p, stretch, s[None, :]))
        return np.concatenate([[stretch], states.T.ravel()])

    def transfer(self, solved: Solved, grid: Grid) -> Array:
        """Return x of a solution on another grid."""
        return self._transfer(solved, grid, solved.solution.p, float(solved.solution.x[0]))

    def _transfer(self, solved: Solved, grid: Grid, p: Array, stretch: float) -> Array:
        """Return a solution's states on a grid, moved by what the unloaded arc moves between the two poses."""
        s = grid.case.transcribed.points
        if solved.grid is grid:
            states = solved.solution.x[1:]
        else:
            states = between_nodes(self.shape, solved.nodes, solved.constants, s)[:STATE_SIZE].T.ravel()
        x_old, p_old = solved.solution.x, solved.solution.p
        moved = self.arc_guess(grid, p, stretch) - self.arc_guess(grid, p_old, x_old[0])
        return np.concatenate([[x_old[0]], states]) + moved

    def _examine(self, grid: Grid, solution: Solution) -> Solved:
        """Estimate the discretisation error of a solution and test its stability."""
        correction = discretisation_correction(grid.problem, solution, grid.engine.linear)
        order = method_named(self.numerics.transcription, 1).order
        richardson = 2**order / (2**order - 1)
        tip = correction[-STATE_SIZE:] * richardson
        nodes = grid.nodes(solution.x)
        constants = grid.constants(solution)
        return Solved(
            grid=grid,
            solution=solution,
            nodes=nodes,
            constants=constants,
            error=float(np.linalg.norm(tip[:3])),
            rotation_error=float(np.linalg.norm(tip[3:12]) / np.sqrt(2)),
            stable=conjugate_points(grid.transition, self._tip_variation, nodes, constants) == 0,
        )

    def _finished(self, pressure: Array, loads: Loads, solved: Solved, iterations: int, began: float) -> Step:
        """Turn the solution of a pose into a step in SI units, with its certificate."""
        grid, solution = solved.grid, solved.solution
        problem = grid.problem
        result = outputs(problem, solution)
        L_0, F_0 = (float(v) for v in np.asarray(grid.problem.units(solution.x, solution.p)).ravel())
        s = np.linspace(0, 1, SHAPE_POINTS)
        shape = shape_of(between_nodes(self.shape, solved.nodes, solved.constants, s), s, L_0, F_0)
        unloaded_tip = np.asarray(self.functions.arc(solution.p, float(result["stretch"][0]), 1.0)).ravel()[:3] * L_0
        pose = pose_of(self.model, result, shape, unloaded_tip, solved.stable)
        warnings = list(pose_warnings(self.model, pose))
        if solved.error > self.numerics.accuracy:
            warnings.append(
                f"estimated discretisation error {solved.error:.2g} of the length is above the accuracy asked for with "
                f'{solved.intervals} intervals; set [solver] intervals = "auto" or a larger number'
            )
        return Step(
            pressure=pressure,
            status=Status.SOLVED,
            message=Status.SOLVED.advice,
            pose=pose,
            residual=solution.residual,
            certificate=certificate(problem, solution),
            discretisation_error=solved.error,
            intervals=solved.intervals,
            iterations=iterations,
            solve_time=time.perf_counter() - began,
            warnings=tuple(warnings),
        )
