"""The numbers of a sweep by name, in file units: one list, so that netCDF and CSV agree."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.units import BAR, DEGREE, MILLIMETRE, NEWTON_MILLIMETRE
from softnlp.batch.plan import Plan
from softnlp.batch.poses import STATUSES, Lane, Rows
from softnlp.model.gravity import gravity_words
from softnlp.model.robot import DIMENSIONS
from softnlp.statics.step import SELF_INTERSECTING_FLAGS, STABLE_FLAGS, STABLE_MEANING
from softnlp.studies.fields import SELF_INTERSECTING

Array = NDArray[Any]

TEXT = "text"
_STATUS_NAMES = np.array([status.value for status in STATUSES], dtype=object)
LONGEST_STATUS = max(len(status.value) for status in STATUSES)
_DECIMALS = 12


@dataclass(frozen=True)
class Column:
    """One quantity of every pose.

    dims : names of its dimensions after `pose`. kind : numpy type, or `TEXT`. of : from the rows of some poses and
    their numbers. more : further attributes.
    """

    name: str
    dims: tuple[str, ...]
    kind: str
    unit: str
    meaning: str
    of: Callable[[Rows, NDArray[np.int64]], Array]
    more: dict[str, Any] = field(default_factory=dict)


def columns(plan: Plan) -> tuple[Column, ...]:
    """Return every quantity of the poses of a plan."""
    return (
        _given("pressure_bar", ("set",), "bar", "gauge pressure of each chamber set", plan.pressures(), BAR),
        *_times(plan),
        *(c for name in plan.varied if name != "pressure" for c in _varied(plan, name)),
        *_POSE,
        *(_WALL if plan.contact is not None else ()),
        *_SOLVE,
    )


def _flags(names: dict[str, int]) -> dict[str, Any]:
    return {"flag_values": np.array(list(names.values()), np.int8), "flag_meanings": " ".join(names)}


def _number(name: str, unit: str, meaning: str, entry: str, scale: float = 1.0, dims: tuple[str, ...] = ()) -> Column:
    """Return a column that is an entry of the rows in another unit."""
    return Column(name, dims, "f8", unit, meaning, lambda rows, numbers: rows[entry] / scale)


def _whole(name: str, entry: str, kind: str, meaning: str, **more: Any) -> Column:
    return Column(name, (), kind, "1", meaning, lambda rows, numbers: rows[entry], more)


def _tilt(rows: Rows, numbers: NDArray[np.int64]) -> Array:
    axis = rows["tip_rotation"][:, :, 2]
    return np.asarray(np.arctan2(np.hypot(axis[:, 0], axis[:, 1]), axis[:, 2]) / DEGREE)


_POSE = (
    Column("status", (), TEXT, "1", "how the pose ended", lambda rows, numbers: _STATUS_NAMES[rows["status"]]),
    _number("tip_position_mm", "mm", "tip position in the world frame", "tip_position", MILLIMETRE, ("axis",)),
    _number("tip_rotation", "1", "tip rotation; columns are the body axes", "tip_rotation", dims=("row", "col")),
    _number(
        "bending_angle_deg", "degree", "bending angle: integral of sqrt(u_x^2 + u_y^2) over s", "bending_angle", DEGREE
    ),
    Column("tilt_deg", (), "f8", "degree", "angle between the tip axis and +z", _tilt),
    _number("stretch", "1", "axial stretch from the pressure balance, Eq. (23)", "stretch"),
    _number(
        "backbone_length_mm", "mm", "length of the deformed axis: integral of |v| over s", "backbone_length", MILLIMETRE
    ),
    _number(
        "chamber_length_mm", "mm", "length of each deformed chamber axis", "chamber_length", MILLIMETRE, ("chamber",)
    ),
)
_WALL = (
    _number("blocked_force_N", "N", "the wall's push on the tip, not negative", "blocked_force"),
    _number("gap_mm", "mm", "from the wall to the free shape's contact point; negative beyond it", "gap", MILLIMETRE),
)
_SOLVE = (
    _whole("stable", "stable", "i1", STABLE_MEANING, **_flags(STABLE_FLAGS)),
    _whole(
        SELF_INTERSECTING,
        SELF_INTERSECTING,
        "i1",
        "curvature times outer radius reaches 1, or parts of the body lie inside each other",
        **_flags(SELF_INTERSECTING_FLAGS),
    ),
    _number("residual", "1", "largest equation error: force by EI/L^2, moment by EI/L, length by L", "residual"),
    _number("discretisation_error", "1", "estimated error of the tip position, of the robot's length L_0", "error"),
    _whole("intervals", "intervals", "i4", "intervals on the rod, 0 where there is no grid"),
    _whole("iterations", "iterations", "i4", "iterations of the solver"),
    _whole(
        "lane",
        "lane",
        "i1",
        "which solver the pose comes from",
        **_flags({lane.name.lower(): int(lane) for lane in Lane}),
    ),
)


def _times(plan: Plan) -> tuple[Column, ...]:
    return () if plan.times is None else (_given("t_s", (), "s", "time of the pose", plan.times, 1.0),)


def _varied(plan: Plan, name: str) -> list[Column]:
    """Return the columns of a varied quantity, named as the scenario names what may be varied."""
    values = plan.values[:, plan.columns_of(name)]
    table, _, entry = name.partition(".")
    if name == "gravity":
        size, words = np.linalg.norm(values, axis=1), gravity_words(values[int(np.argmax(np.abs(values).sum(axis=1)))])
        return [_given("gravity_size_m_per_s2", (), "m/s^2", f"size of gravity; {words}", size, 1.0)]
    if name in ("tip_force", "tip_moment"):
        what, unit, scale = ("force", "N", 1.0) if name == "tip_force" else ("moment", "Nmm", NEWTON_MILLIMETRE)
        shown = "N" if unit == "N" else "N mm"
        return [
            _given(f"tip_load_{what}_{x}_{unit}", (), shown, f"tip {what} along {x}", values[:, k], scale)
            for k, x in enumerate("xyz")
        ]
    value = values[:, 0]
    if table == "robot":
        dimension = next(d for d in DIMENSIONS if d.field == entry)
        unit = "degree" if dimension.file_key.endswith("_deg") else "mm"
        meaning = f"{entry.replace('_', ' ')} of the robot"
        return [_given(f"robot_{dimension.file_key}", (), unit, meaning, value, dimension.scale or 1.0)]
    if name == "material.density":
        return [_given("material_density_kg_m3", (), "kg/m^3", "density of the silicone", value, 1.0)]
    if table == "material":
        constant = next(c for c in plan.model.material.law.constants if c.name == entry)
        meaning = f"constant {constant.name} of the silicone"
        return [_given(f"material_{constant.file_key}", (), constant.unit, meaning, value, constant.scale)]
    return [_given(name.replace(".", "_"), (), "1", f"coefficient {entry.replace('_', ' ')}", value, 1.0)]


def _given(
    name: str,
    dims: tuple[str, ...],
    unit: str,
    meaning: str,
    values: Array,
    scale: float,
) -> Column:
    """Return a column of what the plan gives."""
    return Column(name, dims, "f8", unit, meaning, partial(_in_file_unit, values, scale))


def _in_file_unit(values: Array, scale: float, rows: Rows, numbers: NDArray[np.int64]) -> Array:
    """Return values in another unit, those that are short decimals as such: 0.3, not 0.30000000000000004."""
    given = values[numbers]
    converted = given / scale
    tidy = np.round(converted, _DECIMALS)
    return np.asarray(np.where(tidy * scale == given, tidy, converted))
