"""The linear algebra of one multiple-shooting load case, with its interior nodes eliminated interval by interval.

For J(x) dx = -g, with x = [stretch | x_0 | ... | x_K] and g = [balance | base | gaps | tip] (see `softnlp.loadcase`):

    stretch   the balance depends on nothing else, so d(lambda) = -g_0 / b'(lambda)
    base      d(p, R)_0 = -g_base; d(n, m)_0 stays unknown: six directions and one known part
    interval  dx_k+1 = F_x dx_k + F_c c' d(lambda) + g_k, one Runge-Kutta step with seven forward directions
    tip       six equations for the six unknowns

The same numbers as a sparse factorisation gives, for the cost of one sweep.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp import rod
from softnlp.loadcase import RodFunctions
from softnlp.transcription import MultipleShooting, rk_step

Array = NDArray[np.float64]

_NX = rod.STATE_SIZE
_DIRECTIONS = 7


class CondensedSolver:
    """Solves J dx = -g for a load case with every quantity fixed, transcribed by multiple shooting.

    The fixed values p are those of `softnlp.quantities.quantities(model)`, in order.
    """

    def __init__(self, functions: RodFunctions, method: MultipleShooting) -> None:
        self._intervals = method.intervals
        self._sweep = _sweep_function(functions, method)

    def solve(self, x: Array, p: Array, g: Array) -> Array:
        """Return dx. Raises `numpy.linalg.LinAlgError` where the six tip equations are singular or not finite."""
        K = self._intervals
        directions, tip, turned = (np.asarray(part) for part in self._sweep(x, p, g))
        if not np.all(np.isfinite(tip)):
            raise np.linalg.LinAlgError("the linearised tip equations are not finite")
        base = np.linalg.solve(tip[:, :6], -(tip[:, 6] + g[-6:]))
        known = np.append(base, 1.0)
        states = directions.reshape(_NX, K + 1, _DIRECTIONS) @ known
        return np.concatenate([turned.ravel(), states.T.ravel()])


def _sweep_function(functions: RodFunctions, method: MultipleShooting) -> ca.Function:
    """Return (x, p, g) -> directions (18, 7 (K + 1)), linearised tip (6, 7), d(stretch)."""
    K = method.intervals
    nc = functions.field.size1_in(1)
    step = rk_step(functions.field, method.tableau)

    def sym(name: str, *shape: int) -> ca.SX:
        return ca.SX.sym(name, *shape)

    V, state, gap, c, dc = sym("V", _NX, _DIRECTIONS), sym("x", _NX), sym("gap", _NX), sym("c", nc), sym("dc", nc)
    moves = ca.vertcat(V, ca.horzcat(ca.SX(nc, _DIRECTIONS - 1), dc))
    arrived = ca.jtimes(step(state, c, 1 / K), ca.vertcat(state, c), moves)
    arrived[:, -1] += gap
    advance = ca.Function("advance", [V, state, gap, c, dc], [arrived], {"cse": True}).mapaccum(K)

    tip_residual = functions.tip(state, c, ca.SX.zeros(3), ca.SX.zeros(3))
    tip = ca.Function("tip", [V, state, c, dc], [ca.jtimes(tip_residual, ca.vertcat(state, c), moves)])

    column, stretch = sym("p", functions.section.size1_in(0)), sym("stretch")
    constants, balance, _ = functions.section(column, stretch)
    section = ca.Function(
        "section",
        [column, stretch],
        [constants, ca.jacobian(constants, stretch), ca.jacobian(balance, stretch)],
        {"cse": True},
    )

    x, p = ca.MX.sym("x", 1 + _NX * (K + 1)), ca.MX.sym("p", column.numel())
    g = ca.MX.sym("g", x.numel())
    c_now, c_slope, balance_slope = section(p, x[0])
    d_stretch = -g[0] / balance_slope
    d_constants = c_slope * d_stretch
    nodes = ca.reshape(x[1:], _NX, K + 1)
    gaps = ca.reshape(g[13:-6], _NX, K)
    free = ca.DM.zeros(_NX, 6)
    free[12:, :] = ca.DM.eye(6)
    start = ca.horzcat(ca.MX(free), ca.vertcat(-g[1:13], ca.DM.zeros(6)))
    every = advance(start, nodes[:, :K], gaps, ca.repmat(c_now, 1, K), ca.repmat(d_constants, 1, K))
    last = tip(every[:, -_DIRECTIONS:], nodes[:, K], c_now, d_constants)
    return ca.Function("condensed", [x, p, g], [ca.horzcat(start, every), last, d_stretch])
