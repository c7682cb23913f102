"""Solving a compiled problem: IPOPT, a certificate that does not take its word, and continuation."""

from __future__ import annotations

import sys
import threading
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext, redirect_stdout
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.nlp.evaluation import evaluated
from softnlp.nlp.linear import LinearSolver, sparse_solve
from softnlp.nlp.optimality import OPTIMAL, kkt_error
from softnlp.nlp.problem import CompiledProblem

Array = NDArray[np.float64]

FROM_SOLUTION = {"mu_init": 1e-9, "bound_push": 1e-9, "bound_frac": 1e-9}
"""Options for a start that is a solution: it may lie on a bound, from which IPOPT would move it."""

_LONGEST_SOLVE = 60.0  # seconds after which IPOPT is stopped
_NEWTON_STEPS = 12
_DIVERGED = 1e4  # scaled residual past which Newton steps are not worth following
_LARGEST_FALLBACK = 8000  # unknowns up to which IPOPT is tried after Newton: MUMPS has taken minutes over more
_SLACK = 100.0  # round-off may leave a residual this much above the tolerance asked of an engine


@dataclass(frozen=True)
class EquationResidual:
    """One line of a certificate: the largest error of one equation, evaluated again after the solve.

    Attributes
    ----------
    equation
        Its name.
    value
        In `unit` [SI].
    unit
        Of the value.
    scaled
        The value over EI/L^2 (forces), EI/L (moments) or L (lengths) [1].
    """

    equation: str
    value: float
    unit: str
    scaled: float


@dataclass(frozen=True)
class Ipopt:
    """What IPOPT said of a solution.

    Attributes
    ----------
    status
        Its own word.
    iterations
        That it took.
    multipliers
        Largest multiplier of any row or bound [1].
    rows
        (m,) multiplier of each row, scaled as it is; empty where IPOPT gave up [1].
    bounds
        (n,) of the bounds of each unknown [1].
    objective
        What is minimised, there [1].
    """

    status: str
    iterations: int
    multipliers: float
    rows: Array = field(default_factory=lambda: np.zeros(0), repr=False, compare=False)
    bounds: Array = field(default_factory=lambda: np.zeros(0), repr=False, compare=False)
    objective: float = field(default=float("nan"), repr=False, compare=False)


@dataclass(frozen=True, eq=False)
class Solution:
    """A point x of a problem at fixed values p, and what is known of it.

    residual : largest scaled violation of any equation or bound, evaluated again; inf when it is not a number.
    kkt : error of the first-order conditions, evaluated again, see `softnlp.nlp.optimality.kkt_error`; 0 where
    nothing is minimised. iterations : of every attempt that led here. engine_status : the engine's own
    word. ipopt : what IPOPT said, where it took part.
    """

    x: Array
    p: Array
    residual: float
    iterations: int
    engine_status: str
    kkt: float = 0.0
    ipopt: Ipopt | None = None

    def holds(self, tolerance: float) -> bool:
        """Whether every equation and bound holds within the tolerance: feasible, which is not yet optimal."""
        return self.residual <= tolerance

    @property
    def optimal(self) -> bool:
        """Whether the point is feasible and the first-order conditions hold, both within `OPTIMAL`."""
        return self.holds(OPTIMAL) and self.kkt <= OPTIMAL


class Engine:
    """Newton's method where a structured linear solver is given, and IPOPT, on one compiled problem.

    IPOPT is the reference: it solves what Newton does not, unless `newton_only` or too large for it in bounded time (no
    limit reaches into one sparse factorisation), and solves alone where `ipopt_only`. options : of IPOPT. A square
    problem needs no Hessian: with a zero one IPOPT's step is Newton's too. slope : (x, p) -> residual and Jacobian for
    IPOPT, where it is not that of the problem. Safe to share between threads: calls wait for each other.
    """

    def __init__(
        self,
        problem: CompiledProblem,
        *,
        linear: LinearSolver | None = None,
        newton_only: bool = False,
        ipopt_only: bool = False,
        max_iterations: int | None = None,
        tolerance: float = 1e-11,
        options: Mapping[str, Any] | Sequence[tuple[str, Any]] = (),
        slope: ca.Function | None = None,
    ) -> None:
        self.problem = problem
        self._slope = slope
        self.linear = linear
        self.newton_only = newton_only
        self.ipopt_only = ipopt_only
        self._options = dict(options)
        self.tolerance = tolerance
        self._lock = threading.Lock()
        # Newton at given values either converges soon or has left the basin of the first guess; with quantities free,
        # 70 iterations are not rare.
        self._max_iterations = max_iterations or (15 if problem.is_square and not problem.free else 300)

    @cached_property
    def _solver(self) -> ca.Function:
        return self._ipopt_to(self.tolerance)

    @cached_property
    def _closing(self) -> ca.Function:
        """IPOPT for what round-off left above the tolerance: it would factorise again and again for the last digit."""
        return self._ipopt_to(self.tolerance * _SLACK)

    def _ipopt_to(self, tolerance: float) -> ca.Function:
        nlp = self.problem.nlp
        options: dict[str, Any] = {
            "print_time": False,
            "calc_lam_p": False,
            "calc_multipliers": False,
            "show_eval_warnings": False,
            "ipopt": {
                "print_level": 0,
                "sb": "yes",
                "tol": tolerance,
                "constr_viol_tol": tolerance,
                "acceptable_iter": 0,
                "honor_original_bounds": "yes",  # IPOPT relaxes bounds by 1e-8 of a scaled unknown while it solves
                "nlp_scaling_method": "none",
                "max_iter": self._max_iterations,
                "max_wall_time": _LONGEST_SOLVE,
                # A square problem has no use for a first estimate of the multipliers, which costs a factorisation.
                **({"constr_mult_init_max": 0.0} if self.problem.is_square else {}),
                **self._options,
            },
        }
        if self._slope is not None:
            options["jac_g"] = self._slope
        elif self.problem.cases:
            options["jac_g"] = ca.Function("jac_g", [nlp["x"], nlp["p"]], [nlp["g"], self.problem.slope])
        if self.problem.is_square:
            x, p = nlp["x"], nlp["p"]
            n, m = x.numel(), nlp["g"].numel()
            symbols = [ca.MX.sym("x", n), ca.MX.sym("p", p.numel()), ca.MX.sym("lam_f"), ca.MX.sym("lam_g", m)]
            options["hess_lag"] = ca.Function("zero_hessian", symbols, [ca.MX(n, n)])
        elif self.problem.own_hessian is not None:
            options["hess_lag"] = self.problem.hessian
        elif any(case.once_differentiable for case in self.problem.cases):
            options["ipopt"].setdefault("hessian_approximation", "limited-memory")
        elif self.problem.left_out.numel():
            options["hess_lag"] = self.problem.hessian
        return ca.nlpsol("solver", "ipopt", dict(nlp), options)

    def solve(
        self, p: Array, x_start: Array, most_steps: int = _NEWTON_STEPS, room: Array | float = np.inf
    ) -> Solution:
        """Solve at fixed values p from a first guess; judge the result by the residual, evaluated again.

        most_steps : of Newton's method, where it is used; never more than are worth following. room : by which IPOPT
        may move the scaled free quantities from the first guess, within their bounds.
        """
        x_start = np.asarray(x_start, dtype=float)
        spent = 0
        if self.linear is not None and not self.ipopt_only:
            quick = self._newton(self.linear, p, x_start, min(most_steps, _NEWTON_STEPS))
            if self.newton_only or quick.holds(self.tolerance * _SLACK):
                return quick
            if x_start.size > _LARGEST_FALLBACK:
                return quick
            spent = quick.iterations
        with self._lock:
            start_residual = violation(self.problem, x_start, p)
        if self.problem.is_square and not start_residual < _DIVERGED:
            # A sparse factorisation of such numbers may take minutes and leads nowhere.
            return Solution(x_start, p, start_residual, spent, "the first guess is out of all proportion")
        reference = self._ipopt(p, x_start, room)
        return replace(reference, iterations=reference.iterations + spent)

    def closed(self, solution: Solution) -> Solution:
        """Return IPOPT's solution of the whole program from that of Newton's method, judged anew."""
        rounded = self.problem.is_square and self.tolerance < solution.residual <= self.tolerance * _SLACK
        found = self._ipopt(solution.p, solution.x, solver=self._closing if rounded else self._solver)
        return replace(found, iterations=solution.iterations, kkt=found.kkt or solution.kkt)

    def _newton(self, linear: LinearSolver, p: Array, x_start: Array, most: int) -> Solution:
        """Take full Newton steps while they help."""
        problem = self.problem
        x, best, worst_allowed = x_start, np.inf, _DIVERGED
        with self._lock:
            g = evaluated(problem.residual, x, p)[0].ravel()
            size = _size(g)
            if not size < _DIVERGED:
                return Solution(x, p, size, 0, "the first guess is out of all proportion")
            for k in range(most):
                if size <= self.tolerance:
                    return Solution(x, p, size, k, "Newton converged")
                try:
                    trial = x + linear.solve(x, p, g)
                except np.linalg.LinAlgError:
                    return Solution(x, p, size, k, "Newton met a singular Jacobian")
                g = evaluated(problem.residual, trial, p)[0].ravel()
                new_size = _size(g)
                if not new_size < worst_allowed:
                    return Solution(x, p, size, k, "Newton diverged")
                if new_size >= best and best < self.tolerance * _SLACK:
                    return Solution(x, p, size, k, "Newton converged to round-off")
                x, size, best = trial, new_size, min(best, new_size)
        return Solution(x, p, size, most, "Newton reached its iteration limit")

    def _log(self) -> AbstractContextManager[Any]:
        """Send IPOPT's log, where it is asked for, to standard error: standard output is for results."""
        return redirect_stdout(sys.stderr) if self._options.get("print_level") else nullcontext()

    def _ipopt(
        self, p: Array, x_start: Array, room: Array | float = np.inf, solver: ca.Function | None = None
    ) -> Solution:
        problem = self.problem
        solver = self._solver if solver is None else solver
        around = np.full(x_start.size, np.inf)
        around[: problem.free_size] = room
        with self._lock, self._log():
            try:
                result = solver(
                    x0=x_start,
                    p=p,
                    lbx=np.maximum(problem.lower_x, x_start - around),
                    ubx=np.minimum(problem.upper_x, x_start + around),
                    lbg=problem.lower_g,
                    ubg=problem.upper_g,
                )
            except RuntimeError as error:  # the engine gave up on a number that is not finite
                word = str(error).splitlines()[-1]
                return Solution(x_start, p, float("inf"), 0, word, ipopt=Ipopt(word, 0, float("nan")))
            stats = solver.stats()
        x, *lam = (np.asarray(result[key], dtype=float).ravel() for key in ("x", "lam_x", "lam_g"))
        kkt = kkt_error(problem.slopes, problem.bounds, p, x_start, x, *lam) if problem.has_objective else 0.0
        status, iterations = str(stats["return_status"]), int(stats["iter_count"])
        largest = float(max(np.max(np.abs(v), initial=0.0) for v in lam))
        said = Ipopt(status, iterations, largest, rows=lam[1], bounds=lam[0], objective=float(result["f"]))
        return Solution(x, p, violation(problem, x, p), iterations, status, kkt, said)


def _size(g: Array) -> float:
    """Return the largest entry of a residual; inf where it is not a number."""
    worst = float(np.max(np.abs(g), initial=0.0))
    return worst if np.isfinite(worst) else float("inf")


def violation(problem: CompiledProblem, x: Array, p: Array) -> float:
    """Return the largest scaled violation of any equation, constraint or bound at x; inf when it is not a number."""
    g = np.asarray(problem.residual(x, p)).ravel()
    excess = np.concatenate([problem.lower_g - g, g - problem.upper_g, problem.lower_x - x, x - problem.upper_x])
    worst = float(np.max(excess, initial=0.0))
    return worst if np.all(np.isfinite(g)) and np.isfinite(worst) else float("inf")


def certificate(problem: CompiledProblem, solution: Solution) -> tuple[EquationResidual, ...]:
    """Return the largest residual of every named equation, in its unit and scaled."""
    g = np.asarray(problem.residual(solution.x, solution.p)).ravel()
    off = np.maximum(np.maximum(problem.lower_g - g, g - problem.upper_g), 0.0)
    scales = np.asarray(problem.si_scales(solution.x, solution.p)).ravel()
    lines = []
    for equation, scale in zip(problem.equations, scales, strict=True):
        worst = float(np.max(off[equation.rows]))
        lines.append(EquationResidual(equation.name, worst * float(scale), equation.unit, worst))
    return tuple(lines)


def outputs(problem: CompiledProblem, solution: Solution) -> dict[str, Array]:
    """Return the outputs of the cases at a solution, SI, world frame; columns are flat, matrices keep their shape."""
    values = problem.outputs(x=solution.x, p=solution.p)
    return {
        name: np.asarray(value).ravel() if 1 in value.shape else np.asarray(value) for name, value in values.items()
    }


def discretisation_correction(
    problem: CompiledProblem, solution: Solution, linear: LinearSolver | None = None
) -> Array:
    """Return the first-order change of x from halving every step: one Newton step on the fine equations.

    The fine equations reuse the coarse Jacobian, which differs from theirs by the discretisation error itself. Where
    the problem is not square, the free quantities are held. Raises `numpy.linalg.LinAlgError` where it is singular.
    """
    fine = np.asarray(problem.fine_residual(solution.x, solution.p)).ravel()
    if linear is not None:
        return linear.solve(solution.x, solution.p, fine)
    J = problem.jacobian(solution.x, solution.p)
    n = J.size2()
    skip = 0 if problem.is_square else problem.free_size
    size = n - skip
    step = sparse_solve(J[:size, skip:], -fine[:size])
    return np.concatenate([np.zeros(skip), step])
