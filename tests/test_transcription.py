"""Both transcriptions on a pendulum, whose motion is known in closed form: orders, structure, error estimates."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
from scipy.sparse.linalg import spsolve
from scipy.special import ellipj, ellipk

from softnlp.nlp.transcription import (
    Collocation,
    MultipleShooting,
    Tableau,
    Transcribed,
    Transcription,
    method_named,
    rk_step,
    with_quadrature,
)

C = 5.0  # x'' = -C sin x, swinging to 2 arcsin(K)
CONSTANTS = [2.0, 2.5, 1.0]  # C in three factors
K = 0.85
EULER = Tableau(a=((),), b=(1.0,), order=1)
HEUN = Tableau(a=((), (1.0,)), b=(0.5, 0.5), order=2)
KUTTA3 = Tableau(a=((), (0.5,), (-1.0, 2.0)), b=(1 / 6, 2 / 3, 1 / 6), order=3)
METHODS = [
    *(MultipleShooting(1, tableau) for tableau in (EULER, HEUN, KUTTA3)),
    MultipleShooting(1),
    *(Collocation(1, degree, "legendre") for degree in (1, 2, 3, 4)),
    *(Collocation(1, degree, "radau") for degree in (1, 2, 3)),
]


def named(method: Transcription) -> str:
    return f"{type(method).__name__}-{method.order}-{getattr(method, 'points', '')}"


def pendulum() -> ca.Function:
    x, c = ca.SX.sym("x", 2), ca.SX.sym("c", 3)
    return ca.Function("pendulum", [x, c], [ca.vertcat(x[1], -c[0] * c[1] * c[2] * ca.sin(x[0]))])


def exact(s: np.ndarray) -> np.ndarray:
    """Return (angle, speed) of the pendulum that passes the bottom at s = 0; (2, M)."""
    sn, cn, _, _ = ellipj(np.sqrt(C) * s, K**2)
    return np.array([2 * np.arcsin(K * sn), 2 * K * np.sqrt(C) * cn])


class Solved:
    """The pendulum's initial value problem on a grid, solved by Newton from a straight line."""

    def __init__(self, method: Transcription) -> None:
        c = ca.MX.sym("c", 3)
        self.posed: Transcribed = method.transcribe(pendulum(), c)
        x = self.posed.unknowns
        start = ca.DM(exact(np.zeros(1)))

        def rows(residuals: ca.MX) -> ca.MX:
            return ca.vertcat(x[:2] - start, residuals)

        self.functions = ca.Function(
            "f", [x, c], [rows(self.posed.residuals), ca.jacobian(rows(self.posed.residuals), x), self.posed.nodes]
        )
        self.fine = ca.Function("fine", [x, c], [rows(self.posed.fine_residuals)])
        self.x = np.tile(np.asarray(start), (x.numel() // 2, 1)).ravel()
        for _ in range(30):
            r, J, _ = self.functions(self.x, CONSTANTS)
            self.x = self.x - spsolve(J.sparse(), np.asarray(r).ravel())
            if np.abs(np.asarray(r)).max() < 1e-13:
                break
        self.nodes = np.asarray(self.functions(self.x, CONSTANTS)[2])
        self.jacobian = np.asarray(self.functions(self.x, CONSTANTS)[1])

    @property
    def error(self) -> float:
        """Largest error over the nodes."""
        return float(np.abs(self.nodes - exact(np.linspace(0, 1, self.nodes.shape[1]))).max())

    def correction(self) -> np.ndarray:
        """Return the change of the nodes that one Newton step on the fine equations gives."""
        step = -np.linalg.solve(self.jacobian, np.asarray(self.fine(self.x, CONSTANTS)).ravel())
        return step.reshape(-1, 2).T[:, self.posed.node_index]


def measured_order(error_at: Callable[[int], float], start: int, floor: float = 1e-11) -> float:
    """Return the order seen over two doublings, or over one where the error of the second is rounding."""
    errors = [error for K in (start, 2 * start, 4 * start) if (error := error_at(K)) > floor]
    return float(np.log2(errors[0] / errors[-1])) / (len(errors) - 1)


@pytest.mark.parametrize("method", METHODS, ids=named)
def test_the_nodes_converge_at_the_order_of_the_method(method: Transcription) -> None:
    order = measured_order(lambda K: Solved(method.with_intervals(K)).error, 40 if method.order <= 4 else 4)
    assert order == pytest.approx(method.order, abs=0.1 if method.order <= 4 else 0.25 if method.order <= 6 else 0.6)


@pytest.mark.parametrize("method", METHODS, ids=named)
def test_the_fine_equations_estimate_the_error(method: Transcription) -> None:
    solved = Solved(method.with_intervals(40 if method.order <= 3 else 6))
    p = method.order
    estimate = solved.correction()[:, -1] * 2**p / (2**p - 1)
    true = exact(np.ones(1))[:, 0] - solved.nodes[:, -1]
    assert np.linalg.norm(true) > 1e-13
    assert np.linalg.norm(estimate) == pytest.approx(np.linalg.norm(true), rel=0.3)


@pytest.mark.parametrize("method", METHODS, ids=named)
def test_the_fine_equations_are_two_steps_of_half_the_length(method: Transcription) -> None:
    one, two = Solved(method.with_intervals(1)), Solved(method.with_intervals(2))
    gap = np.asarray(one.fine(one.x, CONSTANTS)).ravel()[-2:]
    assert gap + one.nodes[:, -1] == pytest.approx(two.nodes[:, -1], abs=1e-11)


@pytest.mark.parametrize("method", METHODS[2:], ids=named)
def test_quadratures_converge_with_the_method(method: Transcription) -> None:
    x, c = ca.SX.sym("x", 2), ca.SX.sym("c", 3)
    # energy is constant; the integral of speed is the angle; of sin(angle), what the speed lost
    quadrature = ca.Function(
        "q", [x, c], [ca.vertcat(x[1] ** 2 / 2 - c[0] * c[1] * c[2] * ca.cos(x[0]), x[1], ca.sin(x[0]))]
    )
    angle, speed = exact(np.ones(1))[:, 0]
    start_speed = exact(np.zeros(1))[1, 0]
    expected = np.array([start_speed**2 / 2 - C, angle, (start_speed - speed) / C])

    def error(K: int) -> float:
        solved = Solved(method.with_intervals(K))
        inputs = ca.symvar(solved.posed.integrate(quadrature))
        f = ca.Function("f", inputs, [solved.posed.integrate(quadrature)])
        given = [CONSTANTS if v.numel() == 3 else solved.x for v in inputs]
        return float(np.abs(np.asarray(f(*given)).ravel() - expected).max())

    assert measured_order(error, 20 if method.order <= 4 else 4) > method.order - 0.2


@pytest.mark.parametrize("method", METHODS, ids=named)
def test_unknowns_go_interval_by_interval_so_that_the_jacobian_is_banded(method: Transcription) -> None:
    method = method.with_intervals(7)
    solved = Solved(method)
    posed = solved.posed
    stages = getattr(method, "degree", 0)
    assert method.intervals == 7
    assert posed.unknowns.numel() == 2 * (1 + 7 * (stages + 1))
    assert posed.points.size * posed.state_size == posed.unknowns.numel()
    assert len(posed.kinds) * posed.state_size == posed.residuals.numel() == posed.fine_residuals.numel()
    assert posed.kinds == (*("stage",) * stages, "gap") * 7
    assert np.all(np.diff(posed.points) >= 0)
    np.testing.assert_allclose(posed.points[posed.node_index], np.linspace(0, 1, 8), atol=1e-15)
    rows, columns = np.nonzero(solved.jacobian)
    # a residual of an interval reaches from its left node to its right one
    assert np.max(np.abs(rows - columns)) <= 2 * (stages + 2)
    # states at the points are those of the pendulum
    if method.order > 3:
        np.testing.assert_allclose(solved.x.reshape(-1, 2).T, exact(posed.points), atol=2e-3)


def test_radau_ends_on_its_last_stage() -> None:
    solved = Solved(Collocation(6, 3, "radau"))
    states = solved.x.reshape(-1, 2)
    ends = solved.posed.node_index[1:]
    np.testing.assert_allclose(states[ends], states[ends - 1], atol=1e-13)


def test_multiple_shooting_is_the_same_as_stepping() -> None:
    field = pendulum()
    step, x = rk_step(field, KUTTA3), exact(np.zeros(1)).ravel()
    for _ in range(12):
        x = np.asarray(step(x, CONSTANTS, 1 / 12)).ravel()
    np.testing.assert_allclose(Solved(MultipleShooting(12, KUTTA3)).nodes[:, -1], x, atol=1e-12)


def test_one_step_of_rk4_is_the_taylor_series_to_fourth_order() -> None:
    x, c = ca.SX.sym("x"), ca.SX.sym("c")
    step = rk_step(ca.Function("f", [x, c], [c * x]), MultipleShooting(1).tableau)
    z = 0.3
    assert float(step(1.0, z, 1.0)) == pytest.approx(1 + z + z**2 / 2 + z**3 / 6 + z**4 / 24, rel=1e-15)


def test_a_quadrature_is_appended_to_the_state() -> None:
    x, c = ca.SX.sym("x", 2), ca.SX.sym("c", 3)
    both = with_quadrature(pendulum(), ca.Function("q", [x, c], [x[0] * x[1]]))
    found = np.asarray(both([0.3, 0.7, 99.0], CONSTANTS)).ravel()
    np.testing.assert_allclose(found, [0.7, -C * np.sin(0.3), 0.21], rtol=1e-15)


def test_a_scenario_s_names_are_rk4_shooting_and_fourth_degree_legendre() -> None:
    assert method_named("multiple-shooting", 12) == MultipleShooting(12)
    assert method_named("multiple-shooting", 12).order == 4
    assert method_named("collocation", 6) == Collocation(6, 4, "legendre")
    assert method_named("collocation", 6).order == 8


def test_the_pendulum_of_these_tests_is_a_pendulum() -> None:
    h = 1e-5
    s = np.linspace(0.1, 0.9, 5)
    slope = (exact(s + h) - exact(s - h)) / (2 * h)
    np.testing.assert_allclose(slope, [exact(s)[1], -C * np.sin(exact(s)[0])], atol=1e-8)
    assert exact(np.array([ellipk(K**2) / np.sqrt(C)]))[0, 0] == pytest.approx(2 * np.arcsin(K), rel=1e-12)
