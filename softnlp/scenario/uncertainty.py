"""[uncertainty] of a scenario: standard deviations by the keys of the other tables, in SI units."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from softnlp.base.errors import InputError, nearest
from softnlp.base.ranges import too_uncertain
from softnlp.base.reading import shown
from softnlp.base.units import MILLIMETRE
from softnlp.model.contact_settings import ContactSettings, ContactTask
from softnlp.model.materials import Material, load_materials
from softnlp.model.quantities import Model, quantities
from softnlp.studies.report import tolerance_keys
from softnlp.studies.tolerances import Scatter
from softnlp.studies.uncertainty import Uncertainty, scalable, sets_scatter, stress_scatter

SETS = "sets"
_MATERIAL, _PRESSURE, _WALL = "material", "pressure_bar", "offset_mm"
_OF_WALL = {"tip_cap_mm": ("contact.tip_cap", MILLIMETRE), "chamber_reaction": ("contact.chamber_reaction", 1.0)}


def uncertainty_of(
    table: Mapping[str, float | str],
    model: Model,
    silicone: Mapping[str, Any],
    folder: Path,
    contact: ContactSettings | None,
    task: object,
) -> Uncertainty:
    """Return what scatters in a scenario.

    silicone : its [material]. folder : of the materials file that it names. contact : of a blocked force, else None.
    task : what else that is asked.

    Raises
    ------
    InputError
        With the key, for names that are not known, what is no deviation, and studies that have no derivatives.
    """
    if not table:
        raise InputError("expected at least one standard deviation, such as material = 0.15")
    if contact is not None:
        _require_derivatives(contact, task)
    keys = tolerance_keys(model) | (_OF_WALL if contact is not None else {})
    known = [_MATERIAL, *keys, *([_WALL] if contact is not None else [])]
    sources: list[Scatter] = []
    share = wall = 0.0
    nominal = {q.name: q.nominal for q in quantities(model).values()}
    if contact is not None:
        nominal |= {"contact.tip_cap": np.array([contact.tip_cap])}
        nominal |= {"contact.chamber_reaction": np.array([float(model.coefficients.chamber_reaction)])}
    for key, written in table.items():
        if key not in known:
            raise InputError(f"unknown name{nearest(key, known)}", key=key)
        if written == SETS and key == _MATERIAL:
            sources += sets_scatter(model.material, _sets(model.material, silicone, folder))
            continue
        size, relative = _size(key, written)
        if key == _MATERIAL:
            sources.append(stress_scatter(scalable(model.material), size))
        elif key == _WALL:
            if relative:
                raise InputError("expected a number, and no percentage of what may be 0", key=key)
            wall = size * MILLIMETRE
        elif key == _PRESSURE and relative:
            share = size
        else:
            name, unit = keys[key]
            sources += _scatter(key, name, size if relative else size * unit, relative, nominal.get(name))
    return Uncertainty(tuple(sources), share, wall, dict(table))


def _scatter(key: str, name: str, size: float, relative: bool, nominal: Any) -> list[Scatter]:
    """Return the sources of one quantity: an entry each. relative : whether size is a fraction of what it is."""
    entries = np.atleast_1d(np.asarray(nominal, dtype=float))
    if relative:
        if entries.size > 1 or entries[0] == 0:
            raise InputError("expected a number, and no percentage of what may be 0", key=key)
        size *= abs(float(entries[0]))
    if entries.size == 1 and name != "pressure":
        return [Scatter(key, {name: size})]
    axes = [str(k + 1) for k in range(entries.size)] if name == "pressure" else list("xyz")
    return [Scatter(key, {f"{name}.{axis}": size}) for axis in axes]


def _size(key: str, written: float | str) -> tuple[float, bool]:
    """Return a deviation in the unit of its key, or as a fraction, and which."""
    expected = "a number that is not negative, or a percentage such as '3%'"
    expected += f", or {SETS!r}" if key == _MATERIAL else ""
    relative = isinstance(written, str)
    try:
        if relative and not str(written).strip().endswith("%"):
            raise ValueError
        size = float(str(written).strip().removesuffix("%")) / 100 if relative else float(written)
    except ValueError:
        raise InputError(f"expected {expected}, got {shown(written)}", key=key) from None
    if not (np.isfinite(size) and size >= 0):
        raise InputError(f"expected {expected}, got {shown(written)}", key=key)
    if refusal := too_uncertain(size, relative or key == _MATERIAL):
        raise InputError(f"{refusal}, got {shown(written)}", key=key)
    return size, relative


def _sets(material: Material, silicone: Mapping[str, Any], folder: Path) -> list[Material]:
    """Return the material by every set that its file has of its law."""
    advice = "give material a number"
    if "constants" in silicone or "formula" in silicone:
        raise InputError(f"constants of [material] are of no set; {advice}", key=_MATERIAL)
    file = folder / silicone["file"] if "file" in silicone else None
    sets = load_materials(file)[material.name].sets.values()
    laws = [chosen.models[material.law.name] for chosen in sets if material.law.name in chosen.models]
    alike = [other for other in laws if other.law.told == material.law.told]
    if len(alike) < 2:
        of_law = f"{material.name} has one set with law {material.law.name!r}"
        raise InputError(f"expected a silicone with several sets: {of_law}; {advice}", key=_MATERIAL)
    return alike


def _require_derivatives(contact: ContactSettings, task: object) -> None:
    """Refuse what has no derivatives: a compromise of weights, and chambers that are held without a wall."""
    if contact.closure_name == "weighted":
        raise InputError("not used with closure = 'weighted', a compromise that no equation fixes; remove this table")
    if isinstance(task, ContactTask) and task.constrained:
        raise InputError("not used with mode = 'constrained'; remove this table")
