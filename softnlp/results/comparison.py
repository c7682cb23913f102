"""What a comparison leaves behind: a JSON document, a table of its rows, and one of its statistics."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from softnlp.base.errors import InputError
from softnlp.base.reading import shown
from softnlp.base.statistics import Statistics
from softnlp.model.inputs import coefficients_table, contact_table, loads_table, package_version, pressure_bar, tidy
from softnlp.results.document import csv_text, number
from softnlp.scenario.compare import CompareTask, comparison_checks
from softnlp.studies.check import messages
from softnlp.studies.comparison import NUMBERS, OBSERVABLES, Comparison, differences

STATISTICS = ("count", "rmse", "mape_percent", "mean", "median", "max", "bias", "left_out_of_mape", "unit")
_VARIANT = ("law", "coefficients", "conventions", "closure")


def comparison_document(task: CompareTask, found: Comparison) -> dict[str, Any]:
    """Return the JSON document of a comparison."""
    scenario = task.scenario
    measured = {OBSERVABLES[name].measured: found.measured(name) for name in found.observables}
    return {
        "softnlp": package_version(),
        "title": scenario.title,
        "study": scenario.study,
        "measured": str(task.path),
        "conventions": scenario.conventions.name,
        "robots": [o.label for o in found.observed],
        "material": scenario.material.name,
        "loads": loads_table(scenario.loads),
        "contact": None if scenario.contact is None else contact_table(scenario.contact),
        "shape": found.shape,
        "count": len(task.columns.rows),
        "measured_count": measured,
        "blank_count": {key: len(task.columns.rows) - count for key, count in measured.items()},
        "best": _best(found),
        "variants": [_variant(task, found, v) for v in range(len(found.variants))],
        "notes": list(task.notes),
        **({} if task.registration is None else {"registration": _registrations(found)}),
        "checks": [check.document() for check in comparison_checks(task, found)],
        "warnings": [*task.warnings, *messages(comparison_checks(task, found), "warned")],
    }


def _registrations(found: Comparison) -> list[list[Any]]:
    """Return [registration] of each variant and robot, with what was fitted."""
    every = [[solved.registration for solved in simulated] for simulated in found.simulated]
    return [[None if placed is None else placed.table() for placed in row] for row in every]


def _named(found: Comparison, v: int) -> dict[str, Any]:
    variant = found.variants[v]
    names = (variant.law, variant.named, variant.conventions.name, variant.closure)
    return dict(zip(_VARIANT, names, strict=True))


def _best(found: Comparison) -> dict[str, Any] | None:
    """Return the variant with the least error over all, and of each observable."""
    if found.best is None:
        return None
    each = {}
    for name in found.main_observables:
        if (v := found.best_of(name)) is not None:
            each[OBSERVABLES[name].measured] = {"variant": v + 1, **_named(found, v)}
    return {"variant": found.best + 1, **_named(found, found.best), "by_observable": each}


def _variant(task: CompareTask, found: Comparison, v: int) -> dict[str, Any]:
    variant = found.variants[v]
    return {
        **_named(found, v),
        "coefficient_values": coefficients_table(variant.coefficients, energy=variant.conventions.energy),
        "unsolved": found.lost(v),
        "self_intersecting": found.self_intersecting(v),
        "statistics": _statistics(found, v, None),
        "by_robot": {o.label: _statistics(found, v, k) for k, o in enumerate(found.observed)},
        "rows": [_row(task, found, v, *place) for place in _places(task)],
    }


def _statistics(found: Comparison, v: int, robot: int | None) -> dict[str, Any]:
    """Return the statistics of every observable that was measured, of one robot or of all."""
    told = {}
    for name in found.observables:
        if found.measured(name, robot):
            values = statistics_cells(found.statistics(v, name, robot), name)
            told[OBSERVABLES[name].measured] = dict(zip(STATISTICS, values, strict=True))
    return told


def statistics_cells(s: Statistics, name: str) -> list[Any]:
    """Return statistics in the unit of files, in the order of `STATISTICS`; None where there is no number."""
    scale = OBSERVABLES[name].scale
    rmse, mean, median, largest, bias = (number(x / scale) for x in (s.rmse, s.mean, s.median, s.largest, s.bias))
    return [s.count, rmse, number(s.mape), mean, median, largest, bias, s.left_out, OBSERVABLES[name].unit.label]


def _places(task: CompareTask) -> Iterator[tuple[int, int | None, int]]:
    """Yield (row of the file, which robot, row of that robot) in the file's order; robot None: it has no numbers."""
    where = {place: (j, k) for j, rows in enumerate(task.rows) for k, (_, place) in enumerate(rows.places)}
    for row in range(len(task.columns.rows)):
        robot, k = where.get(row, (None, 0))
        yield row, robot, k


def _row(task: CompareTask, found: Comparison, v: int, row: int, robot: int | None, k: int) -> dict[str, Any]:
    """Return one measured row with what a variant says of it."""
    line = task.columns.lines[row]
    if robot is None:
        return {"row": row + 1, "line": line, "status": None}
    o, solved = found.observed[robot], found.simulated[v][robot]
    status = solved.status[k]
    told: dict[str, Any] = {"row": row + 1, "line": line, "robot": o.label, "pressure_bar": pressure_bar(o.pressure[k])}
    if np.isfinite(task.time[row]):
        told["t_s"] = tidy(task.time[row])
    told |= {"status": None if status is None else status.value, "message": solved.message[k]}
    known = status is not None and status.has_solution
    told["self_intersecting"] = k in solved.self_intersecting if known else None
    parts: dict[str, dict[str, Any]] = {"measured": {}, "simulated": {}, "error": {}}
    measured, simulated = o.values[k], solved.values[k]
    for name in found.observables:
        key, scale = OBSERVABLES[name].measured, OBSERVABLES[name].scale
        # The distance of the tips has no measured and no simulated number.
        at: Any = NUMBERS.index(name) if name in NUMBERS else slice(3)
        if np.isfinite(measured[at]).all():
            if name in NUMBERS:
                parts["measured"][key], parts["simulated"][key] = (number(v[at] / scale) for v in (measured, simulated))
            error, _ = differences(name, simulated[None, :], measured[None, :], float(o.robot.length))
            parts["error"][key] = number(error[0] / scale)
    return told | parts


def summary_text(found: Comparison) -> str:
    """Return the statistics as CSV: a row for each variant, robot ("all" first) and observable."""
    rows: list[list[Any]] = []
    for v in range(len(found.variants)):
        for robot, label in ((None, "all"), *((k, o.label) for k, o in enumerate(found.observed))):
            for name in found.observables:
                if found.measured(name, robot):
                    cells = statistics_cells(found.statistics(v, name, robot), name)
                    rows.append([*_named(found, v).values(), label, OBSERVABLES[name].measured, *cells])
    return csv_text([*_VARIANT, "robot", "observable", *STATISTICS], rows, 10)


def require_free_names(task: CompareTask) -> None:
    """Refuse a file that has columns which the table of rows adds."""
    for name in _added([*OBSERVABLES]):
        if name in task.header:
            raise InputError(
                f"column {shown(name)} is one that a comparison writes; rename it or leave it out",
                source=task.columns.file,
            )


def _added(observables: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Return the columns that the table of rows has beside those of the file, each with its part and key in a row."""
    keys = [OBSERVABLES[name].measured for name in observables]
    simulated = [OBSERVABLES[name].measured for name in observables if name in NUMBERS]
    return {
        **{f"variant_{name}": ("", name) for name in _VARIANT},
        **{f"simulated_{key}": ("", key) for key in ("status", "message")},
        **{f"simulated_{key}": ("simulated", key) for key in simulated},
        **{f"error_{key}": ("error", key) for key in keys},
    }


def rows_text(task: CompareTask, found: Comparison) -> str:
    """Return every row of the file as CSV for each variant: its cells, what is simulated, and the errors."""
    added = _added(found.observables)
    rows: list[list[Any]] = []
    for v in range(len(found.variants)):
        for place in _places(task):
            told = _row(task, found, v, *place) | _named(found, v)
            cells = [(told.get(part, {}) if part else told).get(key) for part, key in added.values()]
            rows.append([*task.columns.rows[place[0]], *cells])
    return csv_text([*task.header, *added], rows, 10)
