"""Solving a compiled problem: IPOPT, a certificate that does not take its word, and continuation."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.problem import CompiledProblem

Array = NDArray[np.float64]


@dataclass(frozen=True)
class EquationResidual:
    """One line of a certificate: the largest error of one equation, evaluated again after the solve.

    `value` is in `unit` (SI); `scaled` is divided by EI/L^2 (forces), EI/L (moments) or L (lengths).
    """

    equation: str
    value: float
    unit: str
    scaled: float


@dataclass(frozen=True, eq=False)
class Solution:
    """A point x of a problem at fixed values p, and what is known of it.

    residual : largest scaled violation of any equation or bound, evaluated again; inf when it is not a number.
    iterations : of every attempt that led here. engine_status : IPOPT's own word, for information only.
    """

    x: Array
    p: Array
    residual: float
    iterations: int
    engine_status: str

    def holds(self, tolerance: float) -> bool:
        """Whether every equation and bound holds within the tolerance."""
        return self.residual <= tolerance


class Engine:
    """IPOPT on one compiled problem. Safe to share between threads: calls wait for each other.

    A square problem needs no Hessian: with a zero one IPOPT's step is Newton's.
    """

    def __init__(
        self, problem: CompiledProblem, *, max_iterations: int | None = None, tolerance: float = 1e-11
    ) -> None:
        self.problem = problem
        self.tolerance = tolerance
        self._lock = threading.Lock()
        # Newton on a square problem either converges soon or has left the basin of the first guess.
        self._max_iterations = max_iterations or (15 if problem.is_square else 300)

    @cached_property
    def _solver(self) -> ca.Function:
        nlp = self.problem.nlp
        options: dict[str, Any] = {
            "print_time": False,
            "calc_lam_p": False,
            "calc_multipliers": False,
            "show_eval_warnings": False,
            "ipopt": {
                "print_level": 0,
                "sb": "yes",
                "tol": self.tolerance,
                "constr_viol_tol": self.tolerance,
                "acceptable_iter": 0,
                "nlp_scaling_method": "none",
                "max_iter": self._max_iterations,
            },
        }
        if self.problem.is_square:
            x, p = nlp["x"], nlp["p"]
            n, m = x.numel(), nlp["g"].numel()
            symbols = [ca.MX.sym("x", n), ca.MX.sym("p", p.numel()), ca.MX.sym("lam_f"), ca.MX.sym("lam_g", m)]
            options["hess_lag"] = ca.Function("zero_hessian", symbols, [ca.MX(n, n)])
        return ca.nlpsol("solver", "ipopt", dict(nlp), options)

    def solve(self, p: Array, x_start: Array) -> Solution:
        """Solve at fixed values p from a first guess; judge the result by the residual, evaluated again."""
        problem = self.problem
        with self._lock:
            try:
                result = self._solver(
                    x0=x_start,
                    p=p,
                    lbx=problem.lower_x,
                    ubx=problem.upper_x,
                    lbg=problem.lower_g,
                    ubg=problem.upper_g,
                )
            except RuntimeError as error:  # the engine gave up on a number that is not finite
                return Solution(np.asarray(x_start, float), p, float("inf"), 0, str(error).splitlines()[-1])
            stats = self._solver.stats()
        x = np.asarray(result["x"], dtype=float).ravel()
        return Solution(x, p, violation(problem, x, p), int(stats["iter_count"]), str(stats["return_status"]))


def violation(problem: CompiledProblem, x: Array, p: Array) -> float:
    """Return the largest scaled violation of any equation, constraint or bound at x; inf when it is not a number."""
    g = np.asarray(problem.residual(x, p)).ravel()
    excess = np.concatenate(
        [problem.lower_g - g, g - problem.upper_g, problem.lower_x - x, x - problem.upper_x]
    )
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


def discretisation_correction(problem: CompiledProblem, solution: Solution) -> Array:
    """Return the first-order change of x from halving every step: one Newton step on the fine equations.

    The fine equations reuse the coarse Jacobian, which differs from theirs by the discretisation error itself. Where the
    problem is not square, the free quantities are held.
    """
    fine = np.asarray(problem.fine_residual(solution.x, solution.p)).ravel()
    J = problem.jacobian(solution.x, solution.p)
    n = J.size2()
    skip = 0 if problem.is_square else problem.free_size
    size = n - skip
    J = J[:size, skip:]
    step = np.asarray(ca.solve(J, ca.DM(-fine[:size]), "qr")).ravel()
    return np.concatenate([np.zeros(skip), step])


@dataclass(frozen=True, eq=False)
class Followed:
    """How far a path was followed: the last solution, the fraction 0..1 it belongs to, and all iterations spent."""

    solution: Solution
    fraction: float
    iterations: int

    @property
    def arrived(self) -> bool:
        """Whether the end of the path was reached."""
        return self.fraction >= 1.0


def follow(
    engine: Engine,
    path: Callable[[float], Array],
    start: Array,
    *,
    distance: Callable[[Array], float],
    first_step: float = 0.125,
    smallest_step: float = 1 / 1024,
    largest_jump: float = 0.6,
    most_solves: int = 400,
) -> Followed:
    """Follow a solution along p = path(t) from t = 0, where `start` is a solution or close to one, to t = 1.

    The step is halved when a solve fails or lands further than `largest_jump` (scaled) from its prediction, which is how
    another branch shows, and grows again after success. The predictor is the secant. `distance` measures a change of x. A
    solve counts when it meets ten times the engine's own tolerance, so an engine for a path may be a loose one.
    """
    tolerance = 10 * engine.tolerance
    current = engine.solve(path(0.0), start)
    iterations = current.iterations
    if not current.holds(tolerance):
        return Followed(current, 0.0, iterations)
    done, step = 0.0, first_step
    previous: tuple[float, Array] | None = None
    for _ in range(most_solves):
        target = min(1.0, done + step)
        guess = current.x
        if previous is not None:
            guess = guess + (current.x - previous[1]) * (target - done) / (done - previous[0])
        trial = engine.solve(path(target), guess)
        iterations += trial.iterations
        jump = distance(trial.x - guess)
        if trial.holds(tolerance) and jump <= largest_jump:
            previous, current, done = (done, current.x), trial, target
            if done >= 1.0:
                break
            step *= 1.6 if trial.iterations <= 4 else 1.0
        else:
            step /= 2
            if step < smallest_step:
                break
    return Followed(current, done, iterations)


def straight_path(problem: CompiledProblem, start: Mapping[str, Any], end: Mapping[str, Any]) -> Callable[[float], Array]:
    """Return p(t) along the straight line between two sets of values of the fixed quantities."""
    a, b = problem.pack(start), problem.pack(end)
    return lambda t: b if t >= 1.0 else a + t * (b - a)
