"""What a sweep keeps of each pose: one row of a structured array, which a journal can store as bytes."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.statics.step import STABLE_FLAGS

Rows = NDArray[np.void]

STATUSES: tuple[Status, ...] = tuple(Status)
"""`status` of a row is a position here."""


class Lane(IntEnum):
    """Which solver a row comes from."""

    BATCH = 0
    PROBLEM = 1


def row_type(chambers: int, *, wall: bool, obstacles: int = 0) -> np.dtype[Any]:
    """Return the type of a row; SI units, world frame, NaN where there is no solution.

    pose : number of the pose in the plan. status : position in `STATUSES`. stable : of `STABLE_FLAGS`.
    self_intersecting : 1, 0, or -1 without a solution. lane : `Lane`. error : estimated tip position error over L_0.
    The rest is as in `softnlp.statics.step.Pose`; with a wall the blocked shape's, blocked_force [N] and gap, of the
    free shape's contact point to the wall [m]; among obstacles contact_force (obstacles, 3) on the robot [N] and
    contact_gap (obstacles,) [m].
    """
    fields: list[tuple[Any, ...]] = [
        ("pose", "<i8"),
        ("status", "i1"),
        ("stable", "i1"),
        ("self_intersecting", "i1"),
        ("lane", "i1"),
        ("intervals", "<i2"),
        ("iterations", "<i4"),
        ("stretch", "<f8"),
        ("tip_position", "<f8", (3,)),
        ("tip_rotation", "<f8", (3, 3)),
        ("bending_angle", "<f8"),
        ("backbone_length", "<f8"),
        ("chamber_length", "<f8", (chambers,)),
        ("residual", "<f8"),
        ("error", "<f8"),
    ]
    if wall:
        fields += [("blocked_force", "<f8"), ("gap", "<f8")]
    if obstacles:
        fields += [("contact_force", "<f8", (obstacles, 3)), ("contact_gap", "<f8", (obstacles,))]
    return np.dtype(fields)


def unsolved_rows(numbers: NDArray[np.int64], kind: np.dtype[Any]) -> Rows:
    """Return rows without solutions: every number NaN, status `diverged`."""
    rows = np.zeros(numbers.size, kind)
    for name in kind.names or ():
        if kind[name].base.kind == "f":
            rows[name] = np.nan
    rows["pose"] = numbers
    rows["status"] = STATUSES.index(Status.DIVERGED)
    rows["stable"] = STABLE_FLAGS["undefined"]
    rows["self_intersecting"] = -1
    rows["lane"] = Lane.PROBLEM
    return rows


@dataclass(frozen=True, eq=False)
class Block:
    """The solved rows of one chunk of a plan, in the chunk's order.

    messages : for poses that ended otherwise than `solved`, (pose, text).
    """

    chunk: int
    rows: Rows
    messages: tuple[tuple[int, str], ...]
