"""Several segments of the energy section, round and of any outline: against one robot, and against composed arcs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from softnlp import (
    BAR,
    ENERGY,
    Coefficients,
    ContactSettings,
    Loads,
    Numerics,
    Segment,
    blocked_force,
    forward,
    material,
    robot,
)
from softnlp import segmented_robot as in_series
from softnlp.base.errors import InputError
from softnlp.model.body import Body
from softnlp.model.conventions import UNIAXIAL
from softnlp.model.outlined import Chamber, Semicircle, outlined_robot
from softnlp.scenario.read import scenario_from_text
from softnlp.scenario.run import run_scenario

RUBBER = material("Ecoflex 00-50")
C_M = Coefficients(modulus_factor=1.284)
ONE = robot("D25L60")
HALF = replace(ONE, length=ONE.length / 2)
HOW = {"conventions": ENERGY, "coefficients": C_M}
LOADS = Loads(tip_force=(0.02, 0.01, -0.05), gravity=(0.0, 0.0, -9.81))


def test_two_segments_of_one_section_are_one_of_twice_the_length():
    pressure = [0.8 * BAR, 0.0, 0.1 * BAR]
    two = in_series([Segment(HALF, RUBBER), Segment(HALF, RUBBER)])
    one = forward(ONE, RUBBER, [pressure], loads=LOADS, numerics=Numerics(intervals=24), **HOW).steps[0]
    how = {"loads": LOADS, "numerics": Numerics(intervals=12), **HOW}
    both = forward(two, two.material, [pressure * 2], **how).steps[0]
    assert np.abs(one.pose.tip_position - both.pose.tip_position).max() < 1e-10 * ONE.length
    assert np.abs(one.pose.tip_rotation - both.pose.tip_rotation).max() < 1e-9
    lengths = both.pose.chamber_length
    assert np.abs(lengths[:6] + lengths[6:] - one.pose.chamber_length).max() < 1e-10 * ONE.length


@pytest.mark.slow
def test_different_segments_are_arcs_one_behind_the_other():
    first, turn = [0.6 * BAR, 0.0, 0.0], 0.7
    bender = outlined_robot("b", [Chamber(0, Semicircle(7e-3, 1e-3, 0.0), 0.5e-3)], 40e-3, outer_diameter=20e-3)
    how = {"conventions": UNIAXIAL, "coefficients": C_M}
    two = in_series([Segment(HALF, RUBBER, connector=2e-3), Segment(bender, RUBBER, turn=turn)])
    both = forward(two, two.material, [[*first, 0.2 * BAR]], numerics=Numerics(intervals=24), **how).steps[0]
    a, b = (
        forward(one, RUBBER, [pressure], **how).steps[0].pose
        for one, pressure in ((HALF, first), (bender, [0.2 * BAR]))
    )
    c, s = np.cos(turn), np.sin(turn)
    R = a.tip_rotation @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    tip = a.tip_position + a.tip_rotation[:, 2] * 2e-3 + R @ b.tip_position
    assert np.abs(both.pose.tip_position - tip).max() < 1e-9 * 0.07
    assert both.pose.bending_angle == pytest.approx(a.bending_angle + b.bending_angle, abs=1e-8)
    assert both.pose.chamber_length == pytest.approx([*a.chamber_length, *b.chamber_length], rel=1e-9)


def test_a_wall_holds_segments_as_it_holds_one_robot():
    two = in_series([Segment(HALF, RUBBER), Segment(HALF, RUBBER)])
    how = {"contact": ContactSettings(closure="none"), **HOW}
    one = blocked_force(ONE, RUBBER, [[0.5 * BAR, 0.0, 0.0]], **how).steps[0]
    both = blocked_force(two, two.material, [[0.5 * BAR, 0.0, 0.0] * 2], **how).steps[0]
    assert both.contact.force == pytest.approx(one.contact.force, abs=1e-6)
    assert both.contact.told_reaction is None
    with pytest.raises(InputError, match="not used with conventions energy"):
        blocked_force(two, two.material, [[0.5 * BAR, 0.0, 0.0] * 2], contact=ContactSettings(closure="free"), **HOW)


def test_lines_and_sections_that_vary_are_refused():
    with pytest.raises(InputError, match="no bonded lines so far"):
        Body([Segment(HALF, RUBBER, lines="bonded"), Segment(HALF, RUBBER)], conventions=ENERGY)
    with pytest.raises(InputError, match="does not vary along a segment so far"):
        Body([Segment(HALF, RUBBER, along={"robot.outer_diameter": (25e-3, 24e-3)})], conventions=ENERGY)


def test_a_segment_may_have_chambers_of_its_own():
    silicone = '[segment.material]\nname = "Ecoflex 00-50"\nmodel = "mooney-rivlin"\n'
    robots = (
        "[segment.robot]\nouter_diameter_mm = 20.0\nlength_mm = 30.0\n[[segment.chamber]]\nset = 1\n"
        "circle = { x_mm = 4.0, y_mm = 0.0, bore_mm = 4.0, wall_mm = 0.5 }\n",
        '[segment.robot]\nname = "D20L40"\n',
    )
    segments = "".join(f"[[segment]]\n{own}{silicone}" for own in robots)
    head = 'study = "forward"\n[corrections]\nconventions = "energy"\n[pressure]\nsequence_bar = [[0.2, 0, 0.1, 0]]\n'
    step = run_scenario(scenario_from_text(head + segments, "mine.toml")).steps[0]
    assert step.pose is not None
    assert len(step.pose.chamber_length) == 7
    assert step.residual < 1e-8
    wrong = segments.replace("x_mm = 4.0", "x_mm = 9.0")
    with pytest.raises(InputError, match=r"segment.1.chamber: chambers_inside_wall"):
        scenario_from_text(head + wrong, "mine.toml")
