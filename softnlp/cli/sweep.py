"""`softnlp sweep`: a workspace solved in parallel, kept as it goes, and continued where it was stopped."""

from __future__ import annotations

import json as json_module
import math
import shlex
import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softnlp.base.errors import InputError, reworded
from softnlp.base.processes import processors
from softnlp.base.units import MILLIMETRE
from softnlp.cli.console import SOLVED, SOME_UNSOLVED, STOPPED, complain, interrupt_asked, say
from softnlp.cli.study import AllErrors, Legend, beside, say_legend, scenario_at
from softnlp.model.gravity import gravity_lines
from softnlp.native.jit import can_compile, why_interpreted

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from softnlp.scenario.read import Scenario
    from softnlp.sweep.run import SweepProgress, SweepSummary

SLOWER = "10 to 20"
"""What poses that are solved together take without compiled code, of the time with it."""
COMPILING = f"building compiled code, under a second in each process; poses are then {SLOWER} times as fast"

_OPTIONS = {"resume=True": "--resume", "another folder leaves": "another --out leaves", "executor=": "--cluster"}
"""What `softnlp.run_sweep` advises, as options."""


def sweep(
    scenario: Path,
    /,
    *,
    out: Path | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    resume: bool = False,
    csv: bool = False,
    all_errors: AllErrors = False,
    legend: Legend = False,
) -> int:
    """Solve every pose of a workspace.

    Solved poses are kept in journal.sqlite as they come, so that nothing is lost when the sweep is stopped or killed:
    --resume continues it, with the same result. At the end workspace.nc holds every pose, and the last line printed is
    "N poses, F failed, S s, R poses/s". The exit status is 0 when every pose solved, 3 when some did not, 2 for bad
    input or where it cannot go on, 130 when stopped by Ctrl-C.

    Parameters
    ----------
    scenario
        TOML file of study "workspace"; docs/workspace.md lists what it may hold.
    out
        Folder for the journal and the results; by default results/NAME, where NAME is that of the scenario file.
    workers
        Processes that solve side by side; by default one for each processor.
    cluster
        Address of a Dask scheduler, such as tcp://10.0.0.5:8786, whose workers solve instead.
    resume
        Continue the sweep that has begun in that folder, if one has.
    csv
        Write workspace.csv as well.
    """
    if workers is not None and workers < 1:
        raise InputError(f"expected a number of at least 1, got {workers}", key="--workers")
    if workers is not None and cluster is not None:
        raise InputError("not together with --cluster, whose workers are its own", key="--workers")
    asked = scenario_at(scenario, all_errors)
    if asked.study != "workspace":
        raise InputError(f"expected a scenario of study 'workspace'; {asked.path} is of study {asked.study!r}")
    if legend:
        return say_legend(asked.study)
    folder = out or Path("results") / scenario.stem
    summary = _run(asked, folder, workers=workers or processors(), cluster=cluster, resume=resume, csv=csv)
    return _told(asked, folder, summary)


def run_study(asked: Scenario, out: Path | None, json: bool) -> int:
    """Run a scenario of study "workspace" for `softnlp run`; a sweep that has begun in the folder is continued."""
    if not json:
        folder = out or Path("results") / asked.path.stem
        return _told(asked, folder, _run(asked, folder))
    with ExitStack() as stack:
        folder = out or Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="softnlp-")))
        summary = _run(asked, folder)
        say(json_module.dumps(_document(asked, folder, summary, kept=out is not None), indent=2, allow_nan=False))
        return STOPPED if summary.stopped else _status(summary)


def _run(
    asked: Scenario,
    folder: Path,
    *,
    workers: int | None = None,
    cluster: str | None = None,
    resume: bool = True,
    csv: bool = False,
) -> SweepSummary:
    """Run a sweep with a progress bar, and write what goes beside its result."""
    from softnlp.results import write_whole
    from softnlp.scenario.workspace import run_sweep
    from softnlp.sweep.pool import cluster_executor

    together = asked.numerics.engine != "ipopt" and asked.numerics.transcription == "multiple-shooting"
    if together and cluster is None and (why := why_interpreted()):
        complain(f"warning: no compiled code ({why}): the same numbers, some {SLOWER} times slower")
    with ExitStack() as stack:
        executor: Executor | None = None if cluster is None else stack.enter_context(cluster_executor(cluster))
        bar = stack.enter_context(
            _Bar(asked.title, COMPILING if together and cluster is None and can_compile() else "")
        )
        stop = stack.enter_context(interrupt_asked(bar.stopping))
        stack.enter_context(reworded(_OPTIONS))
        summary = run_sweep(
            asked,
            folder,
            executor=executor,
            workers=workers or processors(),
            resume=resume,
            progress=bar.show,
            stop=stop,
            csv=csv,
        )
    for name, text in beside(asked).items():  # of a sweep that was finished already only what is missing
        if not summary.stopped and (summary.written or not (folder / name).exists()):
            write_whole(folder / name, text.encode())
    return summary


def _told(asked: Scenario, folder: Path, summary: SweepSummary) -> int:
    """Print what a sweep came to; return the exit status."""
    model = f"{asked.robot.name}, {asked.material.name} ({asked.material.law.name})"
    held = gravity_lines(asked.loads.gravity)
    warnings = (f"warning: {w}" for w in (*asked.warnings, *summary.notes))
    say("\n".join([f"{asked.title}: {model}", *held, *warnings]))
    if summary.already and summary.already == summary.poses and not summary.written:
        say("this sweep was finished already; nothing was rewritten")
    elif summary.already:
        say(f"{summary.already} of {summary.poses} poses were there already")
    unsolved = {status: n for status, n in summary.statuses.items() if status != "solved"}
    if unsolved:
        say("ended otherwise than solved: " + ", ".join(f"{n} {status}" for status, n in unsolved.items()))
    if summary.self_intersecting:
        say(f"warning: {summary.self_intersecting} of the poses pass through themselves, which no body can")
    if summary.audit.audited:
        away = f"{summary.audit.largest / MILLIMETRE:.2g} mm"
        say(f"{summary.audit.audited} poses audited by IPOPT, whose tips are at most {away} away")
    if summary.audit.disputed:
        told = ", ".join(str(number) for number in summary.audit.disputed[:10])
        more = len(summary.audit.disputed) - 10
        told += f" and {more} more" if more > 0 else ""
        say(f"warning: IPOPT does not confirm the audited poses {told}; look at them with the engine 'ipopt'")
    if summary.stopped:
        again = shlex.join(["softnlp", "sweep", str(asked.path), "--out", str(folder), "--resume"])
        complain(f"stopped after {summary.done} of {summary.poses} poses, which are kept; `{again}` continues")
    else:
        say(f"results in {folder}; `softnlp workspace {folder}` draws and measures them")
    say(f"{summary.done} poses, {summary.failed} failed, {summary.seconds:.2f} s, {summary.rate:.0f} poses/s")
    return STOPPED if summary.stopped else _status(summary)


def _status(summary: SweepSummary) -> int:
    return SOME_UNSOLVED if summary.failed or summary.audit.disputed else SOLVED


def _document(asked: Scenario, folder: Path, summary: SweepSummary, *, kept: bool) -> dict[str, Any]:
    """Return the JSON document of a sweep."""
    from softnlp import __version__
    from softnlp.sweep.run import WORKSPACE_FILE

    return {
        "softnlp": __version__,
        "title": asked.title,
        "study": asked.study,
        "conventions": asked.conventions.name,
        "poses": summary.poses,
        "done": summary.done,
        "failed": summary.failed,
        "already": summary.already,
        "statuses": dict(summary.statuses),
        "self_intersecting": summary.self_intersecting,
        "audited": summary.audit.audited,
        "audit_largest_mm": summary.audit.largest / MILLIMETRE if math.isfinite(summary.audit.largest) else None,
        "audit_disputed": list(summary.audit.disputed),
        "seconds": summary.seconds,
        "poses_per_s": summary.rate,
        "file": str(folder / WORKSPACE_FILE) if kept and not summary.stopped else None,
        "warnings": list(asked.warnings),
    }


class _Bar(ExitStack):
    """A progress bar on a terminal, which begins with the first news: no thread may run when processes are forked."""

    def __init__(self, title: str, first: str = "") -> None:
        """Take the title, and what is said until the first poses are there."""
        super().__init__()
        self._first = first
        self._title = title
        self._shown: Any = None
        self._task: Any = None
        self._note = ""

    def show(self, news: SweepProgress) -> None:
        """Show how far the sweep is."""
        if not sys.stderr.isatty():
            return
        if self._shown is None:
            self._shown = self.enter_context(self._begun())
            self._task = self._shown.add_task("", total=news.poses, completed=news.already, failed="", rate="")
        rate = (news.done - news.already) / news.seconds if news.seconds > 0 else 0.0
        self._shown.update(
            self._task,
            completed=news.done,
            failed=f"{news.failed} failed" if news.failed else "",
            rate=f"{rate:.0f} poses/s",
            description=self._note or (self._first if news.done == news.already < news.poses else ""),
        )

    def stopping(self, _: str) -> None:
        """Say that the sweep will stop."""
        self._note = "stopping (Ctrl-C again: at once)"
        if self._shown is not None:
            self._shown.update(self._task, description=self._note)

    def _begun(self) -> Any:
        from rich import progress as rich
        from rich.console import Console
        from rich.text import Text

        columns = (
            rich.RenderableColumn(Text(self._title)),
            rich.BarColumn(),
            rich.MofNCompleteColumn(),
            rich.TextColumn("{task.fields[rate]}"),
            rich.TimeRemainingColumn(),
            rich.TextColumn("[red]{task.fields[failed]}"),
            rich.TextColumn("{task.description}"),
        )
        return rich.Progress(*columns, console=Console(stderr=True), transient=True)
