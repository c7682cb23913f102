"""What runs where poses are solved: one solver a process, made once for the plan that is being swept."""

from __future__ import annotations

import pickle
import threading
from dataclasses import dataclass
from pathlib import Path

from softnlp.base.processes import begin_worker
from softnlp.batch.chunk import ChunkSolver
from softnlp.batch.plan import Plan
from softnlp.batch.poses import Block


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
    """Begin a worker of a process pool, and keep the plan."""
    begin_worker()
    _plans[fingerprint] = plan


def solve_prepared(fingerprint: str, chunk: int) -> Block:
    """Return the solved poses of a chunk of the plan that `prepare` got."""
    return solve(_plans[fingerprint], fingerprint, chunk)
