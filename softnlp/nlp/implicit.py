"""Exact derivatives of a solution by the quantities that are fixed in it, by the implicit function theorem.

A solution x(p) keeps g(x, p) = 0, so J dx/dp = -dg/dp with J the Jacobian that Newton's method used: one linearised
sweep, or one sparse factorisation, with as many right sides as there are quantities. What an output z(x, p) does
follows from it, dz/dp = z_x dx/dp + z_p. These are the derivatives of the numbers that the solver returns on its grid.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import IllPosedError, nearest
from softnlp.base.quantity import Quantity
from softnlp.nlp.evaluation import evaluated
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

    def __init__(
        self, problem: CompiledProblem, names: Sequence[str], linear: LinearSolver | ManySidedSolver | None = None
    ) -> None:
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
        self.linear = linear if isinstance(linear, ManySidedSolver) else SparseSolver(problem)
        chosen = [start[q.name] + k for q in self.quantities for k in range(q.size)]
        self.columns = np.array(chosen, dtype=int)
        x, p, g = (problem.nlp[name] for name in "xpg")
        seeds = ca.DM(columns, len(chosen))
        for k, column in enumerate(chosen):
            seeds[column, k] = 1.0
        by_theta = ca.horzcat(ca.jtimes(g, p, seeds), g)
        self._right = ca.Function("residual_by_theta", [x, p], [ca.densify(by_theta)])
        self._seeds = seeds

    @cached_property
    def _outputs(self) -> tuple[tuple[str, ...], ca.Function]:
        """The outputs' names, and the function (x, p, dx) of their derivatives; built at first use."""
        x, p = self.problem.nlp["x"], self.problem.nlp["p"]
        dx = ca.MX.sym("dx", x.numel(), self.columns.size)
        results = self.problem.outputs(x=x, p=p)
        moved = [ca.jtimes(ca.vec(z), x, dx) + ca.jtimes(ca.vec(z), p, self._seeds) for z in results.values()]
        # Forward, so that a bending angle without a derivative, of a straight robot, leaves the others theirs.
        return tuple(results), ca.Function("outputs_by_theta", [x, p, dx], [ca.densify(m) for m in moved])

    def states(self, x: Array, p: Array) -> Array:
        """Return d x / d theta (n, k) at a solution.

        Raises `numpy.linalg.LinAlgError` where the Jacobian is singular: at a fold or a branch point.
        """
        right = self.right(x, p)[:, :-1]
        return self.linear.solve_many(x, p, right) if right.size else right

    def right(self, x: Array, p: Array) -> Array:
        """Return d g / d theta, x held, and the residual g behind it (n, k + 1).

        They are the right sides that give d x / d theta and Newton's step.
        """
        return evaluated(self._right, x, p)[0]

    def outputs(self, x: Array, p: Array, moves: Array | None = None) -> dict[str, Array]:
        """Return d output / d theta (size, k) by the name of the output; matrices column by column.

        moves : of `states` at the same point, when they are known. Raises as `states`.
        """
        dx = self.states(x, p) if moves is None else moves
        names, moved = self._outputs
        return {name: np.asarray(value) for name, value in zip(names, moved.call([x, p, dx]), strict=True)}
