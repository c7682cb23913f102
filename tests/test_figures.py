"""The figures and tables of the documentation say what the package's own interface gives."""

from __future__ import annotations

import re

import numpy as np
import pytest

from docs.figures import buckling, laws, measured_angles, printed_sign, section_limits, settled
from docs.figures._shared import MEASURED_ELONGATION, PUBLISHED, markdown
from softnlp import (
    BAR,
    COEFFICIENT_SETS,
    DEGREE,
    MILLIMETRE,
    REPRODUCTION,
    ROBOTS,
    Coefficients,
    Status,
    forward,
    material,
    robot,
)
from softnlp.model.round_chambers import deform


def numbers(table: str, row: str) -> list[float]:
    """Return the numbers of a row of a Markdown table, behind its first cell."""
    (line,) = re.findall(rf"^\| {re.escape(row)} \|(.*)$", table, re.MULTILINE)
    return [float(x) for x in re.findall(r"-?\d+\.?\d*", line)]


def test_the_settled_reading_is_the_package_itself() -> None:
    for case in PUBLISHED:
        step = forward(robot("laparoscope-6"), material(case.silicone), [[case.pressure * BAR, 0, 0]]).steps[0]
        assert step.pose is not None
        angle = settled.angle(case, settled.READINGS[0], 0.41, 1.23)
        assert angle == pytest.approx(step.pose.bending_angle / DEGREE, abs=1e-9)
        assert angle == pytest.approx(case.angle, abs=0.1)


def test_other_readings_are_other_models_and_the_table_says_by_how_much() -> None:
    table = settled.text()
    for reading in settled.READINGS[1:]:
        worst, left, *_ = numbers(table, reading.words)[-4:]
        assert worst > 5
        assert left <= worst
    assert numbers(table, "as settled")[0] <= 0.1


@pytest.mark.thorough
def test_measured_angles_are_compared_with_poses_of_the_interface() -> None:
    angles, elongations = measured_angles.predictions()
    P = np.array([[1.5, 0, 0], [1.5, 1.5, 0], [1.5, 1.5, 1.5]]) * BAR
    for label, coefficients in COEFFICIENT_SETS.items():
        one, two, three = forward(robot("D15L60"), material("Ecoflex 00-50"), P, coefficients=coefficients).steps
        assert one.pose is not None
        assert two.pose is not None
        assert three.pose is not None
        assert angles[label]["D15L60", 1] == pytest.approx(one.pose.bending_angle / DEGREE)
        assert angles[label]["D15L60", 2] == pytest.approx(two.pose.bending_angle / DEGREE)
        longer = three.pose.backbone_length - robot("D15L60").length
        assert elongations[label]["D15L60"] == pytest.approx(longer / MILLIMETRE)
    assert numbers(measured_angles.text(), "mean error") == pytest.approx([44.5, 30.2], abs=0.06)


@pytest.mark.slow
def test_the_printed_sign_is_what_the_table_says() -> None:
    table = printed_sign.text()
    low, high = (1 + mm / 60 for mm in MEASURED_ELONGATION["L60"])
    assert numbers(table, "measured, all robots of 60 mm") == pytest.approx([low, high], abs=0.005)
    settled_stretches = [x for law in printed_sign.LAWS for x in numbers(table, f"settled, {law}")]
    assert all(low - 0.1 < x < high for x in settled_stretches)
    last = numbers(table, "printed, yeoh")[1]  # of D20L60 [bar]
    P = np.outer([last - 0.006, last + 0.006], [1, 1, 1]) * BAR
    steps = forward(robot("D20L60"), material("Ecoflex 00-50", "yeoh"), P, conventions=printed_sign.PRINTED).steps
    assert [step.status for step in steps] == [Status.SOLVED, Status.NO_EQUILIBRIUM]


def test_chambers_touch_where_the_section_says_so() -> None:
    for name in ("D25L60", "laparoscope-9"):
        body = ROBOTS[name]
        stretch = section_limits.touching(body)
        section = deform(body, material("Ecoflex 00-50"), [0.0] * 3, stretch, Coefficients(), REPRODUCTION)
        centres = np.array([[float(c) for c in centre] for centre in section.centres])
        gaps = np.linalg.norm(centres - np.roll(centres, 1, axis=0), axis=1)
        assert gaps.min() == pytest.approx(2 * body.chamber_radius, rel=1e-12)
    assert section_limits.area_lost(ROBOTS["D25L60"], 1.0) == pytest.approx(0, abs=1e-9)
    assert section_limits.area_lost(ROBOTS["D25L60"], 1.6) == pytest.approx(25.8, abs=0.05)


def test_laws_agree_as_far_as_the_table_says() -> None:
    silicone = "Ecoflex 00-50"
    stresses = [
        float(material(silicone, law).engineering_stress(2.0))
        for law in ("neo-hookean", "mooney-rivlin", "yeoh", "ogden")
    ]
    spread = 100 * (max(stresses) - min(stresses)) / np.mean(stresses)
    row = next(line for line in laws.text().splitlines() if silicone in line).split("|")
    assert float(row[5].split("/")[0]) == pytest.approx(spread, abs=0.5)


def test_the_robot_that_buckles_is_the_one_above_the_critical_number() -> None:
    table = buckling.text()
    for name in buckling.ROBOTS:
        number = numbers(table, name)[0]
        assert ("stands" in next(line for line in table.splitlines() if name in line)) == (number < 7.84)


def test_a_cell_may_hold_a_bar() -> None:
    assert markdown(["a", "b"], [["x", "|v|"]]).splitlines()[-1] == "| x | \\|v\\| |"
