"""Obstacles as the [[obstacle]] tables of a scenario, in mm, there and back."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields
from typing import Any

from softnlp.base.errors import InputError, nearest
from softnlp.base.units import MILLIMETRE
from softnlp.model.inputs import tidy
from softnlp.model.obstacles import KINDS, Obstacle

FILE_KEYS = {
    "point": "point_mm",
    "normal": "normal",
    "centre": "centre_mm",
    "start": "from_mm",
    "end": "to_mm",
    "axis": "axis",
    "radius": "radius_mm",
    "length": "length_mm",
}
"""The key in a file of each field of an obstacle; those that end in _mm are lengths."""

_BOTH = ("part", "name")


def obstacle_tables(obstacles: Iterable[Obstacle]) -> list[dict[str, Any]]:
    """Return obstacles as tables."""
    tables = []
    for obstacle in obstacles:
        table: dict[str, Any] = {"kind": obstacle.kind}
        for key in _own(type(obstacle)):
            value, scale = getattr(obstacle, key), _scale(key)
            table[FILE_KEYS[key]] = [tidy(v, scale) for v in value] if isinstance(value, tuple) else tidy(value, scale)
        table["part"] = obstacle.part
        if obstacle.name:
            table["name"] = obstacle.name
        tables.append(table)
    return tables


def obstacles_of_tables(tables: Sequence[Mapping[str, Any]]) -> tuple[Obstacle, ...]:
    """Return the obstacles of tables.

    Raises
    ------
    InputError
        For a kind that is not known, a key that it does not have or lacks, and what the obstacle refuses; with the
        table "obstacle.2" for the second one.
    """
    found = []
    for number, table in enumerate(tables):
        try:
            found.append(_made(table))
        except InputError as error:
            key = FILE_KEYS.get(error.key or "", error.key)
            raise InputError(error.message, table=f"obstacle.{number + 1}", key=key) from None
    return tuple(found)


def _made(table: Mapping[str, Any]) -> Obstacle:
    """Return the obstacle of one table."""
    kind = table["kind"]
    if kind not in KINDS:
        raise InputError(f"expected one of {', '.join(KINDS)}, got {kind!r}{nearest(kind, KINDS)}", key="kind")
    made, own = KINDS[kind], {FILE_KEYS[key]: key for key in _own(KINDS[kind])}
    given = {key: value for key, value in table.items() if key not in ("kind", *_BOTH) and value is not None}
    for key in given:
        if key not in own:
            raise InputError(f"a {kind} has none; it takes {', '.join(own)}", key=key)
    for key in own:
        if key not in given:
            raise InputError(f"missing; a {kind} takes {', '.join(own)}", key=key)
    values: dict[str, Any] = {}
    for key, field in own.items():
        value, scale = given[key], _scale(field)
        values[field] = [v * scale for v in value] if isinstance(value, list | tuple) else value * scale
    values |= {key: table[key] for key in _BOTH if table.get(key) is not None}
    return made(**values)


def _own(kind: type[Obstacle]) -> list[str]:
    """Return the fields of a kind beside those that all have."""
    return [field.name for field in fields(kind) if field.name not in _BOTH]


def _scale(key: str) -> float:
    return MILLIMETRE if FILE_KEYS[key].endswith("_mm") else 1.0
