"""Inverse kinematics of a scenario: its tables, what they ask, checked and in SI units, and the run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, Field, PlainValidator, TypeAdapter

from softnlp.base.errors import InputError, located
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.scenario.data import Read, Scenario, run_of
from softnlp.scenario.obstacle_schema import Obstacles
from softnlp.scenario.schema import (
    MOST_STEPS,
    Normal,
    NotNegative,
    Positive,
    ScenarioFile,
    Table,
    UncertaintyTable,
    Vector,
)
from softnlp.scenario.segments import allowed
from softnlp.statics.step import Run, Step
from softnlp.studies.forward import followed
from softnlp.studies.inverse_obstacles import InverseAmongObstacles
from softnlp.studies.inverse_solver import InverseKinematics
from softnlp.studies.targets import InverseTask, Target

Array = NDArray[np.float64]
Rows = Annotated[list[Vector], Field(min_length=1, max_length=MOST_STEPS)]
_STRICT = ConfigDict(strict=True, allow_inf_nan=False)
_BOUNDS = TypeAdapter(Annotated[list[NotNegative], Field(min_length=1)], config=_STRICT)
_PAIRS = TypeAdapter(Annotated[list[list[NotNegative]], Field(min_length=1)], config=_STRICT)


def _bounds(value: Any) -> list[float] | list[list[float]]:
    """Return bounds as they are given: the form is chosen first, so that what is wrong is said of that form alone."""
    pairs = isinstance(value, list) and any(isinstance(item, list) for item in value)
    return (_PAIRS if pairs else _BOUNDS).validate_python(value)


Bounds = Annotated[list[float] | list[list[float]], PlainValidator(_bounds)]
Directions = Annotated[list[Normal], Field(min_length=1, max_length=MOST_STEPS)]


class TargetTable(Table):
    """[target]: where the tip is to be, which way it is to point, or both row by row.

    tip_position_mm : rows of x, y, z; as in [[10.0, 0.0, 60.0]]
    tip_direction : rows of a vector along which the tip is to point; as in [[0.0, 0.0, 1.0]]
    contact_force_N : that no obstacle may push harder; 0.0 for none touched; as in 0.1
    length_per_radian_mm : weighs a direction against a position; by default the robot's length; as in 60.0
    """

    tip_position_mm: Rows | None = None
    tip_direction: Directions | None = None
    length_per_radian_mm: Positive | None = None
    contact_force_N: NotNegative | None = None


class BoundsTable(Table):
    """[bounds]: lowest and highest pressure, for all sets or for each.

    pressure_bar : lowest and highest of all sets, or such a pair for each
    """

    pressure_bar: Bounds = Field(default=[0.0, 1.5])


class InverseFile(ScenarioFile):
    """A whole scenario of `inverse`."""

    target: TargetTable = Field(description="a table with tip_position_mm, tip_direction or both")
    bounds: BoundsTable = BoundsTable()
    obstacle: Obstacles = Field(default=[])
    uncertainty: UncertaintyTable | None = None


def inverse_task(given: Read) -> InverseTask:
    """Return what is asked of inverse kinematics.

    Raises
    ------
    InputError
        With the table and the key, for rows that do not pair, and bounds that do not fit the robot.
    """
    target: TargetTable = given.file.target
    positions, directions = target.tip_position_mm, target.tip_direction
    if positions is None and directions is None:
        raise InputError("expected tip_position_mm, tip_direction or both, got none", table="target")
    if positions is None or directions is None:
        needed = "expected only where tip_position_mm and tip_direction are both given"
        target.refuse(["length_per_radian_mm"], needed, "target")
    elif len(positions) != len(directions):
        problem = f"expected one direction a position, got {len(directions)} for {len(positions)}"
        raise InputError(problem, table="target", key="tip_direction")
    if not given.file.obstacle:
        target.refuse(["contact_force_N"], "expected only with [[obstacle]]", "target")
    lower, upper = pressures_of(given.file.bounds, given.robot.chamber_sets)
    targets = tuple(
        Target(
            None if positions is None else np.array(positions[k]) * MILLIMETRE,
            None if directions is None else np.array(directions[k]),
        )
        for k in range(len(positions or directions or ()))
    )
    weight = float(given.robot.length)
    if target.length_per_radian_mm is not None:
        weight = target.length_per_radian_mm * MILLIMETRE
    return InverseTask(targets, lower, upper, weight, allow=allowed(given.file), contact_force=target.contact_force_N)


def pressures_of(table: BoundsTable, sets: int) -> tuple[Array, Array]:
    """Return the bounds of each set [Pa]."""
    rows = table.pressure_bar
    pairs = rows if any(isinstance(row, list) for row in rows) else [rows] * sets
    if len(pairs) != sets or not all(isinstance(pair, list) and len(pair) == 2 for pair in pairs):
        problem = f"expected [lowest, highest], or {sets} such pairs, one for each chamber set"
        raise InputError(problem, table="bounds", key="pressure_bar")
    bounds = np.array(pairs, dtype=float)
    for low, high in bounds[bounds[:, 1] < bounds[:, 0]][:1]:
        problem = f"expected a highest pressure of at least the lowest, got [{low:g}, {high:g}]"
        raise InputError(problem, table="bounds", key="pressure_bar")
    return bounds[:, 0] * BAR, bounds[:, 1] * BAR


def run_inverse(scenario: Scenario, progress: Callable[[int, Step], None] | None, branches: int = 0) -> Run:
    """Run inverse kinematics, a step a target; `branches` means nothing here."""
    task = scenario.task
    assert isinstance(task, InverseTask)
    if scenario.obstacles:
        asked = scenario.model, scenario.numerics, scenario.loads, task, scenario.obstacles
        with located(source=str(scenario.path)):
            among = InverseAmongObstacles(*asked)
        return run_of(scenario, followed(among.nearest, task.targets, progress))
    solver = InverseKinematics(scenario.model, scenario.numerics, scenario.loads, task, "newton")
    return run_of(scenario, followed(solver.nearest, task.targets, progress))
