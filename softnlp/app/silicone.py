"""What a document says of its silicone, also where that is none: what is wrong, other forms, and its curves."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import tomlkit
from numpy.typing import NDArray
from tomlkit.items import InlineTable

from softnlp.app.inputs import Tables
from softnlp.app.parts import marks
from softnlp.app.theme import figure_config, figure_layout, figure_text
from softnlp.base.errors import InputError
from softnlp.figures.style import colour
from softnlp.model.laws import LAWS
from softnlp.model.materials import (
    FITTED_STRETCH,
    Material,
    MaterialEntry,
    MaterialSet,
    load_materials,
    material_from_table,
)

Form = Literal["library", "constants", "formula"]

OWN_LAW = "own law"
"""The name that a formula of one's own starts with."""
FIRST_FORMULA = "a * (stretch - stretch**-2)"
"""Neo-Hookean, so that it starts as something that is known."""
_FALLBACK = "mooney-rivlin"
KILOPASCAL = 1e3
MEASURES = {
    "engineering_stress": ("Engineering", "engineering stress [kPa]"),
    "true_stress": ("True", "true stress [kPa]"),
    "tangent_modulus": ("Modulus", "tangent modulus [kPa]"),
}
"""What may be drawn, a method of `Material`: what the switch calls it, and the axis."""
LAW_NAMES = {
    "linear": "Linear",
    "neo-hookean": "Neo-Hookean",
    "mooney-rivlin": "Mooney–Rivlin",
    "yeoh": "Yeoh",
    "ogden": "Ogden",
}
POINTS = 101
WIDTH, HEIGHT = 306, 300
"""Of the figure [px]. A fixed size, so that it is right where it was drawn while nobody saw it."""
_DASHES = {"linear": "dot", "neo-hookean": "dash", "mooney-rivlin": "solid", "yeoh": "dashdot", "ogden": "longdash"}
_COLOURS = {law: colour(k) for k, law in enumerate(("mooney-rivlin", "neo-hookean", "yeoh", "ogden", "linear"))}
_OWN = colour(5)
_ON_DARK = {colour(0): colour(5), colour(5): colour(6)}
"""Lines too dark for a dark page, and what takes their place."""
_LEGEND = {"orientation": "h", "x": 0, "y": -0.24, "yanchor": "top", "font": {"size": 11}}
_CLIP = 1.25  # the figure reaches this far beyond the values in the fitted range
_LARGEST = 1e12  # kPa; beyond it nothing is drawn


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
    document: Tables, entries: Mapping[str, MaterialEntry], folder: Path, problem: InputError | None = None
) -> MaterialState:
    """Read the silicone of a document; nothing is raised.

    entries : the silicones to choose from (`known_silicones`). folder : of the files that the document names.
    problem : what reading the whole scenario said, which may be about this table.
    """
    table = document.table("material")
    name = table.get("name")
    entry = entries.get(name) if isinstance(name, str) else None
    others = {} if entry is None else set_of(table, entry).models
    own = problem if problem is not None and problem.table == "material" else None
    try:
        material = material_from_table(table, folder=folder)
    except InputError as error:
        material, own = None, error
    said = {} if own is None else {_place(own, table): own.message}
    return MaterialState(form_of(table), material, others, said)


def known_silicones(document: Tables, folder: Path) -> Mapping[str, MaterialEntry]:
    """Return the silicones of the document's materials file where it names one that can be read, else the library's."""
    file = document.get("material", "file")
    if isinstance(file, str):
        with suppress(InputError):
            return load_materials(folder / file)
    return load_materials()


def library_form(table: Mapping[str, Any], entry: MaterialEntry) -> dict[str, Any]:
    """Return the table of a silicone of the library, with its law and set where it has them."""
    chosen = set_of(table, entry)
    named = {} if chosen is entry.default else {"set": chosen.name}
    model = law_or_default(table.get("model"), chosen.models)
    return {"name": entry.name, "model": model, **named, **_kept(table, "density_kg_m3", "file")}


def set_of(table: Mapping[str, Any], entry: MaterialEntry) -> MaterialSet:
    """Return the set of constants that a table names, the default one where it names none that there is."""
    return entry.sets.get(str(table.get("set")), entry.default)


def constants_form(table: Mapping[str, Any], law: str, entry: MaterialEntry | None) -> dict[str, Any]:
    """Return the table with constants of its own for a built-in law, which start as those of a silicone."""
    return {
        "name": table.get("name", "own silicone"),
        "model": law,
        "constants": inline(law_constants(law, entry)),
        **_kept(table, "density_kg_m3", "fitted_stretch"),
    }


def formula_form(table: Mapping[str, Any], entry: MaterialEntry | None) -> dict[str, Any]:
    """Return the table with a law of its own, which starts as neo-Hookean."""
    modulus = law_constants("neo-hookean", entry)["mu0_MPa"]
    return {
        "name": table.get("name", "own silicone"),
        "model": OWN_LAW,
        "formula": FIRST_FORMULA,
        "constants": inline({"a": modulus}),
        **_kept(table, "density_kg_m3", "fitted_stretch"),
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


def law_name(law: str) -> str:
    """Return what a law is called on the page."""
    return LAW_NAMES.get(law, law)


def material_figure(
    chosen: Material | None, others: Mapping[str, Material], measure: str, stretch: float | None, dark: bool
) -> dict[str, Any]:
    """Return a plotly figure of a silicone's laws, the chosen one bold, and where a pose stands on it.

    chosen : None where the scenario has no silicone that can be drawn. others : more laws to compare, by name.
    measure : of `MEASURES`. stretch : of the pose, None for none. The last trace is that of the pose (`mark_pose`).
    """
    thin = {law: m for law, m in others.items() if chosen is None or not same(m, chosen)}
    fitted = next((m.fitted_stretch for m in (chosen, *others.values()) if m is not None), (1.0, 2.0))
    high = max(1.0 + 1.15 * (fitted[1] - 1.0), 1.03 * (stretch or 1.0))
    x = np.linspace(min(1.0, fitted[0]), min(high, 1e3), POINTS)
    curves = [_curve(m, law_name(law), x, measure, dark=dark, bold=False) for law, m in thin.items()]
    if chosen is not None:
        own = f"{law_name(chosen.law.name)}, own" if chosen.law.name in others and chosen.law.name in thin else ""
        curves.append(_curve(chosen, own or law_name(chosen.law.name), x, measure, dark=dark, bold=True))
    layout = figure_layout(dark)
    layout |= {"margin": {"l": 8, "r": 8, "t": 8, "b": 8}, "legend": dict(_LEGEND)}
    layout |= {"width": WIDTH, "height": HEIGHT, "shapes": _fit(fitted), "showlegend": True, "hovermode": "closest"}
    drawn = [*([] if chosen is None else [chosen]), *thin.values()]
    layout["xaxis"] |= _axis("stretch [-]", [float(x[0]), float(x[-1])])
    layout["yaxis"] |= _axis(MEASURES[measure][1], _reach(drawn, x, measure))
    layout["annotations"] = [
        {
            "text": f"fitted {fitted[0]:.3g} to {fitted[1]:.3g}",
            "x": fitted[1], "y": 0, "yref": "paper", "xanchor": "right", "yanchor": "bottom", "showarrow": False,
            "font": {"size": 10}, "opacity": 0.8,
        }
    ]  # fmt: skip
    layout["uirevision"] = measure
    figure = {"data": [*curves, _pose()], "layout": layout, "config": figure_config() | {"responsive": False}}
    mark_pose(figure, chosen, measure, stretch)
    return figure


def mark_pose(figure: dict[str, Any], chosen: Material | None, measure: str, stretch: float | None) -> None:
    """Move the point of the pose in a figure; without a silicone or a stretch it is not drawn."""
    trace = figure["data"][-1]
    values = [] if chosen is None or stretch is None else _values(chosen, np.array([stretch]), measure)
    shown = bool(values) and values[0] is not None
    trace["x"], trace["y"] = ([stretch], values) if shown else ([], [])


def same(a: Material, b: Material) -> bool:
    """Return whether two materials are the same law with the same constants."""
    return a.law.name == b.law.name and dict(a.constants) == dict(b.constants)


def _curve(
    material: Material, name: str, x: NDArray[np.float64], measure: str, *, dark: bool, bold: bool
) -> dict[str, Any]:
    law = material.law.name
    line = _COLOURS.get(law, _OWN)
    return {
        "type": "scatter",
        "mode": "lines",
        "name": f"<b>{figure_text(name)}</b>" if bold else figure_text(name),
        "x": [float(f"{v:.5g}") for v in x],
        "y": _values(material, x, measure),
        "line": {
            "color": _ON_DARK.get(line, line) if dark else line,
            "width": 3.5 if bold else 1.4,
            "dash": "solid" if bold else _DASHES.get(law, "solid"),
        },
        "opacity": 1.0 if bold or dark else 0.85,
        "hovertemplate": "%{y:.4g} kPa at %{x:.3f}<extra>" + figure_text(name) + "</extra>",
    }


def _axis(title: str, reach: list[float] | None) -> dict[str, Any]:
    axis: dict[str, Any] = {"title": {"text": title, "font": {"size": 12}, "standoff": 6}}
    return axis if reach is None else axis | {"range": reach}  # plotly fails, later, on a range that is null


def _pose() -> dict[str, Any]:
    trace = marks([], [], "#E5383B", "pose", size=11, line={"color": "#FFFFFF", "width": 1.5})
    return trace | {"hovertemplate": "%{y:.4g} kPa at %{x:.3f}<extra>pose</extra>", "cliponaxis": False}


def _fit(fitted: tuple[float, float]) -> list[dict[str, Any]]:
    """Shade the range that the constants were fitted on, and mark its ends."""
    band = {"type": "rect", "xref": "x", "yref": "paper", "x0": fitted[0], "x1": fitted[1], "y0": 0, "y1": 1}
    end = {"type": "line", "xref": "x", "yref": "paper", "x0": fitted[1], "x1": fitted[1], "y0": 0, "y1": 1}
    return [
        band | {"fillcolor": "rgba(128,128,128,0.13)", "line": {"width": 0}, "layer": "below"},
        end | {"line": {"color": "rgba(128,128,128,0.9)", "width": 1, "dash": "dot"}, "layer": "below"},
    ]


def _reach(materials: list[Material], x: NDArray[np.float64], measure: str) -> list[float] | None:
    """Return the range of the values within the fitted ranges, so that a law that runs away hides no other."""
    inside = [
        value
        for m in materials
        for stretch, value in zip(x, _values(m, x, measure), strict=True)
        if value is not None and m.fitted_stretch[0] - 1e-9 <= stretch <= m.fitted_stretch[1] + 1e-9
    ]
    low, high = (min(0.0, _CLIP * min(inside)), _CLIP * max(inside)) if inside else (0.0, 0.0)
    return [low, high] if low < high else None


def _values(material: Material, x: NDArray[np.float64], measure: str) -> list[float | None]:
    values = np.asarray(getattr(material, measure)(x)) / KILOPASCAL
    return [float(f"{v:.5g}") if np.isfinite(v) and abs(v) < _LARGEST else None for v in np.ravel(values)]
