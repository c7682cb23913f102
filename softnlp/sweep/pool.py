"""Who solves the chunks of a sweep: this process, a pool of processes, or any executor, Dask's included."""

from __future__ import annotations

import pickle
import tempfile
from collections.abc import Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

from softnlp.base.errors import InputError
from softnlp.base.processes import process_context
from softnlp.base.reading import one_line
from softnlp.batch.plan import Plan
from softnlp.batch.poses import Block
from softnlp.sweep.worker import PlanFile, keep, prepare, solve, solve_prepared

CONNECT_PATIENCE = "10s"


class Crew(Protocol):
    """Solves chunks side by side. window : how many it is given at once."""

    window: int

    def submit(self, chunk: int) -> Future[Block]:
        """Start a chunk."""
        ...

    def restart(self) -> bool:
        """Begin again after a worker died; whether that is possible."""
        ...


class ProcessCrew:
    """A pool of processes on this machine, which get the plan when they start."""

    def __init__(self, plan: Plan, fingerprint: str, workers: int) -> None:
        self.window = 2 * workers + 2
        self._given = (plan, fingerprint)
        self._workers = workers
        self._pool = self._start()

    def submit(self, chunk: int) -> Future[Block]:
        """Start a chunk."""
        return self._pool.submit(solve_prepared, self._given[1], chunk)

    def restart(self) -> bool:
        """Start a new pool in place of a broken one."""
        self.stop()
        self._pool = self._start()
        return True

    def stop(self) -> None:
        """End the workers; what they have not begun is dropped."""
        self._pool.shutdown(wait=True, cancel_futures=True)

    def _start(self) -> ProcessPoolExecutor:
        context = process_context()
        if context.get_start_method() == "fork":
            keep(*self._given)  # what is made here need not be made by each of them
        return ProcessPoolExecutor(self._workers, mp_context=context, initializer=prepare, initargs=self._given)


class ExecutorCrew:
    """Any executor: its workers get what tells them the plan with each chunk, and keep the plan."""

    def __init__(self, executor: Executor, source: Any, fingerprint: str, window: int) -> None:
        self.window = window
        self._executor = executor
        self._given = (source, fingerprint)

    def submit(self, chunk: int) -> Future[Block]:
        """Start a chunk."""
        return self._executor.submit(solve, *self._given, chunk)

    def restart(self) -> bool:
        """Whoever made the executor may start another; this cannot."""
        return False


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
            raise InputError("the Dask cluster has no workers", key="--cluster")
        scattered = client.scatter(plan, broadcast=True, hash=False)
        yield ExecutorCrew(executor, scattered, fingerprint, 3 * threads + 2)
        return
    workers = int(getattr(executor, "_max_workers", 8) or 8)
    with tempfile.TemporaryDirectory(prefix="softnlp-plan-") as folder:
        path = Path(folder, "plan.pickle")
        path.write_bytes(pickle.dumps(plan, protocol=pickle.HIGHEST_PROTOCOL))
        yield ExecutorCrew(executor, PlanFile(path), fingerprint, 2 * workers + 2)


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
