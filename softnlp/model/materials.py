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

from softnlp.base import ranges
from softnlp.base.errors import MaterialError, nearest
from softnlp.base.reading import choices
from softnlp.base.rich import rich_html
from softnlp.model.formula import shown
from softnlp.model.laws import LAWS, SYMBOLS, Constant, Law, evaluate, formula_law, function_law
from softnlp.model.material_reading import (
    check_keys,
    file_label,
    located,
    number,
    quoted,
    read_table,
    shipped_file,
    stretch_range,
    text_of,
    within,
)
from softnlp.model.material_sets import check_response, given_fields, law_with_constants, read_sets, unknown_law

__all__ = [
    "LAWS",
    "Constant",
    "Law",
    "Material",
    "MaterialEntry",
    "MaterialSet",
    "formula_law",
    "function_law",
    "load_materials",
    "material",
    "material_from_table",
]

DENSITY = 1070.0  # of a silicone whose file gives none [kg/m^3]
FITTED_STRETCH = (1.0, 2.0)  # where the published constants were fitted


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
    set
        Of the constants where a materials file names it, else "".
    """

    name: str
    law: Law
    constants: Mapping[str, Any]
    density: Any = DENSITY
    fitted_stretch: tuple[float, float] = FITTED_STRETCH
    set: str = ""

    _repr_html_ = rich_html

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
            check_response(self)

    def __reduce__(self) -> tuple[Any, ...]:
        # A read-only mapping has no pickle of its own.
        return type(self), (self.name, self.law, dict(self.constants), self.density, self.fitted_stretch, self.set)

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
class MaterialSet:
    """Constants of one silicone that come from one source.

    Attributes
    ----------
    name
        Of the set.
    source, test, rate, date
        Where they come from, how the silicone was tested, how fast, and when; "" if not said.
    models
        A checked `Material` for each law that the file gives constants of.
    derived
        By law, how constants that were not published were found.
    """

    name: str
    source: str
    test: str
    rate: str
    date: str
    models: Mapping[str, Material]
    derived: Mapping[str, str]


@dataclass(frozen=True, eq=False)
class MaterialEntry:
    """A silicone of a materials file.

    Attributes
    ----------
    name
        Of the silicone.
    sets
        Its sets of constants by name, the default one first.
    """

    name: str
    sets: Mapping[str, MaterialSet]

    @property
    def default(self) -> MaterialSet:
        """The set that is taken where none is named."""
        return next(iter(self.sets.values()))

    @property
    def source(self) -> str:
        """Where the constants of the default set come from, "" if not said."""
        return self.default.source

    @property
    def models(self) -> Mapping[str, Material]:
        """The laws of the default set."""
        return self.default.models

    @property
    def derived(self) -> Mapping[str, str]:
        """By law, how constants of the default set that were not published were found."""
        return self.default.derived

    def chosen(self, name: str | None, where: str = "") -> MaterialSet:
        """Return a set by its name.

        Parameters
        ----------
        name
            Of the set; None is the default one.
        where
            The file, in words, for an error.

        Returns
        -------
        MaterialSet
            The set.

        Raises
        ------
        MaterialError
            With the sets that there are.
        """
        if name is None:
            return self.default
        if not isinstance(name, str) or name not in self.sets:
            message = f"unknown set {shown(name)} of {quoted(self.name)}{where}; expected {choices(self.sets)}"
            raise MaterialError(message, key="set")
        return self.sets[name]


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
    file = shipped_file() if path is None else path
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
    name: str,
    model: str = "mooney-rivlin",
    *,
    set: str | None = None,
    file: str | PathLike[str] | None = None,
    density: Any = None,
) -> Material:
    """Return a silicone with one of its laws, from the shipped file or one of the same form.

    Parameters
    ----------
    name, model
        Of the silicone and of the law.
    set
        Of constants, where the file has several of the silicone; the first by default.
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
        With the nearest known name, or the sets that there are.
    """
    entries = _shipped(shipped_file()) if file is None else load_materials(file)
    where = "" if file is None else f" in {file_label(file)}"
    if not isinstance(name, str) or name not in entries:
        raise MaterialError(f"unknown silicone {shown(name)}{where}{nearest(str(name), entries)}", key="name")
    chosen = entries[name].chosen(set, where)
    models = chosen.models
    if not isinstance(model, str) or model not in models:
        no_such = f"{quoted(name)} has no constants of law" if model in list(LAWS) else "unknown law"
        of_set = "" if chosen is entries[name].default else f" in set {shown(chosen.name)}"
        raise MaterialError(f"{no_such} {shown(model)}{of_set}{where}{nearest(str(model), models)}", key="model")
    return models[model] if density is None else replace(models[model], density=density)


def material_from_table(table: Mapping[str, Any], *, folder: str | PathLike[str] = ".") -> Material:
    """Return the material of a scenario's `[material]`, in one of these forms.

    - From the shipped file, or from `file` (relative to `folder`): `name`, `model`, and `set` where there are several.
    - With constants of its own: `name`, a built-in law as `model`, `constants` under their file keys (`C10_MPa`, `b1`).
    - With a law of its own: `name`, a new name as `model`, a `formula` in MPa and the `constants` that it names.

    `density_kg_m3` is optional in each, `fitted_stretch` in the last two. Raises `MaterialError` with table and key.
    """
    with located(table="material"):
        own = isinstance(table, Mapping) and ("constants" in table or "formula" in table)
        if own and "file" in table:
            raise MaterialError("constants come from a file or from this table, not from both", key="file")
        if own and "set" in table:
            raise MaterialError("constants come from a set of a file or from this table, not from both", key="set")
        optional = ("constants", "formula", "fitted_stretch") if own else ("file", "set")
        check_keys(table, ("name", "model"), ("density_kg_m3", *optional))
        name, model = text_of(table, "name"), text_of(table, "model")
        given = given_fields(table)
        if own:
            if "formula" in table and model in LAWS:
                raise MaterialError(f"the built-in law '{model}' has its formula; name yours otherwise", key="formula")
            if "formula" not in table and model not in LAWS:
                raise MaterialError(unknown_law(model), key="model")
            law, constants = law_with_constants(model, table, "material.constants")
            return _checked(name, law, constants, given, "material" if "formula" in table else "material.constants")
        file = Path(folder, text_of(table, "file")) if "file" in table else None
        named = text_of(table, "set") if "set" in table else None
        return material(name, model, set=named, file=file, density=given.get("density"))


# --- reading tables ---------------------------------------------------------------------------------------------------


@cache
def _shipped(file: Path) -> Mapping[str, MaterialEntry]:
    """Return the silicones of the library's file, read once: checking all its laws takes 20 ms."""
    return load_materials(file)


def _entry(name: str, table: Mapping[str, Any]) -> MaterialEntry:
    """Return the silicone of one top-level table of a materials file."""

    def law_of(model: str, written: dict[str, Any], fields: dict[str, Any], place: str) -> Material:
        if model in LAWS:
            law, constants = law_with_constants(model, {"constants": written}, place)
        else:
            if "formula" not in written:
                raise MaterialError(unknown_law(model))
            check_keys(written, ("formula",), ("constants", "derived"))
            law, constants = law_with_constants(model, written, f"{place}.constants")
        return _checked(name, law, constants, fields, place)

    sets = {key: MaterialSet(**fields) for key, fields in read_sets(name, table, given_fields, law_of).items()}
    return MaterialEntry(name, MappingProxyType(sets))


def _checked(name: str, law: Law, constants: dict[str, float], given: dict[str, Any], table: str) -> Material:
    """Return the material; an error of what the law gives stands at its formula, or else at the table of constants."""
    try:
        return Material(name, law, constants, **given)
    except MaterialError as error:
        raise error.located(table=table, key=None if law.name in LAWS else "formula") from None
