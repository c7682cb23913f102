"""Copies of a problem as one: its derivatives against CasADi's of the whole, and what joins the copies."""

from __future__ import annotations

import casadi as ca
import numpy as np

from softnlp import BAR, Body, Constraint, MultipleShooting, Segment, case, material, problem, robot
from softnlp.nlp.joined import Link, joined
from softnlp.nlp.problem import CompiledProblem
from softnlp.nlp.solver import Engine

BODY = Body([Segment(robot("D25L60"), material("Ecoflex 00-50"))])
COUNT = 3


def one() -> CompiledProblem:
    """Return a problem whose bending angle has a least size."""
    P = BODY.quantities["pressure"].symbol
    pose = case("pose", BODY, method=MultipleShooting(3))
    bent = Constraint("bending angle", pose.outputs["bending_angle"], 0.5, np.inf, unit="rad")
    return problem([pose], free=["pressure"], constraints=[bent], objective=ca.sumsqr(P / BAR)).compiled


def linked(limit: float) -> tuple[CompiledProblem, CompiledProblem]:
    """Return copies whose first pressure may change by a limit [bar], with the squares of these changes beside."""
    alone = one()
    n = alone.nlp["x"].numel()
    change = ca.DM(COUNT - 1, COUNT * n)
    for k in range(COUNT - 1):
        change[k, k * n], change[k, (k + 1) * n] = -1.0, 1.0
    bound = np.full(COUNT - 1, limit)
    return alone, joined(
        alone, COUNT, links=[Link("change", change, -bound, bound, "bar")], quadratic=change.T @ change
    )


def test_the_blocks_are_the_derivatives_of_the_whole() -> None:
    _, whole = linked(0.1)
    x, p, f, g = (whole.nlp[name] for name in "xpfg")
    lam = ca.MX.sym("lam", g.numel())
    expected = ca.Function("all", [x, p, lam], [ca.jacobian(g, x), ca.triu(ca.hessian(2 * f + ca.dot(lam, g), x)[0])])
    rng = np.random.default_rng(1)
    at = rng.uniform(0.1, 0.5, x.numel()), np.tile(one().pack({}), COUNT)
    multipliers = rng.normal(size=g.numel())
    J, H = expected(*at, multipliers)
    assert np.allclose(np.asarray(whole.jacobian(*at)), np.asarray(J), atol=1e-12)
    assert np.allclose(np.asarray(whole.hessian(*at, 2.0, multipliers)), np.asarray(H), atol=1e-9)


def test_copies_without_links_are_the_problem_alone_and_rows_have_their_names() -> None:
    alone, whole = linked(0.1)
    n, m = alone.nlp["x"].numel(), alone.nlp["g"].numel()
    rng = np.random.default_rng(2)
    X = rng.uniform(0.8, 1.2, (COUNT, n))
    p = alone.pack({})
    g = np.asarray(whole.residual(X.ravel(), np.tile(p, COUNT))).ravel()
    for k in range(COUNT):
        assert np.allclose(g[k * m : (k + 1) * m], np.asarray(alone.residual(X[k], p)).ravel())
    assert np.allclose(g[COUNT * m :], np.diff(X[:, 0]))
    named = {e.name: e.rows for e in whole.equations}
    assert named["change"].tolist() == [COUNT * m, COUNT * m + 1]
    assert sorted(np.concatenate(list(named.values())).tolist()) == list(range(g.size))


def test_ipopt_solves_copies_as_it_solves_one() -> None:
    alone, whole = linked(1.0)
    p = alone.pack({})
    posed = problem([case("pose", BODY, method=MultipleShooting(3))])
    start = posed._start({"pressure": [0.5 * BAR, 0, 0]}, {})
    x = np.concatenate([[0.5, 0.0, 0.0], start])
    single = Engine(alone, ipopt_only=True, tolerance=1e-9).solve(p, x)
    several = Engine(whole, ipopt_only=True, tolerance=1e-9).solve(np.tile(p, COUNT), np.tile(x, COUNT))
    assert single.optimal
    assert several.optimal
    assert np.allclose(several.x.reshape(COUNT, -1), single.x, atol=1e-6)
