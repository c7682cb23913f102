"""Solving one pose after another for one robot: the grid, its refinement, and what is said of the result."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping
from copy import copy
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.model.numerics import Numerics, Transcribing
from softnlp.model.quantities import Model
from softnlp.model.rod import STATE_SIZE, Loads
from softnlp.nlp.solver import Solution, certificate, discretisation_correction, outputs
from softnlp.nlp.transcription import method_named
from softnlp.statics.attempts import LOADS, Attempt, Goal, Neighbour, Work, attempts, from_near
from softnlp.statics.branch import BranchPoint, stretch_on_branch
from softnlp.statics.closing import DisputedError, closed
from softnlp.statics.compiled import RodEquations, rod_equations
from softnlp.statics.loadcase import RodFunctions, unpack_section
from softnlp.statics.pose import (
    SHAPE_POINTS,
    bending_angle,
    between_nodes,
    pose_of,
    pose_warnings,
    shape_of,
    stability,
)
from softnlp.statics.pose_grid import TIP, Grid, Solved, compiled_grid, iteration_cost, next_size
from softnlp.statics.step import Step

Array = NDArray[np.float64]

FIRST_INTERVALS = {"multiple-shooting": 10, "collocation": 5}
MOST_INTERVALS = 1810
_MOST_COLLOCATION = 320  # as many points; order 8 needs no more
_TURN = 0.25  # largest angle [rad] of the unloaded arc within one RK4 interval of a first grid
SEARCHED_BY: Transcribing = "multiple-shooting"
_DEARER = 3  # an iteration on a neighbour's grid than on a coarse one, where the neighbour's is still tried first
_FINER = 4  # how much finer a grid is tried where a coarse one finds no solution
# Work is counted in Runge-Kutta intervals of Newton iterations, some 0.07 ms each.
_MOST_WORK, _KEPT_TO_SHOW = 9_000, 3_000  # to find one pose, and then to solve it on the grid that its accuracy needs
_BY_IPOPT = 4  # so much more where IPOPT makes every step, which takes more of them
HOPELESS = 1.0  # estimated error of a given grid, in lengths, from which its solution is none of the rod
_TO_SHOW = 4  # iterations on that grid, the error and stability counted
# Without loads the exact answer is a circular arc; a solution is good enough to show it.
UNLOADED_ACCURACY = 5e-9


class PoseSolver:
    """Solves poses of one model; compiled grids are kept between poses, so a sequence pays for each once.

    model : robot, silicone, coefficients, conventions, all numbers. unloaded_accuracy : estimate to aim for, times 3,
    where no load acts, if it is below that of the numerics.
    """

    def __init__(
        self,
        model: Model,
        numerics: Numerics,
        *,
        unloaded_accuracy: float = UNLOADED_ACCURACY * 3,
        equations: RodEquations | None = None,
    ) -> None:
        self.numerics = numerics
        self._unloaded_accuracy = unloaded_accuracy
        self.equations = equations or rod_equations(model)
        self._set_model(model)

    def _set_model(self, model: Model) -> None:
        self.model = model
        self.quantities = self.equations.quantities_of(model)
        self._numbers = {name: q.nominal for name, q in self.quantities.items()}
        self.ahead: tuple[Array, tuple[Step, Solved | None]] | None = None  # what a wall's place has asked for already

    @property
    def branch(self) -> ca.Function:
        """The branch of the stretch, see `branch_function`."""
        return self.equations.branch

    @property
    def functions(self) -> RodFunctions:
        """The rod, see `RodFunctions`."""
        return self.equations.functions

    @property
    def shape(self) -> ca.Function:
        """The shape between nodes, see `shape_function`."""
        return self.equations.shape

    def with_model(self, model: Model) -> PoseSolver:
        """Return a solver for other numbers that shares what is compiled; `ValueError` for another `Model.kind`."""
        self.model.check_kind(model)
        other = copy(self)
        other._set_model(model)
        return other

    def with_values(self, values: Mapping[str, Any]) -> PoseSolver:
        """Return a solver with other values [SI] of its quantities, which need not be possible ones of a model."""
        other = copy(self)
        other._numbers = {**self._numbers, **{name: v for name, v in values.items() if name in self.quantities}}
        return other

    def grid(self, intervals: int, transcription: Transcribing | None = None) -> Grid:
        """Return the compiled problem on a grid, building it at first use; transcribed as the numerics say, or so."""
        numerics = self.numerics if transcription is None else replace(self.numerics, transcription=transcription)
        by_ipopt = numerics.engine == "ipopt"
        key = (numerics.transcription, intervals, by_ipopt, numerics.ipopt)
        return self.equations.kept(key, lambda: compiled_grid(self.equations, numerics, intervals))

    @property
    def most_intervals(self) -> int:
        """The finest grid that refinement uses."""
        return _MOST_COLLOCATION if self.numerics.transcription == "collocation" else MOST_INTERVALS

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
        loaded = any(np.any(values[name]) for name in LOADS)
        given = self.numerics.intervals
        first = given or self.first_intervals(column, branch.stretch, None if loaded else target)
        most_work = _MOST_WORK * (_BY_IPOPT if self.numerics.engine == "ipopt" else 1)
        work = Work(most_work, _KEPT_TO_SHOW if given is None else math.inf)
        found, iterations, how_far = self._searched(values, branch, warm, work, first, loaded)
        most = self.most_intervals
        while found is not None:
            own = found.grid.transcription == self.numerics.transcription
            chosen = own and found.intervals >= (given or 0)
            wanted = self.next_intervals(found.refinement_error, found.intervals, target) if chosen else first
            hopeless = given is not None and not found.refinement_error <= HOPELESS
            enough = found.intervals >= most and found.refinement_error <= self.numerics.accuracy
            if (wanted is None and not hopeless) or enough:
                return self._closed(pressure, loads, found, iterations, began)
            wanted = min(wanted or found.intervals, most)
            cost = iteration_cost(wanted, self.numerics.transcription)
            dear = given is None and _TO_SHOW * cost > work.left + _KEPT_TO_SHOW
            if dear or hopeless or (chosen and found.intervals >= most):
                status, residual = Status.INACCURATE, found.solution.residual
                how_far = f"; with {found.intervals} intervals it is {found.refinement_error:.2g} L_0"
                how_far += f", and {wanted} would take too long" if dear else ""
                break
            found, spent, how_far = self._solve_on(self.grid(wanted), values, branch, found, work)
            iterations += spent
        else:
            status, residual = Status.DIVERGED, None
        seconds = time.perf_counter() - began
        message = status.advice + how_far
        return Step(pressure, status, message, residual=residual, iterations=iterations, solve_time=seconds), None

    def _searched(
        self, values: dict[str, Any], branch: BranchPoint, near: Solved | None, work: Work, first: int, loaded: bool
    ) -> tuple[Solved | None, int, str]:
        """Find a pose by Newton's method from a neighbour, else on a coarse shooting grid, where paths cost the least.

        first : intervals of the grid that the pose is shown on first, at once where it is an arc. Returns as
        `_solve_on`.
        """
        given, size, spent = self.numerics.intervals, first, 0
        name: Transcribing | None = None
        if loaded:
            name = SEARCHED_BY
            quick = self.first_intervals(self.column(values), branch.stretch, transcription=name)
            size = min(quick, given or quick)
        coarse = self.grid(size, name)
        if near is not None:
            grid = self.grid(max(near.intervals, first))
            if grid.iteration_cost <= _DEARER * coarse.iteration_cost:
                found, spent, _ = self._solve_on(grid, values, branch, near, work, from_near)
                if found is not None and found.stable:
                    return found, spent, ""
        finest = min(_FINER * size, self.most_intervals)
        while True:
            found, more, how_far = self._solve_on(self.grid(size, name), values, branch, near, work)
            spent += more
            if (found and not found.is_rough) or given is not None or size >= finest or work.used_up:
                return found, spent, how_far
            size, near = min(_FINER * size, self.most_intervals), found

    def first_intervals(
        self, column: Array, stretch: float, arc_target: float | None = None, transcription: str | None = None
    ) -> int:
        """Return a grid coarse enough to be quick and fine enough for the curl of the unloaded robot.

        arc_target : for a robot without loads, the error to meet at once: RK4 turns a circular arc of angle a by
        a (a / K)^4 / 120 too little, of which the tip's position shows about 0.6. transcription : as of `grid`.
        """
        name = transcription or self.numerics.transcription
        first = FIRST_INTERVALS[name]
        straight = np.asarray(self.functions.arc(column, stretch, 0.01)).ravel()
        curl = 100 * float(np.hypot(straight[9], straight[10]))  # of the axis, R e3, over the first hundredth
        curl = max(curl, self._turn_of_moment(column, stretch) / 2)  # half as finely: it is not there at first
        turn = _TURN * FIRST_INTERVALS["multiple-shooting"] / first
        wanted = max(first, curl / turn)
        if arc_target is not None and name == "multiple-shooting":
            wanted = max(wanted, curl * (0.6 * curl / (120 * arc_target)) ** 0.25)
        return min(next_size(wanted), self.most_intervals)

    def _turn_of_moment(self, column: Array, stretch: float) -> float:
        """Return how far the dead tip moment alone would bend or twist the rod [rad]."""
        constants, _, units = (np.asarray(part).ravel() for part in self.functions.section(column, stretch))
        after = self.model.robot.chamber_sets + 3  # the pressures and the tip force
        section, scaled = unpack_section(constants), column[after : after + 3] / np.prod(units)
        length = constants[len(section)]
        return float(np.linalg.norm(scaled) * length / min(section.bending_x, section.bending_y, section.torsion))

    def target_accuracy(self, loads: Loads) -> float:
        """Return the estimate to aim for: a third of the accuracy, since estimates are good to a factor of 3."""
        accuracy = self.numerics.accuracy
        if not loads.act:
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
        self,
        grid: Grid,
        values: dict[str, Any],
        branch: BranchPoint,
        near: Solved | None,
        work: Work,
        tried: Callable[[Goal, Work], Iterator[Attempt]] | None = None,
    ) -> tuple[Solved | None, int, str]:
        """Make the attempts in turn; the first stable solution wins, an unstable one is kept if there is no other.

        Of several unstable ones that is the first along a load path, which is where the robot buckles or snaps from;
        what a guess led to comes after. One on too coarse a grid to be judged is for a finer one to judge.
        near : a neighbour, or this pose on another grid, whose like is the answer. Returns the solution, the iterations
        spent and what to say where there is none.
        """
        p = grid.problem.pack(values)
        refining = near is not None and not near.is_rough and np.array_equal(near.solution.p, p)

        def arc(at: Mapping[str, Any]) -> Array:
            return self.arc_guess(grid, grid.problem.pack(at), self._stretch(at))

        spent, reached, note = 0, 0.0, ""
        kept: Solved | None = None
        kept_from_path = False
        neighbour = None if near is None else self._neighbour(near, grid, p, branch.stretch)
        goal = Goal(grid, values, arc, neighbour, last_by_ipopt=self.numerics.engine == "auto")
        for attempt in (tried or attempts)(goal, work):
            spent += attempt.solution.iterations
            work.spend(grid, attempt.solution.iterations)
            if attempt.fraction < 1.0:
                reached = max(reached, attempt.fraction)
            elif attempt.solution.holds(self.numerics.tolerance):
                try:
                    solved = self._examine(grid, attempt.solution, goal.is_loaded)
                except np.linalg.LinAlgError as error:
                    note = f"; a solution found on {grid.intervals} intervals cannot be judged: {error}"
                    continue
                if solved.stable or refining or (solved.is_rough and self.numerics.intervals is None):
                    return solved, spent, ""
                if kept is None or (attempt.on_path and not kept_from_path):
                    kept, kept_from_path = solved, attempt.on_path
            if work.used_up:
                note += "; stopped, since it took too long"
                break
        if not goal.is_loaded:
            return kept, spent, f"; {grid.intervals} intervals do not show how far it curls{note}"
        return kept, spent, f"; continuation came {100 * reached:.3g} % of the way{note}"

    def column(self, values: Mapping[str, Any]) -> Array:
        """Return every quantity in its order, SI."""
        return np.concatenate([np.ravel(values.get(name, q.nominal)) for name, q in self.quantities.items()])

    def _stretch(self, values: Mapping[str, Any]) -> float:
        """Return the stretch on the branch from zero pressure at the pressure in `values`."""
        return stretch_on_branch(self.branch, self.column(values), values["pressure"]).stretch

    def arc_guess(self, grid: Grid, p: Array, stretch: float) -> Array:
        """Return x of the unloaded circular arc at this pressure."""
        return grid.case.arc(p, stretch)

    def transfer(self, solved: Solved, grid: Grid) -> Array:
        """Return x of a solution on another grid."""
        return self._neighbour(solved, grid, solved.solution.p, float(solved.solution.x[0])).moved

    def _neighbour(self, solved: Solved, grid: Grid, p: Array, stretch: float) -> Neighbour:
        """Return a solution on a grid, as it is and moved by what the unloaded arc moves to the pose at p."""
        s = grid.case.transcribed.points
        if solved.grid is grid:
            states = solved.solution.x[1:]
        else:
            states = between_nodes(self.shape, solved.limit, solved.constants, s)[:STATE_SIZE].T.ravel()
        x_old, p_old = solved.solution.x, solved.solution.p
        x = np.concatenate([[x_old[0]], states])
        arcs = self.arc_guess(grid, p_old, x_old[0]), self.arc_guess(grid, p, stretch)
        return Neighbour(x=x, p=p_old, moved=x + arcs[1] - arcs[0], stable=solved.stable)

    def _examine(self, grid: Grid, solution: Solution, loaded: bool) -> Solved:
        """Estimate the discretisation error of a solution and test its stability; an arc without loads is stable.

        Raises `numpy.linalg.LinAlgError` where they are not numbers.
        """
        richardson = 2**grid.order / (2**grid.order - 1)
        correction = richardson * discretisation_correction(grid.problem, solution, grid.engine.linear)
        tip = correction[-STATE_SIZE:]
        nodes = grid.nodes(solution.x)
        constants = grid.constants(solution)
        if not np.all(np.isfinite(tip)):
            raise np.linalg.LinAlgError("its discretisation error is not finite")
        return Solved(
            grid=grid,
            solution=solution,
            nodes=nodes,
            limit=grid.nodes(solution.x + correction),
            constants=constants,
            error=float(np.linalg.norm(tip[:3])),
            rotation_error=float(np.linalg.norm(tip[3:12]) / np.sqrt(2)),
            stable=not loaded or self.equations.conjugate_points(nodes, constants) == 0,
        )

    def _closed(
        self, pressure: Array, loads: Loads, found: Solved, iterations: int, began: float
    ) -> tuple[Step, Solved | None]:
        """Let IPOPT close a solution, where it takes part, and return its step."""
        grid = found.grid
        try:
            solution = closed(grid.reference, found.solution, self.numerics, TIP)
        except DisputedError as error:
            seconds = time.perf_counter() - began
            return Step(pressure, Status.DISPUTED, str(error), iterations=iterations, solve_time=seconds), None
        if solution is not found.solution:
            found = replace(found, solution=solution, nodes=grid.nodes(solution.x), constants=grid.constants(solution))
        return self._finished(pressure, loads, found, iterations, began), found

    def _finished(self, pressure: Array, loads: Loads, solved: Solved, iterations: int, began: float) -> Step:
        """Turn the solution of a pose into a step in SI units, with its certificate."""
        grid, solution = solved.grid, solved.solution
        problem = grid.problem
        result = outputs(problem, solution)
        L_0, F_0 = (float(v) for v in np.asarray(grid.problem.units(solution.x, solution.p)).ravel())
        s = np.linspace(0, 1, SHAPE_POINTS)
        shape = shape_of(between_nodes(self.shape, solved.nodes, solved.constants, s), s, L_0, F_0)
        unloaded_tip = np.asarray(self.functions.arc(solution.p, float(result["stretch"][0]), 1.0)).ravel()[:3] * L_0
        bending = bending_angle(self.shape, solved.nodes, solved.constants)
        pose = pose_of(self.model, result, shape, bending, unloaded_tip, stability(loads, solved.stable))
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
            engine=self.numerics.engine,
            ipopt=solution.ipopt,
        )
