"""The pressures of a path for a regulator: a CSV file that a scenario's [pressure] reads too."""

from __future__ import annotations

from softnlp.base.columns import OUTPUTS
from softnlp.model.inputs import pressure_bar, tidy
from softnlp.results.document import csv_text
from softnlp.statics.step import Run

PATH_FILE = "path.csv"


def path_text(run: Run) -> str:
    """Return time and pressures of every step, those of targets that are not met too."""
    header = [OUTPUTS["t"].key, *(f"p{k + 1}_bar" for k in range(run.robot.chamber_sets))]
    rows = [[None if step.time is None else tidy(step.time), *pressure_bar(step.pressure)] for step in run.steps]
    return csv_text(header, rows)
