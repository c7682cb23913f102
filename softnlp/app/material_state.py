"""What a document says of its silicone, also where that is none: what can be drawn, what is wrong, other forms."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import tomlkit
from tomlkit.items import InlineTable

from softnlp.app.document import Document
from softnlp.base.errors import InputError
from softnlp.model.laws import LAWS
from softnlp.model.materials import FITTED_STRETCH, Material, MaterialEntry, load_materials, material_from_table

Form = Literal["library", "constants", "formula"]

OWN_LAW = "own law"
"""The name that a formula of one's own starts with."""
FIRST_FORMULA = "a * (stretch - stretch**-2)"
"""Neo-Hookean, so that it starts as something that is known."""
_FALLBACK = "mooney-rivlin"
_KEPT = ("density_kg_m3",)


@dataclass(frozen=True, eq=False)
class MaterialState:
    """A silicone as far as the document gives one.

    form : how it is given. material : where it is one, else None. others : the laws of the library's (or the file's)
    silicone of that name. said : by key of [material] ("constants.C10_MPa" for a constant), what is wrong.
    """

    form: Form
    material: Material | None
    others: Mapping[str, Material]
    said: Mapping[str, str]


def form_of(table: Mapping[str, Any]) -> Form:
    """Return which of its three forms a [material] has."""
    if "formula" in table:
        return "formula"
    return "constants" if "constants" in table else "library"


def material_state(
    document: Document, entries: Mapping[str, MaterialEntry], folder: Path, problem: InputError | None = None
) -> MaterialState:
    """Read the silicone of a document; nothing is raised.

    entries : the silicones to choose from (`known_silicones`). folder : of the files that the document names.
    problem : what reading the whole scenario said, which may be about this table.
    """
    table = document.table("material")
    name = table.get("name")
    others = entries[name].models if isinstance(name, str) and name in entries else {}
    try:
        return MaterialState(form_of(table), material_from_table(table, folder=folder), others, _of(problem, table))
    except InputError as error:
        return MaterialState(form_of(table), None, others, {_place(error, table): error.message})


def known_silicones(document: Document, folder: Path) -> Mapping[str, MaterialEntry]:
    """Return the silicones of the document's materials file where it names one that can be read, else the library's."""
    file = document.get("material", "file")
    if isinstance(file, str):
        with suppress(InputError):
            return load_materials(folder / file)
    return load_materials()


def library_form(table: Mapping[str, Any], name: str, model: str) -> dict[str, Any]:
    """Return the table of a silicone of the library with one of its laws."""
    return {"name": name, "model": model, **_kept(table, *_KEPT, "file")}


def constants_form(table: Mapping[str, Any], law: str, entry: MaterialEntry | None) -> dict[str, Any]:
    """Return the table with constants of its own for a built-in law, which start as those of a silicone."""
    return {
        "name": table.get("name", "own silicone"),
        "model": law,
        "constants": inline(law_constants(law, entry)),
        **_kept(table, *_KEPT, "fitted_stretch"),
    }


def formula_form(table: Mapping[str, Any], entry: MaterialEntry | None) -> dict[str, Any]:
    """Return the table with a law of its own, which starts as neo-Hookean."""
    modulus = law_constants("neo-hookean", entry)["mu0_MPa"]
    return {
        "name": table.get("name", "own silicone"),
        "model": OWN_LAW,
        "formula": FIRST_FORMULA,
        "constants": inline({"a": modulus}),
        **_kept(table, *_KEPT, "fitted_stretch"),
    }


def law_constants(law: str, entry: MaterialEntry | None) -> dict[str, float]:
    """Return the constants of a built-in law under the keys of a file; of the library's first silicone without one."""
    if entry is None or law not in entry.models:
        entry = next(iter(load_materials().values()))
    material = entry.models[law]
    return {c.file_key: float(f"{material.constants[c.name] / c.scale:.12g}") for c in LAWS[law].constants}


def law_or_default(model: Any, models: Mapping[str, Any]) -> str:
    """Return a law if it is one of these, else Mooney-Rivlin or the first."""
    if isinstance(model, str) and model in models:
        return model
    return _FALLBACK if _FALLBACK in models else next(iter(models))


def inline(values: Mapping[str, Any]) -> InlineTable:
    """Return constants as a table on one line, which may stand anywhere in [material]."""
    table = tomlkit.inline_table()
    table.update(dict(values))
    written = tomlkit.value(table.as_string())  # what was read keeps its spaces in a copy of the document
    assert isinstance(written, InlineTable)
    return written


def constants_of_rows(rows: Sequence[tuple[str, float | None]]) -> tuple[dict[str, float], str]:
    """Return the constants of rows of names and values, and what is wrong with the rows, "" for nothing.

    A row without a name, or without a value, is not there yet.
    """
    constants: dict[str, float] = {}
    problem = ""
    for name, value in rows:
        if not name:
            problem = problem or ("" if value is None else "a constant has no name")
        elif name in constants:
            problem = problem or f"two constants are called {name!r}"
        elif value is None:
            problem = problem or f"the constant {name!r} has no value"
        else:
            constants[name] = value
    return constants, problem


def fitted_range(low: float | None, high: float | None) -> list[float] | None:
    """Return `fitted_stretch` with one or both ends changed; None where both are cleared, which is the default."""
    if low is None and high is None:
        return None
    return [FITTED_STRETCH[0] if low is None else low, FITTED_STRETCH[1] if high is None else high]


def _of(problem: InputError | None, table: Mapping[str, Any]) -> dict[str, str]:
    return {_place(problem, table): problem.message} if problem is not None and problem.table == "material" else {}


def _place(error: InputError, table: Mapping[str, Any]) -> str:
    """Return the key of [material] that an error is about, "" for the whole table."""
    key = error.key or ""
    if key.startswith('"'):
        with suppress(ValueError):
            key = str(json.loads(key))
    if error.table == "material.constants":
        law = LAWS.get(str(table.get("model")))
        key = next((c.file_key for c in law.constants if c.name == key), key) if law is not None else key
        return f"constants.{key}" if key else "constants"
    return key


def _kept(table: Mapping[str, Any], *keys: str) -> dict[str, Any]:
    return {key: table[key] for key in keys if key in table}
