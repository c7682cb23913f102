"""Small sweeps for the tests, and a solver that makes rows up so that running a sweep can be tested without solving."""

from __future__ import annotations

import os
import resource
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from softnlp.base.status import Status
from softnlp.batch.plan import Plan, cells
from softnlp.batch.poses import STATUSES, Block, unsolved_rows
from softnlp.scenario.read import Scenario, scenario_from_text
from softnlp.scenario.workspace import plan_of

HEAD = """study = "workspace"
[robot]
name = "D25L60"
[material]
name = "Ecoflex 00-50"
model = "mooney-rivlin"
"""
GRID = "[workspace]\nlevels = 3\nto_bar = 1.2\n"
QUICK = '[gravity]\ndirection = "-z"\n[solver]\nintervals = 10\naccuracy = 1e-3\n'


def scenario(tables: str = GRID, head: str = HEAD) -> Scenario:
    """Return a scenario of the given tables."""
    return scenario_from_text(head + tables, "sweep.toml")


def plan(tables: str = GRID + QUICK, chunk: int = 4, head: str = HEAD) -> Plan:
    """Return a plan in small chunks."""
    whole = plan_of(scenario(tables, head))
    order = whole.order if "[pressure]" in tables else cells(whole.values, chunk)
    return replace(whole, chunk=chunk, order=order)


def made_up(plan: Plan, chunk: int) -> Block:
    """Return rows that are a function of plan and chunk alone; every fifth pose failed."""
    numbers = plan.members(chunk)
    rows = unsolved_rows(numbers, plan.row_type)
    good = numbers % 5 != 4
    rng = np.random.default_rng(chunk)
    for name in rows.dtype.names or ():
        if rows.dtype[name].base.kind == "f":
            values = rng.random((numbers.size, *rows.dtype[name].shape))
            rows[name][good] = values[good]
    rows["status"][good] = STATUSES.index(Status.SOLVED)
    rows["stable"][good] = 1
    return Block(chunk, rows, tuple((int(n), f"pose {n} did not, ∂x\n") for n in numbers[~good]))


class MadeUpSolver:
    """Stands in for `ChunkSolver`."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan

    def solve(self, chunk: int) -> Block:
        return made_up(self.plan, chunk)


@contextmanager
def read_only(folder: Path) -> Iterator[None]:
    """Make a folder one that cannot be written; as root, by being somebody else for a while."""
    root = os.geteuid() == 0
    own = [p for p in (folder, *folder.parents) if len(p.parts) > 2]  # pytest's, for their owner alone
    modes = {path: path.stat().st_mode for path in own}
    folder.chmod(0o555)
    if root:
        for path in own[1:]:
            path.chmod(modes[path] | 0o055)
        os.seteuid(65534)
    try:
        yield
    finally:
        if root:
            os.seteuid(0)
        for path, mode in modes.items():
            path.chmod(mode)


def in_child(function: Any, *arguments: Any, file_size: int | None = None) -> str:
    """Return what a function returns in a forked process, optionally one whose files may not grow beyond a size.

    The text of what it raises instead comes with the type in front. The process ends without cleaning up.
    """
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            if file_size is not None:
                resource.setrlimit(resource.RLIMIT_FSIZE, (file_size, file_size))
            told = str(function(*arguments))
        except BaseException as error:
            told = f"{type(error).__name__}: {error}"
        os.write(writing, told.encode())
        os._exit(0)
    os.close(writing)
    with os.fdopen(reading, "rb") as pipe:
        told = pipe.read().decode()
    status = os.waitpid(child, 0)[1]
    assert status == 0, f"the process ended with {status}: {told}"
    return told
