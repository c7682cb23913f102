"""Tips of a robot from a tracker's file: in the frame of the robot's base where the file or a person tells it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.units import MILLIMETRE
from softnlp.laboratory.choices import AskError, Choices
from softnlp.laboratory.clock import time_of
from softnlp.laboratory.imported import ANY, Imported, require_possible
from softnlp.laboratory.poses import (
    FARTHEST,
    Sensor,
    motion_axis,
    order_misfits,
    pose_groups,
    sensors,
    tip_and_base,
    turn_sense,
)
from softnlp.laboratory.pressure import is_pressure, pressure_columns, pressures_of
from softnlp.laboratory.samples import sample_checks, spikes
from softnlp.laboratory.signals import noise
from softnlp.laboratory.streams import with_pressures
from softnlp.laboratory.table import RawTable
from softnlp.studies.check import Check

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

FRAMES = ("given", "base sensor", "rest", "fit")
_AXES = ("x_mm", "y_mm", "z_mm")
_QUATERNION = ("qx", "qy", "qz", "qw")
_UP = {  # rotation vectors onto +z
    **{"z": (0.0, 0.0, 0.0), "y": (np.pi / 2, 0.0, 0.0), "x": (0.0, -np.pi / 2, 0.0)},
    **{"-z": (np.pi, 0.0, 0.0), "-y": (-np.pi / 2, 0.0, 0.0), "-x": (0.0, np.pi / 2, 0.0)},
}
_AXIS, _STRAIGHT = 25.0, 15.0  # [deg]: the robot's axis, and its rest tip as seen from its base, away from z


def is_tips(table: RawTable) -> bool:
    """Whether a table holds positions of sensors."""
    return bool(pose_groups(table))


def import_tips(tables: Sequence[RawTable], choices: Choices) -> Imported:
    """Return the tips of a tracker's file, with the pressures where the file or a log beside it holds them.

    Raises
    ------
    AskError
        Where sensors, units or frame are not known.
    InputError
        For settings that do not fit, or files without positions.
    """
    trackers = [table for table in tables if is_tips(table)]
    logs = [table for table in tables if table not in trackers and is_pressure(table)]
    if len(trackers) != 1 or len(logs) + 1 != len(tables):
        raise InputError("expected one file of a tracker, and at most one log of pressures", key="FILE")
    found = sensors(trackers[0], choices)
    tip_name, base_name = tip_and_base({name: sensor for name, (_, sensor) in found.items()}, choices)
    table, tip = found[tip_name]
    lost = int(np.sum(~tip.seen))
    if lost == len(tip.seen):
        raise AskError(
            f"{table.file}: sensor {tip_name} was seen in no row, or only beyond {FARTHEST:g} m: where its positions "
            "are in another unit say --set unit.NAME=mm of each of their columns"
        )
    choices.drop(lost, "rows in which the sensor was not seen")
    checks = _quaternion_checks(tip)
    position, quaternion, more = _in_frame(tip, None if base_name is None else found[base_name][1], choices)
    checks += [*more, *_sense_checks(position, quaternion, choices)]
    time, seen = None, tip.seen
    pressures = None
    if pressure_columns(table) and not logs:
        _, pressures, _ = pressures_of(table.kept(seen), choices, timed=False)
    else:
        time, clock_checks = time_of(table, choices, need=bool(logs))
        checks += clock_checks
    columns: dict[str, Array] = {} if time is None else {"t_s": time[seen]}
    if pressures is not None:
        if len(pressures) != len(position):
            raise InputError(f"{table.file}: a pressure is missing in a row that has a tip")
        columns |= {f"p{k + 1}_bar": column for k, column in enumerate(pressures.T)}
    columns |= dict(zip(_AXES, position.T / MILLIMETRE, strict=True))
    if quaternion is not None:
        columns |= dict(zip(_QUATERNION, quaternion.T, strict=True))
    stream = {name: column for name, column in columns.items() if not name.startswith("p")}
    checks += sample_checks(stream, columns.get("t_s"), lost)
    checks.append(
        Check("jumps of the tip", spikes(position), (0, 0), ANY, "single samples far away; the tracker lost the sensor")
    )
    numbers = {"rows_not_seen": float(lost)}
    if time is not None:
        numbers["noise_mm"] = float(max(map(noise, position.T))) / MILLIMETRE
    if logs:
        columns, streamed, told = with_pressures(columns, position, table, logs[0], choices)
        checks, numbers = [*checks, *streamed], numbers | told
    checks += [*_rest_checks(columns, choices), *_upright_checks(columns, choices)]
    require_possible(checks, choices)
    return Imported("tips", tuple(t.file for t in tables), columns, tuple(checks), choices, numbers)


def _in_frame(tip: Sensor, base: Sensor | None, choices: Choices) -> tuple[Array, Array | None, list[Check]]:
    """Return the tip (rows, 3) [m] and its quaternion in the frame that is asked for, of the rows that were seen."""
    from scipy.spatial.transform import Rotation

    frame = choices.get("frame")
    if frame is None and base is not None:
        raise AskError(
            f"sensor {base.name} stands still at the base: --set frame='base sensor' with base_sensor_mm=[x, y, z], "
            "where it sits in the robot's frame (origin at the base, z along the robot at rest), or --set frame=given "
            "leaves the tips in the tracker's frame"
        )
    frame = choices.one_of("frame", FRAMES, "given")
    position = tip.position[tip.seen]
    R = None if tip.quaternion is None else Rotation.from_quat(tip.quaternion[tip.seen])
    offset = np.array(choices.numbers("tip_offset_mm", 3) or [0.0, 0.0, 0.0]) * MILLIMETRE
    if np.any(offset) and R is None:
        raise InputError(
            "the sensor's place on the tip needs its quaternion; fit it in [registration]", key="tip_offset_mm"
        )
    if R is not None and np.any(offset):
        position = position - R.apply(offset)
    turn, shift, checks = _frame(frame, position, R, base, choices)
    position = turn.inv().apply(position - shift)
    up = choices.one_of("up", _UP, "z")
    upright = Rotation.from_rotvec(_UP[up])
    position = upright.apply(position)
    quaternion = None if R is None else (upright * turn.inv() * R).as_quat(canonical=True)
    return position, quaternion, checks


def _frame(
    frame: str, position: Array, R: Rotation | None, base: Sensor | None, choices: Choices
) -> tuple[Rotation, Array, list[Check]]:
    """Return rotation and origin [m] of the robot's frame in that of the tracker, and checks."""
    from scipy.spatial.transform import Rotation

    if frame == "base sensor":
        if base is None or base.quaternion is None:
            raise InputError("expected a sensor at the base with its quaternion: --set base=NAME", key="frame")
        place = choices.numbers("base_sensor_mm", 3)
        if place is None:
            raise AskError("where does the base sensor sit in the robot's frame? --set base_sensor_mm=[x, y, z]")
        q = choices.numbers("base_sensor_quat_xyzw", 4) or [0.0, 0.0, 0.0, 1.0]
        seen = Rotation.from_quat(base.quaternion[base.seen])
        turn = seen.mean() * Rotation.from_quat(q).inv()
        shift = np.mean(base.position[base.seen], axis=0) - turn.apply(np.array(place) * MILLIMETRE)
        likely = "the base moved while the tips were measured; fix it, or measure with it again"
        return turn, shift, [Check("motion of the base", base.spread / MILLIMETRE, (0, 3.0), ANY, likely, "mm")]
    if frame == "rest":
        length = choices.number("length_mm")
        if R is None or length is None:
            raise AskError("the rest pose makes a frame by the robot's length: --set length_mm=…, and a quaternion")
        first = _rest_rows(position)
        turn = R[first].mean()
        shift = np.mean(position[first], axis=0) - turn.apply([0.0, 0.0, length * MILLIMETRE])
        return turn, shift, []
    q = choices.numbers("rotation_world_from_base_quat_xyzw", 4) or [0.0, 0.0, 0.0, 1.0]
    moved = choices.numbers("translation_mm", 3) or [0.0, 0.0, 0.0]
    return Rotation.from_quat(q), np.array(moved) * MILLIMETRE, []


def _rest_rows(position: Array) -> NDArray[np.intp]:
    """Return the rows of the first pose: those before the tip moves."""
    from softnlp.laboratory.signals import plateaus

    first = next(plateaus(position), np.array([0]))
    return first if first[0] <= max(3, 0.1 * len(position)) else np.array([0])


def _quaternion_checks(tip: Sensor) -> list[Check]:
    """Return the checks of the norm of quaternions and of the order of their columns."""
    if tip.quaternion is None:
        return []
    norm = np.linalg.norm(tip.quaternion[tip.seen], axis=1)
    off = float(np.max(np.abs(norm - 1)))
    found = [Check("quaternion norm, away from 1", off, (0, 0.01), (0, 0.1), "these columns are no quaternion")]
    misfits = order_misfits(tip)
    if not misfits:
        return found
    used, *others = misfits.items()
    best = min(others, key=lambda pair: pair[1])
    how = f"--set quaternion={best[0]}" if best[0] != "inverse" else "turns from the sensor to the tracker; invert them"
    likely = f"read as {used[0]} the turns do not go with the motion, as {best[0]} the number is {best[1]:.3g}: {how}"
    limit = 0.3 if best[1] > 0.5 * used[1] else min(0.3, 0.12)
    found.append(Check("quaternion order", used[1], (0, limit), (0, 1), likely))
    return found


def _sense_checks(position: Array, quaternion: Array | None, choices: Choices) -> list[Check]:
    """Return the check of the sense of the turns, in the robot's frame: a tip moves to where it turns the z axis."""
    cosine = None if quaternion is None or choices.used.get("frame") == "fit" else turn_sense(position, quaternion)
    if cosine is None:
        return []
    likely = (
        "the tip moves against its turn: the quaternion is that from the robot to the sensor, so negate its vector "
        "part (a tip_offset_mm goes the wrong way else); or z is not along the robot: --set frame=…, up=…"
    )
    return [Check("cosine between the tip's motion and its turn", cosine, (0, 1), ANY, likely)]


def _rest_checks(columns: dict[str, Array], choices: Choices) -> list[Check]:
    """Return the checks of tips against pressures: the rest tip, and a tip that does not move."""
    tips = np.column_stack([columns[name] for name in _AXES])
    pressures = [column for name, column in columns.items() if name.startswith("p") and name.endswith("_bar")]
    found = []
    length = choices.number("length_mm")
    rest = np.median(tips[_rest_rows(tips)], axis=0)
    if pressures:
        P = np.column_stack(pressures)
        low = np.max(np.abs(P), axis=1) < 0.02
        rest = np.median(tips[low], axis=0) if np.any(low) else np.full(3, np.nan)
        moved = float(np.linalg.norm(np.ptp(tips, axis=0)))
        if np.ptp(P) > 0.1:
            likely = "the tip does not move while the pressure does: a wrong sensor, unit, or valve"
            found.append(Check("motion of the tip", moved, (1.0, 1e3), ANY, likely, "mm"))
    if length is not None and np.all(np.isfinite(rest)):
        away = float(np.linalg.norm(rest - [0.0, 0.0, length]))
        likely = (
            "the frame or the sensor's place on the tip is another: --set frame=…, tip_offset_mm=…, or [registration]"
        )
        found.append(Check("rest tip, away from (0, 0, length)", away, (0, 0.02 * length), ANY, likely, "mm"))
    return found


def _upright_checks(columns: dict[str, Array], choices: Choices) -> list[Check]:
    """Return the checks of a robot along z: of its motion, and of its rest tip as seen from the origin [deg]."""
    if choices.used.get("frame") == "fit":
        return []
    tips = np.column_stack([columns[name] for name in _AXES])
    rest = np.median(tips[_rest_rows(tips)], axis=0)
    how = (
        "; else --set frame=rest or 'base sensor', rotation_world_from_base_quat_xyzw=…, or frame = \"fit\" in "
        "[registration] of the scenario"
    )
    found = []
    if (told := motion_axis(tips, rest)) is not None:
        axis, in_plane = told
        angle = _from_z(axis)
        likely = f"the robot lies along {_nearest_axis(axis, choices)}{how}"
        if in_plane:
            angle = abs(90 - angle)
            likely = f"the tips move in one plane, in which z is not: --set up=y, or another{how}"
        found.append(Check("angle between the robot by its motion and z", angle, (0, _AXIS), ANY, likely, "deg"))
    if np.any(rest) and choices.number("length_mm") is None:
        likely = f"the tips are not in the frame of the robot, but along {_nearest_axis(rest, choices)}{how}"
        found.append(Check("angle between the rest tip and z", _from_z(rest), (0, _STRAIGHT), ANY, likely, "deg"))
    return found


def _from_z(axis: Array) -> float:
    """Return the angle between an axis and z [deg]."""
    return float(np.degrees(np.arccos(np.clip(axis[2] / np.linalg.norm(axis), -1, 1))))


def _nearest_axis(axis: Array, choices: Choices) -> str:
    """Return in words which axis of the tracker is near to another, and how that becomes z."""
    from scipy.spatial.transform import Rotation

    near = [name for name, turn in _UP.items() if _from_z(Rotation.from_rotvec(turn).apply(axis)) < _AXIS]
    if not near or choices.used.get("up", "z") != "z":
        return "none of its axes"
    return f"{near[0]} of the tracker: --set up={near[0]}"
