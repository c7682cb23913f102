"""Solving a path: a proposal point by point, one program over all points by IPOPT, and the verdict on every pose.

The proposal meets one target after another without limits between them. IPOPT starts there, on the node states of every
instant. What it finds is judged by the pose that `PoseSolver` finds at each pressure, followed from the one before:
residual, discretisation, stability, and the distance to obstacles on points between the nodes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.model.numerics import Numerics
from softnlp.model.obstacles import Obstacle
from softnlp.model.quantities import Model
from softnlp.model.rod import Loads
from softnlp.nlp.joined import with_bounds
from softnlp.nlp.reduced import Point
from softnlp.nlp.solver import FROM_SOLUTION, Engine, Solution, violation
from softnlp.statics.clearance import BodyGaps, beside_nodes, least_between, require_whole_body
from softnlp.statics.kept import pose_solver
from softnlp.statics.obstacle_step import names_of
from softnlp.statics.pose_grid import Solved
from softnlp.statics.step import Step
from softnlp.studies.inverse_problem import Program, Tips, coarse_intervals, pressure_limits
from softnlp.studies.inverse_solver import InverseKinematics
from softnlp.studies.targets import InverseTask, aim_of
from softnlp.studies.trajectory_problem import (
    CLEARANCE,
    ON_TARGET,
    PathProgram,
    PathTask,
    effort_of,
    instant,
    path_program,
)

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

CLEARANCE_KEPT = 1e-5
"""By how much the body may come closer to an obstacle than the clearance, between nodes of the grid [m]."""

OTHER_POSE = 1e-3
"""How far the pose at a pressure is from that of the program, from which it is another equilibrium [L_0]."""

_MET = 1e-7  # misfit of a target that is met [L_0]
_MISSED = 1e-7  # a miss of the elastic program from which a target counts as not met [L_0]
_CLOSER = 3e-6  # [m] than the clearance between nodes, from which the nodes next to it are kept further away
_ROUNDS, _GRIDS = 6, 3
_MORE_BETWEEN = 1.3  # of what gaps between nodes are less at the start: poses change
_MOST_BETWEEN = 5e-4  # [m] that a gap between nodes is taken to be less than at these, before it is seen
_DEEP = 1e-3  # [m] in an obstacle, from which a start is not near to what keeps the clearance
_NEAR = 1e-3  # scaled violation of a start that counts as a solution
_HARD, _ELASTIC = 60, 300  # iterations of IPOPT
_LONGEST = 1200.0  # seconds of one solve
_IPOPT = {"bound_relax_factor": 0.0, "constr_viol_tol": 1e-10, "max_wall_time": _LONGEST}
_CHANGED = {"mu_init": 1e-5, "bound_push": 1e-6, "bound_frac": 1e-6}  # for the same path with rows moved a little
_FAR = {"mu_init": 1e-3, "bound_push": 1e-3, "bound_frac": 1e-3}


@dataclass(frozen=True, eq=False)
class Found:
    """What IPOPT found of a path.

    solution : of the whole program, None where there is none within the limits. missed : (T,) which targets are only
    neared. word : why there is none. iterations : of every solve.
    """

    program: PathProgram
    solution: Solution | None
    missed: Mask
    word: str
    iterations: int

    @property
    def pressure(self) -> Array:
        """(T, sets) [Pa], within the bounds to the last bit."""
        assert self.solution is not None
        z = self.program.pressures(self.solution.x)
        return np.clip(z * BAR, self.program.task.lower, self.program.task.upper)

    @property
    def tips(self) -> Array:
        """(T, 3) where the program has the tip [m]."""
        assert self.solution is not None
        found = self.program.compiled.outputs(x=self.solution.x, p=self.solution.p)["tip_position"]
        return np.asarray(found).reshape(-1, 3)


@dataclass(frozen=True, eq=False)
class Judged:
    """The pose at one instant, judged by itself.

    gaps : (obstacles,) least distance to each [m]. closer : (rows,) by how much the body is closer than the clearance
    beside each node [m].
    """

    step: Step
    solved: Solved | None
    gaps: Array
    closer: Array


class PathSolver:
    """Solves one path of one model; what is compiled is kept with the model's kind."""

    def __init__(
        self, model: Model, numerics: Numerics, loads: Loads, task: PathTask, obstacles: Sequence[Obstacle] = ()
    ) -> None:
        if numerics.engine == "newton":
            problem = "a path is one program, which IPOPT solves; expected 'auto' or 'ipopt', got 'newton'"
            raise InputError(problem, table="solver", key="engine")
        self.task, self.loads, self.numerics, self.obstacles = task, loads, numerics, tuple(obstacles)
        self.model = model
        self.quick = pose_solver(model, numerics.without_ipopt())
        self.poses = self.quick if numerics.engine == "auto" else pose_solver(model, numerics)
        self.length = float(model.robot.length)
        self.limits, self.ended = pressure_limits(self.quick, task.lower, task.upper)
        if self.ended is not None and float(self.limits.lower.sum()) > self.limits.largest_sum:
            raise InputError(f"expected lower ones: {self.ended.message}", table="bounds", key="pressure_bar")
        self.aims = [aim_of(self._inverse_task, target, self.length) for target in task.targets]
        self.moving = int(np.sum(self.limits.upper > self.limits.lower))
        self.body = BodyGaps(obstacles, self.length) if obstacles else None
        self._require_clear(model)

    def _require_clear(self, model: Model) -> None:
        """Refuse obstacles that overlap the robot at rest, and that its base is closer to than the clearance."""
        if self.body is None:
            return
        require_whole_body(self.obstacles)
        names = names_of(self.obstacles)
        for k, (name, gap) in enumerate(zip(names, self.body.at_rest(model.robot), strict=True)):
            if gap < 0:
                text = f"the robot overlaps {name} by {-gap / MILLIMETRE:.3g} mm at rest; move the obstacle away"
                raise InputError(text, table=f"obstacle.{k + 1}")
        for name, gap in zip(names, self.body.at_base(model.robot), strict=True):
            if gap < self.task.clearance:
                text = f"expected at most {gap / MILLIMETRE:.3g} mm, by which the base is away from {name}"
                raise InputError(text, table="trajectory", key="clearance_mm")

    @cached_property
    def _inverse_task(self) -> InverseTask:
        task = self.task
        return InverseTask(task.targets, task.lower, task.upper, task.length_per_radian, task.allow)

    @property
    def redundant(self) -> bool:
        """Whether pressures are left to choose where a target is met."""
        return self.moving > self.aims[0].conditions

    # --- the proposal

    def proposed(self) -> tuple[list[Solved], list[Step], Mask]:
        """Return a pose near each target, and which targets are met, limits between points and obstacles aside."""
        poses = self.quick
        tips = self._tips(self.numerics.intervals or coarse_intervals(poses, self.limits))
        search = InverseKinematics(self.model, poses.numerics, self.loads, self._inverse_task, "newton")
        found, steps, met = list[Solved](), list[Step](), list[bool]()
        last: Point | None = None
        warm: Solved | None = None
        for aim in self.aims:
            program = tips.program(aim)
            point = _continued(program, last)
            if not _meets(point) and (not met or met[-1]):  # once in a row of targets that are not met
                _, reached = search.nearest(aim.target, None)
                if reached is not None:
                    other = program.at(reached.pressure / BAR, tips.moved(reached.solved))
                    point = other if _misfit(other) < _misfit(point) else point
            point = point or program.at((self.limits.lower + self.limits.upper) / 2) or program.at(self.limits.lower)
            if point is None:
                raise InputError("no pose of the robot is found within them", table="bounds", key="pressure_bar")
            step, solved = poses.solve(self.limits.clip(point.theta) * BAR, self.loads, warm)
            found.append(solved or tips.solved(program, point))
            steps.append(step)
            met.append(_meets(point))
            last, warm = point, solved or warm
        return found, steps, np.array(met)

    # --- the program

    def program(self, intervals: int) -> PathProgram:
        """Return the program on a grid."""
        case = self.quick.grid(intervals).case
        effort = effort_of(self.task, self.moving, self.aims[0].conditions)
        one = instant(case, self.model, self.aims[0], self.limits, self.obstacles, effort=effort)
        return path_program(one, self.task, self.moving)

    def found(
        self, program: PathProgram, intervals: int, start: Array, missed: Mask, tightened: Array, *, again: bool = False
    ) -> Found:
        """Let IPOPT solve a path from a start: as asked, else with as few targets missed as can be.

        again : the start is a solution of the same path but for what gaps or the grid changed.
        """
        # Targets that determine their pressures leave nothing to keep a limit with that these do not keep already.
        hopeless = not (again or self.redundant or np.any(missed)) and self._violates(program, start, tightened)
        spent = 0
        if not hopeless:
            attempt = self._attempt(program, start, missed, tightened, 0, again=again)
            if attempt.solution is not None or bool(np.all(missed)):
                return attempt
            spent = attempt.iterations
        # A start deep in an obstacle leads IPOPT astray; at rest every limit is kept, but the way there may be another.
        deep = self._overlap(program, start) > _DEEP
        relaxed = None
        for at_rest in (deep, not deep):
            begin = self._resting(program, intervals) if at_rest else start
            if begin is not None and (relaxed is None or relaxed.solution is None):
                relaxed = self._attempt(program, begin, missed, tightened, spent, elastic=True)
                spent = relaxed.iterations
        assert relaxed is not None
        if relaxed.solution is None:
            return relaxed
        x = program.split(relaxed.solution.x).copy()
        left = x[:, program.instant.misses]
        lost = missed | (left.sum(axis=1) > _MISSED)
        left[:] = 0.0
        last = self._attempt(program, x.ravel(), lost, tightened, relaxed.iterations, again=True)
        return last if last.solution is not None else replace(relaxed, missed=lost)

    def _overlap(self, program: PathProgram, x: Array) -> float:
        """Return how deep in an obstacle a node of a path is at most [m], 0 where none is."""
        rows = program.instant.rows(CLEARANCE)
        gaps = self._rows(program, x)[:, rows] * self.length
        return float(-np.min(gaps, initial=0.0))

    def _rows(self, program: PathProgram, x: Array) -> Array:
        """Return the rows of each instant (T, rows)."""
        g = np.asarray(program.compiled.residual(x, self._packed(program, np.zeros(program.count, bool)))).ravel()
        return g[: program.count * program.rows].reshape(program.count, -1)

    def _resting(self, program: PathProgram, intervals: int) -> Array | None:
        """Return the robot at its lowest pressures at every instant, with each target missed by what it takes."""
        _, rest = self.quick.solve(self.limits.clip(self.task.lower / BAR) * BAR, self.loads)
        if rest is None:
            return None
        x = self.start(program, intervals, [rest] * program.count)
        off = self._rows(program, x)[:, program.instant.rows(ON_TARGET)]
        program.split(x)[:, program.instant.misses] = np.hstack([np.maximum(off, 0.0), np.maximum(-off, 0.0)])
        return x

    def _violates(self, program: PathProgram, start: Array, tightened: Array) -> bool:
        """Whether a start that is on every target breaks a limit."""
        none = np.zeros(program.count, bool)
        posed = with_bounds(program.compiled, program.bounds(none, tightened))
        return violation(posed, start, self._packed(program, none)) > 1e3 * self.numerics.accuracy

    def _packed(self, program: PathProgram, missed: Mask) -> Array:
        values = {name: v for name, v in self.quick.values(np.zeros(0), self.loads).items() if name != "pressure"}
        return program.packed(self.aims, values, missed)

    def _attempt(
        self,
        program: PathProgram,
        start: Array,
        missed: Mask,
        tightened: Array,
        spent: int,
        *,
        elastic: bool = False,
        again: bool = False,
    ) -> Found:
        """Solve once. spent : iterations before."""
        bounds = program.bounds(missed, tightened, elastic=elastic)
        posed = with_bounds(program.compiled, bounds)
        p = self._packed(program, missed)
        chosen: dict[str, float] = _FAR
        if again:
            chosen = _CHANGED
        elif not elastic and violation(posed, start, p) < _NEAR:
            chosen = FROM_SOLUTION
        options = {**_IPOPT, **chosen, **dict(self.numerics.ipopt)}
        most = _ELASTIC if elastic else _HARD
        engine = Engine(posed, ipopt_only=True, tolerance=1e-9, max_iterations=most, options=options)
        solution = engine.solve(p, np.clip(start, bounds.lower_x, bounds.upper_x))
        holds = solution.holds(self.numerics.tolerance)
        return Found(program, solution if holds else None, missed, solution.engine_status, spent + solution.iterations)

    def start(self, program: PathProgram, intervals: int, poses: Sequence[Solved]) -> Array:
        """Return x where each instant is at a pose that was solved. intervals : of the program's grid."""
        tips, sets = self._tips(intervals), program.instant.sets
        misses = np.zeros(2 * program.instant.conditions)
        heads = [np.concatenate([pose.solution.p[:sets] / BAR, misses]) for pose in poses]
        return np.concatenate(
            [part for head, pose in zip(heads, poses, strict=True) for part in (head, tips.moved(pose))]
        )

    def _tips(self, intervals: int) -> Tips:
        return Tips(self.quick, self.loads, self.limits, self.quick.numerics, intervals)

    # --- the whole

    def solve(self) -> tuple[Found, tuple[Judged, ...]]:
        """Return what IPOPT found, on a grid that its poses need, and these, none where there is no path."""
        proposed, steps, met = self.proposed()
        missed = ~met if self.moving >= self.aims[0].conditions else np.ones(met.size, bool)
        intervals = max(pose.intervals for pose in proposed)
        program = self.program(intervals)
        start = self.start(program, intervals, proposed)
        tightened = self._between(program, start, steps)
        found, judged, spent, grids = None, tuple[Judged, ...](), 0, 0
        for _ in range(_ROUNDS):
            found = self.found(program, intervals, start, missed, tightened, again=spent > 0)
            spent += found.iterations
            found = replace(found, iterations=spent)
            if found.solution is None:
                return found, ()
            judged = self.judged(found)
            finer = self._finer(found, judged, intervals) if grids < _GRIDS else None
            closer = np.array([one.closer for one in judged])
            if finer is None and not np.any(closer > _CLOSER):
                break
            start, missed = found.solution.x, found.missed
            if np.any(closer > _CLOSER):
                tightened = tightened + np.where(closer > 0, closer + _CLOSER / 2, 0.0) / self.length
            if finer is not None:
                solved = [one.solved for one in judged]
                assert all(pose is not None for pose in solved)
                intervals, grids = finer, grids + 1
                program = self.program(intervals)
                start = self.start(program, intervals, [pose for pose in solved if pose is not None])
                tightened = self._between(program, start, [one.step for one in judged])
        assert found is not None
        return found, judged

    def _between(self, program: PathProgram, x: Array, steps: Sequence[Step]) -> Array:
        """Return by how much gaps between nodes are less than at both of these (T, rows) [L_0]. steps : poses at x."""
        rows, gaps = program.instant.rows(CLEARANCE), program.instant.gaps
        found = np.zeros((program.count, rows.size))
        if gaps is None or self.body is None:
            return found
        nodes = self._rows(program, x)[:, rows] * self.length
        for k, step in enumerate(steps):
            if step.pose is not None:
                arc, there = self.body.at(step.pose)
                for j in range(len(self.obstacles)):
                    own = gaps.obstacle == j
                    at = np.concatenate([there[j, :1], nodes[k, own]])
                    dip = np.minimum(at[:-1], at[1:]) - least_between(gaps.arc[own], arc, there[j])[:-1]
                    both = np.maximum(dip, np.append(dip[1:], 0.0))
                    found[k, own] = np.clip(_MORE_BETWEEN * both, 0.0, _MOST_BETWEEN) / self.length
        return found

    def judged(self, found: Found) -> tuple[Judged, ...]:
        """Return the pose at each pressure that was found, each followed from the one before."""
        every, warm = list[Judged](), None
        gaps = found.program.instant.gaps
        for pressure in found.pressure:
            step, solved = self.poses.solve(pressure, self.loads, warm)
            warm = solved or warm
            least, closer = np.zeros(0), np.zeros(0)
            if gaps is not None and self.body is not None:
                least, closer = np.full(len(self.obstacles), np.nan), np.zeros(gaps.arc.size)
                if step.pose is not None:
                    arc, there = self.body.at(step.pose)
                    least, closer = there.min(axis=1), beside_nodes(gaps, arc, self.task.clearance - there)
            every.append(Judged(step, solved, least, closer))
        return tuple(every)

    def _finer(self, found: Found, judged: Sequence[Judged], intervals: int) -> int | None:
        """Return a finer grid where the tips of the program are too far from those of its poses, None elsewhere."""
        if self.numerics.intervals is not None or any(one.step.pose is None or one.solved is None for one in judged):
            return None
        off = [
            float(np.linalg.norm(one.step.pose.tip_position - tip)) / self.length
            for one, tip in zip(judged, found.tips, strict=True)
            if one.step.pose is not None
        ]
        usual = [error for error in off if error < OTHER_POSE]  # a finer grid does not lead to another equilibrium
        worst = max(usual, default=0.0)
        if worst <= self.numerics.accuracy / 2:
            return None
        return self.quick.next_intervals(worst, intervals, self.numerics.accuracy / 3)


def _continued(program: Program, last: Point | None) -> Point | None:
    """Return the tip nearest to a target from that of the one before; None where there is none."""
    if last is None:
        return None
    begin = program.at(last.theta, last)
    return None if begin is None else program.searched(begin)[0]


def _misfit(point: Point | None) -> float:
    return float("inf") if point is None else float(np.linalg.norm(point.r))


def _meets(point: Point | None) -> bool:
    return _misfit(point) <= _MET
