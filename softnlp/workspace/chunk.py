"""Solving one chunk of a plan: every pose by the problem itself, each started from the one before."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.quantities import Model, with_symbols
from softnlp.rod import Loads
from softnlp.studies.statics import PoseSolver, Solved
from softnlp.studies.step import Step
from softnlp.workspace.plan import Plan
from softnlp.workspace.poses import STATUSES, Block, Lane, Rows, unsolved_rows

Array = NDArray[np.float64]


class ChunkSolver:
    """Solves chunks of one plan; a worker makes one and keeps what it compiled."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self._poses = PoseSolver(plan.model, plan.numerics)

    def solve(self, chunk: int) -> Block:
        """Return the poses of a chunk; never raises for a pose that cannot be solved."""
        numbers = self.plan.members(chunk)
        rows = unsolved_rows(numbers, self.plan.row_type)
        messages: list[tuple[int, str]] = []
        table = self.plan.full_values(numbers)
        near: Solved | None = None
        for k, number in enumerate(numbers.tolist()):
            model, pressure, loads = self._pose(table[:, k])
            step, solved = self._poses.with_model(model).solve(pressure, loads, near)
            near = solved or near
            _fill(rows, k, step)
            if not step.status.has_solution:
                messages.append((number, step.message))
        return Block(chunk, rows, tuple(messages))

    def _pose(self, column: Array) -> tuple[Model, Array, Loads]:
        """Return the model, the pressures and the loads of one pose from every quantity."""
        values: dict[str, Any] = {}
        start = 0
        for name, q in self.plan.declared().items():
            part = column[start : start + q.size]
            values[name] = float(part[0]) if q.size == 1 and name != "pressure" else part
            start += q.size
        named = with_symbols(self.plan.model, values)
        return named, values["pressure"], Loads(values["tip_force"], values["tip_moment"], values["gravity"])


def _fill(rows: Rows, k: int, step: Step) -> None:
    """Put a step into row k."""
    rows["status"][k] = STATUSES.index(step.status)
    rows["lane"][k] = Lane.PROBLEM
    rows["iterations"][k] = step.iterations
    rows["intervals"][k] = step.intervals or 0
    rows["residual"][k] = np.nan if step.residual is None else step.residual
    pose = step.pose
    if pose is None or not step.status.has_solution:
        return
    rows["stable"][k] = pose.stable
    rows["error"][k] = step.discretisation_error
    for name in ("stretch", "tip_position", "tip_rotation", "bending_angle", "backbone_length", "chamber_length"):
        rows[name][k] = getattr(pose, name)
