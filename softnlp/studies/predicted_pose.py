"""The observables of free poses and their exact derivatives by constants, at any values of the constants.

Without loads the pose is the arc of the section's constants in closed form, once the stretch is known; with loads it is
the solution of the rod's equations g(x, p) = 0. Derivatives are those of the implicit function: dx = -J^-1 g_p dp.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.model import rod
from softnlp.model.rod import Loads
from softnlp.nlp.directions import SolutionDerivatives, unit_directions
from softnlp.statics.branch import stretch_on_branch
from softnlp.statics.loadcase import unpack_section
from softnlp.statics.pose_grid import Grid, Solved, pose_distance
from softnlp.statics.solver import PoseSolver
from softnlp.studies.trial import TrialPoses

Array = NDArray[np.float64]

_NEWTON_STEPS, _LARGEST_CHANGE = 20, 0.1
_NO_CURVATURE = 1e-30  # squared, under the root: the bending angle has no derivative at a straight shape
STRAIGHT = 1e-8
"""Bending angle of a straight shape [rad]; it has no derivative there."""
_LARGEST_JUMP = 0.3  # of a scaled position or direction cosine, between solutions at two sets of constants


@dataclass(frozen=True)
class Failure:
    """A row whose pose was not found, and the named status of it."""

    row: int
    status: Status
    message: str


@dataclass(frozen=True, eq=False)
class Prediction:
    """values : (rows, m), nan where a pose was not found. slopes : (rows, m, constants)."""

    values: Array
    slopes: Array
    failures: tuple[Failure, ...]


class FreePoses(Protocol):
    """The observables of a sequence of free poses: `POSE_COLUMNS`, then the chamber lengths [m]."""

    def evaluate(self, constants: Mapping[str, float], anew: bool = False) -> Prediction:
        """Return them at values of quantities; `anew` follows every pose from zero pressure again."""
        ...


class ArcPoses:
    """Free poses without loads, in closed form."""

    def __init__(self, solver: TrialPoses, pressure: Array, names: Sequence[str]) -> None:
        self._solver = solver
        self._pressure = pressure
        self._function = _arc_function(solver, names)
        self._stretch: Array | None = None

    def evaluate(self, constants: Mapping[str, float], anew: bool = False) -> Prediction:
        """See `FreePoses`."""
        solver = self._solver.at(constants)
        columns = np.array([solver.column(solver.values(P, Loads())) for P in self._pressure]).T
        failures: list[Failure] = []
        stretch = None if anew or self._stretch is None else self._near(columns, self._stretch)
        if stretch is None:
            stretch = np.ones(len(self._pressure))
            for row, P in enumerate(self._pressure):
                point = stretch_on_branch(solver.branch, columns[:, row], P)
                stretch[row] = point.stretch if point.status is Status.SOLVED else np.nan
                if point.status is not Status.SOLVED:
                    failures.append(Failure(row, point.status, point.message))
            if not failures:
                polished = self._near(columns, stretch)
                stretch = stretch if polished is None else polished
        if not failures:
            self._stretch = stretch
        values, by_stretch, by_column, imbalance = self._evaluated(columns, stretch)
        slope, rates = imbalance[:, 1], imbalance[:, 2:]
        slopes = by_column - by_stretch[:, :, None] * (rates / slope[:, None])[:, None, :]
        return Prediction(values, slopes, tuple(failures))

    def _evaluated(self, columns: Array, stretch: Array) -> tuple[Array, Array, Array, Array]:
        """Return values, their derivatives by stretch and by constants, and (balance, by stretch, by constants)."""
        n = len(stretch)
        values, by_stretch, by_column, imbalance = (
            np.asarray(part) for part in self._function(columns, stretch[None, :])
        )
        split = by_column.reshape(by_column.shape[0], n, -1).transpose(1, 0, 2)
        return values.T, by_stretch.T, split, imbalance.T

    def _near(self, columns: Array, stretch: Array) -> Array | None:
        """Return the roots of the balance next to known stretches by Newton's method, None where one is not near."""
        found = stretch
        for _ in range(_NEWTON_STEPS):
            imbalance = self._evaluated(columns, found)[3]
            with np.errstate(all="ignore"):
                change = -imbalance[:, 0] / imbalance[:, 1]
            # On the branch from zero pressure the resistance grows faster with the stretch than the pressure's force.
            if not np.all(imbalance[:, 1] > 0) or not np.all(np.abs(found + change - stretch) < _LARGEST_CHANGE):
                return None
            found = found + change
            if np.all(np.abs(change) < 1e-14):
                break
        return found


def _arc_function(solver: PoseSolver, names: Sequence[str]) -> ca.Function:
    """Return (quantities, stretch) -> observables, derivatives by stretch and by the named, and the balance's."""
    functions = solver.functions
    column, stretch = ca.SX.sym("quantities", functions.section.size1_in(0)), ca.SX.sym("stretch")
    c, balance, units = functions.section(column, stretch)
    state = functions.arc(column, stretch, 1.0)
    L_0, N = units[0], functions.model.robot.chambers
    _, u = rod.strains(state, unpack_section(c))
    angle = stretch * ca.sqrt(u[0] ** 2 + u[1] ** 2 + _NO_CURVATURE)
    lengths = functions.lengths(state, c)[:N] * L_0
    seen = ca.vertcat(state[:3] * L_0, angle, (stretch - 1) * L_0, lengths)
    chosen = ca.DM(unit_directions(column.numel(), positions(solver, names)))
    imbalance = ca.horzcat(balance, ca.jacobian(balance, stretch), ca.jtimes(balance, column, chosen))
    parts = [seen, ca.jacobian(seen, stretch), ca.jtimes(seen, column, chosen), imbalance.T]
    return ca.Function("arcs", [column, stretch], [ca.densify(part) for part in parts], {"cse": True})


class LoadedPoses:
    """Free poses under dead loads: each followed from the last at first, then from itself at other constants."""

    def __init__(self, solver: TrialPoses, pressure: Array, loads: Loads, names: Sequence[str]) -> None:
        self._solver = solver
        self._pressure = pressure
        self._loads = loads
        self._positions = positions(solver, names)
        self._known: dict[int, Solved] = {}

    def evaluate(self, constants: Mapping[str, float], anew: bool = False) -> Prediction:
        """See `FreePoses`."""
        solver = self._solver.at(constants)
        failures: tuple[Failure, ...] = ()
        if anew or not self._moved(solver):
            failures = self._follow(solver)
        shape = (5 + solver.model.robot.chambers, len(self._positions))
        values = np.full((len(self._pressure), shape[0]), np.nan)
        slopes = np.full((len(self._pressure), *shape), np.nan)
        for row, found in self._known.items():
            values[row], slopes[row] = self._observed(found)
        return Prediction(values, slopes, failures)

    def _follow(self, solver: TrialPoses) -> tuple[Failure, ...]:
        """Solve every pose, each from the last; return those that have no solution."""
        self._known = {}
        failures = []
        near: Solved | None = None
        for row, P in enumerate(self._pressure):
            step, found = solver.solve(P, self._loads, near)
            near = found or near
            if found is None:
                failures.append(Failure(row, step.status, step.message))
            else:
                self._known[row] = found
        return tuple(failures)

    def _moved(self, solver: TrialPoses) -> bool:
        """Solve every known pose at other constants; whether all are still there, and near."""
        if len(self._known) < len(self._pressure):
            return False
        moved = {}
        for row, found in self._known.items():
            grid, x = found.grid, found.solution.x
            p = grid.problem.pack(solver.values(self._pressure[row], self._loads))
            solution = grid.engine.solve(p, x)
            if not solution.holds(solver.numerics.tolerance) or pose_distance(solution.x - x) > _LARGEST_JUMP:
                return False
            moved[row] = replace(found, solution=solution)
        self._known = moved
        return True

    def _observed(self, found: Solved) -> tuple[Array, Array]:
        """Return the observables of a pose and their derivatives."""
        x, p = found.solution.x, found.solution.p
        derivatives = self._solver.derivatives.get(
            found.intervals, lambda: _pose_derivatives(found.grid, len(self._positions))
        )
        values, slopes = derivatives(x, p, unit_directions(p.size, self._positions))
        if values[3] < STRAIGHT:
            slopes[3] = 0.0
        return values, slopes


def _pose_derivatives(grid: Grid, directions: int) -> SolutionDerivatives:
    """Return the derivatives of a pose's observables."""
    problem = grid.problem
    x, p = problem.nlp["x"], problem.nlp["p"]
    out = problem.outputs(x=x, p=p)
    elongation = out["backbone_length"] - problem.units(x, p)[0]
    seen = ca.vertcat(out["tip_position"], out["bending_angle"], elongation, ca.vec(out["chamber_lengths"]))
    return SolutionDerivatives(problem, grid.engine.linear, seen, directions)


def positions(solver: PoseSolver, names: Sequence[str]) -> list[int | None]:
    """Return where scalar quantities stand in the column of all; None for those that are not in it."""
    at: dict[str, int] = {}
    start = 0
    for name, q in solver.quantities.items():
        at[name] = start
        start += q.size
    return [at.get(name) for name in names]
