"""What a tip over time leaves behind: JSON of an identification and of a comparison, tables, and keys to paste."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.units import MILLIMETRE
from softnlp.model.inputs import loads_table
from softnlp.results.document import csv_text, document_head, number, plain
from softnlp.results.identify_document import material_table, table_text
from softnlp.studies.check import messages

if TYPE_CHECKING:
    from softnlp.scenario.data import Scenario
    from softnlp.scenario.motion import MotionTask
    from softnlp.studies.identify_motion import MotionFit
    from softnlp.studies.trace import Trace, TraceErrors

Array = NDArray[np.float64]


def errors_table(errors: TraceErrors | None) -> dict[str, Any] | None:
    """Return how far a simulated tip is from a measured one."""
    if errors is None:
        return None
    first = errors.harmonic
    return {
        "count": int(np.isfinite(errors.distance).sum()),
        "rmse_mm": number(errors.rmse, MILLIMETRE),
        "largest_mm": number(errors.largest, MILLIMETRE),
        "rmse_of_axes_mm": [number(value, MILLIMETRE) for value in errors.axes],
        "movement_mm": number(errors.movement, MILLIMETRE),
        "first_harmonic": None
        if first is None
        else {
            "frequency_Hz": number(first.frequency),
            "axis": "xyz"[first.axis],
            "measured_mm": number(abs(first.measured), MILLIMETRE),
            "simulated_mm": number(abs(first.simulated), MILLIMETRE),
            "amplitude_ratio": number(abs(first.simulated) / abs(first.measured)) if first.measured else None,
            "phase_deg": number(np.rad2deg(first.phase)),
        },
    }


def motion_document(asked: Scenario, task: MotionTask, found: MotionFit) -> dict[str, Any]:
    """Return the JSON document of an identification from a motion."""
    constants = [
        {
            "name": name,
            "value": number(found.values[k]),
            "standard_error": number(found.uncertainty.standard_errors[k]),
            "start": number(found.start[k]),
            "bounds": [number(found.lower[k]), number(found.upper[k])],
            "at_bound": name in found.at_bound,
            "determined": found.determined[name],
        }
        for k, name in enumerate(found.names)
    ]
    solved = found.status == "solved"
    return {
        **document_head(asked.title, "identify", asked.conventions.name),
        "loads": loads_table(asked.loads),
        "status": str(found.status),
        "message": found.message,
        "file": task.file,
        "constants": constants,
        "correlation": plain(found.uncertainty.correlation),
        "condition": number(found.uncertainty.condition),
        "errors": {"before": errors_table(found.errors_before), "after": errors_table(found.errors_after)},
        "step_s": number(found.asked.step or np.nan),
        "tables": motion_tables(found) if solved else None,
        "measurements": [
            {"t_s": float(t), **{key: _place(tips[k]) for key, tips in _tips(found).items()}}
            for k, t in enumerate(found.trace.times)
        ],
        "evaluations": found.evaluations,
        "checks": [check.document() for check in found.checks],
        "warnings": [*found.warnings, *messages(found.checks, "warned")],
    }


def _tips(found: MotionFit) -> dict[str, Array]:
    return {"measured": found.trace.tip, "before": found.before, "after": found.after}


def _place(tip: Array) -> list[float | None]:
    return [number(value, MILLIMETRE) for value in tip]


def motion_tables(found: MotionFit) -> dict[str, Any]:
    """Return the keys of a scenario that were found, by table."""
    values = dict(zip(found.names, found.values.tolist(), strict=True))
    factor = values.pop("modulus_factor", None)
    tables: dict[str, Any] = {"dynamic": values} if values else {}
    if factor is not None and found.coefficients.modulus_factor != 1.0:
        tables["corrections"] = {"modulus_factor": factor}
    elif factor is not None:
        tables["material"] = material_table(found.material)
    return tables


def motion_text(asked: Scenario, found: MotionFit) -> str:
    """Return keys to paste into a scenario, with standard errors as comments."""
    notes = {}
    for k, name in enumerate(found.names):
        error, note = found.uncertainty.standard_errors[k], found.notes[name]
        said = f"+- {error:.2g}" if isfinite(error) else "without standard error"
        notes[name] = f"  # identified, {note if name in found.at_bound else said + (note and f', {note}')}"
    title = " ".join(asked.title.split())
    lines = [f"# Identified from {title}; keys to paste into a scenario."]
    if "material" in (tables := motion_tables(found)):
        lines.append(
            f"# modulus_factor = {float(found.values[found.names.index('modulus_factor')])!r}{notes['modulus_factor']}"
        )
    for table, values in tables.items():
        lines += ["", f"[{table}]", *table_text(table, values, notes)]
    return "\n".join(lines) + "\n"


def trace_table_text(trace: Trace, simulated: dict[str, Array]) -> str:
    """Return the rows of a trace with simulated tips beside them as CSV. simulated : by what is added to a name."""
    columns = [f"{x}_mm" for x in "xyz"]
    header = ["t_s", *columns, *(f"{name}_{when}" for when in simulated for name in columns)]
    every = [trace.tip, *simulated.values()]
    rows = [
        [t, *(v if isfinite(v) else "" for tips in every for v in tips[k] / MILLIMETRE)]
        for k, t in enumerate(trace.times)
    ]
    return csv_text(header, rows, 10)


def trace_document(
    asked: Scenario, file: str, trace: Trace, tips: Array, errors: TraceErrors, notes: tuple[str, ...]
) -> dict[str, Any]:
    """Return the JSON document of a motion compared with a trace. tips : simulated (rows, 3) [m]."""
    return {
        **document_head(asked.title, "compare", asked.conventions.name),
        "loads": loads_table(asked.loads),
        "file": file,
        **(errors_table(errors) or {}),
        "measurements": [
            {"t_s": float(t), "measured": _place(trace.tip[k]), "simulated": _place(tips[k])}
            for k, t in enumerate(trace.times)
        ],
        "notes": list(notes),
    }
