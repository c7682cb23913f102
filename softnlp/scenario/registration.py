"""[registration] of a scenario as a registration in SI units, and what it is to an import."""

from __future__ import annotations

from typing import Any

import numpy as np

from softnlp.base.errors import InputError
from softnlp.base.units import DEGREE, MILLIMETRE
from softnlp.scenario.schema import RegistrationTable
from softnlp.studies.registration import Registration, rotation_of_quaternion

_IMPORTED = ("base_sensor_mm", "tip_offset_mm")


def registration_of(table: RegistrationTable, sets: int) -> Registration | None:
    """Return the registration that a table asks for, None for none.

    sets : of the robot whose pressures are reordered.

    Raises
    ------
    InputError
        For keys that do not go together, and an order that is none of the robot's sets.
    """
    frame = table.frame
    given = ("rotation_world_from_base_quat_xyzw", "translation_mm")
    if frame == "fit":
        table.refuse(given, 'not used with frame = "fit"; remove it', "registration")
        if table.clock_deg is None:
            raise InputError(
                "a frame that is fitted has the clock in it; fit one of them", table="registration", key="clock_deg"
            )
    if frame != "base sensor":
        table.refuse(("base_sensor_mm",), 'used with frame = "base sensor" only; remove it', "registration")
    order = tuple(table.set_order or ())
    if order and sorted(order) != list(range(1, sets + 1)):
        text = f"expected each set from 1 to {sets} once, got {list(order)}"
        raise InputError(text, table="registration", key="set_order")
    fit = [name for name, wanted in (("frame", frame == "fit"), ("tip_offset", table.tip_offset_mm is None)) if wanted]
    fit += ["clock"] if table.clock_deg is None else []
    fit += ["tip_sensor"] if table.tip_sensor_quat_xyzw is None else []
    q = table.rotation_world_from_base_quat_xyzw
    offset = (0.0, 0.0, 0.0) if table.tip_offset_mm is None else tuple(v * MILLIMETRE for v in table.tip_offset_mm)
    made = Registration(
        rotation=np.eye(3) if q is None else rotation_of_quaternion(q),
        translation=tuple(v * MILLIMETRE for v in table.translation_mm or (0.0, 0.0, 0.0)),
        # an import by the base sensor takes the sensor's place on the tip off already
        tip_offset=(0.0, 0.0, 0.0) if frame == "base sensor" else offset,
        clock=(table.clock_deg or 0.0) * DEGREE,
        fit=tuple(fit),
        tip_sensor=rotation_of_quaternion(table.tip_sensor_quat_xyzw or [0.0, 0.0, 0.0, 1.0]),
        set_order=order if order != tuple(range(1, sets + 1)) else (),
    )
    return made if made.acts or made.set_order else None


def takes_orientations(table: RegistrationTable) -> bool:
    """Whether a table says how the axes of the tip's sensor lie, so that orientations count."""
    return "tip_sensor_quat_xyzw" in table.model_fields_set


def import_settings(table: RegistrationTable) -> dict[str, Any] | None:
    """Return what a registration by the base sensor is to the import of a tracker's file, None for another."""
    if table.frame != "base sensor":
        return None
    if table.tip_offset_mm is None:
        raise InputError(
            'expected numbers; "fit" goes with frame = "fit" or "given"', table="registration", key="tip_offset_mm"
        )
    known = {key: getattr(table, key) for key in _IMPORTED if getattr(table, key) is not None}
    if table.tip_sensor_quat_xyzw is None and any(table.tip_offset_mm):
        text = "expected numbers: the base sensor's frame takes tip_offset_mm off along the axes of the tip's sensor"
        raise InputError(text, table="registration", key="tip_sensor_quat_xyzw")
    axes = rotation_of_quaternion(table.tip_sensor_quat_xyzw or [0.0, 0.0, 0.0, 1.0])
    known["tip_offset_mm"] = [float(v) for v in np.array(table.tip_offset_mm) @ axes]  # along those of the sensor
    return {"frame": "base sensor", **known}
