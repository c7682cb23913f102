"""[measurements] as the identification tab edits it, and what it shows of what was found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np

from softnlp.base.columns import OUTPUTS
from softnlp.figures.style import colour
from softnlp.model.conventions import Coefficients
from softnlp.model.materials import Material
from softnlp.studies.identified import COEFFICIENTS, Identified, file_name, free_constants
from softnlp.studies.measurements import OBSERVABLES, column_slice
from softnlp.studies.tensile import TensileFit

Table = dict[str, Any]
Rows = list[list[Any]]

LETTERS: Mapping[str, str] = {
    "k_e": "k_e, stiffening in elongation",
    "k_b": "k_b, stiffening in bending",
    "k_a": "k_a, correction of the area",
    "k_i": "k_i, correction of the inertia",
    "phi": "phi, part of the liner that pressure acts on",
    "k_c": "k_c, chamber reaction at a wall",
}
SIGMAS: Mapping[str, tuple[str, str]] = {
    key: (OUTPUTS[name].label.capitalize(), unit)
    for name in OBSERVABLES
    for key, unit in (
        (OUTPUTS[name].key, OUTPUTS[name].unit.label),
        *([(f"{name}_percent", "%")] if name != "tip_position" else []),
    )
}
MEASURED = [OUTPUTS[entry].measured for entries in OBSERVABLES.values() for entry in entries]
GREY = "#909090"


def free_choices(material: Material | None) -> dict[str, str]:
    """Return the constants that may be free, by name, with what they are."""
    own = () if material is None else material.law.constants
    return {**LETTERS, **{c.name: f"{c.name} of {material.law.name}" for c in own if material is not None}}


def first_free(header: Sequence[str]) -> list[str]:
    """Return which constants to free at first, by what a file has measured."""
    *poses, force = (name in header for name in MEASURED)
    return ["k_e", "k_b"] * any(poses) + ["k_c"] * force or ["k_e", "k_b"]


def with_free(table: Table, free: Sequence[str]) -> Table:
    """Return the table with other free constants, and the bounds of those only."""
    bounds = {name: pair for name, pair in dict(table.get("bounds", {})).items() if name in free}
    kept = {key: value for key, value in table.items() if key not in ("free", "bounds")}
    return {**kept, "free": list(free), **({"bounds": bounds} if bounds else {})}


def with_bound(table: Table, name: str, pair: Sequence[float]) -> Table:
    """Return the table with the bounds of a constant, in the unit of files."""
    return {**table, "bounds": {**dict(table.get("bounds", {})), name: list(pair)}}


def bounds_of(table: Mapping[str, Any], material: Material) -> dict[str, tuple[float | None, float | None, str]]:
    """Return the bounds of each free constant in the unit of files, None where it has none, and that unit."""
    given = dict(table.get("bounds", {}))
    known = {c.name: c for c in material.law.constants} | {c.file_key: c for c in material.law.constants}
    found: dict[str, tuple[float | None, float | None, str]] = {}
    for name in table.get("free", []):
        constant = None if name in COEFFICIENTS else known.get(name)
        if constant is None and name not in COEFFICIENTS:
            continue
        unit = "MPa" if constant is not None and constant.file_key.endswith("_MPa") else ""
        pair = given.get(name)
        if not (isinstance(pair, list) and len(pair) == 2):
            plain = free_constants([constant.name if constant else name], material, Coefficients())
            pair = [float(plain.lower[0]), float(plain.upper[0])]  # a silicone's constants have none of their own
        low, high = (float(x) if isfinite(x) else None for x in pair)
        found[name] = (low, high, unit)
    return found


def constant_rows(found: Identified) -> tuple[list[str], Rows]:
    """Return header and rows of the constants found, in the unit of files."""
    rows: Rows = []
    for k, name in enumerate(found.free.names):
        key, scale = file_name(name, found.material)
        error = float(found.uncertainty.standard_errors[k] / scale)
        row = [float(found.free.start[k] / scale), float(found.constants[k] / scale), error]
        rows.append([key, *row, found.notes[name]])
    return ["constant", "start", "found", "standard error", "note"], rows


def misfit_rows(found: Identified) -> tuple[list[str], Rows]:
    """Return header and rows of how far the model is from each observable, before and after."""
    before, after = found.errors(False), found.errors()
    rows: Rows = []
    for key in after:
        scale = OUTPUTS[key].scale
        row = [OUTPUTS[key].axis, after[key].count, *(m[key].rmse / scale for m in (before, after))]
        rows.append([*row, *(m[key].mape for m in (before, after))])
    return ["observable", "numbers", "rms before", "rms after", "mean before [%]", "mean after [%]"], rows


def compared(found: Identified, observable: str) -> list[dict[str, Any]]:
    """Return the traces of model against measurement: grey before, in colour after, a marker a robot."""
    scale, where = OUTPUTS[observable].scale, column_slice(observable)
    traces: list[dict[str, Any]] = []
    ends: list[float] = []
    for k, data in enumerate(found.data):
        measured = (data.of(observable) / scale).ravel()
        known = np.isfinite(measured)
        if not known.any():
            continue
        for when, values, paint in (("before", found.before, GREY), (data.label, found.after, colour(k))):
            model = (values[k][:, where] / scale).ravel()[known]
            ends += [float(v) for v in (*measured[known], *model) if isfinite(v)]
            traces.append(
                {
                    "type": "scatter",
                    "mode": "markers",
                    "x": measured[known].tolist(),
                    "y": [float(v) if isfinite(v) else None for v in model],
                    "name": when if when != "before" or not traces else "",
                    "showlegend": when != "before" or not traces,
                    "marker": {"color": paint, "size": 8, "symbol": k % 8 + (100 if when == "before" else 0)},
                }
            )
    if ends:
        line = {"color": GREY, "width": 1, "dash": "dot"}
        same = [min(ends), max(ends)]
        traces.append({"type": "scatter", "mode": "lines", "x": same, "y": same, "line": line, "showlegend": False})
    return traces


def observables(found: Identified) -> dict[str, str]:
    """Return what was measured, by key, as an axis names it."""
    return {key: OUTPUTS[key].axis for key in found.errors(False)}


def law_rows(fit: TensileFit) -> tuple[list[str], Rows]:
    """Return header and rows of the laws fitted to a tensile test."""
    rows: Rows = []
    for f in fit.fits.values():
        constants = ", ".join(
            f"{c.file_key} = {f.constants[c.name] / c.scale:.5g} ± {f.standard_errors[c.name] / c.scale:.2g}"
            + (f.notes[c.name] and f" ({f.notes[c.name]})")
            for c in f.law.constants
        )
        problem = f.problem and f"{f.status}: {f.problem}"
        rows.append([f.law.name, f.r_squared, f.misfit.rmse / 1e3, f.misfit.mape, constants, problem])
    header = ["law", "R²", "rms [kPa]", "mean [%]", "constants ± standard error", "problem"]
    return (header, rows) if any(row[-1] for row in rows) else (header[:-1], [row[:-1] for row in rows])


def law_traces(fit: TensileFit) -> list[dict[str, Any]]:
    """Return the traces of a tensile test and of the laws fitted to it, stretch against kPa."""
    low, high = next(iter(fit.fits.values())).fitted_stretch
    stretch = np.linspace(low, high, 121)
    points = {
        "type": "scatter",
        "mode": "markers",
        "name": "data",
        "x": fit.stretch.tolist(),
        "y": (fit.stress / 1e3).tolist(),
        "marker": {"color": GREY, "size": 5, "symbol": 100},
    }
    dashes = ("solid", "dash", "dashdot", "dot", "longdash")
    laws = [
        {
            "type": "scatter",
            "mode": "lines",
            "name": f.law.name,
            "x": stretch.tolist(),
            "y": [float(y) if isfinite(y) else None for y in f.stress(stretch) / 1e3],
            "line": {"color": colour(k), "width": 2, "dash": dashes[k % len(dashes)]},
        }
        for k, f in enumerate(fit.fits.values())
    ]
    return [points, *laws]
