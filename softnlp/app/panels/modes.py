"""Natural frequencies and damping about the pose of the sliders, as `softnlp modes` finds them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from softnlp.app import controls
from softnlp.app.asking import Progress, sentence
from softnlp.app.parts import NumberTable, csv_text, study_row
from softnlp.app.session import Session
from softnlp.base.errors import InputError
from softnlp.results.modes import SHOWN, modes_rows
from softnlp.scenario.dynamic import modes_of
from softnlp.studies.modes import Modes


def modes_part(session: Session) -> None:
    """Build the button and the table in the current slot."""
    controls.heading("Natural frequencies")

    def asked() -> Callable[[Progress], Modes]:
        scenario = session.scenario
        if scenario is None or session.problem is not None:
            raise session.problem or InputError("expected a robot that can be made")
        here = replace(scenario, pressures=np.atleast_2d(session.pressure).copy())
        return lambda progress: modes_of(here)

    def done(modes: Modes) -> None:
        notes = " ".join(map(sentence, modes.warnings))
        if modes.found is None:
            row.warn(sentence(modes.message))
            return
        row.say(" ".join(["About the pose of the sliders, small motions.", notes]).strip())
        header, rows = modes_rows(modes.found, SHOWN)
        shown = ["no.", "f [Hz]", "damping", "kind", "tip moves x, y, z"]
        cells = [[*map(_number, row[:4]), ", ".join(f"{float(x):.2g}" for x in row[4:])] for row in rows]
        table.show(shown, cells, "modes.csv", csv=csv_text(header, rows))

    row = study_row("modes", "Find natural frequencies", asked, done)
    table = NumberTable("modes.table")


def _number(cell: str) -> str | float:
    try:
        return float(cell)
    except ValueError:
        return cell
