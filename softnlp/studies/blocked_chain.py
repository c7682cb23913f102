"""The force of several segments against a wall at the tip: one case with the wall's push, followed along the pressure.

The wall holds the tip alone, as closure `free`: how the reaction of a chamber that ends at a junction would pass it is
not modelled. The branch begins where the free shape meets the wall on the way from zero pressure.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.status import Status
from softnlp.model.contact_settings import NO_CLOSURE, ContactSettings
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.rod import Loads
from softnlp.model.tip_wall import TipWall
from softnlp.nlp.transcription import method_named
from softnlp.statics.answer import Answer, follow, solve
from softnlp.statics.blocked_step import touching_step
from softnlp.statics.case import case
from softnlp.statics.chain import Chain
from softnlp.statics.chain_grid import ChainGrid
from softnlp.statics.chain_solver import ChainSolver
from softnlp.statics.chain_step import chain_step
from softnlp.statics.kept import pose_solver
from softnlp.statics.pose_grid import Solved, iteration_cost
from softnlp.statics.posed import Problem, problem
from softnlp.statics.step import Contact, Pose, Step
from softnlp.statics.wall import Wall, with_closure

Array = NDArray[np.float64]

_TOUCH = 1e-9  # of the length, beside three times the estimated error of the free shape
_SCAN = 9  # pressures at which the gap of the free shape is looked at
_ROUGHLY = 1e-3  # accuracy of free shapes on the way, and of the part of it at which one meets the wall
_COARSER, _FEWEST = 4, 20  # the wall holds the rod from curling: a first grid, and its intervals at least
_FINER = (1, 2, 4, 8)  # times as many intervals as the free shape's, until the accuracy is met
_SHOWN = 1e-2  # estimated error of the shape at first contact, up to which a coarse grid tells its branch
_SAME = 0.05  # scaled change of a solution on another grid below which it is the same one
_PULL = 1e-6  # of what bends the robot: less is no pull


def require_free(contact: ContactSettings) -> None:
    """Raise `InputError` for a closure that several segments do not have; that of the energy section is none."""
    if contact.closure not in ("free", NO_CLOSURE):
        raise InputError(
            f"expected 'free' with several segments or a section that varies, got {contact.closure_name!r}: how the "
            "reaction of a chamber passes a junction is not modelled",
            key="closure",
        )


@dataclass(frozen=True, eq=False)
class Held:
    """A blocked shape: its pressures (sets,) [Pa] and the answer, with the free shape there."""

    pressure: Array
    answer: Answer
    free: Solved


class ChainWall:
    """Solves blocked poses of a model of several segments against a wall under the same loads."""

    def __init__(self, model: Model, numerics: Numerics, contact: ContactSettings, loads: Loads) -> None:
        require_free(with_closure(model, contact))
        poses = pose_solver(model, numerics.without_ipopt() if numerics.engine == "auto" else numerics)
        assert isinstance(poses, ChainSolver)
        self.poses, self._numerics, self._contact, self._loads = poses, numerics, contact, loads
        coarse = replace(numerics.without_ipopt(), accuracy=max(numerics.accuracy, _ROUGHLY))
        self._rough_poses = pose_solver(model, coarse)

    def solve(self, pressure: Array, wall: Wall, near: Held | None = None) -> tuple[Step, Held | None]:
        """Solve one blocked pose, from a neighbour of less pressure or from zero. Never raises for a hard one."""
        began = time.perf_counter()
        step, free = self.poses.solve(pressure, self._loads, None if near is None else near.free)
        if step.pose is None or free is None:
            return step, None
        length = self.poses.model.length
        touch = (_TOUCH + 3 * free.error) * length
        gap = self._gap(step.pose, wall)
        if gap > -touch:
            found = touching_step(step, self._contact, wall, gap, touch)
            return replace(found, engine=self._numerics.engine, solve_time=time.perf_counter() - began), None
        answer = self._settled(free, pressure, wall, near)
        intervals, error = _intervals(answer), answer.discretisation_error
        if answer.status is Status.SOLVED:
            values, engine = self._values(pressure, wall), self._numerics.engine
            answer = solve(answer.problem, values, answer, engine=engine, ipopt=dict(self._numerics.ipopt))
        status, message = answer.status, answer.message
        if (
            status is Status.SOLVED
            and self._numerics.intervals is None
            and not (error or 0.0) <= self._numerics.accuracy
        ):
            status = Status.INACCURATE
            message = f"{status.advice}; with {intervals} intervals it is {error:.2g} L_0"
        if status is not Status.SOLVED:
            return Step(pressure, status, message, solve_time=time.perf_counter() - began), None
        return self._step(pressure, wall, answer, step.pose, gap, began), Held(pressure, answer, free)

    def _settled(self, free: Solved, pressure: Array, wall: Wall, near: Held | None) -> Answer:
        """Return the answer on the first grid that meets the accuracy, or the last one tried.

        A branch is followed on the grid of the neighbour or a coarse one, and its end solved again on a finer one;
        where that leads elsewhere it is followed on finer ones.
        """
        given, fewest = self._numerics.intervals, max(free.intervals // _COARSER, _FEWEST)
        first = [] if given else [fewest if near is None else _intervals(near.answer)]
        sizes = [*first, *([given] if given else [finer * free.intervals for finer in _FINER])]
        for k, size in enumerate(sizes):
            shown = np.inf if k or given else _SHOWN
            answer = self._followed(self._posed(size), pressure, wall, near, shown)
            if answer.status is not Status.SOLVED:
                if k < len(first):
                    continue
                break
            finer = self._finer(answer, pressure, wall)
            if finer is not None:
                return finer
        return answer

    def _finer(self, answer: Answer, pressure: Array, wall: Wall) -> Answer | None:
        """Return an answer on a grid that meets the accuracy, which its own may be; None where that leads elsewhere."""
        target = self._numerics.accuracy / 3
        for _ in _FINER:
            error = np.inf if answer.discretisation_error is None else answer.discretisation_error
            wanted = self.poses.next_intervals(error, _intervals(answer), target)
            if wanted is None:
                return answer
            if wanted > self.poses.most_intervals:
                return None
            found = self._moved(answer, self._posed(wanted), self._values(pressure, wall))
            if found is None or not self._pushes(found):
                return None
            answer = found
        return None

    def _grid(self, posed: Problem) -> ChainGrid:
        chain, engine = posed.cases[0], posed._engine(newton_only=True)
        assert isinstance(chain, Chain)
        assert chain.method is not None
        name = self._numerics.transcription
        cost = iteration_cost(chain.method.intervals, name)
        return ChainGrid(chain, engine, engine, engine, name, chain.method.order, cost)

    def _moved(self, answer: Answer, posed: Problem, values: Mapping[str, Any]) -> Answer | None:
        """Return an answer solved again on another grid; None where that leads elsewhere."""
        if answer.problem is posed:
            return answer
        before, grid, solution = self._grid(answer.problem), self._grid(posed), answer.solution
        pieces = before.pieces(before.nodes(solution.x), before.constants(solution), solution)
        added = solution.x[solution.x.size - before.case.added.numel() :]
        x = np.concatenate([grid.resampled(pieces, before.stretches(solution.x)), added])
        found = solve(posed, values, replace(answer, problem=posed, solution=replace(solution, x=x)), engine="newton")
        same = found.status is Status.SOLVED and grid.distance(found.solution.x - x) <= _SAME
        return found if same else None

    def _gap(self, pose: Pose, wall: Wall) -> float:
        return wall.gap(pose.tip_position + self._contact.tip_cap * pose.tip_rotation[:, 2])

    def _posed(self, intervals: int) -> Problem:
        """Return the problem of the body with the wall on a grid, compiled at first use."""
        equations, method = self.poses.equations, method_named(self._numerics.transcription, intervals)

        def made() -> Problem:
            return problem([case("pose", equations.body, loads=[TipWall()], method=method)])

        return equations.kept(("wall", method), made)

    def _values(self, pressure: Array, wall: Wall) -> dict[str, Any]:
        own = {"wall.point": wall.point, "wall.normal": wall.normal, "wall.cap": self._contact.tip_cap}
        return {**self.poses.values(pressure, self._loads), **own}

    def _followed(self, posed: Problem, pressure: Array, wall: Wall, near: Held | None, shown: float) -> Answer:
        """Return the answer at the end of the branch from a neighbour of less pressure, else from the first contact.

        shown : largest estimated error of the shape that it begins at.
        """
        end = self._values(pressure, wall)
        if near is not None and np.all(pressure >= near.pressure):
            begin = self._moved(near.answer, posed, near.answer.values)
            found = None if begin is None else follow(posed, begin, end)[-1]
            if found is not None and found.status is Status.SOLVED and self._pushes(found):
                return found
        part, place = self._first_contact(pressure, wall)
        start = solve(posed, self._values(part * pressure, place), engine="newton")
        if start.status is Status.SOLVED and (start.discretisation_error or 0.0) > shown:
            return replace(start, status=Status.INACCURATE, outputs={})
        if start.status is not Status.SOLVED:
            return start
        found = follow(posed, start, end)[-1]
        if found.status is Status.SOLVED and not self._pushes(found):
            message = f"{Status.DIVERGED.advice}; on the branch followed the wall would have to pull"
            return replace(found, status=Status.DIVERGED, message=message, outputs={})
        return found

    def _pushes(self, answer: Answer) -> bool:
        chain = answer.problem.cases[0]
        F_0 = float(np.asarray(answer.problem.compiled.units(answer.solution.x, answer.solution.p)).ravel()[1])
        assert isinstance(chain, Chain)
        return bool(answer["tip_forces"][0] >= -_PULL * F_0)

    def _first_contact(self, pressure: Array, wall: Wall) -> tuple[float, Wall]:
        """Return about the part of the pressure at which the free shape meets the wall for good, and the wall there.

        Where the robot is pressed into it already at rest the wall is the one that touches it then.
        """
        shapes: dict[float, Solved] = {}

        def gap(part: float) -> float:
            """Return the gap at a part, from the shape next below, whose grid is no finer than it needs."""
            below = max((known for known in shapes if known < part), default=None)
            near = None if below is None else shapes[below]
            step, found = self._rough_poses.solve(part * pressure, self._loads, near)
            if found is not None:
                shapes[part] = found
            return float("nan") if step.pose is None else self._gap(step.pose, wall)

        from scipy.optimize import brentq  # here: runs without a wall do without scipy

        scan = np.linspace(0, 1, _SCAN)
        known = np.array([gap(float(part)) for part in scan])
        ahead = np.flatnonzero(known > 0)
        if not ahead.size:
            return 0.0, Wall(wall.point + min(float(known[0]), 0.0) * wall.normal, wall.normal)
        last = int(ahead[-1])
        return float(brentq(gap, scan[last], scan[last + 1], xtol=_ROUGHLY)), wall

    def _step(self, pressure: Array, wall: Wall, answer: Answer, free: Pose, gap: float, began: float) -> Step:
        grid, solution = self._grid(answer.problem), answer.solution
        nodes, constants = grid.nodes(solution.x), grid.constants(solution)
        units, whole, _ = grid.units(solution)
        error = (answer.discretisation_error or 0.0) * float(units[0].max()) / whole
        found = Solved(lambda: grid, grid.intervals, solution, nodes, nodes, constants, error, 0.0, stable=True)
        step = chain_step(self.poses.body, self._numerics, pressure, self._loads, found, solution.iterations, began)
        assert step.pose is not None
        pressed = (pressure > 0)[_sets(self.poses)]
        contact = Contact(
            force=max(float(answer["tip_forces"][0]), 0.0),
            normal=wall.normal,
            wall_point=wall.point,
            tip_cap=self._contact.tip_cap,
            closure=self._contact.closure_name,
            chamber_reaction=np.zeros_like(free.chamber_length),
            free=free,
            gap=gap,
            length_error=float(pressed @ (free.chamber_length - step.pose.chamber_length)),
        )
        # Nothing here tells whether the equilibrium is a minimum: the energy's index is that of a free tip.
        return replace(step, pose=replace(step.pose, stable=None), contact=contact)


def _intervals(answer: Answer) -> int:
    """Return the intervals of each segment."""
    method = answer.problem.cases[0].method
    assert method is not None
    return method.intervals


def _sets(poses: ChainSolver) -> list[int]:
    """Return the set of each chamber of all segments."""
    found, before = list[int](), 0
    for segment in poses.body.segments:
        found += [before + own for own in segment.robot.set_of_chamber]
        before += segment.robot.chamber_sets
    return found
