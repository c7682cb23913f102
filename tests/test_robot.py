"""Robot geometry: the chamber layout, the rules of manufacture and the library."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from math import cos, degrees, hypot, inf, nan, pi, radians, sin

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from softnlp.base.errors import RobotError
from softnlp.base.units import DEGREE, MILLIMETRE
from softnlp.model.robot import DIMENSIONS, MINIMUM_WALL, ROBOTS, Robot, check, robot, touching_stretch, violations

D25 = ROBOTS["D25L60"]


def layout(sets: int, per_set: int, angle_deg: float, thread: float = 0.0005) -> Robot:
    """Return a large body with thin chambers, so that only the chambers' spacing matters."""
    return Robot("layout", 0.2, 0.05, 0.1, thread, thread / 2, 0.1, sets, per_set, angle_deg * DEGREE)


def broken(robot: Robot) -> list[str]:
    return [v.rule for v in violations(robot)]


PUBLISHED_OUTER_WALL_MM = {"D25": 1.25, "D20": 0.9, "D15": 0.65, "D10": 0.5, "lap": 0.525}
PUBLISHED_TOUCHING = {"laparoscope-9": 1.43, "D20": 1.56, "D10": 1.69, "D25": 1.71, "D15": 1.87}


def test_the_library_holds_the_published_robots() -> None:
    assert list(ROBOTS) == [
        *(f"{body}L{length}" for body in ("D25", "D20", "D15", "D10") for length in (40, 60)),
        "laparoscope-3",
        "laparoscope-6",
        "laparoscope-9",
    ]
    assert [ROBOTS[f"laparoscope-{n}"].chambers for n in (3, 6, 9)] == [3, 6, 9]


@pytest.mark.parametrize("name", ROBOTS)
def test_published_robots_can_be_made_and_satisfy_eq_1(name: str) -> None:
    made = ROBOTS[name]
    assert check(made) == ()
    assert made.name == name
    assert made.outer_wall == pytest.approx(PUBLISHED_OUTER_WALL_MM[name[:3]] * MILLIMETRE)
    recomposed = made.lumen_diameter + 4 * (made.chamber_wall + made.outer_wall) + 2 * made.chamber_diameter
    assert recomposed == pytest.approx(made.outer_diameter)
    assert made.length in (pytest.approx(0.04), pytest.approx(0.06), pytest.approx(0.045))


@pytest.mark.parametrize(("name", "stretch"), PUBLISHED_TOUCHING.items())
def test_published_touching_stretch(name: str, stretch: float) -> None:
    for made in (r for n, r in ROBOTS.items() if n.startswith(name)):
        assert round(touching_stretch(made), 2) == stretch


@pytest.mark.parametrize("name", ["D25L40", "D10L60", "laparoscope-6", "laparoscope-9"])
def test_chambers_touch_exactly_at_the_touching_stretch(name: str) -> None:
    """Shrink the circle as (S2) says and measure the gap between every two chambers."""
    made = ROBOTS[name]
    shrink = touching_stretch(made) ** -0.5
    centres = np.array(made.chamber_centres()) * shrink
    gaps = [hypot(*(a - b)) - 2 * made.chamber_radius for a, b in combinations(centres, 2)]
    assert min(gaps) == pytest.approx(0, abs=1e-12)


def test_angles_of_a_published_robot() -> None:
    assert [degrees(a) for a in D25.chamber_angles()] == pytest.approx([-25, 25, 95, 145, 215, 265])
    assert D25.set_of_chamber == (0, 0, 1, 1, 2, 2)
    assert D25.chamber_centres()[0] == pytest.approx((8.5e-3 * cos(radians(25)), -8.5e-3 * sin(radians(25))))


@given(st.integers(1, 6), st.integers(1, 4), st.floats(1, 80))
def test_layout_is_symmetric(sets: int, per_set: int, angle: float) -> None:
    made = layout(sets, per_set, angle)
    angles = np.array(made.chamber_angles()).reshape(sets, per_set)
    assert made.chambers == len(made.set_of_chamber) == angles.size
    assert angles[0].mean() == pytest.approx(0, abs=1e-12)  # set 1 is centred on +x
    assert np.diff(angles, axis=1) == pytest.approx(angle * DEGREE)
    turned = (angles - angles[0]) - 2 * pi * np.arange(sets)[:, None] / sets
    assert turned == pytest.approx(0, abs=1e-9)  # every set is set 1 turned by 360/n1


def test_symbols_give_expressions_with_the_same_values() -> None:
    width, circle, angle = ca.SX.sym("D_c"), ca.SX.sym("D_cp"), ca.SX.sym("alpha_1")
    free = robot("D25L60", chamber_diameter=width, chamber_circle_diameter=circle, chamber_angle=angle)
    centres = ca.vertcat(*(ca.horzcat(*c) for c in free.chamber_centres()))
    walls = ca.vertcat(free.outer_wall, free.chamber_radius, free.bore_radius)
    evaluate = ca.Function("f", [width, circle, angle], [centres, walls])
    found, found_walls = evaluate(D25.chamber_diameter, D25.chamber_circle_diameter, D25.chamber_angle)
    assert np.array(found) == pytest.approx(np.array(D25.chamber_centres()))
    assert np.array(found_walls).ravel() == pytest.approx([D25.outer_wall, D25.chamber_radius, D25.bore_radius])
    with pytest.raises(RobotError, match="chamber_circle_diameter: expected a number, got SX"):
        check(free)


# --- rules -----------------------------------------------------------------------------------------------------------


@given(st.integers(1, 6), st.integers(1, 5), st.floats(0.5, 360), st.floats(0.0005, 0.02))
def test_overlap_agrees_with_every_pair_of_chambers(sets: int, per_set: int, angle: float, thread: float) -> None:
    """All pairs, not only neighbours, and any angle: sets may interleave."""
    made = layout(sets, per_set, angle, thread=thread)
    gaps = [hypot(a[0] - b[0], a[1] - b[1]) for a, b in combinations(made.chamber_centres(), 2)]
    smallest = min(gaps, default=inf)
    if abs(smallest - 2 * made.chamber_radius) > 2e-9:
        assert ("chamber_overlap" in broken(made)) == (smallest < 2 * made.chamber_radius)
    assert touching_stretch(made) == pytest.approx((smallest / (2 * made.chamber_radius)) ** 2, rel=1e-6, abs=1e-9)


def test_last_and_first_chamber_are_neighbours() -> None:
    """One set of five over 320 degrees: only the gap that closes the circle is too small."""
    made = layout(1, 5, 80.0, thread=0.02)  # gaps of 80, 80, 80, 80 and 40 degrees
    (violation,) = (v for v in violations(made) if v.rule == "chamber_overlap")
    assert violation.chambers == (0, 4)
    assert "chambers 1 and 5" in violation.message or "chambers 5 and 1" in violation.message


def test_interleaved_sets_are_not_refused_for_interleaving() -> None:
    """Chambers of set 1 at +-90 degrees, of set 2 at 30 and 210, of set 3 at 150 and 330: evenly spaced."""
    made = layout(3, 2, 180.0)
    assert "chamber_overlap" not in broken(made)
    assert touching_stretch(made) == pytest.approx((made.chamber_circle_radius / (2 * made.chamber_radius)) ** 2)


def test_a_single_chamber_has_no_neighbour() -> None:
    assert touching_stretch(layout(1, 1, 0.0)) == inf
    assert "chamber_overlap" not in broken(layout(1, 1, 0.0))


def test_two_opposite_chambers() -> None:
    made = layout(2, 1, 0.0)
    assert touching_stretch(made) == pytest.approx((made.chamber_circle_radius / made.chamber_radius) ** 2)


def test_wall_thickness_names_rule_and_numbers() -> None:
    thin = replace(D25, outer_diameter=0.0210)  # (21 - 9 - 9)/4 = 0.75 mm
    assert broken(thin) == ["wall_thickness", "chambers_inside_wall"]
    message = violations(thin)[0].message
    assert "Eq. (1)" in message
    assert "0.75 mm" in message
    assert "0.8 mm" in message


@pytest.mark.parametrize(("slack", "refused"), [(0.0, False), (-1e-11, False), (-1e-6, True), (1e-6, False)])
def test_wall_thickness_at_the_limit(slack: float, refused: bool) -> None:
    """A wall of exactly delta_s passes, a micrometre less does not: delta_c + delta_r = 0.8 mm + slack."""
    lumen = 0.010
    width = 4 * (MINIMUM_WALL + slack) + 2 * 0.0034 + lumen
    made = replace(
        D25,
        chamber_diameter=0.0034,
        lumen_diameter=lumen,
        chamber_wall=0.0003,
        outer_diameter=width,
        chamber_circle_diameter=(width + lumen) / 2,
    )
    assert broken(made) == (["wall_thickness"] if refused else [])
    assert broken(replace(made, chamber_wall=0.00035)) == broken(made)  # the rule is on the sum


def test_minimum_wall_can_be_chosen() -> None:
    check(D25, minimum_wall=1.75e-3)
    with pytest.raises(RobotError, match=r"wall_thickness: .*1\.75 mm.*2 mm"):
        check(D25, minimum_wall=2e-3)


def test_chambers_outside_the_wall_are_refused_and_never_allowed() -> None:
    outside = replace(D25, chamber_circle_diameter=0.020)
    assert broken(outside) == ["chambers_inside_wall"]
    with pytest.raises(RobotError, match=r"r_cp \+ r_co = 12.75 mm, beyond the outer radius 12.5 mm"):
        check(outside, allow=["wall_thickness", "chamber_overlap"])
    with pytest.raises(RobotError, match="can never be lowered"):
        check(outside, allow=["chambers_inside_wall"])
    inside = replace(D25, chamber_circle_diameter=0.0144)
    with pytest.raises(RobotError, match=r"r_cp - r_co = 4.45 mm, inside the lumen radius 4.5 mm"):
        check(inside)


def test_allowed_rules_become_warnings() -> None:
    crowded = replace(D25, chamber_angle=30 * DEGREE)
    with pytest.raises(RobotError, match=r'chamber_overlap: .*allow = \["chamber_overlap"\]') as caught:
        check(crowded)
    assert "\n" not in str(caught.value)
    (warning,) = check(crowded, allow=["chamber_overlap"])
    assert "4.39992 mm" in warning  # 2 * 8.5 sin 15 deg
    assert "5.5 mm" in warning
    with pytest.raises(RobotError, match="did you mean 'chamber_overlap'"):
        check(crowded, allow=["chambers_overlap"])


def test_several_broken_rules_are_counted() -> None:
    with pytest.raises(RobotError, match=r"^wall_thickness: .*\(and 1 more\)$"):
        check(replace(D25, outer_diameter=0.0210))


@pytest.mark.parametrize("dimension", DIMENSIONS, ids=lambda d: d.field)
@pytest.mark.parametrize("value", [-1.0, 0.0, nan, inf, 1e300, True, "5"])
def test_impossible_dimensions_are_named(dimension, value) -> None:
    with pytest.raises(RobotError) as caught:
        check(replace(D25, **{dimension.field: value}))
    assert caught.value.key == dimension.field


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"lumen_diameter": 0.025}, "lumen_diameter"),
        ({"lumen_diameter": 0.030}, "lumen_diameter"),
        ({"chamber_sets": 100, "chambers_per_set": 100}, "chamber_sets"),
        ({"chamber_sets": 2.0}, "chamber_sets"),
        ({"chamber_angle": 50.0}, "chamber_angle"),  # degrees where radians are asked
        ({"length": 1e-9}, "length"),
    ],
)
def test_impossible_geometry_is_named(change: dict[str, float], key: str) -> None:
    with pytest.raises(RobotError) as caught:
        check(replace(D25, **change))
    assert caught.value.key == key


# --- the library -----------------------------------------------------------------------------------------------------


def test_robot_overrides_single_dimensions() -> None:
    longer = robot("D25L60", length=0.08)
    assert longer.length == 0.08
    assert longer.name == "D25L60 (modified)"
    assert longer.outer_diameter == D25.outer_diameter
    assert robot("D25L60", length=D25.length) is D25
    assert robot("D25L60") is D25


def test_robot_names_the_nearest() -> None:
    with pytest.raises(RobotError, match="did you mean 'D25L60'"):
        robot("D25L6")
    with pytest.raises(RobotError, match="did you mean 'outer_diameter'"):
        robot("D25L60", outer_diametre=0.02)


def test_robot_refuses_what_cannot_be_made() -> None:
    with pytest.raises(RobotError, match="chamber_overlap"):
        robot("D25L60", chamber_angle=30 * DEGREE)
    assert robot("D25L60", chamber_angle=30 * DEGREE, allow=["chamber_overlap"]).chamber_angle == 30 * DEGREE


def test_dimensions_cover_the_robot() -> None:
    assert [d.field for d in DIMENSIONS] == [f for f in D25.__dataclass_fields__ if f != "name"]
