"""The targets and bounds of a scenario of `inverse`, checked against each other, in SI units."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.model.robot import Robot
from softnlp.scenario.schema_inverse import BoundsTable, TargetTable
from softnlp.studies.targets import InverseTask, Target

Array = NDArray[np.float64]


def inverse_task(target: TargetTable, bounds: BoundsTable, robot: Robot) -> InverseTask:
    """Return what is asked of inverse kinematics.

    Raises
    ------
    InputError
        With the table and the key, for rows that do not pair, and bounds that do not fit the robot.
    """
    positions, directions = target.tip_position_mm, target.tip_direction
    if positions is None and directions is None:
        raise InputError("expected tip_position_mm, tip_direction or both, got none", table="target")
    if positions is not None and directions is not None and len(positions) != len(directions):
        raise InputError(
            f"expected one direction a position, got {len(directions)} for {len(positions)}",
            table="target",
            key="tip_direction",
        )
    if target.length_per_radian_mm is not None and (positions is None or directions is None):
        raise InputError(
            "expected only where tip_position_mm and tip_direction are both given",
            table="target",
            key="length_per_radian_mm",
        )
    lower, upper = _bounds(bounds, robot.chamber_sets)
    count = len(positions) if positions is not None else len(directions or ())
    targets = tuple(
        Target(
            None if positions is None else np.array(positions[k]) * MILLIMETRE,
            None if directions is None else np.array(directions[k]),
        )
        for k in range(count)
    )
    weight = float(robot.length)
    if target.length_per_radian_mm is not None:
        weight = target.length_per_radian_mm * MILLIMETRE
    return InverseTask(targets, lower, upper, weight)


def _bounds(table: BoundsTable, sets: int) -> tuple[Array, Array]:
    """Return the bounds of each set [Pa]."""
    rows = table.pressure_bar
    if any(isinstance(row, list) for row in rows):
        if len(rows) != sets or not all(isinstance(row, list) and len(row) == 2 for row in rows):
            raise _wrong(f"expected [lowest, highest], or {sets} such pairs, one for each chamber set")
        pairs = np.array(rows, dtype=float)
    else:
        if len(rows) != 2:
            raise _wrong(f"expected [lowest, highest], or {sets} such pairs, one for each chamber set")
        pairs = np.tile(np.array(rows, dtype=float), (sets, 1))
    for low, high in pairs:
        if high < low:
            raise _wrong(f"expected a highest pressure of at least the lowest, got [{low:g}, {high:g}]")
    return pairs[:, 0] * BAR, pairs[:, 1] * BAR


def _wrong(message: str) -> InputError:
    return InputError(message, table="bounds", key="pressure_bar")
