"""`softnlp run`: a scenario file solved, its table printed, its results written."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from softnlp.base.errors import InputError
from softnlp.cli.console import SOLVED, SOME_UNSOLVED, rich_text, say
from softnlp.cli.figures import draw
from softnlp.cli.report import Report, write_report
from softnlp.cli.study import (
    AllErrors,
    Json,
    Legend,
    Out,
    require_file,
    results_folder,
    say_legend,
    scenario_at,
    show,
    stepwise,
    stopped_after,
)
from softnlp.model.contact_settings import ContactTask

if TYPE_CHECKING:
    from softnlp.scenario.read import Scenario
    from softnlp.statics.step import Run

_COMMANDS: Mapping[str, str] = {
    "workspace": "sweep",
    "identify": "identify",
    "design": "design",
}
"""Studies whose result is no list of steps: which module of this package has the `run_study` that runs a scenario."""

_TABLE_WIDTH = 100
_SET_WIDTH = 12  # of what each chamber set beyond the third adds to the table
_DEVIATION_WIDTH = 45  # of standard deviations beside the numbers


def run(
    scenario: Path,
    /,
    *,
    out: Out = None,
    json: Json = False,
    branches: int = 0,
    ipopt_log: bool = False,
    report: Report = None,
    all_errors: AllErrors = False,
    legend: Legend = False,
) -> int:
    """Solve every step of a scenario file in order, each started from the last.

    Prints a table and writes results.nc, table.csv, results.json, versions.json, figure.png and a copy of the scenario.
    The exit status is 0 when every step solved, 3 when some did not, 2 for bad input, 130 when stopped by Ctrl-C.

    Parameters
    ----------
    scenario
        TOML file; docs/scenario.md lists what it may hold.
    branches
        Of a blocked force only: start each step from so many other places as well, and warn where that finds another
        equilibrium. The result stays the one followed from zero pressure.
    ipopt_log
        Print the log of IPOPT on standard error.
    """
    asked = scenario_at(scenario, all_errors)
    if legend:
        return say_legend(asked.study)
    if ipopt_log:
        asked = _with_log(asked)
    _require_branches(asked, branches)
    if asked.study in _COMMANDS:
        study = import_module(f"softnlp.cli.{_COMMANDS[asked.study]}").run_study
        if asked.study == "workspace":
            if report is not None:
                raise InputError("expected only for studies other than 'workspace'", key="--report")
            return int(study(asked, out, json))
        return int(study(asked, out, json, report))
    return run_steps(asked, out, json, branches, report)


def run_steps(asked: Scenario, out: Path | None, json: bool, branches: int = 0, report: Path | None = None) -> int:
    """Run a scenario whose study is a list of steps; see `run`."""
    from softnlp.results import json_text
    from softnlp.scenario.run import partial_run, solve_steps

    folder = results_folder(out, json, asked.path.stem)
    if report is not None:
        require_file(report)
    steps, whole = stepwise(asked, asked.step_count, lambda keep: solve_steps(asked, keep, branches))
    done = partial_run(asked, steps) if whole is None else whole
    show(folder, json, lambda to: _write(done, to, asked), lambda: json_text(done), lambda: say(_table(done)))
    if report is not None:
        from softnlp.figures import run_figure
        from softnlp.results import view_of_run

        write_report(report, asked, json_text(done), {"Shapes": lambda: run_figure(view_of_run(done))}, quiet=json)
    if whole is None:
        return stopped_after(len(steps), asked.step_count, "steps", folder)
    return SOME_UNSOLVED if done.failed else SOLVED


def _with_log(asked: Scenario) -> Scenario:
    """Let IPOPT print its log. Raises `InputError` where it takes no part."""
    if asked.numerics.engine == "newton":
        raise InputError("IPOPT takes no part that a log shows here", key="--ipopt-log")
    told = {"print_level": 5, **dict(asked.numerics.ipopt)}
    return replace(asked, numerics=replace(asked.numerics, ipopt=told))


def _require_branches(asked: Scenario, branches: int) -> None:
    """Refuse --branches where it means nothing."""
    if branches < 0:
        raise InputError(f"expected a number of at least 0, got {branches}", key="--branches")
    if not branches:
        return
    task = asked.task
    if asked.study != "blocked-force":
        raise InputError(
            f"expected only for study 'blocked-force'; {asked.path} is of study {asked.study!r}", key="--branches"
        )
    if task != ContactTask():
        raise InputError(
            "expected only for the force at each pressure, not with offsets_mm, offset_ramp, target_force_N or "
            f"mode = 'constrained' as in {asked.path}",
            key="--branches",
        )


def _write(done: Run, folder: Path, asked: Scenario) -> None:
    """Write results and figure."""
    from softnlp.figures import run_figure
    from softnlp.results import save, view_of_run

    save(done, folder, scenario_text=asked.text)
    draw({folder / "figure.png": lambda: run_figure(view_of_run(done))}, folder)


def _table(done: Run) -> str:
    """Return the table of a run as text; never narrower than its numbers need."""
    from softnlp.results import table_lines

    more = _DEVIATION_WIDTH if done.uncertainty else 0
    heading = f"{done.title}: {done.robot.name}, {done.material.name} ({done.material.law.name})"
    return rich_text(heading, table_lines(done), _TABLE_WIDTH + _SET_WIDTH * max(0, done.robot.chamber_sets - 3) + more)
