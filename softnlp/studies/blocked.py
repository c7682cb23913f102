"""Solving one blocked pose after another: the free shape, where contact begins, and the branch from there."""

from __future__ import annotations

import time
from copy import copy
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.condensed import CondensedSolver
from softnlp.contact_settings import ContactSettings
from softnlp.continuation import follow
from softnlp.loadcase import LoadCase, load_case, rod_functions
from softnlp.numerics import Numerics
from softnlp.problem import CompiledProblem, compile_problem
from softnlp.quantities import Model
from softnlp.rod import STATE_SIZE, Loads
from softnlp.solver import Engine, Solution, discretisation_correction
from softnlp.studies.blocked_grid import Blocked, BlockedGrid
from softnlp.studies.blocked_step import failed_step, solved_step, touching_step
from softnlp.studies.free_shape import FreeShapes
from softnlp.studies.pose import between_nodes, shape_function
from softnlp.studies.statics import MOST_INTERVALS, PoseSolver, Solved
from softnlp.studies.step import Step
from softnlp.studies.wall import Situation, Wall
from softnlp.studies.weighted import Weighted
from softnlp.tip import tip_conditions
from softnlp.transcription import MultipleShooting, method_named

Array = NDArray[np.float64]

_TOUCHING = 1e-9  # of the length: a free contact point nearer to the wall than this touches it
_SCAN = 17
_NEAR_FOLD = 0.2  # of the largest in-plane determinant on the way: below it a branch that ends has turned
_LARGEST_JUMP = 0.3


@dataclass(frozen=True, eq=False)
class _Ended:
    """Where a branch was lost: the situation reached, whether it had turned, iterations spent."""

    situation: Situation
    folded: bool
    iterations: int


class BlockedSolver:
    """Solves blocked poses of one model under one closure; compiled grids are kept between poses.

    contact : closure, tip cap and weights; the wall is given with each pose, and without one (`wall` false) the closure
    holds the chambers under the dead loads alone.
    """

    def __init__(
        self,
        model: Model,
        numerics: Numerics,
        contact: ContactSettings,
        *,
        wall: bool = True,
        poses: PoseSolver | None = None,
    ) -> None:
        self.model = model
        self.numerics = numerics
        self.contact = contact
        self.has_wall = wall
        # Without loads the free lengths and tip are taken from the closed form, so the grid need not show it.
        self.poses = poses or PoseSolver(model, numerics, unloaded_accuracy=numerics.accuracy)
        self.functions = rod_functions(model, tip_conditions(contact.closure, wall=wall))
        self._declared = self.functions.declared()
        self._transfer = shape_function(self.functions.field)
        self._grids: dict[tuple[int, bytes], BlockedGrid] = {}
        self._compiled: dict[int, tuple[LoadCase, CompiledProblem, CondensedSolver]] = {}

    def with_contact(self, contact: ContactSettings) -> BlockedSolver:
        """Return a solver with other settings that shares what both need compiled."""
        other = BlockedSolver(self.model, self.numerics, contact, wall=self.has_wall, poses=self.poses)
        if contact.closure == self.contact.closure:
            other.functions, other._compiled = self.functions, self._compiled
        return other

    def with_model(self, model: Model) -> BlockedSolver:
        """Return a solver for a model of the same chambers, law and conventions; it shares what is compiled."""
        other = copy(self)
        other.model, other.poses = model, self.poses.with_model(model)
        return other

    def grid(self, intervals: int, plane: Array | None) -> BlockedGrid:
        """Return the compiled problem on a grid and in a plane (None: in space), building it at first use."""
        key = (intervals, b"" if plane is None else np.round(plane, 12).tobytes())
        if key in self._grids:
            return self._grids[key]
        shooting = MultipleShooting(intervals)
        if intervals not in self._compiled:
            method = method_named(self.numerics.transcription, intervals)
            case = load_case("blocked", self.functions, self._declared, method)
            problem = compile_problem(list(self._declared.values()), [case])
            self._compiled[intervals] = (case, problem, CondensedSolver(self.functions, shooting))
        case, problem, judge = self._compiled[intervals]
        condensed = CondensedSolver(self.functions, shooting, plane)
        linear = condensed if self.numerics.transcription == "multiple-shooting" else None
        exact = Engine(problem, linear=linear)
        loose = Engine(problem, linear=linear, newton_only=linear is not None, max_iterations=8, tolerance=1e-7)
        engine: Engine | Weighted = exact
        stepper: Engine | Weighted = loose
        if self.contact.closure == "weighted":
            engine, stepper = (
                Weighted(e, self.functions, case, condensed, plane, self.contact.weights) for e in (exact, loose)
            )
        self._grids[key] = BlockedGrid(case, engine, stepper, condensed, judge, intervals, self.functions.state_size)
        return self._grids[key]

    def solve(
        self, pressure: Array, loads: Loads, wall: Wall | None, near: Blocked | None = None
    ) -> tuple[Step, Blocked | None]:
        """Solve one blocked pose, followed from a neighbouring solution or from zero pressure with the wall in place.

        pressure : (sets,) [Pa], not negative. Never raises for a pose that cannot be solved.
        """
        began = time.perf_counter()
        situation = Situation(np.asarray(pressure, float), loads, wall)
        free_loads = loads if self.has_wall else Loads()  # without a wall the chambers keep their unloaded lengths
        free_step, free = self.poses.solve(situation.pressure, free_loads, near.free if near else None)
        if free is None or free_step.pose is None:
            return free_step, None
        touch = _TOUCHING + 3 * free.error if situation.is_loaded else _TOUCHING
        if wall is not None:
            ahead = wall.gap(self.free_tip(free)[1])
            if ahead > -touch * float(self.model.robot.length):
                step = touching_step(free_step, self.contact, wall, ahead, touch * float(self.model.robot.length))
                return replace(step, solve_time=time.perf_counter() - began), None
        found, spent = self._settle(situation, free, near)
        spent += free_step.iterations
        if isinstance(found, _Ended):
            return failed_step(situation.pressure, found.situation.pressure, found.folded, spent, began), None
        return solved_step(self.poses, self.functions, self.contact, found, free_step, spent, began), found

    def _settle(self, situation: Situation, free: Solved, near: Blocked | None) -> tuple[Blocked | _Ended, int]:
        """Follow the branch to a situation and refine the grid until its accuracy is met."""
        plane = self.plane(situation)
        pressed = np.array([float(situation.pressure[k] > 0) for k in self.model.robot.set_of_chamber])
        first = self.numerics.intervals or self.poses.first_intervals(free.solution.p, float(free.solution.x[0]))
        intervals = near.grid.intervals if near else first
        spent = 0
        found: Blocked | _Ended | None = None
        usable = near is not None and self._leads_to(near, situation, pressed, plane)
        if near is not None and usable:
            found = self._followed(self.grid(intervals, plane), situation, pressed, free, plane, near)
            spent += found.solution.iterations if isinstance(found, Blocked) else found.iterations
        if not isinstance(found, Blocked):
            for _ in range(2):
                found = self._followed(self.grid(intervals, plane), situation, pressed, free, plane, None)
                spent += found.solution.iterations if isinstance(found, Blocked) else found.iterations
                if isinstance(found, Blocked) or found.folded or self.numerics.intervals is not None:
                    break
                intervals *= 2
        target = self.poses.numerics.accuracy / 3
        while isinstance(found, Blocked):
            intervals = found.grid.intervals
            wanted = self.poses.next_intervals(found.refinement_error, intervals, target)
            if wanted is None or intervals >= MOST_INTERVALS:
                break
            finer = self._refined(found, self.grid(min(wanted, MOST_INTERVALS), plane))
            if finer is None:
                break
            spent += finer.solution.iterations
            found = finer
        assert found is not None
        return found, spent

    def plane(self, situation: Situation) -> Array | None:
        """Return the normal of the plane in which wall, pressures and loads keep the rod, or None in space."""
        plane = situation.wall.plane if situation.wall is not None else None
        if plane is None:
            return None
        column = self.poses.column(self.poses.values(situation.pressure, situation.loads))
        c = np.asarray(self.functions.section(column, 1.2)[0]).ravel()
        section_plane = abs(c[2] - c[3]) <= 1e-9 * abs(c[2]) or min(abs(plane[0]), abs(plane[1])) <= 1e-12
        moment = np.array([c[6], c[7], 0.0])
        along = np.cross(plane, [0.0, 0.0, 1.0])
        up = np.array([0.0, 0.0, 1.0])
        pairs = [(moment, along), (np.asarray(situation.loads.tip_moment, float), along)]
        pairs += [(np.asarray(situation.loads.tip_moment, float), up)]
        pairs += [(np.asarray(v, float), plane) for v in (situation.loads.tip_force, situation.loads.gravity)]
        flat = all(abs(v @ d) <= 1e-9 * max(float(np.linalg.norm(v)), 1e-300) for v, d in pairs)
        return plane if section_plane and flat else None

    def _leads_to(self, near: Blocked, situation: Situation, pressed: Array, plane: Array | None) -> bool:
        """Whether the sequence only rises from a solution to a situation, so that its branch is the followed one."""
        here = near.situation
        walls = here.wall is not None and situation.wall is not None
        same_wall = not walls or (here.wall is not None and situation.wall is not None
                                  and bool(np.all(here.wall.normal == situation.wall.normal)))  # fmt: skip
        rises = bool(np.all(situation.pressure >= here.pressure))
        same_plane = (self.plane(here) is None) == (plane is None)
        return rises and same_wall and same_plane and bool(np.all(near.pressed == pressed))

    def values(self, situation: Situation, pressed: Array, free_lengths: Array) -> dict[str, Any]:
        """Return the quantities that a blocked pose sets."""
        values = self.poses.values(situation.pressure, situation.loads)
        if situation.wall is not None:
            values["contact.wall_point"] = situation.wall.point
            values["contact.wall_normal"] = situation.wall.normal
        values["contact.tip_cap"] = self.contact.tip_cap
        values["contact.chamber_reaction"] = self.model.coefficients.chamber_reaction
        values["contact.free_lengths"] = free_lengths
        values["contact.pressed"] = pressed
        return values

    def _followed(
        self,
        grid: BlockedGrid,
        end: Situation,
        pressed: Array,
        free: Solved,
        plane: Array | None,
        near: Blocked | None,
    ) -> Blocked | _Ended:
        """Follow the branch to `end` from `near`, or from where contact begins on the way from zero pressure."""
        shapes = FreeShapes(self.poses, self.functions, free.intervals, self.contact.tip_cap)
        unloaded = not self.has_wall
        if near is not None:
            begin, t_0 = near.situation, 0.0
            shapes.begin(
                float(near.solution.x[0]), near.free.solution.x if near.free.intervals == free.intervals else None
            )
        else:
            begin, t_0 = self._from_zero(end, shapes)

        def free_situation(situation: Situation) -> Situation:
            return Situation(situation.pressure, Loads(), None) if unloaded else situation

        def path(u: float) -> Array:
            situation = begin.towards(end, t_0 + u * (1 - t_0))
            lengths = free_lengths if u >= 1.0 else shapes.tip(free_situation(situation))[0]
            return grid.problem.pack(self.values(situation, pressed, lengths))

        free_lengths = self.free_tip(free)[0]
        if near is not None:
            x = self._transferred(near, grid)
        else:
            first = begin.towards(end, t_0)
            x = self._free_guess(grid, first, shapes)
        trace: list[tuple[float, float]] = []
        sideways: list[tuple[float, float]] = [] if near is None else [(0.0, near.sideways)]

        def same_branch(u: float, solution: Solution) -> bool:
            size = grid.determinant(solution)
            if trace and size * trace[0][1] <= 0:
                return False
            trace.append((u, size))
            if near is None or u >= 1.0:
                sideways.append((u, grid.sideways(solution, plane)))
            return True

        begun = grid.stepper.solve(path(0.0), x)
        if begun.holds(10 * grid.stepper.tolerance):
            same_branch(0.0, begun)
        followed = follow(
            grid.stepper,  # type: ignore[arg-type]
            path,
            begun.x,
            distance=grid.distance,
            first_step=1.0 if near is not None else 0.25,
            smallest_step=1 / 2048,
            largest_jump=_LARGEST_JUMP,
            same_branch=same_branch,
        )
        spent = begun.iterations + followed.iterations
        if followed.arrived:
            final = grid.engine.solve(path(1.0), followed.solution.x)
            if final.holds(self.numerics.tolerance) and grid.distance(final.x - followed.solution.x) < 0.01:
                final = replace(final, iterations=final.iterations + spent)
                aside = self._slips(begin, end, t_0, sideways, near), sideways[-1][1]
                return self._examined(grid, final, end, pressed, aside, free)
        reached = begin.towards(end, t_0 + followed.fraction * (1 - t_0))
        sizes = [abs(size) for _, size in trace]
        folded = len(sizes) > 1 and sizes[-1] < _NEAR_FOLD * max(sizes)
        return _Ended(reached, folded, spent)

    def _from_zero(self, end: Situation, shapes: FreeShapes) -> tuple[Situation, float]:
        """Return where a path from zero pressure begins, and the fraction of it at which contact is made for good.

        Where loads or the offset press the robot into the wall already at rest, they grow with the pressure.
        """
        nothing = np.zeros_like(end.pressure)
        shapes.begin(1.0, None)
        if end.wall is None:
            return Situation(nothing, Loads(), None), 0.0
        touch = _TOUCHING * float(self.model.robot.length)
        rest = Situation(nothing, end.loads, end.wall)
        ahead = end.wall.gap(shapes.tip(rest)[1])
        if not ahead >= -touch:
            shapes.begin(1.0, None)
            tip = shapes.tip(Situation(nothing, Loads(), None))[1]
            shift = end.wall.gap(tip)
            shapes.begin(1.0, None)
            if shift < 0 or end.is_loaded:
                wall = Wall(end.wall.point + min(shift, 0.0) * end.wall.normal, end.wall.normal)
                rest = Situation(nothing, Loads(), wall)

        def gap_at(t: float) -> float:
            situation = rest.towards(end, t)
            assert situation.wall is not None
            return situation.wall.gap(shapes.tip(situation)[1])

        grid = np.linspace(0, 1, _SCAN)
        gaps = np.array([gap_at(t) for t in grid[:-1]])
        apart = np.flatnonzero(gaps > touch)
        if apart.size == 0:
            shapes.begin(1.0, None)
            return rest, 0.0
        low, high = float(grid[apart[-1]]), float(grid[apart[-1] + 1])
        for _ in range(40):
            middle = (low + high) / 2
            low, high = (middle, high) if gap_at(middle) > 0 else (low, middle)
        return rest, high

    def _free_guess(self, grid: BlockedGrid, situation: Situation, shapes: FreeShapes) -> Array:
        """Return x of the free shape without force: exact without loads, else its solution moved to this grid."""
        column = self.poses.column(self.poses.values(situation.pressure, situation.loads))
        stretch = shapes.stretch(column)
        s = grid.case.transcribed.points
        states = np.asarray(self.functions.arc(column, stretch, s[None, :]))
        if situation.is_loaded and self.has_wall:
            _, solved = self.poses.solve(situation.pressure, situation.loads)
            if solved is not None:
                nodes = np.vstack([solved.nodes, np.zeros((states.shape[0] - STATE_SIZE, solved.nodes.shape[1]))])
                moved = between_nodes(self._transfer, nodes, solved.constants, s)[: states.shape[0]]
                states = np.vstack([moved[:STATE_SIZE], states[STATE_SIZE:]])
        return np.concatenate([[stretch], states.T.ravel(), np.zeros(self.functions.tip_unknowns)])

    def free_tip(self, free: Solved) -> tuple[Array, Array]:
        """Return chamber lengths and contact point of a free shape [m], in closed form where no load acts on it."""
        column, cap = free.solution.p, self.contact.tip_cap
        sets, L_0 = self.model.robot.chamber_sets, float(self.model.robot.length)
        if not np.any(column[sets : sets + 9]):  # tip force, tip moment, gravity
            state = np.asarray(self.functions.arc(column, float(free.solution.x[0]), 1.0)).ravel()
            return state[STATE_SIZE:] * L_0, state[:3] * L_0 + cap * state[9:12]
        found = free.grid.problem.outputs(x=free.solution.x, p=column)
        axis = np.asarray(found["tip_rotation"])[:, 2]
        return np.asarray(found["chamber_lengths"]).ravel(), np.asarray(found["tip_position"]).ravel() + cap * axis

    def _transferred(self, found: Blocked, grid: BlockedGrid) -> Array:
        """Return a solution on another grid."""
        if found.grid.intervals == grid.intervals:
            return found.solution.x
        s = grid.case.transcribed.points
        states = between_nodes(self._transfer, found.grid.nodes(found.solution.x), found.constants, s)[
            : grid.state_size
        ]
        return np.concatenate([found.solution.x[:1], states.T.ravel(), found.grid.tip_forces(found.solution.x)])

    def _refined(self, found: Blocked, grid: BlockedGrid) -> Blocked | None:
        """Return a solution solved again on a finer grid, or None where that leads elsewhere."""
        p = grid.problem.pack(self.values(found.situation, found.pressed, self.free_tip(found.free)[0]))
        guess = self._transferred(found, grid)
        solution = grid.engine.solve(p, guess)
        if not solution.holds(self.numerics.tolerance) or grid.distance(solution.x - guess) > 0.05:
            return None
        return self._examined(grid, solution, found.situation, found.pressed, (found.slips, found.sideways), found.free)

    def _slips(
        self, begin: Situation, end: Situation, t_0: float, sideways: list[tuple[float, float]], near: Blocked | None
    ) -> float | None:
        """Return the largest set pressure at which the out-of-plane determinant changed its sign, if it has."""
        if near is not None and near.slips is not None:
            return near.slips
        for (u, a), (w, b) in pairwise(sideways):
            if a * b < 0:
                crossing = u + (w - u) * a / (a - b)
                return float(np.max(begin.towards(end, t_0 + crossing * (1 - t_0)).pressure))
        return None

    def _examined(
        self,
        grid: BlockedGrid,
        solution: Solution,
        situation: Situation,
        pressed: Array,
        aside: tuple[float | None, float],
        free: Solved,
    ) -> Blocked:
        """Estimate the discretisation error of a solution."""
        linear = grid.engine.linear
        correction = discretisation_correction(grid.problem, solution, linear)
        order = method_named(self.numerics.transcription, 1).order
        change = correction * 2**order / (2**order - 1)
        tip = grid.nodes(change)[:, -1]
        position = float(np.linalg.norm(tip[:3]))
        rotation = float(np.linalg.norm(tip[3:12]) / np.sqrt(2))
        forces = grid.tip_forces(change) / np.maximum(1.0, np.abs(grid.tip_forces(solution.x)))
        force = float(np.max(np.abs(forces), initial=0.0))
        constants = np.asarray(grid.problem.case_constants(solution.x, solution.p)).ravel()
        worst = max(position, rotation / 5, force / 5)
        return Blocked(situation, pressed, grid, solution, constants, position, worst, *aside, free)
