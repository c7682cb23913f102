"""The table [[obstacle]], and the scenarios that take it."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from softnlp.scenario.schema import BlockedForceFile, ForwardFile
from softnlp.scenario.values import Label, Positive, Table, Vector

MOST_OBSTACLES = 20


class ObstacleTable(Table):
    """[[obstacle]]: what the robot may touch, one table each.

    kind : what it is
    point_mm : of a plane, or the middle of a trocar; as in [0.0, 0.0, 30.0]
    normal : of a plane, out of it towards the robot; as in [1.0, 0.0, 0.0]
    centre_mm : of a sphere; as in [-25.0, 0.0, 60.0]
    from_mm : one end of the axis of a cylinder, a capsule or a tube; as in [-30.0, -50.0, 30.0]
    to_mm : the other end; as in [-30.0, 50.0, 30.0]
    axis : of a trocar, a direction; as in [0.0, 0.0, 1.0]
    radius_mm : of all but a plane; as in 8.0
    length_mm : of a trocar; as in 5.0
    part : what of the robot touches it
    name : by which results call it; by default its kind and number; as in "liver"
    """

    kind: Literal["plane", "sphere", "cylinder", "capsule", "trocar", "tube"]
    point_mm: Vector | None = None
    normal: Vector | None = None
    centre_mm: Vector | None = None
    from_mm: Vector | None = None
    to_mm: Vector | None = None
    axis: Vector | None = None
    radius_mm: Positive | None = None
    length_mm: Positive | None = None
    part: Literal["body", "tip axis", "tip rim"] = "body"
    name: Label | None = None


Obstacles = Annotated[list[ObstacleTable], Field(max_length=MOST_OBSTACLES)]


class BlockedAmongObstaclesFile(BlockedForceFile):
    """A whole scenario of `blocked-force`."""

    obstacle: Obstacles = Field(default=[])


class AmongObstaclesFile(ForwardFile):
    """A whole scenario of `forward`."""

    obstacle: Obstacles = Field(default=[])
