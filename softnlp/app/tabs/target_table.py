"""[target] as the inverse tab edits it: positions and directions stay paired row by row."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from softnlp.base.units import BAR, DEGREE, MILLIMETRE
from softnlp.results.targets import target_values
from softnlp.statics.step import Run, Step

Table = dict[str, Any]

POSITION, DIRECTION = "tip_position_mm", "tip_direction"
KINDS: Mapping[str, tuple[str, ...]] = {
    "position": (POSITION,),
    "direction": (DIRECTION,),
    "both": (POSITION, DIRECTION),
}
_FIRST: Mapping[str, list[float]] = {POSITION: [-20.0, 0.0, 62.0], DIRECTION: [0.0, 0.0, 1.0]}


def kind_of(table: Mapping[str, Any]) -> str:
    """Return what the targets are: a position, a direction, or both."""
    keys = tuple(key for key in KINDS["both"] if isinstance(table.get(key), list))
    return next((kind for kind, wanted in KINDS.items() if wanted == keys), "position")


def rows_of(table: Mapping[str, Any], key: str) -> list[list[Any]]:
    """Return the rows of a key, of three entries each."""
    rows = table.get(key)
    return [list(row) for row in rows if isinstance(row, list) and len(row) == 3] if isinstance(rows, list) else []


def count_of(table: Mapping[str, Any]) -> int:
    """Return the number of targets."""
    return max(len(rows_of(table, key)) for key in KINDS["both"])


def with_kind(table: Table, kind: str) -> Table:
    """Return the table with targets of another kind, as many as before."""
    count = max(count_of(table), 1)
    kept = {key: v for key, v in table.items() if key not in KINDS["both"] and (kind == "both" or not _is_weight(key))}
    return {key: (rows_of(table, key) + [_FIRST[key]] * count)[:count] for key in KINDS[kind]} | kept


def with_number(table: Table, key: str, row: int, column: int, value: float) -> Table:
    """Return the table with one number of one target changed."""
    rows = rows_of(table, key)
    rows[row][column] = value
    return {**table, key: rows}


def with_added(table: Table) -> Table:
    """Return the table with one more target, like the last."""
    return {**table, **{key: [*rows_of(table, key), _last(table, key)] for key in KINDS[kind_of(table)]}}


def without(table: Table, row: int) -> Table:
    """Return the table without a target; the only one stays."""
    if count_of(table) < 2:
        return table
    return {**table, **{k: [r for j, r in enumerate(rows_of(table, k)) if j != row] for k in KINDS[kind_of(table)]}}


def with_picked(table: Table, place_mm: Sequence[float]) -> Table:
    """Return the table with the last target at a place of the view."""
    if kind_of(table) == "direction":
        return table
    rows = rows_of(table, POSITION)
    return {**table, POSITION: [*rows[:-1], [round(float(x), 1) for x in place_mm]]}


def words_of(step: Step) -> str:
    """Return in words what was found for a target."""
    bars = ", ".join(f"{p / BAR:.4g}" for p in step.pressure)
    aimed = step.aimed
    if not step.status.has_solution or aimed is None:
        return f"{step.message[:1].upper()}{step.message[1:]}."
    left = []
    if aimed.distance is not None:
        left.append(f"{aimed.distance / MILLIMETRE:.2g} mm")
    if aimed.angle is not None:
        left.append(f"{aimed.angle / DEGREE:.2g} deg")
    return f"Reached at {bars} bar, {' and '.join(left)} left."


def target_columns(run: Run) -> dict[str, list[Any]]:
    """Return the columns of a table of targets, by label; None where there is none."""
    columns: dict[str, list[Any]] = {}
    for step in run.steps:
        values = target_values(run, step)
        target = values["target_mm"]
        entries = {f"{axis} wanted [mm]": None if target is None else float(target[k]) for k, axis in enumerate("xyz")}
        entries |= {"distance left [mm]": values["distance_mm"], "angle left [deg]": values["direction_error_deg"]}
        for label, value in entries.items():
            columns.setdefault(label, []).append(value)
    return {label: values for label, values in columns.items() if any(value is not None for value in values)}


def _last(table: Table, key: str) -> list[float]:
    rows = rows_of(table, key)
    return list(rows[-1]) if rows else list(_FIRST[key])


def _is_weight(key: str) -> bool:
    return key == "length_per_radian_mm"
