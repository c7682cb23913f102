"""What a design asks, as the tables of a scenario hold it: rows of choices and of requirements, and their changes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

from softnlp.base.errors import InputError
from softnlp.base.reading import shown
from softnlp.model.materials import load_materials
from softnlp.model.robot import DIMENSIONS, ROBOTS
from softnlp.studies.design_task import OUTPUTS

Table = dict[str, Any]

SIZES = {f"robot.{d.file_key}": d for d in DIMENSIONS if d.scale is not None}
COUNTS = tuple(f"robot.{d.file_key}" for d in DIMENSIONS if d.scale is None)
NAMES = ("material.name", "material.model", "robot.name")
CHOICES = (*SIZES, *COUNTS, *NAMES)
"""The keys of [choices]."""
REQUIRED = {output.key: output for output in OUTPUTS.values()}
"""What may be required, by its key of [requirements]."""
_WIDE = 0.15  # of a dimension, to either side: a range to start from


def chosen(choices: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of each choice by its whole key, such as "robot.length_mm"."""
    groups = {name: group for name, group in choices.items() if isinstance(group, Mapping)}
    return {f"{name}.{key}": value for name, group in groups.items() for key, value in group.items()}


def choices_of(chosen: Mapping[str, Any]) -> Table:
    """Return the table [choices] of values by their whole keys."""
    table: Table = {}
    for key, value in chosen.items():
        group, _, name = key.partition(".")
        table.setdefault(group, {})[name] = value
    return table


def first_values(key: str, robot: Mapping[str, Any], material: Mapping[str, Any]) -> Any:
    """Return what a new choice starts with. robot : every dimension in the unit of its key. material : as the file."""
    if key in SIZES:
        size = robot.get(key.partition(".")[2])
        middle = float(size) if isinstance(size, int | float) else 10.0
        return {"from": float(f"{(1 - _WIDE) * middle:.3g}"), "to": float(f"{(1 + _WIDE) * middle:.3g}")}
    if key in COUNTS:
        return [1, 2, 3] if key.endswith("chambers_per_set") else [2, 3]
    return names_of(key, material)[:3]


def names_of(key: str, material: Mapping[str, Any]) -> list[str]:
    """Return the names that a choice may have, those of the scenario first."""
    if key == "robot.name":
        return list(ROBOTS)
    own = [str(material[name]) for name in (key.partition(".")[2],) if name in material]
    library = load_materials()
    if key == "material.name":
        return list(dict.fromkeys([*own, *library]))
    known = library.get(str(material.get("name", "")))
    return list(dict.fromkeys([*own, *({} if known is None else known.models)]))


def ends(value: Any) -> tuple[Any, Any] | None:
    """Return both ends of a range, None for another choice."""
    return (value.get("from"), value.get("to")) if isinstance(value, Mapping) else None


def listed(value: Any) -> str:
    """Return a list of values as a person types it."""
    return ", ".join(f"{v:g}" if isinstance(v, float) else str(v) for v in value) if isinstance(value, list) else ""


def numbers(text: str, whole: bool) -> list[Any]:
    """Return the numbers of a list that was typed; raises `InputError` for what is none."""
    found: list[Any] = []
    for part in text.replace(";", ",").split(","):
        if not part.strip():
            continue
        try:
            number = float(part)
        except ValueError:
            raise InputError(f"expected numbers with commas between them, got {shown(part.strip())}") from None
        if not isfinite(number) or (whole and number != int(number)):
            raise InputError(f"expected {'whole numbers' if whole else 'numbers'}, got {shown(part.strip())}")
        found.append(int(number) if whole else number)
    return found


def with_limit(requirements: Mapping[str, Any], key: str, side: str, value: float | None) -> Table:
    """Return requirements with one limit changed, or taken out for None; one without limits goes."""
    limits = {**requirements.get(key, {}), side: value}
    limits = {name: limit for name, limit in limits.items() if limit is not None}
    changed = {**requirements, key: limits}
    return {name: limits for name, limits in changed.items() if limits}


def pressure_kind(value: Any) -> str:
    """Return what the pressure of a design is: "fixed", a "range" or "steps"."""
    return "fixed" if not isinstance(value, Mapping) else "steps" if "step" in value else "range"


def as_pressure(kind: str, value: Any) -> Any:
    """Return a pressure of another kind that ends where it did."""
    last = value.get("to", 1.0) if isinstance(value, Mapping) else value
    last = float(last) if isinstance(last, int | float) else 1.0
    return {"fixed": last, "range": {"from": 0.0, "to": last}, "steps": {"step": round(last / 10, 6), "to": last}}[kind]


def without(table: Mapping[str, Any], key: str) -> Table:
    """Return a table without a key."""
    return {name: value for name, value in table.items() if name != key}


def renamed(table: Mapping[str, Any], old: str, new: str, value: Any) -> Table:
    """Return a table with a key and its value in the place of another key."""
    return dict((new, value) if name == old else (name, entry) for name, entry in table.items() if name != new)


def free_keys(all_keys: Sequence[str], taken: Mapping[str, Any]) -> list[str]:
    """Return the keys that a table does not have yet."""
    return [key for key in all_keys if key not in taken]


def words(key: str) -> str:
    """Return a key of [choices] in words, with its unit."""
    group, _, name = key.partition(".")
    if key in NAMES:
        return {"material.name": "silicone", "material.model": "law of the silicone", "robot.name": "robot"}[key]
    stem, _, unit = name.rpartition("_") if group == "robot" and key in SIZES else (name, "", "")
    return stem.replace("_", " ") + (f" [{'°' if unit == 'deg' else unit}]" if unit else "")
