"""Cases joined by freed quantities and constraints are solved as one sparse factorisation solves them."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from softnlp import BAR, Coefficients, ContactSettings, IllPosedError, Numerics, forward, material, robot
from softnlp.base.quantity import quantity
from softnlp.model.quantities import Model
from softnlp.nlp.constraint import Constraint
from softnlp.nlp.linear import BorderedSolver, SparseSolver
from softnlp.nlp.problem import CompiledProblem, compile_problem
from softnlp.nlp.solver import Engine
from softnlp.nlp.transcription import MultipleShooting, method_named
from softnlp.statics.compiled import rod_equations
from softnlp.statics.condensed import StretchSolver, linear_solver
from softnlp.statics.joint import joint_problem
from softnlp.statics.kept import blocked_solver
from softnlp.statics.loadcase import load_case
from softnlp.statics.unloaded import unloaded_case

MODEL = Model(robot("D25L60"), material("Ecoflex 00-50"), Coefficients())
EQUATIONS = rod_equations(MODEL)
SOME = np.array([0.4, 0.3, 0.2]) * BAR
TIP = forward(MODEL.robot, MODEL.material, SOME).steps[0].pose.tip_position  # type: ignore[union-attr]


def two_loads(intervals: int = 6, *, arc_first: bool = False) -> CompiledProblem:
    """Return one robot under two loads, whose shared pressure and whose second load are free."""
    first = dict(EQUATIONS.declared)
    force = quantity("second force", "N", np.array([0.05, 0.0, -0.02]))
    second = {**first, "tip_force": replace(force, name="tip_force")}
    functions, method = EQUATIONS.functions, MultipleShooting(intervals)
    one = unloaded_case("one", functions, first) if arc_first else load_case("one", functions, first, method)
    other = load_case("other", functions, second, MultipleShooting(intervals + 3))
    apart = other.outputs["tip_position"] - one.outputs["tip_position"]
    wanted = [
        Constraint("tip", one.outputs["tip_position"] - TIP, unit="m", scale=one.length_unit),
        Constraint("apart", apart - np.array([2e-3, 0.0, 0.0]), unit="m", scale=one.length_unit),
    ]
    given = [*first.values(), force]
    return compile_problem(given, [one, other], free=["pressure", "second force"], constraints=wanted)


def somewhere(problem: CompiledProblem, seed: int, noise: float = 1e-2) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a point near the arc at 0.4 bar, the values, and a residual that is as good as any other."""
    rng = np.random.default_rng(seed)
    p = problem.pack({})
    functions = EQUATIONS.functions
    column = np.concatenate([np.ravel(q.nominal) for q in EQUATIONS.declared.values()])
    column[:3] = SOME
    parts = [problem.pack_free({"pressure": SOME})]
    for case in problem.cases:
        s = case.transcribed.points  # type: ignore[attr-defined]
        states = np.asarray(functions.arc(column, 1.1, s[None, :])).T.ravel() if s.size else np.zeros(0)
        parts += [[1.1], states]
    x = np.concatenate(parts)
    return x + noise * rng.standard_normal(x.size), p, rng.standard_normal(x.size)


@pytest.mark.parametrize("arc_first", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_cases_behind_a_border_give_the_numbers_of_one_factorisation(arc_first: bool, seed: int) -> None:
    problem = two_loads(arc_first=arc_first)
    x, p, g = somewhere(problem, seed)
    bordered = linear_solver(problem)
    assert isinstance(bordered, BorderedSolver)
    expected = SparseSolver(problem).solve(x, p, g)
    np.testing.assert_allclose(bordered.solve(x, p, g), expected, rtol=0, atol=1e-9 * np.max(np.abs(expected)))
    G = np.column_stack([g, -2 * g, g[::-1]])
    many = bordered.solve_many(x, p, G)
    np.testing.assert_allclose(many[:, 1], -2 * many[:, 0], atol=1e-10 * np.max(np.abs(many)))
    left = np.asarray(problem.jacobian(x, p)) @ many + G
    assert np.max(np.abs(left)) < 1e-8 * np.max(np.abs(many))


@pytest.mark.parametrize("free_pressure", [False, True])
def test_a_case_that_takes_what_another_one_found_is_solved_after_it(free_pressure: bool) -> None:
    solver = blocked_solver(MODEL, Numerics(intervals=5), ContactSettings(closure="compliant"))
    problem = joint_problem(solver, 5, free_pressure=free_pressure).compiled
    rng = np.random.default_rng(1)
    column = np.concatenate([np.ravel(q.nominal) for q in EQUATIONS.declared.values()])
    arc = np.asarray(solver.functions.arc(column, 1.1, np.linspace(0, 1, 6)[None, :])).T
    free = np.concatenate([[1.1], arc[:, :18].ravel()])
    x = np.concatenate([np.ones(int(free_pressure)), free, [1.1], arc.ravel(), [0.1]])
    x += 1e-2 * rng.standard_normal(x.size)
    values = {
        "pressure": [0.4 * BAR, 0.0, 0.0],
        "contact.wall_normal": [1.0, 0.0, 0.0],
        "contact.pressed": [1.0, 1.0, 0, 0, 0, 0],
    }
    p, g = problem.pack(values), rng.standard_normal(x.size)
    expected = SparseSolver(problem).solve(x, p, g)
    np.testing.assert_allclose(
        linear_solver(problem).solve(x, p, g), expected, rtol=0, atol=1e-8 * np.max(np.abs(expected))
    )


def test_newton_behind_a_border_and_ipopt_find_the_same_point() -> None:
    problem = two_loads()
    x, p, _ = somewhere(problem, 0, noise=1e-3)
    by_newton = Engine(problem, linear=linear_solver(problem), newton_only=True, max_iterations=40)
    found = by_newton.solve(p, x)
    reference = Engine(problem).solve(p, x)
    assert found.holds(1e-9)
    assert reference.holds(1e-9)
    np.testing.assert_allclose(found.x, reference.x, atol=1e-8)


def test_cases_that_are_not_condensed_take_a_sparse_factorisation() -> None:
    case = load_case("pose", EQUATIONS.functions, EQUATIONS.declared, method_named("collocation", 2))
    assert isinstance(linear_solver(compile_problem(list(EQUATIONS.declared.values()), [case])), SparseSolver)


def test_singular_parts_are_named() -> None:
    column = np.concatenate([np.ravel(q.nominal) for q in EQUATIONS.declared.values()])
    with pytest.raises(np.linalg.LinAlgError, match="stretch balance"):
        StretchSolver(EQUATIONS.functions).solve_many(np.array([np.nan]), column, np.ones((1, 2)))
    declared = dict(EQUATIONS.declared)
    case = load_case("pose", EQUATIONS.functions, declared, MultipleShooting(4))
    least = compile_problem(
        list(declared.values()), [case], free=["pressure"], objective=ca.sumsqr(case.outputs["tip_position"])
    )
    with pytest.raises(IllPosedError, match="no Jacobian"):
        linear_solver(least)
