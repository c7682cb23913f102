"""What an identification leaves behind: a JSON document, a table of the data, and tables that a scenario accepts."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

from softnlp.base.columns import OUTPUTS
from softnlp.base.files import toml_key, toml_text
from softnlp.base.statistics import Statistics
from softnlp.base.units import MEGAPASCAL
from softnlp.model.inputs import loads_table, pressure_bar, tidy
from softnlp.model.materials import Material
from softnlp.results.document import csv_text, document_head, engine_table, number, plain
from softnlp.studies.check import messages
from softnlp.studies.identified import COEFFICIENTS, file_name
from softnlp.studies.measurements import OBSERVABLES, column_slice

if TYPE_CHECKING:
    from softnlp.scenario.read import Scenario
    from softnlp.studies.identified import Identified
    from softnlp.studies.measurements import RobotTask, TensileTask
    from softnlp.studies.tensile import LawFit, TensileFit

_TABLE_OF = {"stiffening": ("k_e", "k_b"), "corrections": ("k_a", "k_i", "phi"), "contact": ("k_c",)}


def _misfit(found: Statistics, unit: float) -> dict[str, Any]:
    return {"count": found.count, "rmse": number(found.rmse, unit), "mape_percent": number(found.mape)}


# --- tensile tests ----------------------------------------------------------------------------------------------------


def tensile_document(asked: Scenario, task: TensileTask, fit: TensileFit) -> dict[str, Any]:
    """Return the JSON document of a tensile test."""
    from softnlp.studies.tensile import tensile_misfit

    best = fit.best
    before = None if task.before is None else tensile_misfit(task.before, task.stretch, task.stress)
    return {
        **document_head(asked.title, "identify", asked.conventions.name),
        "material": task.name,
        "files": list(task.files),
        "points": int(task.stretch.size),
        "stretch_range": None if task.stretch_range is None else list(task.stretch_range),
        "dropped": task.dropped,
        "data_stretch": list(task.data_stretch),
        "fitted_stretch": [float(v) for v in next(iter(fit.fits.values())).fitted_stretch],
        "before": None
        if before is None
        else {"rmse_MPa": number(before.rmse, MEGAPASCAL), "mape_percent": number(before.mape)},
        "best": None if best is None else best.law.name,
        "checks": [check.document() for check in fit.checks],
        "laws": [_law(f) for f in fit.fits.values()],
        **({"notes": list(task.notes)} if task.notes else {}),
    }


def _law(fit: LawFit) -> dict[str, Any]:
    constants = fit.law.constants
    return {
        "model": fit.law.name,
        "status": fit.status,
        "message": fit.problem or "the sum of squares is at a minimum",
        "constants": {c.file_key: number(fit.constants[c.name] / c.scale) for c in constants},
        "standard_errors": {c.file_key: number(fit.standard_errors[c.name] / c.scale) for c in constants},
        "determined": {c.file_key: fit.determined[c.name] for c in constants},
        "at_bound": [c.file_key for c in constants if c.name in fit.at_bound],
        "correlation": plain(fit.correlation),
        "condition": number(fit.condition),
        "r_squared": number(fit.r_squared),
        "rmse_MPa": number(fit.misfit.rmse, MEGAPASCAL),
        "mape_percent": number(fit.misfit.mape),
        "unstable_from_stretch": fit.unstable_from,
        "checks": [check.document() for check in fit.checks],
        **engine_table(fit.engine, fit.ipopt),
        "warnings": list(fit.warnings),
    }


def material_file_text(task: TensileTask, fit: TensileFit) -> str:
    """Return a materials file with every fitted law that is a material; the others are comments."""
    low, high = next(iter(fit.fits.values())).fitted_stretch
    name = _quoted(task.name)
    source = f"tensile test: {', '.join(task.files)}, {task.about}"
    lines = [
        "# Constants fitted by softnlp identify; +- is one standard error.",
        "",
        f"[{name}]",
        f"density_kg_m3 = {tidy(task.density)!r}",
        f"fitted_stretch = [{tidy(low)!r}, {tidy(high)!r}]",
        f"source = {_quoted(source, always=True)}",
    ]
    for f in fit.fits.values():
        block = [f"[{name}.{_quoted(f.law.name)}]"]
        formula = formula_of(f.law)
        if formula is not None:
            block.append(f"formula = {_quoted(formula, always=True)}")
            block.append(f"[{name}.{_quoted(f.law.name)}.constants]")
        for c in f.law.constants:
            value, error = f.constants[c.name] / c.scale, f.standard_errors[c.name] / c.scale
            block.append(f"{c.file_key} = {value!r}  # +- {error:.2g}{f.notes[c.name] and f', {f.notes[c.name]}'}")
        note = f"# R^2 = {f.r_squared:.6f}, rmse {f.misfit.rmse / MEGAPASCAL:.3g} MPa"
        problem = [f"{f.status}: {f.problem}"] if f.problem else []
        lines += ["", note, *(f"# {_one_line(w)}" for w in (*problem, *f.warnings))]
        lines += block if f.material is not None else [f"# {line}" for line in block]
    return "\n".join(lines) + "\n"


def formula_of(law: Any) -> str | None:
    """Return the text of a person's law, None for a built-in one."""
    return getattr(getattr(law.formula, "function", None), "text", None)


def tensile_table_text(task: TensileTask, fit: TensileFit) -> str:
    """Return the data and every law's stress at them as CSV."""
    laws = list(fit.fits.values())
    curves = [f.stress(task.stretch) / MEGAPASCAL for f in laws]
    if task.before is not None:
        curves.insert(0, np.asarray(task.before.engineering_stress(task.stretch)) / MEGAPASCAL)
    before = ["before_MPa"] if task.before is not None else []
    header = ["file", "stretch", "stress_MPa", *before, *(f"{f.law.name}_MPa" for f in laws)]
    rows = [
        [task.files[task.file_of_point[k]], task.stretch[k], task.stress[k] / MEGAPASCAL, *(c[k] for c in curves)]
        for k in range(task.stretch.size)
    ]
    return csv_text(header, rows, 10)


# --- measurements of robots -------------------------------------------------------------------------------------------


def robot_document(asked: Scenario, task: RobotTask, found: Identified) -> dict[str, Any]:
    """Return the JSON document of measurements of robots."""
    constants = []
    for k, name in enumerate(found.free.names):
        key, scale = file_name(name, found.material)
        constants.append(
            {
                "name": key,
                "value": number(found.constants[k], scale),
                "standard_error": number(found.uncertainty.standard_errors[k], scale),
                "start": number(found.free.start[k], scale),
                "bounds": [number(found.free.lower[k], scale), number(found.free.upper[k], scale)],
                "at_bound": name in found.at_bound,
                "determined": found.determined[name],
            }
        )
    return {
        **document_head(asked.title, "identify", asked.conventions.name),
        "loads": loads_table(asked.loads),
        "status": str(found.status),
        "message": found.message,
        "constants": constants,
        "correlation": plain(found.uncertainty.correlation),
        "condition": number(found.uncertainty.condition),
        "weighted_rms": {"before": number(found.weighted_rms(False)), "after": number(found.weighted_rms())},
        "errors": {
            when: {OUTPUTS[key].key: _misfit(m, OUTPUTS[key].scale) for key, m in found.errors(after).items()}
            for when, after in (("before", False), ("after", True))
        },
        "sigma": {d.label: _sigma(d) for d in found.data},
        "tables": scenario_tables(found) if found.status == "solved" else None,
        "measurements": [row for k in range(len(found.data)) for row in _rows(found, k)],
        "evaluations": found.evaluations,
        **engine_table(found.engine, found.ipopt),
        **({} if found.registration is None else {"registration": found.registration.table()}),
        "checks": [check.document() for check in found.checks],
        "warnings": [*found.warnings, *messages(found.checks, "warned")],
    }


def _sigma(data: Any) -> dict[str, float]:
    """Return the root mean square of the standard deviations that the residuals were divided by."""
    found = {}
    for key in OBSERVABLES:
        used = data.sigma[:, column_slice(key)][np.isfinite(data.of(key))]
        if used.size:
            found[OUTPUTS[key].key] = float(OUTPUTS[key].shown(np.sqrt(np.mean(used**2))))
    return found


def _rows(found: Identified, k: int) -> list[dict[str, Any]]:
    """Return what was measured of one robot with the model before and after."""
    data = found.data[k]
    rows = []
    for j, P in enumerate(data.pressure):
        row: dict[str, Any] = {"robot": data.label, "pressure_bar": pressure_bar(P)}
        for when, values in (("measured", data.values), ("before", found.before[k]), ("after", found.after[k])):
            row[when] = {
                OUTPUTS[key].key: _value(OUTPUTS[key].shown(values[j, column_slice(key)]))
                for key in OBSERVABLES
                if np.any(np.isfinite(data.values[j, column_slice(key)]))
            }
        rows.append(row)
    return rows


def _value(values: Any) -> Any:
    numbers = [number(v) for v in values]
    return numbers[0] if len(numbers) == 1 else numbers


def scenario_tables(found: Identified) -> dict[str, Any]:
    """Return the tables of a scenario with what was identified, and the coefficients that go with it."""
    values = {name: float(getattr(found.coefficients, c.field)) for name, c in COEFFICIENTS.items()}
    tables: dict[str, Any] = {}
    for table, names in _TABLE_OF.items():
        if table != "contact" or "k_c" in found.free.names:
            tables[table] = {COEFFICIENTS[n].field: values[n] for n in names}
    if any(q.startswith("material.") for q in found.free.quantities):
        tables["material"] = material_table(found.material)
    return tables


def material_table(material: Material) -> dict[str, Any]:
    """Return [material] of a scenario with the constants of a material."""
    formula = formula_of(material.law)
    return {
        "name": material.name,
        "model": material.law.name,
        "density_kg_m3": tidy(material.density),
        "fitted_stretch": [tidy(v) for v in material.fitted_stretch],
        **({} if formula is None else {"formula": formula}),
        "constants": {c.file_key: float(material.constants[c.name]) / c.scale for c in material.law.constants},
    }


def identified_text(asked: Scenario, found: Identified) -> str:
    """Return tables to paste into a scenario, with standard errors as comments."""
    errors = {}
    for k, name in enumerate(found.free.names):
        key, scale = file_name(name, found.material)
        key = COEFFICIENTS[name].field if name in COEFFICIENTS else key
        error = found.uncertainty.standard_errors[k] / scale
        errors[key] = f"  # identified, +- {error:.2g}" if isfinite(error) else "  # identified, without standard error"
        if note := found.notes[name]:
            errors[key] = "  # identified, at its bound" if name in found.at_bound else f"{errors[key]}, {note}"
    lines = [f"# Identified from {_one_line(asked.title)}; tables to paste into a scenario."]
    for table, values in scenario_tables(found).items():
        if table == "contact":
            lines += ["", "# for study blocked-force only"]
        lines += ["", f"[{table}]"] if table != "contact" else [f"[{table}]"]
        lines += table_text(table, values, errors)
    if found.registration is not None:
        lines += ["", *found.registration.lines()]
    return "\n".join(lines) + "\n"


def table_text(table: str, values: dict[str, Any], notes: dict[str, str]) -> list[str]:
    """Return the lines of a table of a scenario below its head. notes : what stands behind a key."""
    lines = []
    for key, value in values.items():
        if isinstance(value, dict):
            lines += ["", f"[{table}.{key}]"]
            lines += [f"{_quoted(k)} = {v!r}{notes.get(k, '')}" for k, v in value.items()]
        else:
            text = _quoted(value, always=True) if isinstance(value, str) else repr(value)
            lines.append(f"{key} = {text}{notes.get(key, '')}")
    return lines


def robot_table_text(task: RobotTask, found: Identified) -> str:
    """Return the rows of the files with what the model says before and after, as CSV."""
    names, picks = [], []
    for key, entries in OBSERVABLES.items():
        parts, unit = [OUTPUTS[entry].measured for entry in entries], OUTPUTS[key].scale
        where = range(column_slice(key).start, column_slice(key).stop)
        for part, column in zip(parts, where, strict=True):
            if any(np.any(d.measured[:, column]) for d in found.data):
                names.append(part)
                picks.append((column, unit))
    header = [*task.columns, *(f"{n}_{when}" for n in names for when in ("before", "after"))]
    rows = []
    for k, cells in enumerate(task.cells):
        for j, row in enumerate(cells):
            pairs = [(found.before[k][j, c] / unit, found.after[k][j, c] / unit) for c, unit in picks]
            rows.append([*row, *(v if isfinite(v) else "" for pair in pairs for v in pair)])
    return csv_text(header, rows, 10)


def _quoted(text: str, *, always: bool = False) -> str:
    """Return a key, or text, as TOML writes it."""
    return toml_text(text) if always else toml_key(text)


def _one_line(text: str) -> str:
    return " ".join(text.split())
