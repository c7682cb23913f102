"""Linear algebra of Newton's method: sparse factorisation of any square problem, and cases joined by a border."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from itertools import pairwise
from typing import Any, Protocol, runtime_checkable

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import IllPosedError
from softnlp.nlp.problem import CompiledProblem

Array = NDArray[np.float64]


_CLOSE = 1e-2  # of a scaled unknown: how far a factorisation may be from where it corrects


class LinearSolver(Protocol):
    """Solves J(x, p) dx = -g where a problem's structure allows better than a sparse factorisation."""

    def solve(self, x: Array, p: Array, g: Array) -> Array:
        """Return dx; raises `numpy.linalg.LinAlgError` where J is singular."""
        ...


@runtime_checkable
class ManySidedSolver(Protocol):
    """A linear solver that takes many right sides for the cost of one factorisation or sweep."""

    def solve_many(self, x: Array, p: Array, G: Array) -> Array:
        """Return the columns dx for as many right sides G (n, r). Raises as `LinearSolver.solve`."""
        ...


class SparseSolver:
    """Solves J dx = -g of any square problem by sparse LU factorisation.

    entries : those of the Jacobian at (x, p), in the problem's order, where they are to be had faster than from it.
    """

    def __init__(self, problem: CompiledProblem, entries: Callable[[Array, Array], Array | None] | None = None) -> None:
        self._problem, self._entries = problem, entries
        self._last: tuple[Array, Array, Any] | None = None  # where the last factorisation was made, and that

    @cached_property
    def _pattern(self) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """The rows of the entries of J, and where each column begins."""
        pattern = self._problem.jacobian.sparsity_out(0)
        return np.array(pattern.row(), np.int32), np.array(pattern.colind(), np.int32)

    def solve(self, x: Array, p: Array, g: Array) -> Array:
        """Return dx. Raises `numpy.linalg.LinAlgError` where J is singular or not finite."""
        return self.solve_many(x, p, g)

    def solve_many(self, x: Array, p: Array, G: Array) -> Array:
        """Return the columns dx for as many right sides G (n, r), of one factorisation. Raises as `solve`."""
        entries = None if self._entries is None else self._entries(x, p)
        if entries is None:
            entries = np.array(self._problem.jacobian.call([x, p])[0].nonzeros())
        factors = _factors(entries, *self._pattern)
        self._last = np.array(x), np.array(p), factors
        return np.asarray(factors.solve(-np.asarray(G, dtype=float)))


def sparse_solve(J: ca.DM, right: Array) -> Array:
    """Return J^-1 right (n,). Raises `numpy.linalg.LinAlgError` where J is singular or not finite."""
    pattern = J.sparsity()
    factors = _factors(np.array(J.nonzeros()), np.array(pattern.row(), np.int32), np.array(pattern.colind(), np.int32))
    return np.asarray(factors.solve(np.asarray(right, dtype=float)))


def _factors(entries: Array, rows: NDArray[np.int32], columns: NDArray[np.int32]) -> Any:
    """Return the sparse LU factors of a square matrix, by columns."""
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import splu

    size = len(columns) - 1
    if not np.all(np.isfinite(entries)):
        raise np.linalg.LinAlgError("the Jacobian is not finite")
    try:
        return splu(csc_matrix((entries, rows, columns), shape=(size, size)))
    except RuntimeError as error:
        raise np.linalg.LinAlgError(str(error)) from error


class LastFactors:
    """Solves with the factorisation that a sparse solver made last, where that was near: for corrections alone."""

    def __init__(self, solver: SparseSolver) -> None:
        self._solver = solver

    def solve(self, x: Array, p: Array, g: Array) -> Array:
        """Return dx, of a Jacobian within `_CLOSE` of x. Raises as `SparseSolver.solve`."""
        last = self._solver._last
        if last is None or not np.array_equal(last[1], p) or np.max(np.abs(last[0] - x)) > _CLOSE:
            return self._solver.solve(x, p, g)
        return np.asarray(last[2].solve(-np.asarray(g, dtype=float)))


class BorderedSolver:
    """Solves J dx = -g of cases that freed quantities and constraints join, each case by a solver of its own.

    With x = [theta | x_1 | ... | x_m], theta free, and g = [g_1 | ... | g_m | c],

        J = [ B_1  A_1              ]      A_i : solved by the case's own solver
            [ ...  K_ij  ...  A_m   ]      K_ij, j < i : what case i takes of the states of those before it
            [ D    E_1   ...  E_m   ]      D, E : the constraints

    Every right side and every column of B is taken through the cases in order, one directional derivative of g_i for
    what came before; theta follows from the constraints, as many equations as it has entries.

    solvers : one a case, for (x_i, the case's own values, g_i).

    Raises
    ------
    IllPosedError
        For a problem that is not square.

    """

    def __init__(self, problem: CompiledProblem, solvers: Sequence[ManySidedSolver]) -> None:
        if not problem.is_square:
            raise IllPosedError("a problem with an objective or an inequality has no Jacobian to solve with")
        self._problem, self._solvers = problem, tuple(solvers)
        sizes = [case.residuals.numel() for case in problem.cases]
        self._free = problem.free_size
        ends = np.cumsum([0, *sizes])
        self._rows = [slice(int(a), int(b)) for a, b in pairwise(ends)]
        self._functions: dict[tuple[int, int], ca.Function] = {}
        self._constraints = slice(int(ends[-1]), problem.nlp["g"].numel())

    def solve(self, x: Array, p: Array, g: Array) -> Array:
        """Return dx. Raises `numpy.linalg.LinAlgError` where J, or a case's own part of it, is singular."""
        return self.solve_many(x, p, np.asarray(g)[:, None])[:, 0]

    def solve_many(self, x: Array, p: Array, G: Array) -> Array:
        """Return the columns dx for as many right sides G (n, r). Raises as `solve`."""
        n, k, r = x.size, self._free, G.shape[1]
        dx = np.zeros((n, r + k))
        dx[:k, r:] = np.eye(k)
        right = np.column_stack([G, np.zeros((len(G), k))])
        columns = [np.asarray(c).ravel() for c in self._problem.case_columns.call([x, p])]
        for i, (rows, solver) in enumerate(zip(self._rows, self._solvers, strict=True)):
            states = slice(k + rows.start, k + rows.stop)
            moved = right[rows] + (np.asarray(self._moved(i, r + k)(x, p, dx)) if i or k else 0.0)
            dx[states] = solver.solve_many(x[states], columns[i], moved)
        if not k:
            return dx
        moved = right[self._constraints] + np.asarray(self._moved(len(self._rows), r + k)(x, p, dx))
        theta = np.linalg.solve(moved[:, r:], -moved[:, :r])
        solved: Array = dx[:, :r] + dx[:, r:] @ theta
        return solved

    def _moved(self, part: int, columns: int) -> ca.Function:
        """Return (x, p, dx) -> how the rows of a case, or the constraints behind them, change; built at first use."""
        if (part, columns) not in self._functions:
            rows = [*self._rows, self._constraints][part]
            x, p, g = (self._problem.nlp[name] for name in "xpg")
            dx = ca.MX.sym("dx", x.numel(), columns)
            moved = ca.densify(ca.jtimes(g[rows], x, dx))
            self._functions[part, columns] = ca.Function("moved", [x, p, dx], [moved])
        return self._functions[part, columns]
