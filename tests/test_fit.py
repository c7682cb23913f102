"""Chambers of a robot of known sizes: what is said can be made can be, and what is said to mend it does."""

from __future__ import annotations

import re
from dataclasses import replace
from math import inf, radians
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from softnlp.base.errors import RobotError
from softnlp.base.ranges import SIZE
from softnlp.cli import main
from softnlp.model.fit import fit_robot
from softnlp.model.robot import ROBOTS, Robot, check, violations

MM, EPS = 1e-3, 1e-6
DIAMETERS = ("outer_diameter", "lumen_diameter", "chamber_diameter")


def sizes_of(robot: Robot) -> dict[str, Any]:
    names = (*DIAMETERS, "chamber_sets", "chambers_per_set", "chamber_wall", "length")
    return {name: getattr(robot, name) for name in names}


@pytest.mark.parametrize("name", ROBOTS)
def test_the_robots_of_the_library_have_their_chambers_there(name: str) -> None:
    """The paper's robots have the circle in the middle of the wall; their angles are within the range."""
    robot = ROBOTS[name]
    found = fit_robot(**sizes_of(robot))
    assert found.robot.chamber_circle_diameter == pytest.approx(robot.chamber_circle_diameter, abs=0.3 * MM)
    if robot.chambers_per_set > 1:
        low, high = found.limits["chamber_angle"]
        assert low < robot.chamber_angle <= high
    assert check(found.robot) == ()


SIZES = {
    "outer_diameter": st.floats(8 * MM, 40 * MM),
    "lumen_diameter": st.floats(1 * MM, 20 * MM),
    "chamber_diameter": st.floats(1 * MM, 8 * MM),
    "chamber_sets": st.integers(1, 4),
    "chambers_per_set": st.integers(1, 4),
    "chamber_wall": st.floats(0.1 * MM, 1.5 * MM),
}


@given(**SIZES)
def test_limits_are_where_robots_can_no_longer_be_made(**sizes: Any) -> None:
    assume(sizes["lumen_diameter"] < sizes["outer_diameter"] - MM)
    try:
        found = fit_robot(**sizes)
    except RobotError as error:
        ways = re.findall(r"(outer diameter|bore|lumen) at (least|most) ([\d.]+) mm", error.message)
        assert ways[0][:2] == ("outer diameter", "least")
        for word, way, number in ways:
            name = {"bore": "chamber_diameter", "lumen": "lumen_diameter"}.get(word, "outer_diameter")
            mended = float(number) * MM + (1 if way == "least" else -1) * 1e-3 * MM  # written with six digits
            if mended > 0.01 * MM:
                assert violations(fit_robot(**(sizes | {name: mended})).robot) == ()
        return
    assert violations(found.robot) == ()
    for name in DIAMETERS:
        for limit, out in zip(found.limits[name], (-1, 1), strict=True):
            if 0.05 * MM < limit < inf:
                assert violations(fit_robot(**(sizes | {name: limit - out * EPS})).robot) == ()
                with pytest.raises(RobotError):
                    fit_robot(**(sizes | {name: limit + out * EPS}))
    for name in ("chamber_circle_diameter", "chamber_angle"):
        for limit, out in zip(found.limits.get(name, ()), (-1, 1), strict=False):
            step = EPS if name.endswith("diameter") else radians(0.01)
            if limit - step > 0:
                assert violations(replace(found.robot, **{name: limit - out * step})) == ()
                if limit + out * step > 0 and (name != "chamber_angle" or found.robot.chambers > 2):
                    assert violations(replace(found.robot, **{name: limit + out * step})) != ()


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        (
            {"outer_diameter": 19.4},
            "1.8 mm too little: outer diameter at least 21.2 mm or bore at most 3.6 mm or lumen",
        ),
        ({"chamber_circle_diameter": 20.0}, "outer diameter at least 25.5 mm or chamber circle at most 19.5 mm"),
        ({"chamber_circle_diameter": 14.0}, "chamber circle at least 14.5 mm or lumen at most 8.5 mm"),
    ],
)
def test_a_refusal_says_what_mends_it(changed: dict[str, float], told: str) -> None:
    broken = replace(ROBOTS["D25L60"], **{name: value * MM for name, value in changed.items()})
    assert any(told in v.message for v in violations(broken))


def test_chambers_that_overlap_are_told_the_circle_and_the_bore() -> None:
    broken = replace(ROBOTS["D25L60"], chamber_angle=radians(30))
    (found,) = violations(broken)
    circle, bore = (float(x) * MM for x in re.findall(r"at (?:least|most) ([\d.]+) mm", found.message))
    assert violations(replace(broken, chamber_diameter=bore - EPS)) == ()
    assert "chamber_overlap" not in [v.rule for v in violations(replace(broken, chamber_circle_diameter=circle + EPS))]


def test_sizes_in_metres_are_named() -> None:
    D25 = ROBOTS["D25L60"]
    tiny = replace(D25, **{name: getattr(D25, name) / 1000 for name in (*DIAMETERS, "chamber_circle_diameter")})
    with pytest.raises(RobotError, match=r"an outer diameter of 0\.025 mm looks like metres: 25 mm"):
        check(replace(tiny, chamber_wall=1e-6))
    with pytest.raises(RobotError, match=r"got 0\.0005 mm; 0\.0005 mm looks like metres: 0\.5 mm$"):
        check(replace(tiny, chamber_wall=0.5e-6))
    assert SIZE.refusal(1e-4).endswith("; 0.0001 mm looks like metres: 0.1 mm")
    assert SIZE.refusal(2e5).endswith("got 200000 mm")


def test_the_command_prints_a_table_that_a_scenario_takes(capsys: pytest.CaptureFixture[str]) -> None:
    import tomllib

    words = ["--outer-diameter-mm", "25", "--lumen-diameter-mm", "9", "--chamber-diameter-mm", "4.5"]
    assert main(["robots", "--fit", *words]) == 0
    text = capsys.readouterr().out
    table = tomllib.loads(text[text.index("[robot]") :])["robot"]
    assert (table["chamber_circle_diameter_mm"], table["chamber_angle_deg"]) == (17, 60)
    assert ["outer_diameter_mm", "25", "21.2", "-"] in [line.split() for line in text.splitlines()]
    assert main(["robots", "--fit", *words[:4]]) == 2
    assert capsys.readouterr().err == "softnlp: --chamber-diameter-mm: missing; --fit needs it\n"
    assert main(["robots", *words]) == 2
    assert "--fit: expected together" in capsys.readouterr().err
    assert main(["robots", "--fit", *words, "--chamber-sets", "0"]) == 2
    assert "--chamber-sets: expected a whole number from 1" in capsys.readouterr().err
