"""What an unknown key was meant to be: a key of the table with its unit, and the number in that unit."""

from __future__ import annotations

from collections.abc import Iterable
from math import isfinite
from typing import Any

from softnlp.base.errors import nearest
from softnlp.base.files import toml_text
from softnlp.base.reading import shown
from softnlp.laboratory.units import Unit, unit_named


def meant(key: str, value: Any, known: Iterable[str]) -> tuple[str | None, str]:
    """Return the key of a table that an unknown one is meant to be, None where none is near, and what to say."""
    names = list(known)
    stem, unit = split_unit(key)
    near = [name for name in names if _alike(split_unit(name), stem, unit)]
    if not near and unit is not None:  # another word for the only key of its kind
        near = [name for name in names if (of := split_unit(name)[1]) is not None and of.kind == unit.kind]
        near = near if len(near) == 1 else []
    if len(near) != 1:
        said = nearest(key, names)
        found = next((name for name in names if said == f"; did you mean {name!r}?"), None)
        return found, f"unknown key{said}"
    to = near[0]
    wanted = split_unit(to)[1]
    assert wanted is not None
    if unit is None:
        number = f" = {toml_text(value)}" if _is_number(value) else ""
        return to, f"unknown key; did you mean {to!r}? it ends in its unit: write {to}{number}, in {wanted.name}"
    if unit == wanted:
        return to, f"unknown key; did you mean {to!r}?"
    factor = unit.scale / wanted.scale
    if _is_number(value):
        converted = f"{value * factor:.10g}"
        return to, f"unknown key; {shown(value)} {unit.name} = {converted} {wanted.name}: write {to} = {converted}"
    return to, f"unknown key; did you mean {to!r}? it is in {wanted.name}: 1 {unit.name} = {factor:.10g} {wanted.name}"


def split_unit(key: str) -> tuple[str, Unit | None]:
    """Return a key without its unit, and that; None where it ends in none."""
    stem, _, end = key.rpartition("_")
    unit = unit_named(end) if stem else None
    return (stem, unit) if unit is not None else (key, None)


def _alike(known: tuple[str, Unit | None], stem: str, unit: Unit | None) -> bool:
    """Whether a key of a table has the stem of an unknown one, and a unit of the same kind or of none given."""
    its_stem, its_unit = known
    same = its_stem.lower() == stem.lower()
    return same and its_unit is not None and (unit is None or unit.kind == its_unit.kind)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)
