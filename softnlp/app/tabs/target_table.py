"""[target] as the inverse tab edits it: positions and directions stay paired row by row."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from softnlp.base.columns import OUTPUTS
from softnlp.base.units import BAR
from softnlp.statics.step import Run, Step
from softnlp.studies.fields import value

Table = dict[str, Any]

POSITION, DIRECTION = OUTPUTS["tip_position"].key, "tip_direction"
KINDS: Mapping[str, tuple[str, ...]] = {
    "position": (POSITION,),
    "direction": (DIRECTION,),
    "both": (POSITION, DIRECTION),
}
_LEFT = {"distance": OUTPUTS["distance"], "angle": OUTPUTS["direction_error"]}
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


def with_number(table: Table, key: str, row: int, column: int, entry: float) -> Table:
    """Return the table with one number of one target changed."""
    rows = rows_of(table, key)
    rows[row][column] = entry
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
    known = [(value(output, step), output.unit) for output in _LEFT.values()]
    left = [f"{size:.2g} {unit}" for size, unit in known if size is not None]
    return f"Reached at {bars} bar, {' and '.join(left)} left."


def target_columns(run: Run) -> dict[str, list[Any]]:
    """Return the columns of a table of targets, by label; None where there is none."""
    columns: dict[str, list[Any]] = {}
    wanted = OUTPUTS["target"]
    for step in run.steps:
        target = value(wanted, step)
        places = [None] * 3 if target is None else map(float, target)
        entries = {f"{axis} wanted [{wanted.unit}]": place for axis, place in zip("xyz", places, strict=True)}
        entries |= {f"{name} left [{output.unit}]": value(output, step) for name, output in _LEFT.items()}
        for label, entry in entries.items():
            columns.setdefault(label, []).append(entry)
    return {label: values for label, values in columns.items() if any(entry is not None for entry in values)}


def _last(table: Table, key: str) -> list[float]:
    rows = rows_of(table, key)
    return list(rows[-1]) if rows else list(_FIRST[key])


def _is_weight(key: str) -> bool:
    return key == "length_per_radian_mm"
