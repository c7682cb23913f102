"""Solving one pose after another for one robot: the grid, its refinement, and what is said of the result."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping
from copy import copy
from dataclasses import replace
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.model.numerics import Numerics, Transcribing
from softnlp.model.quantities import LOADS, Model
from softnlp.model.rod import STATE_SIZE, Loads
from softnlp.nlp.solver import Solution, discretisation_correction
from softnlp.statics.attempts import Attempt, Goal, Neighbour, Work, attempts, from_near
from softnlp.statics.branch import BranchPoint, stretch_on_branch
from softnlp.statics.closing import DisputedError, closed
from softnlp.statics.compiled import RodEquations, rod_equations
from softnlp.statics.grid_size import first_intervals, most_intervals, next_intervals
from softnlp.statics.loadcase import RodFunctions
from softnlp.statics.pose import Mapped, between_nodes
from softnlp.statics.pose_grid import HOPELESS, Grid, Solved, compiled_grid, dearer, iteration_cost
from softnlp.statics.pose_step import solved_step
from softnlp.statics.proposed import proposed, residual
from softnlp.statics.step import Step

Array = NDArray[np.float64]

SEARCHED_BY: Transcribing = "multiple-shooting"
_FINER = 4  # how much finer a grid is tried where a coarse one finds no solution
# Work is counted in Runge-Kutta intervals of Newton iterations, some 0.07 ms each.
_MOST_WORK, _KEPT_TO_SHOW = 9_000, 3_000  # to find one pose, and then to solve it on the grid that its accuracy needs
_BY_IPOPT = 4  # so much more where IPOPT makes every step, which takes more of them
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
        self._set_numbers({name: q.nominal for name, q in self.quantities.items()})
        self.ahead: tuple[Array, tuple[Step, Solved | None]] | None = None  # what a wall's place has asked for already

    def _set_numbers(self, numbers: Mapping[str, Any]) -> None:
        self._numbers = dict(numbers)
        self._column = np.concatenate([np.ravel(v).astype(float) for v in self._numbers.values()])
        starts = np.cumsum([0, *(q.size for q in self.quantities.values())]).tolist()
        self._places = {name: slice(*ends) for name, ends in zip(self.quantities, pairwise(starts), strict=True)}

    @property
    def branch(self) -> ca.Function:
        """The branch of the stretch, see `branch_function`."""
        return self.equations.branch

    @property
    def functions(self) -> RodFunctions:
        """The rod, see `RodFunctions`."""
        return self.equations.functions

    @property
    def shape(self) -> Mapped:
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
        other._set_numbers({**self._numbers, **{name: v for name, v in values.items() if name in self.quantities}})
        return other

    def grid(self, intervals: int, transcription: Transcribing | None = None) -> Grid:
        """Return the compiled problem on a grid, building it at first use; transcribed as the numerics say, or so."""
        numerics = self.numerics if transcription is None else replace(self.numerics, transcription=transcription)
        by_ipopt = numerics.engine == "ipopt"
        key = (numerics.transcription, intervals, by_ipopt, numerics.ipopt)
        return self.equations.kept(key, lambda: self._compiled(numerics, intervals))

    def unloaded(self, case: Any, column: Array) -> Array | None:
        """Return x of a case without loads at every quantity in its order, None where its branch ends before."""
        found = stretch_on_branch(self.branch, column, column[: self.model.sets])
        return case.arc(column, found.stretch) if found.status.has_solution else None

    def _compiled(self, numerics: Numerics, intervals: int) -> Grid:
        return compiled_grid(self.equations, numerics, intervals)

    def branch_at(self, values: Mapping[str, Any]) -> BranchPoint:
        """Return where the branch of the stretch stands at values of the quantities."""
        return stretch_on_branch(self.branch, self.column(values), np.asarray(values["pressure"]))

    @property
    def most_intervals(self) -> int:
        """The finest grid that refinement uses."""
        return most_intervals(self.numerics.transcription)

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
        quick = self._proposed(column, loads, warm)
        if quick is not None:
            return self._closed(pressure, loads, quick, quick.solution.iterations, began)
        branch = self.branch_at(values)
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

    def _proposed(self, column: Array, loads: Loads, near: Solved | None) -> Solved | None:
        """Return the pose that single shooting finds in machine code, where that is compiled and certain of it."""
        numerics = self.numerics
        if numerics.transcription != "multiple-shooting" or numerics.engine == "ipopt":
            return None
        section = self.model.section
        single = self.equations.single_shooting() if section.by_sum or section.coupled else None
        if single is None:
            return None
        nodes = None if near is None else near.nodes
        found = proposed(single, numerics, column, self.target_accuracy(loads), nodes)
        if found is None:
            return None
        at, shot = found
        x = np.concatenate([[at.stretch], shot.nodes.T.ravel()])
        intervals = shot.nodes.shape[1] - 1
        return Solved(
            compiled=lambda: self.grid(intervals),
            intervals=intervals,
            solution=Solution(x, column, residual(at, shot), shot.passes, "single shooting converged"),
            nodes=shot.nodes,
            limit=shot.nodes,
            constants=at.constants,
            error=shot.error,
            rotation_error=shot.rotation_error,
            stable=True,
            shot=found,
        )

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
            if not dearer(grid.intervals, coarse.intervals, self.numerics.transcription):
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
        """Return a first grid at a stretch, see `softnlp.statics.grid_size`. transcription : as of `grid`."""
        constants, _, units = (np.asarray(part).ravel() for part in self.functions.section(column, stretch))
        after = self.model.sets + 3  # the pressures and the tip force
        moment = column[after : after + 3] / np.prod(units)
        return first_intervals(transcription or self.numerics.transcription, constants, moment, arc_target)

    def target_accuracy(self, loads: Loads) -> float:
        """Return the estimate to aim for: a third of the accuracy, since estimates are good to a factor of 3."""
        accuracy = self.numerics.accuracy
        if not loads.act:
            accuracy = min(accuracy, self._unloaded_accuracy)
        return accuracy / 3

    def next_intervals(self, error: float, intervals: int, target: float) -> int | None:
        """Return the finer grid that should meet the target, or None where this one does or the grid is given."""
        return next_intervals(self.numerics, error, intervals, target)

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
        column = self._column.copy()
        for name, at in self._places.items():
            value = values.get(name)
            if value is None:
                column[at] = self.quantities[name].nominal
            elif value is not self._numbers[name]:
                column[at] = np.ravel(value)
        return column

    def _stretch(self, values: Mapping[str, Any]) -> float:
        """Return the stretch on the branch from zero pressure at the pressure in `values`."""
        return self.branch_at(values).stretch

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
        correction = richardson * discretisation_correction(grid.problem, solution, grid.corrector)
        tip = grid.last_state(correction)
        nodes = grid.nodes(solution.x)
        constants = grid.constants(solution)
        if not np.all(np.isfinite(tip)):
            raise np.linalg.LinAlgError("its discretisation error is not finite")
        off, turned = grid.tip_error(tip, solution)
        return Solved(
            compiled=lambda: grid,
            intervals=grid.intervals,
            solution=solution,
            nodes=nodes,
            limit=grid.nodes(solution.x + correction),
            constants=constants,
            error=off,
            rotation_error=turned,
            stable=not loaded or self._conjugate_points(grid, nodes, constants, solution) == 0,
        )

    def _conjugate_points(self, grid: Grid, nodes: Array, constants: Array, solution: Solution) -> int:
        return self.equations.conjugate_points(nodes, constants)

    def _closed(
        self, pressure: Array, loads: Loads, found: Solved, iterations: int, began: float
    ) -> tuple[Step, Solved | None]:
        """Let IPOPT close a solution, where it takes part, and return its step."""
        if self.numerics.engine == "auto":
            grid = found.grid
            try:
                solution = closed(grid.reference, found.solution, self.numerics, grid.tip)
            except DisputedError as error:
                seconds = time.perf_counter() - began
                return Step(pressure, Status.DISPUTED, str(error), iterations=iterations, solve_time=seconds), None
            if solution is not found.solution:
                nodes, constants = grid.nodes(solution.x), grid.constants(solution)
                found = replace(found, solution=solution, nodes=nodes, constants=constants, shot=None)
        return self._step(pressure, loads, found, iterations, began), found

    def _step(self, pressure: Array, loads: Loads, found: Solved, iterations: int, began: float) -> Step:
        return solved_step(self.equations, self.model, self.numerics, pressure, loads, found, iterations, began)
