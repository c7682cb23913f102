"""The free shape along a path towards a blocked pose: chamber lengths and where the contact point would be."""

from __future__ import annotations

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.loadcase import RodFunctions
from softnlp.rod import STATE_SIZE
from softnlp.studies.statics import PoseSolver
from softnlp.studies.wall import Situation

Array = NDArray[np.float64]

_NEWTON_STEPS = 30


class FreeShapes:
    """Free shapes of one model, each found from the last: an arc in closed form, or Newton where loads act."""

    def __init__(self, poses: PoseSolver, functions: RodFunctions, intervals: int, tip_cap: float) -> None:
        self._poses = poses
        self._functions = functions
        self._intervals = intervals
        self._tip_cap = tip_cap
        self._last_x: Array | None = None
        self._last_stretch = 1.0
        column, stretch = ca.SX.sym("p", functions.section.size1_in(0)), ca.SX.sym("stretch")
        _, balance, _ = functions.section(column, stretch)
        self._balance = ca.Function("balance", [column, stretch], [balance, ca.jacobian(balance, stretch)])

    def begin(self, stretch: float, x: Array | None) -> None:
        """Start again from a known stretch, and from the pose problem's solution x there if it is known."""
        self._last_stretch, self._last_x = stretch, x

    def stretch(self, column: Array) -> float:
        """Return the root of the stretch balance next to the last one."""
        found = self._last_stretch
        for _ in range(_NEWTON_STEPS):
            balance, slope = self._balance(column, found)
            change = -float(balance) / float(slope)
            found += change
            if not abs(change) > 1e-13:
                break
        self._last_stretch = found
        return found

    def tip(self, situation: Situation) -> tuple[Array, Array]:
        """Return the free chamber lengths (N,) and the contact point (3,) [m]; nan where it is not found."""
        values = self._poses.values(situation.pressure, situation.loads)
        column = self._poses.column(values)
        stretch = self.stretch(column)
        L_0 = float(self._poses.model.robot.length)
        if not situation.is_loaded:
            state = np.asarray(self._functions.arc(column, stretch, 1.0)).ravel()
            return state[STATE_SIZE:] * L_0, (state[:3] + self._tip_cap / L_0 * state[9:12]) * L_0
        grid = self._poses.grid(self._intervals)
        p = grid.problem.pack(values)
        guess = self._last_x if self._last_x is not None else self._poses.arc_guess(grid, p, stretch)
        solution = grid.stepper.solve(p, guess)
        if not solution.holds(10 * grid.stepper.tolerance):
            N = self._poses.model.robot.chambers
            return np.full(N, np.nan), np.full(3, np.nan)
        self._last_x = solution.x
        found = grid.problem.outputs(x=solution.x, p=p)
        axis = np.asarray(found["tip_rotation"])[:, 2]
        point = np.asarray(found["tip_position"]).ravel() + self._tip_cap * axis
        return np.asarray(found["chamber_lengths"]).ravel(), point
