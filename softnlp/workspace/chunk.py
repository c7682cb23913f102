"""Solving one chunk of a plan: all its poses at once, and by the problem itself those that this leaves."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.loadcase import rod_functions
from softnlp.quantities import Model, with_symbols
from softnlp.rod import Loads
from softnlp.status import Status
from softnlp.studies.statics import PoseSolver, Solved
from softnlp.studies.step import Step
from softnlp.workspace.batch import Batch, BatchSolver, Mask, Shot
from softnlp.workspace.csource import Kernels
from softnlp.workspace.plan import LOADS, Plan
from softnlp.workspace.poses import STATUSES, Block, Lane, Rows, unsolved_rows
from softnlp.workspace.reduced import POSITION, ROTATION, reduced_rod
from softnlp.workspace.shooting import shooting
from softnlp.workspace.stretches import Stretches, stretch_maps

Array = NDArray[np.float64]

_WORTH_COMPILING = 2000  # poses


class ChunkSolver:
    """Solves chunks of one plan; a worker makes one and keeps what it compiled."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self._problem: PoseSolver | None = None
        self._functions = rod_functions(plan.model)
        reduced = reduced_rod(self._functions)
        kernels = Kernels(
            {"value": reduced.value, "directions": reduced.directions, "check": reduced.check},
            {"ends": reduced.ends, **stretch_maps(self._functions)},
        )
        self._kernels = shooting(kernels, build=plan.poses >= _WORTH_COMPILING)
        numerics = plan.numerics
        self._batch = BatchSolver(self._functions, self._kernels, numerics.accuracy / 3, numerics.intervals)
        self._stretches = Stretches(self._functions, self._kernels, shared=not set(plan.varied) - {"pressure", *LOADS})
        self._loads = _entries(plan, "tip_force"), _entries(plan, "tip_moment")

    def solve(self, chunk: int) -> Block:
        """Return the poses of a chunk; never raises for a pose that cannot be solved."""
        numbers = self.plan.members(chunk)
        rows = unsolved_rows(numbers, self.plan.row_type)
        table = self.plan.full_values(numbers)
        if self.plan.numerics.transcription == "multiple-shooting":
            self._solve_together(rows, table)
        messages: list[tuple[int, str]] = []
        near: Solved | None = None
        for k in np.flatnonzero(rows["lane"] == Lane.PROBLEM).tolist():
            model, pressure, loads = self._pose(table[:, k])
            if self._problem is None:
                self._problem = PoseSolver(self.plan.model, self.plan.numerics)
            step, solved = self._problem.with_model(model).solve(pressure, loads, near)
            near = solved or near
            _fill(rows, k, step)
            if not step.status.has_solution:
                messages.append((int(numbers[k]), step.message))
        return Block(chunk, rows, tuple(messages))

    def _solve_together(self, rows: Rows, table: Array) -> None:
        """Fill the rows of poses that are solved, accurate and stable for certain; the others stay as they are."""
        stretch, known = self._stretches.find(table)
        poses = np.flatnonzero(known)
        if poses.size == 0:
            return
        columns, stretch = table[:, poses], stretch[poses]
        section = self._kernels.apply("section", np.vstack([columns, stretch]))
        constants, (balance, L_0, F_0) = section[:-3], section[-3:]
        force, moment = columns[self._loads[0]] / F_0, columns[self._loads[1]] / (F_0 * L_0)
        data = np.vstack([constants, force, moment])
        bend = constants[11] * np.hypot(constants[6] / constants[2], constants[7] / constants[3])
        features = self.plan.values[rows["pose"][poses]]
        shot = self._batch.solve(Batch(data, bend), features)
        residual = np.maximum(shot.residual, np.abs(balance))
        good = (residual <= self.plan.numerics.tolerance) & shot.certain & np.all(constants[:5] > 0, axis=0)
        good &= (shot.refinement_error <= self.plan.numerics.accuracy) | (self.plan.numerics.intervals is not None)
        _fill_together(rows, poses[good], shot, good, stretch[good], L_0[good], residual[good])

    def _pose(self, column: Array) -> tuple[Model, Array, Loads]:
        """Return the model, the pressures and the loads of one pose from every quantity."""
        values: dict[str, Any] = {}
        start = 0
        for name, nominal in self.plan.nominal.items():
            part = column[start : start + nominal.size]
            values[name] = float(part[0]) if nominal.size == 1 and name != "pressure" else part
            start += nominal.size
        named = with_symbols(self.plan.model, values)
        return named, values["pressure"], Loads(values["tip_force"], values["tip_moment"], values["gravity"])


def _entries(plan: Plan, name: str) -> slice:
    """Return where a quantity stands in a column of all of them."""
    names = list(plan.nominal)
    start = sum(plan.nominal[other].size for other in names[: names.index(name)])
    return slice(start, start + plan.nominal[name].size)


def _fill_together(
    rows: Rows, where: NDArray[np.intp], shot: Shot, good: Mask, stretch: Array, L_0: Array, residual: Array
) -> None:
    """Put the good poses of a shot into their rows."""
    N = shot.integrals.shape[0] - 2
    rows["status"][where] = STATUSES.index(Status.SOLVED)
    rows["lane"][where] = Lane.BATCH
    rows["stable"][where] = 1
    rows["intervals"][where] = shot.intervals[good]
    rows["iterations"][where] = shot.iterations[good]
    rows["stretch"][where] = stretch
    rows["tip_position"][where] = (shot.tip[POSITION, good] * L_0).T
    rows["tip_rotation"][where] = shot.tip[ROTATION, good].T.reshape(-1, 3, 3).transpose(0, 2, 1)
    rows["chamber_length"][where] = (shot.integrals[:N, good] * L_0).T
    rows["bending_angle"][where] = shot.integrals[N, good]
    rows["backbone_length"][where] = shot.integrals[N + 1, good] * L_0
    rows["residual"][where] = residual
    rows["error"][where] = shot.error[good]


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
