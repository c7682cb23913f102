"""[pressure] as the sequence part edits it, and what it draws of a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.reading import shown
from softnlp.base.units import BAR, DEGREE, MILLIMETRE
from softnlp.statics.step import Step

Array = NDArray[np.float64]

RAMP: Mapping[str, Any] = {"sets": [1], "to_bar": 1.5, "steps": 11}
MOST_TYPED = 200
"""Steps that are shown as text to be edited; more come from a file."""
QUANTITIES: Mapping[str, str] = {
    "bending": "Bending angle",
    "length": "Backbone length",
    "tip": "Tip position",
}
LABELS: Mapping[str, str] = {
    "bending": "bending angle [deg]",
    "length": "backbone length [mm]",
    "tip": "tip position [mm]",
}


def source_of(table: Mapping[str, Any]) -> str:
    """Return where the pressures come from: ramp, file or list."""
    return next((key for key in ("ramp", "file") if key in table), "list")


def rows_text(rows: Sequence[Sequence[float]]) -> str:
    """Return rows of pressures as a person edits them, a line a step."""
    return "\n".join(", ".join(f"{p:.12g}" for p in row) for row in rows)


def rows_of_text(text: str) -> list[list[float]]:
    """Return the rows of pressures [bar] that a person typed; commas, semicolons or blanks between the numbers.

    Raises
    ------
    InputError
        For what is not a number, with its line.
    """
    rows = []
    for number, words in enumerate(text.splitlines(), start=1):
        row = []
        for word in words.replace(",", " ").replace(";", " ").split():
            try:
                row.append(float(word))
            except ValueError:
                raise InputError(f"line {number}: expected pressures in bar, got {shown(word)}") from None
            if not np.isfinite(row[-1]) or "_" in word:
                raise InputError(f"line {number}: expected a finite number, got {shown(word)}")
        if row:
            rows.append(row)
    if not rows:
        raise InputError("expected a line of pressures in bar for each step")
    return rows


def series(steps: Sequence[Step]) -> dict[str, list[float]]:
    """Return what is drawn of steps by column label, nan where a step has no solution."""
    found: dict[str, list[float]] = {
        label: [] for label in ("bending angle [deg]", "backbone length [mm]", "tip x [mm]", "tip y [mm]", "tip z [mm]")
    }
    for step in steps:
        pose = step.pose if step.status.has_solution else None
        values = [float("nan")] * 5
        if pose is not None:
            values = [pose.bending_angle / DEGREE, pose.backbone_length / MILLIMETRE, *(pose.tip_position / MILLIMETRE)]
        for column, value in zip(found.values(), values, strict=True):
            column.append(float(value))
    return found


def against(steps: Sequence[Step], axis: str) -> tuple[list[float], str]:
    """Return the numbers and the label of the axis that steps are drawn along: pressure, or time or number."""
    if axis == "pressure":
        return [float(step.pressure.max()) / BAR for step in steps], "largest pressure [bar]"
    times = [step.time for step in steps]
    if all(time is not None for time in times) and times:
        return [float(time or 0.0) for time in times], "time [s]"
    return [float(k) for k in range(1, len(steps) + 1)], "step"
