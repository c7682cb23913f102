"""Blocked forces and their exact derivatives by constants, at any values of the constants.

At first, and whenever asked anew, each force is followed from zero pressure as in `softnlp.blocked_force`. At other
constants nearby the solutions are found from the known ones; where that leads elsewhere they are followed again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.model.rod import Loads
from softnlp.nlp.directions import SolutionDerivatives, unit_directions
from softnlp.statics.blocked_grid import Blocked, BlockedGrid
from softnlp.statics.wall import Wall, standing_wall
from softnlp.studies.predicted_pose import Failure, Prediction
from softnlp.studies.trial import TrialBlocked

Array = NDArray[np.float64]

_LARGEST_JUMP = 0.3  # of a scaled position or direction cosine, between solutions at two sets of constants


class BlockedForces:
    """The blocked force of one robot at a sequence of pressures."""

    def __init__(self, solver: TrialBlocked, pressure: Array, loads: Loads, names: Sequence[str]) -> None:
        self._solver = solver
        self._pressure = pressure
        self._loads = loads
        self._names = tuple(names)
        self._order = np.argsort(np.sum(pressure, axis=1), kind="stable")
        self._wall: Wall | None = None
        self._known: dict[int, Blocked] = {}
        self._failures: tuple[Failure, ...] = ()

    def evaluate(self, constants: Mapping[str, float], lengths: Array, slopes: Array, anew: bool = False) -> Prediction:
        """Return the forces (rows, 1) [N] and their derivatives.

        lengths : (rows, N) free chamber lengths [m]; slopes : (rows, N, constants) their derivatives.
        """
        solver = self._solver.at(constants)
        if self._wall is None:
            self._wall = standing_wall(solver.poses, solver.contact, self._pressure, self._loads)
        if anew or self._failures or not self._moved(solver, lengths):
            self._failures = self._follow(solver, self._wall)
        rows, n = len(self._pressure), len(self._names)
        forces, by_constant = np.zeros((rows, 1)), np.zeros((rows, 1, n))
        for failure in self._failures:
            forces[failure.row], by_constant[failure.row] = np.nan, np.nan
        for row, found in self._known.items():
            forces[row], by_constant[row] = self._force(solver, found, slopes[row])
        return Prediction(forces, by_constant, self._failures)

    def _follow(self, solver: TrialBlocked, wall: Wall) -> tuple[Failure, ...]:
        """Follow every force from zero pressure; return those that are lost."""
        self._known = {}
        failures = []
        near: Blocked | None = None
        for row in self._order:
            step, found = solver.solve(self._pressure[row], self._loads, wall, near)
            near = found or near
            if found is not None:
                self._known[int(row)] = found
            elif not step.status.has_solution:
                failures.append(Failure(int(row), step.status, step.message))
        return tuple(failures)

    def _moved(self, solver: TrialBlocked, lengths: Array) -> bool:
        """Solve every known blocked shape at other constants; whether all are still there, and near."""
        pressed = {int(row) for row in np.flatnonzero(np.any(self._pressure > 0, axis=1))}
        if not pressed <= set(self._known):
            return False  # not solved yet, or a shape that did not touch the wall may do so now
        moved = {}
        for row, found in self._known.items():
            grid = found.grid
            p = grid.problem.pack(solver.values(found.situation, found.pressed, lengths[row]))
            solution = grid.engine.solve(p, found.solution.x)
            near = solution.holds(solver.numerics.tolerance) and bool(
                grid.distance(solution.x - found.solution.x) < _LARGEST_JUMP
            )
            if not near or grid.tip_forces(solution.x)[0] < 0:
                return False
            plane = solver.plane(found.situation)
            if grid.determinants(solution, plane)[0] * grid.determinants(found.solution, plane)[0] <= 0:
                return False
            moved[row] = replace(found, solution=solution)
        self._known = moved
        return True

    def _force(self, solver: TrialBlocked, found: Blocked, slopes: Array) -> tuple[Array, Array]:
        """Return the force of a blocked shape and its derivatives."""
        grid, p = found.grid, found.solution.p
        derivatives = solver.derivatives.get(grid.intervals, lambda: _force_derivatives(grid, len(self._names)))
        at, start = {}, 0
        for q in grid.problem.fixed:
            at[q.name] = start
            start += q.size
        dp = unit_directions(p.size, [at.get(name) for name in self._names])
        first = at["contact.free_lengths"]
        dp[first : first + slopes.shape[0]] = slopes
        return derivatives(found.solution.x, p, dp)


def _force_derivatives(grid: BlockedGrid, directions: int) -> SolutionDerivatives:
    """Return the derivatives of the wall's force [N]."""
    problem = grid.problem
    out = problem.outputs(x=problem.nlp["x"], p=problem.nlp["p"])
    return SolutionDerivatives(problem, grid.engine.linear, ca.vec(out["tip_forces"])[0], directions)
