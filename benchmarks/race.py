"""Timing several methods side by side: in turns, so that what else the machine does meets all alike."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from statistics import median
from typing import Any

HINT = "not installed: pip install 'softnlp[bench]'"
Solve = Callable[[], Any]
Judge = Callable[[Any], float]
Say = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Entry:
    """A method at one resolution.

    prepare : builds what is kept between solves and returns what solves once. module : what must be installed, if it
    is not the package's own. units : how many answers a solve gives; times are for one. once : nothing is kept between
    solves and one takes long, so the first is the only one. uncharged : seconds of all solves so far that the method is
    not to be charged with. judged : whether its answer is that of the others.
    """

    tool: str
    resolution: str
    prepare: Callable[[], Solve]
    module: str = ""
    reference: bool = False
    units: int = 1
    judged: bool = True
    once: bool = False
    note: str = ""
    uncharged: Callable[[], float] = field(default=lambda: 0.0)


@dataclass(frozen=True)
class Row:
    """A line of the table. seconds : median for one answer; first_seconds : everything built, and one solve.

    ratio : the time over that of the task's reference. error : of what the task says, None where there is none.
    """

    task: str
    tool: str
    resolution: str
    seconds: float | None = None
    first_seconds: float | None = None
    ratio: float | None = None
    error: float | None = None
    repeats: int = 0
    reference: bool = False
    note: str = ""


@dataclass(eq=False)
class _Runner:
    entry: Entry
    solve: Solve | None = None
    answer: Any = None
    first: float | None = None
    times: list[float] = field(default_factory=list)
    trouble: str = ""

    def start(self) -> None:
        """Build and solve once; a method that fails is a line that says so."""
        if self.entry.module and find_spec(self.entry.module) is None:
            self.trouble = HINT
            return
        began = time.perf_counter()
        try:
            self.solve = self.entry.prepare()
            self.again()
        except (ArithmeticError, RuntimeError, ValueError) as error:
            self.solve, self.trouble = None, f"failed: {str(error).splitlines()[0]}"
        self.first = time.perf_counter() - began
        if not self.entry.once:
            self.times.clear()

    def again(self) -> None:
        """Solve once more on the clock."""
        assert self.solve is not None
        free, began = self.entry.uncharged(), time.perf_counter()
        self.answer = self.solve()
        spent = time.perf_counter() - began - (self.entry.uncharged() - free)
        self.times.append(spent / self.entry.units)


def race(
    task: str, entries: Sequence[Entry], judge: Judge, *, repeats: int = 5, seconds: float = 6.0, say: Say = print
) -> list[Row]:
    """Time all entries of one task in turns; the first solve of each is not among its repeats.

    repeats : of each, fewer where they would take longer than `seconds` together, but at least one.
    """
    runners = []
    for entry in entries:
        say(f"{task}: {entry.tool}, {entry.resolution}")
        runners.append(_Runner(entry))
        runners[-1].start()
    running = [r for r in runners if r.solve is not None]
    for turn in range(repeats):
        for r in running:
            if not r.entry.once and (turn == 0 or sum(r.times) * r.entry.units * (turn + 1) / turn <= seconds):
                say(f"{task}: {r.entry.tool}, {r.entry.resolution}, {turn + 1} of {repeats}")
                r.again()
    reference = next((median(r.times) for r in running if r.entry.reference), None)
    return [_row(task, r, judge, reference) for r in runners]


def _row(task: str, r: _Runner, judge: Judge, reference: float | None) -> Row:
    entry = r.entry
    if r.solve is None:
        return Row(task, entry.tool, entry.resolution, first_seconds=r.first, note=r.trouble)
    seconds = median(r.times)
    return Row(
        task,
        entry.tool,
        entry.resolution,
        seconds=seconds,
        first_seconds=r.first,
        ratio=None if reference is None else seconds / reference,
        error=judge(r.answer) if entry.judged else None,
        repeats=len(r.times),
        reference=entry.reference,
        note=entry.note,
    )
