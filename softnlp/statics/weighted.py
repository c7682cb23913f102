"""The paper's closure: the tip equations and the chamber constraint are met as well as their weights ask, Eq. (14).

The sum of squares of W_n e_n, W_m e_m, W_h e_h and W_L e_L is minimised over N(0), M(0) and the wall's force, with the
equations along the rod held: Gauss-Newton steps, in which the interior nodes are eliminated as in `CondensedSolver`,
sped up by Anderson's mixing. A weight W_h of None holds e_h = 0 exactly.

By collocation the errors s = (e_n, e_m, e_h) are given instead, which makes the problem square, and the squares are
minimised over s with e_L(s) replaced by its tangent. That fails where the square problem is singular.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from softnlp.model.contact_settings import ClosureWeights
from softnlp.model.rod import STATE_SIZE
from softnlp.nlp.evaluation import evaluated
from softnlp.nlp.linear import LinearSolver
from softnlp.nlp.problem import CompiledProblem
from softnlp.nlp.solver import Engine, Solution
from softnlp.statics.condensed import CondensedSolver, plane_directions
from softnlp.statics.loadcase import LoadCase, RodFunctions

Array = NDArray[np.float64]

_GIVEN = 7  # e_n, e_m, e_h are the last of a problem's fixed values
_STEPS = 60
_MEMORY = 4
_SHRINKS = 0.5  # a step of Gauss-Newton's, at least, in a quarter of those that it may take
_DIVERGED = 1e4


def scaled_weights(weights: ClosureWeights, length_unit: float, force_unit: float) -> tuple[Array, float]:
    """Return 1/W of the seven tip equations (0: exact) and W_L, dimensionless.

    A weight that is not given is 1 over the unit: EI / L_0^2 for forces, EI / L_0 for moments, L_0 for lengths.
    """
    moment_unit = force_unit * length_unit
    W_n = (weights.force or 1 / force_unit) * force_unit
    W_m = (weights.moment or 1 / moment_unit) * moment_unit
    W_L = (weights.length or 1 / length_unit) * length_unit
    slack_h = 1 / (weights.position * length_unit) if weights.position else 0.0
    return np.array([1 / W_n] * 3 + [1 / W_m] * 3 + [slack_h]), W_L


class MinimumStep:
    """Solves the linearised minimum, in place of J dx = -g, for multiple shooting.

    The tip equations, whose errors are in p, are met together with e_L as well as their weights ask; the others
    exactly.
    """

    def __init__(
        self, functions: RodFunctions, condensed: CondensedSolver, plane: Array | None, weights: ClosureWeights
    ) -> None:
        self._functions = functions
        self._condensed = condensed
        self._rows = int(functions.tip.size1_out(0))
        self._into = np.eye(self._rows) if plane is None else plane_directions(plane, self._rows)[0].T
        self._weights = weights

    def solve(self, x: Array, p: Array, g: Array) -> Array:
        """Return dx. Raises `numpy.linalg.LinAlgError` where the minimum is not determined or not finite."""
        functions, rows = self._functions, self._rows
        nx, n_c = functions.state_size, int(functions.section.size1_in(0))
        N = nx - STATE_SIZE
        constants, _, units = functions.section(p[:n_c], x[0])
        L_0, F_0 = (float(v) for v in np.asarray(units).ravel())
        inverse, W_L = scaled_weights(self._weights, L_0, F_0)
        inverse = self._into**2 @ inverse[:rows]
        system = self._condensed.tip_system(x, p, g)
        left = p[-_GIVEN:] / np.array([F_0] * 3 + [F_0 * L_0] * 3 + [L_0])
        right = self._into @ (system.right + left[:rows])
        matrix = self._into @ system.matrix

        y, taken = x[x.size - functions.tip_unknowns :], p[n_c:]
        tip = x[x.size - functions.tip_unknowns - nx : x.size - functions.tip_unknowns]
        e_L = float(functions.contact(tip, constants, y, functions.tip_numbers(p), units)[1])
        lengths = -(taken[8 + N : 8 + 2 * N] @ system.directions[STATE_SIZE:, -1])
        slope = np.concatenate([lengths[:-1], np.zeros(functions.tip_unknowns)])

        soft = inverse > 0
        A = np.vstack([matrix[soft] / inverse[soft, None], W_L * slope])
        b = np.append(right[soft] / inverse[soft], W_L * (e_L + lengths[-1]))
        C, c = matrix[~soft], right[~soft]
        n, m = A.shape[1], len(C)
        kkt = np.block([[A.T @ A, C.T], [C, np.zeros((m, m))]])
        z = np.linalg.solve(kkt, -np.concatenate([A.T @ b, c]))[:n]
        known = n - functions.tip_unknowns
        states = system.directions @ np.append(z[:known], 1.0)
        return np.concatenate([[system.d_stretch], states.T.ravel(), z[known:]])


class Weighted:
    """Minimises the weighted squares; stands in for an `Engine` of the square problem.

    A solution's p holds the errors that were left, in "contact.force_error", "contact.moment_error" and
    "contact.gap_error"; its kkt is the last step to the linearised minimum, which solves the first-order conditions.
    In a plane of symmetry the minimum is sought in that plane: outside it are lower ones.
    """

    def __init__(
        self,
        engine: Engine,
        functions: RodFunctions,
        case: LoadCase,
        condensed: CondensedSolver,
        plane: Array | None,
        weights: ClosureWeights,
    ) -> None:
        self._engine = engine
        self._functions = functions
        self._node_index = case.transcribed.node_index
        self._states = len(case.transcribed.points)
        self._condensed = condensed
        self._plane = plane
        self._rows = int(functions.tip.size1_out(0))  # 6 without a wall
        self._weights = weights
        self.tolerance = engine.tolerance
        nodes_only = self._node_index.size == self._states and not engine.ipopt_only
        self._step = MinimumStep(functions, condensed, plane, weights) if nodes_only else None

    @property
    def problem(self) -> CompiledProblem:
        """The square problem with given errors."""
        return self._engine.problem

    @property
    def linear(self) -> LinearSolver | None:
        """The linearised minimum."""
        return self._step

    def solve(self, p: Array, x_start: Array, most_steps: int | None = None) -> Solution:
        """Return the minimum next to a first guess; its residual is infinite when the minimum was not found."""
        if self._step is not None:
            return self._gauss_newton(self._step, p, x_start, most_steps or _STEPS)
        problem = self.problem
        L_0, F_0 = (float(v) for v in np.asarray(problem.units(x_start, p)).ravel())
        units = np.array([F_0] * 3 + [F_0 * L_0] * 3 + [L_0])
        inverse, W_L = scaled_weights(self._weights, L_0, F_0)
        inverse = inverse[: self._rows]

        def with_errors(s: Array) -> Array:
            return np.concatenate([p[:-_GIVEN], s * units[: s.size], np.zeros(_GIVEN - s.size)])

        # what the guess leaves of the tip equations is where the search begins
        s = np.asarray(problem.residual(x_start, with_errors(np.zeros(self._rows)))).ravel()[-self._rows :]
        s = np.where(inverse > 0, self._flat(s), 0.0)
        x, spent = x_start, 0
        history: list[tuple[Array, Array]] = []
        # beyond this rounding of the square problem's solution decides
        enough = max(self.tolerance, 1e-10)
        for _ in range(most_steps or _STEPS):
            solution = self._engine.solve(with_errors(s), x)
            spent += solution.iterations
            if not solution.holds(100 * self.tolerance):
                return replace(solution, residual=float("inf"), iterations=spent)
            x = solution.x
            e_L, slope = self._length_error(solution)
            along = inverse**2 * slope
            wanted = -along * W_L**2 * (e_L - slope @ s) / (1 + W_L**2 * (slope @ along))
            left = float(np.max(np.abs(wanted - s)))
            if left <= enough * max(1.0, float(np.max(np.abs(s)))):
                return replace(solution, iterations=spent, kkt=left)
            history.append((s, wanted))
            s = _accelerated(history[-_MEMORY:])
        return replace(solution, residual=float("inf"), iterations=spent)

    def _gauss_newton(self, step: MinimumStep, p: Array, x_start: Array, most_steps: int) -> Solution:
        """Return the minimum next to a first guess."""
        problem, rows = self.problem, self._rows
        units = np.asarray(problem.units(x_start, p)).ravel()
        scale = np.array([units[1]] * 3 + [units[0] * units[1]] * 3 + [units[0]])[:rows]
        inverse = scaled_weights(self._weights, float(units[0]), float(units[1]))[0][:rows]
        none = np.concatenate([p[:-_GIVEN], np.zeros(_GIVEN)])
        enough = max(self.tolerance, 1e-10)

        def judged(x: Array) -> tuple[Array, Array]:
            """Return p with the errors that x leaves of the tip equations, and the residual without them."""
            g = evaluated(problem.residual, x, none)[0].ravel()
            given, left = none.copy(), np.where(inverse > 0, self._flat(g[-rows:]), 0.0)
            given[-_GIVEN : given.size - _GIVEN + rows] = left * scale
            g[-rows:] -= left
            return given, g

        x, history, sizes = x_start, list[tuple[Array, Array]](), list[float]()
        patience = max(most_steps // 4, _MEMORY)
        for k in range(most_steps):
            given, g = judged(x)
            if not float(np.max(np.abs(g))) < _DIVERGED:
                return Solution(x, given, float("inf"), k, "Gauss-Newton diverged")
            try:
                dx = step.solve(x, given, g)
            except np.linalg.LinAlgError:
                return Solution(x, given, float("inf"), k, "the minimum is not determined")
            left = float(np.max(np.abs(dx)))
            if left <= enough * max(1.0, float(np.max(np.abs(x)))):
                given = judged(x + dx)[0]
                residual = float(np.max(np.abs(np.asarray(problem.residual(x + dx, given)))))
                return Solution(x + dx, given, residual, k + 1, "minimum of the weighted squares", left)
            sizes.append(left)
            if k >= patience and min(sizes[-patience:]) > _SHRINKS * min(sizes[:-patience]):
                return Solution(x, given, float("inf"), k + 1, "Gauss-Newton does not converge")
            history.append((x, x + dx))
            x = _accelerated(history[-_MEMORY:])
        return Solution(x, given, float("inf"), most_steps, "Gauss-Newton reached its iteration limit")

    def _flat(self, s: Array) -> Array:
        """Return errors without what leaves the plane."""
        if self._plane is None:
            return s
        inside = plane_directions(self._plane, self._rows)[0]
        flat: Array = inside @ (inside.T @ s)
        return flat

    def _length_error(self, solution: Solution) -> tuple[float, Array]:
        """Return the scaled e_L at a solution of the square problem and its slope by the errors s (7,)."""
        x, p = solution.x, solution.p
        nx = self._functions.state_size
        states = x[1 : 1 + nx * self._states].reshape(self._states, nx)
        nodes = states[self._node_index]
        y = x[1 + nx * self._states :]
        at_nodes = np.concatenate([x[:1], nodes.ravel(), y])
        taken = p[self._functions.section.size1_in(0) :]
        units = self.problem.units(x, p)
        constants = self.problem.case_constants(x, p)
        a = self._functions.tip_numbers(p)
        e_L = float(self._functions.contact(nodes[-1], constants, y, a, units)[1])
        N = nx - STATE_SIZE
        pressed = taken[8 + N : 8 + 2 * N]
        lengths = self._condensed.tip_moves(at_nodes, p)[STATE_SIZE:]
        return e_L, -(pressed @ lengths)


def _accelerated(history: list[tuple[Array, Array]]) -> Array:
    """Return the next point of a fixed-point iteration by Anderson's mixing of the last (point, image) pairs."""
    points, images = (np.array(part) for part in zip(*history, strict=True))
    left = images - points
    if len(history) == 1:
        return np.asarray(images[-1])
    gamma = np.linalg.lstsq(np.diff(left, axis=0).T, left[-1], rcond=1e-10)[0]
    mixed: Array = images[-1] - np.diff(images, axis=0).T @ gamma
    return mixed
