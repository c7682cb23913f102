"""`softnlp design`: the best design of a scenario, with every candidate and why it is feasible or not."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

from softnlp.base.errors import InputError
from softnlp.cli.console import SOLVED, SOME_UNSOLVED, rich_text, say
from softnlp.cli.report import Report, write_report
from softnlp.cli.study import (
    AllErrors,
    Json,
    Legend,
    Out,
    require_file,
    results_folder,
    say_legend,
    scenario_for,
    show,
    stepwise,
    stopped_after,
    write_results,
)

if TYPE_CHECKING:
    from softnlp.scenario.read import Scenario
    from softnlp.studies.design import Design

_MANY = 24  # candidates from which other processes are worth their start
_TABLE_WIDTH = 110


def design(
    scenario: Path,
    /,
    *,
    out: Out = None,
    json: Json = False,
    workers: int | None = None,
    report: Report = None,
    all_errors: AllErrors = False,
    legend: Legend = False,
) -> int:
    """Find the best design of a scenario of study "design".

    Prints a table and writes design.json, table.csv, best.toml (the best one as a scenario), figure.png, versions.json
    and a copy of the scenario. The exit status is 0 when a feasible design was found, 3 when none is, 2 for bad input,
    130 when stopped by Ctrl-C.

    Parameters
    ----------
    scenario
        TOML file; docs/design.md lists what it may hold.
    workers
        Processes; by default one for a few candidates, else one for each processor.
    """
    asked = scenario_for(scenario, "design", "expected 'design', got {}; use softnlp run", all_errors)
    if workers is not None and workers < 1:
        raise InputError(f"expected a number of at least 1, got {workers}", key="--workers")
    return say_legend(asked.study) if legend else run_study(asked, out, json, report, workers)


def run_study(
    asked: Scenario, out: Path | None, json: bool, report: Path | None = None, workers: int | None = None
) -> int:
    """Run a scenario of study "design"; see `design`."""
    from softnlp.results.design import design_json, design_lines
    from softnlp.scenario.design import finished_design, run_design

    folder = results_folder(out, json, asked.path.stem)
    if report is not None:
        require_file(report)
    total = asked.step_count
    if workers is None:
        workers = (os.cpu_count() or 1) if total >= _MANY else 1
    candidates, whole = stepwise(asked, total, lambda keep: run_design(asked, keep, workers))
    done = finished_design(asked, candidates) if whole is None else whole

    def table() -> None:
        say(rich_text(done.title, design_lines(done), _TABLE_WIDTH))

    show(folder, json, lambda to: _write(done, to, asked), lambda: design_json(done), table)
    if report is not None:
        from softnlp.figures.design import design_figure

        write_report(report, asked, design_json(done), {"Candidates": lambda: design_figure(done)}, quiet=json)
    if whole is None:
        return stopped_after(len(candidates), total, "candidates", folder)
    return SOLVED if done.best is not None else SOME_UNSOLVED


def _write(done: Design, folder: Path, asked: Scenario) -> None:
    """Write the numbers, made before the first file is written so that an error leaves no half, and the figure."""
    from softnlp.figures.design import design_figure
    from softnlp.results.design import design_csv, design_json

    texts = {"design.json": design_json(done), "table.csv": design_csv(done)}
    best = best_text(done, asked)
    if best is not None:
        texts["best.toml"] = best
    else:  # one of an earlier run would not belong to these results
        (folder / "best.toml").unlink(missing_ok=True)
    write_results(folder, asked, texts, {"figure": lambda: design_figure(done)})


def best_text(done: Design, asked: Scenario) -> str | None:
    """Return the best candidate as the text of a scenario, None where nothing is feasible."""
    from softnlp.results.design import best_scenario

    given = tomllib.loads(asked.text)
    if "file" in given["material"]:  # its path counted from the folder of the scenario
        given["material"]["file"] = str((asked.path.parent / given["material"]["file"]).resolve())
    return best_scenario(done, given)
