"""Everything that can do a task of this package, side by side in one run, as one table.

    python -m benchmarks [--out docs/benchmarks] [--only TASK ...] [--repeats N]

Writes table.md and table.json under --out, and nothing else. PyElastica and SoRoMoX come with
`pip install 'softnlp[bench]'`; what is not installed is a line that says so. One thread for NumPy's linear algebra.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before NumPy is there

import argparse
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from benchmarks import cantilever, machine, studies, studies_fitted, table
from benchmarks.race import Row, race
from benchmarks.studies import Task
from softnlp.cli.console import say


def slender_cantilever() -> Task:
    """All tools on the one task that all of them have."""
    exact = cantilever.truth(cantilever.cantilever())
    judge = partial(cantilever.tip_error, exact=exact)
    return Task("cantilever", "solve", "tip position, of the length", cantilever.entries(), judge)


TASKS: dict[str, Callable[[], Task]] = {
    "cantilever": slender_cantilever,
    "forward": lambda: studies.forward("no load"),
    "loaded": lambda: studies.forward("tip force and gravity"),
    "blocked": studies.blocked_force,
    "sweep": studies.workspace,
    "inverse": studies.inverse_kinematics,
    "identify": studies_fitted.identification,
    "design": studies_fitted.best_design,
}


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the tasks and write the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("docs/benchmarks"), help="folder of table.md and table.json")
    parser.add_argument("--only", nargs="+", choices=TASKS, default=list(TASKS), help="tasks; all by default")
    parser.add_argument("--repeats", type=int, default=5, help="solves of each that are timed, 5 by default")
    given = parser.parse_args(arguments)
    if given.repeats < 1:
        parser.error("--repeats: expected 1 or more")
    began = time.perf_counter()
    rows: list[Row] = []
    headings = {}
    for k, name in enumerate(given.only):
        say(f"[{k + 1} of {len(given.only)}, {time.perf_counter() - began:.0f} s] {name}: what is right")
        task = TASKS[name]()
        headings[task.name] = table.Heading(task.unit, task.error)
        told = partial(progress, began, k + 1, len(given.only))
        rows += race(task.name, task.entries, task.judge, repeats=given.repeats, say=told)
    seconds, described = time.perf_counter() - began, machine.described()
    given.out.mkdir(parents=True, exist_ok=True)
    page = table.markdown(rows, headings, described, seconds)
    (given.out / "table.md").write_text(page, encoding="utf-8")
    (given.out / "table.json").write_text(table.document(rows, headings, described, seconds), encoding="utf-8")
    say(f"\n{page}")


def progress(began: float, number: int, tasks: int, what: str) -> None:
    """Say what is being solved, after how long."""
    say(f"[{number} of {tasks}, {time.perf_counter() - began:.0f} s] {what}")


if __name__ == "__main__":
    main()
