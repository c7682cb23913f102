"""A problem in its few free quantities: the cases are solved by Newton's method wherever the search goes.

With x = [theta | states], the states follow from theta, and so do the objective f and the constraints c; their slopes
are those of the implicit function, exact. What is left has as many unknowns as theta has entries.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.nlp.bounded import Limits, Map, Measured, least_norm, nearest
from softnlp.nlp.evaluation import evaluated
from softnlp.nlp.implicit import ImplicitDerivatives
from softnlp.nlp.linear import LinearSolver
from softnlp.nlp.problem import CompiledProblem, compile_problem
from softnlp.nlp.solver import Solution, violation

Array = NDArray[np.float64]

_ITERATIONS = 200
_NEWTON_STEPS = 30
_LOST, _NEAR = 1e4, 1e-7  # scaled residuals: nothing leads back from it; one more step ends at round-off
_ACTIVE = 1e-7  # scaled distance from a bound that counts as none
_LEAST_SLOPE = 1e-5
_SHORTEST = 1 / 64  # of a step of the search, where the states do not follow a whole one


def _always() -> bool:
    return True


@dataclass(frozen=True, eq=False)
class Point:
    """Where the states are solved at theta: the states, their slopes by theta, and what follows from them.

    f : the objective. c : rows of the constraints. r : residuals. Slopes are by theta.
    """

    theta: Array
    states: Array
    moves: Array
    f: float
    c: Array
    r: Array
    f_slope: Array
    c_slope: Array
    r_slope: Array

    @property
    def x(self) -> Array:
        """The unknowns of the whole problem."""
        return np.concatenate([self.theta, self.states])


def held_states(problem: CompiledProblem, linear: Callable[[CompiledProblem], LinearSolver]) -> ImplicitDerivatives:
    """Return the cases of a problem with every quantity fixed. linear : makes what solves them."""
    held = compile_problem([*problem.free, *problem.fixed], problem.cases)
    return ImplicitDerivatives(held, [q.name for q in problem.free], linear(held))


class Reduced:
    """The objective and constraints of a problem as functions of its free quantities theta, over their scales.

    held : its cases with every quantity fixed, which may be shared, see `held_states`. residuals : where the objective
    is half the sum of their squares, in the symbols of quantities and cases. begin : the first states for fixed values
    of the cases alone, where no point is near; None where there are none. sound : whether the states of a solution can
    be meant.
    """

    def __init__(
        self,
        problem: CompiledProblem,
        held: ImplicitDerivatives,
        residuals: ca.MX | None = None,
        *,
        begin: Callable[[Array], Array | None] = lambda fixed: None,
        sound: Callable[[Array], bool] = lambda states: True,
    ) -> None:
        self.problem, self.held = problem, held
        self._squares, self._begin, self._sound = residuals is not None, begin, sound
        self._scales = np.repeat([q.scale for q in problem.free], [q.size for q in problem.free])
        places, start = {}, 0
        for q in [*problem.free, *problem.fixed]:
            places[q.name] = np.arange(start, start + q.size)
            start += q.size
        self._columns = np.concatenate([places[q.name] for q in held.problem.fixed])
        x, p = problem.nlp["x"], problem.nlp["p"]
        rows = [row for row, _, _ in (c.scaled() for c in problem.constraints)]
        r = ca.MX(0, 1) if residuals is None else residuals
        moves = ca.MX.sym("moves", x.numel() - self._scales.size, self._scales.size)
        self._tail = problem.function("rows", [ca.vertcat(*rows, r)])
        judged = ca.vertcat(ca.MX(0, 1) if self._squares else problem.nlp["f"], self._tail(x, p))
        slopes = ca.jtimes(judged, x, ca.vertcat(ca.DM.eye(self._scales.size), moves))
        self._judged = ca.Function("judged", [x, p, moves], [ca.densify(judged), ca.densify(slopes)])
        self._rows = sum(row.numel() for row in rows)
        first = problem.nlp["g"].numel() - self._rows
        self.lower, self.upper = problem.lower_g[first:], problem.upper_g[first:]

    def fixed(self, theta: Array, p: Array) -> Array:
        """Return the fixed values of the cases alone at theta (k,), SI."""
        values: Array = np.concatenate([theta * self._scales, p])[self._columns]
        return values

    def at(self, theta: Array, p: Array, near: Point | Array | None = None) -> Point | None:
        """Return the point at theta (k,), from one nearby, or from x or its states; None where Newton finds none."""
        theta = np.array(theta, dtype=float)
        fixed, held = self.fixed(theta, p), self.held
        if isinstance(near, Point):
            near = near.states + near.moves @ (theta - near.theta)
        x = self._begin(fixed) if near is None else near[-held.problem.nlp["x"].numel() :]
        if x is None:
            return None
        for _ in range(_NEWTON_STEPS):
            right = held.right(x, fixed)
            size = float(np.max(np.abs(right[:, -1])))
            if not size < _LOST:
                return None
            try:
                moves = held.linear.solve_many(x, fixed, right)
            except np.linalg.LinAlgError:
                return None
            x = x + moves[:, -1]
            if size < _NEAR:  # the step leaves the square of it
                return self.judged(theta, x, moves[:, :-1] * self._scales, p) if self._sound(x) else None
        return None

    def judged(self, theta: Array, states: Array, moves: Array, p: Array) -> Point:
        """Return a point whose states and their slopes are known."""
        values, slopes = evaluated(self._judged, np.concatenate([theta, states]), p, moves)
        first = 0 if self._squares else 1
        m = first + self._rows
        c, r, c_slope, r_slope = values[first:m, 0], values[m:, 0], slopes[first:m], slopes[m:]
        # SciPy's SLSQP misreads a gradient that is not contiguous
        f, f_slope = (r @ r / 2, r @ r_slope) if self._squares else (values[0, 0], slopes[0].copy())
        return Point(theta, states, moves, float(f), c, r, f_slope, c_slope, r_slope)

    def residuals(self, points: Sequence[Point], p: Array) -> Array:
        """Return the residuals (m, n) at points whose states are known, at other fixed values p."""
        return np.asarray(self._tail(np.column_stack([point.x for point in points]), p))[self._rows :]

    def measured(self, point: Point, unit: float = 1.0) -> Measured:
        """Return the residuals at a point over a unit, or where there are none what the equalities leave."""
        if self._squares:
            return Measured(point.theta, point.r / unit, point.r_slope / unit, point)
        equal = self.lower == self.upper
        return Measured(point.theta, (point.c - self.lower)[equal], point.c_slope[equal], point)

    def least_squares(
        self,
        p: Array,
        start: Point,
        limits: Limits,
        second: Array | None = None,
        unit: float = 1.0,
        afford: Callable[[], bool] = _always,
    ) -> tuple[Point, Array]:
        """Return the point of least residuals near a start, and their curvature: `softnlp.nlp.bounded.nearest`.

        afford : asked before each point, whether it may be solved; without it the search ends at the best one known.
        """
        end, second = nearest(self._map(p, unit, afford), self.measured(start, unit), limits, second)
        return end.memo, second

    def minimum_norm(
        self,
        p: Array,
        start: Point,
        limits: Limits,
        second: Array | None = None,
        afford: Callable[[], bool] = _always,
    ) -> tuple[Point, Array]:
        """Return the point of least theta near a start that keeps the equalities: `softnlp.nlp.bounded.least_norm`.

        afford : as of `least_squares`.
        """
        end, second = least_norm(self._map(p, afford=afford), self.measured(start), limits, second)
        return end.memo, second

    def _map(self, p: Array, unit: float = 1.0, afford: Callable[[], bool] = _always) -> Map:
        """Return the residuals by theta, or the equalities."""

        def measure(theta: Array, near: Measured) -> Measured | None:
            point = self.at(theta, p, near.memo) if afford() else None
            return None if point is None else self.measured(point, unit)

        return measure

    def minimise(self, p: Array, start: Array) -> Solution:
        """Return the point of least f near a start x that keeps the constraints and the bounds of theta.

        The method is `least_squares` where residuals are all there is, else SciPy's SLSQP; what its end leaves of the
        Lagrangian's slope is the solution's kkt.
        """
        from scipy.optimize import minimize

        begin = start[: self._scales.size]
        first = self.at(begin, p, start)
        if first is None:
            return Solution(start, p, float("inf"), 0, "the states are not found at the start")
        lower_x, upper_x = self.problem.lower_x[: begin.size], self.problem.upper_x[: begin.size]
        if self._squares and not self._rows:
            unit = float(np.linalg.norm(first.r)) or 1.0
            end, _ = self.least_squares(p, first, Limits(lower_x, upper_x, np.inf), unit=unit)
            return self._solution(end, first, p, 0, "a trust region ended")
        last = first
        known: dict[bytes, Point] = {begin.tobytes(): last}
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
            begin,
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
            found = self.at(here.theta + step * (theta - here.theta), p, here)
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

        rows, least, most = [], [], []
        for slopes, value, lower, upper in (
            (end.c_slope, end.c, self.lower, self.upper),
            (np.eye(end.theta.size), end.theta, self.problem.lower_x, self.problem.upper_x),
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
