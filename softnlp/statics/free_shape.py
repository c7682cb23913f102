"""The free shape of a blocked pose and on the path towards it: chamber lengths and the contact point without a wall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.model.rod import STATE_SIZE, Loads
from softnlp.statics.arc import Arc, arc_pose, unloaded_arc
from softnlp.statics.loadcase import RodFunctions, stretch_imbalance, stretch_near
from softnlp.statics.pose import between_nodes
from softnlp.statics.pose_grid import Solved
from softnlp.statics.solver import SEARCHED_BY, PoseSolver
from softnlp.statics.step import Pose, Step
from softnlp.statics.wall import Situation, Wall

Array = NDArray[np.float64]

_SCAN = 17
_FURTHEST, _APART = 2.0, 1e-7  # of the change of stretch before: how far it is extrapolated; between two shapes
_HALVINGS, _HALVINGS_LOADED = 40, 18  # of a part of the scan, to the round-off of an arc and of a loose solution


@dataclass(frozen=True, eq=False)
class Free:
    """A free shape: in closed form without loads (`arc`), else as it was solved.

    column : every quantity in its order, SI. lengths : (N,) of the chambers [m]. contact_point : (3,) [m].
    """

    column: Array
    stretch: float
    lengths: Array
    contact_point: Array
    arc: Arc | None = None
    solved: Solved | None = None
    step: Step | None = None

    @property
    def error(self) -> float:
        """The estimated tip position error over L_0."""
        return 0.0 if self.solved is None else self.solved.error

    @property
    def iterations(self) -> int:
        """The iterations spent on it."""
        return 0 if self.step is None else self.step.iterations

    def pose(self, poses: PoseSolver) -> Pose:
        """Return the pose."""
        if self.arc is not None:
            return arc_pose(poses, self.arc)
        assert self.step is not None
        assert self.step.pose is not None
        return self.step.pose


def free_shape(poses: PoseSolver, pressure: Array, loads: Loads, tip_cap: float, near: Free | None) -> Step | Free:
    """Return the free shape at a pressure (sets,) [Pa], or the step that says why there is none.

    near : of a neighbouring pose, where there is one.
    """
    if not loads.act:
        branch, arc = unloaded_arc(poses, pressure)
        if branch.status is not Status.SOLVED:
            return Step(pressure, branch.status, branch.message)
        return Free(arc.column, arc.stretch, arc.lengths, arc.tip_position + tip_cap * arc.axis, arc=arc)
    ahead, poses.ahead = poses.ahead, None
    if ahead is not None and near is None and np.array_equal(ahead[0], poses.column(poses.values(pressure, loads))):
        step, solved = ahead[1]
    else:
        step, solved = poses.solve(pressure, loads, near.solved if near else None)
    if solved is None or step.pose is None:
        return step
    pose, x = step.pose, solved.solution.x
    point = pose.tip_position + tip_cap * pose.tip_rotation[:, 2]
    return Free(solved.solution.p, float(x[0]), pose.chamber_length, point, solved=solved, step=step)


class FreeShapes:
    """Free shapes of one model, each found from the last: an arc in closed form, or Newton where loads act.

    intervals : of shooting, where an iteration costs the least.
    """

    def __init__(self, poses: PoseSolver, functions: RodFunctions, intervals: int, tip_cap: float) -> None:
        self._poses = poses
        self._functions = functions
        self._intervals = intervals
        self._tip_cap = tip_cap
        self._last: tuple[float, Array | None] = (1.0, None)
        self._before: tuple[float, Array] | None = None  # the one found before the last
        self._balance = stretch_imbalance(functions)

    @property
    def last(self) -> tuple[float, Array | None]:
        """The stretch and the pose problem's solution that were found last, from which the next are found."""
        return self._last

    def begin(self, stretch: float, x: Array | None) -> None:
        """Start again from a known stretch, and from the pose problem's solution x there if it is known."""
        self._last, self._before = (stretch, x), None

    def stretch(self, column: Array) -> float:
        """Return the root of the stretch balance next to the last one."""
        start, x = self._last
        found = float(stretch_near(self._balance, column, np.array([start]))[0])
        self._last = found, x
        return found

    def tip(self, situation: Situation) -> tuple[Array, Array]:
        """Return the free chamber lengths (N,) and the contact point (3,) [m]; nan where it is not found."""
        values = self._poses.values(situation.pressure, situation.loads)
        column = self._poses.column(values)
        last_stretch, last = self._last
        stretch = self.stretch(column)
        L_0 = float(self._poses.model.robot.length)
        if not situation.loads.act:
            state = np.asarray(self._functions.arc(column, stretch, 1.0)).ravel()
            return state[STATE_SIZE:] * L_0, (state[:3] + self._tip_cap / L_0 * state[9:12]) * L_0
        grid = self._poses.grid(self._intervals, SEARCHED_BY)
        p = grid.problem.pack(values)
        guess = last if last is not None else self._poses.arc_guess(grid, p, stretch)
        if last is not None and self._before is not None:  # pressure and stretch rise together: a secant in the stretch
            run = last_stretch - self._before[0]
            if abs(stretch - last_stretch) <= _FURTHEST * abs(run):
                guess = last + (last - self._before[1]) * ((stretch - last_stretch) / run) if run else last
        solution = grid.stepper.solve(p, guess)
        if last is not None and not solution.holds(10 * grid.stepper.tolerance):
            solution = grid.stepper.solve(p, last)
        if not solution.holds(10 * grid.stepper.tolerance):
            N = self._poses.model.robot.chambers
            return np.full(N, np.nan), np.full(3, np.nan)
        if last is not None and abs(stretch - last_stretch) > _APART:
            self._before = last_stretch, last
        self._last = stretch, solution.x
        found = grid.problem.outputs(x=solution.x, p=p)
        axis = np.asarray(found["tip_rotation"])[:, 2]
        point = np.asarray(found["tip_position"]).ravel() + self._tip_cap * axis
        return np.asarray(found["chamber_lengths"]).ravel(), point

    def guess(self, situation: Situation, s: Array) -> Array:
        """Return the stretch and then the states at s of a free shape; of the arc where it is not found."""
        poses = self._poses
        values = poses.values(situation.pressure, situation.loads)
        column = poses.column(values)
        stretch = self.stretch(column)
        states = np.asarray(self._functions.arc(column, stretch, s[None, :]))
        if situation.loads.act and np.all(np.isfinite(self.tip(situation)[1])):
            grid, x = poses.grid(self._intervals, SEARCHED_BY), self._last[1]
            assert x is not None
            constants = np.asarray(grid.problem.case_constants(x, grid.problem.pack(values))).ravel()
            states[:STATE_SIZE] = between_nodes(poses.shape, grid.nodes(x), constants, s)[:STATE_SIZE]
        return np.concatenate([[stretch], states.T.ravel()])


def from_zero(end: Situation, shapes: FreeShapes, touch: float) -> tuple[Situation, float]:
    """Return where a path from zero pressure begins, and the fraction of it at which contact is made for good.

    touch : distance [m] within which the contact point touches the wall. Where loads or the offset press the robot into
    the wall already at rest, they grow with the pressure.
    """
    nothing = np.zeros_like(end.pressure)
    shapes.begin(1.0, None)
    if end.wall is None:
        return Situation(nothing, Loads(), None), 0.0
    rest = Situation(nothing, end.loads, end.wall)
    ahead = end.wall.gap(shapes.tip(rest)[1])
    if not ahead >= -touch:
        shapes.begin(1.0, None)
        tip = shapes.tip(Situation(nothing, Loads(), None))[1]
        shift = end.wall.gap(tip)
        shapes.begin(1.0, None)
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
    for _ in range(_HALVINGS_LOADED if end.loads.act else _HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if gap_at(middle) > 0 else (low, middle)
    return rest, high
