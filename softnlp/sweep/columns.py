"""The numbers of a sweep by name, in file units: one list, so that netCDF and CSV agree."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.arrays import Index
from softnlp.base.columns import MM, OUTPUTS, N, Output
from softnlp.base.netcdf import flag_attributes
from softnlp.batch.plan import Plan
from softnlp.batch.poses import STATUSES, Lane, Rows
from softnlp.model.gravity import gravity_words
from softnlp.studies.fields import FLAGS
from softnlp.sweep.task import varied_quantities

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
    of: Callable[[Rows, Index], Array]
    more: dict[str, Any] = field(default_factory=dict)


def columns(plan: Plan) -> tuple[Column, ...]:
    """Return every quantity of the poses of a plan."""
    given = OUTPUTS["pressure"]
    return (
        _given(given.key, given.dims, given.unit.attribute, given.meaning, plan.pressures(), given.scale),
        *(() if plan.times is None else (_given("t_s", (), "s", "time of the pose", plan.times, 1.0),)),
        *(c for name in plan.varied if name != "pressure" for c in _varied(plan, name)),
        *_POSE,
        *(_WALL if plan.contact is not None else ()),
        *(_CONTACTS if plan.obstacles else ()),
        *_SOLVE,
    )


def _tilt(rows: Rows) -> Array:
    axis = rows["tip_rotation"][:, :, 2]
    return np.asarray(np.arctan2(np.hypot(axis[:, 0], axis[:, 1]), axis[:, 2]))


def _lane(rows: Rows, numbers: Index) -> Array:
    return np.asarray(rows["lane"])


def _output(name: str, of: Callable[[Rows], Array] | None = None, kind: str = "f8") -> Column:
    """Return the column of an output, an entry of the rows where nothing else is said."""
    output = OUTPUTS[name]
    more = flag_attributes(FLAGS[name]) if name in FLAGS else {}

    def values(rows: Rows, numbers: Index) -> Array:
        return np.asarray(output.shown(rows[name] if of is None else of(rows)))

    return Column(output.key, output.dims, kind, output.unit.attribute, output.meaning, values, more)


_POSE = (
    Column("status", (), TEXT, "1", "how the pose ended", lambda rows, numbers: _STATUS_NAMES[rows["status"]]),
    *map(_output, ("tip_position", "tip_rotation", "bending_angle")),
    _output("tilt", _tilt),
    *map(_output, ("stretch", "backbone_length", "chamber_length")),
)
_WALL = (_output("blocked_force"), _output("gap"))
CONTACTS = (
    Output("contact_force", N, "force of the obstacle on the robot, world frame", ("obstacle", "axis")),
    Output("contact_gap", MM, "least distance between obstacle and body", ("obstacle",)),
)
"""Of poses among obstacles."""
_CONTACTS = tuple(
    Column(
        output.key,
        output.dims,
        "f8",
        output.unit.attribute,
        output.meaning,
        lambda rows, numbers, output=output: np.asarray(output.shown(rows[output.name])),  # type: ignore[misc]
    )
    for output in CONTACTS
)
_LANES = {lane.name.lower(): int(lane) for lane in Lane}
_SOLVE = (
    _output("stable", kind="i1"),
    _output("self_intersecting", kind="i1"),
    _output("residual"),
    _output("discretisation_error", lambda rows: rows["error"]),
    _output("intervals", kind="i4"),
    _output("iterations", kind="i4"),
    Column("lane", (), "i1", "1", "which solver the pose comes from", _lane, flag_attributes(_LANES)),
)


def _varied(plan: Plan, name: str) -> Iterator[Column]:
    """Yield the columns of a varied quantity, named as the scenario names what may be varied."""
    values = plan.values[:, plan.columns_of(name)]
    for key, kind in varied_quantities(plan.model.material, plan.loads.gravity).items():
        if kind.quantity == name:
            size, meaning = values[:, kind.place if isinstance(kind.place, int) else 0], kind.meaning
            if name == "gravity":
                largest = values[int(np.argmax(np.abs(values).sum(axis=1)))]
                size, meaning = np.linalg.norm(values, axis=1), f"{meaning}; {gravity_words(largest)}"
            yield _given(key.replace(".", "_"), (), kind.unit, meaning, size, kind.scale)


def _given(name: str, dims: tuple[str, ...], unit: str, meaning: str, values: Array, scale: float) -> Column:
    """Return a column of what the plan gives."""
    return Column(name, dims, "f8", unit, meaning, partial(_in_file_unit, values, scale))


def _in_file_unit(values: Array, scale: float, rows: Rows, numbers: Index) -> Array:
    """Return values in another unit, those that are short decimals as such: 0.3, not 0.30000000000000004."""
    given = values[numbers]
    converted = given / scale
    tidy = np.round(converted, _DECIMALS)
    return np.asarray(np.where(tidy * scale == given, tidy, converted))
