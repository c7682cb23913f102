"""From an ordinary differential equation on 0..1 to algebraic equations: multiple shooting and collocation.

Knows no rod. A *field* is a `casadi.Function` (x, c) -> dx/ds, with the state x (nx) and constants c (nc), posed on
s in 0..1. Both methods give the same thing, a `Transcribed`: unknowns in the order of the intervals, so that the
Jacobian is banded,

    [x_0 | (stages) x_1 | (stages) x_2 | ... | x_K]

and one continuity residual per interval (behind its stage residuals, for collocation). The order in which a caller adds
boundary conditions is the caller's.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any, Literal, Protocol

import casadi as ca
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tableau:
    """An explicit Runge-Kutta method.

    Attributes
    ----------
    a
        (stages, stages) lower triangle, row by row [1].
    b
        (stages,) weights [1].
    order
        Of its error.
    """

    a: tuple[tuple[float, ...], ...]
    b: tuple[float, ...]
    order: int


RK4 = Tableau(a=((), (0.5,), (0.0, 0.5), (0.0, 0.0, 1.0)), b=(1 / 6, 1 / 3, 1 / 3, 1 / 6), order=4)


@dataclass(frozen=True, eq=False)
class Transcribed:
    """A field on a grid of K equal intervals, as equations.

    unknowns : column of all states, in the order of the intervals. points : s of each state in `unknowns`.
    node_index : which of those states are the nodes x_0..x_K. residuals : stage and continuity equations, nx each.
    kinds : for each residual block of nx, "stage" or "gap".
    fine_residuals : the same at half the step for the same nodes, which is what the error estimate measures.
    integrate : given a function (x, c) -> q, its integral over s by the method's own quadrature. slopes : given how the
    constants move, the Jacobian of the residuals by the unknowns and how the residuals move with the constants.
    """

    unknowns: ca.MX
    points: Array
    node_index: NDArray[np.intp]
    state_size: int
    residuals: ca.MX
    kinds: tuple[str, ...]
    fine_residuals: ca.MX
    integrate: Callable[[ca.Function], ca.MX]
    slopes: Callable[[ca.MX], tuple[ca.MX, ca.MX]]

    @cached_property
    def nodes(self) -> ca.MX:
        """The node states x_0..x_K as columns."""
        return ca.reshape(self.unknowns, self.state_size, -1)[:, self.node_index.tolist()]


class Transcription(Hashable, Protocol):
    """What the problem asks of a method."""

    @property
    def intervals(self) -> int:
        """The number of equal intervals."""
        ...

    @property
    def order(self) -> int:
        """The order of the error at the nodes."""
        ...

    def transcribe(self, field: ca.Function, constants: ca.MX) -> Transcribed:
        """Pose the field on the grid."""
        ...

    def with_intervals(self, intervals: int) -> Transcription:
        """Return the same method on another grid."""
        ...

    def interval(self, field: ca.Function) -> ca.Function:
        """Return (states of one interval from node to node, c, h) -> its residuals."""
        ...


@lru_cache(maxsize=16)
def rk_step(field: ca.Function, tableau: Tableau) -> ca.Function:
    """Return one explicit Runge-Kutta step as a function (x, c, h) -> x_next; the same one for the same field.

    Common subexpressions are looked for here alone: functions made of steps have hardly more, and would take longer to
    search than to evaluate.
    """
    nx = field.size1_in(0)
    x, c, h = ca.SX.sym("x", nx), ca.SX.sym("c", field.size1_in(1)), ca.SX.sym("h")
    k: list[ca.SX] = []
    for row in tableau.a:
        k.append(field(x + h * sum((a * k_j for a, k_j in zip(row, k, strict=True) if a), ca.SX.zeros(nx)), c))
    x_next = x + h * sum((b * k_j for b, k_j in zip(tableau.b, k, strict=True)), ca.SX.zeros(nx))
    return ca.Function("step", [x, c, h], [x_next], {"cse": True})


@lru_cache(maxsize=16)
def with_quadrature(field: ca.Function, quadrature: ca.Function) -> ca.Function:
    """Return the field with the integrals of `quadrature` (x, c) -> q appended to its state."""
    nx = field.size1_in(0)
    x, c = ca.SX.sym("x", nx + quadrature.size1_out(0)), ca.SX.sym("c", field.size1_in(1))
    return ca.Function("augmented", [x, c], [ca.vertcat(field(x[:nx], c), quadrature(x[:nx], c))])


@lru_cache(maxsize=16)
def interval_slopes(field: ca.Function, method: Transcription) -> ca.Function:
    """Return (states of one interval, c, h, dc) -> Jacobian by all but the last node, by that, and change along dc."""
    interval = method.interval(field)
    m, nc = interval.size1_out(0), interval.size1_in(1)
    w, c, h, dc = ca.SX.sym("w", interval.size1_in(0)), ca.SX.sym("c", nc), ca.SX.sym("h"), ca.SX.sym("dc", nc)
    residual = interval(w, c, h)
    J = ca.jacobian(residual, w)
    moved = ca.densify(ca.jtimes(residual, c, dc))
    return ca.Function("interval_slopes", [w, c, h, dc], [J[:, :m], J[:, m:], moved])


def _slopes(field: ca.Function, method: Transcription, unknowns: ca.MX, c: ca.MX, dc: ca.MX) -> tuple[ca.MX, ca.MX]:
    """Return the Jacobian of the residuals on a grid by the unknowns, and how they move with c along dc.

    Made of the blocks of one interval, since automatic differentiation of the whole takes some times as long.
    """
    K, block = method.intervals, interval_slopes(field, method.with_intervals(1))
    m, nx = block.size1_out(0), field.size1_in(0)
    windows = unknowns[(np.arange(m + nx)[:, None] + m * np.arange(K)).T.ravel().tolist()]
    own, following, moved = block.map(K)(ca.reshape(windows, m + nx, K), c, 1 / K, dc)
    own, following = (
        ca.sparsity_cast(part, ca.diagcat(*[block.sparsity_out(k)] * K)) for k, part in enumerate((own, following))
    )
    next_node = (np.arange(nx) + m * np.arange(1, K + 1)[:, None]).ravel().tolist()
    to_next = ca.DM(ca.Sparsity.triplet(nx * K, unknowns.numel(), list(range(nx * K)), next_node), 1)
    return ca.horzcat(own, ca.MX(m * K, nx)) + following @ to_next, ca.vec(moved)


@dataclass(frozen=True)
class MultipleShooting:
    """Multiple shooting: each interval is one explicit Runge-Kutta step from its left node.

    Attributes
    ----------
    intervals
        Of the length, equal.
    tableau
        The Runge-Kutta method.
    """

    intervals: int = 20
    tableau: Tableau = RK4

    @property
    def order(self) -> int:
        """The order of the error at the nodes."""
        return self.tableau.order

    def with_intervals(self, intervals: int) -> MultipleShooting:
        """Return the same method on another grid.

        Parameters
        ----------
        intervals
            Their number.

        Returns
        -------
        Transcription
            Of the same class.
        """
        return replace(self, intervals=intervals)

    def interval(self, field: ca.Function) -> ca.Function:
        """Return (states of one interval from node to node, c, h) -> its residuals.

        Parameters
        ----------
        field
            (x, c) -> dx/ds on s in 0..1.

        Returns
        -------
        Function
            As said.
        """
        nx = field.size1_in(0)
        w, c, h = ca.SX.sym("w", 2 * nx), ca.SX.sym("c", field.size1_in(1)), ca.SX.sym("h")
        return ca.Function("interval", [w, c, h], [rk_step(field, self.tableau)(w[:nx], c, h) - w[nx:]])

    def transcribe(self, field: ca.Function, constants: ca.MX) -> Transcribed:
        """Pose the field on the grid, with unknowns [x_0 | x_1 | ... | x_K].

        Parameters
        ----------
        field
            (x, c) -> dx/ds on s in 0..1.
        constants
            c, an MX column.

        Returns
        -------
        Transcribed
            Unknowns and as many residuals but one state.
        """
        nx, K = field.size1_in(0), self.intervals
        unknowns = ca.MX.sym("states", nx * (K + 1))
        nodes = ca.reshape(unknowns, nx, K + 1)
        left, right = nodes[:, :K], nodes[:, 1:]
        step = rk_step(field, self.tableau)
        many = step.map(K)
        h = 1 / K
        gaps = many(left, constants, h) - right
        fine = many(many(left, constants, h / 2), constants, h / 2) - right

        def integrate(quadrature: ca.Function) -> ca.MX:
            nq = quadrature.size1_out(0)
            augmented = rk_step(with_quadrature(field, quadrature), self.tableau).map(K)
            start = ca.vertcat(left, ca.DM.zeros(nq, K))
            return ca.sum2(augmented(start, constants, h)[nx:, :])

        return Transcribed(
            unknowns=unknowns,
            points=np.linspace(0, 1, K + 1),
            node_index=np.arange(K + 1),
            state_size=nx,
            residuals=ca.vec(gaps),
            kinds=("gap",) * K,
            fine_residuals=ca.vec(fine),
            integrate=integrate,
            slopes=lambda moved: _slopes(field, self, unknowns, constants, moved),
        )


@dataclass(frozen=True)
class Collocation:
    """Orthogonal collocation: in each interval the state is a polynomial of `degree` that obeys the field at points.

    Legendre points give order 2 degree at the nodes, Radau points 2 degree - 1.

    Attributes
    ----------
    intervals
        Of the length, equal.
    degree
        Of the polynomials, and so many points in each interval.
    points
        "legendre" or "radau".
    """

    intervals: int = 10
    degree: int = 4
    points: Literal["legendre", "radau"] = "legendre"

    @property
    def order(self) -> int:
        """The order of the error at the nodes."""
        return 2 * self.degree - (self.points == "radau")

    def with_intervals(self, intervals: int) -> Collocation:
        """Return the same method on another grid.

        Parameters
        ----------
        intervals
            Their number.

        Returns
        -------
        Transcription
            Of the same class.
        """
        return replace(self, intervals=intervals)

    def _stage_residuals(self, field: ca.Function, start: Any, stages: Any, c: Any, h: Any) -> tuple[Any, Any]:
        """Return the stage residuals (nx x degree) and the state at the end of one interval."""
        tau = ca.collocation_points(self.degree, self.points)
        C, D, _ = ca.collocation_coeff(tau)
        every = ca.horzcat(start, stages)
        rates = ca.horzcat(*(field(stages[:, j], c) for j in range(self.degree)))
        return h * rates - every @ C, every @ D

    def interval(self, field: ca.Function) -> ca.Function:
        """Return (states of one interval from node to node, c, h) -> its residuals.

        Parameters
        ----------
        field
            (x, c) -> dx/ds on s in 0..1.

        Returns
        -------
        Function
            As said.
        """
        nx, d = field.size1_in(0), self.degree
        w, c, h = ca.SX.sym("w", nx * (d + 2)), ca.SX.sym("c", field.size1_in(1)), ca.SX.sym("h")
        x, z, end = ca.vertsplit(w, [0, nx, nx * (d + 1), nx * (d + 2)])
        stage, reached = self._stage_residuals(field, x, ca.reshape(z, nx, d), c, h)
        return ca.Function("interval", [w, c, h], [ca.vertcat(ca.vec(stage), reached - end)])

    def transcribe(self, field: ca.Function, constants: ca.MX) -> Transcribed:
        """Pose the field on the grid, with unknowns [x_0 | stages, x_1 | ... | stages, x_K].

        Parameters
        ----------
        field
            (x, c) -> dx/ds on s in 0..1.
        constants
            c, an MX column.

        Returns
        -------
        Transcribed
            Unknowns and as many residuals but one state.
        """
        nx, K, d = field.size1_in(0), self.intervals, self.degree
        tau = ca.collocation_points(d, self.points)
        h = 1 / K
        unknowns = ca.MX.sym("states", nx * (1 + K * (d + 1)))
        states = ca.reshape(unknowns, nx, 1 + K * (d + 1))
        node_index = np.arange(K + 1) * (d + 1)

        left = states[:, node_index[:-1].tolist()]
        right = states[:, node_index[1:].tolist()]
        inner = [j for j in range(states.shape[1]) if j % (d + 1)]
        windows = ca.vertcat(left, ca.reshape(states[:, inner], nx * d, K), right)
        residuals = self.interval(field).map(K)(windows, constants, h)

        flow, (first, second) = self._flow(field, h / 2).map(K), self._halves()
        polynomials = ca.reshape(ca.vertcat(left, ca.reshape(states[:, inner], nx * d, K)), nx, (d + 1) * K)
        half = flow(left, constants, _on_each(polynomials, first, nx, K))
        fine_gap = flow(half, constants, _on_each(polynomials, second, nx, K)) - right
        fine = ca.vertcat(ca.DM.zeros(nx * d, K), fine_gap)

        # Not collocation_coeff's weights, which give s = 0 a share: with one Radau point they sum to a half.
        B = ca.DM(np.linalg.solve(np.vander(tau, increasing=True).T, 1 / np.arange(1, d + 1)))

        def integrate(quadrature: ca.Function) -> ca.MX:
            rates = quadrature.map(K * d)(states[:, inner], constants)
            return rates @ (h * ca.repmat(B, K, 1))

        return Transcribed(
            unknowns=unknowns,
            points=np.concatenate([[0.0], *([(k + np.array([*tau, 1.0])) / K for k in range(K)])]),
            node_index=node_index,
            state_size=nx,
            residuals=ca.vec(residuals),
            kinds=(*("stage",) * d, "gap") * K,
            fine_residuals=ca.vec(fine),
            integrate=integrate,
            slopes=lambda moved: _slopes(field, self, unknowns, constants, moved),
        )

    def _halves(self) -> tuple[Array, Array]:
        """Return what takes a polynomial's start and stages (d + 1) to its stages in each half of the interval."""
        tau = np.array([0.0, *ca.collocation_points(self.degree, self.points)])
        powers, places = np.vander(tau, increasing=True), np.concatenate([tau[1:], 1 + tau[1:]]) / 2
        first, second = np.split(np.linalg.solve(powers.T, np.vander(places, tau.size, increasing=True).T), 2, axis=1)
        return first, second

    def _flow(self, field: ca.Function, h: float) -> ca.Function:
        """Return the step of the method over an interval of length h: (x, c, guess of the stages) -> x_next."""
        nx, d = field.size1_in(0), self.degree
        x, c, z = ca.SX.sym("x", nx), ca.SX.sym("c", field.size1_in(1)), ca.SX.sym("z", nx * d)
        stage, reached = self._stage_residuals(field, x, ca.reshape(z, nx, d), c, h)
        equations = ca.Function("stages", [z, x, c], [ca.vec(stage), reached])
        newton = ca.rootfinder("flow", "newton", equations, {"abstol": 1e-13, "max_iter": 50, "error_on_fail": False})
        start, constants, guess = ca.MX.sym("x", nx), ca.MX.sym("c", field.size1_in(1)), ca.MX.sym("guess", nx * d)
        return ca.Function("flow", [start, constants, guess], [newton(guess, start, constants)[1]])


def _on_each(polynomials: ca.MX, weights: Array, rows: int, count: int) -> ca.MX:
    """Return polynomials side by side, each (rows, n) times weights (n, m), as columns (rows m, count)."""
    return ca.reshape(polynomials @ ca.kron(ca.DM.eye(count), ca.DM(weights)), rows * weights.shape[1], count)


def method_named(name: str, intervals: int) -> Transcription:
    """Return the method that a scenario names: "multiple-shooting" (RK4) or "collocation" (Legendre, degree 4)."""
    return Collocation(intervals) if name == "collocation" else MultipleShooting(intervals)
