"""Running a sweep: chunks to whoever solves them, solved poses to the journal, and the result file at the end."""

from __future__ import annotations

import json
import time
from collections import deque
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from contextlib import AbstractContextManager
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from softnlp import __version__
from softnlp.base.errors import SoftnlpError
from softnlp.base.files import make_folder
from softnlp.base.processes import require_workers
from softnlp.base.reading import one_line
from softnlp.base.units import BAR
from softnlp.batch.chunk import ChunkSolver
from softnlp.batch.plan import Plan
from softnlp.batch.poses import STATUSES, Block
from softnlp.model.inputs import package_version
from softnlp.sweep.audit import Audit, audit
from softnlp.sweep.dataset import fingerprint_of, write_csv, write_workspace
from softnlp.sweep.journal import Journal
from softnlp.sweep.pool import Crew, executor_crew, process_crew

JOURNAL_FILE = "journal.sqlite"
WORKSPACE_FILE = "workspace.nc"
CSV_FILE = "workspace.csv"

_FEW_CHUNKS = 2  # are solved here: a pool of processes would take longer to start
_MOST_DEATHS = 3
_KEPT = "what was solved is kept, and resume=True goes on from there"
_PATIENCE = 0.1  # [s] between two looks at whether to stop


class SweepError(SoftnlpError):
    """A sweep cannot go on; what was solved is in its journal."""


@dataclass(frozen=True)
class SweepProgress:
    """How far a sweep is: poses confirmed and of those failed, of all; those that were there before; [s] since."""

    done: int
    failed: int
    poses: int
    already: int
    seconds: float


@dataclass(frozen=True)
class SweepSummary:
    """What a sweep came to.

    Attributes
    ----------
    poses
        Of the plan.
    done, failed
        Confirmed, and of those without a solution.
    already
        That were there before.
    statuses
        Confirmed poses by how they ended.
    self_intersecting
        Confirmed poses that pass through themselves.
    seconds
        Of all of this run [s].
    stopped
        Before the end, when asked.
    written
        The files that this run wrote.
    notes
        Versions of other packages with which some of the poses were solved before.
    audit
        What IPOPT said of a sample, at the end of the run that wrote the result.
    """

    poses: int
    done: int
    failed: int
    already: int
    statuses: Mapping[str, int]
    self_intersecting: int
    seconds: float
    stopped: bool
    written: tuple[Path, ...]
    notes: tuple[str, ...]
    audit: Audit

    @property
    def rate(self) -> float:
        """Poses solved a second [1]."""
        return (self.done - self.already) / self.seconds if self.seconds > 0 else 0.0


Report = Callable[[SweepProgress], None]
Stop = Callable[[], bool]
_Tell = Callable[[], None]


def sweep(
    plan: Plan,
    folder: str | PathLike[str],
    about: Mapping[str, str],
    *,
    executor: Executor | None = None,
    workers: int = 1,
    resume: bool = False,
    progress: Report | None = None,
    stop: Stop | None = None,
    csv: bool = False,
) -> SweepSummary:
    """Solve every pose of a plan; as `softnlp.run_sweep`. about : attributes of the result file."""
    require_workers(workers)
    told: dict[str, Any] = dict(about)
    began = time.monotonic()
    folder = make_folder(folder)
    result, table = folder / WORKSPACE_FILE, folder / CSV_FILE
    versions = {package: package_version(package) for package in ("casadi", "numpy")}
    with Journal(folder / JOURNAL_FILE, plan, __version__, resume=resume, versions=versions) as journal:
        already = journal.poses
        if journal.earlier:
            told["versions_before"] = json.dumps(journal.earlier)
        notes = tuple(
            f"the sweep was begun with {package} {before[package]} and goes on with {now}"
            for before in journal.earlier
            for package, now in versions.items()
            if before.get(package, now) != now
        )

        def report() -> None:
            if progress is not None:
                seconds = time.monotonic() - began
                progress(SweepProgress(journal.poses, journal.failed, plan.poses, already, seconds))

        def summary(stopped: bool, *written: Path) -> SweepSummary:
            seconds = time.monotonic() - began
            counts = {status.value: int(n) for status, n in zip(STATUSES, journal.counts, strict=True) if n}
            poses, failed = journal.poses, journal.failed
            through = journal.self_intersecting
            return SweepSummary(
                plan.poses, poses, failed, already, counts, through, seconds, stopped, written, notes, sample
            )

        todo = [int(chunk) for chunk in np.flatnonzero(~journal.done)]
        sample = Audit()
        finished = not todo and fingerprint_of(result) == plan.fingerprint()
        if not finished:
            stopped = _solve(plan, todo, journal, executor, workers, report, stop or _never)
            journal.commit()
            report()
            if stopped and not journal.done.all():
                return summary(True)
            for left in folder.glob(f".{WORKSPACE_FILE[:-3]}.*.part"):  # of a process that was killed while writing
                left.unlink(missing_ok=True)
            audited = audit(plan, journal, stop)
            if audited is None:
                return summary(True)
            sample = audited
        written = [] if finished else [write_workspace(result, plan, journal, told | sample.attributes)]
        if (csv and not table.exists()) or (written and table.exists()):
            written.append(write_csv(table, plan, journal))
        return summary(False, *written)


def _never() -> bool:
    return False


def _solve(
    plan: Plan, todo: list[int], journal: Journal, executor: Executor | None, workers: int, report: _Tell, stop: Stop
) -> bool:
    """Solve chunks into the journal; return whether it was stopped before the end."""
    if executor is None and (workers <= 1 or len(todo) <= _FEW_CHUNKS):
        return _solve_here(plan, todo, journal, report, stop)
    fingerprint = plan.fingerprint()
    crew: AbstractContextManager[Crew] = (
        process_crew(plan, fingerprint, min(workers, len(todo)))
        if executor is None
        else executor_crew(executor, plan, fingerprint)
    )
    with crew as started:
        return _Foreman(plan, started, journal, todo).run(report, stop)


def _solve_here(plan: Plan, todo: list[int], journal: Journal, report: _Tell, stop: Stop) -> bool:
    """Solve chunks in this process."""
    report()
    solver: ChunkSolver | None = None
    for chunk in todo:
        if stop():
            return True
        try:
            solver = solver or ChunkSolver(plan)
            block = solver.solve(chunk)
        except Exception as error:
            raise _unsolvable(plan, chunk, error) from error
        journal.add(block)
        report()
    return False


class _Foreman:
    """Keeps a crew busy with a bounded number of chunks, which keeps memory flat; begins again when workers die."""

    def __init__(self, plan: Plan, crew: Crew, journal: Journal, todo: list[int]) -> None:
        self._plan = plan
        self._crew = crew
        self._journal = journal
        self._waiting = deque(todo)
        self._pending: dict[Future[Block], int] = {}
        self._suspects: set[int] = set()
        self._deaths = 0

    def run(self, report: _Tell, stop: Stop) -> bool:
        """Solve every chunk; return whether it was stopped before the end."""
        self._submit()
        report()
        stopping = False
        while self._pending:
            done, _ = wait(self._pending, timeout=_PATIENCE, return_when=FIRST_COMPLETED)
            lost = self._take(done)
            if lost and not stopping:
                self._begin_again(lost)
            if self._journal.tick():
                report()
            if not stopping and stop():
                stopping = True
                self._drop()
            if not stopping:
                self._submit()
        return stopping

    def _submit(self) -> None:
        """Give out chunks; after a second death one at a time, so that the next names its chunk."""
        window = 1 if self._deaths > 1 else self._crew.window
        while self._waiting and len(self._pending) < window:
            chunk = self._waiting.popleft()
            try:
                self._pending[self._crew.submit(chunk)] = chunk
            except BrokenExecutor:
                self._waiting.appendleft(chunk)
                self._begin_again(self._take(self._all()))

    def _take(self, done: set[Future[Block]]) -> list[int]:
        """Keep what was solved; return the chunks that died with their worker."""
        lost = []
        for future in done:
            chunk = self._pending.pop(future)
            try:
                block = future.result()
            except BrokenExecutor:
                lost.append(chunk)
                continue
            except (Exception, CancelledError) as error:
                raise _unsolvable(self._plan, chunk, error) from error
            self._journal.add(block)
            self._suspects.discard(chunk)
            if not self._suspects:
                self._deaths = 0
        return lost

    def _all(self) -> set[Future[Block]]:
        """Return everything pending, finished: with a dead worker its pool is broken and every future ends."""
        return set(wait(self._pending).done)

    def _begin_again(self, lost: list[int]) -> None:
        """Start new workers for what was lost, unless a chunk kills every worker that takes it."""
        lost = sorted([*lost, *self._take(self._all())])
        self._deaths += 1
        self._suspects.update(lost)
        if self._deaths >= _MOST_DEATHS:
            what = _named(self._plan, lost[0]) if len(lost) == 1 else f"one of {len(lost)} chunks"
            raise SweepError(f"workers died {self._deaths} times, the last one while solving {what}; {_KEPT}")
        if not self._crew.restart():
            raise SweepError(f"the executor lost its workers; {_KEPT}")
        self._waiting.extendleft(reversed(lost))

    def _drop(self) -> None:
        """Forget what nobody has begun."""
        for future in [future for future in self._pending if future.cancel()]:
            del self._pending[future]
        self._waiting.clear()


def _unsolvable(plan: Plan, chunk: int, error: BaseException) -> SweepError:
    """Return what to raise where a solver or an executor raised."""
    told = one_line(f"{type(error).__name__}: {' '.join(str(error).split())}", 300)
    return SweepError(f"{_named(plan, chunk)} cannot be solved ({told}); {_KEPT}")


def _named(plan: Plan, chunk: int) -> str:
    first = int(plan.members(chunk)[0])
    pressure = ", ".join(f"{p / BAR:.4g}" for p in plan.pressures()[first])
    return f"chunk {chunk} (its first pose is number {first + 1}, at {pressure} bar)"
