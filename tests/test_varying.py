"""Sections that vary along s: closed forms, the order in s, joints, and a staircase of uniform segments."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from softnlp import (
    BAR,
    MILLIMETRE,
    Body,
    Collocation,
    Constraint,
    InputError,
    MultipleShooting,
    RobotError,
    Segment,
    Status,
    case,
    material,
    problem,
    robot,
    solve,
)
from softnlp.model.quantities import Model, quantities
from softnlp.statics.branch import branch_function, stretch_on_branch

D25, SOFT = robot("D25L60"), material("Ecoflex 00-50")
PRESSURE = np.array([0.5, 0.1, 0.0]) * BAR
LOADED = {"pressure": PRESSURE, "tip_force": (0.03, 0.02, -0.01), "gravity": (0.0, 0.0, 9.80665)}
WIDTHS = ("outer_diameter", "lumen_diameter", "chamber_circle_diameter", "chamber_diameter", "chamber_wall")
CONE = {
    "robot.outer_diameter": (25e-3, 21e-3),
    "robot.lumen_diameter": (9e-3, 7e-3),
    "robot.chamber_circle_diameter": (17e-3, 14.5e-3),
    "robot.chamber_diameter": (4.5e-3, 4e-3),
}


def at(s: float, cone: dict[str, Any] = CONE) -> Any:
    """Return the robot of the section at s."""
    there = {key.removeprefix("robot."): a + s * (b - a) for key, (a, b) in cone.items()}
    return replace(D25, **there)


def solved(segments: list[Segment], method: Any, values: dict[str, Any], engine: Any = "newton") -> Any:
    P = np.tile(values["pressure"], len(segments))
    found = solve(problem([case("pose", Body(segments), method=method)]), {**values, "pressure": P}, engine=engine)
    assert found.status is Status.SOLVED, found.message
    return found


@cache
def tapered(method: Any) -> Any:
    return solved([Segment(D25, SOFT, along=CONE)], method, LOADED)


@pytest.mark.parametrize("engine", ["newton", "ipopt"])
@pytest.mark.parametrize("method", [MultipleShooting(8), Collocation(2)], ids=["shooting", "collocation"])
def test_what_varies_by_nothing_is_uniform(method: Any, engine: Any) -> None:
    same = {"robot.outer_diameter": (25e-3, 25e-3), "material.C10": (SOFT.constants["C10"],) * 2}
    varying = solved([Segment(D25, SOFT, along=same)], method, LOADED, engine)
    uniform = solved([Segment(D25, SOFT)], method, LOADED, engine)
    for name in ("tip_position", "tip_rotation", "chamber_lengths", "bending_angle", "backbone_length", "stretch"):
        np.testing.assert_allclose(varying[name], uniform[name], rtol=1e-10, atol=1e-12, err_msg=name)
    np.testing.assert_allclose(varying["segment.1.tip_stretch"], varying["stretch"], rtol=1e-12)


def test_a_tapered_section_converges_at_the_order_of_the_method() -> None:
    best = tapered(Collocation(4))
    for name in ("tip_position", "tip_rotation", "chamber_lengths", "segment.1.tip_stretch"):
        errors = [np.abs(tapered(MultipleShooting(K))[name] - best[name]).max() for K in (4, 8)]
        assert np.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.3), name
    table = {"robot.outer_diameter": {"s": [0, 0.25, 1], "value": [25e-3, 23e-3, 25e-3]}}
    methods = (MultipleShooting(4), MultipleShooting(8), Collocation(4))
    tips = [solved([Segment(D25, SOFT, along=table)], method, LOADED)["tip_position"] for method in methods]
    errors = [float(np.linalg.norm(tip - tips[-1])) for tip in tips[:2]]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4, abs=0.3)  # knots are ends of intervals


@pytest.mark.parametrize("shrink", [0.8, 0.5])
def test_a_cone_under_an_axial_load_is_its_closed_form(shrink: float) -> None:
    """Every width shrinks alike, so the area does by its square: the elongation is F L / (E sqrt(A_base A_tip))."""
    rubber = material("Ecoflex 00-50", "linear")
    start = replace(D25, **{name: 2 * getattr(D25, name) for name in WIDTHS})
    along = {f"robot.{name}": (getattr(start, name), shrink * getattr(start, name)) for name in WIDTHS}
    F = 0.3
    values = {"pressure": np.zeros(3), "tip_force": (0.0, 0.0, F)}
    found = solved([Segment(start, rubber, along=along)], MultipleShooting(20), values)
    A = float(np.ravel(Model(start, rubber).section.at(Model(start, rubber).numbers, np.zeros(3), 1.0).area)[0])
    E = float(rubber.tangent_modulus(1.0))
    expected = F * start.length / (E * A * shrink)
    assert found["tip_position"][2] - start.length == pytest.approx(expected, rel=1e-6)
    assert found["backbone_length"][0] == pytest.approx(found["tip_position"][2], rel=1e-12)


def test_the_chambers_of_a_cone_are_longer_than_its_axis() -> None:
    """Straight lines to a circle that is narrower at the tip."""
    found = solved([Segment(D25, SOFT, along=CONE)], MultipleShooting(4), {"pressure": np.zeros(3)})
    np.testing.assert_allclose(found["chamber_lengths"], np.hypot(D25.length, 1.25e-3), rtol=1e-12)
    assert found["backbone_length"][0] == pytest.approx(D25.length, rel=1e-12)


def test_the_stretch_is_at_each_point_that_of_the_section_there() -> None:
    found = tapered(MultipleShooting(16))
    states = found.states("pose")
    for column in (0, 5, 16):
        model = Model(at(states[19, column]), SOFT)
        numbers = [PRESSURE if key == "pressure" else q.nominal for key, q in quantities(model).items()]
        point = stretch_on_branch(branch_function(model), np.concatenate(numbers), PRESSURE)
        assert states[18, column] == pytest.approx(point.stretch, abs=1e-9)
    assert states[19, -1] == pytest.approx(1.0, abs=1e-12)
    assert found["segment.1.tip_stretch"][0] > found["stretch"][0] + 5e-3  # wider chambers in proportion


def test_a_staircase_of_uniform_segments_tends_to_the_taper() -> None:
    """An independent way to the same shape, through equations of uniform rods alone; of second order in the steps."""
    errors = []
    for steps in (2, 4):
        segments = [Segment(replace(at((k + 0.5) / steps), length=D25.length / steps), SOFT) for k in range(steps)]
        found = solved(segments, MultipleShooting(4), LOADED)
        errors.append(float(np.linalg.norm(found["tip_position"] - tapered(MultipleShooting(16))["tip_position"])))
    assert errors[1] < 4e-3 * D25.length
    assert errors[0] / errors[1] == pytest.approx(4, rel=0.15)


def test_two_tapered_segments_are_one() -> None:
    half = {key: (a, (a + b) / 2) for key, (a, b) in CONE.items()}
    other = {key: ((a + b) / 2, b) for key, (a, b) in CONE.items()}
    short = replace(D25, length=30 * MILLIMETRE)
    two = solved([Segment(short, SOFT, along=half), Segment(short, SOFT, along=other)], MultipleShooting(8), LOADED)
    one = tapered(MultipleShooting(16))
    for name in ("tip_position", "tip_rotation", "bending_angle", "backbone_length"):
        np.testing.assert_allclose(two[name], one[name], atol=1e-9 * D25.length, err_msg=name)
    assert two["stretch"][1] == pytest.approx(two["segment.1.tip_stretch"][0], abs=1e-9)
    knot = {key: {"s": [0, 0.5, 1], "value": [a, (a + b) / 2, b]} for key, (a, b) in CONE.items()}
    parts = solved([Segment(D25, SOFT, along=knot)], MultipleShooting(16), LOADED)
    np.testing.assert_allclose(parts["tip_position"], one["tip_position"], atol=1e-9 * D25.length)
    assert "pose: segment 1 part 2 states" in parts.problem.variables
    assert parts.states("pose").shape == (20, 18)


def test_what_varies_is_a_quantity_with_one_entry_a_knot() -> None:
    body = Body([Segment(D25, SOFT, along=CONE)])
    q = body.quantities["robot.outer_diameter"]
    np.testing.assert_array_equal(q.nominal, [25e-3, 21e-3])
    pose = case("pose", body, method=MultipleShooting(8))
    height = Constraint("height", pose.outputs["tip_position"][2] - 66 * MILLIMETRE, unit="m", scale=D25.length)
    base = Constraint("base", q.symbol[0] - 25e-3, unit="m", scale=D25.length)
    posed = problem([pose], free=["robot.outer_diameter"], constraints=[height, base])
    found = solve(posed, {"pressure": np.full(3, 0.4 * BAR)})
    assert found.status is Status.SOLVED, found.message
    assert found["tip_position"][2] == pytest.approx(66 * MILLIMETRE, abs=1e-9)
    again = {**CONE, "robot.outer_diameter": found["robot.outer_diameter"]}
    same = solved([Segment(D25, SOFT, along=again)], MultipleShooting(8), {"pressure": np.full(3, 0.4 * BAR)})
    assert same["tip_position"][2] == pytest.approx(66 * MILLIMETRE, abs=1e-9)


@pytest.mark.parametrize(
    ("along", "text"),
    [
        ({"robot.length": (1e-2, 2e-2)}, "'robot.length' cannot vary along a segment"),
        ({"robot.outer_diametre": (1e-2, 2e-2)}, "did you mean 'robot.outer_diameter'"),
        ({"pressure": (0.0, 1.0)}, "'pressure' cannot vary"),
        ({"robot.outer_diameter": (1e-2,)}, "expected 2 numbers"),
        ({"robot.outer_diameter": {"s": [0, 0.5], "value": [1e-2, 1e-2]}}, "expected s from 0 to 1, rising"),
        ({"robot.outer_diameter": {"s": [0, 0.5, 0.5, 1], "value": [1e-2] * 4}}, "expected s from 0 to 1, rising"),
    ],
)
def test_what_cannot_vary_is_refused_by_name(along: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=text):
        Body([Segment(D25, SOFT, along=along)])


def test_every_knot_has_to_be_a_robot_that_can_be_made() -> None:
    with pytest.raises(RobotError, match="chambers_inside_wall"):
        Body([Segment(D25, SOFT, along={"robot.outer_diameter": (25e-3, 21e-3)})])
