"""The tables [[obstacle]] of a scenario as the page edits them: first ones, moved ones, and what is wrong with one."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, get_args, get_origin

from softnlp.app.controls import annotation_parts, known
from softnlp.base.errors import InputError
from softnlp.base.units import MILLIMETRE
from softnlp.model.obstacle_tables import FILE_KEYS
from softnlp.model.obstacles import KINDS
from softnlp.model.robot import Robot

Row = dict[str, Any]

LIST = "obstacle"
PLACES = ("point_mm", "centre_mm", "from_mm", "to_mm")
"""The keys that say where an obstacle is."""
_ITEM = re.compile(r"item (\d+): (.*)", re.DOTALL)
_NUMBERED = re.compile(r"obstacle\.(\d+)")
_ROOM = 3.0  # between a first obstacle and the robot [mm]


def kinds() -> tuple[str, ...]:
    """Return the kinds that a scenario may have."""
    return tuple(get_args(known(LIST, "kind").annotation))


def keys_of(kind: str) -> list[str]:
    """Return the keys of a kind beside those that all have."""
    own = [field.name for field in fields(KINDS[kind])]
    return [key for name, key in FILE_KEYS.items() if name in own]


def parts_of(kind: str) -> list[str]:
    """Return what of the robot may touch an obstacle of a kind."""
    every = [str(part) for part in get_args(known(LIST, "part").annotation)]
    return every if kind == "plane" else [part for part in every if part != "tip rim"]


def is_vector(key: str) -> bool:
    """Whether a key has three numbers."""
    return any(get_origin(part) is list for part in annotation_parts(known(LIST, key).annotation))


def first_row(kind: str, robot: Robot) -> Row:
    """Return an obstacle that a robot does not touch at rest: beside it, where its first set bends it, or around it."""
    L, radius = robot.length / MILLIMETRE, robot.outer_diameter / MILLIMETRE / 2
    size = _tidy(0.15 * L)
    beside = -_tidy(radius + size + _ROOM)
    values: Mapping[str, Any] = {
        "plane": {"point_mm": [-_tidy(radius + 0.2 * L), 0.0, 0.0], "normal": [1.0, 0.0, 0.0]},
        "sphere": {"centre_mm": [beside, 0.0, _tidy(0.7 * L)], "radius_mm": size},
        "trocar": {
            "point_mm": [0.0, 0.0, _tidy(0.3 * L)],
            "axis": [0.0, 0.0, 1.0],
            "radius_mm": _tidy(radius + _ROOM),
            "length_mm": _tidy(0.1 * L),
        },
        "tube": {
            "from_mm": [0.0, 0.0, _tidy(0.2 * L)],
            "to_mm": [0.0, 0.0, _tidy(0.6 * L)],
            "radius_mm": _tidy(radius + _ROOM),
        },
    }
    across = {
        "from_mm": [beside, -_tidy(0.5 * L), _tidy(0.7 * L)],
        "to_mm": [beside, _tidy(0.5 * L), _tidy(0.7 * L)],
        "radius_mm": size,
    }
    return {"kind": kind, **values.get(kind, across)}


def of_kind(row: Row, kind: str, robot: Robot) -> Row:
    """Return a row as one of another kind at the same place; what both have stays."""
    made = first_row(kind, robot)
    kept = {key: row[key] for key in (*keys_of(kind), "name") if key in row}
    here, first = middle(row), middle(made)
    if here is not None and first is not None and kind not in ("plane", "trocar", "tube"):
        made = moved(made, [a - b for a, b in zip(here, first, strict=True)])
    part = {"part": row["part"]} if row.get("part") in parts_of(kind)[1:] else {}
    return {**made, **kept, **part}


def moved(row: Row, by: Sequence[float]) -> Row:
    """Return a row at another place, so many mm away."""
    return {
        key: [_tidy(a + b, 3) for a, b in zip(value, by, strict=True)]
        if key in PLACES and isinstance(value, list) and len(value) == 3
        else value
        for key, value in row.items()
    }


def middle(row: Row) -> list[float] | None:
    """Return where an obstacle is [mm], None where it has no such point."""
    points = [row[key] for key in PLACES if isinstance(row.get(key), list) and len(row[key]) == 3]
    if not points:
        return None
    return [sum(point[k] for point in points) / len(points) for k in range(3)]


def problem_of_row(problem: InputError | None, number: int) -> tuple[str, str] | None:
    """Return the key and what is wrong with an obstacle, from 0; None where it is not about that one."""
    if problem is None or problem.table is None:
        return None
    key, item = problem.key or "kind", _ITEM.fullmatch(problem.message)
    if problem.table == LIST and item is not None and int(item[1]) == number + 1:
        return key, item[2]
    numbered = _NUMBERED.fullmatch(problem.table)
    return (key, problem.message) if numbered is not None and int(numbered[1]) == number + 1 else None


def _tidy(value: float, digits: int = 1) -> float:
    return round(float(value), digits) + 0.0
