"""Ways to solve one loaded pose from nothing, each in its plain form, on the same equations and the same grid.

All begin at the unloaded circular arc of the pose's pressure. What they return is filled into the unknowns of the
multiple-shooting problem, or of the collocation problem, whose residual is then evaluated again.

multiple shooting    full Newton steps on all nodes at once, and nothing else
its NLP by IPOPT     the same problem by IPOPT, whose filter line search shortens steps, without a fallback
single shooting      the same equations with the nodes eliminated: n(0), m(0) by full Newton steps
paper's method       those six by Levenberg-Marquardt with finite differences (MINPACK), as the paper does it
collocation          full Newton steps on the Legendre collocation problem
continuation         multiple shooting, each pose from the last, while the load is applied in adaptive steps
softnlp              the package as it comes: Newton, then its ladder of paths and fallbacks
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from scipy.optimize import least_squares

from benchmarks.paper_method import Array
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import LOADS, Model
from softnlp.model.rod import STATE_SIZE, Loads
from softnlp.nlp.continuation import Path, follow, straight_path
from softnlp.nlp.linear import SparseSolver
from softnlp.nlp.solver import Engine, Solution, violation
from softnlp.nlp.transcription import RK4, rk_step
from softnlp.statics.branch import stretch_on_branch
from softnlp.statics.pose_grid import Grid
from softnlp.statics.solver import PoseSolver

INTERVALS, COLLOCATION_INTERVALS = 40, 10
MOST_ITERATIONS = 50
CONVERGED = 1e-11
_HOPELESS = 1e8  # scaled residual
_FORCE = slice(12, 18)


@dataclass(frozen=True, eq=False)
class Found:
    """What a method ended with. x : unknowns of its grid. words : why it stopped."""

    grid: Grid
    x: Array
    iterations: int
    words: str


@dataclass(frozen=True, eq=False)
class Pose:
    """A pose to solve: pressures (sets,) [Pa] and dead loads."""

    pressure: Array
    loads: Loads


class Methods:
    """Everything compiled for one model; each method maps a pose to what it found."""

    def __init__(self, model: Model) -> None:
        self.solver = PoseSolver(model, Numerics(intervals=INTERVALS))
        self._collocated = PoseSolver(model, Numerics(transcription="collocation", intervals=COLLOCATION_INTERVALS))
        self.grid = self.solver.grid(INTERVALS)
        self._collocation_grid = self._collocated.grid(COLLOCATION_INTERVALS)
        self._ipopt = Engine(self.grid.problem, max_iterations=MOST_ITERATIONS)
        self._sparse = SparseSolver(self._collocation_grid.problem)
        self._shoot, self._shoot_slope = self._shooting()
        self.by_name: dict[str, Callable[[Pose], Found]] = {
            "multiple shooting": self.multiple_shooting,
            "its NLP by IPOPT": self.nlp,
            "single shooting": self.single_shooting,
            "paper's method": self.paper,
            "collocation": self.collocation,
            "continuation": self.continuation,
            "softnlp": self.ladder,
        }

    def values(self, pose: Pose) -> dict[str, Any]:
        """Return what a pose sets."""
        return self.solver.values(pose.pressure, pose.loads)

    def start(self, grid: Grid, values: dict[str, Any]) -> tuple[Array, Array]:
        """Return the fixed values p and the arc x."""
        p = grid.problem.pack(values)
        return p, self.solver.arc_guess(grid, p, self.stretch(values))

    def stretch(self, values: dict[str, Any]) -> float:
        """Return the stretch that the pressure gives."""
        return float(stretch_on_branch(self.solver.branch, self.solver.column(values), values["pressure"]).stretch)

    def multiple_shooting(self, pose: Pose) -> Found:
        """Take full Newton steps from the arc."""
        p, x = self.start(self.grid, self.values(pose))
        linear, problem = self.grid.engine.linear, self.grid.problem
        assert linear is not None
        return newton(self.grid, lambda z: residual_of(problem, z, p), lambda z, g: linear.solve(z, p, g), x)

    def nlp(self, pose: Pose) -> Found:
        """Solve the NLP by IPOPT from the arc."""
        p, x = self.start(self.grid, self.values(pose))
        found = self._ipopt.solve(p, x)
        return Found(self.grid, found.x, found.iterations, f"IPOPT: {found.engine_status}")

    def collocation(self, pose: Pose) -> Found:
        """Take full Newton steps from the arc on the collocation problem."""
        grid = self._collocation_grid
        p, x = self.start(grid, self.values(pose))
        return newton(grid, lambda z: residual_of(grid.problem, z, p), lambda z, g: self._sparse.solve(z, p, g), x)

    def single_shooting(self, pose: Pose) -> Found:
        """Take full Newton steps in n(0), m(0)."""
        p, x = self.start(self.grid, self.values(pose))

        def step(base: Array, g: Array) -> Array:
            J = np.asarray(self._shoot_slope(base, x[0], p))
            if not np.all(np.isfinite(J)):
                raise np.linalg.LinAlgError("not finite")
            return np.linalg.solve(J, -g)

        found = newton(self.grid, lambda base: self._shot(base, x[0], p)[1], step, base_of(x))
        return self._filled(found.x, x[0], p, found.iterations, found.words)

    def paper(self, pose: Pose) -> Found:
        """Minimise the squares of the tip's errors by Levenberg-Marquardt; iterations are its gradients."""
        p, x = self.start(self.grid, self.values(pose))

        def errors(base: Array) -> Array:
            g = self._shot(base, x[0], p)[1]
            return np.where(np.isfinite(g), g, 1e6)

        found = least_squares(errors, base_of(x), method="lm", ftol=1e-15, xtol=1e-15, gtol=1e-15)
        return self._filled(found.x, x[0], p, int(found.nfev), "a minimum of the squares that is no solution")

    def continuation(self, pose: Pose) -> Found:
        """Apply the load in adaptive steps, each from the secant of the last two."""
        values = self.values(pose)
        path, x = self.load_path(values)
        engine = self.grid.engine
        followed = follow(self.grid.stepper, path, x, distance=self.grid.distance)
        if not followed.arrived:
            return Found(self.grid, followed.solution.x, followed.iterations, "the path turned back or was lost")
        final = engine.solve(path(1.0), followed.solution.x)
        return Found(self.grid, final.x, followed.iterations + final.iterations, final.engine_status)

    def ladder(self, pose: Pose) -> Found:
        """Solve as the package does; where it does not, the words are its message to the user."""
        step, solved = self.solver.solve(pose.pressure, pose.loads)
        if solved is None:
            return Found(self.grid, np.full(self.grid.problem.lower_x.shape, np.nan), step.iterations, step.message)
        return Found(solved.grid, solved.solution.x, step.iterations, step.message)

    def load_path(self, values: dict[str, Any]) -> tuple[Path, Array]:
        """Return the straight path from no load to the pose's, and where it starts: the arc."""
        unloaded = {**values, **{name: np.zeros(3) for name in LOADS}}
        return straight_path(self.grid.problem, unloaded, values), self.start(self.grid, unloaded)[1]

    def end_of_load_path(self, pose: Pose) -> Array | None:
        """Return the load path's equilibrium, followed in small steps; None at a fold."""
        path, x = self.load_path(self.values(pose))
        followed = follow(
            self.grid.stepper,
            path,
            x,
            distance=self.grid.distance,
            first_step=1 / 16,
            largest_jump=0.1,
            most_solves=1000,
        )
        return self.grid.engine.solve(path(1.0), followed.solution.x).x if followed.arrived else None

    def tip(self, grid: Grid, x: Array) -> Array:
        """Return the tip's position (3) in L_0 and its rotation (9)."""
        return np.array(grid.nodes(x)[:12, -1])

    def stable(self, grid: Grid, x: Array, pose: Pose) -> bool:
        """Return whether an equilibrium is a minimum of the energy."""
        solution = Solution(x, grid.problem.pack(self.values(pose)), 0.0, 0, "")
        try:
            return self.solver.equations.conjugate_points(grid.nodes(x), grid.constants(solution)) == 0
        except np.linalg.LinAlgError:
            return False

    def residual(self, found: Found, pose: Pose) -> float:
        """Return the largest scaled residual, evaluated again; inf where it is no number."""
        if not np.all(np.isfinite(found.x)):
            return float("inf")
        return violation(found.grid.problem, found.x, found.grid.problem.pack(self.values(pose)))

    def _shooting(self) -> tuple[ca.Function, ca.Function]:
        """Return (base, stretch, p) -> all nodes (18, K + 1) and the tip's errors (6), and the errors' Jacobian."""
        functions, K = self.solver.functions, INTERVALS
        base, stretch, p = (
            ca.SX.sym("base", 6),
            ca.SX.sym("stretch"),
            ca.SX.sym("p", self.grid.problem.nlp["p"].numel()),
        )
        step = rk_step(functions.field, RK4)
        c, _, units = functions.section(p, stretch)
        state = ca.vertcat(ca.SX.zeros(3), ca.reshape(ca.SX.eye(3), 9, 1), base)
        every = step.mapaccum(K)
        b, s, q = (ca.MX.sym(n, v.shape) for n, v in (("base", base), ("stretch", stretch), ("p", p)))
        start = ca.Function("start", [base, stretch, p], [state, c, units])
        x0, constants, u = start(b, s, q)
        nodes = every(x0, ca.repmat(constants, 1, K), ca.DM.ones(1, K) / K)
        tip = functions.tip(nodes[:, -1], constants, ca.MX(0, 1), functions.tip_numbers(q), u)
        shoot = ca.Function("shoot", [b, s, q], [ca.horzcat(x0, nodes), tip])
        return shoot, ca.Function("slope", [b, s, q], [ca.jacobian(tip, b)])

    def _shot(self, base: Array, stretch: float, p: Array) -> tuple[Array, Array]:
        nodes, tip = self._shoot(base, stretch, p)
        return np.asarray(nodes), np.asarray(tip).ravel()

    def _filled(self, base: Array, stretch: float, p: Array, iterations: int, words: str) -> Found:
        nodes, _ = self._shot(base, stretch, p)
        return Found(self.grid, np.concatenate([[stretch], nodes.T.ravel()]), iterations, words)


def base_of(x: Array) -> Array:
    """Return n(0), m(0) of the unknowns of a multiple-shooting problem, scaled."""
    return np.array(x[1 : 1 + STATE_SIZE][_FORCE])


def residual_of(problem: Any, x: Array, p: Array) -> Array:
    """Return all equations at x."""
    return np.asarray(problem.residual(x, p)).ravel()


def newton(grid: Grid, residual: Callable[[Array], Array], step: Callable[[Array, Array], Array], x: Array) -> Found:
    """Take full Newton steps until the residual is at round-off, or no longer of use."""
    best, best_x = np.inf, x
    for k in range(MOST_ITERATIONS + 1):
        g = residual(x)
        size = float(np.max(np.abs(g))) if np.all(np.isfinite(g)) else np.inf
        if size < best:
            best, best_x = size, x
        elif best <= 1e-9:  # round-off
            return Found(grid, best_x, k, "Newton's method converged")
        if size <= CONVERGED:
            return Found(grid, x, k, "Newton's method converged")
        if not size < _HOPELESS:
            return Found(grid, best_x, k, "Newton's method diverged")
        try:
            x = x + step(x, g)
        except np.linalg.LinAlgError:
            return Found(grid, best_x, k, "Newton's method met a singular Jacobian")
    return Found(grid, best_x, MOST_ITERATIONS, f"Newton's method did not converge in {MOST_ITERATIONS} iterations")
