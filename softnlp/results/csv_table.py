"""A run as CSV: one row a step, the unit in each column's name, empty cells where there is no solution."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from softnlp.results.fields import DOCUMENT_FIELDS, Field, solved_pose
from softnlp.results.files import write_whole
from softnlp.results.inputs import pressure_bar, tidy
from softnlp.robot import Robot
from softnlp.studies.step import Run, Step


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
    header = ["step"] + ["t_s"] * timed
    header += [f"p{k + 1}_bar" for k in range(run.robot.chamber_sets)]
    header += ["status", *(name for f in DOCUMENT_FIELDS for name in _columns(f, run.robot))]
    header += ["residual", "message", "warnings"]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(list(_row(k, step, run.robot, timed)) for k, step in enumerate(run.steps, start=1))
    return text.getvalue()


def _columns(field: Field, robot: Robot) -> list[str]:
    """Return the column names of a field: the index goes before the unit suffix, tip_x_mm for instance."""
    if not field.dims:
        return [field.name]
    stem, _, unit = field.name.rpartition("_")
    if field.dims == ("axis",):
        return [f"{stem}_{axis}_{unit}" for axis in "xyz"]
    if field.dims == ("chamber",):
        return [f"{stem}_{n + 1}_{unit}" for n in range(robot.chambers)]
    return [f"{field.name}_{row}{col}" for row in "xyz" for col in "xyz"]


def _row(number: int, step: Step, robot: Robot, timed: bool) -> Iterator[Any]:
    pose = solved_pose(step)
    yield number
    if timed:
        yield "" if step.time is None else tidy(step.time)
    yield from pressure_bar(step.pressure)
    yield step.status.value
    for field in DOCUMENT_FIELDS:
        if pose is None:
            yield from [""] * len(_columns(field, robot))
        else:
            yield from (_cell(v) for v in np.ravel(field.of(step, pose)).tolist())
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
