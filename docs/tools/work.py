"""Work of a build, on all processors."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import Any

Job = tuple[Callable[..., None], tuple[Any, ...]]
"""A function of a module, and its arguments."""


def do(jobs: Sequence[Job]) -> None:
    """Do every job, those first that come first; raises what the first of them raises that fails."""
    if not jobs:
        return
    workers = min(len(jobs), os.cpu_count() or 1)
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        for result in [pool.submit(function, *arguments) for function, arguments in jobs]:
            result.result()
