"""A run as one JSON document: the names and units that people's scripts rely on; and how any study writes text."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Iterable, Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np

from softnlp.base.columns import OUTPUTS, outputs
from softnlp.base.errors import InputError
from softnlp.base.units import MILLIMETRE, NEWTON_MILLIMETRE
from softnlp.model.inputs import asked_tables, contact_table, package_version, pressure_bar, tidy
from softnlp.model.obstacle_tables import obstacle_tables
from softnlp.model.quantities import Model
from softnlp.nlp.solver import EquationResidual, Ipopt
from softnlp.statics.step import Run, Step
from softnlp.studies.fields import (
    BLOCKED_FORCE,
    DYNAMIC,
    TRAJECTORY,
    closure_of,
    deviation_outputs,
    document_outputs,
    left_by_weights,
    solved_pose,
    value,
)

_SAID = ("status", "iterations", "multipliers")


def run_document(run: Run) -> dict[str, Any]:
    """Return a run as `softnlp.to_json` does."""
    return {
        **document_head(run.title, run.study, run.conventions.name),
        **asked_tables(Model(run.robot, run.material, run.coefficients, run.conventions), run.loads),
        **({} if run.contact is None else {"contact": contact_table(run.contact)}),
        **({"uncertainty": dict(run.uncertainty)} if run.uncertainty else {}),
        **({"obstacles": obstacle_tables(run.obstacles)} if run.obstacles else {}),
        **({"limits": dict(run.limits), "least_margins": _least(run)} if run.study == TRAJECTORY else {}),
        "warnings": list(run.warnings),
        **({"energy": plain(run.energy) or None} if run.study == DYNAMIC else {}),
        "steps": [_step(run, step) for step in run.steps],
    }


def require_run(found: Any, taker: str) -> Run:
    """Return a run, or raise `InputError` that says what takes another result. taker : what was called."""
    if isinstance(found, Run):
        return found
    name = type(found).__name__
    advice = {
        "Design": "; softnlp.to_json takes it, and the command softnlp design writes its files",
        "TensileFit": "; softnlp.to_json takes it with its scenario, and the command softnlp identify writes its files",
        "Identified": "; softnlp.to_json takes it with its scenario, and the command softnlp identify writes its files",
        "Workspace": f"; it is a netCDF file already: {getattr(found, 'file', '')}",
    }
    raise InputError(f"{taker} takes a run, got a value of type {name}{advice.get(name, '')}")


def json_text(run: Run) -> str:
    """Return the document of a run as text, ending in a newline."""
    return document_text(run_document(run))


def document_head(title: str, study: str, conventions: str) -> dict[str, Any]:
    """Return how the document of any study begins."""
    return {"softnlp": package_version(), "title": title, "study": study, "conventions": conventions}


def document_text(document: Mapping[str, Any], *, compact: bool = True) -> str:
    """Return a document as text, ending in a newline; `compact` puts each list of numbers on one line."""
    text = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False)
    if compact:  # strings hold no bare newline, so none is touched
        text = re.sub(r"\[\n\s+([^\[\]{}\"]*?)\n\s+\]", lambda m: f"[{' '.join(m[1].split())}]", text)
    return text + "\n"


def csv_text(header: Iterable[Any], rows: Iterable[Sequence[Any]], digits: int | None = None) -> str:
    """Return rows as CSV, empty cells for None; digits : of numbers, by default all that they have."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows([f"{v:.{digits}g}" if digits and isinstance(v, float) else v for v in row] for row in rows)
    return text.getvalue()


def _step(run: Run, step: Step) -> dict[str, Any]:
    table: dict[str, Any] = {"pressure_bar": pressure_bar(step.pressure)}
    if step.time is not None:
        table["t_s"] = tidy(step.time)
    table["status"] = step.status.value
    table["message"] = step.message
    deviations = deviation_outputs(run)
    table |= {o.key: plain(value(o, step)) for o in document_outputs(run) if o not in deviations}
    table["segments"] = segments_of(step)
    if deviations:
        table["std"] = {o.key.removeprefix("std_"): plain(value(o, step)) for o in deviations}
        table["std_message"] = "" if step.deviation is None else step.deviation.message
    if run.study == BLOCKED_FORCE:
        table["closure"] = closure_of(run, step)
        if table["closure"] == "weighted":
            table["weighted_residual"] = _lines(left_by_weights(step))
    if run.obstacles:
        table["contacts"] = contacts_of(step)
        table["complementarity_Nmm"] = number(step.complementarity, NEWTON_MILLIMETRE)
    table |= engine_table(step.engine, step.ipopt)
    table["residual"] = plain(step.residual)
    table["certificate"] = _lines(step.certificate)
    table["warnings"] = list(step.warnings)
    return table


def _least(run: Run) -> dict[str, Any]:
    """Return the least of each margin over a path."""
    found = {}
    for output in outputs("margins"):
        known = [v for step in run.steps if (v := value(output, step)) is not None]
        found[output.key] = plain(min(known, default=None))
    return found


def segments_of(step: Step) -> list[dict[str, Any]] | None:
    """Return each segment of a step's pose by itself, None without a solution."""
    if (pose := solved_pose(step)) is None:
        return None
    names = ("tip_position", "tip_rotation", "stretch", "bending_angle")
    return [
        {OUTPUTS[name].key: plain(OUTPUTS[name].shown(getattr(part, name))) for name in names} for part in pose.parts
    ]


def contacts_of(step: Step) -> list[dict[str, Any]] | None:
    """Return what each obstacle does to the robot, None without a solution."""
    if solved_pose(step) is None:
        return None
    return [
        {
            "obstacle": contact.obstacle,
            "force_N": plain(contact.force),
            "from_s": contact.start,
            "to_s": contact.end,
            OUTPUTS["gap"].key: number(contact.gap, MILLIMETRE),
        }
        for contact in step.contacts
    ]


def engine_table(engine: str | None, ipopt: Ipopt | None) -> dict[str, Any]:
    """Return which engine solved something, and what IPOPT said of it."""
    said = {name: None if ipopt is None else plain(getattr(ipopt, name)) for name in _SAID}
    return {"engine": engine, **{f"ipopt_{name}": value for name, value in said.items()}}


def _lines(residuals: tuple[EquationResidual, ...]) -> list[dict[str, Any]]:
    """Return errors of equations, each with its unit."""
    return [
        {"equation": line.equation, "value": plain(line.value), "unit": line.unit, "scaled": plain(line.scaled)}
        for line in residuals
    ]


def plain(found: Any) -> Any:
    """Return numbers and arrays as JSON has them: Python's own types, None for what is not finite."""
    if isinstance(found, np.ndarray | np.generic):
        found = found.tolist()
    if isinstance(found, dict):
        return {key: plain(item) for key, item in found.items()}
    if isinstance(found, list):
        return [plain(item) for item in found]
    return None if isinstance(found, float) and not isfinite(found) else found


def number(value: float | None, scale: float = 1.0) -> float | None:
    """Return a number in a unit of so many SI, None where there is none."""
    return None if value is None or not isfinite(value) else float(value) / scale
