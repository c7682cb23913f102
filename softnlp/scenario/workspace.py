"""[workspace] of a scenario, checked against the robot, the silicone and the loads, in SI units."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError, located, nearest
from softnlp.base.reading import shown
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.model.contact_settings import require_in_front
from softnlp.model.materials import Material
from softnlp.model.robot import Robot
from softnlp.scenario.contact import contact_settings
from softnlp.scenario.schema_workspace import WorkspaceFile, WorkspaceTable
from softnlp.sweep.manufacture import check_many
from softnlp.sweep.task import Axis, WorkspaceTask, combinations, varied_quantities, varied_table

Array = NDArray[np.float64]

MOST_POSES = 20_000_000
_CONTACT_OF_STEPS = ("offsets_mm", "offset_ramp", "target_force_N")
_MATERIALS_AT_ONCE = 10_000


def workspace_task(file: WorkspaceFile, robot: Robot, material: Material, pressures: Array) -> WorkspaceTask:
    """Return what is asked of a sweep.

    Parameters
    ----------
    pressures : (steps, sets) of [pressure], no steps without it [Pa].

    Raises
    ------
    InputError
        With the key (and the table where it is not [workspace]), for keys that do not go together, more than 20 million
        poses, or a varied robot that breaks a rule of manufacture.
    """
    table = file.workspace
    _check_contact(file)
    _check_source(file)
    task = WorkspaceTask(
        levels=table.levels,
        samples=table.samples,
        sets=_sets(table, robot.chamber_sets),
        lowest=table.from_bar * BAR,
        highest=(table.to_bar or 0.0) * BAR,
        seed=table.seed,
        vary=_axes(file, material),
    )
    poses = task.step_count(len(pressures))
    if poses > MOST_POSES:
        raise InputError(
            f"expected at most {MOST_POSES} poses, got {poses}",
            key="samples" if table.samples is not None else "levels" if table.levels is not None else "vary",
        )
    _check_varied(task, file, robot, material)
    if file.contact is not None:
        lengths = [v for axis in task.vary if axis.quantity == "robot.length" for v in axis.values.tolist()]
        with located(table="contact"):
            require_in_front(contact_settings(file.contact), lengths)
    return task


def _check_contact(file: WorkspaceFile) -> None:
    """Refuse what a wall of a sweep cannot do: one force, at one place, for every pose."""
    wall = file.contact
    if wall is None:
        return
    if wall.mode != "blocked":
        raise InputError(f"expected 'blocked' in a sweep, got {shown(wall.mode)}", table="contact", key="mode")
    for key in _CONTACT_OF_STEPS:
        if getattr(wall, key) is not None:
            raise InputError(
                'not in a sweep, which finds the force at every pressure; use study = "blocked-force"',
                table="contact",
                key=key,
            )


def _check_source(file: WorkspaceFile) -> None:
    """Require exactly one source of pressures, and the keys that go with it."""
    table = file.workspace
    sources = [key for key in ("levels", "samples") if getattr(table, key) is not None]
    if file.pressure is not None:
        sources.append("[pressure]")
    if len(sources) != 1:
        raise InputError(
            f"expected exactly one of levels, samples or [pressure], got {' and '.join(sources) or 'none'}",
            key=sources[0] if sources and sources[0] != "[pressure]" else None,
        )
    if sources == ["[pressure]"]:
        for key in ("to_bar", "from_bar", "sets"):
            if key in table.model_fields_set:
                raise InputError("expected only with levels or samples, not with [pressure]", key=key)
    elif table.to_bar is None:
        raise InputError(f"missing; expected with {sources[0]}: the highest pressure in bar", key="to_bar")
    elif table.to_bar < table.from_bar:
        raise InputError(f"expected at least from_bar = {table.from_bar:g}, got {table.to_bar:g}", key="to_bar")
    if table.levels == 1:
        raise InputError("expected a whole number of at least 2, got 1", key="levels")
    if table.samples is None and "seed" in table.model_fields_set:
        raise InputError("expected only with samples", key="seed")


def _sets(table: WorkspaceTable, sets: int) -> tuple[int, ...]:
    """Return the swept chamber sets, counted from 0."""
    chosen = list(range(1, sets + 1)) if table.sets is None else table.sets
    for number, one in enumerate(chosen, start=1):
        if not 1 <= one <= sets:
            raise InputError(f"item {number}: expected a chamber set from 1 to {sets}, got {shown(one)}", key="sets")
        if one in chosen[: number - 1]:
            raise InputError(f"item {number}: expected each chamber set once, got {one} twice", key="sets")
    return tuple(one - 1 for one in chosen)


def _axes(file: WorkspaceFile, material: Material) -> tuple[Axis, ...]:
    """Return what differs besides the pressures, in the order of the file."""
    kinds = varied_quantities(material, file.gravity.direction)
    axes = []
    for key, entry in _flat(file.workspace.vary).items():
        place = f"vary.{key}"
        if key not in kinds:
            raise InputError(f"unknown quantity{nearest(key, kinds)}", key=place)
        kind = kinds[key]
        if kind.quantity == "gravity" and not any(file.gravity.direction):
            raise InputError("expected only with a direction in [gravity], which is off", key=place)
        given = _values(entry, place, sampled=file.workspace.samples is not None)
        axes.append(Axis(key, kind.quantity, kind.place, np.asarray(given) * kind.scale))
    return tuple(axes)


def _flat(vary: Mapping[str, Any], above: str = "") -> dict[str, Any]:
    """Return the entries of `vary` by their dotted key: TOML reads robot.length_mm without quotes as a table of one."""
    flat: dict[str, Any] = {}
    for key, value in vary.items():
        if not above and "." not in key and isinstance(value, dict) and value and not {*value} & {*_ENTRY}:
            flat |= _flat(value, f"{key}.")
        else:
            flat[above + key] = value
    return flat


_ENTRY = ("from", "to", "levels", "values")


def _values(entry: Any, place: str, *, sampled: bool) -> list[float]:
    """Return the levels of one varied quantity, or both ends of its range where it is sampled, in file units."""
    wanted = "{ from, to }" if sampled else "{ from, to, levels } or { values }"
    if not isinstance(entry, dict):
        raise InputError(f"expected a table {wanted}, got {shown(entry)}", key=place)
    known = _ENTRY[:2] if sampled else _ENTRY
    for key in entry:
        if key not in _ENTRY:
            raise InputError(f"unknown key{nearest(str(key), known)}", key=f"{place}.{key}")
        if key not in known:
            raise InputError(f"not with samples; expected {wanted}", key=f"{place}.{key}")
    if "values" in entry:
        values = entry["values"]
        if len(entry) > 1:
            raise InputError(f"expected {wanted}, got both", key=place)
        if not isinstance(values, list) or not values:
            raise InputError(f"expected a list of at least 1 number, got {shown(values)}", key=f"{place}.values")
        return [_number(value, f"{place}.values") for value in values]
    for key in known[:2] if sampled else known[:3]:
        if key not in entry:
            raise InputError(f"missing; expected {wanted}", key=f"{place}.{key}")
    low, high = (_number(entry[key], f"{place}.{key}") for key in ("from", "to"))
    if sampled:
        return [low, high]
    levels = entry["levels"]
    if isinstance(levels, bool) or not isinstance(levels, int) or not 2 <= levels <= MOST_POSES:
        raise InputError(f"expected a whole number from 2 to {MOST_POSES}, got {shown(levels)}", key=f"{place}.levels")
    return [float(value) for value in np.linspace(low, high, levels)]


def _number(value: Any, place: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"expected a number, got {shown(value)}", key=place)
    if not abs(value) <= sys.float_info.max:
        raise InputError(f"expected a finite number, got {shown(value)}", key=place)
    return float(value)


def _check_varied(task: WorkspaceTask, file: WorkspaceFile, robot: Robot, material: Material) -> None:
    """Refuse varied dimensions of which no robot, and varied constants of which no silicone, can be made."""
    of_robot = {a.quantity.removeprefix("robot."): k for k, a in enumerate(task.vary) if a.quantity[:6] == "robot."}
    names = {f"material.{c.name}": c.name for c in material.law.constants}
    of_material = {names[a.quantity]: k for k, a in enumerate(task.vary) if a.quantity in names}
    if not of_robot and not of_material:
        return
    table = combinations(task) if task.samples is None else varied_table(task, 0)
    if of_robot:
        columns = table[:, list(of_robot.values())]
        if task.samples is None:  # each robot once, in the order in which they come
            columns = columns[np.sort(np.unique(columns, axis=0, return_index=True)[1])]
        try:
            check_many(
                robot,
                dict(zip(of_robot, columns.T, strict=True)),
                allow=file.robot.allow,
                minimum_wall=file.robot.minimum_wall_mm * MILLIMETRE,
            )
        except InputError as error:
            raise InputError(error.message, key="vary") from None
    for start in range(0, len(table) if of_material else 0, _MATERIALS_AT_ONCE):
        part = table[start : start + _MATERIALS_AT_ONCE]
        constants = {**material.constants, **{name: part[:, k] for name, k in of_material.items()}}
        try:
            Material(material.name, material.law, constants, material.density, material.fitted_stretch)
        except InputError as error:
            raise InputError(error.message, key="vary") from None
