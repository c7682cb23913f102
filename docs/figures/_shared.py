"""What the scripts of this folder share: published numbers with their source, and tables as Markdown."""

from __future__ import annotations

import atexit
import csv
import io
import shlex
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import chdir, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from benchmarks.measured import ELONGATIONS, published
from docs.tools.pages import saved
from softnlp import BAR, load_scenario, run_scenario
from softnlp.cli import main
from softnlp.figures import run_figure
from softnlp.results import view_of_run

ROOT = Path(__file__).parents[2]
SCENARIOS = ROOT / "scenarios"


@dataclass(frozen=True)
class Simulated:
    """A published simulation of the six-chamber laparoscope robot: one set, Mooney-Rivlin; bar and degrees."""

    silicone: str
    pressure: float
    angle: float


PUBLISHED = tuple(
    Simulated(row["material"], row["pressure_bar"], row["bending_angle_deg"]) for row in published()["laparoscope"]
)
# Least and largest elongation of the robots of one length, three sets at 1.5 bar, Ecoflex 00-50 [mm]
MEASURED_ELONGATION = ELONGATIONS


def measured(file: str, column: str) -> list[tuple[str, list[float], float]]:
    """Return (robot, pressures [Pa], value) for each row of a shipped file that has a value."""
    with open(SCENARIOS / "files" / file, newline="") as opened:
        rows = list(csv.DictReader(opened))
    return [
        (row["robot"], [float(row[f"p{k}_bar"]) * BAR for k in (1, 2, 3)], float(row[column]))
        for row in rows
        if row[column]
    ]


def markdown(header: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Return a table; columns of numbers are set to the right."""
    cells = [[str(cell).replace("|", "\\|") for cell in row] for row in rows]
    numeric = [all(cell[:1] in "+-0123456789*" for cell in column if cell) for column in zip(*cells, strict=True)]
    align = ["--:" if is_number and k else "---" for k, is_number in enumerate(numeric)]
    return "\n".join("| " + " | ".join(line) + " |" for line in [header, align, *cells])


def figure_of(scenario: str, change: Callable[[Any], Any] = lambda asked: asked) -> Any:
    """Return the figure of a scenario's run."""
    return run_figure(view_of_run(run_scenario(change(load_scenario(SCENARIOS / scenario)))))


@dataclass(frozen=True)
class Done:
    """What commands printed, as a reader sees it, and the folder in which they ran."""

    block: str
    folder: Path


def command(*lines: str, files: Mapping[str, str] = MappingProxyType({})) -> Done:
    """Run commands as a person would at the top of the repository, beside files with these contents.

    Raises
    ------
    RuntimeError
        When a command does not end with status 0.
    """
    holder = tempfile.TemporaryDirectory()
    atexit.register(holder.cleanup)
    folder = Path(holder.name)
    (folder / "scenarios").symlink_to(SCENARIOS)
    for name, text in files.items():
        (folder / name).write_text(text)
    shown = []
    for line in lines:
        said = io.StringIO()
        with chdir(folder), redirect_stdout(said):
            status = main(shlex.split(line)[1:])
        if status:
            raise RuntimeError(f"{line}: status {status}")
        shown += [f"$ {line}", said.getvalue().rstrip()]
    return Done("\n".join(["```text", *shown, "```"]), folder)


def as_shown(*lines: str, drawn: str, page: str = "") -> tuple[Callable[[], str], Callable[[], Path]]:
    """Run commands and return `text` and `figure` of a script: what they print, and a file that they draw.

    page : whose files, as the reader saves them, the commands run.
    """
    done = command(*lines, files=saved(page) if page else {})
    return lambda: done.block, lambda: done.folder / drawn
