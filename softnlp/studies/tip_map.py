"""From pressures to the tip and its derivatives by them: arcs in closed form, and Newton's method on one grid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.model.rod import STATE_SIZE, Loads
from softnlp.nlp.solver import Solution
from softnlp.statics.branch import stretch_on_branch
from softnlp.statics.pose_grid import Solved
from softnlp.statics.solver import PoseSolver
from softnlp.studies.derivatives import PoseDerivatives

Array = NDArray[np.float64]

_NEWTON_STEPS = 30
_LOST, _NEAR = 1e4, 1e-7  # scaled residuals: nothing leads back from it; one more step ends at round-off


@dataclass(frozen=True, eq=False)
class TipPoint:
    """The tip at pressures (sets,) [Pa]: state (12,) is p [L_0] and R column by column, slope (12, sets) d state / dP.

    x, dx : the solution on a grid and its derivative; empty for an arc.
    """

    pressure: Array
    state: Array
    slope: Array
    x: Array
    dx: Array


class TipMap(Protocol):
    """What inverse kinematics asks of a model."""

    def at(self, pressure: Array, near: TipPoint | None) -> TipPoint | None:
        """Return the tip at a pressure, from one nearby where there is one; None where it is not found."""
        ...


class ArcMap:
    """The tip of the robot without gravity and tip load, exact."""

    def __init__(self, poses: PoseSolver) -> None:
        self._poses = poses
        functions = poses.functions
        sets = poses.model.robot.chamber_sets
        column, stretch = ca.SX.sym("p", functions.section.size1_in(0)), ca.SX.sym("stretch")
        P = column[:sets]
        _, balance, _ = functions.section(column, stretch)
        self._balance = ca.Function("balance", [column, stretch], [balance, ca.jacobian(balance, stretch)])
        tip = functions.arc(column, stretch, 1.0)[:12]
        by_pressure = -ca.jacobian(balance, P) / ca.jacobian(balance, stretch)
        slope = ca.jacobian(tip, P) + ca.jacobian(tip, stretch) @ by_pressure
        self._tip = ca.Function("tip", [column, stretch], [tip, ca.densify(slope)], {"cse": True})

    def _column(self, pressure: Array) -> Array:
        return self._poses.column({"pressure": pressure})

    def at(self, pressure: Array, near: TipPoint | None) -> TipPoint | None:
        """Return the tip of the arc; the stretch is the root next to that of `near`."""
        column = self._column(pressure)
        if near is None:
            branch = stretch_on_branch(self._poses.branch, column, pressure)
            if not branch.status.has_solution:
                return None
            stretch = branch.stretch
        else:
            stretch = float(near.x[0])
            for _ in range(_NEWTON_STEPS):
                balance, slope = self._balance(column, stretch)
                change = -float(balance) / float(slope)
                stretch += change
                if not abs(change) > 1e-13:
                    break
            if not (stretch >= 0.5 and abs(float(self._balance(column, stretch)[0])) < 1e-9):
                return None
        state, by_pressure = self._tip(column, stretch)
        return TipPoint(pressure, np.asarray(state).ravel(), np.asarray(by_pressure), np.array([stretch]), np.zeros(0))


class GridMap:
    """The tip of the loaded robot on one grid, followed from point to point."""

    def __init__(self, derivatives: PoseDerivatives, intervals: int, loads: Loads) -> None:
        poses = derivatives.poses
        self.intervals = intervals
        self._poses = poses
        self._grid = poses.grid(intervals)
        self._derivatives = derivatives.on_grid(intervals, ("pressure",))
        self._loads = loads

    def at(self, pressure: Array, near: TipPoint | None) -> TipPoint | None:
        """Return the tip of the solution that Newton's method reaches from what `near` predicts, or from the arc."""
        p = self._grid.problem.pack(self._poses.values(pressure, self._loads))
        if near is None:
            branch = stretch_on_branch(self._poses.branch, p, pressure)
            if not branch.status.has_solution:
                return None
            guess = self._poses.arc_guess(self._grid, p, branch.stretch)
        else:
            guess = near.x + near.dx @ (pressure - near.pressure)
        return self._newton(pressure, guess, p)

    def of(self, solved: Solved) -> TipPoint | None:
        """Return the tip of a pose solved on any grid, on this map's grid."""
        pressure = solved.solution.p[: self._poses.model.robot.chamber_sets]
        guess = solved.solution.x if solved.grid is self._grid else self._poses.transfer(solved, self._grid)
        return self._newton(pressure, guess, solved.solution.p)

    def solved(self, point: TipPoint) -> Solved:
        """Return a point as a pose on this grid, not examined, for going on to another grid."""
        p = self._grid.problem.pack(self._poses.values(point.pressure, self._loads))
        solution, nodes = Solution(point.x, p, 0.0, 0, ""), self._grid.nodes(point.x)
        return Solved(self._grid, solution, nodes, nodes, self._grid.constants(solution), 0.0, 0.0, stable=True)

    def _newton(self, pressure: Array, x: Array, p: Array) -> TipPoint | None:
        """Take Newton steps, each with the derivatives by pressure; those of the last step belong to the point."""
        residual = self._grid.problem.residual
        for _ in range(_NEWTON_STEPS):
            g = np.asarray(residual(x, p)).ravel()
            size = float(np.max(np.abs(g)))
            if not size < _LOST:
                return None
            try:
                step, dx = self._derivatives.newton(x, p, g)
            except np.linalg.LinAlgError:
                return None
            x = x + step
            if size < _NEAR:  # the step leaves the square of it
                tip = slice(x.size - STATE_SIZE, x.size - STATE_SIZE + 12)
                return TipPoint(pressure, x[tip], dx[tip], x, dx)
        return None
