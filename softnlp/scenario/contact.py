"""The wall of a scenario: [contact], its keys checked against each other, in SI units."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.units import MILLIMETRE, NEWTON_MILLIMETRE
from softnlp.model.contact_settings import ClosureWeights, ContactSettings, ContactTask, require_in_front
from softnlp.model.robot import Robot
from softnlp.scenario.schema import ContactTable

Array = NDArray[np.float64]

_WEIGHTS = ("weight_force_per_N", "weight_moment_per_Nmm", "weight_length_per_mm", "weight_position_per_mm")
_OFFSETS = ("offset_mm", "offsets_mm", "offset_ramp")
_WALL = (*_OFFSETS, "wall_point_mm", "wall_normal", "target_force_N", "tip_cap_mm")


def contact_settings(table: ContactTable, robot: Robot | None = None) -> ContactSettings:
    """Return where the wall stands and how the problem is closed.

    robot : whose unbent tip may not start behind a wall given by a point; None leaves that to the study.

    Raises
    ------
    InputError
        With the key (no table, no source), for keys that do not go together, and as `require_in_front`.
    """
    if (table.wall_point_mm is None) != (table.wall_normal is None):
        there, absent = "wall_point_mm", "wall_normal"
        if table.wall_point_mm is None:
            there, absent = absent, there
        raise InputError(f"missing; expected together with {there}", key=absent)
    offsets = [key for key in _OFFSETS if getattr(table, key) is not None]
    if len(offsets) > 1:
        raise InputError(f"expected at most one of {', '.join(_OFFSETS)}, got {' and '.join(offsets)}", key=offsets[1])
    if table.wall_point_mm is not None and table.offset_mm is not None:
        raise InputError("expected either offset_mm or wall_point_mm and wall_normal, got both", key="offset_mm")
    if table.closure != "weighted":
        for key in ContactTable.model_fields:
            if key.startswith("weight_") and key in table.model_fields_set:
                raise InputError(f"expected only with closure = 'weighted', got closure = {table.closure!r}", key=key)
    point = None
    if table.wall_point_mm is not None:
        x, y, z = (component * MILLIMETRE for component in table.wall_point_mm)
        point = (x, y, z)
    settings = ContactSettings(
        offset=(table.offset_mm or 0.0) * MILLIMETRE,
        tip_cap=table.tip_cap_mm * MILLIMETRE,
        closure=table.closure,
        wall_point=point,
        wall_normal=table.wall_normal,
        weights=ClosureWeights(
            force=table.weight_force_per_N,
            moment=_per(table.weight_moment_per_Nmm, NEWTON_MILLIMETRE),
            length=_per(table.weight_length_per_mm, MILLIMETRE),
            position=_per(table.weight_position_per_mm, MILLIMETRE),
        ),
    )
    if robot is not None:
        require_in_front(settings, [float(robot.length)], _offsets(table) or ())
    return settings


def _offsets(table: ContactTable) -> list[float] | None:
    """Return the offsets of a characteristic curve [m], or None where none is asked for."""
    offsets = table.offsets_mm
    if table.offset_ramp is not None:
        ramp = table.offset_ramp
        offsets = np.linspace(ramp.from_mm, ramp.to_mm, ramp.steps).tolist()
    return None if offsets is None else [h * MILLIMETRE for h in offsets]


def _per(weight: float | None, unit: float) -> float | None:
    """Convert a weight given per unit of the file."""
    return None if weight is None else weight / unit


def _check_sensitivity(table: ContactTable) -> None:
    """Refuse weight_sensitivity without a weight, and with what has no force at each pressure."""
    if not any(key in table.model_fields_set for key in _WEIGHTS):
        raise InputError(f"expected at least one of {', '.join(_WEIGHTS)} with it", key="weight_sensitivity")
    asked: list[str] = [key for key in ("offsets_mm", "offset_ramp", "target_force_N") if key in table.model_fields_set]
    if table.mode == "constrained":
        asked.append("mode = 'constrained'")
    if asked:
        raise InputError(
            f"expected only where the force is asked for at each pressure, got {asked[0]}", key="weight_sensitivity"
        )


def contact_task(table: ContactTable, pressures: Array) -> ContactTask:
    """Return what is asked of the wall.

    Parameters
    ----------
    pressures : (steps, sets), of the scenario [Pa].

    Raises
    ------
    InputError
        As `contact_settings`, and where the pressures do not fit what is asked.
    """
    given = [key for key in _WALL if key in table.model_fields_set]
    if table.weight_sensitivity:
        _check_sensitivity(table)
    if table.mode == "constrained":
        if given:
            raise InputError("expected only with mode = 'blocked': mode = 'constrained' has no wall", key=given[0])
        if table.closure == "free":
            raise InputError(
                "expected 'compliant', 'rigid' or 'weighted' with mode = 'constrained', got 'free', which constrains "
                'nothing; use study = "forward"',
                key="closure",
            )
        return ContactTask(constrained=True)
    several = [key for key in ("offsets_mm", "offset_ramp", "target_force_N") if key in given]
    if len(several) > 1:
        raise InputError(f"expected at most one of {', '.join(several)}", key=several[1])
    if table.target_force_N is not None:
        if not pressures[-1].any() or np.ptp(pressures[-1][pressures[-1] > 0]) > 0:
            raise InputError(
                "expected [pressure] to end with one pressure in the sets that are to push, which bounds the search, "
                "and none in the others",
                key="target_force_N",
            )
        return ContactTask(target_force=table.target_force_N)
    offsets = _offsets(table)
    if offsets is None:
        return ContactTask(weight_sensitivity=table.weight_sensitivity)
    if len(pressures) != 1:
        raise InputError(
            f"expected one step in [pressure] with several offsets, got {len(pressures)}; give sequence_bar one row",
            key=several[0],
        )
    return ContactTask(offsets=tuple(offsets))
