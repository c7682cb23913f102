"""Solving one blocked pose after another: the free shape, where contact begins, and the branch from there."""

from __future__ import annotations

import time
from copy import copy
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.numerics import Numerics, Transcribing
from softnlp.model.quantities import Model
from softnlp.model.rod import Loads
from softnlp.model.tip import TipContact
from softnlp.nlp.continuation import follow
from softnlp.nlp.solver import Solution
from softnlp.statics.blocked_grid import Blocked, BlockedGrid, kept_grid, transferred
from softnlp.statics.blocked_refine import examined, refined, stepwise, to_accuracy
from softnlp.statics.blocked_resume import (
    LARGEST_JUMP,
    MOST_STEPS,
    Ended,
    Reached,
    point_before,
    resumed,
    sound_error,
)
from softnlp.statics.blocked_step import failed_step, inaccurate_step, solved_step, touching_step
from softnlp.statics.closing import DisputedError, closed
from softnlp.statics.compiled import RodEquations, rod_equations
from softnlp.statics.free_shape import Free, FreeShapes, Route, free_shape, from_zero, route_from
from softnlp.statics.grid_size import search_grids
from softnlp.statics.loadcase import RodFunctions
from softnlp.statics.pose_grid import iteration_cost
from softnlp.statics.solver import SEARCHED_BY, PoseSolver
from softnlp.statics.step import Step
from softnlp.statics.wall import Situation, Wall, keeps_plane, slipping_pressure, with_closure

Array = NDArray[np.float64]

TOUCHING = 1e-9  # of the length: a free contact point nearer to the wall than this touches it
_NEAR_FOLD = 0.2  # of the largest in-plane determinant on the way: below it a branch that ends has turned
_FINEST_FIRST = 55  # intervals of a first grid, however far the free shape curls: the wall keeps the rod from that
_MOST_STEPS_MINIMUM = 24  # to a point of a path where that is a minimum, see `MOST_STEPS`
_MOST_WORK, _LEAST = 20_000, 100  # to follow a branch, in intervals of Newton's iterations; iterations on any grid
_LEAST_WORK = 40_000  # the same of these iterations: on the finest grids they are fewer
_SAME_PLACE = 0.01  # of the way: two grids that lose the branch as near to each other lose it there
_SOUND = 0.5  # of the largest determinant: nearer to a fold an error is that of the place of the fold
_NEAR_END = 0.98  # of a path: a fold that a coarse grid finds beyond it may lie behind the end
_SURE = 1e-3  # estimated error of a shape on that grid below which the end of the branch after it is believed


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
        equations: RodEquations | None = None,
    ) -> None:
        self.model = model
        self.numerics = numerics
        self.contact = with_closure(model, contact)
        self.has_wall = wall
        # Without loads the free lengths and tip are taken from the closed form, so the grid need not show it.
        self.poses = poses or PoseSolver(model, numerics, unloaded_accuracy=numerics.accuracy)
        loads = (TipContact(contact.closure, wall),)
        self.equations = equations or rod_equations(model, loads, like=self.poses.equations)

    def with_contact(self, contact: ContactSettings) -> BlockedSolver:
        """Return a solver with other settings that shares what both need compiled."""
        if contact.closure != self.contact.closure:
            return BlockedSolver(self.model, self.numerics, contact, wall=self.has_wall, poses=self.poses)
        other = copy(self)
        other.contact = contact
        return other

    @property
    def functions(self) -> RodFunctions:
        """The rod under the closure, see `RodFunctions`."""
        return self.equations.functions

    def with_model(self, model: Model) -> BlockedSolver:
        """Return a solver for other numbers that shares what is compiled; `ValueError` for another `Model.kind`."""
        other = copy(self)
        other.model, other.poses = model, self.poses.with_model(model)
        return other

    def grid(self, intervals: int, plane: Array | None, name: Transcribing | None = None) -> BlockedGrid:
        """Return what is compiled on a grid and in a plane (None: in space), transcribed as the numerics say, or so."""
        weights = self.contact.weights if self.contact.closure == "weighted" else None
        numerics = replace(self.numerics, transcription=name) if name else self.numerics
        return kept_grid(self.equations, numerics, weights, intervals, plane)

    def solve(
        self, pressure: Array, loads: Loads, wall: Wall | None, near: Blocked | None = None
    ) -> tuple[Step, Blocked | None]:
        """Solve one blocked pose, followed from a neighbouring solution or from zero pressure with the wall in place.

        pressure : (sets,) [Pa], not negative. Never raises for a pose that cannot be solved.
        """
        began = time.perf_counter()
        situation = Situation(np.asarray(pressure, float), loads, wall)
        free_loads = loads if self.has_wall else Loads()  # without a wall the chambers keep their unloaded lengths
        free = free_shape(self.poses, situation.pressure, free_loads, self.contact.tip_cap, near.free if near else None)
        if isinstance(free, Step):
            return replace(free, solve_time=time.perf_counter() - began), None
        touch = TOUCHING + 3 * free.error if situation.loads.act else TOUCHING
        if wall is not None:
            ahead = wall.gap(free.contact_point)
            if ahead > -touch * self.model.length:
                free_step = free.step or self.poses.solve(situation.pressure, loads)[0]
                if free_step.pose is None:
                    return free_step, None
                step = touching_step(free_step, self.contact, wall, ahead, touch * self.model.length)
                return replace(step, solve_time=time.perf_counter() - began), None
        found, spent = self._settle(situation, free, near)
        spent += free.iterations
        if isinstance(found, Ended):
            return failed_step(
                situation.pressure, found.situation.pressure, found.folded, found.stopped, spent, began
            ), None
        if self._is_rough(found):
            return inaccurate_step(situation.pressure, found, spent, began), None
        try:
            found = self._closed(found)
        except DisputedError as error:
            seconds = time.perf_counter() - began
            return Step(situation.pressure, Status.DISPUTED, str(error), iterations=spent, solve_time=seconds), None
        pose = free.pose(self.poses)
        return solved_step(self.poses, self.functions, self.contact, found, pose, spent, began), found

    def _closed(self, found: Blocked) -> Blocked:
        """Let IPOPT close a solution, where it takes part. Raises `DisputedError` where it does not confirm it."""
        grid = found.grid
        solution = closed(grid.reference, found.solution, self.numerics, grid.tip)
        return found if solution is found.solution else replace(found, solution=solution)

    def _settle(self, situation: Situation, free: Free, near: Blocked | None) -> tuple[Blocked | Ended, int]:
        """Follow the branch to a situation and refine the grid until its accuracy is met."""
        plane = self.plane(situation)
        pressed = np.array([float(situation.pressure[k] > 0) for k in self.model.section.set_of_chamber])
        first = self.poses.first_intervals(free.column, free.stretch)
        first = self.numerics.intervals or (min(first, _FINEST_FIRST) if situation.wall is not None else first)
        intervals = near.grid.intervals if near else first
        spent = 0
        found: Blocked | Ended | None = None
        usable = near is not None and self._leads_to(near, situation, pressed, plane)
        if near is not None and usable:
            found = self._continued(self.grid(intervals, plane), situation, pressed, free, plane, near)
            spent += found.solution.iterations if found is not None else 0
        for start in [near, None] if usable else [None]:
            if not isinstance(found, Blocked):
                found, more = self._searched(situation, pressed, free, plane, intervals, start)
                spent += more
        assert found is not None
        found, more = self._to_accuracy(found, plane)
        spent += more
        if usable and self._is_rough(found):  # the neighbour's grid was too coarse for this shape: its word is no good
            found, more = self._searched(situation, pressed, free, plane, first, None)
            found, further = self._to_accuracy(found, plane)
            spent += more + further
        return found, spent

    def _is_rough(self, found: Blocked | Ended) -> bool:
        """Whether a solution misses the accuracy on grids that nobody chose."""
        return isinstance(found, Blocked) and self.numerics.intervals is None and found.error > self.numerics.accuracy

    def _to_accuracy(self, found: Blocked | Ended, plane: Array | None) -> tuple[Blocked | Ended, int]:
        """Return a solution on a grid that meets the accuracy, or the finest that has it, and the iterations."""
        if isinstance(found, Ended):
            return found, 0
        wanted = partial(self.poses.next_intervals, target=self.poses.numerics.accuracy / 3)
        return to_accuracy(found, wanted, lambda there, size: self._refined(there, self.grid(size, plane)))

    def _searched(
        self, situation: Situation, pressed: Array, free: Free, plane: Array | None, first: int, near: Blocked | None
    ) -> tuple[Blocked | Ended, int]:
        """Follow the branch from `near` or zero pressure, on a coarse grid where its word is good, to one of `first`.

        A fold costs many steps that all fail, so it is worth finding where a step is cheap.
        """
        spent, route = 0, self._route(situation, free, near)
        own, given, left = self.numerics.transcription, self.numerics.intervals is not None, _MOST_WORK
        like = first if own == SEARCHED_BY else 2 * first  # intervals of shooting that show as much
        tried = search_grids(first, own, SEARCHED_BY, once=given or near is not None)
        before, lost = None, 0.0

        def searched(size: int) -> BlockedGrid:
            return self.grid(size, plane, SEARCHED_BY)

        for size, name in tried:
            cost, shown = iteration_cost(size, name), name == own and size >= first
            grid = self.grid(size, plane, name)
            most = max(left // cost, min(_LEAST, _LEAST_WORK // size))
            found = self._followed(grid, route, situation, pressed, free, plane, near, most, before)
            before = found.before if isinstance(found, Ended) else None
            more = found.solution.iterations if isinstance(found, Blocked) else found.iterations
            spent, left = spent + more, left - more * cost
            if isinstance(found, Ended) and found.folded and (shown or size >= like or found.error <= _SURE):
                break
            if isinstance(found, Ended):
                if lost > 0 and not found.stopped and abs(found.fraction - lost) <= _SAME_PLACE:
                    break  # a finer grid loses it where the last one did
                lost = found.fraction
            if isinstance(found, Blocked):
                finer = found if shown else stepwise(found, self.grid(first, plane), searched, self._refined)
                if finer is not None:
                    return finer, spent + (0 if finer is found else finer.solution.iterations)
        return found, spent

    def plane(self, situation: Situation) -> Array | None:
        """Return the normal of the plane in which wall, pressures and loads keep the rod, or None in space."""
        plane = situation.wall.plane if situation.wall is not None else None
        if plane is None:
            return None
        column = self.poses.column(self.poses.values(situation.pressure, situation.loads))
        section = np.asarray(self.functions.section(column, 1.2)[0]).ravel()
        return plane if keeps_plane(plane, section, situation.loads) else None

    def _leads_to(self, near: Blocked, situation: Situation, pressed: Array, plane: Array | None) -> bool:
        """Whether the sequence only rises from a solution to a situation, so that its branch is the followed one."""
        here = near.situation
        rises = bool(np.all(situation.pressure >= here.pressure))
        same_plane = (self.plane(here) is None) == (plane is None)
        return rises and here.turned_as(situation) and same_plane and bool(np.all(near.pressed == pressed))

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

    def _continued(
        self, grid: BlockedGrid, end: Situation, pressed: Array, free: Free, plane: Array | None, near: Blocked
    ) -> Blocked | None:
        """Solve at once from a neighbouring solution on the same grid; None where that leads off its branch."""
        if grid is not near.grid:
            return None
        p = grid.problem.pack(self.values(end, pressed, free.lengths))
        x = near.solution.x
        guess = grid.predicted(x, p) if grid.has_tangent else x
        rough = grid.stepper.solve(p, guess)
        if not rough.holds(10 * grid.stepper.tolerance) or not grid.distance(rough.x - x) <= LARGEST_JUMP:
            return None
        if grid.has_tangent and grid.strayed(guess - x, rough.x - x) > 1:
            return None
        determinants = grid.determinants(rough, plane)
        if not grid.is_minimum and determinants[0] * near.determinants[0] <= 0:
            return None
        return self._arrived(
            grid, rough, near.situation, end, pressed, free, [(0.0, near.determinants), (1.0, determinants)], near
        )

    def _arrived(
        self,
        grid: BlockedGrid,
        rough: Solution,
        begin: Situation,
        end: Situation,
        pressed: Array,
        free: Free,
        trace: list[tuple[float, tuple[float, float]]],
        near: Blocked | None,
    ) -> Blocked | None:
        """Solve to the end what a path led to; None where that leads elsewhere.

        trace : (fraction of the way from `begin`, determinants in and out of the plane).
        """
        final = grid.engine.solve(rough.p, rough.x)
        if not final.holds(self.numerics.tolerance) or grid.distance(final.x - rough.x) >= 0.01:
            return None
        final = replace(final, iterations=final.iterations + rough.iterations)
        slips = near.slips if near is not None else None
        if slips is None:
            slips = slipping_pressure(begin, end, [(u, aside) for u, (_, aside) in trace])
        return examined(grid, final, end, pressed, (slips, trace[-1][1]), free)

    def _route(self, end: Situation, free: Free, near: Blocked | None) -> Route:
        """Return the way to `end` from `near`, or from where contact begins on the way from zero pressure."""
        intervals = self.poses.first_intervals(free.column, free.stretch, transcription=SEARCHED_BY)
        solved = free.solved  # the lengths on the way lead, only those at its end count
        if solved is not None and solved.grid.transcription == SEARCHED_BY:
            intervals = min(intervals, solved.intervals)
        shapes = FreeShapes(self.poses, self.functions, intervals, self.contact.tip_cap)
        if near is None:
            return from_zero(end, shapes, TOUCHING * self.model.length)
        solved = near.free.solved
        on_grid = solved is not None and solved.grid is self.poses.grid(intervals, SEARCHED_BY)
        start = near.free.stretch, solved.solution.x if solved and on_grid else None
        return route_from(near.situation, end, shapes, start)

    def _followed(
        self,
        grid: BlockedGrid,
        route: Route,
        end: Situation,
        pressed: Array,
        free: Free,
        plane: Array | None,
        near: Blocked | None,
        most: int,
        before: Reached | None = None,
    ) -> Blocked | Ended:
        """Follow the branch along a route to `end`, in so many iterations at most.

        before : where another grid came on it, which this one goes on from where it has the same point.
        """
        begin, shapes = route.begin, route.shapes
        shapes.begin(*route.start)

        def path(u: float) -> Array:
            lengths = free.lengths if u >= 1.0 else route.lengths(u)
            return grid.problem.pack(self.values(begin.towards(end, u), pressed, lengths))

        trace: list[tuple[float, tuple[float, float]]] = []
        sound: list[tuple[float, Solution]] = []
        begun, first = resumed(grid, self.equations.shape, path, plane, before), 0.0
        if begun is not None and before is not None:
            first, trace = before.fraction, list(before.trace)
        else:
            shapes.begin(*route.start)
            if near is not None:
                x = transferred(near, grid.case, self.equations.shape)
            else:
                free_x = shapes.guess(begin, grid.case.transcribed.points)
                x = np.concatenate([free_x, np.zeros(self.functions.tip_unknowns)])
            begun = grid.stepper.solve(path(0.0), x)
        points: list[Solution | None] = [None] * len(trace)  # what another grid passed is not gone back to

        def along(v: float) -> float:
            """Return the fraction of the whole way."""
            return 1.0 if v >= 1.0 else first + v * (1 - first)

        def same_branch(u: float, solution: Solution) -> bool:
            determinants = grid.determinants(solution, plane)
            if trace and not grid.is_minimum and determinants[0] * trace[0][1][0] <= 0:
                return False
            trace.append((u, determinants))
            points.append(solution)
            if abs(determinants[0]) >= _SOUND * max(abs(size) for _, (size, _) in trace):
                sound.append((u, solution))
            return True

        if begun.holds(10 * grid.stepper.tolerance):
            same_branch(first, begun)
        first_step = 0.5 if near is not None else 0.25
        followed = follow(
            grid.stepper,  # type: ignore[arg-type]
            lambda v: path(along(v)),
            begun.x,
            distance=grid.distance,
            first_step=first_step if before is None or not first else min(before.step / (1 - first), first_step),
            smallest_step=1 / 2048 / (1 - first),
            largest_jump=LARGEST_JUMP,
            same_branch=lambda v, solution: same_branch(along(v), solution),
            predict=grid.predicted if grid.has_tangent else None,
            most_iterations=most,
            most_steps=_MOST_STEPS_MINIMUM if grid.is_minimum else MOST_STEPS,
            strayed=grid.strayed,
        )
        spent = begun.iterations + followed.iterations
        if followed.arrived:
            rough = replace(followed.solution, iterations=spent)
            found = self._arrived(grid, rough, begin, end, pressed, free, trace, near)
            if found is not None:
                return found
        fraction = along(followed.fraction)
        reached = begin.towards(end, fraction)
        sizes = [abs(size) for _, (size, _) in trace]
        stopped = followed.iterations >= most
        folded = not stopped and len(sizes) > 1 and (grid.is_minimum or sizes[-1] < _NEAR_FOLD * max(sizes))
        error = sound_error(grid, self.equations.shape, path, sound, before) if folded and fraction < _NEAR_END else 1.0
        before = point_before(grid, trace, points, sound, fraction, (begin, end), pressed, free) or before
        return Ended(reached, folded, spent, error, stopped, before, fraction)

    def _refined(self, found: Blocked, grid: BlockedGrid) -> Blocked | None:
        """Return a solution solved again on a finer grid, or None where that leads elsewhere."""
        p = grid.problem.pack(self.values(found.situation, found.pressed, found.free.lengths))
        return refined(found, grid, p, self.equations.shape, self.numerics.tolerance, self.plane(found.situation))
