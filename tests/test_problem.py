"""Freeing and fixing quantities: answers recovered, ill-posed choices refused by name, several load cases in one."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from cases import Posed, equals, pose
from designs import silicone

from softnlp.base.errors import IllPosedError
from softnlp.base.quantity import quantity
from softnlp.model.conventions import Coefficients
from softnlp.model.quantities import Model, quantities
from softnlp.model.robot import ROBOTS
from softnlp.model.rod import Loads
from softnlp.nlp.constraint import Constraint
from softnlp.nlp.solver import certificate
from softnlp.nlp.transcription import Collocation
from softnlp.studies.forward import forward

ECOFLEX_50 = silicone("Ecoflex 00-50")
MODEL = Model(ROBOTS["D20L60"], ECOFLEX_50)
PRESSURE = np.array([9e4, 4e4, 1e4])
LOADS = {"tip_force": (0.02, -0.03, 0.01), "gravity": (0.0, 0.0, -9.80665)}
TIP = quantity("target", "m", np.zeros(3))


def forward_outputs(model: Model = MODEL, values: dict = {"pressure": PRESSURE, **LOADS}) -> dict[str, np.ndarray]:  # noqa: B006
    """Return the outputs on the same grid with everything fixed."""
    posed = pose(model)
    solution = posed.solve(values)
    assert solution.holds(1e-9)
    return posed.outputs(solution)


def tip_target(cases, given) -> list[Constraint]:
    L_0 = MODEL.robot.length
    return [equals("tip target", cases[0].outputs["tip_position"], given["target"].symbol, "m", L_0)]


# --- square problems -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", [None, Collocation(6)], ids=["shooting", "collocation"])
def test_three_free_pressures_recover_what_made_the_tip(method: Collocation | None) -> None:
    changes = {"method": method} if method else {}
    fixed = pose(MODEL, **changes)
    expected = fixed.outputs(fixed.solve({"pressure": PRESSURE, **LOADS}))
    posed = pose(MODEL, free=["pressure"], constraints=tip_target, extra=[TIP], **changes)
    assert posed.problem.is_square
    solution = posed.solve({"target": expected["tip_position"], **LOADS}, {"pressure": [6e4, 6e4, 3e4]})
    assert solution.holds(1e-9)
    np.testing.assert_allclose(posed.problem.free_values(solution.x)["pressure"], PRESSURE, rtol=1e-7)
    # what a finer grid leaves of it, is of the same equations; the target is met on any grid
    left = np.asarray(posed.problem.fine_residual(solution.x, solution.p)).ravel()
    assert left.size == len(solution.x)
    assert 0 < np.abs(left).max() < 1e-2
    np.testing.assert_allclose(left[-3:], 0.0, atol=1e-9)
    found = posed.outputs(solution)
    for name, value in expected.items():
        np.testing.assert_allclose(found[name], value, rtol=1e-7, atol=1e-9, err_msg=name)


def test_a_freed_constant_of_the_material_is_recovered_from_a_bending_angle() -> None:
    values = {"pressure": PRESSURE, **LOADS}
    angle = float(forward_outputs()["bending_angle"][0])

    def measured(cases, given) -> list[Constraint]:
        return [equals("bending angle", cases[0].outputs["bending_angle"], angle)]

    off = replace(ECOFLEX_50, constants={**ECOFLEX_50.constants, "C01": 0.8 * ECOFLEX_50.constants["C01"]})
    posed = pose(replace(MODEL, material=off), free=["material.C01"], constraints=measured)
    solution = posed.solve(values)
    assert solution.holds(1e-9)
    found = float(posed.problem.free_values(solution.x)["material.C01"][0])
    assert found == pytest.approx(ECOFLEX_50.constants["C01"], rel=1e-7)


@pytest.mark.parametrize(
    ("name", "wrong"),
    [("stiffening.bending", 1.0), ("robot.length", 55e-3), ("robot.chamber_diameter", 3.4e-3), ("material.C10", 3e3)],
)
def test_any_quantity_can_be_freed_by_name(name: str, wrong: float) -> None:
    tip_x = forward_outputs()["tip_position"][0]

    def measured(cases, given) -> list[Constraint]:
        return [equals("tip x", cases[0].outputs["tip_position"][0], tip_x, "m", MODEL.robot.length)]

    posed = pose(MODEL, free=[name], constraints=measured)
    solution = posed.solve({"pressure": PRESSURE, **LOADS}, {name: wrong})
    assert solution.holds(1e-9)
    right = float(quantities(MODEL)[name].nominal[0])
    assert float(posed.problem.free_values(solution.x)[name][0]) == pytest.approx(right, rel=1e-6)


def test_two_load_cases_share_their_pressure() -> None:
    # a free shape and a loaded one of the same robot; the force that gives a wanted deflection between them is unknown
    force = quantity("wall force", "N", np.zeros(3), scale=0.05)
    nothing = {name: quantity(f"no {name}", "", np.zeros(3)) for name in ("tip_force", "tip_moment", "gravity")}
    wanted = np.array([0.004, -0.002, 0.001])

    def deflected(cases, given) -> list[Constraint]:
        free_tip, tip = (case.outputs["tip_position"] for case in cases)
        return [equals("deflection", tip - free_tip, wanted, "m", MODEL.robot.length)]

    posed = pose(MODEL, free=["wall force"], constraints=deflected, own=[nothing, {"tip_force": force}])
    solution = posed.solve({"pressure": PRESSURE})
    assert solution.holds(1e-9)
    found = posed.outputs(solution)
    np.testing.assert_allclose(found["case1_tip_position"] - found["case0_tip_position"], wanted, atol=1e-11)
    assert found["case0_stretch"] == pytest.approx(found["case1_stretch"], rel=1e-12)
    # each case is the pose that it would be alone
    F = posed.problem.free_values(solution.x)["wall force"]
    alone = forward_outputs(values={"pressure": PRESSURE, "tip_force": F})
    np.testing.assert_allclose(alone["tip_position"], found["case1_tip_position"], atol=1e-11)
    free = forward_outputs(values={"pressure": PRESSURE})
    np.testing.assert_allclose(free["chamber_lengths"], found["case0_chamber_lengths"], atol=1e-11)
    names = [line.equation for line in certificate(posed.problem, solution)]
    assert names[0] == "case0: stretch balance"
    assert "case1: tip force" in names
    assert names[-1] == "deflection"
    # the rows of the second case follow those of the first, and those of the constraint both
    size, count = (len(found) for found in (residual_rows(posed, 0), posed.problem.cases[0].equations))
    assert residual_rows(posed, 0) == list(range(size))
    equations = posed.problem.equations
    for first, second in zip(equations[:count], equations[count:-1], strict=True):
        np.testing.assert_array_equal(second.rows, first.rows + size)
    assert equations[-1].rows.tolist() == [2 * size, 2 * size + 1, 2 * size + 2]


def residual_rows(posed: Posed, case: int) -> list[int]:
    """Return the rows of a case's equations, sorted, counted in the case."""
    return sorted(int(row) for e in posed.problem.cases[case].equations for row in e.rows)


def test_rows_of_several_constraints_follow_those_of_the_case() -> None:
    def three(cases, given) -> list[Constraint]:
        tip, stretch = cases[0].outputs["tip_position"], cases[0].outputs["stretch"]
        return [
            equals("across", tip[:2], 0.0, "m", 0.06),
            equals("stretch", stretch, 1.1),
            equals("height", tip[2], 0.06),
        ]

    problem = pose(MODEL, free=["pressure", "stiffening.bending"], constraints=three).problem
    assert problem.equations[0].name == "stretch balance"
    size = problem.cases[0].residuals.numel()
    assert [(e.name, e.rows.tolist()) for e in problem.equations[-3:]] == [
        ("across", [size, size + 1]),
        ("stretch", [size + 2]),
        ("height", [size + 3]),
    ]
    assert sorted(row for e in problem.equations for row in e.rows) == list(range(size + 4))


def test_a_compiled_problem_solves_for_many_values_and_robots() -> None:
    posed = pose(MODEL)
    other = replace(ROBOTS["D15L40"], name="other")
    dimensions = {
        f"robot.{name}": getattr(other, name)
        for name in ("outer_diameter", "lumen_diameter", "chamber_circle_diameter", "chamber_diameter", "chamber_wall",
                     "length", "chamber_angle")
    }  # fmt: skip
    values = {"pressure": PRESSURE, **LOADS, **dimensions}
    solution = posed.solve(values)
    assert solution.holds(1e-9)
    run = forward(other, ECOFLEX_50, PRESSURE, loads=Loads(**LOADS))
    assert run.steps[0].pose is not None
    tip = posed.outputs(solution)["tip_position"]
    assert np.linalg.norm(tip - run.steps[0].pose.tip_position) < 1e-5 * other.length


# --- objectives and bounds -------------------------------------------------------------------------------------------


def smallest_pressure(cases, given) -> ca.MX:
    return ca.sumsqr(given["pressure"].symbol / 1e5)


def tip_in_plane(cases, given) -> list[Constraint]:
    tip = cases[0].outputs["tip_position"]
    return [equals("tip target", tip[:2], given["target"].symbol[:2], "m", MODEL.robot.length)]


def redundant() -> Posed:
    """Return three free pressures, two coordinates of the tip as target, and the smallest sum of squares."""
    return pose(MODEL, free=["pressure"], constraints=tip_in_plane, objective=smallest_pressure, extra=[TIP])


def test_redundant_pressures_meet_the_target_with_the_smallest_sum_of_squares() -> None:
    tip = forward_outputs()["tip_position"]
    posed = redundant()
    assert not posed.problem.is_square
    solution = posed.solve({"target": tip, **LOADS}, {"pressure": [8e4, 5e4, 2e4]})
    assert solution.holds(1e-8)
    P = posed.problem.free_values(solution.x)["pressure"]
    assert np.all(P >= -1e-8 * 1e5)
    assert np.sum(P**2) < np.sum(PRESSURE**2)
    np.testing.assert_allclose(posed.outputs(solution)["tip_position"][:2], tip[:2], atol=1e-9)
    # no neighbour that meets the target is smaller: fix one pressure beside it and solve for the other two
    bound = int(np.argmin(P))
    assert P[bound] == pytest.approx(0.0, abs=1.0)  # the smallest pushes against its bound
    only = quantity("held", "Pa", 2e3)

    def held(cases, given) -> list[Constraint]:
        return [
            *tip_in_plane(cases, given),
            equals("held", given["pressure"].symbol[bound], given["held"].symbol, "Pa", 1e5),
        ]

    square = pose(MODEL, free=["pressure"], constraints=held, extra=[TIP, only])
    beside = square.solve({"target": tip, **LOADS}, {"pressure": P})
    assert beside.holds(1e-9)
    assert np.sum(square.problem.free_values(beside.x)["pressure"] ** 2) > np.sum(P**2)


def test_bounds_hold_and_what_they_forbid_is_not_called_a_solution() -> None:
    tip = forward_outputs()["tip_position"]
    low = quantity("pressure", "Pa", np.full(3, 2e4), scale=1e5, lower=0.0, upper=3e4)  # PRESSURE needs 9e4
    posed = pose(MODEL, free=["pressure"], constraints=tip_target, own=[{"pressure": low}], extra=[TIP])
    solution = posed.solve({"target": tip, **LOADS}, max_iterations=60)
    assert not solution.holds(1e-8)
    assert solution.residual > 1e-3


def test_bounds_are_those_of_the_quantity_in_its_scale() -> None:
    within = quantity("pressure", "Pa", np.full(3, 5e4), scale=2e5, lower=2e4, upper=9e4)
    problem = pose(MODEL, free=["pressure"], constraints=tip_target, own=[{"pressure": within}], extra=[TIP]).problem
    np.testing.assert_allclose(problem.lower_x[:3], 0.1)
    np.testing.assert_allclose(problem.upper_x[:3], 0.45)
    assert np.all(np.isinf(problem.lower_x[3:]))


def test_a_problem_with_an_inequality_is_not_square() -> None:
    def enough(cases, given) -> list[Constraint]:
        return [Constraint("bends enough", cases[0].outputs["bending_angle"], 0.1, np.inf, "rad")]

    assert pose(MODEL).problem.is_square
    assert not pose(MODEL, constraints=enough).problem.is_square


@pytest.mark.thorough
def test_an_inequality_is_held_and_certified() -> None:
    # the lowest pressure in set 1 that bends the robot to at least 60 degrees
    def enough(cases, given) -> list[Constraint]:
        others = given["pressure"].symbol[1:]
        return [
            Constraint("bends enough", cases[0].outputs["bending_angle"], float(np.radians(60)), np.inf, "rad"),
            equals("others off", others, 0.0, "Pa", 1e5),
        ]

    def cost(cases, given) -> ca.MX:
        return given["pressure"].symbol[0] / 1e5

    posed = pose(MODEL, free=["pressure"], constraints=enough, objective=cost)
    solution = posed.solve({}, {"pressure": [1.2e5, 0.0, 0.0]})
    assert solution.holds(1e-8)
    assert posed.outputs(solution)["bending_angle"][0] == pytest.approx(np.radians(60), abs=1e-7)
    P = posed.problem.free_values(solution.x)["pressure"]
    run = forward(MODEL.robot, ECOFLEX_50, np.maximum(P, 0))
    assert run.steps[0].pose is not None
    assert np.degrees(run.steps[0].pose.bending_angle) == pytest.approx(60, abs=1e-3)
    lines = {line.equation: line for line in certificate(posed.problem, solution)}
    assert lines["bends enough"].unit == "rad"
    assert lines["bends enough"].scaled <= 1e-8
    assert lines["others off"].value == pytest.approx(lines["others off"].scaled * 1e5)
    # the certificate of a point that breaks it says by how much
    broken = replace(solution, x=posed.start({"pressure": [5e4, 0, 0]}))
    angle = float(posed.problem.outputs(x=broken.x, p=broken.p)["bending_angle"])
    line = next(line for line in certificate(posed.problem, broken) if line.equation == "bends enough")
    assert line.value == pytest.approx(np.radians(60) - angle, rel=1e-9)


# --- refused by name -------------------------------------------------------------------------------------------------


def refusal(**changes) -> str:
    with pytest.raises(IllPosedError) as caught:
        pose(MODEL, **changes)
    text = str(caught.value)
    assert "\n" not in text
    return text


def two_targets(cases, given) -> list[Constraint]:
    return [*tip_in_plane(cases, given), equals("angle", cases[0].outputs["bending_angle"], 1.0)]


def test_too_few_equations_are_refused() -> None:
    assert refusal(free=["pressure", "material.C01"], constraints=two_targets, extra=[TIP]) == (
        "too few equations: free are pressure (3), material.C01 (1), and the constraints add 3 equations: "
        "tip target (2), angle (1); fix a quantity, add a constraint or give an objective"
    )
    assert refusal(free=["stiffening.bending"]) == (
        "too few equations: free are stiffening.bending (1), and the constraints add 0 equations: none; "
        "fix a quantity, add a constraint or give an objective"
    )


def test_too_many_equations_are_refused() -> None:
    advice = "free more quantities, or make a constraint an objective"
    assert refusal(free=["stiffening.bending"], constraints=tip_target, extra=[TIP]) == (
        "too many equations: free are stiffening.bending (1), and the constraints add 3 equations: tip target (3); "
        + advice
    )
    assert refusal(constraints=tip_target, extra=[TIP]) == (
        "too many equations: free are nothing, and the constraints add 3 equations: tip target (3); " + advice
    )


def test_an_unknown_name_is_refused_with_the_nearest_one() -> None:
    text = refusal(free=["presure"])
    assert "'presure'" in text
    assert "'pressure'" in text
    text = refusal(free=["robot.lenght"])
    assert "'robot.length'" in text


def test_a_free_quantity_that_enters_nothing_is_refused() -> None:
    idle = quantity("friction", "1", 0.3)

    def two(cases, given) -> list[Constraint]:
        return tip_target(cases, given)[:1]

    text = refusal(free=["pressure", "friction"], constraints=two, objective=smallest_pressure, extra=[TIP, idle])
    assert text == "'friction' is free but enters no equation and no objective, so nothing determines it; fix it"
    price = quantity("price", "1", 0.3)

    def cost(cases, given) -> ca.MX:
        return smallest_pressure(cases, given) + given["price"].symbol ** 2

    among = {"constraints": two, "objective": cost, "extra": [TIP, idle, price]}
    assert refusal(free=["pressure", "price", "friction"], **among) == text
    # where it makes up the count, what it does not determine is named
    text = refusal(free=["friction"], constraints=lambda cases, given: [
        equals("bending angle", cases[0].outputs["bending_angle"], 1.0)], extra=[idle])  # fmt: skip
    assert "friction" in text
    assert "bending angle" in text


def test_a_free_quantity_may_enter_the_objective_alone() -> None:
    weight = quantity("price", "1", 0.3)

    def cost(cases, given) -> ca.MX:
        return smallest_pressure(cases, given) + (given["price"].symbol - 2) ** 2

    posed = pose(MODEL, free=["pressure", "price"], constraints=tip_in_plane, objective=cost, extra=[TIP, weight])
    tip = forward_outputs()["tip_position"]
    solution = posed.solve({"target": tip, **LOADS}, {"pressure": [8e4, 5e4, 2e4]})
    assert solution.holds(1e-8)
    assert posed.problem.free_values(solution.x)["price"][0] == pytest.approx(2.0, abs=1e-6)


def test_a_target_may_be_missed_by_a_slack_that_costs() -> None:
    # each slack enters one equation and the objective, and there it stays at zero
    slack = quantity("slack", "m", np.full(3, 1e-3), scale=MODEL.robot.length)

    def missed(cases, given) -> list[Constraint]:
        tip = cases[0].outputs["tip_position"] + given["slack"].symbol
        return [equals("tip target", tip, given["target"].symbol, "m", MODEL.robot.length)]

    def cost(cases, given) -> ca.MX:
        return ca.sumsqr(given["slack"].symbol / MODEL.robot.length)

    posed = pose(MODEL, free=["pressure", "slack"], constraints=missed, objective=cost, extra=[TIP, slack])
    solution = posed.solve({"target": forward_outputs()["tip_position"], **LOADS}, {"pressure": [8e4, 5e4, 2e4]})
    assert solution.holds(1e-8)
    found = posed.problem.free_values(solution.x)
    np.testing.assert_allclose(found["slack"], 0.0, atol=1e-8 * MODEL.robot.length)
    np.testing.assert_allclose(found["pressure"], PRESSURE, rtol=1e-5)


def test_an_objective_with_nothing_to_choose_is_refused() -> None:
    text = refusal(free=["pressure"], constraints=tip_target, objective=smallest_pressure, extra=[TIP])
    assert "nothing to choose" in text
    assert "pressure (3)" in text


def test_two_quantities_of_one_name_are_refused() -> None:
    text = refusal(extra=[quantity("price", "1", 0.3), quantity("pressure", "Pa", np.zeros(3))])
    assert "two quantities are named 'pressure'" in text


def test_a_constraint_on_nothing_unknown_is_refused() -> None:
    text = refusal(
        free=["stiffening.bending"],
        constraints=lambda cases, given: [
            equals("sum of pressures", ca.sum1(given["pressure"].symbol), 1e5, "Pa", 1e5)
        ],
    )
    assert "'sum of pressures'" in text
    assert "does not depend on anything unknown" in text


def test_a_structurally_singular_choice_is_refused_where_counting_is_content() -> None:
    # three pressures, three equations, but two of them are about the stretch alone
    def twice(cases, given) -> list[Constraint]:
        stretch, angle = cases[0].outputs["stretch"], cases[0].outputs["bending_angle"]
        return [equals("stretch", stretch, 1.2), equals("square", stretch**2, 1.44), equals("angle", angle, 0.5)]

    assert refusal(free=["pressure"], constraints=twice) == (
        "the constraints stretch (1), square (1), angle (1) cannot all be met by freeing pressure (3): they move 1 "
        "combination(s) of unknowns too few; free a quantity that enters them"
    )


def test_free_values_are_packed_and_found_again() -> None:
    names = ["stiffening.bending", "pressure", "robot.length", "material.C10"]

    def measured(cases, given) -> list[Constraint]:
        tip, lengths = cases[0].outputs["tip_position"], cases[0].outputs["chamber_lengths"]
        return [equals("tip", tip, 0.0), equals("lengths", lengths[:3], 0.0)]

    problem = pose(MODEL, free=names, constraints=measured).problem
    given = {"stiffening.bending": [1.5], "pressure": [1e4, 2e4, 3e4], "robot.length": [0.05], "material.C10": [4e3]}
    x = problem.pack_free(given)
    assert problem.free_size == x.size == 6
    assert np.abs(x).max() < 3  # scaled
    found = problem.free_values(np.concatenate([x, np.full(4, 99.0)]))
    assert list(found) == names
    for name, value in given.items():
        np.testing.assert_allclose(found[name], value, rtol=1e-14)


def test_a_value_for_what_is_not_fixed_is_refused() -> None:
    posed = pose(MODEL)
    with pytest.raises(IllPosedError, match=r"'presure'.*'pressure'"):
        posed.problem.pack({"presure": PRESSURE})
    with pytest.raises(IllPosedError, match=r"'pressure' takes 3 numbers, got 2"):
        posed.problem.pack({"pressure": PRESSURE[:2]})
    with pytest.raises(IllPosedError, match=r"'gravity' takes 3 numbers, got 2"):
        posed.problem.pack({"gravity": [0.0, 1.0]})
    with pytest.raises(IllPosedError, match="not a free quantity"):
        posed.problem.pack_free({"pressure": PRESSURE})
    np.testing.assert_array_equal(posed.problem.pack({"pressure": 2.0})[:3], 2.0)


# --- quantities ------------------------------------------------------------------------------------------------------


def test_every_number_of_the_model_is_a_quantity_with_unit_scale_and_bounds() -> None:
    model = Model(ROBOTS["D25L40"], ECOFLEX_50, Coefficients(elongation=0.3, bore_fraction=0.2))
    declared = quantities(model)
    assert set(declared) >= {"pressure", "tip_force", "tip_moment", "gravity", "robot.length", "robot.chamber_angle"}
    assert set(declared) >= {"material.C10", "material.density", "stiffening.elongation", "corrections.bore_fraction"}
    assert float(declared["robot.outer_diameter"].nominal[0]) == 25e-3
    assert float(declared["material.C01"].nominal[0]) == pytest.approx(0.01558e6)
    assert float(declared["stiffening.elongation"].nominal[0]) == 0.3
    assert (declared["pressure"].size, declared["pressure"].unit, declared["pressure"].lower) == (3, "Pa", 0.0)
    for q in declared.values():
        assert q.unit
        assert q.scale > 0
        assert q.symbol.numel() == q.size
        assert np.all(np.abs(q.nominal) / q.scale < 1e3)


def test_the_unknowns_are_of_order_one() -> None:
    for robot in ("D25L60", "laparoscope-3"):
        posed = pose(
            Model(ROBOTS[robot], silicone("Dragon Skin 10")), free=["pressure"], constraints=tip_target, extra=[TIP]
        )
        x = posed.start({"pressure": [2e5, 1e5, 0.0]})
        assert np.abs(x).max() < 300
        assert np.median(np.abs(x[x != 0])) > 1e-2
