"""Silicones: a stress-stretch law with its constants, and the tables of them that people write (model section 2).

`softnlp.model.laws` holds the laws. Inside the package everything is in SI; files hold MPa and are converted where they
are read. Every error of a file or table is one line that names the file, the table and the key.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from softnlp.base import ranges
from softnlp.base.errors import MaterialError, nearest
from softnlp.base.units import MEGAPASCAL
from softnlp.model.formula import check_constant_name, shown
from softnlp.model.laws import LAWS, SYMBOLS, Constant, Law, evaluate, formula_law, function_law
from softnlp.model.material_reading import (
    check_keys,
    file_label,
    located,
    number,
    quoted,
    read_table,
    stretch_range,
    text_of,
    within,
)

__all__ = [
    "LAWS",
    "Constant",
    "Law",
    "Material",
    "MaterialEntry",
    "formula_law",
    "function_law",
    "load_materials",
    "material",
    "material_from_table",
]

DENSITY = 1070.0  # of a silicone whose file gives none [kg/m^3]
FITTED_STRETCH = (1.0, 2.0)  # where the published constants were fitted
_CHECK_POINTS = 101  # stretches at which a law's stress must be finite
_ENTRY_KEYS = ("density_kg_m3", "fitted_stretch", "source")


@dataclass(frozen=True, eq=False)
class Material:
    """A law with its constants. Stress and modulus follow their arguments' kind.

    Numbers give a float; numpy arrays, in the stretch or a constant, an array of their broadcast shape; CasADi values
    (SX, MX, DM), in either, an expression, elementwise where they are matrices.

    Raises `MaterialError` for a constant that is missing, unknown or not finite and, where no constant is a symbol, for
    a law whose stress at stretch 1 is not 0, whose tangent modulus there is not positive, or whose stress is not finite
    over the fitted range.

    Attributes
    ----------
    name
        Of the silicone.
    law
        Stress against stretch.
    constants
        By name, each a number, an array or a symbol [SI]; kept in law order, read-only.
    density
        A number [kg/m^3].
    fitted_stretch
        (2,) range of stretch that the constants were fitted on [1].
    """

    name: str
    law: Law
    constants: Mapping[str, Any]
    density: Any = DENSITY
    fitted_stretch: tuple[float, float] = FITTED_STRETCH

    def __post_init__(self) -> None:
        names = [c.name for c in self.law.constants]
        check_keys(self.constants, names, what=f"constant of law {shown(self.law.name)}")
        constants = {name: number(self.constants[name], name) for name in names}
        for constant in self.law.constants:
            limits = ranges.STRESS if constant.unit == "MPa" else ranges.CONSTANT
            within(limits, constants[constant.name], constant.file_key)
        # Frozen and read-only, so that constants cannot change behind the checks.
        object.__setattr__(self, "constants", MappingProxyType(constants))
        object.__setattr__(self, "density", number(self.density, "density", positive=True))
        within(ranges.DENSITY, self.density, "density")
        object.__setattr__(self, "fitted_stretch", stretch_range(self.fitted_stretch))
        if not any(isinstance(value, SYMBOLS) for value in constants.values()):
            _check_response(self)

    def __reduce__(self) -> tuple[Any, ...]:
        # A read-only mapping has no pickle of its own.
        return type(self), (self.name, self.law, dict(self.constants), self.density, self.fitted_stretch)

    def engineering_stress(self, stretch: Any) -> Any:
        """Return sigma_e (Table II), force over undeformed area.

        Parameters
        ----------
        stretch
            A number, an array or a symbol [1].

        Returns
        -------
        float, array or expression
            A number, or of the shape of the arguments [Pa].
        """
        return evaluate(self.law.functions.engineering_stress, stretch, *self.constants.values())

    def true_stress(self, stretch: Any) -> Any:
        """Return sigma_t = stretch * sigma_e, force over deformed area.

        Parameters
        ----------
        stretch
            A number, an array or a symbol [1].

        Returns
        -------
        float, array or expression
            A number, or of the shape of the arguments [Pa].
        """
        return evaluate(self.law.functions.true_stress, stretch, *self.constants.values())

    def tangent_modulus(self, stretch: Any) -> Any:
        """Return E_t = d sigma_t / d stretch, Eq. (24); E_l for the linear law.

        Parameters
        ----------
        stretch
            A number, an array or a symbol [1].

        Returns
        -------
        float, array or expression
            A number, or of the shape of the arguments [Pa].
        """
        return evaluate(self.law.functions.tangent_modulus, stretch, *self.constants.values())

    def shear_modulus(self, stretch: Any) -> Any:
        """Return G = E_t / 3, incompressible.

        Parameters
        ----------
        stretch
            A number, an array or a symbol [1].

        Returns
        -------
        float, array or expression
            A number, or of the shape of the arguments [Pa].
        """
        return self.tangent_modulus(stretch) / 3


@dataclass(frozen=True, eq=False)
class MaterialEntry:
    """A silicone of a materials file.

    Attributes
    ----------
    name
        Of the silicone.
    source
        Where the constants come from, "" if not said.
    models
        A checked `Material` for each law that the file gives constants of.
    derived
        By law, how constants that were not published were found.
    """

    name: str
    source: str
    models: Mapping[str, Material]
    derived: Mapping[str, str]


def load_materials(path: str | PathLike[str] | None = None) -> Mapping[str, MaterialEntry]:
    """Return the silicones of a materials file by name, in the file's order.

    Parameters
    ----------
    path
        A TOML file; the shipped one by default.

    Returns
    -------
    Mapping
        `MaterialEntry` by name, read-only.

    Raises
    ------
    MaterialError
        With source, table and key of the first thing in the file that is not right.
    """
    file = _shipped_file() if path is None else path
    entries = {}
    with located(source=file_label(file)):
        data = read_table(file)
        if not data:
            raise MaterialError('it is empty; expected a table for each silicone, such as ["Ecoflex 00-50"]')
        for name, table in data.items():
            if not isinstance(table, Mapping):
                raise MaterialError(f"expected a table of a silicone, got {shown(table)}", key=quoted(name))
            with located(table=quoted(name)):
                entries[name] = _entry(name, table)
    return MappingProxyType(entries)


def material(
    name: str, model: str = "mooney-rivlin", *, file: str | PathLike[str] | None = None, density: Any = None
) -> Material:
    """Return a silicone with one of its laws, from the shipped file or one of the same form.

    Parameters
    ----------
    name, model
        Of the silicone and of the law.
    file
        A materials file, the shipped one by default.
    density
        In place of the file's, a number [kg/m^3].

    Returns
    -------
    Material
        Checked.

    Raises
    ------
    MaterialError
        With the nearest known name.
    """
    entries = _shipped(_shipped_file()) if file is None else load_materials(file)
    where = "" if file is None else f" in {file_label(file)}"
    if not isinstance(name, str) or name not in entries:
        raise MaterialError(f"unknown silicone {shown(name)}{where}{nearest(str(name), entries)}", key="name")
    models = entries[name].models
    if not isinstance(model, str) or model not in models:
        no_such = f"{quoted(name)} has no constants of law" if model in list(LAWS) else "unknown law"
        raise MaterialError(f"{no_such} {shown(model)}{where}{nearest(str(model), models)}", key="model")
    return models[model] if density is None else replace(models[model], density=density)


def material_from_table(table: Mapping[str, Any], *, folder: str | PathLike[str] = ".") -> Material:
    """Return the material of a scenario's `[material]`, in one of these forms.

    - From the shipped file, or from `file` (relative to `folder`): `name` and `model`.
    - With constants of its own: `name`, a built-in law as `model`, `constants` under their file keys (`C10_MPa`, `b1`).
    - With a law of its own: `name`, a new name as `model`, a `formula` in MPa and the `constants` that it names.

    `density_kg_m3` is optional in each, `fitted_stretch` in the last two. Raises `MaterialError` with table and key.
    """
    with located(table="material"):
        own = isinstance(table, Mapping) and ("constants" in table or "formula" in table)
        if own and "file" in table:
            raise MaterialError("constants come from a file or from this table, not from both", key="file")
        optional = ("constants", "formula", "fitted_stretch") if own else ("file",)
        check_keys(table, ("name", "model"), ("density_kg_m3", *optional))
        name, model = text_of(table, "name"), text_of(table, "model")
        given = _given(table)
        if own:
            if "formula" in table and model in LAWS:
                raise MaterialError(f"the built-in law '{model}' has its formula; name yours otherwise", key="formula")
            if "formula" not in table and model not in LAWS:
                raise MaterialError(_unknown_law(model), key="model")
            law, constants = _law_with_constants(model, table, "material.constants")
            return _checked(name, law, constants, given, "material" if "formula" in table else "material.constants")
        file = Path(folder, text_of(table, "file")) if "file" in table else None
        return material(name, model, file=file, density=given.get("density"))


# --- reading tables ---------------------------------------------------------------------------------------------------


def _shipped_file() -> Path:
    """Return the library's file: beside the package when installed, at the top level of a checkout."""
    package = Path(__file__).parents[1]
    installed = package / "materials.toml"
    return installed if installed.is_file() else package.parent / "materials.toml"


@cache
def _shipped(file: Path) -> Mapping[str, MaterialEntry]:
    """Return the silicones of the library's file, read once: checking all its laws takes 20 ms."""
    return load_materials(file)


def _entry(name: str, table: Mapping[str, Any]) -> MaterialEntry:
    """Return the silicone of one top-level table of a materials file."""
    laws = {key: value for key, value in table.items() if key not in _ENTRY_KEYS and isinstance(value, Mapping)}
    check_keys({key: value for key, value in table.items() if key not in laws}, (), _ENTRY_KEYS)
    if not laws:
        raise MaterialError(f"expected the table of a law, such as [{quoted(name)}.mooney-rivlin]")
    source = text_of(table, "source") if "source" in table else ""
    given = _given(table)
    models, derived = {}, {}
    for model, law_table in laws.items():
        table_name = f"{quoted(name)}.{quoted(model)}"
        with located(table=table_name):
            written = dict(law_table)
            if "derived" in written:
                derived[model] = text_of(written, "derived")
                del written["derived"]
            if model in LAWS:
                law, constants = _law_with_constants(model, {"constants": written}, table_name)
            else:
                if "formula" not in written:
                    raise MaterialError(_unknown_law(model))
                check_keys(written, ("formula",), ("constants", "derived"))
                law, constants = _law_with_constants(model, written, f"{table_name}.constants")
            models[model] = _checked(name, law, constants, given, table_name)
    return MaterialEntry(name, source, MappingProxyType(models), MappingProxyType(derived))


def _law_with_constants(model: str, written: Mapping[str, Any], constants_table: str) -> tuple[Law, dict[str, float]]:
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


def _checked(name: str, law: Law, constants: dict[str, float], given: dict[str, Any], table: str) -> Material:
    """Return the material; an error of what the law gives stands at its formula, or else at the table of constants."""
    try:
        return Material(name, law, constants, **given)
    except MaterialError as error:
        raise error.located(table=table, key=None if law.name in LAWS else "formula") from None


def _unknown_law(model: str) -> str:
    return f"unknown law {shown(model)}{nearest(model, LAWS)} (a law of your own needs a formula)"


# --- checks -----------------------------------------------------------------------------------------------------------


def _given(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields of `Material` that a table states beside name, law and constants."""
    fields: dict[str, Any] = {}
    if "density_kg_m3" in table:
        fields["density"] = number(table["density_kg_m3"], "density_kg_m3", positive=True)
    if "fitted_stretch" in table:
        fields["fitted_stretch"] = stretch_range(table["fitted_stretch"])
    return fields


def _check_response(material: Material) -> None:
    """Raise `MaterialError` where the law with these numbers is no material; see `Material`."""
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
