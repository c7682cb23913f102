"""What a tab asks of a study: the scenario on the screen with some tables of its own, run step by step."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from threading import Event
from time import perf_counter
from typing import Any

from softnlp.app.document import Document
from softnlp.app.session import Session
from softnlp.base.errors import InputError
from softnlp.base.units import BAR
from softnlp.scenario.read import Scenario, scenario_from_text
from softnlp.scenario.run import partial_run, solve_steps
from softnlp.statics.step import Run, Step

MOST_STEPS = 10_000
"""Of a run on the page, which keeps every shape in memory; `softnlp run` takes more."""

Tables = Mapping[str, Mapping[str, Any] | None]


class Stopped(Exception):
    """A person stopped the work."""


class Progress:
    """How far work is; the work calls it between two steps, the page reads `fraction` and `text`."""

    def __init__(self) -> None:
        self.fraction = 0.0
        self.text = ""
        self._stop = Event()
        self._began = perf_counter()

    def __call__(self, done: float, total: float, text: str = "") -> None:
        """Note how far the work is.

        Raises
        ------
        Stopped
            Where a person wants it to end.
        """
        if self._stop.is_set():
            raise Stopped
        self.fraction = min(1.0, done / total) if total else 0.0
        self.text = text

    def words(self) -> str:
        """Return how far the work is, with the part that is done and how long the rest takes at the same pace."""
        if not 0 < self.fraction < 1:
            return self.text
        left = (perf_counter() - self._began) * (1 - self.fraction) / self.fraction
        part = f"{100 * self.fraction:.0f} %, about {duration(left)} left"
        return f"{self.text}, {part}" if self.text else part.capitalize()

    @property
    def stopping(self) -> bool:
        """Whether a person wants the work to end."""
        return self._stop.is_set()

    def stop(self) -> None:
        """Ask the work to end at its next step."""
        self._stop.set()


def duration(seconds: float) -> str:
    """Return a time in words, as a person would say it."""
    if seconds < 1:
        return "1 s"
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"


def scenario_with(session: Session, study: str, tables: Tables | None = None) -> Scenario:
    """Return the scenario of a study as the document has it, with whole tables replaced (None: left out), for a run.

    The study on the screen becomes that of the file.

    Raises
    ------
    InputError
        Where it cannot be run.
    """
    document = Document(session.document.text(study))
    document.study = study
    for name, values in (tables or {}).items():
        document.replace(name, values)
    asked = scenario_from_text(document.text(study), session.folder / session.name)
    if study == session.document.study:
        first = not session.is_used(study)
        session.use()
        if first:
            session.reread()  # what is said of a study that nobody asked goes
    return asked


def few_enough(asked: Scenario, most: int, what: str, command: str, table: str | None = None) -> None:
    """Raise `InputError` for a scenario of more steps or poses than a page should wait for."""
    count = asked.step_count
    if count > most:
        words = f"{count} {what} are too many for this page, which runs {most}; save the scenario and use {command}"
        raise InputError(words, table=table)


def run_steps(asked: Scenario, progress: Progress, on_step: Callable[[Step], None] = lambda step: None) -> Run:
    """Run a scenario; where a person stops it, the run has the steps done by then and says so.

    on_step : called with each step as it is done, in the thread of the work.

    Raises
    ------
    InputError
        For more steps than the page takes, and as `softnlp.run_scenario`.
    """
    few_enough(asked, MOST_STEPS, "steps", "softnlp run")
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
    return " ".join([words, *map(sentence, stopped)])


def sentence(words: str) -> str:
    """Return words as a sentence."""
    return f"{words[:1].upper()}{words[1:]}."


def rows_bar(pressures: Iterable[Any]) -> list[list[float]]:
    """Return rows of pressures [Pa] as a file has them [bar]."""
    return [[float(f"{p / BAR:.12g}") for p in row] for row in pressures]


def bars(pressure: Iterable[float], digits: int = 4) -> str:
    """Return pressures [Pa] in words, in bar."""
    return ", ".join(f"{p / BAR:.{digits}g}" for p in pressure)
