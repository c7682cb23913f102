"""Problems posed with the public pieces: the page's examples by every engine and transcription, chains, refusals."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import casadi as ca
import numpy as np
import pytest
from test_pages import blocks

from softnlp import (
    BAR,
    DEGREE,
    MILLIMETRE,
    Body,
    Coefficients,
    Collocation,
    Constraint,
    IllPosedError,
    InputError,
    Loads,
    Material,
    MultipleShooting,
    Numerics,
    Robot,
    RobotError,
    Segment,
    Status,
    blocked_force,
    case,
    follow,
    formula_law,
    forward,
    material,
    problem,
    quantity,
    robot,
    solve,
)
from softnlp.figures import sparsity_figure
from softnlp.nlp.reduced import Reduced, held_states
from softnlp.statics.condensed import linear_solver

D25, SOFT = robot("D25L60"), material("Ecoflex 00-50")
SHOOTING, COLLOCATION = MultipleShooting(16), Collocation(3)
PRESSURE = np.array([0.5, 0.1, 0.0]) * BAR
LOADS = {"tip_force": (0.03, 0.02, -0.01), "gravity": (0.0, 0.0, 9.80665)}


@cache
def examples() -> dict[str, Any]:
    """Return what the page's blocks define; the page's own test runs all that they do."""
    found: dict[str, Any] = {}
    for _, language, code in blocks("problem"):
        if language == "python" and ("import" in code or "def " in code):
            exec(code.split("\n\n\nfound =")[0].split("\n\n\nprint(")[0], found)
    return found


CHOICES = ("through_a_hole", "stiff_enough")
NAMES = ("pressure_for_angle", "constant_from_tip", "through_a_hole", "stiff_enough", "one_tip")


@pytest.mark.parametrize("method", [MultipleShooting(10), COLLOCATION], ids=["shooting", "collocation"])
@pytest.mark.parametrize("name", NAMES)
def test_an_example_of_the_page_has_one_answer(name: str, method: Any) -> None:
    """Newton's method and IPOPT agree, in states and in what is free; with a choice "auto" is IPOPT."""
    engines = ("newton", "auto") if name in CHOICES else ("newton", "ipopt", "auto")
    answers = {engine: examples()[name](method, engine) for engine in engines}
    assert {a.status for a in answers.values()} == {Status.SOLVED}
    x = answers["auto"].solution.x
    flat = 1e-4 if name == "through_a_hole" else 1e-7  # of two pressures that cost nearly the same
    for answer in answers.values():
        np.testing.assert_allclose(answer.solution.x, x, atol=flat)
        assert max(line.scaled for line in answer.residuals) <= 1e-8
    found = answers["auto"]
    assert found.solution.ipopt is not None
    if name == "pressure_for_angle":
        again = forward(D25, SOFT, [found["pressure"]], loads=Loads(tip_force=(0.02, 0.01, 0.0))).steps[0].pose
        assert again is not None
        assert again.bending_angle == pytest.approx(60 * DEGREE, abs=1e-3)
        np.testing.assert_allclose(found["tip_position"], again.tip_position, atol=1e-3 * D25.length)
    if name == "one_tip":  # what holds one, holds the other
        np.testing.assert_allclose(
            found["left_tip_position"], found["right_tip_position"] + [30 * MILLIMETRE, 0, 0], atol=1e-10
        )


def posed_pose(method: Any = SHOOTING, **more: Any) -> Any:
    body = Body([Segment(D25, SOFT)])
    return problem([case("pose", body, method=method, **more)])


def test_a_case_with_nothing_free_is_the_packages_pose() -> None:
    pose = forward(D25, SOFT, [PRESSURE], loads=Loads(**LOADS), numerics=Numerics(intervals=320)).steps[0].pose
    assert pose is not None
    errors = []
    for intervals in (20, 40):
        found = solve(posed_pose(MultipleShooting(intervals)), {**LOADS, "pressure": PRESSURE}, engine="newton")
        errors.append(float(np.linalg.norm(found["tip_position"] - pose.tip_position)) / D25.length)
    assert errors[1] < 1e-8
    assert errors[1] < errors[0] / 8  # of order 4
    unloaded = solve(problem([case("arc", Body([Segment(D25, SOFT)]), method=None)]), {"pressure": PRESSURE})
    free = forward(D25, SOFT, [PRESSURE]).steps[0].pose
    assert free is not None
    np.testing.assert_allclose(unloaded["tip_position"], free.tip_position, atol=1e-9 * D25.length)


@pytest.mark.parametrize("closure", ["free", "compliant", "rigid"])
def test_two_cases_and_a_wall_are_a_blocked_force(closure: Any) -> None:
    body = Body([Segment(D25, SOFT)])
    free = case("free", body, method=None)
    lengths = {"contact.free_lengths": free.outputs["chamber_lengths"]}
    blocked = case("blocked", body, wall=closure, given=lengths, method=MultipleShooting(40))
    P = [0.8 * BAR, 0.0, 0.0]
    wall = {
        "contact.wall_point": (0.0, 0.0, 0.0),
        "contact.wall_normal": (1.0, 0.0, 0.0),
        "contact.pressed": [1.0, 1.0, 0.0, 0.0, 0.0, 0.0],
    }
    step = blocked_force(D25, SOFT, [P]).steps[0] if closure == "compliant" else None
    found = solve(problem([free, blocked]), {"pressure": P, **wall}, engine="newton")
    assert found.status is Status.SOLVED
    if step is not None:
        assert step.contact is not None
        assert found["blocked_tip_forces"][0] == pytest.approx(step.contact.force, rel=1e-6)
    assert abs(found["blocked_tip_position"][0]) < 1e-10


@pytest.mark.parametrize(("whole", "half"), [(MultipleShooting(32), SHOOTING), (Collocation(8), Collocation(4))])
def test_two_segments_of_one_section_are_one_of_twice_the_length(whole: Any, half: Any) -> None:
    shorter = robot("D25L60", length=30 * MILLIMETRE)
    one = solve(posed_pose(whole), {**LOADS, "pressure": PRESSURE})
    chain = problem([case("pose", Body([Segment(shorter, SOFT), Segment(shorter, SOFT)]), method=half)])
    for engine in ("newton", "ipopt"):
        two = solve(chain, {**LOADS, "pressure": np.tile(PRESSURE, 2)}, engine=engine)  # type: ignore[arg-type]
        assert two.status is Status.SOLVED
        for name in ("tip_position", "bending_angle", "backbone_length", "tip_rotation"):
            np.testing.assert_allclose(two[name], one[name], atol=1e-9 * D25.length, err_msg=name)
        np.testing.assert_allclose(
            two["chamber_lengths"].reshape(2, -1).sum(axis=0), one["chamber_lengths"], atol=1e-12
        )
        np.testing.assert_allclose(two["stretch"], np.repeat(one["stretch"], 2), rtol=1e-12)
    # the junction's state is the middle of the one
    middle = one.states("pose")[:12, one.states("pose").shape[1] // 2]
    scale = np.repeat([D25.length / shorter.length, 1.0], [3, 9])
    np.testing.assert_allclose(two.states("pose", 1)[:12, -1], middle * scale, atol=1e-9)
    np.testing.assert_allclose(two["segment.1.tip_position"], middle[:3] * D25.length, atol=1e-10)


def test_an_unloaded_chain_is_arcs_one_behind_the_other() -> None:
    """Two silicones, a robot thinner than the other, each bent by its own sets."""
    thin, other = robot("D20L60"), material("Ecoflex 00-30")
    chain = problem([case("pose", Body([Segment(D25, SOFT), Segment(thin, other)]), method=MultipleShooting(40))])
    P = np.array([0.5, 0.0, 0.1, 0.0, 0.3, 0.0]) * BAR
    found = solve(chain, {"pressure": P}, engine="newton")
    first, second = (forward(r, m, [p]).steps[0].pose for r, m, p in ((D25, SOFT, P[:3]), (thin, other, P[3:])))
    assert first is not None
    assert second is not None
    np.testing.assert_allclose(found["segment.1.tip_position"], first.tip_position, atol=1e-7)
    expected = first.tip_position + first.tip_rotation @ second.tip_position
    np.testing.assert_allclose(found["tip_position"], expected, atol=1e-7)
    np.testing.assert_allclose(found["tip_rotation"], first.tip_rotation @ second.tip_rotation, atol=1e-6)
    np.testing.assert_allclose(found["stretch"], [first.stretch, second.stretch], rtol=1e-12)


def test_the_base_of_a_loaded_chain_carries_what_loads_it() -> None:
    """Force and moment about the base, in newtons, of a body of two unlike segments."""
    thin = robot("D20L60")
    chain = problem([case("pose", Body([Segment(D25, SOFT), Segment(thin, SOFT)]), method=MultipleShooting(24))])
    F, M = np.array([0.02, -0.03, 0.01]), np.array([1e-3, 2e-4, -5e-4])
    values = {"tip_force": F, "tip_moment": M, "pressure": np.array([0.2, 0, 0, 0, 0.3, 0]) * BAR}
    found = solve(chain, values, engine="newton")
    base = found.states("pose", 1)[:, 0]
    L_0, F_0 = D25.length, chain.cases[0].equations[0]
    unit = float(chain.compiled.si_scales(found.solution.x, found.solution.p)[0])  # of the first balance: EI / L_0^2
    assert F_0.unit == "N"
    np.testing.assert_allclose(base[12:15] * unit, F, atol=1e-10)
    np.testing.assert_allclose(base[15:18] * unit * L_0, M + np.cross(found["tip_position"], F), atol=1e-9)


def test_a_factor_on_the_pressure_is_freed_in_its_place() -> None:
    body = Body([Segment(D25, SOFT)])
    scale = quantity("scale", "1", 1.0, lower=0.0)
    P = body.quantities["pressure"]
    pose = case("pose", body, given={"pressure": scale.symbol * P.symbol}, method=SHOOTING)
    height = Constraint("height", pose.outputs["tip_position"][2] - 66 * MILLIMETRE, unit="m", scale=D25.length)
    posed = problem([pose], given=[scale, P], free=["scale"], constraints=[height])
    found = solve(posed, {"pressure": np.full(3, 0.4 * BAR)})
    assert found["tip_position"][2] == pytest.approx(66 * MILLIMETRE, abs=1e-9)
    straight = forward(D25, SOFT, [found["scale"] * np.full(3, 0.4 * BAR)]).steps[0].pose
    assert straight is not None
    assert straight.tip_position[2] == pytest.approx(66 * MILLIMETRE, abs=1e-8)


def test_residuals_are_a_least_squares_problem() -> None:
    """Two constants from three tips that the model itself gave, by both engines; a third free one cannot be told."""
    body = Body([Segment(D25, SOFT)])
    pressures = np.array([[0.3, 0, 0], [0.5, 0.2, 0], [0.8, 0, 0]]) * BAR
    cases = [case(f"row {k}", body, own=["pressure"], method=None) for k in range(3)]
    truth = {"material.C10": 0.9 * SOFT.constants["C10"], "material.C01": 1.1 * SOFT.constants["C01"]}
    rows = {f"row {k}.pressure": p for k, p in enumerate(pressures)}
    seen = solve(problem(cases), {**rows, **truth}, engine="newton")
    measured = [seen[f"row {k}_tip_position"] for k in range(3)]
    off = [(c.outputs["tip_position"] - m) / MILLIMETRE for c, m in zip(cases, measured, strict=True)]
    posed = problem(cases, free=list(truth), residuals=off)
    for engine in ("newton", "ipopt"):
        found = solve(posed, rows, engine=engine)  # type: ignore[arg-type]
        assert found.status is Status.SOLVED
        for name, value in truth.items():
            assert found[name][0] == pytest.approx(value, rel=1e-5)


def test_multipliers_tell_what_a_bound_costs() -> None:
    """The objective's derivative by the bound, which is the multiplier over the scale, by differences."""
    body = Body([Segment(D25, SOFT)])
    pose = case("pose", body, method=MultipleShooting(6))
    least = quantity("least", "rad", 60 * DEGREE)
    rule = Constraint("angle", pose.outputs["bending_angle"] - least.symbol, 0.0, np.inf, unit="rad", scale=0.5)
    cost = ca.sumsqr(body.quantities["pressure"].symbol / BAR)
    posed = problem([pose], given=[least], free=["pressure"], constraints=[rule], objective=cost)
    costs, found = [], None
    for angle in (59.9 * DEGREE, 60.1 * DEGREE, 60 * DEGREE):
        found = solve(posed, {"least": angle}, found or {"pressure": [0.8 * BAR, 0.05 * BAR, 0.0]})
        assert found.status is Status.SOLVED
        costs.append(float(np.sum(found["pressure"] ** 2)) / BAR**2)
    slope = (costs[1] - costs[0]) / (0.2 * DEGREE)
    assert -found.multipliers["angle"][0] / 0.5 == pytest.approx(slope, rel=1e-4)
    # and the program is solved elsewhere, with the functions as they are
    x, p, b = found.solution.x, found.solution.p, posed.bounds
    functions = posed.functions
    nlp = {key: posed.nlp[key] for key in "xpfg"}
    quiet = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-10}}
    there = ca.nlpsol("there", "ipopt", nlp, quiet)(
        x0=x, p=p, lbx=b.lower_x, ubx=b.upper_x, lbg=b.lower_g, ubg=b.upper_g
    )
    np.testing.assert_allclose(np.asarray(there["x"]).ravel(), x, atol=1e-6)
    assert float(functions["f"](x, p)) == pytest.approx(costs[2])
    moved = np.zeros(x.size)
    moved[0] = 1e-6
    slopes = (functions["g"](x + moved, p) - functions["g"](x - moved, p)) / 2e-6
    np.testing.assert_allclose(np.asarray(functions["jacobian"](x, p))[:, 0], np.asarray(slopes).ravel(), atol=1e-6)


def test_slopes_of_the_reduced_problem_are_its_differences() -> None:
    answer = examples()["stiff_enough"](SHOOTING, "newton")
    posed = answer.problem
    reduced = Reduced(posed.compiled, held_states(posed.compiled, linear_solver))
    x, p = answer.solution.x, answer.solution.p
    theta = x[:3] + np.array([0.0, 0.1, 0.05])  # away from its bounds
    here = reduced.at(theta, p, x)
    assert here is not None
    for k in range(3):
        ahead, behind = (reduced.at(theta + s * np.eye(3)[k], p, here.x) for s in (1e-5, -1e-5))
        assert ahead is not None
        assert behind is not None
        assert here.f_slope[k] == pytest.approx((ahead.f - behind.f) / 2e-5, rel=1e-6, abs=1e-8)
        np.testing.assert_allclose(here.c_slope[:, k], (ahead.c - behind.c) / 2e-5, rtol=1e-5, atol=1e-7)


def test_a_path_is_followed_to_the_end_or_says_where_it_ends() -> None:
    posed = posed_pose()
    first = solve(posed, {"pressure": [0.6 * BAR, 0, 0]}, engine="newton")
    path = follow(posed, first, {"tip_force": (0.05, 0.02, -0.05)}, steps=3)
    assert [a.status for a in path] == [Status.SOLVED] * 4
    direct = solve(posed, {"pressure": [0.6 * BAR, 0, 0], "tip_force": (0.05, 0.02, -0.05)}, engine="newton")
    np.testing.assert_allclose(path[-1]["tip_position"], direct["tip_position"], atol=1e-10)
    np.testing.assert_allclose(path[1]["tip_force"], np.array([0.05, 0.02, -0.05]) / 3)
    weak = Material("weak", formula_law("weak", "a * (stretch - 1) * exp(-4 * (stretch - 1))", ["a"]), {"a": 0.05})
    posed = problem([case("pose", Body([Segment(D25, weak)]), method=SHOOTING)])
    first = solve(posed, {"pressure": [0.1 * BAR, 0, 0]}, engine="newton")
    lost = follow(posed, first, {"pressure": [2 * BAR, 0, 0]})
    assert lost[-1].status is Status.FOLD
    assert lost[-1].outputs == {}
    assert "% of the way" in lost[-1].message


def test_what_has_no_solution_has_no_outputs() -> None:
    body = Body([Segment(D25, SOFT)])
    pose = case("pose", body, method=SHOOTING)
    far = Constraint("far", pose.outputs["tip_position"][0] - 1.0, unit="m", scale=D25.length)
    idle = Constraint("idle", body.quantities["pressure"].symbol[1:], unit="Pa", scale=BAR)
    found = solve(problem([pose], free=["pressure"], constraints=[far, idle]))
    assert found.status is Status.DIVERGED
    assert found.outputs == {}
    assert "no solution was found" in found.message
    with pytest.raises(KeyError, match="no quantity or output is named 'tip_positon'"):
        found["tip_positon"]


# A robot that meets every rule and loses GJ from 0.667 bar on.
TWISTER = Robot(
    name="twister",
    outer_diameter=22.52 * MILLIMETRE,
    lumen_diameter=9.61 * MILLIMETRE,
    chamber_circle_diameter=16.06 * MILLIMETRE,
    chamber_diameter=4.85 * MILLIMETRE,
    chamber_wall=0.64 * MILLIMETRE,
    length=60 * MILLIMETRE,
    chamber_sets=4,
    chambers_per_set=2,
    chamber_angle=45 * DEGREE,
)


@pytest.mark.parametrize("engine", ["auto", "newton", "ipopt"])
def test_no_engine_solves_past_a_stiffness_that_lost_its_sign(engine: Any) -> None:
    """As `forward` says it, whether the pressure is given or found, in a chain and in one case of two."""
    high = [0.86 * BAR] * 4
    said = forward(TWISTER, SOFT, [high]).steps[0]
    body = Body([Segment(TWISTER, SOFT)])
    pose = case("pose", body, method=SHOOTING)
    found = solve(problem([pose]), {"pressure": high}, engine=engine)
    assert (found.status, found.message) == (said.status, said.message)
    assert found.status is Status.UNSTABLE_MATERIAL
    assert found.outputs == {}
    P = body.quantities["pressure"].symbol
    long = Constraint("long", pose.outputs["backbone_length"], 1.99 * TWISTER.length, np.inf, unit="m", scale=0.06)
    posed = problem([pose], free=["pressure"], constraints=[long], objective=ca.sumsqr(P / BAR))
    found = solve(posed, start={"pressure": [0.5 * BAR] * 4}, engine=engine)
    assert (found.status, found.outputs) == (Status.UNSTABLE_MATERIAL, {})
    if engine == "newton":
        chain = problem([case("pose", Body([Segment(D25, SOFT), Segment(TWISTER, SOFT)]), method=SHOOTING)])
        found = solve(chain, {"pressure": [0.0] * 3 + high}, engine=engine)
        assert (found.status, found.message) == (said.status, f"segment 2: {said.message}")
        two = problem([pose, case("other", Body([Segment(TWISTER, SOFT)], name="other"), method=SHOOTING)])
        found = solve(two, {"other.pressure": high}, engine=engine)
        assert (found.status, found.message) == (said.status, f"other: {said.message}")


def test_a_path_ends_where_a_stiffness_loses_its_sign() -> None:
    posed = problem([case("pose", Body([Segment(TWISTER, SOFT)]), method=SHOOTING)])
    first = solve(posed, {"pressure": [0.3 * BAR] * 4}, engine="newton")
    path = follow(posed, first, {"pressure": [1.0 * BAR] * 4}, steps=7)
    assert [a.status for a in path[:-1]] == [Status.SOLVED] * 4  # to 0.6 bar
    assert (len(path), path[-1].status) == (5, Status.UNSTABLE_MATERIAL)


def test_a_grid_that_does_not_show_the_rod_is_no_solution() -> None:
    """Ten intervals put the tip of a curl of 15 turns at 45 m."""
    found = solve(posed_pose(MultipleShooting(10)), {"pressure": [20 * BAR, 0, 0]}, engine="newton")
    assert (found.status, found.outputs) == (Status.INACCURATE, {})
    assert "take more intervals" in found.message
    loaded = {**LOADS, "pressure": PRESSURE}
    coarse, fine = (solve(posed_pose(MultipleShooting(K)), loaded, engine="newton") for K in (10, 80))
    assert coarse.discretisation_error is not None
    error = float(np.linalg.norm(coarse["tip_position"] - fine["tip_position"])) / D25.length
    assert error / 3 < coarse.discretisation_error < 3 * error


def test_another_root_of_the_stretch_is_no_solution() -> None:
    """A law that weakens has two stretches at a pressure; only one is reached from zero pressure."""
    weak = Material("weak", formula_law("weak", "a * (stretch - 1) * exp(-(stretch - 1))", ["a"]), {"a": 0.05})
    body = Body([Segment(D25, weak)], coefficients=Coefficients(elongation=0.0))
    posed = problem([case("pose", body, method=None)])
    low = {"pressure": [0.1 * BAR] * 3}
    near = solve(posed, low, engine="newton")
    assert near.status is Status.SOLVED
    far = replace(near, solution=replace(near.solution, x=np.array([4.0])))
    other = solve(posed, low, far, engine="newton")
    assert other.solution.holds(1e-9)
    assert other.solution.x[0] > 2
    assert (other.status, other.outputs) == (Status.DIVERGED, {})
    assert "on the branch from zero pressure, where the stretch is 1.0" in other.message


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("pressure", [500 * BAR, 0, 0], "at most 100 bar, got 500 bar"),
        ("pressure", [-0.5 * BAR, 0, 0], "expected at least 0 and at most 100 bar, got -0.5 bar"),
        ("tip_force", [0, 0, -1e5], "at most 10000 N, got 100000 N"),
        ("tip_moment", [0, 2e3, 0], "at most 1e"),
        ("gravity", [0, 0, 1e4], "at most 1000"),
    ],
)
def test_what_acts_is_within_its_range(key: str, value: Any, said: str) -> None:
    posed = posed_pose()
    start = solve(posed, {"pressure": PRESSURE}, engine="newton")
    with pytest.raises(InputError, match=f"{key}: .*{said}"):
        solve(posed, {key: value})
    with pytest.raises(InputError, match=f"{key}: .*{said}"):
        follow(posed, start, {key: value})
    factor = quantity("factor", "1", 1.0)  # as an expression too
    given = {key: factor.symbol * ca.DM(np.asarray(value, float))}
    with pytest.raises(InputError, match=key):
        solve(problem([case("pose", Body([Segment(D25, SOFT)]), given=given, method=SHOOTING)], given=[factor]))


def test_a_pressure_that_is_found_is_within_its_range() -> None:
    """Freed, its expression may be what no regulator gives."""
    body = Body([Segment(D25, SOFT)])
    factor = quantity("factor", "1", 0.1)
    pose = case("pose", body, given={"pressure": ca.vertcat(factor.symbol * BAR, 0, 0)}, method=SHOOTING)
    aside = Constraint("aside", pose.outputs["tip_position"][0] - 5 * MILLIMETRE, unit="m", scale=0.06)
    found = solve(problem([pose], given=[factor], free=["factor"], constraints=[aside]), engine="newton")
    assert (found.status, found.outputs) == (Status.DIVERGED, {})
    assert "pressure: expected at least 0" in found.message


@pytest.mark.parametrize("value", [[np.nan, 0, 0], [np.inf, 0, 0], ["a", 0, 0], "x"])
def test_values_and_starts_are_finite_numbers(value: Any) -> None:
    body = Body([Segment(D25, SOFT)])
    pose = case("pose", body, method=SHOOTING)
    angle = Constraint("angle", pose.outputs["bending_angle"], 1, 2)
    posed = problem([pose], free=["pressure"], constraints=[angle], objective=ca.sumsqr(pose.outputs["tip_position"]))
    with pytest.raises(IllPosedError, match="'pressure' takes finite numbers"):
        solve(posed, start={"pressure": value})
    with pytest.raises(IllPosedError, match="'pressure' takes finite numbers"):
        solve(posed_pose(), {"pressure": value})


@pytest.mark.parametrize("scale", [1e7, 1e12, 1e300])
def test_a_scale_hides_no_violation(scale: float) -> None:
    """Over the scale an angle of 0 keeps a least angle of 60 degrees to any tolerance."""
    body = Body([Segment(D25, SOFT)])
    pose = case("pose", body, method=MultipleShooting(6))
    rule = Constraint("angle", pose.outputs["bending_angle"], 60 * DEGREE, np.inf, unit="rad", scale=scale)
    cost = ca.sumsqr(body.quantities["pressure"].symbol / BAR)
    found = solve(problem([pose], free=["pressure"], constraints=[rule], objective=cost))
    assert (found.status, found.outputs) == (Status.DIVERGED, {})
    assert "constraint 'angle' is off by" in found.message
    assert "scale" in found.message


def test_a_scale_that_is_only_large_is_taken() -> None:
    """Newton's method meets an equation to round-off, whatever it is divided by; one of slope 0 at its root too."""
    body = Body([Segment(D25, SOFT)])
    pose = case("pose", body, method=SHOOTING)
    idle = Constraint("idle", body.quantities["pressure"].symbol[1:], unit="Pa", scale=BAR)
    off = pose.outputs["bending_angle"] - 60 * DEGREE
    for scale, error in ((1e6, off), (1.0, off**2)):
        angle = Constraint("angle", error, unit="rad", scale=scale)
        posed = problem([pose], free=["pressure"], constraints=[angle, idle])
        found = solve(posed, start={"pressure": [0.9 * BAR, 0, 0]}, engine="newton", tolerance=1e-6)
        assert found.status is Status.SOLVED
        assert found["bending_angle"][0] == pytest.approx(60 * DEGREE, abs=1e-3)


P_BODY = Body([Segment(D25, SOFT)])
POSE = case("pose", P_BODY, method=MultipleShooting(3))
ANGLE = POSE.outputs["bending_angle"]


@pytest.mark.parametrize(
    ("constraint", "said"),
    [
        ((None, ANGLE, 1, 2), "expected a name for each constraint, got None"),
        (("", ANGLE, 1, 2), "expected a name for each constraint, got ''"),
        (("a", 0.5, 0, 1), "constraint 'a': expected an expression of CasADi's MX, got 0.5"),
        (("a", None, 0, 1), "got None"),
        (("a", ca.SX.sym("q"), 0, 1), "got one of SX"),
        (("a", ca.MX(0, 1), 0, 1), "at least one entry"),
        (("a", ca.MX.sym("q"), 0, 1), "constraint 'a': 'q' is no quantity of the cases"),
        (("a", ANGLE, "1", 2), "constraint 'a': expected bounds that are numbers, got '1'"),
        (("a", ANGLE, None, 2), "got None"),
        (("a", ANGLE, [[1], [1, 2]], 2), "expected bounds that are numbers"),
        (("a", ANGLE, np.inf, np.inf), "no number lies between its bounds"),
        (("a", ANGLE, -np.inf, -np.inf), "no number lies between its bounds"),
        (("a", ANGLE, 1, 2, "rad", "x"), "expected a scale above 0, got 'x'"),
        (("a", ANGLE, 1, 2, "rad", None), "expected a scale above 0, got None"),
        (("a", ANGLE, 1, 2, "rad", True), "expected a scale above 0, got True"),
        (("stretch balance", ANGLE, 1, 2), "two constraints or equations are named 'stretch balance'"),
        (("bounds", ANGLE, 1, 2), "named 'bounds'"),
        (("twice", ANGLE, 1, 2), "two constraints or equations are named 'twice'"),
    ],
)
def test_a_constraint_that_cannot_be_meant_is_refused(constraint: tuple[Any, ...], said: str) -> None:
    rules = [Constraint("twice", ANGLE, 0, 2), Constraint(*constraint)]
    with pytest.raises(IllPosedError, match=said):
        problem([POSE], free=["pressure"], constraints=rules, objective=ca.sumsqr(POSE.outputs["tip_position"]))


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"objective": ca.SX(1)}, "objective: expected an expression of CasADi's MX, got one of SX"),
        ({"objective": ca.MX.sym("q")}, "objective: 'q' is no quantity"),
        ({"objective": POSE.outputs["tip_position"]}, "objective: expected one number to minimise, got 3"),
        ({"residuals": [ANGLE, ca.MX.sym("q")]}, "residual: 'q' is no quantity"),
        ({"residuals": [0.5]}, "residual: expected an expression"),
    ],
)
def test_what_is_minimised_is_known(asked: dict[str, Any], said: str) -> None:
    with pytest.raises(IllPosedError, match=said):
        problem([POSE], free=["pressure"], **asked)
    foreign = case("pose", P_BODY, given={"pressure": 2 * ca.MX.sym("q", 3)}, method=MultipleShooting(3))
    with pytest.raises(IllPosedError, match="case 'pose': 'q' is no quantity"):
        problem([foreign])


def test_what_cannot_be_posed_is_refused_by_name() -> None:
    body = Body([Segment(D25, SOFT)])
    with pytest.raises(IllPosedError, match="'presure' is not a quantity of this case; did you mean 'pressure'"):
        case("pose", body, own=["presure"])
    with pytest.raises(IllPosedError, match="'pressure' takes 3 numbers, got 2"):
        case("pose", body, given={"pressure": ca.MX.zeros(2)})
    two = Body([Segment(D25, SOFT)] * 2)
    with pytest.raises(IllPosedError, match="take a body of one segment"):
        case("pose", two, wall="free")
    with pytest.raises(InputError, match="expected at least one segment"):
        Body([])
    with pytest.raises(IllPosedError, match="expected at least one case"):
        problem([])
    with pytest.raises(IllPosedError, match="two quantities are named 'pressure'"):
        problem([case("a", body), case("b", Body([Segment(D25, SOFT)]))])
    with pytest.raises(IllPosedError, match="too few equations"):
        problem([case("a", body)], free=["pressure"])
    posed = posed_pose()
    with pytest.raises(IllPosedError, match="of the same problem"):
        solve(posed, start=solve(posed_pose(), {"pressure": PRESSURE}, engine="newton"))
    with pytest.raises(IllPosedError, match="'tip_farce' is not a fixed quantity"):
        solve(posed, {"tip_farce": 1.0})
    with pytest.raises(InputError, match="engine: expected one of auto, ipopt, newton, got 'Newton'"):
        solve(posed, engine="Newton")  # type: ignore[arg-type]
    with pytest.raises(IllPosedError, match="two cases are named 'a'"):
        problem([case("a", body), case("a", body, own=["pressure"])])
    with pytest.raises(RobotError, match="chamber"):
        Body([Segment(replace(D25, chamber_diameter=9 * MILLIMETRE), SOFT)])
    start = solve(posed, {"pressure": PRESSURE}, engine="newton")
    with pytest.raises(IllPosedError, match="begins at a solution of this problem"):
        follow(posed_pose(), start, {"tip_force": (0.0, 0.0, 0.0)})
    with pytest.raises(InputError, match="steps: expected at least one step, got 0"):
        follow(posed, start, {}, steps=0)


def test_the_sparsity_is_drawn_with_its_names() -> None:
    posed = posed_pose(MultipleShooting(5))
    figure = sparsity_figure(posed)
    jacobian, hessian = figure.axes
    entries = posed.compiled.jacobian.sparsity_out(0).nnz()
    assert len(jacobian.lines[0].get_xdata()) == entries  # type: ignore[arg-type]
    assert "pose: states" in [label.get_text() for label in jacobian.get_xticklabels()]
    assert "base orientation" in " ".join(label.get_text() for label in jacobian.get_yticklabels())
    assert hessian.get_title(loc="left") == "Hessian of the Lagrangian"
