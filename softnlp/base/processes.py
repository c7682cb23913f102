"""Worker processes that never run the caller's script again, so that it needs no `if __name__ == "__main__"`."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import connection, parent_process, spawn
from multiprocessing.context import BaseContext, SpawnContext, SpawnProcess
from numbers import Integral
from typing import Any

from softnlp.base.errors import InputError

MOST_WORKERS = 1024

_launching = threading.Lock()


def require_workers(workers: Any) -> None:
    """Raise `InputError` for what is no number of processes."""
    if isinstance(workers, bool) or not isinstance(workers, Integral) or not 1 <= int(workers) <= MOST_WORKERS:
        raise InputError(f"expected a whole number from 1 to {MOST_WORKERS}, got {workers!r}", key="workers")


def process_context() -> BaseContext:
    """Return how workers are started: by fork, the quickest, only where no thread runs that it would cut off."""
    if sys.platform == "linux" and threading.active_count() == 1:
        return multiprocessing.get_context("fork")
    return _Context()


def processors() -> int:
    """Return how many processors this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on Linux
        return os.cpu_count() or 1


def worker_pool(workers: int, begin: Callable[..., object], *given: Any) -> ProcessPoolExecutor:
    """Return a pool of processes that each begin with `begin(*given)` beside `begin_worker`."""
    return ProcessPoolExecutor(workers, mp_context=process_context(), initializer=_begin, initargs=(begin, given))


def _begin(begin: Callable[..., object], given: tuple[Any, ...]) -> None:
    begin_worker()
    begin(*given)


def begin_worker() -> None:
    """Begin a worker: leave Ctrl-C to the parent, and end when the parent has gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if (parent := parent_process()) is not None:
        # A parent that was killed tells nobody; its workers would wait for the next task for ever.
        threading.Thread(target=_end_with, args=(parent.sentinel,), daemon=True).start()


def _end_with(sentinel: int) -> None:
    connection.wait([sentinel])
    os._exit(1)


class _Process(SpawnProcess):
    """A fresh interpreter. What is sent to it may name modules, but nothing that a script or notebook defines."""

    @staticmethod
    def _Popen(process_obj: Any) -> Any:
        with _without_main():
            return SpawnProcess._Popen(process_obj)


class _Context(SpawnContext):
    Process = _Process


@contextmanager
def _without_main() -> Iterator[None]:
    """Tell what this thread starts nothing of the caller's `__main__`; other threads start theirs as always."""
    thread = threading.get_ident()
    with _launching:
        told = spawn.get_preparation_data

        def untold(name: str) -> dict[str, Any]:
            data = told(name)
            if threading.get_ident() == thread:
                data = {key: value for key, value in data.items() if not key.startswith("init_main_")}
            return data

        spawn.get_preparation_data = untold
        try:
            yield
        finally:
            spawn.get_preparation_data = told
