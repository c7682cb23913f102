"""Solving one chunk of a plan: all its poses at once, and by the problem itself those that this leaves."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.batch.alone import Alone
from softnlp.batch.arrays import some
from softnlp.batch.blocked_lane import CLOSURES, BlockedLane, BlockedPoses
from softnlp.batch.plan import Plan
from softnlp.batch.pose_lane import PoseLane, Poses, entries
from softnlp.batch.poses import STATUSES, Block, Lane, Rows, unsolved_rows
from softnlp.model.segments import SegmentedRobot
from softnlp.statics.reduced import POSITION, ROTATION, STATE
from softnlp.statics.step import Step, stable_flag

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]


class ChunkSolver:
    """Solves chunks of one plan; a worker makes one and keeps what it compiled."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        # The batch proposes and some poses are audited; what is solved alone is not closed one by one.
        self._alone = Alone(plan, plan.numerics if self.by_ipopt else plan.numerics.without_ipopt())
        single = not isinstance(plan.model.robot, SegmentedRobot) and not plan.obstacles
        together = single and plan.numerics.transcription == "multiple-shooting" and not self.by_ipopt
        self._free = PoseLane(plan) if together else None
        self._wall = self._alone.wall
        self._blocked: BlockedLane | None = None
        together = self._free is not None and plan.numerics.intervals is None
        if self._free is not None and plan.contact is not None and self._wall is not None:
            together = together and plan.contact.closure in CLOSURES
            self._blocked = BlockedLane(plan, plan.contact, self._wall, self._free) if together else None

    @property
    def by_ipopt(self) -> bool:
        """Whether IPOPT solves every pose."""
        return self.plan.numerics.engine == "ipopt"

    def solve(self, chunk: int) -> Block:
        """Return the poses of a chunk; never raises for a pose that cannot be solved."""
        numbers = self.plan.members(chunk)
        rows = unsolved_rows(numbers, self.plan.row_type)
        columns = self.plan.full_values(numbers)
        if self._free is not None and (self._wall is None or self._blocked is not None):
            self._solve_together(self._free, rows, columns, self.plan.values[numbers])
        messages: list[tuple[int, str]] = []
        near: Any = None
        for k in np.flatnonzero(rows["lane"] == Lane.PROBLEM).tolist():
            step, solved = self._alone.solve(columns[:, k], near)
            near = solved or near
            _fill(rows, k, step)
            if step.status is not Status.SOLVED:
                messages.append((int(numbers[k]), step.message))
        dead_moment = np.any(columns[entries(self.plan, "tip_moment")] != 0, axis=0)
        rows["stable"][dead_moment] = stable_flag(None)  # also of those that the lane found
        return Block(chunk, rows, tuple(messages))

    def _solve_together(self, lane: PoseLane, rows: Rows, columns: Array, features: Array) -> None:
        """Fill the rows of poses that are solved, accurate and stable for certain; the others stay as they are."""
        free = lane.solve(columns, features)
        if self._blocked is None:
            _fill_free(rows, free, lane.self_intersecting(free, columns))
            return
        gap, touch = self._blocked.gaps(free), self._blocked.touching(free)
        beyond = gap <= -touch
        apart = some_poses(free, ~beyond)
        _fill_free(rows, apart, lane.self_intersecting(apart, columns))
        rows["blocked_force"][apart.numbers] = 0.0
        rows["gap"][apart.numbers] = gap[~beyond]
        rows["status"][apart.numbers[(gap > touch)[~beyond]]] = STATUSES.index(Status.NO_CONTACT)
        if np.any(beyond):
            found = self._blocked.solve(columns, features, some_poses(free, beyond))
            if found is not None:
                gaps = np.full(len(rows), np.nan)
                gaps[free.numbers] = gap
                _fill_blocked(rows, found, gaps[found.numbers], self._blocked.self_intersecting(found, columns))


def some_poses(poses: Poses, mask: NDArray[np.bool_]) -> Poses:
    """Return some of the solved poses."""
    return Poses(poses.numbers[mask], some(poses.sections, mask), some(poses.shot, mask), poses.residual[mask])


def _fill_free(rows: Rows, poses: Poses, through: Mask) -> None:
    """Put solved poses without a wall into their rows."""
    lengths, angle, backbone = poses.shot.integrals[:-2], poses.shot.integrals[-2], poses.shot.integrals[-1]
    _fill_together(rows, poses, poses.shot.tip, lengths, angle, backbone)
    rows["self_intersecting"][poses.numbers] = through


def _fill_blocked(rows: Rows, poses: BlockedPoses, gap: Array, through: Mask) -> None:
    """Put solved blocked poses into their rows."""
    angle, backbone = poses.shot.integrals
    _fill_together(rows, poses, poses.shot.state, poses.shot.state[STATE:], angle, backbone)
    rows["self_intersecting"][poses.numbers] = through
    rows["blocked_force"][poses.numbers] = poses.force
    rows["gap"][poses.numbers] = gap


def _fill_together(
    rows: Rows, poses: Poses | BlockedPoses, tip: Array, lengths: Array, angle: Array, backbone: Array
) -> None:
    """Put what poses with and without a wall share into their rows; tip : [p, R, ...].

    All are stable for certain, but where the rod is compressed to nothing.
    """
    where, shot, L_0 = poses.numbers, poses.shot, poses.sections.length_unit
    rows["status"][where] = STATUSES.index(Status.SOLVED)
    rows["lane"][where] = Lane.BATCH
    rows["stable"][where] = np.where(np.isinf(shot.curvature), stable_flag(None), stable_flag(True))
    rows["intervals"][where] = shot.intervals
    rows["iterations"][where] = shot.iterations
    rows["stretch"][where] = poses.sections.stretch
    rows["tip_position"][where] = (tip[POSITION] * L_0).T
    rows["tip_rotation"][where] = tip[ROTATION].T.reshape(-1, 3, 3).transpose(0, 2, 1)
    rows["bending_angle"][where] = angle
    rows["backbone_length"][where] = backbone * L_0
    rows["chamber_length"][where] = (lengths * L_0).T
    rows["residual"][where] = poses.residual
    rows["error"][where] = shot.error


def _fill(rows: Rows, k: int, step: Step) -> None:
    """Put a step into row k."""
    rows["status"][k] = STATUSES.index(step.status)
    rows["lane"][k] = Lane.PROBLEM
    rows["iterations"][k] = step.iterations
    rows["intervals"][k] = step.intervals or 0
    rows["residual"][k] = np.nan if step.residual is None else step.residual
    pose = step.pose
    if pose is None or not step.status.has_solution:
        return
    rows["stable"][k] = stable_flag(pose.stable)
    rows["self_intersecting"][k] = pose.fit.self_intersecting
    rows["error"][k] = step.discretisation_error
    for name in ("stretch", "tip_position", "tip_rotation", "bending_angle", "backbone_length", "chamber_length"):
        rows[name][k] = getattr(pose, name)
    for j, contact in enumerate(step.contacts):
        rows["contact_force"][k, j] = contact.force
        rows["contact_gap"][k, j] = contact.gap
    if step.contact is not None:
        rows["blocked_force"][k] = step.contact.force
        rows["gap"][k] = step.contact.gap
