"""Searches with IPOPT: where they begin, how they end in short steps, and rows left out of the Hessian."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from softnlp.base.quantity import quantity
from softnlp.nlp.constraint import Constraint
from softnlp.nlp.problem import CompiledProblem, compile_problem
from softnlp.nlp.search import Start, in_steps, minima, spread
from softnlp.nlp.solver import Engine


def valley(*, in_hessian: bool = True, order: bool = False) -> CompiledProblem:
    """Return Rosenbrock's valley beside the outside of a circle, with a plain row behind or before it."""
    v = quantity("v", "1", np.zeros(2), lower=-3.0, upper=3.0)
    x, y = v.symbol[0], v.symbol[1]
    rows = [Constraint("circle", x**2 + y**2, -np.inf, 1.0, in_hessian=in_hessian), Constraint("sum", x + y, -4.0, 4.0)]
    cost = (1 - x) ** 2 + 100 * (y - x**2) ** 2
    return compile_problem([v], [], free=["v"], constraints=rows[::-1] if order else rows, objective=cost)


def test_starts_are_spread_in_their_box() -> None:
    lower, upper = np.array([1.0, -3.0, 0.0]), np.array([2.0, 5.0, 0.1])
    unit = (spread(lower, upper, 256) - lower) / (upper - lower)
    assert np.all((unit >= 0) & (unit < 1))
    np.testing.assert_allclose(unit[0], 0.5)
    counts, _ = np.histogramdd(unit, bins=(4, 4, 4), range=[(0, 1)] * 3)
    assert counts.min() >= 1
    assert counts.max() <= 9


@pytest.mark.parametrize("order", [False, True])
def test_a_row_left_out_of_the_hessian_moves_no_minimum(order: bool) -> None:
    whole, less = valley(order=order), valley(in_hessian=False, order=order)
    assert [c.name for c in less.constraints] == [e.name for e in less.equations] == ["sum", "circle"]
    x, multipliers = np.array([0.3, -0.7]), np.array([0.5, 2.0])
    where = [c.name for c in whole.constraints].index("circle")
    exact = ca.triu(ca.hessian(whole.nlp["f"] + 2 * whole.nlp["g"][where], whole.nlp["x"])[0])
    curved = np.asarray(ca.Function("H", [whole.nlp["x"]], [exact])(x))
    np.testing.assert_allclose(curved - np.asarray(less.hessian(x, [], 1.0, multipliers)), np.diag([4.0, 4.0]))
    np.testing.assert_allclose(np.asarray(less.jacobian(x, [])), [[1.0, 1.0], 2 * x])
    ends = [Engine(problem, ipopt_only=True).solve(problem.pack({}), np.zeros(2)) for problem in (whole, less)]
    assert all(end.optimal for end in ends)
    assert ends[0].x @ ends[0].x == pytest.approx(1.0, abs=1e-9)
    np.testing.assert_allclose(ends[0].x, ends[1].x, atol=1e-7)
    assert ends[1].ipopt is not None
    assert ends[1].ipopt.objective == pytest.approx(float((1 - ends[1].x[0]) ** 2), abs=2e-2)


def test_short_steps_end_where_a_solve_at_once_does_and_take_no_longer_ones() -> None:
    problem = valley()
    start = Start(Engine(problem, ipopt_only=True), problem.pack({}), np.array([0.2, 0.6]))
    near = start.engine.solve(start.p, start.x, room=0.01)
    assert np.abs(near.x - start.x).max() == pytest.approx(0.01, abs=1e-6)
    slow = in_steps(start, 1e-7)
    (at_once,) = minima([start], 1e-7)
    assert slow.optimal
    np.testing.assert_allclose(slow.x, at_once.x, atol=1e-6)
    assert slow.iterations > at_once.iterations


def test_starts_that_are_lost_at_once_are_begun_again_in_steps() -> None:
    problem = valley()
    stopped = Engine(problem, ipopt_only=True, max_iterations=1, tolerance=1e-12)
    start = Start(stopped, problem.pack({}), np.array([2.9, 2.9]))
    found = minima([start, start], 1e-7)
    assert len(found) == 4
    assert np.isfinite([end.residual for end in found[:2]]).all()
    assert np.isinf([end.residual for end in found[2:]]).all()
    assert found[2].iterations == 15
