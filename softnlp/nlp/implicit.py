"""Exact derivatives of a solution by the quantities that are fixed in it, by the implicit function theorem.

A solution x(p) keeps g(x, p) = 0, so J dx/dp = -dg/dp with J the Jacobian that Newton's method used: one linearised
sweep, or one sparse factorisation, with as many right sides as there are quantities. What an output z(x, p) does
follows from it, dz/dp = z_x dx/dp + z_p. These are the derivatives of the numbers that the solver returns on its grid.
"""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import IllPosedError, nearest
from softnlp.base.quantity import Quantity
from softnlp.nlp.linear import LinearSolver, ManySidedSolver, SparseSolver
from softnlp.nlp.problem import CompiledProblem

Array = NDArray[np.float64]


class ImplicitDerivatives:
    """d x / d theta and d outputs / d theta of a square problem, for chosen fixed quantities; compiled once.

    names : of fixed quantities of the problem; theta stacks their entries, in this order, SI. linear : what the
    problem is solved with, where its structure allows better than a sparse factorisation.

    Raises
    ------
    IllPosedError
        For a name that is not a fixed quantity of the problem, and for a problem that is not square.

    """

    def __init__(self, problem: CompiledProblem, names: Sequence[str], linear: LinearSolver | None = None) -> None:
        if not problem.is_square:
            raise IllPosedError("a problem with an objective or an inequality is not differentiated; fix what is free")
        start, columns = {}, 0
        for q in problem.fixed:
            start[q.name] = columns
            columns += q.size
        by_name = {q.name: q for q in problem.fixed}
        for name in names:
            if name not in by_name:
                raise IllPosedError(f"'{name}' is not a fixed quantity of this problem{nearest(name, by_name)}")
        self.problem = problem
        self.quantities: tuple[Quantity, ...] = tuple(by_name[name] for name in dict.fromkeys(names))
        self._linear = linear if isinstance(linear, ManySidedSolver) else SparseSolver(problem)
        chosen = [start[q.name] + k for q in self.quantities for k in range(q.size)]
        self.columns = np.array(chosen, dtype=int)
        x, p, g = (problem.nlp[name] for name in "xpg")
        seeds = ca.DM(columns, len(chosen))
        for k, column in enumerate(chosen):
            seeds[column, k] = 1.0
        self._residual = ca.Function("residual_by_theta", [x, p], [ca.densify(ca.jtimes(g, p, seeds))])
        dx = ca.MX.sym("dx", x.numel(), len(chosen))
        results = problem.outputs(x=x, p=p)
        self._names = tuple(results)
        moved = [ca.jtimes(ca.vec(z), x, dx) + ca.jtimes(ca.vec(z), p, seeds) for z in results.values()]
        # Forward, so that a bending angle without a derivative, of a straight robot, leaves the others theirs.
        self._outputs = ca.Function("outputs_by_theta", [x, p, dx], [ca.densify(m) for m in moved])

    def states(self, x: Array, p: Array) -> Array:
        """Return d x / d theta (n, k) at a solution.

        Raises `numpy.linalg.LinAlgError` where the Jacobian is singular: at a fold or a branch point.
        """
        return self._solved(x, p, np.asarray(self._residual(x, p)))

    def newton(self, x: Array, p: Array, g: Array) -> tuple[Array, Array]:
        """Return Newton's step (n,) for the residual g at x and d x / d theta (n, k), for the cost of one of them.

        Raises as `states`.
        """
        moves = self._solved(x, p, np.column_stack([np.asarray(self._residual(x, p)), g]))
        return moves[:, -1], moves[:, :-1]

    def _solved(self, x: Array, p: Array, G: Array) -> Array:
        """Return -J^-1 G."""
        return self._linear.solve_many(x, p, G) if G.size else G

    def outputs(self, x: Array, p: Array, moves: Array | None = None) -> dict[str, Array]:
        """Return d output / d theta (size, k) by the name of the output; matrices column by column.

        moves : of `states` at the same point, when they are known. Raises as `states`.
        """
        dx = self.states(x, p) if moves is None else moves
        return {
            name: np.asarray(value) for name, value in zip(self._names, self._outputs.call([x, p, dx]), strict=True)
        }
