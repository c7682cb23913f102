"""A run as CSV: one row a step, the unit in each column's name, empty cells where there is no solution."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from softnlp.base.columns import Output
from softnlp.base.files import write_whole
from softnlp.model.inputs import pressure_bar, tidy
from softnlp.statics.step import Run, Step
from softnlp.studies.fields import BLOCKED_FORCE, closure_of, document_outputs, left_by_weights, value


def write_table(run: Run, path: str | PathLike[str]) -> Path:
    """Write a run as CSV; pressures are in columns p1_bar, p2_bar, … as in a pressure file.

    Raises
    ------
    InputError
        When the file cannot be written.
    """
    return write_whole(path, table_text(run).encode())


def table_text(run: Run) -> str:
    """Return the text of `write_table`."""
    timed = any(step.time is not None for step in run.steps)
    weighted = {line.equation: line.unit for step in run.steps for line in left_by_weights(step)}
    header = ["step"] + ["t_s"] * timed
    header += [f"p{k + 1}_bar" for k in range(run.robot.chamber_sets)]
    columns = {output: output.keys({"chamber": run.robot.chambers}, "") for output in document_outputs(run)}
    header += ["status", *(key for keys in columns.values() for key in keys)]
    header += ["closure"] * (run.study == BLOCKED_FORCE)
    header += ["_".join(["weighted_residual", *name.split(), unit.replace(" ", "")]) for name, unit in weighted.items()]
    header += ["residual", "message", "warnings"]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    for number, step in enumerate(run.steps, start=1):
        writer.writerow(list(_row(number, step, run, timed, columns, list(weighted))))
    return text.getvalue()


def _row(
    number: int, step: Step, run: Run, timed: bool, columns: Mapping[Output, Sequence[str]], weighted: list[str]
) -> Iterator[Any]:
    yield number
    if timed:
        yield "" if step.time is None else tidy(step.time)
    yield from pressure_bar(step.pressure)
    yield step.status.value
    for output, keys in columns.items():
        found = value(output, step)
        yield from ([""] * len(keys) if found is None else map(_cell, np.ravel(found).tolist()))
    if run.study == BLOCKED_FORCE:
        yield closure_of(run, step) or ""
    left = {line.equation: line.value for line in left_by_weights(step)}
    yield from (_cell(left.get(equation)) for equation in weighted)
    yield _cell(step.residual)
    yield step.message
    yield "; ".join(step.warnings)


def _cell(found: Any) -> Any:
    """Return a number as CSV has it: true and false, empty where there is none."""
    if isinstance(found, bool):
        return "true" if found else "false"
    if found is None or found != found:  # NaN
        return ""
    return found
