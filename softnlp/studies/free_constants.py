"""Which constants an identification may free: their names, where they start, and how far they may go."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError, nearest
from softnlp.model.conventions import Coefficients
from softnlp.model.materials import Material

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Coefficient:
    """A coefficient that may be freed. quantity : its name in `softnlp.model.quantities`. field : of `Coefficients`."""

    quantity: str
    field: str
    lower: float
    upper: float


COEFFICIENTS: Mapping[str, Coefficient] = MappingProxyType(
    {
        "k_e": Coefficient("stiffening.elongation", "elongation", 0.0, 20.0),
        "k_b": Coefficient("stiffening.bending", "bending", 0.0, 50.0),
        "k_a": Coefficient("corrections.area", "area", 0.05, 20.0),
        "k_i": Coefficient("corrections.inertia", "inertia", 0.05, 20.0),
        "phi": Coefficient("corrections.bore_fraction", "bore_fraction", 0.0, 1.0),
        "k_c": Coefficient("contact.chamber_reaction", "chamber_reaction", 0.0, 100.0),
    }
)
"""By the letter of the equations."""


@dataclass(frozen=True, eq=False)
class FreeConstants:
    """Constants to identify, in order. start, lower, upper, scale : SI, one each; scale is a typical size.

    names : as asked. quantities : their names in `softnlp.model.quantities`.
    """

    names: tuple[str, ...]
    quantities: tuple[str, ...]
    start: Array
    lower: Array
    upper: Array
    scale: Array

    def values(self, x: Array) -> dict[str, float]:
        """Return values [SI] by quantity."""
        return dict(zip(self.quantities, (float(v) for v in x), strict=True))

    def applied(self, x: Array, material: Material, coefficients: Coefficients) -> tuple[Material, Coefficients]:
        """Return material and coefficients with these values; raises `MaterialError` where they are no material."""
        fields = {c.quantity: c.field for c in COEFFICIENTS.values()}
        values = self.values(x)
        own = {fields[name]: value for name, value in values.items() if name in fields}
        constants = {n.removeprefix("material."): v for n, v in values.items() if n.startswith("material.")}
        made = replace(material, constants={**material.constants, **constants}) if constants else material
        return made, replace(coefficients, **own)


def free_constants(
    free: Sequence[str],
    material: Material,
    coefficients: Coefficients,
    bounds: Mapping[str, tuple[float, float]] | None = None,
) -> FreeConstants:
    """Return the constants of the given names: a letter of `COEFFICIENTS`, or a constant of the material's law.

    bounds : by name, SI; a material's constants have none of their own. A start outside its bounds is moved to them.
    Raises `InputError` for an unknown name, one given twice, or bounds that are none.
    """
    known = {**{n: c.quantity for n, c in COEFFICIENTS.items()}}
    for constant in material.law.constants:
        name = constant.name if constant.name not in known else f"material.{constant.name}"
        known[name] = f"material.{constant.name}"
    if not free:
        raise InputError(f"expected at least one of {', '.join(known)}", key="free")
    for k, name in enumerate(free):
        if name not in known:
            raise InputError(f"unknown constant {name!r}{nearest(str(name), known)}", key="free")
        if name in free[:k]:
            raise InputError(f"expected each constant once, got {name!r} twice", key="free")
    for name, pair in (bounds or {}).items():
        if name not in free:
            raise InputError(f"expected a constant that is free{nearest(str(name), free)}", key=f"bounds.{name}")
        if len(pair) != 2 or not pair[0] < pair[1]:
            raise InputError(f"expected a lower and an upper bound, got {list(pair)}", key=f"bounds.{name}")
    start, limits, scale = [], [], []
    for name in free:
        low, high = (bounds or {}).get(name, _bounds(name, known[name]))
        value = _nominal(known[name], material, coefficients)
        start.append(min(max(value, low), high))
        limits.append((low, high))
        scale.append(abs(value) if known[name].startswith("material.") and value else 1.0)
    lower, upper = np.array(limits, float).T
    return FreeConstants(
        tuple(free), tuple(known[n] for n in free), np.array(start, float), lower, upper, np.array(scale)
    )


def file_name(name: str, material: Material) -> tuple[str, float]:
    """Return the key that files have for a constant, and its unit there in SI."""
    plain = name.removeprefix("material.")
    for c in material.law.constants:
        if c.name == plain and name not in COEFFICIENTS:
            return c.file_key, c.scale
    return name, 1.0


def constants_text(keys: Sequence[tuple[str, float]], x: Array, form: str = ".4g") -> str:
    """Return values [SI] in words; keys : of files with their units, of `file_name`."""
    return ", ".join(f"{key} = {value / unit:{form}}" for (key, unit), value in zip(keys, x, strict=True))


def _bounds(name: str, quantity: str) -> tuple[float, float]:
    if quantity.startswith("material."):
        return -np.inf, np.inf
    return COEFFICIENTS[name].lower, COEFFICIENTS[name].upper


def _nominal(quantity: str, material: Material, coefficients: Coefficients) -> float:
    if quantity.startswith("material."):
        return float(material.constants[quantity.removeprefix("material.")])
    field = next(c.field for c in COEFFICIENTS.values() if c.quantity == quantity)
    value: Any = getattr(coefficients, field)
    return float(value)
