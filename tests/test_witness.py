"""The witness proves itself on what is known without it: published angles, closed forms, elastica, balances."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from euler_elastica import cantilever
from witness import arc, shoot, solve
from witness_section import (
    AS_PRINTED,
    BODIES,
    CALIBRATED,
    LAW_NAMES,
    SILICONES,
    Choices,
    NoRoot,
    Section,
    Unstable,
    balance_pressure,
    published,
    section,
    solve_stretch,
)

G = 9.80665
ECOFLEX_50 = published("Ecoflex 00-50")


def unpressurised(robot: str = "D10L60") -> Section:
    return section(BODIES[robot], ECOFLEX_50, [0, 0, 0])


def inextensible(sec: Section) -> Section:
    stiff = 1e10 * sec.EI[0] / sec.L**2
    return replace(sec, EA=stiff, GA=stiff)


@pytest.mark.parametrize(
    ("silicone", "bar", "degrees"),
    [
        ("Ecoflex 00-10", 0.6, 111.6),
        ("Ecoflex 00-20", 0.8, 111.7),
        ("Ecoflex 00-30", 1.2, 113.4),
        ("Ecoflex 00-50", 1.8, 108.5),
        ("Dragon Skin 10", 3.0, 62.5),
    ],
)
def test_published_angles_of_the_laparoscope_robot(silicone: str, bar: float, degrees: float) -> None:
    assert np.degrees(solve("laparoscope-6", silicone, [bar, 0, 0]).bending_angle) == pytest.approx(degrees, abs=0.1)


def test_secants_of_the_linear_law() -> None:
    kPa = [published(s, "linear").modulus(1.0) / 1e3 for s in SILICONES]
    np.testing.assert_allclose(kPa, [139.6, 55.1, 34.4, 24.0, 17.5], atol=0.05)


@pytest.mark.parametrize("law", LAW_NAMES[1:])
@pytest.mark.parametrize("silicone", SILICONES)
def test_tangent_moduli_are_the_slope_of_the_true_stress(silicone: str, law: str) -> None:
    rubber = published(silicone, law)
    for stretch in (0.9, 1.0, 1.3, 2.0, 2.7):
        z = stretch + 1e-20j  # a complex step has no rounding error
        assert rubber.modulus(stretch) == pytest.approx((z * rubber.stress(z)).imag / 1e-20, rel=1e-9)


def test_the_stretch_is_the_first_root_and_moves_continuously() -> None:
    body, rubber = BODIES["D20L60"], published("Ecoflex 00-30", "yeoh")
    choices = Choices(k_e=0.0)
    stretches = [solve_stretch(body, rubber, total, choices) for total in np.linspace(0, 6.8e5, 25)]
    assert stretches[0] == 1.0
    assert np.all(np.diff(stretches) > 0)
    for total, stretch in zip(np.linspace(0, 6.8e5, 25)[1:], stretches[1:], strict=True):
        assert balance_pressure(body, rubber, stretch, choices) == pytest.approx(total, rel=1e-10)
    with pytest.raises(NoRoot):  # this law has a limit pressure, and roots beyond it are another branch
        solve_stretch(body, rubber, 9e5, choices)


def test_a_modulus_that_lost_its_sign_is_not_returned() -> None:
    # at 1.36 MPa in all the chambers Ogden's 00-50 with stiffening is past the stretch 3.04 where its modulus is 0
    with pytest.raises(Unstable):
        section(BODIES["D25L60"], published("Ecoflex 00-50", "ogden"), [1.36e6, 1.36e6, 1.36e6], Choices(k_b=0.0))


def test_shares_of_the_section_add_up_for_a_round_layout() -> None:
    for name in BODIES:
        sec = section(BODIES[name], ECOFLEX_50, [4e4, 4e4, 4e4], CALIBRATED)
        assert sec.EI[0] == pytest.approx(sec.EI[1], rel=1e-12)
        plain = section(BODIES[name], ECOFLEX_50, [4e4, 4e4, 4e4], Choices(k_b=0.0))
        # J = I_x + I_y for the same section, and GJ = E J / 3
        assert pytest.approx(sum(plain.EI), rel=1e-12) == 3 * plain.GJ
        fibres = section(BODIES[name], ECOFLEX_50, [0, 0, 0], AS_PRINTED)
        bare = section(BODIES[name], ECOFLEX_50, [0, 0, 0])
        assert fibres.A < bare.A
        assert sum(fibres.EI) < sum(bare.EI)
        assert pytest.approx(sum(fibres.EI), rel=1e-12) == 3 * fibres.GJ


@pytest.mark.parametrize("choices", [Choices(), CALIBRATED, AS_PRINTED], ids=["reproduction", "calibrated", "printed"])
@pytest.mark.parametrize(
    ("robot", "bar"), [("D25L60", [1.5, 0, 0]), ("D10L40", [0.3, 0.6, 0.1]), ("laparoscope-9", [0, 0.5, 0.5])]
)
def test_an_unloaded_pose_is_the_closed_form_arc(robot: str, bar: list[float], choices: Choices) -> None:
    pose = solve(robot, "Ecoflex 00-50", bar, choices=choices)
    exact = arc(pose.section)
    L = pose.section.L
    np.testing.assert_allclose(pose.tip_position, exact["tip_position"], atol=1e-10 * L)
    np.testing.assert_allclose(pose.tip_rotation, exact["tip_rotation"], atol=1e-10)
    np.testing.assert_allclose(pose.chamber_lengths, exact["chamber_lengths"], atol=1e-10 * L)
    assert pose.bending_angle == pytest.approx(exact["bending_angle"], abs=1e-10)
    assert pose.backbone_length == pytest.approx(L, abs=1e-10 * L)
    assert pose.conjugate_points == 0


@pytest.mark.parametrize("load", [0.5, 2.0, 10.0])
def test_transverse_tip_load_is_the_elastica(load: float) -> None:
    sec = inextensible(unpressurised())
    pose = shoot(sec, tip_force=(load * sec.EI[0] / sec.L**2, 0, 0))
    x, z, slope = cantilever(load)
    np.testing.assert_allclose(
        pose.tip_position / sec.L, [x, 0, z], atol=2e-9
    )  # 1e-10 of it for each unit of load / EA
    assert pose.tilt == pytest.approx(slope, abs=1e-9)


def test_a_real_slender_robot_is_near_the_elastica() -> None:
    # 1 m of a 10 mm silicone rod: shear and extension are left in and are of the order (r / L)^2
    sec = section(replace(BODIES["D10L60"], L_0=1.0), ECOFLEX_50, [0, 0, 0])
    load = 3.0
    pose = shoot(sec, tip_force=(load * sec.EI[0] / sec.L**2, 0, 0))
    x, z, _ = cantilever(load)
    np.testing.assert_allclose(pose.tip_position, [x, 0, z], atol=30 * (5e-3) ** 2)
    assert np.abs(pose.tip_position - [x, 0, z]).max() > 1e-7


def test_a_pure_moment_bends_to_a_circle_and_twists_evenly() -> None:
    sec = unpressurised("D15L60")
    turn = 1.2 * np.pi
    pose = shoot(sec, tip_moment=(0, turn * sec.EI[1] / sec.L, 0))
    r = sec.L / turn
    np.testing.assert_allclose(pose.tip_position, [r * (1 - np.cos(turn)), 0, r * np.sin(turn)], atol=1e-10 * sec.L)
    assert pose.bending_angle == pytest.approx(turn, abs=1e-10)
    twisted = shoot(sec, tip_moment=(0, 0, 0.7 * sec.GJ / sec.L))
    np.testing.assert_allclose(twisted.tip_position, [0, 0, sec.L], atol=1e-12)
    assert np.arctan2(twisted.tip_rotation[1, 0], twisted.tip_rotation[0, 0]) == pytest.approx(0.7, abs=1e-10)
    # a chamber on a helix of radius r_cp
    helix = np.hypot(sec.L, 0.7 * np.hypot(*sec.d[0]))
    np.testing.assert_allclose(twisted.chamber_lengths, helix, atol=1e-12)


def test_equal_pressures_and_an_axial_pull_only_lengthen() -> None:
    sec = section(BODIES["D20L40"], ECOFLEX_50, [8e4, 8e4, 8e4])
    pull = 0.2
    pose = shoot(sec, tip_force=(0, 0, pull))
    length = sec.stretch * 40e-3 * (1 + pull / sec.EA)
    np.testing.assert_allclose(pose.tip_position, [0, 0, length], atol=1e-12)
    np.testing.assert_allclose(pose.chamber_lengths, length, atol=1e-12)
    assert pose.backbone_length == pytest.approx(length, abs=1e-12)
    weight = 1070 * sec.A * G * sec.L
    hanging = shoot(sec, gravity=(0, 0, G))
    assert hanging.tip_position[2] == pytest.approx(sec.L * (1 + weight / (2 * sec.EA)), abs=1e-12)


def loaded() -> dict[str, tuple[float, float, float]]:
    return {"tip_force": (0.05, -0.08, 0.03), "tip_moment": (1e-3, 2e-3, -1e-3), "gravity": (3.0, -2.0, -6.0)}


def test_forces_and_moments_balance_on_every_part_of_the_rod() -> None:
    loads = loaded()
    pose = shoot(section(BODIES["D25L60"], ECOFLEX_50, [9e4, 3e4, 0]), **loads, points=401)
    sec = pose.section
    f_e = 1070 * sec.A * np.array(loads["gravity"])
    F, M = np.array(loads["tip_force"]), np.array(loads["tip_moment"])
    # what the wall carries beside the pressure is the load beyond the section
    force = pose.n - sec.F_P * pose.R[:, :, 2]
    np.testing.assert_allclose(force, F + f_e * (sec.L - pose.s)[:, None], atol=1e-10)
    moment = pose.m - pose.R @ sec.M_P
    weight = np.zeros((401, 3))
    for k in range(0, 401, 2):  # Simpson from the section to the tip
        w = np.ones(401 - k)
        w[1:-1:2], w[2:-1:2] = 4, 2
        w *= (pose.s[1] - pose.s[0]) / 3 if k < 400 else 0
        weight[k] = (w[:, None] * np.cross(pose.p[k:] - pose.p[k], f_e)).sum(axis=0)
    expected = M + np.cross(pose.tip_position - pose.p, F) + weight
    np.testing.assert_allclose(moment[::2], expected[::2], atol=1e-9)


def test_turning_pressures_and_loads_by_a_third_turns_the_pose() -> None:
    c, s = np.cos(2 * np.pi / 3), np.sin(2 * np.pi / 3)
    Q = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    body = BODIES["D15L60"]
    one = shoot(section(body, ECOFLEX_50, [9e4, 2e4, 0]), **loaded())
    two = shoot(section(body, ECOFLEX_50, [0, 9e4, 2e4]), **{k: tuple(Q @ v) for k, v in loaded().items()})
    # one shared P, so the stiffness is round and only the direction turns
    np.testing.assert_allclose(two.tip_position, Q @ one.tip_position, atol=1e-10)
    np.testing.assert_allclose(two.tip_rotation, Q @ one.tip_rotation @ Q.T, atol=1e-8)
    np.testing.assert_allclose(two.chamber_lengths, np.roll(one.chamber_lengths, 2), atol=1e-10)


def test_pressing_set_1_bends_towards_minus_x_and_lengthens_its_chambers_most() -> None:
    pose = solve("D25L40", "Dragon Skin 10", [1.0, 0, 0])
    assert pose.tip_position[0] < -1e-3
    assert abs(pose.tip_position[1]) < 1e-12
    assert pose.chamber_lengths[:2].min() > pose.chamber_lengths[2:].max()


@pytest.mark.parametrize(("factor", "points"), [(0.98, 0), (1.02, 2)])
def test_a_column_under_a_tip_load_loses_stability_at_euler(factor: float, points: int) -> None:
    sec = inextensible(unpressurised())
    euler = np.pi**2 / 4 * sec.EI[0] / sec.L**2
    assert shoot(sec, tip_force=(0, 0, -factor * euler)).conjugate_points == points  # both planes at once


@pytest.mark.parametrize(("factor", "points"), [(0.99, 0), (1.01, 2)])
def test_a_column_under_its_weight_loses_stability_at_greenhill(factor: float, points: int) -> None:
    sec = inextensible(unpressurised())
    g = factor * 7.8373 * sec.EI[0] / (1070 * sec.A * sec.L**3)
    assert shoot(sec, gravity=(0, 0, -g)).conjugate_points == points


def test_the_determinant_alone_misses_a_round_column_that_buckles() -> None:
    stands = solve("D10L60", "Ecoflex 00-50", [0, 0, 0], gravity=(0, 0, -G))
    falls = solve("D10L60", "Ecoflex 00-10", [0, 0, 0], gravity=(0, 0, -G))
    assert stands.conjugate_points == 0
    assert falls.conjugate_points == 2
    assert np.sign(stands.determinant) == np.sign(falls.determinant)
