"""A problem in its few free quantities: the cases are solved by Newton's method wherever the search goes.

With x = [theta | states], the states follow from theta, and so do the objective f and the constraints c; their slopes
are those of the implicit function, exact. What is left has as many unknowns as theta has entries.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.nlp.implicit import ImplicitDerivatives
from softnlp.nlp.linear import LinearSolver
from softnlp.nlp.problem import CompiledProblem, compile_problem
from softnlp.nlp.solver import Engine, Solution, violation

Array = NDArray[np.float64]

_ITERATIONS = 200
_ACTIVE = 1e-7  # scaled distance from a bound that counts as none
_LEAST_SLOPE = 1e-5
_SHORTEST = 1 / 64  # of a step of the search, where the states do not follow a whole one


@dataclass(frozen=True, eq=False)
class Point:
    """Where the states are solved: x, the objective f, rows c of the constraints, residuals r, and slopes by theta."""

    x: Array
    f: float
    c: Array
    r: Array
    f_slope: Array
    c_slope: Array
    r_slope: Array


class Reduced:
    """The objective and constraints of a problem as functions of its free quantities theta, over their scales.

    linear : makes what solves the cases with every quantity fixed. residuals : where the objective is half the sum of
    their squares, in the symbols of quantities and cases.
    """

    def __init__(
        self,
        problem: CompiledProblem,
        linear: Callable[[CompiledProblem], LinearSolver],
        residuals: ca.MX | None = None,
    ) -> None:
        self.problem = problem
        self._squares = residuals is not None
        self._free = problem.free_size
        held = compile_problem([*problem.free, *problem.fixed], problem.cases)
        solver = linear(held)
        self._engine = Engine(held, linear=solver, newton_only=True)
        self._derivatives = ImplicitDerivatives(held, [q.name for q in problem.free], solver)
        self._scales = np.repeat([q.scale for q in problem.free], [q.size for q in problem.free])
        x, p, f, g = (problem.nlp[key] for key in "xpfg")
        rows = slice(held.nlp["g"].numel(), g.numel())
        moves = ca.MX.sym("moves", x.numel(), self._free)
        r = ca.MX(0, 1) if residuals is None else problem.function("residuals", [residuals])(x, p)
        self._rows = rows.stop - rows.start
        judged = ca.vertcat(f, g[rows], r)
        slopes = ca.densify(ca.jtimes(judged, x, moves))
        self._judged = ca.Function("judged", [x, p, moves], [judged, slopes])
        self.lower, self.upper = problem.lower_g[rows], problem.upper_g[rows]

    def at(self, theta: Array, p: Array, near: Array) -> Point | None:
        """Return the point at theta (k,), from states x nearby; None where Newton's method finds none."""
        fixed = np.concatenate([theta * self._scales, p])
        solution = self._engine.solve(fixed, near[self._free :])
        if not solution.holds(1e-9):
            return None
        try:
            states = self._derivatives.states(solution.x, fixed) * self._scales
        except np.linalg.LinAlgError:
            return None
        x = np.concatenate([theta, solution.x])
        judged, slopes = self._judged(x, p, np.vstack([np.eye(theta.size), states]))
        values, moved, m = np.asarray(judged).ravel(), np.asarray(slopes), self._rows + 1
        return Point(x, float(values[0]), values[1:m], values[m:], moved[0], moved[1:m], moved[m:])

    def minimise(self, p: Array, start: Array) -> Solution:
        """Return the point of least f near a start x that keeps the constraints and the bounds of theta.

        The method is SciPy's `least_squares` where residuals are all there is, else SLSQP; what its end leaves of the
        Lagrangian's slope is the solution's kkt.
        """
        from scipy.optimize import least_squares, minimize

        first = self.at(start[: self._free], p, start)
        if first is None:
            return Solution(start, p, float("inf"), 0, "the states are not found at the start")
        last = first
        known: dict[bytes, Point] = {last.x[: self._free].tobytes(): last}
        evaluations = 1

        def point(theta: Array) -> Point:
            nonlocal last, evaluations
            theta = np.asarray(theta, dtype=float)
            found = known.get(theta.tobytes())
            if found is None:
                evaluations += 1
                found = self._reached(theta, p, last)
                known[theta.tobytes()] = found
            last = found
            return found

        lower_x, upper_x = self.problem.lower_x[: self._free], self.problem.upper_x[: self._free]
        if self._squares and not self._rows:
            done = least_squares(
                lambda t: point(t).r,
                start[: self._free],
                jac=lambda t: point(t).r_slope,
                bounds=(lower_x, upper_x),
                ftol=1e-15,
                xtol=1e-15,
                gtol=1e-15,
                max_nfev=_ITERATIONS,
            )
            return self._solution(point(done.x), first, p, evaluations, str(done.message))
        equal = self.lower == self.upper
        below, above = ~equal & np.isfinite(self.lower), ~equal & np.isfinite(self.upper)
        conditions = [
            {
                "type": kind,
                "fun": lambda t, w=where, b=bound, s=sign: s * (point(t).c - b)[w],
                "jac": lambda t, w=where, s=sign: s * point(t).c_slope[w],
            }
            for kind, where, bound, sign in (
                ("eq", equal, self.lower, 1.0),
                ("ineq", below, self.lower, 1.0),
                ("ineq", above, self.upper, -1.0),
            )
            if np.any(where)
        ]
        done = minimize(
            lambda t: point(t).f,
            start[: self._free],
            jac=lambda t: point(t).f_slope,
            bounds=list(zip(lower_x, upper_x, strict=True)),
            constraints=conditions,
            method="SLSQP",
            options={"ftol": 1e-15, "maxiter": _ITERATIONS},
        )
        return self._solution(point(done.x), first, p, evaluations, str(done.message))

    def _solution(self, end: Point, first: Point, p: Array, evaluations: int, words: str) -> Solution:
        """Return the end of a search, judged anew."""
        kkt = self._left(end) / max(float(np.max(np.abs([first.f_slope, end.f_slope]))), _LEAST_SLOPE)
        return Solution(end.x, p, violation(self.problem, end.x, p), evaluations, words, kkt)

    def _reached(self, theta: Array, p: Array, last: Point) -> Point:
        """Return the point at theta, by shorter and shorter steps from the last; that one where there is no way."""
        here, step = last, 1.0
        while step >= _SHORTEST:
            begin = here.x[: self._free]
            found = self.at(begin + step * (theta - begin), p, here.x)
            if found is None:
                step /= 2
            elif step == 1.0:
                return found
            else:
                here, step = found, 1.0
        return replace(last, f=np.inf, r=np.full(last.r.size, np.inf))

    def _left(self, end: Point) -> float:
        """Return what is left of the Lagrangian's slope with the best multipliers of their signs."""
        from scipy.optimize import lsq_linear

        theta = end.x[: self._free]
        rows, least, most = [], [], []
        for slopes, value, lower, upper in (
            (end.c_slope, end.c, self.lower, self.upper),
            (np.eye(theta.size), theta, self.problem.lower_x, self.problem.upper_x),
        ):
            for k in range(len(value)):
                down, up = value[k] <= lower[k] + _ACTIVE, value[k] >= upper[k] - _ACTIVE
                if down or up:
                    rows.append(slopes[k])
                    least.append(-np.inf if down else 0.0)
                    most.append(np.inf if up else 0.0)
        left = end.f_slope
        if rows:
            A = np.array(rows).T
            left = left + A @ lsq_linear(A, -left, (least, most), tol=1e-14).x
        return float(np.max(np.abs(left)))
