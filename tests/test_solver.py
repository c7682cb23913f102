"""What is called a solution: residuals evaluated again, certificates, orders of convergence, hard cases, named ends."""

from __future__ import annotations

import re
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from cases import equals, pose
from designs import body_of, random_design, rubber_of, silicone
from slow import some_slow
from witness import Witnessed, shoot
from witness_section import section

from softnlp.base.quantity import quantity
from softnlp.base.status import Status
from softnlp.model.conventions import Coefficients
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.robot import ROBOTS, Robot
from softnlp.model.rod import Loads
from softnlp.nlp import solver
from softnlp.nlp.continuation import follow, straight_path
from softnlp.nlp.linear import SparseSolver
from softnlp.nlp.solver import Engine, Solution, certificate, discretisation_correction, violation
from softnlp.nlp.transcription import Collocation, MultipleShooting, Transcription
from softnlp.statics import compiled
from softnlp.statics import solver as statics
from softnlp.statics.attempts import Attempt
from softnlp.statics.branch import stretch_on_branch
from softnlp.statics.condensed import CondensedSolver
from softnlp.statics.loadcase import rod_functions
from softnlp.statics.solver import PoseSolver
from softnlp.statics.step import Step
from softnlp.studies.forward import forward

sys.path.insert(0, str(Path(__file__).parents[1]))  # benchmarks/ is not installed

from benchmarks.robustness import RESIDUAL, hard_case, outcome_of, report, solve_cold

ECOFLEX_50 = silicone("Ecoflex 00-50")
MODEL = Model(ROBOTS["D20L60"], ECOFLEX_50)
LOADS = {"tip_force": (0.03, -0.05, 0.02), "tip_moment": (1e-3, 0.0, 5e-4), "gravity": (0.0, 3.0, -9.0)}
VALUES = {"pressure": (8e4, 2e4, 0.0), **LOADS}
EQUATIONS = {
    "stretch balance": "N",
    "base position": "m",
    "base orientation": "1",
    "continuity of position": "m",
    "continuity of rotation": "1",
    "continuity of force": "N",
    "continuity of moment": "N m",
    "tip force": "N",
    "tip moment": "N m",
}
STAGES = {
    "collocation of position": "m",
    "collocation of rotation": "1",
    "collocation of force": "N",
    "collocation of moment": "N m",
}


def witness_of_values() -> Witnessed:
    sec = section(body_of(MODEL.robot), rubber_of(MODEL.material), np.array(VALUES["pressure"]))
    return shoot(sec, LOADS["tip_force"], LOADS["tip_moment"], LOADS["gravity"])


# --- the residual and the certificate --------------------------------------------------------------------------------


@pytest.mark.parametrize("transcription", ["multiple-shooting", "collocation"])
def test_the_certificate_of_a_step_has_every_equation_with_its_unit(transcription: str) -> None:
    step = forward(
        MODEL.robot,
        ECOFLEX_50,
        VALUES["pressure"],
        loads=Loads(**LOADS),
        numerics=Numerics(transcription=transcription),
    ).steps[0]
    assert {line.equation: line.unit for line in step.certificate} == EQUATIONS | (
        STAGES if transcription == "collocation" else {}
    )
    assert step.residual is not None
    assert step.residual == max(line.scaled for line in step.certificate)
    assert step.residual <= 1e-8
    # the scales: L for lengths, EI / L^2 for forces, EI / L for moments
    rest = section(body_of(MODEL.robot), rubber_of(ECOFLEX_50), [0, 0, 0])
    EI, L = sum(rest.EI) / 2, MODEL.robot.length
    scale = {"m": L, "N": EI / L**2, "N m": EI / L, "1": 1.0}
    for line in step.certificate:
        assert line.value == pytest.approx(line.scaled * scale[line.unit], rel=1e-9, abs=1e-30)


def test_a_certificate_measures_how_wrong_a_point_is() -> None:
    posed = pose(MODEL)
    solution = posed.solve(VALUES)
    w = witness_of_values()
    L = MODEL.robot.length
    x = solution.x.copy()
    x[-18] += 0.01  # the tip 0.01 L beside where it is
    moved = replace(solution, x=x)
    lines = {line.equation: line for line in certificate(posed.problem, moved)}
    assert lines["continuity of position"].scaled == pytest.approx(0.01, rel=1e-6)
    assert lines["continuity of position"].value == pytest.approx(0.01 * L, rel=1e-6)
    assert lines["tip force"].scaled < 1e-10
    assert violation(posed.problem, x, solution.p) == pytest.approx(0.01, rel=1e-6)
    # a wrong load is a wrong tip force, in newtons
    heavier = posed.problem.pack({**VALUES, "tip_force": np.add(LOADS["tip_force"], (0, 0.004, 0))})
    lines = {line.equation: line for line in certificate(posed.problem, replace(solution, p=heavier))}
    assert lines["tip force"].value == pytest.approx(0.004, rel=1e-6)
    assert lines["tip moment"].scaled < 1e-10
    assert posed.outputs(solution)["stretch"][0] == pytest.approx(w.stretch, rel=1e-10)


def test_a_number_that_is_not_finite_is_not_a_solution() -> None:
    posed = pose(MODEL)
    engine = Engine(posed.problem)
    start = posed.start(VALUES)
    for bad in ({"pressure": (np.nan, 0, 0)}, {"tip_force": (np.inf, 0, 0)}, {"robot.length": 0.0}):
        found = engine.solve(posed.problem.pack({**VALUES, **bad}), start)
        assert found.residual == np.inf
        assert not found.holds(1e300)
    found = engine.solve(posed.problem.pack(VALUES), np.full_like(start, np.nan))
    assert not found.holds(1e-8)
    # and the engine still works
    assert engine.solve(posed.problem.pack(VALUES), start).holds(1e-10)


def test_an_engine_that_stopped_early_is_not_believed() -> None:
    posed = pose(MODEL)
    p, start = posed.problem.pack(VALUES), posed.start(VALUES)
    stopped = Engine(posed.problem, max_iterations=1).solve(p, start)
    assert stopped.residual > 1e-3
    assert not stopped.holds(1e-8)
    assert stopped.residual == violation(posed.problem, stopped.x, p)
    # what the engine says does not matter, only the equations: nothing converged, yet the point is right
    right = Engine(posed.problem).solve(p, start)
    repeated = Engine(posed.problem, max_iterations=1).solve(p, right.x)
    assert repeated.holds(1e-10)


def test_freed_quantities_get_the_iterations_that_they_need() -> None:
    # from far away, with what the engine gives by itself
    target = quantity("target", "m", tuple(np.asarray(witness_of_values().tip_position)))
    posed = pose(
        MODEL,
        free=["pressure"],
        constraints=lambda cases, given: [equals("tip", cases[0].outputs["tip_position"], target.symbol, "m", 0.06)],
        extra=[target],
    )
    values = {name: value for name, value in VALUES.items() if name != "pressure"}
    start = posed.start({**values, "pressure": (1e3, 1e3, 1e5)})
    found = Engine(posed.problem).solve(posed.problem.pack(values), start)
    assert found.iterations > 15
    assert found.holds(1e-8)


def test_a_bound_is_met_exactly() -> None:
    # a tip that a pressure below zero would reach: IPOPT itself lets a bound give by 1e-8 of the scale
    posed = pose(
        MODEL,
        free=["pressure"],
        objective=lambda cases, given: ca.sumsqr(cases[0].outputs["tip_position"] - ca.DM([0.0, 0.0, 0.02])) / 0.06**2,
    )
    found = posed.solve({}, {"pressure": [2e4, 1e4, 1e4]}, max_iterations=200)
    pressure = posed.problem.free_values(found.x)["pressure"]
    assert found.holds(1e-8)
    assert np.all(pressure >= 0.0)


def test_an_impossible_problem_is_not_solved() -> None:
    # a tip further away than any pressure moves it
    target = quantity("target", "m", (0.0, 0.0, 10.0))
    posed = pose(
        MODEL,
        free=["pressure"],
        constraints=lambda cases, given: [equals("tip", cases[0].outputs["tip_position"], target.symbol, "m", 0.06)],
        extra=[target],
    )
    found = posed.solve({}, {"pressure": [3e4, 3e4, 3e4]}, max_iterations=60)
    assert found.residual > 1.0


def test_two_threads_share_an_engine_and_get_right_answers() -> None:
    posed = pose(MODEL)
    linear = CondensedSolver(posed.functions, MultipleShooting(24))
    pressures = [(1e4 * k, 5e3 * (k % 3), 0.0) for k in range(8)]
    tasks = [{**VALUES, "pressure": pressure} for pressure in pressures]
    starts = [posed.start(values) for values in tasks]
    for engine in (Engine(posed.problem), Engine(posed.problem, linear=linear)):
        alone = [engine.solve(posed.problem.pack(v), x) for v, x in zip(tasks, starts, strict=True)]
        with ThreadPoolExecutor(2) as pool:
            for _ in range(3):
                together = list(pool.map(lambda v, x: engine.solve(posed.problem.pack(v), x), tasks, starts))  # noqa: B023
                for one, two in zip(alone, together, strict=True):
                    assert two.holds(1e-10)
                    np.testing.assert_allclose(two.x, one.x, atol=1e-9)


# --- orders, estimates, linear algebra -------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def truth() -> Witnessed:
    return witness_of_values()


def tip_error(method: Transcription, w: Witnessed) -> tuple[float, float]:
    """Return the error of the tip position over L_0 on a grid, and its estimate."""
    posed = pose(MODEL, method=method)
    solution = posed.solve(VALUES)
    assert solution.holds(1e-9)
    error = posed.outputs(solution)["tip_position"] - w.tip_position
    correction = discretisation_correction(posed.problem, solution)[-18:-15] * 2**method.order / (2**method.order - 1)
    return float(np.linalg.norm(error)) / MODEL.robot.length, float(np.linalg.norm(correction))


@pytest.mark.parametrize(
    ("method", "grids", "order"),
    [
        (MultipleShooting(1), (20, 40, 80), 4),
        (Collocation(1, 1, "legendre"), (20, 40, 80), 2),
        (Collocation(1, 2, "legendre"), (8, 16, 32), 4),
        (Collocation(1, 3, "legendre"), (3, 6, 10), 6),
        (Collocation(1, 4, "legendre"), (2, 3, 4), 8),
        (Collocation(1, 2, "radau"), (12, 24, 48), 3),
        (Collocation(1, 3, "radau"), (4, 8, 16), 5),
    ],
    ids=["RK4", "Legendre-1", "Legendre-2", "Legendre-3", "Legendre-4", "Radau-2", "Radau-3"],
)
def test_the_tip_of_a_loaded_rod_converges_at_the_order_of_the_method(
    method: Transcription, grids: tuple[int, ...], order: int, truth: Witnessed
) -> None:
    found = [tip_error(method.with_intervals(K), truth) for K in grids]
    errors = [error for error, _ in found]
    assert method.order == order
    measured = np.log(errors[-2] / errors[-1]) / np.log(grids[-1] / grids[-2])
    assert measured == pytest.approx(order, abs=0.15 if order <= 4 else 0.8), errors
    for error, estimate in found[1:]:
        assert 1 / 3 <= estimate / error <= 3


def test_the_condensed_solver_is_the_sparse_one() -> None:
    posed = pose(MODEL)
    rng = np.random.default_rng(0)
    x, p = posed.start(VALUES), posed.problem.pack(VALUES)
    x = x * (1 + 0.02 * rng.normal(size=x.size))  # away from a solution
    g = np.asarray(posed.problem.residual(x, p)).ravel()
    J = np.asarray(posed.problem.jacobian(x, p).full())
    expected = np.linalg.solve(J, -g)
    found = CondensedSolver(rod_functions(MODEL), MultipleShooting(24)).solve(x, p, g)
    np.testing.assert_allclose(found, expected, atol=1e-9 * np.abs(expected).max())


def test_newton_and_ipopt_reach_the_same_point() -> None:
    posed = pose(MODEL)
    p, start = posed.problem.pack(VALUES), posed.start(VALUES)
    linear = CondensedSolver(posed.functions, MultipleShooting(24))
    one, two = (Engine(posed.problem, linear=given).solve(p, start) for given in (None, linear))
    assert one.holds(1e-10)
    assert two.holds(1e-10)
    assert one.engine_status != two.engine_status
    np.testing.assert_allclose(two.x, one.x, atol=1e-8)


@pytest.mark.parametrize("size", ["small", "too large"])
def test_what_newton_does_not_solve_is_left_to_ipopt_unless_it_is_too_large(
    size: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    posed = pose(MODEL)
    p, start = posed.problem.pack(VALUES), posed.start(VALUES)
    linear = CondensedSolver(posed.functions, MultipleShooting(24))
    monkeypatch.setattr(solver, "_NEWTON_STEPS", 1)
    if size == "too large":
        monkeypatch.setattr(solver, "_LARGEST_FALLBACK", start.size - 1)
    found, quick = (Engine(posed.problem, linear=linear, newton_only=only).solve(p, start) for only in (False, True))
    assert quick.engine_status == "Newton reached its iteration limit"
    assert not quick.holds(1e-8)
    if size == "too large":
        assert found.engine_status == quick.engine_status
        np.testing.assert_array_equal(found.x, quick.x)
    else:
        assert found.engine_status == "Solve_Succeeded"
        assert found.holds(1e-10)
        assert found.iterations > quick.iterations
        alone = Engine(posed.problem).solve(p, start)
        assert found.iterations == alone.iterations + quick.iterations


def test_a_jacobian_that_is_not_finite_is_singular() -> None:
    posed = pose(MODEL)
    p, x = posed.problem.pack(VALUES), posed.start(VALUES)
    g = np.asarray(posed.problem.residual(x, p)).ravel()
    sparse = SparseSolver(posed.problem)
    assert np.isfinite(sparse.solve(x, p, g)).all()
    with pytest.raises(np.linalg.LinAlgError, match="not finite"):
        sparse.solve(np.full_like(x, np.nan), p, g)


def test_following_a_path_arrives_or_says_how_far_it_came() -> None:
    posed = pose(MODEL)
    engine = Engine(posed.problem)
    unloaded = {"pressure": VALUES["pressure"]}
    start = posed.start(unloaded)

    def distance(change: np.ndarray) -> float:
        return float(np.abs(change).max())

    followed = follow(engine, straight_path(posed.problem, unloaded, VALUES), start, distance=distance)
    assert followed.arrived
    np.testing.assert_allclose(followed.solution.x, posed.solve(VALUES).x, atol=1e-8)
    # towards a pressure that the law cannot balance
    yeoh = Model(ROBOTS["D20L60"], silicone("Ecoflex 00-30", "yeoh"), Coefficients(elongation=0.0))
    posed = pose(yeoh)
    path = straight_path(posed.problem, {}, {"pressure": (2e5, 2e5, 2e5)})  # its branch ends at 1.1467e5
    followed = follow(Engine(posed.problem), path, posed.start({}), distance=distance)
    assert not followed.arrived
    assert followed.fraction == pytest.approx(1.146663e5 / 2e5, abs=2e-3)
    assert followed.solution.holds(1e-9)


SLIM = replace(ROBOTS["D20L60"], chamber_diameter=3e-3)  # whose GJ outlasts the limit pressure


# --- named ends ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("robot", "material", "coefficients", "pressure", "status"),
    [
        (SLIM, ("Ecoflex 00-30", "yeoh"), {"elongation": 0.0}, (6e5, 6e5, 6e5), Status.NO_EQUILIBRIUM),
        (SLIM, ("Ecoflex 00-30", "yeoh"), {"elongation": 0.0}, (6e5, 5.9e5, 5.9e5), Status.NO_EQUILIBRIUM),
        ("D20L60", ("Ecoflex 00-30", "yeoh"), {"elongation": 0.0}, (4e5, 4e5, 4e5), Status.UNSTABLE_MATERIAL),
        ("D25L60", ("Dragon Skin 10", "yeoh"), {"elongation": 0.2}, (100e5, 100e5, 100e5), Status.UNSTABLE_MATERIAL),
        ("D25L60", ("Ecoflex 00-50", "ogden"), {}, (15e5, 15e5, 15e5), Status.UNSTABLE_MATERIAL),
    ],
)
def test_a_branch_that_ends_is_named_with_the_last_pressure_that_solves(
    robot: str | Robot,
    material: tuple[str, str],
    coefficients: dict[str, float],
    pressure: tuple[float, ...],
    status: Status | None,
) -> None:
    def at(P: np.ndarray, intervals: int | None = None) -> Step:
        numerics = Numerics(intervals=intervals)
        given = Coefficients(**coefficients)
        body = ROBOTS[robot] if isinstance(robot, str) else robot
        return forward(body, silicone(*material), P, coefficients=given, numerics=numerics).steps[0]

    beyond = at(np.array(pressure))
    assert beyond.status is status
    assert beyond.pose is None
    assert beyond.residual is None
    found = re.search(r"last pressure with an equilibrium is ([\d., e+-]+) bar", beyond.message)
    assert found
    last = 1e5 * np.array([float(word) for word in found.group(1).split(",")])
    np.testing.assert_allclose(last / last.sum(), np.array(pressure) / sum(pressure), rtol=1e-4)
    solved = at(last, 150)
    assert solved.status is Status.SOLVED
    assert solved.residual is not None
    assert solved.residual <= 1e-8
    assert at(1.001 * last).status is beyond.status


@pytest.mark.parametrize("transcription", ["multiple-shooting", "collocation"])
def test_near_vanishing_stiffness_a_pose_ends_in_a_named_status(
    transcription: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # EI falls towards zero, so the robot curls up hundreds of times, more than any grid shows
    model = Model(ROBOTS["D10L40"], silicone("Ecoflex 00-10", "yeoh"), Coefficients(elongation=0.0, bending=0.0))
    solver = PoseSolver(model, Numerics(transcription=transcription))
    column = solver.column({"pressure": np.array([1e6, 0, 0])})
    last = stretch_on_branch(solver.branch, column, np.array([1e6, 0, 0])).fraction * 1e6
    assert solver.solve(np.array([0.4 * last, 0, 0]), Loads())[0].status is Status.SOLVED
    step, found = solver.solve(np.array([0.99 * last, 0, 0]), Loads())
    if transcription == "collocation":  # a coarse grid holds the equations, though nothing like the coil
        assert step.status is Status.INACCURATE
        assert "with 80 intervals it is 22 L_0, and 320 would take too long" in step.message
    else:
        assert step.status is Status.DIVERGED
        assert "curls" in step.message
    assert step.pose is None
    assert found is None
    # with a load there are many paths to try, but only so much work
    step, found = solver.solve(np.array([0.99 * last, 0, 0]), Loads(tip_force=(1e-3, 2e-3, 0)))
    assert step.status is Status.DIVERGED
    assert "took too long" in step.message
    assert step.iterations < 400
    assert found is None


def test_what_cannot_be_judged_is_not_a_solution(monkeypatch: pytest.MonkeyPatch) -> None:
    def solve() -> Step:
        return PoseSolver(MODEL, Numerics(intervals=20)).solve(np.array(VALUES["pressure"]), Loads(**LOADS))[0]

    assert solve().status is Status.SOLVED

    def singular(*_: object) -> int:
        raise np.linalg.LinAlgError("Singular matrix")

    with monkeypatch.context() as patched:
        patched.setattr(compiled, "conjugate_points", singular)
        step = solve()
        assert step.status is Status.DIVERGED
        assert "cannot be judged: Singular matrix" in step.message
    monkeypatch.setattr(statics, "discretisation_correction", lambda *_: np.full(18, np.nan))
    step = solve()
    assert step.status is Status.DIVERGED
    assert "error is not finite" in step.message


def test_of_unstable_equilibria_the_first_on_the_load_path_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    solver = PoseSolver(Model(ROBOTS["D10L60"], silicone("Ecoflex 00-10")), Numerics(intervals=10))
    weight = Loads(gravity=(0.0, 0.0, -9.8))
    P = np.zeros(3)
    found = solver.solve(P, weight)[1]
    assert found is not None
    assert not found.stable
    named = [("guessed", False), ("first", True), ("second", True), ("guessed again", False)]

    def four(*_: object) -> list[Attempt]:
        return [Attempt(replace(found.solution, engine_status=name), on_path=on_path) for name, on_path in named]

    monkeypatch.setattr(statics, "attempts", four)
    kept = solver.solve(P, weight)[1]
    assert kept is not None
    assert kept.solution.engine_status == "first"


@pytest.mark.parametrize("exponent", [1.5, 2.0, 5.0])
def test_absurd_loads_end_in_a_named_status(exponent: float) -> None:
    design = random_design(np.random.default_rng([0, 9]))
    sec = design.section
    F = 10**exponent * sum(sec.EI) / 2 / sec.L**2 * np.array([0.3, -0.5, 0.8])
    numerics = Numerics(intervals=40)
    step = forward(design.robot, design.material, design.pressure, loads=Loads(tip_force=F), numerics=numerics).steps[0]
    if step.status is Status.SOLVED:
        assert step.pose is not None
        assert step.residual is not None
        assert step.residual <= 1e-8
        # so far from EI / L^2 the model may have squeezed the rod to nothing; then it says so
        squeezed = step.pose.shape.shear_extension[:, 2].min() <= 0
        assert squeezed == any("v_z" in warning for warning in step.warnings)
    else:
        assert step.status in (Status.DIVERGED, Status.INACCURATE)
        assert step.pose is None
        assert step.message


# --- hard cases ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", some_slow(40, quick=7))
def test_a_hard_case_is_solved_or_honestly_not(seed: int) -> None:
    outcome = outcome_of(seed, hardest=0.45 if seed >= 10 else 1.0)
    assert not outcome.error
    assert not outcome.wrong
    if outcome.status == Status.SOLVED:
        assert outcome.residual is not None
        assert outcome.residual <= RESIDUAL


def test_the_benchmark_counts_what_it_is_given() -> None:
    one, two = outcome_of(3, hardest=0.2), replace(outcome_of(4, hardest=0.2), status="solved", residual=1.0)
    assert one.success
    assert not two.success
    assert two.wrong
    text = report([one, two])
    assert "2 cases, 1 solved" in text
    assert "50.0 %" in text
    assert "solved in name only: 1" in text
    case = hard_case(5, hardest=0.2)
    assert isinstance(solve_cold(case).status, Status)
    assert str(case) == str(hard_case(5, hardest=0.2))


def test_a_solution_says_whether_it_holds() -> None:
    solution = Solution(np.zeros(1), np.zeros(1), 1e-9, 3, "Solved_To_Acceptable_Level")
    assert solution.holds(1e-8)
    assert not replace(solution, residual=2e-8, engine_status="Solve_Succeeded").holds(1e-8)
    assert not replace(solution, residual=np.inf).holds(np.finfo(float).max)
