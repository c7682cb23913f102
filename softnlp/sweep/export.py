"""A sweep as CSV: one row a pose, a few thousand poses in memory at a time."""

from __future__ import annotations

import csv
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from softnlp.base.files import placed_whole
from softnlp.sweep.read import STATUSES, Workspace, column_names, read_block

_BLOCK = 16_384


def export_csv(workspace: Workspace, path: str | PathLike[str]) -> Path:
    """Write every number of every pose, with status, under its name in the file; empty where there is none.

    Raises
    ------
    InputError
        When the file cannot be written.
    """
    names = column_names(workspace)
    words = np.array([status.value for status in STATUSES], dtype=object)
    with placed_whole(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["pose", "status", *names])
        for start in range(0, workspace.poses, _BLOCK):
            rows = slice(start, min(start + _BLOCK, workspace.poses))
            cells: list[list[Any]] = [
                list(range(rows.start + 1, rows.stop + 1)),
                words[workspace.status[rows]].tolist(),
            ]
            cells += [_cells(column) for column in read_block(workspace, names, rows)]
            table.writerows(zip(*cells, strict=True))
    return Path(path)


def _cells(values: Any) -> list[Any]:
    """Return numbers as CSV has them: rounded to 12 digits, empty for NaN."""
    if values.dtype.kind != "f":
        return list(values.tolist())
    return ["" if value != value else float(f"{value:.12g}") for value in values.tolist()]
