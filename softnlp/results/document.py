"""A run as one JSON document: the names and units that people's scripts rely on."""

from __future__ import annotations

import json
import re
from math import isfinite
from typing import Any

import numpy as np

from softnlp.model.inputs import (
    coefficients_table,
    contact_table,
    loads_table,
    material_table,
    package_version,
    pressure_bar,
    robot_table,
    tidy,
)
from softnlp.nlp.solver import EquationResidual, Ipopt
from softnlp.statics.step import Run, Step
from softnlp.studies.fields import BLOCKED_FORCE, closure_of, document_outputs, left_by_weights, value

_SAID = ("status", "iterations", "multipliers")


def to_json(run: Run) -> dict[str, Any]:
    """Return a run as plain dicts, lists, strings, numbers and None; no NaN or infinity.

    Parameters
    ----------
    run
        Of any study that returns one.

    Returns
    -------
    dict
        Numbers under keys with their unit, such as "tip_position_mm". A step without a solution keeps pressure, time,
        status, message, residual, certificate and warnings; its other numbers are None.
    """
    contact = {} if run.contact is None else {"contact": contact_table(run.contact)}
    return {
        "softnlp": package_version(),
        "title": run.title,
        "study": run.study,
        "conventions": run.conventions.name,
        "robot": robot_table(run.robot),
        "material": material_table(run.material),
        "coefficients": coefficients_table(run.coefficients),
        "loads": loads_table(run.loads),
        **contact,
        "warnings": list(run.warnings),
        "steps": [_step(run, step) for step in run.steps],
    }


def json_text(run: Run) -> str:
    """Return the document of `to_json` as text, ending in a newline."""
    return compact_json(json.dumps(to_json(run), indent=2, ensure_ascii=False, allow_nan=False)) + "\n"


def compact_json(text: str) -> str:
    """Put each list of numbers of an indented document on one line."""
    # Strings hold no bare newline, so none is touched.
    return re.sub(r"\[\n\s+([^\[\]{}\"]*?)\n\s+\]", lambda m: f"[{' '.join(m[1].split())}]", text)


def _step(run: Run, step: Step) -> dict[str, Any]:
    table: dict[str, Any] = {"pressure_bar": pressure_bar(step.pressure)}
    if step.time is not None:
        table["t_s"] = tidy(step.time)
    table["status"] = step.status.value
    table["message"] = step.message
    table |= {output.key: _plain(value(output, step)) for output in document_outputs(run)}
    if run.study == BLOCKED_FORCE:
        table["closure"] = closure_of(run, step)
        if table["closure"] == "weighted":
            table["weighted_residual"] = _lines(left_by_weights(step))
    table |= engine_table(step.engine, step.ipopt)
    table["residual"] = _plain(step.residual)
    table["certificate"] = _lines(step.certificate)
    table["warnings"] = list(step.warnings)
    return table


def engine_table(engine: str | None, ipopt: Ipopt | None) -> dict[str, Any]:
    """Return which engine solved something, and what IPOPT said of it."""
    said = {name: None if ipopt is None else _plain(getattr(ipopt, name)) for name in _SAID}
    return {"engine": engine, **{f"ipopt_{name}": value for name, value in said.items()}}


def _lines(residuals: tuple[EquationResidual, ...]) -> list[dict[str, Any]]:
    """Return errors of equations, each with its unit."""
    return [
        {"equation": line.equation, "value": _plain(line.value), "unit": line.unit, "scaled": _plain(line.scaled)}
        for line in residuals
    ]


def _plain(found: Any) -> Any:
    """Return numbers and arrays as JSON has them: Python's own types, None for what is not finite."""
    if isinstance(found, np.ndarray | np.generic):
        found = found.tolist()
    if isinstance(found, list):
        return [_plain(item) for item in found]
    if isinstance(found, float) and not isfinite(found):
        return None
    return found
