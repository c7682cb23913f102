"""Solving one target after another: where to start, a coarse search, the grid that the pose needs, and the verdict.

A search runs in the pressures z [bar] with the exact Jacobian of the tip. It begins at the last target's pressure and
at places of a table of tips over the bounds: closed-form arcs where no load acts, else poses on a coarse grid. What it
finds is made exact on the grid that `PoseSolver` chooses for that pose, and judged by the pose that `PoseSolver` finds
at the pressure, started as for a single forward step: residual, stability, discretisation.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.base.units import BAR, DEGREE, MILLIMETRE
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.robot import SELF_INTERSECTION
from softnlp.model.rod import Loads
from softnlp.nlp.optimality import OPTIMAL, not_optimal
from softnlp.nlp.places import best_first, in_rounds, pattern_search
from softnlp.nlp.reduced import Point
from softnlp.nlp.solver import FROM_SOLUTION
from softnlp.statics.attempts import Work
from softnlp.statics.chain_solver import ChainSolver
from softnlp.statics.closing import DisputedError, closed
from softnlp.statics.kept import pose_solver
from softnlp.statics.pose_grid import Solved
from softnlp.statics.step import Aimed, Step
from softnlp.studies.inverse_problem import Program, Tips, coarse_intervals, pressure_limits
from softnlp.studies.targets import Aim, InverseTask, Target, aim_of

Array = NDArray[np.float64]
Start = tuple[Array, Point | Array | None, bool]
"""Pressures z [bar], states nearby (None: those of the arc), and whether it is where the last target's search ended."""

_STARTS, _MORE_STARTS = 4, 12  # more where every answer of the first is one that no robot takes
_COARSE_MET = 1e-7  # misfit of a coarse search that needs no better one [L_0]
_ROUNDS = 4
_SAME_SPOT = 1e-3  # of the cost: less is no nearer
_JUMP = 0.3  # of the bounds: more is a jump along a path
_SAME_PLACE = 1e-4  # [bar]
_FIRST_MOVE, _LAST_MOVE = 0.25, 1e-3  # of the search among stable poses, of the bounds
_MOST_POSES = 150  # that it solves
_MOST_WORK, _PER_POINT = 400_000, 3  # to search one target of several segments, see `Work`; iterations to a tip
_NO_BODY = "the target was found to be met only by a shape that no body can take"


@dataclass(frozen=True, eq=False)
class Found:
    """Where a coarse search ended: the point, the curvature of its residuals, whether the target is met there.

    continues : whether it began at the last target's pressure. cost : the weighed misfit [L_0].
    """

    point: Point
    second: Array
    met: bool
    continues: bool
    cost: float

    @property
    def rank(self) -> tuple[float, ...]:
        """What is met comes first, by the pressures it takes, then what is nearest."""
        return (not self.met, float(self.point.theta @ self.point.theta) if self.met else self.cost)


@dataclass(frozen=True, eq=False)
class Reached:
    """A judged answer: pressure (sets,) [Pa], its pose, the weighed misfit [L_0]."""

    pressure: Array
    step: Step
    solved: Solved
    aimed: Aimed
    cost: float


class InverseKinematics:
    """Meets targets of one task for one model under the same loads; what is compiled or tabulated is kept."""

    def __init__(
        self, model: Model, numerics: Numerics, loads: Loads, task: InverseTask, method: Literal["newton", "nlp"]
    ) -> None:
        self._numerics = numerics
        self.poses = pose_solver(model, numerics.without_ipopt() if numerics.engine == "auto" else numerics)
        self.loads = loads
        self.task = task
        self.limits, self._ended = pressure_limits(self.poses, task.lower, task.upper)
        self._method = "nlp" if numerics.engine == "ipopt" else method
        self._intervals: int | None = None
        # Several segments have no closed form that the search could move in; their arcs only begin it.
        self._chained = isinstance(self.poses, ChainSolver)
        self._arcs = None if self._chained else self._tips(None)
        if self._arcs is None or loads.act:
            self._coarse = self._tips(numerics.intervals or coarse_intervals(self.poses, self.limits))
        else:
            self._coarse = self._arcs

    def nearest(self, target: Target, near: Reached | None) -> tuple[Step, Reached | None]:
        """Find the pressure for one target, from the last one where there is one. Never raises for a hard target."""
        began = time.perf_counter()
        aim = aim_of(self.task, target, float(self.poses.model.robot.length))
        if self._ended is not None and float(self.limits.lower.sum()) > self.limits.largest_sum:
            lost = Step(self.task.lower, self._ended.status, self._ended.message, aimed=aim.aimed(None))
            return replace(lost, solve_time=time.perf_counter() - began), None
        best: Reached | None = None
        rejected: Step | None = None
        chosen = None
        work = Work(_MOST_WORK if self._chained else np.inf)
        for ends in (self._ends(aim, near, work), self._more_ends(aim, work)):
            for found in ends:
                judged = self._finished(aim, found)
                if isinstance(judged, Step):
                    rejected = judged
                    continue
                if best is None or judged.cost < best.cost * (1 - _SAME_SPOT):
                    best, chosen = judged, found
                if self._meets(aim, best) or judged.cost <= found.cost * (1 + _SAME_SPOT):
                    break
            if rejected is None or (best is not None and self._meets(aim, best)):
                break
        if rejected is not None and (best is None or not self._meets(aim, best)):
            searched = self._searched(aim, best, work)
            if searched is not None and (best is None or searched.cost < best.cost * (1 - _SAME_SPOT)):
                best, chosen = searched, None
        if best is None:
            step = rejected or Step(self.task.lower, Status.DIVERGED, Status.DIVERGED.advice)
            return replace(step, aimed=aim.aimed(None), solve_time=time.perf_counter() - began), None
        warnings = [*best.step.warnings, *self._jumped(best, chosen, near)]
        met, aimed = self._meets(aim, best), best.aimed
        if self._redundant(aim) or not met:
            left = self._left(aim, best, meets=met)
            aimed = replace(best.aimed, optimal=left <= OPTIMAL)
            if left > OPTIMAL:
                warnings.append(not_optimal(left, "the search of pressures"))
        step = replace(best.step, aimed=aimed, warnings=tuple(warnings))
        if self._numerics.engine == "auto":
            step = self._closed(aim, best.solved, step, only_pose=rejected is not None, meets=met)
        step = replace(step, solve_time=time.perf_counter() - began)
        if not step.status.has_solution:
            return step, None
        if not met:
            step = replace(step, status=Status.OUT_OF_REACH, message=self._out_of_reach(aim, best, rejected, work))
        return step, best

    def _program(self, tips: Tips, aim: Aim, work: Work, *, meets: bool = False) -> Program:
        """Return the problem of a target on a grid, each of whose points takes off its share of the work."""
        program = tips.program(aim, meets=meets)
        if not self._chained or tips.intervals is None:
            return program
        grid = self.poses.grid(tips.intervals)

        def afford() -> bool:
            if work.used_up:
                return False
            work.spend(grid, _PER_POINT)
            return True

        return replace(program, afford=afford)

    def _ends(self, aim: Aim, near: Reached | None, work: Work) -> Iterator[Found]:
        """Return where coarse searches end, best first; the first that meets the target at once if no choice is left.

        With more sets than the target needs, every start is searched and the smallest pressures come first.
        """
        return best_first(
            self._starts(aim, near),
            partial(self._search, aim, work),
            enough=lambda found: found.met and not self._redundant(aim),
            place=lambda found: found.point.theta,
            same=_SAME_PLACE,
            rank=lambda found: found.rank,
        )

    def _more_ends(self, aim: Aim, work: Work) -> Iterator[Found]:
        """Yield where searches from further starts meet the target, where there are many ways to meet it."""
        if self._redundant(aim):
            tips = self._coarse.nearest(self._coarse.program(aim), _STARTS + _MORE_STARTS)[_STARTS:]
            found = (self._search(aim, work, (tip.theta, tip, False)) for tip in tips)
            yield from (one for one in found if one is not None and one.met)

    def _starts(self, aim: Aim, near: Reached | None) -> Iterator[Start]:
        """Yield where to begin: at the last pressure, then at places of the table."""
        if near is not None:
            yield near.pressure / BAR, self._coarse.moved(near.solved), True
        if self._arcs is not None and self._coarse is not self._arcs:
            # an arc is near enough to begin with, and costs nothing; most targets need no other start
            yield from ((arc.theta, None, False) for arc in self._arcs.nearest(self._arcs.program(aim), 1))
        yield from ((tip.theta, tip, False) for tip in self._coarse.nearest(self._coarse.program(aim), _STARTS))

    def _search(self, aim: Aim, work: Work, start: Start) -> Found | None:
        """Search on the coarse map from a start; None where there is no tip."""
        z, near, continues = start
        program = self._program(self._coarse, aim, work)
        begin = program.reduced.at(z, program.p, near)
        if begin is None and near is not None:
            begin = program.at(z)
        if begin is None:
            return None
        point, second = program.searched(begin)
        met = float(np.linalg.norm(point.r)) <= _COARSE_MET
        if met and self._redundant(aim):
            strict = self._program(self._coarse, aim, work, meets=True)
            least, second = strict.searched(strict.again(point))
            least = program.again(least)
            point = least if float(np.linalg.norm(least.r)) <= _COARSE_MET else point
        return Found(point, second, met, continues, float(np.linalg.norm(point.r)))

    def _left(self, aim: Aim, reached: Reached, *, meets: bool) -> float:
        """Return what the first-order conditions leave at an answer, on its pose's grid; inf where it has no slope."""
        tips = self._tips(reached.solved.intervals)
        program = tips.program(aim, meets=meets)
        point = program.at(reached.pressure / BAR, tips.moved(reached.solved))
        return float("inf") if point is None else program.could_gain(point)

    @cached_property
    def _moving(self) -> int:
        """How many sets the bounds let move."""
        return int(np.sum(self.limits.upper > self.limits.lower))

    def _redundant(self, aim: Aim) -> bool:
        """Whether there are more pressures to choose than the target has conditions."""
        return self._moving > aim.conditions

    def _finished(self, aim: Aim, found: Found) -> Reached | Step:
        """Make a coarse answer exact on the grid of its pose and judge it; a step where there is no stable pose."""
        exact = 0.3 * self.poses.numerics.accuracy
        lost: list[Step] = []

        def judge(pressure: Array) -> Reached | None:
            judged = self._at(aim, pressure)
            if isinstance(judged, Step):
                lost.append(judged)
                return None
            return judged

        def improve(judged: Reached, best: Reached | None) -> tuple[Reached, Array | None]:
            settled = best is not None and judged.cost >= best.cost * (1 - 1e-9)
            # A later one is of the pose's own grid; among answers as near it has the smaller pressures.
            better = judged if best is None or judged.cost <= best.cost * (1 + 1e-6) + exact else best
            unasked = best is None and self._method == "nlp"  # the program has not been solved yet
            intervals = judged.solved.intervals
            found_already = self._coarse is self._arcs and judged.cost <= found.cost + exact
            on_its_grid = self._intervals == intervals or not self._redundant(aim)
            if not unasked and (settled or found_already or (judged.cost <= exact and on_its_grid)):
                return better, None
            self._intervals = intervals
            refined = self._refined(aim, found, self._tips(intervals), judged.solved)
            stays = refined is not None and float(np.max(np.abs(refined - judged.pressure))) < 1e-9 * BAR
            return better, None if stays and not unasked else refined

        pressure = found.point.theta * BAR
        if self._intervals is not None and self._coarse is not self._arcs:
            begin = self._coarse.solved(self._coarse.program(aim), found.point)
            refined = self._refined(aim, found, self._tips(self._intervals), begin)
            pressure = pressure if refined is None else refined
        return in_rounds(pressure, judge, improve, _ROUNDS) or lost[0]

    def _refined(self, aim: Aim, found: Found, tips: Tips, solved: Solved) -> Array | None:
        """Return the pressure found again on a grid, from a pose nearby; None where Newton is lost."""
        program = tips.program(aim, meets=found.met and self._redundant(aim))
        begin = program.at(solved.solution.p[: self.task.lower.size] / BAR, tips.moved(solved))
        if begin is None:
            return None
        if self._method == "nlp":
            z = program.by_ipopt(begin)
            return None if z is None else z * BAR
        return program.searched(begin, found.second)[0].theta * BAR

    def _at(self, aim: Aim, pressure: Array) -> Reached | Step:
        """Return a stable pose that a body can take as an answer, else the step that says why there is none."""
        step, solved = self.poses.solve(pressure, self.loads)
        if step.pose is None or solved is None:
            return step
        fit, message = step.pose.fit, ""
        if step.pose.stable is False:
            message = (
                "the target was found to be met only by an equilibrium that is not stable: a robot buckles away from it"
            )
        elif fit.self_intersecting and SELF_INTERSECTION not in self.task.allow:
            message = f'{_NO_BODY}: {fit.warnings[-1]}; [robot] allow = ["{SELF_INTERSECTION}"] accepts it'
        if message:
            return Step(pressure, Status.OUT_OF_REACH, message, residual=step.residual, iterations=step.iterations)
        aimed = aim.aimed(step.pose)
        return Reached(pressure, step, solved, aimed, aim.cost(aimed))

    def _searched(self, aim: Aim, best: Reached | None, work: Work) -> Reached | None:
        """Search among stable poses without derivatives: where they end there is no slope to follow.

        It begins at the first stable pose of the table that is nearer than the best one known, or else at that one.
        """
        here = best
        program, shown = self._coarse.program(aim), self._coarse.intervals or 1

        def judge(z: Array) -> Reached | Step | None:
            if work.used_up:
                return None
            judged = self._at(aim, z * BAR)
            if self._chained:
                step, intervals = (
                    (judged, shown) if isinstance(judged, Step) else (judged.step, judged.solved.intervals)
                )
                work.spend(self.poses.grid(intervals), step.iterations)
            return judged

        for tip in self._coarse.nearest(program, below=np.inf if best is None else best.cost):
            judged = judge(tip.theta)
            if isinstance(judged, Reached) and (best is None or judged.cost < best.cost):
                here = judged
                break
        if here is None:
            return None
        reached = {(here.pressure / BAR).tobytes(): here}

        def cost(z: Array) -> float:
            judged = judge(z)
            if not isinstance(judged, Reached):
                return np.inf
            reached[z.tobytes()] = judged
            return judged.cost

        start = here.pressure / BAR, here.cost
        z = pattern_search(start, cost, self.limits, first=_FIRST_MOVE, last=_LAST_MOVE, most=_MOST_POSES)
        return reached[z.tobytes()]

    def _closed(self, aim: Aim, solved: Solved, step: Step, *, only_pose: bool, meets: bool) -> Step:
        """Return the step of an answer with IPOPT's word on the program that was searched, or `disputed`.

        only_pose : its pose at its pressures is closed, where the answer is the nearest of those that a body can take:
        stability and self-intersection are no rows of the program. So is a target that fewer sets meet than it has
        conditions: its misfit is flat where it is zero.
        """
        pose, whole = solved.solution, None
        if not (only_pose or self._moving == 0 or (meets and self._moving < aim.conditions)):
            program = self._tips(solved.intervals).program(aim, meets=meets)
            start = replace(pose, x=np.concatenate([step.pressure / BAR, pose.x]), p=program.p)
            whole = program.engine(**FROM_SOLUTION), start
        try:
            found = closed(solved.grid.reference, pose, self._numerics, solved.grid.tip, whole)
        except DisputedError as error:
            return Step(step.pressure, Status.DISPUTED, str(error), iterations=step.iterations, aimed=aim.aimed(None))
        return replace(step, engine=self._numerics.engine, ipopt=found.ipopt)

    def _meets(self, aim: Aim, reached: Reached) -> bool:
        """Whether a pose is within the accuracy asked for: of L_0, and as many radians."""
        accuracy = self.poses.numerics.accuracy
        distance, angle = reached.aimed.distance, reached.aimed.angle
        return (distance is None or distance <= accuracy * aim.length) and (angle is None or angle <= accuracy)

    def _jumped(self, best: Reached, chosen: Found | None, near: Reached | None) -> list[str]:
        """Return a warning where the answer does not continue the one before."""
        if near is None or (chosen is not None and chosen.continues):
            return []
        span = np.maximum(self.task.upper - self.task.lower, 1e-9)
        if float(np.max(np.abs(best.pressure - near.pressure) / span)) <= _JUMP:
            return []
        old, new = (", ".join(f"{p / BAR:.3g}" for p in r.pressure) for r in (near, best))
        return [f"the pressures jump from ({old}) to ({new}) bar: followed from the target before, none is as near"]

    def _out_of_reach(self, aim: Aim, best: Reached, rejected: Step | None, work: Work) -> str:
        """Say how near the tip comes."""
        left = []
        if best.aimed.distance is not None:
            left.append(f"{best.aimed.distance / MILLIMETRE:.6g} mm away")
        if best.aimed.angle is not None:
            left.append(f"{best.aimed.angle / DEGREE:.6g} degrees off")
        assert best.aimed.tip_position is not None
        tip = ", ".join(f"{x / MILLIMETRE + 0.0:.2f}" for x in np.round(best.aimed.tip_position, 8))
        text = f"{Status.OUT_OF_REACH.advice}; the nearest tip is {' and '.join(left)}, at ({tip}) mm"
        if work.used_up:
            text += "; the search was stopped, since it took too long, so another may be nearer"
        if self._ended is not None and best.pressure.sum() > 0.999 * self.limits.largest_sum * BAR:
            text += f"; pressures end where the stretch does ({self._ended.status.value})"
        if rejected is not None and rejected.message.startswith(_NO_BODY):
            return f"{text}; nearer, {rejected.message}"
        return text if rejected is None else f"{text}; nearer equilibria are not stable or not found"

    def _tips(self, intervals: int | None) -> Tips:
        return Tips(self.poses, self.loads, self.limits, self._numerics, intervals)
