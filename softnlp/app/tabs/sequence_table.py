"""[pressure] as the sequence part edits it, and what it draws of a run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.columns import OUTPUTS, Output
from softnlp.base.errors import InputError
from softnlp.base.reading import shown
from softnlp.base.units import BAR
from softnlp.statics.step import Step
from softnlp.studies import fields

Array = NDArray[np.float64]

RAMP: Mapping[str, Any] = {"sets": [1], "to_bar": 1.5, "steps": 11}
MOST_TYPED = 200
"""Steps that are shown as text to be edited; more come from a file."""
QUANTITIES: Mapping[str, Output] = {
    "bending": OUTPUTS["bending_angle"],
    "length": OUTPUTS["backbone_length"],
    "tip": OUTPUTS["tip_position"],
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


def series(steps: Sequence[Step], quantities: Iterable[str] = tuple(QUANTITIES)) -> dict[str, list[float]]:
    """Return what is drawn of steps by column label, nan where a step has no solution."""
    found: dict[str, list[float]] = {}
    for output in (QUANTITIES[name] for name in quantities):
        labels = [output.axis] if not output.dims else [f"tip {x} [{output.unit}]" for x in "xyz"]
        values = fields.series(output, steps, {"axis": 3}).reshape(-1, len(labels))
        found |= dict(zip(labels, values.T.tolist(), strict=True))
    return found


def against(steps: Sequence[Step], axis: str) -> tuple[list[float], str]:
    """Return the numbers and the label of the axis that steps are drawn along: pressure, or time or number."""
    if axis == "pressure":
        return [float(step.pressure.max()) / BAR for step in steps], "largest pressure [bar]"
    times = [step.time for step in steps]
    if all(time is not None for time in times) and times:
        return [float(time or 0.0) for time in times], OUTPUTS["t"].axis
    return [float(k) for k in range(1, len(steps) + 1)], "step"
