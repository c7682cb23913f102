"""Bounds in the unit of their constraint, and optimality judged from x and multipliers: programs solved by hand."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np
import pytest

from softnlp.base.errors import IllPosedError
from softnlp.base.quantity import quantity
from softnlp.nlp.bounded import Limits, Measured, could_gain
from softnlp.nlp.constraint import Constraint
from softnlp.nlp.optimality import OPTIMAL, Bounds, kkt_error, misfit_slope, not_optimal, slopes
from softnlp.nlp.problem import CompiledProblem, compile_problem
from softnlp.nlp.solver import Engine, Solution, certificate, violation

SCALES = [1e-6, 1e-3, 1.0, 50.0, 1e3]


def posed(
    cost: Callable[[ca.MX], ca.MX],
    rows: Callable[[ca.MX], Sequence[Constraint]] = lambda v: (),
    size: int = 2,
    **limits: float,
) -> CompiledProblem:
    free = quantity("v", "m", np.zeros(size), **limits)
    other = quantity("unit", "m", 1e-3)
    v = free.symbol
    return compile_problem([free, other], [], free=["v"], constraints=rows(v), objective=cost(v))


def solved(problem: CompiledProblem, start: Any, iterations: int | None = None) -> tuple[np.ndarray, Solution]:
    start = problem.pack_free({"v": np.asarray(start, float)})
    found = Engine(problem, max_iterations=iterations).solve(problem.pack({}), start)
    return problem.free_values(found.x)["v"], found


# --- bounds ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize(
    ("lower", "upper", "sign", "expected"),
    [
        (0.8e-3, np.inf, 1, 0.8e-3),
        (-np.inf, -0.2e-3, -1, -0.2e-3),
        (0.8e-3, 1.5e-3, -1, 1.5e-3),
        (0.8e-3, 1.5e-3, 1, 0.8e-3),
    ],
)
def test_a_bound_is_a_value_of_the_expression_whatever_the_scale(
    scale: float, lower: float, upper: float, sign: int, expected: float
) -> None:
    problem = posed(
        lambda v: sign * v * 1e3,
        lambda v: [Constraint("wall", v, lower, upper, "m", scale)],
        size=1,
        lower=-1.0,
        upper=1.0,
    )
    (wall,), found = solved(problem, [1e-3])
    assert wall == pytest.approx(expected, abs=1e-8 * scale + 1e-12)
    assert found.holds(1e-8)
    assert found.optimal
    (line,) = certificate(problem, Solution(np.array([5.0]), found.p, 0.0, 0, ""))
    over = 5.0 - upper if np.isfinite(upper) else 0.0
    assert (line.value, line.scaled) == pytest.approx((over, over / scale))


@pytest.mark.parametrize("scale", SCALES)
def test_bounds_of_a_vector_may_differ_by_entry(scale: float) -> None:
    lower, upper = [0.8e-3, 2e-3, -1.0], [0.8e-3, np.inf, -3e-3]
    problem = posed(
        lambda v: 1e3 * (ca.sumsqr(v) + v[0]),
        lambda v: [Constraint("mixed", 2 * v, lower, upper, "m", scale)],
        size=3,
        scale=1e-3,
    )
    values, found = solved(problem, [0.0, 0.0, 0.0])
    np.testing.assert_allclose(2 * values, [0.8e-3, 2e-3, -3e-3], rtol=1e-4, atol=1e-8 * scale)
    assert found.holds(1e-8)
    assert found.optimal


def test_a_scale_that_is_a_symbol_moves_no_bound() -> None:
    wide, unit = quantity("v", "m", np.zeros(1)), quantity("unit", "m", 1e-3)
    for lower, upper in ((0.8e-3, np.inf), (0.8e-3, 0.8e-3), (-np.inf, 0.8e-3)):
        row = Constraint("wall", wide.symbol, lower, upper, "m", unit.symbol)
        cost = 1e3 * (wide.symbol if lower > 0 else -wide.symbol)
        objective = None if lower == upper else cost
        problem = compile_problem([wide, unit], [], free=["v"], constraints=[row], objective=objective)
        for size in (1e-3, 0.1):
            p = problem.pack({"unit": size})
            found = Engine(problem).solve(p, np.zeros(1))
            assert found.x[0] == pytest.approx(0.8e-3, abs=1e-8 * size)
            assert violation(problem, np.array([0.8e-3]), p) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"lower": 1.0, "upper": 0.0}, "lower <= upper"),
        ({"lower": np.nan}, "lower <= upper"),
        ({"upper": np.inf, "scale": 0.0}, "a scale above 0"),
        ({"upper": np.inf, "scale": -1.0}, "a scale above 0"),
        ({"upper": np.inf, "scale": ca.DM([1.0, 2.0])}, "one scale for all entries, got 2"),
        ({"lower": [1.0, 2.0, 3.0], "upper": np.inf}, "expected one bound, or 2"),
        (
            {"lower": 0.0, "upper": 1.0, "scale": ca.MX.sym("unit")},
            "two different bounds need a scale that is a number",
        ),
    ],
)
def test_bounds_that_cannot_be_meant_are_refused_by_the_constraints_name(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(IllPosedError, match=f"constraint 'wall': .*{said}"):
        posed(ca.sumsqr, lambda v: [Constraint("wall", v, **changes)])


# --- optimality ------------------------------------------------------------------------------------------------------


def valley(v: ca.MX) -> ca.MX:
    return (1 - v[0]) ** 2 + 100 * (v[1] - v[0] ** 2) ** 2


def below(v: ca.MX) -> list[Constraint]:
    return [Constraint("sum", v[0] + v[1], -np.inf, 1.0, "m", 1e-3)]


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e4, -1.0])
def test_a_stopped_search_is_feasible_and_not_optimal_whatever_the_objectives_size(size: float) -> None:
    """A negative size maximises."""
    problem = posed(lambda v: size * valley(v), below, lower=-2.0, upper=2.0)
    for iterations in (1, 2):
        _, found = solved(problem, [0.3, 0.6], iterations)
        assert not found.optimal
        assert found.kkt > 100 * OPTIMAL
    values, found = solved(problem, [0.3, 0.6])
    assert found.optimal
    assert values.sum() == pytest.approx(1.0, abs=1e-5) or size < 0
    _, feasible = solved(posed(lambda v: size * valley(v), lambda v: [], lower=-2.0, upper=2.0), [0.3, 0.6], 1)
    assert feasible.holds(1e-8)  # which is not enough
    assert not feasible.optimal


def test_bounds_of_free_quantities_count() -> None:
    values, found = solved(posed(lambda v: ca.sumsqr(v - 1), lower=2.0, upper=3.0), [2.5, 2.7])
    np.testing.assert_allclose(values, 2.0, atol=1e-7)
    assert found.optimal
    assert not solved(posed(lambda v: ca.sumsqr(v - 1), lower=2.0, upper=3.0), [2.5, 2.7], 1)[1].optimal
    assert solved(posed(lambda v: ca.sumsqr(v - 1)), [1.0, 1.0])[1].optimal  # begun at the minimum


def test_a_problem_without_an_objective_is_optimal_where_it_holds() -> None:
    v = quantity("v", "m", np.zeros(1))
    row = Constraint("place", v.symbol**3, 8.0, 8.0)
    problem = compile_problem([v], [], free=["v"], constraints=[row])
    assert Engine(problem).solve(problem.pack({}), np.ones(1)).optimal
    assert not Engine(problem, max_iterations=1).solve(problem.pack({}), np.ones(1)).optimal


def test_each_condition_is_judged_from_the_point_and_its_multipliers_alone() -> None:
    """Of x + 2 y over x + y >= 1, y >= 0 the minimum is (1, 0) with multipliers 1 and 1."""
    x, p = ca.MX.sym("x", 2), ca.MX.sym("p", 0)
    made = slopes({"x": x, "p": p, "f": x[0] + 2 * x[1], "g": x[0] + x[1]})
    bounds = Bounds(np.array([-np.inf, 0.0]), np.full(2, np.inf), np.array([1.0]), np.array([np.inf]))

    def error(at: Sequence[float], lam_x: Sequence[float], lam_g: float) -> float:
        return kkt_error(made, bounds, np.zeros(0), np.zeros(2), *map(np.array, (at, lam_x, [lam_g])))

    assert error([1, 0], [0, -1], -1) == 0
    assert error([1, 0], [0, 0], -1) == pytest.approx(0.5)  # stationarity, over the slope 2
    assert error([1.2, 0], [0, -1], -1) == pytest.approx(0.1)  # complementarity of the row
    assert error([0.7, 0.3], [0, -1], -1) == pytest.approx(0.15)  # and of the bound
    assert error([1, 0], [0, -3], 1) == pytest.approx(1.0)  # of the wrong sign, and not stationary
    assert error([1, 0], [-1, -2], 0) == pytest.approx(0.5)  # a bound that is not there holds nothing
    assert error([np.nan, 0], [0, -1], -1) == np.inf
    fixed = Bounds(np.array([1.0, 0.0]), np.array([1.0, 0.0]), np.array([-np.inf]), np.array([np.inf]))
    nothing = (np.zeros(0), np.zeros(2), np.array([1.0, 0.0]), np.zeros(2), np.zeros(1))
    assert kkt_error(made, fixed, *nothing) == 0  # nothing is left to choose


def test_least_squares_are_at_a_minimum_where_no_column_sees_the_residuals() -> None:
    rng = np.random.default_rng(5)
    J, y = rng.normal(size=(30, 3)), 50 * rng.normal(size=30)
    c = np.linalg.lstsq(J, y, rcond=None)[0]
    free, step = np.zeros(3, bool), np.array([0.1, 0, 0])
    assert misfit_slope(J, J @ c - y, free, free) < 1e-12
    assert misfit_slope(J * [1e3, 1, 1e-3], J @ c - y, free, free) < 1e-12
    assert misfit_slope(J, J @ (c + step) - y, free, free) > 1e-4
    held = np.array([True, False, False])
    J[:, 1:] -= np.outer(J[:, 0], J[:, 0] @ J[:, 1:]) / (J[:, 0] @ J[:, 0])
    c = np.linalg.lstsq(J, y, rcond=None)[0]
    up, down = J @ (c + step) - y, J @ (c - step) - y
    assert misfit_slope(J, up, held, free) < 1e-12  # pushed against its lower bound
    assert misfit_slope(J, down, free, held) < 1e-12
    assert misfit_slope(J, up, free, held) > 1e-4  # pushed away from its upper one


def test_what_a_search_of_pressures_could_gain_is_zero_at_its_answer_alone() -> None:
    limits = Limits(np.zeros(2), np.ones(2), 1.5)

    def at(z: Sequence[float], r: Sequence[float], J: Any) -> Measured:
        return Measured(np.array(z, float), np.array(r, float), np.array(J, float), None)

    # of z_1 + 2 z_2 = 1 the shortest is (0.2, 0.4)
    assert could_gain(at([0.2, 0.4], [0.0], [[1, 2]]), limits, meets=True) < 1e-12
    assert could_gain(at([0.4, 0.3], [0.0], [[1, 2]]), limits, meets=True) > 0.1
    assert could_gain(at([1, 0.5], [-1.0, 0.0], np.eye(2)), limits, meets=False) < 1e-12  # at a bound
    assert could_gain(at([0.5, 0.5], [-1.0, 0.0], np.eye(2)), limits, meets=False) > 0.1
    assert could_gain(at([1, 0.5], [-1.0, -1.0], np.eye(2)), limits, meets=False) < 1e-12  # the sum's limit too


def test_the_words_name_the_error_and_its_limit() -> None:
    words = not_optimal(3.2e-2, "Maximum_Iterations_Exceeded")
    assert words.startswith("feasible, not optimal: the KKT error is 3.2e-02, above 1e-06")
    assert "Maximum_Iterations_Exceeded" in words
