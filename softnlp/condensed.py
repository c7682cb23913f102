"""The linear algebra of one multiple-shooting load case, with its interior nodes eliminated interval by interval.

For J(x) dx = -g, with x = [stretch | x_0 | ... | x_K | y] and g = [balance | base | gaps | tip] (see
`softnlp.loadcase`):

    stretch   the balance depends on nothing else, so d(lambda) = -g_0 / b'(lambda)
    base      d(p, R, L_i)_0 = -g_base; d(n, m)_0 stays unknown: six directions and one known part
    interval  dx_k+1 = F_x dx_k + F_c c' d(lambda) + g_k, one Runge-Kutta step with seven forward directions
    tip       6 + n_y equations for d(n, m)_0 and the forces y that the tip conditions add

The same numbers as a sparse factorisation gives, for the cost of one sweep.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.loadcase import RodFunctions
from softnlp.transcription import MultipleShooting, rk_step

Array = NDArray[np.float64]

_DIRECTIONS = 7
_FORCE = slice(12, 18)


@dataclass(frozen=True, eq=False)
class TipSystem:
    """The last equations: matrix (6 + n_y square) times d(n(0), m(0), y) = -right.

    directions : (nx, K + 1, 7), how the states follow d(n, m)_0 and, last, the known part. d_stretch : solved.
    """

    matrix: Array
    right: Array
    directions: Array
    d_stretch: float


class CondensedSolver:
    """Solves J dx = -g for a load case with every quantity fixed, transcribed by multiple shooting.

    The fixed values p are those of `functions.declared()`, in order. plane : unit normal of a plane of symmetry through
    +z, in which the shape is held: of n(0), m(0) only what keeps it there moves. None: in space.
    """

    def __init__(
        self, functions: RodFunctions, method: MultipleShooting, plane: Array | None = None, *, like: ca.Function = None
    ) -> None:
        self._intervals = method.intervals
        self._nx = functions.state_size
        self.sweep = like or _sweep_function(functions, method)
        self._tip_rows = 6 + functions.tip_unknowns
        self._plane = plane

    def tip_system(self, x: Array, p: Array, g: Array) -> TipSystem:
        """Return the last equations. Raises `numpy.linalg.LinAlgError` where they are not finite."""
        directions, tip, turned = (np.asarray(part) for part in self.sweep(x, p, g))
        if not np.all(np.isfinite(tip)):
            raise np.linalg.LinAlgError("the linearised tip equations are not finite")
        every = directions.reshape(self._nx, self._intervals + 1, _DIRECTIONS)
        known = _DIRECTIONS - 1
        matrix = np.delete(tip, known, axis=1)
        return TipSystem(matrix, tip[:, known] + g[-self._tip_rows :], every, float(turned[0, 0]))

    def solve(self, x: Array, p: Array, g: Array) -> Array:
        """Return dx. Raises `numpy.linalg.LinAlgError` where the tip equations are singular or not finite."""
        system = self.tip_system(x, p, g)
        if self._plane is None:
            found = np.linalg.solve(system.matrix, -system.right)
        else:
            inside = plane_directions(self._plane, len(system.right))[0]
            found = inside @ np.linalg.solve(inside.T @ system.matrix @ inside, -(inside.T @ system.right))
        states = system.directions @ np.append(found[:6], 1.0)
        return np.concatenate([[system.d_stretch], states.T.ravel(), found[6:]])


def plane_directions(normal: Array, size: int) -> tuple[Array, Array]:
    """Return the directions of (force, moment, more forces) in a plane through +z and those out of it, as columns.

    In the plane: force along it and +z, moment along its normal, and what follows; out of it: the other three. They
    are directions of the tip equations too.
    """
    up = np.array([0.0, 0.0, 1.0])
    along = np.cross(normal, up)
    inside, outside = np.zeros((size, size - 3)), np.zeros((size, 3))
    inside[:3, 0], inside[:3, 1], inside[3:6, 2] = along, up, normal
    inside[6:, 3:] = np.eye(size - 6)
    outside[:3, 0], outside[3:6, 1], outside[3:6, 2] = normal, along, up
    return inside, outside


def _sweep_function(functions: RodFunctions, method: MultipleShooting) -> ca.Function:
    """Return (x, p, g) -> directions (nx, 7 (K + 1)), linearised tip (rows, 7 + n_y), d(stretch)."""
    K, nx, ny = method.intervals, functions.state_size, functions.tip_unknowns
    nc, na = functions.field.size1_in(1), functions.tip.size1_in(5)
    step = rk_step(functions.field, method.tableau)

    def sym(name: str, *shape: int) -> ca.SX:
        return ca.SX.sym(name, *shape)

    V, state, gap, c, dc = sym("V", nx, _DIRECTIONS), sym("x", nx), sym("gap", nx), sym("c", nc), sym("dc", nc)
    moves = ca.vertcat(V, ca.horzcat(ca.SX(nc, _DIRECTIONS - 1), dc))
    arrived = ca.jtimes(step(state, c, 1 / K), ca.vertcat(state, c), moves)
    arrived[:, -1] += gap
    advance = ca.Function("advance", [V, state, gap, c, dc], [arrived], {"cse": True}).mapaccum(K)

    y, a, units = sym("y", ny), sym("a", na), sym("units", 2)
    tip_residual = functions.tip(state, c, ca.SX.zeros(3), ca.SX.zeros(3), y, a, units)
    by_state = ca.jtimes(tip_residual, ca.vertcat(state, c), moves)
    by_forces = ca.densify(ca.jacobian(tip_residual, y))
    linear = ca.horzcat(by_state, by_forces)
    tip = ca.Function("tip", [V, state, c, dc, y, a, units], [ca.densify(linear)], {"cse": True})

    column, stretch = sym("p", functions.section.size1_in(0)), sym("stretch")
    constants, balance, scales = functions.section(column, stretch)
    section = ca.Function(
        "section",
        [column, stretch],
        [constants, ca.jacobian(constants, stretch), ca.jacobian(balance, stretch), scales],
        {"cse": True},
    )

    x, p = ca.MX.sym("x", 1 + nx * (K + 1) + ny), ca.MX.sym("p", column.numel() + na)
    g = ca.MX.sym("g", x.numel())
    c_now, c_slope, balance_slope, scales_now = section(p[: column.numel()], x[0])
    d_stretch = -g[0] / balance_slope
    d_constants = c_slope * d_stretch
    nodes = ca.reshape(x[1 : 1 + nx * (K + 1)], nx, K + 1)
    base = g[1 : 1 + nx - 6]
    gaps = ca.reshape(g[1 + nx - 6 : g.numel() - 6 - ny], nx, K)
    free = ca.DM.zeros(nx, 6)
    free[_FORCE, :] = ca.DM.eye(6)
    held = ca.vertcat(-base[:12], ca.DM.zeros(6), -base[12:])
    start = ca.horzcat(ca.MX(free), held)
    every = advance(start, nodes[:, :K], gaps, ca.repmat(c_now, 1, K), ca.repmat(d_constants, 1, K))
    last = tip(
        every[:, -_DIRECTIONS:], nodes[:, K], c_now, d_constants, x[x.numel() - ny :], p[column.numel() :], scales_now
    )
    return ca.Function("condensed", [x, p, g], [ca.horzcat(start, every), last, d_stretch])
