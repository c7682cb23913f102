"""The tables of a materials file: sets of constants with where they come from, laws, and what a law must be."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np

from softnlp.base.errors import MaterialError, nearest
from softnlp.base.units import MEGAPASCAL
from softnlp.model.formula import check_constant_name, shown
from softnlp.model.laws import LAWS, Law, formula_law
from softnlp.model.material_reading import check_keys, located, number, quoted, stretch_range, text_of

M = TypeVar("M")

UNNAMED = "default"
"""The first set of a silicone whose file gives it no name."""
PROVENANCE = ("source", "test", "rate", "date")
"""Keys that say in words where constants come from."""
_NUMBERS = ("density_kg_m3", "fitted_stretch")
_CHECK_POINTS = 101  # stretches at which a law's stress must be finite

Given = Callable[[Mapping[str, Any]], dict[str, Any]]
ReadLaw = Callable[[str, dict[str, Any], dict[str, Any], str], M]


def read_sets(name: str, table: Mapping[str, Any], given: Given, law: ReadLaw[M]) -> dict[str, dict[str, Any]]:
    """Return the fields of each `MaterialSet` of one top-level table of a materials file, by name, the default first.

    given : fields of `Material` that a table states beside its laws. law : reads one, of its name, its table, those
    fields, and the place of the table in the file.

    Raises
    ------
    MaterialError
        With table and key.
    """
    own = dict(table)
    further = own.pop("sets", {})
    if not isinstance(further, Mapping) or "formula" in further:
        raise MaterialError("expected a table of sets", key="sets")
    first = text_of(own, "set") if "set" in own else UNNAMED
    own.pop("set", None)
    sets = {first: _set(first, quoted(name), own, given, law)}
    shared = {key: own[key] for key in _NUMBERS if key in own}
    for key, written in further.items():
        place = f"{quoted(name)}.sets.{quoted(key)}"
        with located(table=place):
            if key in sets:
                raise MaterialError("there is a set of this name already")
            if not isinstance(written, Mapping):
                raise MaterialError("expected a table")
            sets[key] = _set(key, place, {**shared, **written}, given, law)
    return sets


def _set(name: str, place: str, table: Mapping[str, Any], given: Given, law: ReadLaw[M]) -> dict[str, Any]:
    """Return the set of constants of one table; place : its name in the file."""
    keys = (*_NUMBERS, *PROVENANCE, "set", "sets")
    laws = {key: value for key, value in table.items() if key not in keys and isinstance(value, Mapping)}
    said = {key: value for key, value in table.items() if key not in laws}
    check_keys(said, (), keys)
    if not laws:
        raise MaterialError(f"expected the table of a law, such as [{place}.mooney-rivlin]")
    words = {key: text_of(said, key) if key in said else "" for key in PROVENANCE}
    fields = given(said) | {"set": "" if name == UNNAMED else name}
    models, derived = {}, {}
    for model, law_table in laws.items():
        table_name = f"{place}.{quoted(model)}"
        with located(table=table_name):
            written = dict(law_table)
            if "derived" in written:
                derived[model] = text_of(written, "derived")
                del written["derived"]
            models[model] = law(model, written, fields, table_name)
    return {"name": name, **words, "models": MappingProxyType(models), "derived": MappingProxyType(derived)}


def law_with_constants(model: str, written: Mapping[str, Any], constants_table: str) -> tuple[Law, dict[str, float]]:
    """Return a built-in law, or the one of `written["formula"]`, and its constants in SI."""
    with located(table=constants_table):
        values = written.get("constants", {})
        if not isinstance(values, Mapping):
            raise MaterialError(f"expected a table of constants, got {shown(values)}")
        if "formula" not in written:
            law = LAWS[model]
            check_keys(values, [c.file_key for c in law.constants], what=f"constant of law '{model}'")
            return law, {c.name: number(values[c.file_key], c.file_key) * c.scale for c in law.constants}
        for key in values:
            with located(key=quoted(str(key))):
                check_constant_name(key)
        constants = {key: number(value, key) for key, value in values.items()}
    return formula_law(model, written["formula"], constants), constants


def unknown_law(model: str) -> str:
    """Say that there is no such law, with the nearest one."""
    return f"unknown law {shown(model)}{nearest(model, LAWS)} (a law of your own needs a formula)"


def given_fields(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of `Material` that a table states beside name, law and constants."""
    fields: dict[str, Any] = {}
    if "density_kg_m3" in table:
        fields["density"] = number(table["density_kg_m3"], "density_kg_m3", positive=True)
    if "fitted_stretch" in table:
        fields["fitted_stretch"] = stretch_range(table["fitted_stretch"])
    return fields


def check_response(material: Any) -> None:
    """Raise `MaterialError` where the law with these numbers is no material; see `softnlp.model.materials.Material`."""
    label = f"law {shown(material.law.name)} of {shown(material.name)}"
    stress = np.asarray(material.engineering_stress(1.0))
    modulus = np.asarray(material.tangent_modulus(1.0))
    if not np.isfinite(stress).all():
        raise MaterialError(f"{label}: its stress at stretch 1 is not a finite number; it must be 0")
    if not (np.isfinite(modulus) & (modulus > 0)).all():
        worst = modulus.min() / MEGAPASCAL
        raise MaterialError(
            f"{label}: its tangent modulus at stretch 1 is {worst:g} MPa; it must be positive and finite"
        )
    if (abs(stress) > 1e-9 * modulus).any():
        worst = abs(stress).max() / MEGAPASCAL
        raise MaterialError(f"{label}: its stress at stretch 1 is {worst:g} MPa; it must be 0")
    low, high = material.fitted_stretch
    stretches = np.linspace(min(low, 1.0), max(high, 1.0), _CHECK_POINTS)
    # Constants may be arrays: the stretches go along a first axis of their own.
    along = np.asarray(material.engineering_stress(stretches.reshape(-1, *(1,) * stress.ndim)))
    bad = ~np.isfinite(along).reshape(_CHECK_POINTS, -1).all(axis=1)
    if bad.any():
        raise MaterialError(f"{label}: its stress at stretch {stretches[bad][0]:g} is not a finite number")
