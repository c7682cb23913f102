"""The blocked problem as one NLP: other solvers, both shapes at once, the weighted squares as an objective."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from softnlp import BAR, Loads, Numerics, material, robot
from softnlp.model.contact_settings import ClosureWeights, ContactSettings
from softnlp.model.quantities import Model
from softnlp.nlp import solver as nlp
from softnlp.nlp.problem import compile_problem
from softnlp.nlp.solver import Engine, discretisation_correction
from softnlp.nlp.transcription import MultipleShooting
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.blocked_grid import Blocked
from softnlp.statics.joint import joint_problem
from softnlp.statics.loadcase import load_case
from softnlp.statics.step import Step
from softnlp.statics.wall import Wall

ECOFLEX = material("Ecoflex 00-50")
WALL = Wall(np.zeros(3), np.array([1.0, 0.0, 0.0]))


def solver_of(name: str, intervals: int, contact: ContactSettings) -> BlockedSolver:
    return BlockedSolver(Model(robot(name), ECOFLEX), Numerics(intervals=intervals), contact)


def solved(solver: BlockedSolver, bar: float) -> tuple[Step, Blocked]:
    step, found = solver.solve(np.array([bar * BAR, 0.0, 0.0]), Loads(), WALL)
    assert found is not None, step.message
    return step, found


@pytest.mark.parametrize("closure", ["free", "compliant", "rigid"])
def test_newton_on_the_condensed_equations_and_ipopt_agree(closure: str) -> None:
    solver = solver_of("D20L60", 12, ContactSettings(closure=closure, tip_cap=2e-3))  # type: ignore[arg-type]
    near, found = solved(solver, 0.75)[1], solved(solver, 0.8)[1]
    reference = Engine(found.grid.problem).solve(found.solution.p, near.solution.x)
    assert reference.engine_status == "Solve_Succeeded"
    assert np.abs(found.solution.x - near.solution.x).max() > 1e-3
    np.testing.assert_allclose(found.solution.x, reference.x, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "closure"),
    [
        pytest.param("D25L60", "compliant", marks=pytest.mark.thorough),
        ("D15L60", "free"),
        pytest.param("D25L60", "free", marks=pytest.mark.slow),
        pytest.param("D20L40", "compliant", marks=pytest.mark.slow),
    ],
)
def test_both_shapes_in_one_problem_give_the_same_force(name: str, closure: str) -> None:
    K = 40  # the free lengths are those of the grid here and exact there
    solver = solver_of(name, K, ContactSettings(closure=closure))  # type: ignore[arg-type]
    near, (step, found) = solved(solver, 0.85)[1], solved(solver, 0.9)
    problem = joint_problem(solver, K, free_pressure=False).compiled
    assert [case.name for case in problem.cases] == ["free", "blocked"]
    assert "contact.free_lengths" not in {q.name for q in problem.fixed}
    values = solver.values(found.situation, found.pressed, np.zeros(0))
    del values["contact.free_lengths"]
    arc = solver.poses.arc_guess(solver.poses.grid(K), near.free.column, near.free.stretch)
    both = Engine(problem).solve(problem.pack(values), np.concatenate([arc, near.solution.x]))
    assert both.holds(1e-9)
    force = float(problem.outputs(x=both.x, p=both.p)["blocked_tip_forces"])
    assert step.contact is not None
    assert force == pytest.approx(step.contact.force, rel=1e-8)


@pytest.mark.parametrize("weights", [(2.0, 100.0, 30.0, None), (10.0, 50.0, 20.0, 1e3)])
def test_weighted_is_the_minimum_of_an_objective(weights: tuple[float, float, float, float | None]) -> None:
    # the tip's errors become free quantities and their squares the objective of the same load case; with these weights
    # the minimum in the plane is one in space too
    solver = solver_of("D25L60", 10, ContactSettings(closure="weighted", weights=ClosureWeights(*weights)))
    step, found = solved(solver, 0.5)
    declared = solver.functions.declared()
    case = load_case("blocked", solver.functions, declared, MultipleShooting(10))
    taken = solver.functions.tip_column(declared)
    units = ca.vertcat(case.length_unit, case.force_unit)
    tip = case.transcribed.nodes[:, -1]
    e_L = solver.functions.contact(tip, case.constants, case.symbols[2], taken, units)[1] * case.length_unit
    errors = {name: declared[f"contact.{name}_error"].symbol for name in ("force", "moment", "gap")}
    W_n, W_m, W_L, W_h = weights
    squares = ca.sumsqr(W_n * errors["force"]) + ca.sumsqr(W_m * errors["moment"]) + (W_L * e_L) ** 2
    freed = ["contact.force_error", "contact.moment_error"]
    if W_h is not None:
        squares += (W_h * errors["gap"]) ** 2
        freed.append("contact.gap_error")
    problem = compile_problem(list(declared.values()), [case], free=freed, objective=squares)
    values = solver.values(found.situation, found.pressed, found.free.lengths)
    start = np.concatenate([problem.pack_free({}), solved(solver, 0.4)[1].solution.x])
    best = Engine(problem).solve(problem.pack(values), start)
    assert best.engine_status == "Solve_Succeeded"
    assert step.contact is not None
    assert float(problem.outputs(x=best.x, p=best.p)["tip_forces"]) == pytest.approx(step.contact.force, rel=1e-6)
    left = {line.equation: line.value for line in step.contact.weighted}
    for name, line in (("force", "e_n"), ("moment", "e_m")):
        found_error = np.abs(problem.free_values(best.x)[f"contact.{name}_error"]).max()
        assert found_error == pytest.approx(left[line], rel=1e-6, abs=1e-9)
    np.testing.assert_allclose(best.x[problem.free_size :], found.solution.x, atol=1e-6)


def test_the_error_of_a_minimum_by_collocation_needs_no_factorisation(monkeypatch: pytest.MonkeyPatch) -> None:
    contact = ContactSettings(closure="weighted", weights=ClosureWeights(2.0, 100.0, 30.0, None))
    blocked = BlockedSolver(Model(robot("D25L40"), ECOFLEX), Numerics("collocation", intervals=2), contact)
    _, found = blocked.solve(np.array([1.2 * BAR, 0.0, 0.0]), Loads(), WALL)
    assert found is not None
    problem, linear = found.grid.problem, found.grid.reference.linear
    expected = discretisation_correction(problem, found.solution)
    size = np.abs(expected).max()
    assert size > 1e-9
    monkeypatch.setattr(nlp, "sparse_solve", lambda *_: pytest.fail("the whole matrix was factorised"))
    assert discretisation_correction(problem, found.solution, linear) == pytest.approx(expected, abs=1e-6 * size)
    again = found.grid.refinement(found.solution)
    assert (again[0], max(again[0], again[1] / 5, again[2] / 5)) == (found.error, found.refinement_error)


@pytest.mark.thorough
def test_weighted_by_collocation_is_the_same_minimum() -> None:
    # without a condensed step the errors left are found by a fixed-point iteration over square problems
    contact = ContactSettings(closure="weighted", weights=ClosureWeights(2.0, 100.0, 30.0, None))
    pressure = np.array([0.3 * BAR, 0.0, 0.0])
    steps = []
    for numerics in (Numerics(intervals=24), Numerics("collocation", intervals=5)):
        solver = BlockedSolver(Model(robot("D25L40"), ECOFLEX), numerics, contact)
        step, found = solver.solve(pressure, Loads(), WALL)
        assert found is not None, step.message
        assert step.contact is not None
        steps.append(step.contact)
    shooting, collocation = steps
    assert collocation.force == pytest.approx(shooting.force, rel=1e-5)
    for one, other in zip(shooting.weighted, collocation.weighted, strict=True):
        assert (one.equation, one.unit) == (other.equation, other.unit)
        assert other.value == pytest.approx(one.value, rel=1e-4, abs=1e-9)
