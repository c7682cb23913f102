"""`softnlp design`: the best design of a scenario, with every candidate and why it is feasible or not."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

from softnlp.base.errors import InputError
from softnlp.cli.console import SOLVED, SOME_UNSOLVED, STOPPED, complain, progress, say
from softnlp.cli.figures import draw
from softnlp.cli.folder import require_writable

if TYPE_CHECKING:
    from softnlp.scenario.read import Scenario
    from softnlp.studies.design import Design
    from softnlp.studies.design_candidate import Candidate

_MANY = 24  # candidates from which other processes are worth their start
_TABLE_WIDTH = 110


class _StopDesign(Exception):
    """Ends a study between two candidates."""


def design(scenario: Path, /, *, out: Path | None = None, json: bool = False, workers: int | None = None) -> int:
    """Find the best design of a scenario of study "design".

    Prints a table and writes design.json, table.csv, best.toml (the best one as a scenario), figure.png, versions.json
    and a copy of the scenario. The exit status is 0 when a feasible design was found, 3 when none is, 2 for bad input,
    130 when stopped by Ctrl-C.

    Parameters
    ----------
    scenario
        TOML file; docs/design.md lists what it may hold.
    out
        Folder for the results; by default results/NAME, where NAME is that of the scenario file.
    json
        Print one JSON document and nothing else; no files are written unless --out is given.
    workers
        Processes; by default one for a few candidates, else one for each processor.
    """
    from softnlp.scenario.read import load_scenario

    asked = load_scenario(scenario)
    if asked.study != "design":
        raise InputError(
            f"expected 'design', got {asked.study!r}; use softnlp run", source=str(asked.path), key="study"
        )
    if workers is not None and workers < 1:
        raise InputError(f"expected a number of at least 1, got {workers}", key="--workers")
    return run_study(asked, out, json, workers)


def run_study(asked: Scenario, out: Path | None, json: bool, workers: int | None = None) -> int:
    """Run a scenario of study "design"; see `design`."""
    from softnlp.results.design import design_json

    folder = out if out is not None or json else Path("results") / asked.path.stem
    if folder is not None:
        require_writable(folder)
    done, stopped = _solve(asked, workers)
    try:
        if folder is not None:
            _write(done, folder, asked)
    finally:  # the numbers are shown even where they cannot be written
        say(design_json(done).rstrip("\n") if json else _table(done))
    if folder is not None and not json:
        say(f"results in {folder}")
    if stopped:
        kept = "" if folder is None else f"; those are in {folder}"
        complain(f"stopped after {len(done.candidates)} of {asked.step_count} candidates{kept}")
        return STOPPED
    return SOLVED if done.best is not None else SOME_UNSOLVED


def _solve(asked: Scenario, workers: int | None) -> tuple[Design, bool]:
    """Run the study with a progress bar; return it and whether it was stopped before the end."""
    from softnlp.scenario.run_design import finished_design, run_design

    total = asked.step_count
    done: list[Candidate] = []
    if workers is None:
        workers = (os.cpu_count() or 1) if total >= _MANY else 1
    with progress(total, asked.title) as (advance, stop_asked):

        def keep(count: int, candidate: Candidate) -> None:
            done.append(candidate)
            advance(count)
            if stop_asked() and count < total:
                raise _StopDesign

        try:
            return run_design(asked, keep, workers), False
        except _StopDesign:
            return finished_design(asked, done), True


def _write(done: Design, folder: Path, asked: Scenario) -> None:
    """Write the numbers, made before the first file is written so that an error leaves no half, and the figure."""
    from softnlp.figures.design import design_figure
    from softnlp.results.design import best_scenario, design_csv, design_json
    from softnlp.results.folder import write_files

    given = tomllib.loads(asked.text)
    if "file" in given["material"]:  # its path counted from the folder of the scenario
        given["material"]["file"] = str((asked.path.parent / given["material"]["file"]).resolve())
    texts = {"design.json": design_json(done), "table.csv": design_csv(done)}
    best = best_scenario(done, given)
    if best is not None:
        texts["best.toml"] = best
    else:  # one of an earlier run would not belong to these results
        (folder / "best.toml").unlink(missing_ok=True)
    write_files(folder, texts, asked.text)
    draw({folder / "figure.png": lambda: design_figure(done)}, folder)


def _table(done: Design) -> str:
    """Return the table of a design as text, coloured on a terminal."""
    from rich.console import Console
    from rich.text import Text

    from softnlp.results.design import design_lines

    console = Console(highlight=False)
    if not console.is_terminal or console.width < _TABLE_WIDTH:
        console = Console(highlight=False, width=_TABLE_WIDTH)
    with console.capture() as shown:
        console.print(Text(done.title, "bold"))
        console.print(design_lines(done))
    return shown.get().rstrip("\n")
