"""Who solves the chunks of a sweep: a pool of processes or any executor, Dask's included; one solver a process."""

from __future__ import annotations

import pickle
import tempfile
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from softnlp.base.errors import InputError
from softnlp.base.processes import process_context, worker_pool
from softnlp.base.reading import one_line
from softnlp.batch.chunk import ChunkSolver
from softnlp.batch.plan import Plan
from softnlp.batch.poses import Block

CONNECT_PATIENCE = "10s"


# --- where poses are solved -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class PlanFile:
    """A plan on a disk that every worker sees."""

    path: Path

    def load(self) -> Plan:
        """Return the plan."""
        with self.path.open("rb") as file:
            plan = pickle.load(file)
        assert isinstance(plan, Plan)
        return plan


# What a process keeps between two chunks. The lock is there because a CasADi solver is no good to two threads at once:
# the threads of one process take turns, and it is processes that work side by side.
_lock = threading.Lock()
_solvers: dict[str, ChunkSolver] = {}
_plans: dict[str, Plan] = {}


def solve(source: Plan | PlanFile, fingerprint: str, chunk: int) -> Block:
    """Return the solved poses of a chunk; the solver is made when a plan comes for the first time."""
    with _lock:
        return _kept(source, fingerprint).solve(chunk)


def keep(plan: Plan, fingerprint: str) -> None:
    """Make the solver of a plan in this process, which workers that are forked from it then have."""
    with _lock:
        _kept(plan, fingerprint)


def _kept(source: Plan | PlanFile, fingerprint: str) -> ChunkSolver:
    if fingerprint not in _solvers:
        _solvers.clear()
        _solvers[fingerprint] = ChunkSolver(source.load() if isinstance(source, PlanFile) else source)
    return _solvers[fingerprint]


def prepare(plan: Plan, fingerprint: str) -> None:
    """Keep the plan in a worker of a process pool."""
    _plans[fingerprint] = plan


def solve_prepared(fingerprint: str, chunk: int) -> Block:
    """Return the solved poses of a chunk of the plan that `prepare` got."""
    return solve(_plans[fingerprint], fingerprint, chunk)


# --- who is given chunks ----------------------------------------------------------------------------------------------


class Crew:
    """Any executor: its workers get what tells them the plan with each chunk, and keep the plan.

    window : how many chunks it is given at once.
    """

    def __init__(self, executor: Executor, source: Any, fingerprint: str, window: int) -> None:
        self.window = window
        self._executor = executor
        self._given = (source, fingerprint)

    def submit(self, chunk: int) -> Future[Block]:
        """Start a chunk."""
        return self._executor.submit(solve, *self._given, chunk)

    def restart(self) -> bool:
        """Begin again after a worker died; whoever made the executor may start another, this cannot."""
        return False


class ProcessCrew(Crew):
    """A pool of processes on this machine, which get the plan when they start."""

    def __init__(self, plan: Plan, fingerprint: str, workers: int) -> None:
        self._workers = workers
        self._given = (plan, fingerprint)
        super().__init__(self._start(), plan, fingerprint, 2 * workers + 2)

    def submit(self, chunk: int) -> Future[Block]:
        """Start a chunk."""
        return self._executor.submit(solve_prepared, self._given[1], chunk)

    def restart(self) -> bool:
        """Start a new pool in place of a broken one."""
        self.stop()
        self._executor = self._start()
        return True

    def stop(self) -> None:
        """End the workers; what they have not begun is dropped."""
        self._executor.shutdown(wait=True, cancel_futures=True)

    def _start(self) -> ProcessPoolExecutor:
        if process_context().get_start_method() == "fork":
            keep(*self._given)  # what is made here need not be made by each of them
        return worker_pool(self._workers, prepare, *self._given)


@contextmanager
def process_crew(plan: Plan, fingerprint: str, workers: int) -> Iterator[Crew]:
    """Yield a pool of processes."""
    crew = ProcessCrew(plan, fingerprint, workers)
    try:
        yield crew
    finally:
        crew.stop()


@contextmanager
def executor_crew(executor: Executor, plan: Plan, fingerprint: str) -> Iterator[Crew]:
    """Yield a crew of somebody else's executor, which stays open.

    A Dask client's workers get the plan once, over the network. Those of any other executor read it from a temporary
    file of this machine.
    """
    client = getattr(executor, "_client", None)
    if client is not None and hasattr(client, "scatter"):
        if not (threads := sum(client.nthreads().values())):
            raise InputError("the Dask cluster has no workers", key="executor")
        scattered = client.scatter(plan, broadcast=True, hash=False)
        yield Crew(executor, scattered, fingerprint, 3 * threads + 2)
        return
    workers = int(getattr(executor, "_max_workers", 8) or 8)
    with tempfile.TemporaryDirectory(prefix="softnlp-plan-") as folder:
        path = Path(folder, "plan.pickle")
        path.write_bytes(pickle.dumps(plan, protocol=pickle.HIGHEST_PROTOCOL))
        yield Crew(executor, PlanFile(path), fingerprint, 2 * workers + 2)


@contextmanager
def cluster_executor(address: str) -> Iterator[Executor]:
    """Yield the executor of a Dask cluster, by the address of its scheduler.

    Raises
    ------
    InputError
        Where the extra `cluster` is not installed or no scheduler answers.
    """
    try:
        client_of: Any = import_module("distributed").Client
    except ImportError:
        raise InputError("needs Dask: install softnlp[cluster]", key="--cluster") from None
    try:
        client = client_of(address, timeout=CONNECT_PATIENCE)
    except (OSError, ValueError, TypeError) as error:
        reason = one_line(" ".join(str(error).split()), 200)
        raise InputError(f"no Dask scheduler answers at {address!r} ({reason})", key="--cluster") from None
    try:
        yield client.get_executor(pure=False)
    finally:
        client.close()
