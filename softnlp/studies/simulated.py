"""What the model says of measured rows: solved one after the other, or all poses of a robot at once as a sweep does."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.batch.chunk import ChunkSolver
from softnlp.batch.plan import Plan
from softnlp.batch.poses import STATUSES
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.rod import Loads
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.kept import blocked_solver, pose_solver
from softnlp.statics.solver import PoseSolver
from softnlp.statics.step import Step
from softnlp.statics.wall import standing_wall
from softnlp.studies.observed import NUMBERS

Array = NDArray[np.float64]
Tell = Callable[[int], None]
"""Called with how many rows were solved since the last call."""
Solve = Callable[[Array, Any], tuple[Step, Any]]
"""Solves a row from the last one that was found."""


@dataclass(frozen=True, eq=False)
class Solved:
    """What came of rows.

    Attributes
    ----------
    values
        (rows, 7) as `softnlp.studies.observed.NUMBERS` [m, rad, N]; nan where there is no solution, the force also
        where there is no wall.
    status
        Of each row; None of one that nothing was asked of.
    message
        Of each row; "" of one that nothing was asked of.
    self_intersecting
        The rows whose shape passes through itself.
    """

    values: Array
    status: tuple[Status | None, ...]
    message: tuple[str, ...]
    self_intersecting: frozenset[int] = frozenset()


class RowSolver:
    """Solves rows in their order, each from the last; what is compiled serves all robots and constants of a kind."""

    def __init__(self, numerics: Numerics, loads: Loads) -> None:
        self._numerics = numerics
        self._loads = loads
        self._free: dict[Hashable, PoseSolver] = {}
        self._blocked: dict[Hashable, BlockedSolver] = {}

    def solve(self, model: Model, pressure: Array, contact: ContactSettings | None, tell: Tell) -> Solved:
        """Return the poses at pressures (rows, sets) [Pa], against the wall of `contact` if there is one."""
        solve = self._free_solve(model) if contact is None else self._blocked_solve(model, pressure, contact)
        near, steps = None, []
        for P in pressure:
            step, found = solve(P, near)
            near = found or near
            steps.append(step)
            tell(1)
        length = float(model.robot.length)
        values = np.array([_numbers(step, length) for step in steps]).reshape(-1, len(NUMBERS))
        through = frozenset(k for k, step in enumerate(steps) if step.pose and step.pose.fit.self_intersecting)
        return Solved(values, tuple(step.status for step in steps), tuple(step.message for step in steps), through)

    def _free_solve(self, model: Model) -> Solve:
        kind = model.kind
        if kind not in self._free:
            self._free[kind] = pose_solver(model, self._numerics)
        solver = self._free[kind].with_model(model)
        return lambda P, near: solver.solve(P, self._loads, near)

    def _blocked_solve(self, model: Model, pressure: Array, contact: ContactSettings) -> Solve:
        kind = (model.kind, contact)
        if kind not in self._blocked:
            self._blocked[kind] = blocked_solver(model, self._numerics, contact)
        solver = self._blocked[kind].with_model(model)
        wall = standing_wall(solver.poses, contact, pressure, self._loads)
        return lambda P, near: solver.solve(P, self._loads, wall, near)


def _numbers(step: Step, length: float) -> list[float]:
    """Return `NUMBERS` of a step, nan where it has none."""
    pose = step.pose
    if pose is None or not step.status.has_solution:
        return [np.nan] * len(NUMBERS)
    force = np.nan if step.contact is None else step.contact.force
    return [*pose.tip_position, pose.bending_angle, pose.backbone_length - length, pose.tilt, force]


class SweepSolver:
    """Solves all rows of a robot at once, by the lane of a workspace sweep."""

    def __init__(self, numerics: Numerics, loads: Loads) -> None:
        self._numerics = numerics
        self._loads = loads

    def solve(self, model: Model, pressure: Array, contact: ContactSettings | None, tell: Tell) -> Solved:
        """See `RowSolver`."""
        order = np.arange(len(pressure), dtype=np.int64)
        plan = Plan(model, self._loads, self._numerics, contact, ("pressure",), np.ascontiguousarray(pressure), order)
        solver = ChunkSolver(plan)
        values = np.full((len(pressure), len(NUMBERS)), np.nan)
        status = [Status.DIVERGED] * len(pressure)
        message = [""] * len(pressure)
        through: set[int] = set()
        for chunk in range(plan.chunks):
            block = solver.solve(chunk)
            members, rows = plan.members(chunk), block.rows
            through.update(members[rows["self_intersecting"] == 1].tolist())
            axis = rows["tip_rotation"][:, :, 2]
            tilt = np.arctan2(np.hypot(axis[:, 0], axis[:, 1]), axis[:, 2])
            values[members, :3] = rows["tip_position"]
            pose = (rows["bending_angle"], rows["backbone_length"] - float(model.robot.length), tilt)
            values[members, 3:6] = np.column_stack(pose)
            if contact is not None:
                values[members, 6] = rows["blocked_force"]
            for k, number in enumerate(members.tolist()):
                status[number] = STATUSES[rows["status"][k]]
                message[number] = status[number].advice
            for number, words in block.messages:
                message[number] = words
            tell(len(members))
        lost = np.array([not s.has_solution for s in status])
        values[lost] = np.nan
        return Solved(values, tuple(status), tuple(message), frozenset(through))


def closed_by(contact: ContactSettings, closure: str | None) -> ContactSettings:
    """Return the wall with another closure, where one is named."""
    return contact if closure is None else replace(contact, closure=closure)  # type: ignore[arg-type]
