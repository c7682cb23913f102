"""A run as CSV: one row a step, the unit in each column's name, empty cells where there is no solution."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from softnlp.base.files import write_whole
from softnlp.model.inputs import pressure_bar, tidy
from softnlp.model.robot import Robot
from softnlp.results.targets import INVERSE, TARGET_FIELDS, TargetField, target_values
from softnlp.statics.step import Run, Step
from softnlp.studies.fields import BLOCKED_FORCE, Field, closure_of, document_fields, left_by_weights, solved_pose


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
    targets = TARGET_FIELDS if run.study == INVERSE else ()
    header += ["status", *(name for t in targets for name in _columns(t, run.robot))]
    header += [*(name for f in document_fields(run) for name in _columns(f, run.robot))]
    header += ["closure"] * (run.study == BLOCKED_FORCE)
    header += ["_".join(["weighted_residual", *name.split(), unit.replace(" ", "")]) for name, unit in weighted.items()]
    header += ["residual", "message", "warnings"]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    for number, step in enumerate(run.steps, start=1):
        writer.writerow(list(_row(number, step, run, timed, list(weighted))))
    return text.getvalue()


def _columns(field: Field | TargetField, robot: Robot) -> list[str]:
    """Return the column names of a field: the index goes before the unit suffix, tip_x_mm for instance."""
    if not field.dims:
        return [field.name]
    stem, unit = field.name, ""
    if field.unit != "1":
        stem, _, unit = field.name.rpartition("_")
        unit = f"_{unit}"
    if field.dims == ("axis",):
        return [f"{stem}_{axis}{unit}" for axis in "xyz"]
    if field.dims == ("chamber",):
        return [f"{stem}_{n + 1}{unit}" for n in range(robot.chambers)]
    return [f"{field.name}_{row}{col}" for row in "xyz" for col in "xyz"]


def _row(number: int, step: Step, run: Run, timed: bool, weighted: list[str]) -> Iterator[Any]:
    pose = solved_pose(step)
    yield number
    if timed:
        yield "" if step.time is None else tidy(step.time)
    yield from pressure_bar(step.pressure)
    yield step.status.value
    for target, value in zip(TARGET_FIELDS, target_values(run, step).values(), strict=False):
        yield from ([""] * len(_columns(target, run.robot)) if value is None else map(_cell, np.ravel(value).tolist()))
    for field in document_fields(run):
        value = None if pose is None else field.of(step, pose)
        if value is None:
            yield from [""] * len(_columns(field, run.robot))
        else:
            yield from (_cell(v) for v in np.ravel(value).tolist())
    if run.study == BLOCKED_FORCE:
        yield closure_of(run, step) or ""
    left = {line.equation: line.value for line in left_by_weights(step)}
    yield from (_cell(left.get(equation)) for equation in weighted)
    yield _cell(step.residual)
    yield step.message
    yield "; ".join(step.warnings)


def _cell(value: Any) -> Any:
    """Return a number as CSV has it: true and false, empty where there is none."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if value is None or value != value:  # NaN
        return ""
    return value
