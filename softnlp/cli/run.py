"""`softnlp run`: a scenario file solved, its table printed, its results written."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from softnlp.base.errors import InputError
from softnlp.cli.console import SOLVED, SOME_UNSOLVED, STOPPED, complain, progress, say
from softnlp.cli.figures import draw
from softnlp.cli.folder import require_writable
from softnlp.model.contact_settings import ContactTask

if TYPE_CHECKING:
    from softnlp.scenario.read import Scenario
    from softnlp.statics.step import Run, Step

_COMMANDS: Mapping[str, str] = {
    "workspace": "sweep",
    "identify": "identify",
    "design": "design",
}
"""Studies whose result is no list of steps: which module of this package has the `run_study` that runs a scenario."""

_TABLE_WIDTH = 100
_SET_WIDTH = 12  # of what each chamber set beyond the third adds to the table


class _StopRun(Exception):
    """Ends a run between two steps."""


def run(
    scenario: Path, /, *, out: Path | None = None, json: bool = False, branches: int = 0, ipopt_log: bool = False
) -> int:
    """Solve every step of a scenario file in order, each started from the last.

    Prints a table and writes results.nc, table.csv, results.json, versions.json, figure.png and a copy of the scenario.
    The exit status is 0 when every step solved, 3 when some did not, 2 for bad input, 130 when stopped by Ctrl-C.

    Parameters
    ----------
    scenario
        TOML file; docs/scenario.md lists what it may hold.
    out
        Folder for the results; by default results/NAME, where NAME is that of the scenario file.
    json
        Print one JSON document and nothing else; no files are written unless --out is given.
    branches
        Of a blocked force only: start each step from so many other places as well, and warn where that finds another
        equilibrium. The result stays the one followed from zero pressure.
    ipopt_log
        Print the log of IPOPT on standard error.
    """
    from softnlp.results import json_text
    from softnlp.scenario.read import load_scenario

    asked = load_scenario(scenario)
    if ipopt_log:
        asked = _with_log(asked)
    _require_branches(asked, branches)
    if asked.study in _COMMANDS:
        return int(import_module(f"softnlp.cli.{_COMMANDS[asked.study]}").run_study(asked, out, json))
    folder = out if out is not None or json else Path("results") / scenario.stem
    if folder is not None:
        require_writable(folder)
    done, stopped = _solve(asked, branches)
    try:
        if folder is not None:
            _write(done, folder, asked)
    finally:  # the numbers are shown even where they cannot be written
        say(json_text(done).rstrip("\n") if json else _table(done))
    if folder is not None and not json:
        say(f"results in {folder}")
    if stopped:
        kept = "" if folder is None else f"; those are in {folder}"
        complain(f"stopped after {len(done.steps)} of {asked.step_count} steps{kept}")
        return STOPPED
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


def _solve(asked: Scenario, branches: int) -> tuple[Run, bool]:
    """Run a scenario with a progress bar; return the steps that were done and whether it was stopped before the end."""
    from softnlp.scenario.run import partial_run, solve_steps

    total = asked.step_count
    steps: list[Step] = []
    with progress(total, asked.title) as (advance, stop_asked):

        def keep(index: int, step: Step) -> None:
            steps.append(step)
            advance(len(steps))
            if stop_asked() and len(steps) < total:
                raise _StopRun

        try:
            return solve_steps(asked, keep, branches), False
        except _StopRun:
            return partial_run(asked, steps), True


def _write(done: Run, folder: Path, asked: Scenario) -> None:
    """Write results and figure."""
    from softnlp.figures import run_figure
    from softnlp.results import save, view_of_run

    save(done, folder, scenario_text=asked.text)
    draw({folder / "figure.png": lambda: run_figure(view_of_run(done))}, folder)


def _table(done: Run) -> str:
    """Return the table of a run as text, coloured on a terminal; never narrower than its numbers need."""
    from rich.console import Console
    from rich.text import Text

    from softnlp.results import table_lines

    console = Console(highlight=False)
    needed = _TABLE_WIDTH + _SET_WIDTH * max(0, done.robot.chamber_sets - 3)
    if not console.is_terminal or console.width < needed:
        console = Console(highlight=False, width=needed)
    with console.capture() as shown:
        heading = f"{done.title}: {done.robot.name}, {done.material.name} ({done.material.law.name})"
        console.print(Text(heading, "bold"))
        console.print(table_lines(done))
    return shown.get().rstrip("\n")
