"""[[obstacle]]: the tables of what the robot may touch."""

from __future__ import annotations

from collections.abc import Sequence

from softnlp.base.errors import InputError
from softnlp.model.obstacle_tables import obstacles_of_tables
from softnlp.model.obstacles import Obstacle
from softnlp.scenario.obstacle_schema import ObstacleTable
from softnlp.scenario.schema import ScenarioFile


def obstacles_of(file: ScenarioFile, tables: Sequence[ObstacleTable]) -> tuple[Obstacle, ...]:
    """Return the obstacles of a file.

    Raises
    ------
    InputError
        Beside [uncertainty], and as `obstacles_of_tables`.
    """
    if getattr(file, "uncertainty", None) is not None:
        raise InputError("takes none beside [[obstacle]] so far", table="uncertainty")
    return obstacles_of_tables([table.model_dump() for table in tables])
