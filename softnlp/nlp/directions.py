"""Derivatives of a solution of g(x, p) = 0 by its fixed values p: dx = -J^-1 g_p dp."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.nlp.linear import LinearSolver, ManySidedSolver, SparseSolver
from softnlp.nlp.problem import CompiledProblem

Array = NDArray[np.float64]


class SolutionDerivatives:
    """How the solutions of a square problem, and expressions of (x, p), move along directions of p.

    observed : column of MX expressions of the problem's x and p. directions : how many columns a call takes.
    """

    def __init__(self, problem: CompiledProblem, linear: LinearSolver | None, observed: ca.MX, directions: int) -> None:
        self._linear = linear if isinstance(linear, ManySidedSolver) else SparseSolver(problem)
        x, p, g = (problem.nlp[name] for name in "xpg")
        dx, dp = ca.MX.sym("dx", x.numel(), directions), ca.MX.sym("dp", p.numel(), directions)
        moved = ca.jtimes(observed, x, dx) + ca.jtimes(observed, p, dp)
        self._equations = ca.Function("equations", [x, p, dp], [ca.densify(ca.jtimes(g, p, dp))])
        self._observed = ca.Function("observed", [x, p, dx, dp], [ca.densify(observed), ca.densify(moved)])

    def __call__(self, x: Array, p: Array, dp: Array) -> tuple[Array, Array]:
        """Return the observed values (m,) at a solution and their derivatives (m, directions)."""
        dx = self._linear.solve_many(x, p, np.asarray(self._equations(x, p, dp)))
        values, slopes = self._observed(x, p, dx, dp)
        return np.asarray(values).ravel(), np.asarray(slopes)


def unit_directions(size: int, positions: Sequence[int | None]) -> Array:
    """Return columns of (size, n) that move one entry each; none of them where the position is None."""
    directions = np.zeros((size, len(positions)))
    for k, at in enumerate(positions):
        if at is not None:
            directions[at, k] = 1.0
    return directions
