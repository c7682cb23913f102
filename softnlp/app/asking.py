"""What a tab asks of a study: the scenario on the screen with some tables of its own, run step by step."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from softnlp.app.document import Document
from softnlp.app.job import Progress, Stopped
from softnlp.app.session import Session
from softnlp.base.errors import InputError
from softnlp.base.units import BAR
from softnlp.scenario.read import Scenario, scenario_from_text
from softnlp.scenario.run import partial_run, solve_steps
from softnlp.statics.step import Run, Step

MOST_STEPS = 10_000
"""Of a run on the page, which keeps every shape in memory; `softnlp run` takes more."""

Tables = Mapping[str, Mapping[str, Any] | None]


def scenario_with(session: Session, study: str, tables: Tables | None = None) -> Scenario:
    """Return the scenario of a study as the document has it, with whole tables replaced (None: left out).

    Raises
    ------
    InputError
        Where it cannot be run.
    """
    document = Document(session.document.text(study))
    document.study = study
    for name, values in (tables or {}).items():
        document.replace(name, values)
    return scenario_from_text(document.text(study), session.folder / session.name)


def run_steps(asked: Scenario, progress: Progress, on_step: Callable[[Step], None] = lambda step: None) -> Run:
    """Run a scenario; where a person stops it, the run has the steps done by then and says so.

    on_step : called with each step as it is done, in the thread of the work.

    Raises
    ------
    InputError
        For more steps than the page takes, and as `softnlp.run_scenario`.
    """
    if asked.step_count > MOST_STEPS:
        raise InputError(
            f"{asked.step_count} steps are too many for this page, which runs {MOST_STEPS}; save the scenario and use "
            "softnlp run"
        )
    steps: list[Step] = []

    def done(number: int, step: Step) -> None:
        steps.append(step)
        on_step(step)
        if len(steps) < asked.step_count:
            progress(len(steps), asked.step_count, f"{len(steps)} of {asked.step_count} steps")

    try:
        return solve_steps(asked, done)
    except Stopped:
        return partial_run(asked, steps)


def said(run: Run) -> str:
    """Return what a run came to, in words."""
    words = f"{len(run.steps) - len(run.failed)} of {len(run.steps)} steps solved."
    if run.failed:
        words += f" First failed: {run.failed[0].message}."
    stopped = [note for note in run.warnings if note.startswith("stopped")]
    return " ".join([words, *(f"{note[0].upper()}{note[1:]}." for note in stopped)])


def step_rows(run: Run, columns: Mapping[str, Sequence[float]]) -> tuple[list[str], list[list[Any]]]:
    """Return header and rows of a table of steps: number, pressures, some columns by their label, how it ended."""
    header = ["step", *(f"p{k + 1} [bar]" for k in range(run.robot.chamber_sets)), *columns, "status"]
    header += ["message"] * bool(run.failed)
    rows = []
    for k, step in enumerate(run.steps):
        words = ["" if step.status.has_solution else step.message] * bool(run.failed)
        bars = [float(p) / BAR for p in step.pressure]
        rows.append([k + 1, *bars, *(values[k] for values in columns.values()), str(step.status), *words])
    return header, rows


def failures(run: Run) -> list[bool]:
    """Return which steps carry no solution."""
    return [not step.status.has_solution for step in run.steps]
