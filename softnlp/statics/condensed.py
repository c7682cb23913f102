"""The linear algebra of one multiple-shooting load case, with its interior nodes eliminated interval by interval.

For J(x) dx = -g, with x = [stretch | x_0 | ... | x_K | y] and g = [balance | base | gaps | tip] (see
`softnlp.statics.loadcase`):

    stretch   the balance depends on nothing else, so d(lambda) = -g_0 / b'(lambda)
    base      d(p, R, L_i)_0 = -g_base; d(n, m)_0 stays unknown: six directions and one known part
    interval  dx_k+1 = F_x dx_k + F_c c' d(lambda) + g_k, one Runge-Kutta step with seven forward directions
    tip       6 + n_y equations for d(n, m)_0 and the forces y that the loads add

The same numbers as a sparse factorisation gives, for the cost of one sweep.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.nlp.case import Case
from softnlp.nlp.evaluation import evaluated
from softnlp.nlp.linear import BorderedSolver, LinearSolver, SparseSolver
from softnlp.nlp.problem import CompiledProblem
from softnlp.nlp.transcription import MultipleShooting, Tableau, rk_step
from softnlp.statics.loadcase import LoadCase, RodFunctions, stretch_imbalance
from softnlp.statics.tangents import Tangents, tangents

Array = NDArray[np.float64]

_FORCE = slice(12, 18)
LARGEST = 1e150
"""Entries up to which a matrix counts as finite: their squares are."""


@dataclass(frozen=True, eq=False)
class TipSystem:
    """The last equations: matrix (6 + n_y, d + n_y) times d(N(0), M(0) along d directions, y) = -right.

    directions : (nx, K + 1, d + 1), how the states follow those and, last, the known part. d_stretch : solved.
    """

    matrix: Array
    right: Array
    directions: Array
    d_stretch: float


class CondensedSolver:
    """Solves J dx = -g for a load case with every quantity fixed, transcribed by multiple shooting.

    The fixed values p are those of `functions.declared()`, in order. plane : unit normal of a plane of symmetry through
    +z, in which the shape is held: N(0), M(0) have three directions in it. None: in space, where they have six.
    """

    def __init__(self, functions: RodFunctions, method: MultipleShooting, plane: Array | None = None) -> None:
        self._shape = (functions.state_size, method.intervals + 1)
        rows = 6 + functions.tip_unknowns
        inside = np.eye(rows) if plane is None else plane_directions(plane, rows)[0]
        self._into = inside.T
        self._base = inside[:6, : inside.shape[1] - functions.tip_unknowns]
        self._sweeps: dict[int, ca.Function] = {}
        self._functions, self._method = functions, method

    def tip_system(self, x: Array, p: Array, g: Array | None = None) -> TipSystem:
        """Return the last equations for the residual g, or for none.

        Raises `numpy.linalg.LinAlgError` where they are not finite.
        """
        rows, known = len(self._into[0]), self._base.shape[1]
        given = np.zeros(x.size) if g is None else g
        directions, tip, turned = self._swept(x, p, given[:, None])
        matrix = np.delete(tip, known, axis=1)
        return TipSystem(matrix, tip[:, known] + given[-rows:], directions, float(turned[0, 0]))

    def solve(self, x: Array, p: Array, g: Array) -> Array:
        """Return dx. Raises `numpy.linalg.LinAlgError` where the tip equations are singular or not finite."""
        system = self.tip_system(x, p, g)
        found = np.linalg.solve(self._into @ system.matrix, -(self._into @ system.right))
        known = self._base.shape[1]
        states = system.directions @ np.append(found[:known], 1.0)
        return np.concatenate([[system.d_stretch], states.T.ravel(), found[known:]])

    def solve_many(self, x: Array, p: Array, G: Array) -> Array:
        """Return the columns dx for as many right sides G (n, r) in one sweep. Raises as `solve`."""
        r, rows, known = G.shape[1], len(self._into[0]), self._base.shape[1]
        every, tip, turned = self._swept(x, p, G)
        matrix = np.delete(tip, np.s_[known : known + r], axis=1)
        right = tip[:, known : known + r] + G[-rows:]
        found = np.linalg.solve(self._into @ matrix, -(self._into @ right))
        nx, nodes = self._shape
        states = every[:, :, :known] @ found[:known] + every[:, :, known:]
        return np.concatenate([turned, states.transpose(1, 0, 2).reshape(nx * nodes, r), found[known:]])

    def _swept(self, x: Array, p: Array, G: Array) -> tuple[Array, Array, Array]:
        """Return directions (nx, K + 1, d + r), the linearised tip (rows, d + r + n_y) and d(stretch) (1, r).

        Raises `numpy.linalg.LinAlgError` where the tip equations are not finite.
        """
        r, known = G.shape[1], self._base.shape[1]
        own = tangents(self._functions)
        if own.ready(self._method.intervals):
            with np.errstate(all="ignore"):
                every, tip, turned = self._by_machine(own, x, p, G)
        else:
            directions, tip, turned = evaluated(self._sweep(r), x, p, G)
            every = directions.reshape(*self._shape, known + r)
        if not np.max(np.abs(tip)) < LARGEST:  # nan is not either
            raise np.linalg.LinAlgError("the linearised tip equations are not finite")
        return every, tip, turned

    def _by_machine(self, own: Tangents, x: Array, p: Array, G: Array) -> tuple[Array, Array, Array]:
        """Return what the sweep function does, its intervals differentiated in machine code and then put together."""
        nx, nodes = self._shape
        r, known, rows, K = G.shape[1], self._base.shape[1], len(self._into[0]), nodes - 1
        ends = end_pieces(self._functions, known + r, r)
        n_p = ends.section.size1_in(0)
        c, slope, balance_slope, scales = evaluated(ends.section, p[:n_p], x[:1])
        d_stretch = -G[:1] / balance_slope
        states = x[1 : 1 + nx * nodes].reshape(nodes, nx)
        maps, by_stretch = own.maps(states[:K].T, c[:, 0], slope[:, 0], 1 / K)
        forced = by_stretch[:, :, None] * d_stretch + G[1 + nx - 6 : -rows].reshape(K, nx, r)
        every = chained(self._base, G[1 : 1 + nx - 6], maps, forced)
        y, a = x[1 + nx * nodes :], self._functions.tip_numbers(p)
        (linear,) = evaluated(ends.tip, every[K], states[K], c, slope @ d_stretch, y, a, scales)
        return every.transpose(1, 0, 2), linear, d_stretch

    def _sweep(self, right_sides: int) -> ca.Function:
        """Return the sweep for so many right sides, built at first use."""
        if right_sides not in self._sweeps:
            self._sweeps[right_sides] = _sweep_function(self._functions, self._method, self._base, right_sides)
        return self._sweeps[right_sides]

    def determinant_expression(self, x: Any, p: Any) -> Any:
        """Return the determinant of the tip equations as an expression of symbols or of expressions x, p."""
        _, tip, _ = self._sweep(1).call([x, p, ca.DM.zeros(x.numel())])
        known, columns = self._base.shape[1], tip.shape[1]
        matrix = ca.DM(self._into) @ ca.horzcat(tip[:, :known], tip[:, known + 1 : columns])
        entries = ca.SX.sym("entries", *matrix.shape)
        return ca.Function("determinant", [entries], [ca.det(entries)], {"cse": True})(matrix)

    def tip_moves(self, x: Array, p: Array) -> Array:
        """Return how the tip's state moves when the tip equations are off by given errors, (nx, 6 + n_y)."""
        system = self.tip_system(x, p)
        moves = np.linalg.solve(self._into @ system.matrix, self._into)
        known = self._base.shape[1]
        tip: Array = system.directions[:, -1, :known] @ moves[:known]
        return tip


def chained(base: Array, at_base: Array, maps: Array, forced: Array) -> Array:
    """Return how every node follows the base, and the known part: (K + 1, nx, d + r).

    base : (6, d) directions of N(0), M(0). at_base : (nx - 6, r) residuals of the others there. maps, forced :
    (K, nx, nx), (K, nx, r), what an interval does to a change of its first node and what it adds for each right side.
    """
    (K, nx, r), known = forced.shape, base.shape[1]
    every = np.zeros((K + 1, nx, known + r))
    every[0, _FORCE, :known] = base
    every[0, :12, known:], every[0, 18:, known:] = -at_base[:12], -at_base[12:]
    for k in range(K):
        np.matmul(maps[k], every[k], out=every[k + 1])
        every[k + 1, :, known:] += forced[k]
    return every


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


def linear_solver(problem: CompiledProblem) -> LinearSolver:
    """Return what solves J dx = -g of a square problem: its cases condensed where all are by multiple shooting."""
    solvers = [case_solver(case) for case in problem.cases]
    own = [solver for solver in solvers if solver is not None]
    return BorderedSolver(problem, own) if len(own) == len(solvers) else SparseSolver(problem)


def case_solver(case: Case) -> CondensedSolver | StretchSolver | None:
    """Return what solves a case with every quantity fixed, None where a sparse factorisation has to."""
    if isinstance(case, LoadCase) and case.method is None:
        return StretchSolver(case.functions)
    if isinstance(case, LoadCase) and isinstance(case.method, MultipleShooting):
        return CondensedSolver(case.functions, case.method)
    return None


class StretchSolver:
    """Solves the stretch balance of a shape without loads, whose stretch is all that is unknown."""

    def __init__(self, functions: RodFunctions) -> None:
        self._imbalance = stretch_imbalance(functions)

    def solve_many(self, x: Array, p: Array, G: Array) -> Array:
        """Return the columns dx (1, r). Raises `numpy.linalg.LinAlgError` at the end of the branch."""
        slope = float(evaluated(self._imbalance, p, x)[1][0, 0])
        if not (np.isfinite(slope) and slope):
            raise np.linalg.LinAlgError("the slope of the stretch balance is zero or not finite")
        return -np.asarray(G) / slope


@dataclass(frozen=True, eq=False)
class EndPieces:
    """The linearised tip and section, and which of the constants follow the stretch."""

    tip: ca.Function
    section: ca.Function
    rows: list[int]


@lru_cache(maxsize=16)
def end_pieces(functions: RodFunctions, columns: int, right_sides: int) -> EndPieces:
    """Return what is linearised beside the intervals; shared by every grid.

    columns : directions, of which the last `right_sides` carry a change of the constants.
    """
    ny, r = functions.tip_unknowns, right_sides
    column, stretch = ca.SX.sym("p", functions.section.size1_in(0)), ca.SX.sym("stretch")
    constants, balance, scales = functions.section(column, stretch)
    c_slope = ca.jacobian(constants, stretch)
    section = ca.Function(
        "section",
        [column, stretch],
        [constants, ca.densify(c_slope), ca.jacobian(balance, stretch), scales],
    )
    rows = list(c_slope.sparsity().row())
    V, state, c, dc, moves = _moves(functions, columns, r, rows)
    y, a, units = ca.SX.sym("y", ny), ca.SX.sym("a", functions.tip.size1_in(3)), ca.SX.sym("units", 2)
    tip_residual = functions.tip(state, c, y, a, units)
    linear = ca.horzcat(ca.jtimes(tip_residual, ca.vertcat(state, c), moves), ca.jacobian(tip_residual, y))
    tip = ca.Function("tip", [V, state, c, dc, y, a, units], [ca.densify(linear)])
    return EndPieces(tip, section, rows)


def _moves(functions: RodFunctions, columns: int, right_sides: int, rows: list[int]) -> tuple[ca.SX, ...]:
    """Return symbols for directions, state, constants, their change, and how state and constants move together."""
    nx, nc, r = functions.state_size, functions.field.size1_in(1), right_sides
    V, state = ca.SX.sym("V", nx, columns), ca.SX.sym("x", nx)
    c, dc = ca.SX.sym("c", nc), ca.SX.sym("dc", nc, r)
    moving = ca.SX(nc, r)
    moving[rows, :] = dc[rows, :]
    return V, state, c, dc, ca.vertcat(V, ca.horzcat(ca.SX(nc, columns - r), moving))


@lru_cache(maxsize=16)
def _advance(functions: RodFunctions, tableau: Tableau, columns: int, right_sides: int) -> ca.Function:
    """Return one linearised step, shared by every grid. columns, right_sides : as of `end_pieces`; these carry gaps."""
    rows = end_pieces(functions, columns, right_sides).rows
    V, state, c, dc, moves = _moves(functions, columns, right_sides, rows)
    gap, h = ca.SX.sym("gap", functions.state_size, right_sides), ca.SX.sym("h")
    arrived = ca.jtimes(rk_step(functions.field, tableau)(state, c, h), ca.vertcat(state, c), moves)
    arrived[:, columns - right_sides :] += gap
    return ca.Function("advance", [V, state, gap, c, dc, h], [arrived])


def _sweep_function(
    functions: RodFunctions, method: MultipleShooting, base_directions: Array, right_sides: int
) -> ca.Function:
    """Return (x, p, g) -> directions (nx, (d + r) (K + 1)), linearised tip (rows, d + r + n_y), d(stretch) (1, r).

    r : right sides, the columns of g.
    """
    K, nx, ny, r = method.intervals, functions.state_size, functions.tip_unknowns, right_sides
    columns = base_directions.shape[1] + r
    advance, ends = _advance(functions, method.tableau, columns, r), end_pieces(functions, columns, r)
    tip, section = ends.tip, ends.section
    n_p, every = section.size1_in(0), sum(q.size for q in functions.declared().values())
    x, p = ca.MX.sym("x", 1 + nx * (K + 1) + ny), ca.MX.sym("p", every)
    g = ca.MX.sym("g", x.numel(), r)
    c_now, c_slope, balance_slope, scales_now = section(p[:n_p], x[0])
    d_stretch = -g[0, :] / balance_slope
    d_constants = c_slope @ d_stretch
    nodes = ca.reshape(x[1 : 1 + nx * (K + 1)], nx, K + 1)
    base = g[1 : 1 + nx - 6, :]
    last_gap = x.numel() - 6 - ny
    by_side = [ca.reshape(g[1 + nx - 6 : last_gap, side], nx, K) for side in range(r)]
    gaps = ca.horzcat(*by_side)[:, np.arange(r * K).reshape(r, K).T.ravel().tolist()]  # sides of one interval together
    free = ca.DM.zeros(nx, columns - r)
    free[_FORCE, :] = ca.DM(base_directions)
    held = ca.vertcat(-base[:12, :], ca.DM.zeros(6, r), -base[12:, :])
    start = ca.horzcat(ca.MX(free), held)
    steps = advance.mapaccum(K)
    swept = steps(start, nodes[:, :K], gaps, ca.repmat(c_now, 1, K), ca.repmat(d_constants, 1, K), ca.DM.ones(1, K) / K)
    a = functions.tip_numbers(p)
    last = tip(swept[:, -columns:], nodes[:, K], c_now, d_constants, x[x.numel() - ny :], a, scales_now)
    return ca.Function("condensed", [x, p, g], [ca.horzcat(start, swept), last, d_stretch])
