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
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.base.units import BAR, DEGREE, MILLIMETRE
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.robot import SELF_INTERSECTION
from softnlp.model.rod import Loads
from softnlp.nlp.bounded import Limits, Map, Measured, could_gain, least_norm, nearest
from softnlp.nlp.optimality import OPTIMAL, not_optimal
from softnlp.statics.branch import stretch_on_branch
from softnlp.statics.kept import pose_solver
from softnlp.statics.pose_grid import Solved
from softnlp.statics.step import Aimed, Step
from softnlp.studies.derivatives import PoseDerivatives
from softnlp.studies.inverse_nlp import Programs, moving_sets
from softnlp.studies.targets import (
    Aim,
    ArcMap,
    GridMap,
    InverseTask,
    Table,
    Target,
    TipMap,
    TipPoint,
    aim_of,
    spread,
    tabulated,
)

Array = NDArray[np.float64]

_ARCS, _POSES = 729, 64  # entries of the table of tips
_STARTS = 4
_COARSE_MET = 1e-7  # misfit of a coarse search that needs no better one [L_0]
_ROUNDS = 4
_FOLD_MARGIN = 1e-6  # of the last pressure with an equilibrium
_SAME_SPOT = 1e-3  # of the cost: less is no nearer
_JUMP = 0.3  # of the bounds: more is a jump along a path
_SAME_PLACE = 1e-4  # [bar]
_COMPASS = (0.25, 1e-3)  # first and last step of the search among stable poses, of the bounds
_MOST_POSES = 150  # that it solves
_NO_BODY = "the target is met only by a shape that no body can take"


@dataclass(frozen=True, eq=False)
class Found:
    """Where a coarse search ended: the point, the curvature of its residuals, whether the target is met there.

    continues : whether it began at the last target's pressure.
    """

    point: Measured
    second: Array | None
    met: bool
    continues: bool

    @property
    def cost(self) -> float:
        """The weighed misfit [L_0]."""
        return float(np.linalg.norm(self.point.r))


@dataclass(frozen=True, eq=False)
class Reached:
    """A judged answer: pressure (sets,) [Pa], its pose, the weighed misfit [L_0]."""

    pressure: Array
    step: Step
    solved: Solved
    aimed: Aimed
    cost: float


class InverseSolver:
    """Solves targets of one task for one model under the same loads; what is compiled or tabulated is kept."""

    def __init__(
        self, model: Model, numerics: Numerics, loads: Loads, task: InverseTask, method: Literal["newton", "nlp"]
    ) -> None:
        self._numerics = numerics
        self.poses = pose_solver(model, numerics.without_ipopt() if numerics.engine == "auto" else numerics)
        self.loads = loads
        self.task = task
        self.limits, self.ends = self._limits()
        self._derivatives = PoseDerivatives(self.poses)
        self._method = "nlp" if numerics.engine == "ipopt" else method
        self._programs = Programs(self.poses, loads, self.limits, numerics)
        self._tables: dict[TipMap, Table] = {}
        self._intervals: int | None = None
        self._arcs = ArcMap(self.poses)
        self._coarse: TipMap = self._arcs
        if loads.act:
            self._coarse = self._map(numerics.intervals or self._coarse_intervals())

    def solve(self, target: Target, near: Reached | None) -> tuple[Step, Reached | None]:
        """Find the pressure for one target, from the last one where there is one. Never raises for a hard target."""
        began = time.perf_counter()
        aim = aim_of(self.task, target, float(self.poses.model.robot.length))
        if self.ends is not None and float(self.limits.lower.sum()) > self.limits.largest_sum:
            lost = Step(self.task.lower, self.ends[0], self.ends[1], aimed=aim.aimed(None))
            return replace(lost, solve_time=time.perf_counter() - began), None
        best: Reached | None = None
        rejected: Step | None = None
        chosen = None
        for found in self._candidates(aim, near):
            judged = self._finished(aim, found)
            if isinstance(judged, Step):
                rejected = judged
                continue
            if best is None or judged.cost < best.cost * (1 - _SAME_SPOT):
                best, chosen = judged, found
            if self._meets(aim, best) or judged.cost <= found.cost * (1 + _SAME_SPOT):
                break
        if rejected is not None and (best is None or not self._meets(aim, best)):
            searched = self._searched(aim, best)
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
            step = self._programs.closed(aim, best.solved, step, only_pose=rejected is not None, meets=met)
        step = replace(step, solve_time=time.perf_counter() - began)
        if not step.status.has_solution:
            return step, None
        if not met:
            step = replace(step, status=Status.OUT_OF_REACH, message=self._out_of_reach(aim, best, rejected))
        return step, best

    def forget_table(self) -> None:
        """Drop the tables of starts, for timing what they cost."""
        self._tables.clear()

    def _candidates(self, aim: Aim, near: Reached | None) -> Iterator[Found]:
        """Yield where coarse searches end, best first; the first that meets the target at once if no choice is left.

        With more sets than the target needs, every start is searched and the smallest pressures come first.
        """
        redundant = self._redundant(aim)
        ends: list[Found] = []
        for start, continues in self._starts(aim, near):
            found = self._search(aim, start, continues=continues)
            if found.met and not redundant:
                yield found
            ends.append(found)
        apart: list[Found] = []  # of those that end in one place the first stands for all
        for found in ends:
            if all(np.max(np.abs(found.point.z - other.point.z)) > _SAME_PLACE for other in apart):
                apart.append(found)
        apart.sort(key=lambda f: (not f.met, float(f.point.z @ f.point.z) if f.met else f.cost))
        yield from (found for found in apart if redundant or not found.met)

    def _starts(self, aim: Aim, near: Reached | None) -> Iterator[tuple[TipPoint, bool]]:
        """Yield tips of the coarse map: at the last pressure, which is told by True, then of the table."""
        if near is not None:
            point = self._coarse.of(near.solved) if isinstance(self._coarse, GridMap) else None
            point = point or self._coarse.at(near.pressure, None)
            if point is not None:
                yield point, True
        loaded = isinstance(self._coarse, GridMap)
        if loaded:  # an arc is near enough to begin with, and costs nothing; most targets need no other start
            arcs = self._tips(self._arcs)
            for k in arcs.starts(aim, self.limits, 1):
                if (point := self._coarse.at(arcs.pressures[k], None)) is not None:
                    yield point, False
        table = self._tips(self._coarse)
        for k in table.starts(aim, self.limits, _STARTS):
            point = table.points[k]
            assert point is not None
            yield point, False

    def _tips(self, tips: TipMap) -> Table:
        """Return the tips of a map over the bounds."""
        if tips not in self._tables:
            most = _POSES if isinstance(tips, GridMap) else _ARCS
            self._tables[tips] = tabulated(tips, spread(self.limits, most) * BAR)
        return self._tables[tips]

    def _search(self, aim: Aim, start: TipPoint, *, continues: bool) -> Found:
        """Search on the coarse map from a tip."""
        point, second, _ = nearest(self._measure(aim, self._coarse), aim.measured(start), self.limits)
        met = float(np.linalg.norm(point.r)) <= _COARSE_MET
        if met and self._redundant(aim):
            begin = aim.conditioned(point.memo)
            least, second, _ = least_norm(self._measure(aim, self._coarse, met=True), begin, self.limits)
            if float(np.linalg.norm(least.r)) <= _COARSE_MET:
                point = aim.measured(least.memo)
        return Found(point, second, met, continues)

    def _left(self, aim: Aim, reached: Reached, *, meets: bool) -> float:
        """Return what the first-order conditions leave at an answer, on its pose's grid; inf where it has no slope."""
        point = self._map(reached.solved.intervals).of(reached.solved)
        if point is None:
            return float("inf")
        return could_gain(aim.conditioned(point) if meets else aim.measured(point), self.limits, meets=meets)

    def _redundant(self, aim: Aim) -> bool:
        """Whether there are more pressures to choose than the target has conditions."""
        return moving_sets(self.limits) > aim.conditions

    def _measure(self, aim: Aim, tips: TipMap, *, met: bool = False) -> Map:
        """Return the misfit by pressure on a map."""
        of = aim.conditioned if met else aim.measured

        def measure(z: Array, near: Measured) -> Measured | None:
            point = tips.at(z * BAR, near.memo)
            return None if point is None else of(point)

        return measure

    def _finished(self, aim: Aim, found: Found) -> Reached | Step:
        """Make a coarse answer exact on the grid of its pose and judge it; a step where there is no stable pose."""
        pressure = found.point.z * BAR
        exact = 0.3 * self.poses.numerics.accuracy
        if self._intervals is not None and isinstance(self._coarse, GridMap):
            refined = self._refined(aim, found, self._intervals, self._coarse.solved(found.point.memo))
            pressure = pressure if refined is None else refined
        best: Reached | Step | None = None
        for k in range(_ROUNDS):
            step, solved = self.poses.solve(pressure, self.loads)
            judged = self._judged(aim, pressure, step, solved)
            if isinstance(judged, Step) or solved is None:
                return best or judged
            settled = isinstance(best, Reached) and judged.cost >= best.cost * (1 - 1e-9)
            # A later one is of the pose's own grid; among answers as near it has the smaller pressures.
            if not isinstance(best, Reached) or judged.cost <= best.cost * (1 + 1e-6) + exact:
                best = judged
            found_already = isinstance(self._coarse, ArcMap) and judged.cost <= found.cost + exact
            unasked = k == 0 and self._method == "nlp"  # the program has not been solved yet
            if not unasked and (settled or found_already):
                break
            on_its_grid = self._intervals == solved.intervals or not self._redundant(aim)
            if not unasked and judged.cost <= exact and on_its_grid:
                break
            self._intervals = solved.intervals
            refined = self._refined(aim, found, solved.intervals, solved)
            if refined is None or (not unasked and float(np.max(np.abs(refined - pressure))) < 1e-9 * BAR):
                break
            pressure = refined
        assert best is not None
        return best

    def _refined(self, aim: Aim, found: Found, intervals: int, solved: Solved) -> Array | None:
        """Return the pressure found again on a grid, from a pose nearby; None where Newton is lost."""
        tips = self._map(intervals)
        point = tips.of(solved)
        if point is None:
            return None
        met = found.met and self._redundant(aim)
        if self._method == "nlp":
            return self._programs.searched(aim, tips.intervals, point, meets=met)
        start = aim.conditioned(point) if met else aim.measured(point)
        search = least_norm if met else nearest
        end, _, _ = search(
            self._measure(aim, tips, met=met), start, self.limits, found.second, measured_curvature=False
        )
        return end.z * BAR

    def _judged(self, aim: Aim, pressure: Array, step: Step, solved: Solved | None) -> Reached | Step:
        """Return a stable pose that a body can take as an answer, else the step that says why there is none."""
        if step.pose is None or solved is None:
            return step
        fit, message = step.pose.fit, ""
        if step.pose.stable is False:
            message = "the target is met by an equilibrium that is not stable only: the real robot buckles away from it"
        elif fit.self_intersecting and SELF_INTERSECTION not in self.task.allow:
            message = f'{_NO_BODY}: {fit.warnings[-1]}; [robot] allow = ["{SELF_INTERSECTION}"] accepts it'
        if message:
            return Step(pressure, Status.OUT_OF_REACH, message, residual=step.residual)
        aimed = aim.aimed(step.pose)
        return Reached(pressure, step, solved, aimed, aim.cost(aimed))

    def _meets(self, aim: Aim, reached: Reached) -> bool:
        """Whether a pose is within the accuracy asked for: of L_0, and as many radians."""
        accuracy = self.poses.numerics.accuracy
        distance, angle = reached.aimed.distance, reached.aimed.angle
        return (distance is None or distance <= accuracy * aim.length) and (angle is None or angle <= accuracy)

    def _searched(self, aim: Aim, best: Reached | None) -> Reached | None:
        """Search among stable poses without derivatives: where they end there is no slope to follow.

        It begins at the first stable pose of the table that is nearer than the best one known, or else at that one.
        """
        span = (self.limits.upper - self.limits.lower) * BAR
        here = best
        table = self._tips(self._coarse)
        misfit = np.linalg.norm(aim.misfit(table.states), axis=0)
        for k in table.starts(aim, self.limits, len(table.pressures)):
            if best is not None and misfit[k] >= best.cost:
                break
            judged = self._at(aim, table.pressures[k])
            if isinstance(judged, Reached) and (best is None or judged.cost < best.cost):
                here = judged
                break
        if here is None:
            return None
        size, last = _COMPASS
        moves = np.vstack([np.eye(span.size), -np.eye(span.size)])
        spent = 0
        while size > last and spent < _MOST_POSES:
            for move in moves:
                z = self.limits.clip((here.pressure + size * move * span) / BAR)
                if np.max(np.abs(z * BAR - here.pressure)) < 1e-6 * BAR:
                    continue
                judged = self._at(aim, z * BAR)
                spent += 1
                if isinstance(judged, Reached) and judged.cost < here.cost:
                    here = judged
                    break
            else:
                size /= 2
        return here

    def _at(self, aim: Aim, pressure: Array) -> Reached | Step:
        step, solved = self.poses.solve(pressure, self.loads)
        return self._judged(aim, pressure, step, solved)

    def _jumped(self, best: Reached, chosen: Found | None, near: Reached | None) -> list[str]:
        """Return a warning where the answer does not continue the one before."""
        if near is None or (chosen is not None and chosen.continues):
            return []
        span = np.maximum(self.task.upper - self.task.lower, 1e-9)
        if float(np.max(np.abs(best.pressure - near.pressure) / span)) <= _JUMP:
            return []
        old, new = (", ".join(f"{p / BAR:.3g}" for p in r.pressure) for r in (near, best))
        return [f"the pressures jump from ({old}) to ({new}) bar: followed from the target before, none is as near"]

    def _out_of_reach(self, aim: Aim, best: Reached, rejected: Step | None) -> str:
        """Say how near the tip comes."""
        left = []
        if best.aimed.distance is not None:
            left.append(f"{best.aimed.distance / MILLIMETRE:.6g} mm away")
        if best.aimed.angle is not None:
            left.append(f"{best.aimed.angle / DEGREE:.6g} degrees off")
        assert best.aimed.tip_position is not None
        tip = ", ".join(f"{x / MILLIMETRE + 0.0:.2f}" for x in np.round(best.aimed.tip_position, 8))
        text = f"{Status.OUT_OF_REACH.advice}; the nearest tip is {' and '.join(left)}, at ({tip}) mm"
        if self.ends is not None and best.pressure.sum() > 0.999 * self.limits.largest_sum * BAR:
            text += f"; pressures end where the stretch does ({self.ends[0].value})"
        if rejected is not None and rejected.message.startswith(_NO_BODY):
            return f"{text}; nearer, {rejected.message}"
        return text if rejected is None else f"{text}; nearer equilibria are not stable or not found"

    def _map(self, intervals: int) -> GridMap:
        return GridMap(self._derivatives, intervals, self.loads)  # what is compiled is kept with the poses

    def _limits(self) -> tuple[Limits, tuple[Status, str] | None]:
        """Return the bounds and the largest sum of pressures that has an equilibrium, with what ends it.

        The stretch balance holds the pressures by their sum alone; the stiffnesses may tell sets apart, so the
        least sum of the bounds' corners is taken.
        """
        lower, upper = self.task.lower, self.task.upper
        largest, ends = float(np.sum(upper)), None
        corners = [upper, *(np.where(np.arange(upper.size) == k, upper.sum(), 0.0) for k in range(upper.size))]
        for corner in corners:
            branch = stretch_on_branch(self.poses.branch, self.poses.column({"pressure": corner}), corner)
            if not branch.status.has_solution and branch.fraction * corner.sum() < largest:
                largest = (1 - _FOLD_MARGIN) * branch.fraction * float(corner.sum())
                ends = (branch.status, branch.message)
        return Limits(lower / BAR, upper / BAR, largest / BAR), ends

    def _coarse_intervals(self) -> int:
        """Return a grid that holds the most curled unloaded arc within the bounds."""
        top = self.limits.largest_sum
        most = 0
        for k in range(self.task.upper.size):
            z = self.limits.clip(np.where(np.arange(self.task.upper.size) == k, min(self.limits.upper[k], top), 0.0))
            column = self.poses.column({"pressure": z * BAR})
            branch = stretch_on_branch(self.poses.branch, column, z * BAR)
            most = max(most, self.poses.first_intervals(column, branch.stretch))
        return most
