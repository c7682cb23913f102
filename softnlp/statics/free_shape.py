"""The free shape of a blocked pose and on the path towards it: chamber lengths and the contact point without a wall."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import casadi as ca
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
_HALVINGS = 40  # of a part of the scan, to round-off


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
        self._arc: Array | None = None  # unloaded, where the last was found: the next moves as it does
        self._balance = stretch_imbalance(functions)

    @property
    def last(self) -> tuple[float, Array | None]:
        """The stretch and the pose problem's solution that were found last, from which the next are found."""
        return self._last

    def begin(self, stretch: float, x: Array | None) -> None:
        """Start again from a known stretch, and from the pose problem's solution x there if it is known."""
        self._last, self._arc = (stretch, x), None

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
        last = self._last[1]
        stretch = self.stretch(column)
        L_0 = self._poses.model.length
        if not situation.loads.act:
            state = np.asarray(self._functions.arc(column, stretch, 1.0)).ravel()
            return state[STATE_SIZE:] * L_0, (state[:3] + self._tip_cap / L_0 * state[9:12]) * L_0
        grid = self._poses.grid(self._intervals, SEARCHED_BY)
        p = grid.problem.pack(values)
        arc = self._poses.arc_guess(grid, p, stretch)
        guess = arc if last is None else last if self._arc is None else last + arc - self._arc
        solution = grid.stepper.solve(p, guess)
        if last is not None and not solution.holds(10 * grid.stepper.tolerance):
            solution = grid.stepper.solve(p, last)
        if not solution.holds(10 * grid.stepper.tolerance):
            N = self._poses.model.chambers
            return np.full(N, np.nan), np.full(3, np.nan)
        self._last, self._arc = (stretch, solution.x), arc
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


@dataclass(frozen=True, eq=False)
class Route:
    """The way to a situation from the one at which its branch begins.

    start : of the free shapes there, see `FreeShapes.begin`. lengths : free chamber lengths (N,) at a fraction of it.
    """

    begin: Situation
    shapes: FreeShapes
    start: tuple[float, Array | None]
    lengths: Callable[[float], Array]


def route_from(begin: Situation, end: Situation, shapes: FreeShapes, start: tuple[float, Array | None]) -> Route:
    """Return the way between two situations on which every free shape is found as it is asked for."""

    def lengths(u: float) -> Array:
        situation = begin.towards(end, u)
        return shapes.tip(situation if end.wall is not None else Situation(situation.pressure, Loads(), None))[0]

    return Route(begin, shapes, start, lengths)


def from_zero(end: Situation, shapes: FreeShapes, touch: float) -> Route:
    """Return the way to a situation from where contact is made for good on the path from zero pressure.

    touch : distance [m] within which the contact point touches the wall. Where loads or the offset press the robot into
    the wall already at rest, they grow with the pressure.
    """
    nothing = np.zeros_like(end.pressure)
    shapes.begin(1.0, None)
    if end.wall is None:
        return route_from(Situation(nothing, Loads(), None), end, shapes, shapes.last)
    rest = Situation(nothing, end.loads, end.wall)
    ahead = end.wall.gap(shapes.tip(rest)[1])
    if not ahead >= -touch:
        shapes.begin(1.0, None)
        tip = shapes.tip(Situation(nothing, Loads(), None))[1]
        shift = end.wall.gap(tip)
        shapes.begin(1.0, None)
        wall = Wall(end.wall.point + min(shift, 0.0) * end.wall.normal, end.wall.normal)
        rest = Situation(nothing, Loads(), wall)

    def at(t: float) -> tuple[float, Array]:
        """Return the gap and the free lengths at a fraction of the path."""
        situation = rest.towards(end, t)
        assert situation.wall is not None
        lengths, point = shapes.tip(situation)
        return situation.wall.gap(point), lengths

    def gap(t: float) -> float:
        return at(t)[0] if along is None else float(along(t)[0])

    scan = np.linspace(0, 1, _SCAN)
    known = np.array([np.append(*at(t)) for t in scan])
    along = None  # what is found by iterations is interpolated: it leads, and only what is at the end counts
    if end.loads.act and np.all(np.isfinite(known)):
        along = ca.interpolant("along", "bspline", [scan.tolist()], known.ravel(), {"algorithm": "not_a_knot"})
    apart = np.flatnonzero(known[:-1, 0] > touch)
    low, high = (float(scan[apart[-1]]), float(scan[apart[-1] + 1])) if apart.size else (0.0, 0.0)
    if not apart.size:
        shapes.begin(1.0, None)
    for _ in range(_HALVINGS if apart.size else 0):
        middle = (low + high) / 2
        low, high = (middle, high) if gap(middle) > 0 else (low, middle)
    route = route_from(rest.towards(end, high), end, shapes, shapes.last)
    if along is None:
        return route
    return replace(route, lengths=lambda u: np.asarray(along(high + u * (1 - high))).ravel()[1:])
