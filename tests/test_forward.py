"""Poses at default settings against the paper, closed forms, the elastica and the witness; and their balances."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from designs import (
    GRAVITY,
    LAW_NAMES,
    SILICONES,
    body_of,
    choices_of,
    random_loads,
    random_material,
    random_pressures,
    random_robot,
    rubber_of,
    silicone,
)
from euler_elastica import cantilever
from slow import some_slow
from witness import Witnessed, arc, shoot
from witness_section import section

from softnlp.base.errors import InputError
from softnlp.base.status import Status
from softnlp.model.conventions import AS_PRINTED, COEFFICIENT_SETS, REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.numerics import Numerics
from softnlp.model.robot import ROBOTS, Robot
from softnlp.model.rod import Loads
from softnlp.statics import grid_size
from softnlp.statics.step import Pose, Step
from softnlp.studies.forward import forward

ECOFLEX_50 = silicone("Ecoflex 00-50")
COLLOCATION = Numerics(transcription="collocation")


def solve(robot: Robot, material: Material, pressure: object, **changes: object) -> Step:
    """Solve one pose that must solve, and hold what every solved step holds."""
    step = forward(robot, material, pressure, **changes).steps[0]  # type: ignore[arg-type]
    assert step.status is Status.SOLVED, step.message
    assert step.residual is not None
    assert step.residual <= 1e-8
    return step


def pose_of(*arguments: object, **changes: object) -> Pose:
    pose = solve(*arguments, **changes).pose  # type: ignore[arg-type]
    assert pose is not None
    return pose


def apart(found: np.ndarray, expected: np.ndarray) -> float:
    """Return the angle between two orientations [rad]."""
    return float(np.linalg.norm(found - expected) / np.sqrt(2))


# --- what the paper printed ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "bar", "degrees"),
    [
        ("Ecoflex 00-10", 0.6, 111.6),
        ("Ecoflex 00-20", 0.8, 111.7),
        ("Ecoflex 00-30", 1.2, 113.4),
        ("Ecoflex 00-50", 1.8, 108.5),
        ("Dragon Skin 10", 3.0, 62.5),
    ],
)
def test_the_published_angles_of_the_laparoscope_robot(name: str, bar: float, degrees: float) -> None:
    pose = pose_of(ROBOTS["laparoscope-6"], silicone(name), [1e5 * bar, 0, 0])
    assert np.degrees(pose.bending_angle) == pytest.approx(degrees, abs=0.1)
    assert np.degrees(pose.tilt) == pytest.approx(degrees, abs=0.1)


# --- without loads: the circular arc ---------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", some_slow(25, quick=5))
def test_an_unloaded_pose_is_the_circular_arc(seed: int) -> None:
    rng = np.random.default_rng([seed, 1])
    robot = random_robot(rng, sets=(1, 2, 3, 4))
    material = silicone(SILICONES[seed % 5], LAW_NAMES[(seed // 5) % 5])  # each silicone with each law
    pressure, sec = random_pressures(rng, robot, material, most_bending=360)
    pose = pose_of(robot, material, pressure)
    exact = arc(sec)
    L = robot.length
    assert pose.stretch == pytest.approx(sec.stretch, rel=1e-10)
    assert np.linalg.norm(pose.tip_position - exact["tip_position"]) <= 1e-8 * L
    assert np.abs(pose.chamber_length - exact["chamber_lengths"]).max() <= 1e-8 * L
    assert abs(pose.backbone_length - sec.L) <= 1e-8 * L
    assert pose.bending_angle == pytest.approx(exact["bending_angle"], abs=1e-7)
    assert apart(pose.tip_rotation, exact["tip_rotation"]) <= 1e-7
    assert pose.stable
    np.testing.assert_allclose(pose.tip_displacement, 0, atol=1e-8 * L)
    # and so is every point between base and tip
    for s, p in zip(pose.shape.arc[::12], pose.shape.position[::12], strict=True):
        along = arc(replace(sec, L=s * sec.L))["tip_position"] if s > 0 else np.zeros(3)
        assert np.linalg.norm(p - along) <= 1e-8 * L


def test_zero_pressure_is_straight() -> None:
    robot = ROBOTS["D15L60"]
    for numerics in (Numerics(), COLLOCATION):
        pose = pose_of(robot, ECOFLEX_50, [0, 0, 0], numerics=numerics)
        np.testing.assert_allclose(pose.tip_position, [0, 0, robot.length], atol=1e-15)
        np.testing.assert_allclose(pose.shape.rotation, np.broadcast_to(np.eye(3), (61, 3, 3)), atol=1e-14)
        np.testing.assert_allclose(pose.chamber_length, robot.length, atol=1e-15)
        assert (pose.stretch, pose.bending_angle) == (1.0, pytest.approx(0.0, abs=1e-13))


def test_pressing_set_1_bends_towards_minus_x_in_its_plane() -> None:
    pose = pose_of(ROBOTS["D25L60"], ECOFLEX_50, [1e5, 0, 0])
    assert pose.tip_position[0] < -1e-2
    assert np.abs(pose.shape.position[:, 1]).max() < 1e-12
    assert pose.chamber_length[:2].min() > pose.chamber_length[2:].max()


# --- with loads and gravity: the witness -----------------------------------------------------------------------------


def witnessed(seed: int) -> tuple[Robot, Material, np.ndarray, Loads, Witnessed]:
    """Draw a loaded design and solve it with the witness."""
    rng = np.random.default_rng([seed, 2])
    robot, material = random_robot(rng), random_material(rng)
    pressure, sec = random_pressures(rng, robot, material)
    loads = random_loads(rng, sec, force=1.5, moment=0.7)
    given = (loads.tip_force, loads.tip_moment, loads.gravity, float(material.density))
    w = shoot(sec, *given, points=61)
    if w.conjugate_points:  # its steps were long enough to leave the branch from no load
        w = shoot(sec, *given, points=61, steps=20)
    assert w.residual < 1e-10
    assert w.conjugate_points == 0
    return robot, material, pressure, loads, w


@pytest.mark.parametrize("numerics", [Numerics(), COLLOCATION], ids=lambda n: n.transcription)
@pytest.mark.parametrize("aside", [0.0, 0.003, 0.02])
def test_the_bending_angle_of_an_s_shape_has_no_error_of_the_grid(aside: float, numerics: Numerics) -> None:
    # pressure bends it to one side at the tip, the force to the other at the base; beside the plane it passes near 0
    robot, P, F = ROBOTS["D20L60"], np.array([6e4, 0, 0]), (0.25, aside, 0.1)
    w = shoot(section(body_of(robot), rubber_of(ECOFLEX_50), P), F, points=61)
    curvature = np.linalg.norm(w.u[:, :2], axis=1)
    assert curvature[1:-1].min() < 0.15 * min(curvature[0], curvature[-1])
    pose = pose_of(robot, ECOFLEX_50, P, loads=Loads(tip_force=F), numerics=numerics)
    assert pose.bending_angle == pytest.approx(w.bending_angle, abs=1e-7)


def agrees(pose: Pose, w: Witnessed, L: float) -> float:
    """Hold a pose against the witness; return the error of the tip position over L_0."""
    error = float(np.linalg.norm(pose.tip_position - w.tip_position)) / L
    assert error <= 1e-6
    assert apart(pose.tip_rotation, w.tip_rotation) <= 5e-6
    assert np.abs(pose.chamber_length - w.chamber_lengths).max() <= 1e-6 * L
    assert abs(pose.backbone_length - w.backbone_length) <= 1e-6 * L
    assert pose.bending_angle == pytest.approx(w.bending_angle, abs=5e-6)
    assert pose.tilt == pytest.approx(w.tilt, abs=5e-6)
    assert pose.stable is None  # a dead moment acts
    if w.s.size == pose.shape.arc.size:
        assert np.linalg.norm(pose.shape.position - w.p, axis=1).max() <= 1e-6 * L
        assert np.abs(pose.shape.rotation - w.R).max() <= 5e-6
        EI = sum(w.section.EI) / 2
        assert np.abs(pose.shape.force - w.n).max() <= 1e-5 * (EI / w.section.L**2 + w.section.F_P)
        assert np.abs(pose.shape.moment - w.m).max() <= 1e-5 * (EI / w.section.L + np.linalg.norm(w.section.M_P))
    return error


@pytest.mark.parametrize("seed", some_slow(30, quick=3))
def test_a_loaded_pose_is_the_witness_s(seed: int) -> None:
    robot, material, pressure, loads, w = witnessed(seed)
    step = solve(robot, material, pressure, loads=loads)
    assert step.pose is not None
    error = agrees(step.pose, w, robot.length)
    if error > 1e-9:
        assert step.discretisation_error is not None
        assert 1 / 3 <= step.discretisation_error / error <= 3


@pytest.mark.parametrize("seed", some_slow(4, quick=2))
def test_a_loaded_pose_by_collocation_is_the_witness_s(seed: int) -> None:
    robot, material, pressure, loads, w = witnessed(100 + seed)
    step = solve(robot, material, pressure, loads=loads, numerics=COLLOCATION)
    assert step.pose is not None
    error = agrees(step.pose, w, robot.length)
    if error > 1e-9:
        assert step.discretisation_error is not None
        assert 1 / 3 <= step.discretisation_error / error <= 3


@pytest.mark.parametrize("seed", some_slow(4, quick=2))
def test_both_transcriptions_agree(seed: int) -> None:
    rng = np.random.default_rng([seed, 3])
    robot, material = random_robot(rng), random_material(rng)
    pressure, sec = random_pressures(rng, robot, material)
    loads = random_loads(rng, sec, force=1.0, moment=0.5)
    one, two = (
        pose_of(robot, material, pressure, loads=loads, numerics=Numerics(transcription=name, accuracy=3e-8))
        for name in ("multiple-shooting", "collocation")
    )
    L = robot.length
    assert np.linalg.norm(one.tip_position - two.tip_position) <= 1e-7 * L
    assert np.abs(one.chamber_length - two.chamber_length).max() <= 1e-7 * L
    assert apart(one.tip_rotation, two.tip_rotation) <= 5e-7


@pytest.mark.parametrize(
    ("coefficients", "conventions"),
    [(COEFFICIENT_SETS["calibrated"], REPRODUCTION), (Coefficients(), AS_PRINTED)],
    ids=["calibrated", "as_printed"],
)
def test_other_coefficients_and_conventions_are_the_witness_s_too(
    coefficients: Coefficients, conventions: Conventions
) -> None:
    robot, pressure = ROBOTS["D20L40"], np.array([6e4, 2e4, 0.0])
    loads = Loads(tip_force=(0.03, -0.05, 0.02), tip_moment=(5e-4, 0.0, 3e-4), gravity=(0.0, 3.0, -9.0))
    sec = section(body_of(robot), rubber_of(ECOFLEX_50), pressure, choices_of(coefficients, conventions))
    w = shoot(sec, loads.tip_force, loads.tip_moment, loads.gravity)
    run = forward(robot, ECOFLEX_50, pressure, loads=loads, coefficients=coefficients, conventions=conventions)
    assert run.conventions.name == conventions.name
    assert run.steps[0].pose is not None
    agrees(run.steps[0].pose, w, robot.length)


# --- other exact solutions -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("load", [0.5, 2.0, 8.0])
def test_a_transverse_tip_load_on_a_slender_rod_is_the_elastica(load: float) -> None:
    # 20 m of a 10 mm rod: shear and extension are left in, and are of the order (r / L)^2 = 6e-8
    robot = replace(ROBOTS["D10L60"], length=20.0)
    sec = section(body_of(robot), rubber_of(ECOFLEX_50), [0, 0, 0])
    F = load * sec.EI[0] / sec.L**2
    pose = pose_of(robot, ECOFLEX_50, [0, 0, 0], loads=Loads(tip_force=(F, 0, 0)))
    x, z, slope = cantilever(load)
    np.testing.assert_allclose(pose.tip_position / robot.length, [x, 0, z], atol=1.5e-6)
    assert pose.tilt == pytest.approx(slope, abs=5e-6)
    assert pose.bending_angle == pytest.approx(slope, abs=5e-6)
    # the same in any direction
    c, s = np.cos(2.0), np.sin(2.0)
    turned = pose_of(robot, ECOFLEX_50, [0, 0, 0], loads=Loads(tip_force=(c * F, s * F, 0)))
    np.testing.assert_allclose(turned.tip_position / robot.length, [c * x, s * x, z], atol=1.5e-6)


def test_equal_pressures_and_axial_loads_only_lengthen() -> None:
    robot, pressure = ROBOTS["D20L40"], np.full(3, 8e4)
    sec = section(body_of(robot), rubber_of(ECOFLEX_50), pressure)
    pulls = [(0.0, 0.0), (0.3, 0.0), (-0.05, 0.0), (0.0, GRAVITY), (0.2, -GRAVITY)]
    for pull, gravity in pulls:
        pose = pose_of(robot, ECOFLEX_50, pressure, loads=Loads(tip_force=(0, 0, pull), gravity=(0, 0, gravity)))
        weight = 1070 * sec.A * gravity * sec.L
        length = sec.L * (1 + (pull + weight / 2) / sec.EA)
        np.testing.assert_allclose(pose.tip_position, [0, 0, length], atol=1e-12)
        np.testing.assert_allclose(pose.chamber_length, length, atol=1e-12)
        assert pose.backbone_length == pytest.approx(length, abs=1e-12)
        assert pose.bending_angle == pytest.approx(0, abs=1e-10)
        np.testing.assert_allclose(pose.tip_displacement, [0, 0, length - sec.L], atol=1e-12)


def test_a_pure_tip_moment_bends_to_a_circle_and_twists_evenly() -> None:
    robot = ROBOTS["D15L60"]
    sec = section(body_of(robot), rubber_of(ECOFLEX_50), [0, 0, 0])
    turn, L = 1.2 * np.pi, sec.L
    pose = pose_of(robot, ECOFLEX_50, [0, 0, 0], loads=Loads(tip_moment=(0, turn * sec.EI[1] / L, 0)))
    r = L / turn
    np.testing.assert_allclose(pose.tip_position, [r * (1 - np.cos(turn)), 0, r * np.sin(turn)], atol=1e-6 * L)
    assert pose.bending_angle == pytest.approx(turn, abs=1e-6)
    np.testing.assert_allclose(pose.shape.curvature, np.tile([0, turn / L, 0], (61, 1)), atol=1e-5 / L)
    twisted = pose_of(robot, ECOFLEX_50, [0, 0, 0], loads=Loads(tip_moment=(0, 0, 0.7 * sec.GJ / L)))
    np.testing.assert_allclose(twisted.tip_position, [0, 0, L], atol=1e-12)
    assert np.arctan2(twisted.tip_rotation[1, 0], twisted.tip_rotation[0, 0]) == pytest.approx(0.7, abs=1e-6)
    np.testing.assert_allclose(twisted.chamber_length, np.hypot(L, 0.7 * np.hypot(*sec.d[0])), atol=1e-9)


# --- symmetry and balance --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("numerics", [Numerics(), COLLOCATION], ids=lambda n: n.transcription)
def test_turning_pressures_and_loads_by_a_third_turns_the_pose(numerics: Numerics) -> None:
    c, s = np.cos(2 * np.pi / 3), np.sin(2 * np.pi / 3)
    Q = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    robot, P = ROBOTS["D15L60"], np.array([9e4, 2e4, 0.0])
    loads = Loads(tip_force=(0.02, -0.03, 0.01), tip_moment=(3e-4, 6e-4, -3e-4), gravity=(3.0, -2.0, -6.0))
    turned = Loads(**{name: Q @ np.asarray(value) for name, value in vars(loads).items()})
    one = pose_of(robot, ECOFLEX_50, P, loads=loads, numerics=numerics)
    two = pose_of(robot, ECOFLEX_50, np.roll(P, 1), loads=turned, numerics=numerics)
    L = robot.length
    np.testing.assert_allclose(two.tip_position, Q @ one.tip_position, atol=1e-10 * L)
    np.testing.assert_allclose(two.tip_rotation, Q @ one.tip_rotation @ Q.T, atol=1e-9)
    np.testing.assert_allclose(two.chamber_length, np.roll(one.chamber_length, 2), atol=1e-9 * L)
    assert two.bending_angle == pytest.approx(one.bending_angle, abs=1e-9)


@pytest.mark.parametrize("name", ["D25L60", "laparoscope-9"])
@pytest.mark.parametrize("transcription", ["multiple-shooting", "collocation"])
def test_force_and_moment_balance_over_any_part_of_the_rod(name: str, transcription: str) -> None:
    robot, P = ROBOTS[name], np.array([6e4, 9e4, 0.0])
    sec = section(body_of(robot), rubber_of(ECOFLEX_50), P)
    EI, L = sum(sec.EI) / 2, sec.L
    F, M = np.array([0.5, -0.8, 0.3]) * EI / L**2, np.array([0.1, 0.2, -0.1]) * EI / L
    g = np.array([3.0, -2.0, -6.0])
    numerics = Numerics(transcription=transcription, accuracy=1e-8)
    shape = pose_of(robot, ECOFLEX_50, P, loads=Loads(F, M, g), numerics=numerics).shape
    f_e, s = 1070 * sec.A * g, shape.arc * L
    # force: what the silicone carries is the load beyond the section
    force = shape.force - sec.F_P * shape.rotation[:, :, 2]
    np.testing.assert_allclose(force, F + f_e * (L - s)[:, None], atol=1e-8 * EI / L**2)
    # moment: that of the tip and of the weight beyond the section, by Simpson's rule over the points
    moment = shape.moment - shape.rotation @ sec.M_P
    arms = shape.position[None, :, :] - shape.position[:, None, :]  # from section j to point k
    for j in range(0, 61, 4):
        weights = np.ones(61 - j)
        weights[1:-1:2], weights[2:-1:2] = 4, 2
        h = (s[1] - s[0]) / 3 if j < 60 else 0.0
        weight = h * weights @ np.cross(arms[j, j:], f_e)
        np.testing.assert_allclose(moment[j], M + np.cross(arms[j, -1], F) + weight, atol=2e-7 * EI / L)
    # constitutive law of wall and fluid, R^T N = ... and R^T M + M_P = K u, and kinematics along the rod
    n = np.einsum("sji,sj->si", shape.rotation, force) + np.array([0, 0, sec.F_P])
    m = np.einsum("sji,sj->si", shape.rotation, moment) + sec.M_P
    stiffness = np.array([sec.GA, sec.GA, sec.EA])
    np.testing.assert_allclose(stiffness * (shape.shear_extension - [0, 0, 1]), n - [0, 0, sec.F_P], atol=1e-9 * sec.EA)
    np.testing.assert_allclose([*sec.EI, sec.GJ] * shape.curvature, m, atol=1e-9 * EI / L)
    gram = np.einsum("sji,sjk->sik", shape.rotation, shape.rotation)
    np.testing.assert_allclose(gram, np.broadcast_to(np.eye(3), (61, 3, 3)), atol=1e-6)


# --- sequences, inputs, what a step carries --------------------------------------------------------------------------


def test_a_sequence_gives_what_single_poses_give() -> None:
    robot = ROBOTS["D20L60"]
    table = np.array([[0, 0, 0], [5e4, 0, 0], [1e5, 2e4, 0], [1e5, 2e4, 0], [0, 0, 0]])
    loads = Loads(tip_force=(0.02, 0.01, -0.02), gravity=(0, 0, -GRAVITY))
    seen: list[int] = []
    run = forward(
        robot,
        ECOFLEX_50,
        table,
        loads=loads,
        times=[0.0, 1.0, 2.0, 3.0, 4.0],
        progress=lambda k, step: seen.append(k),
    )
    assert seen == [0, 1, 2, 3, 4]
    assert [step.time for step in run.steps] == [0.0, 1.0, 2.0, 3.0, 4.0]
    for step, pressure in zip(run.steps, table, strict=True):
        alone = pose_of(robot, ECOFLEX_50, pressure, loads=loads)
        assert step.pose is not None
        assert np.linalg.norm(step.pose.tip_position - alone.tip_position) <= 1e-6 * robot.length
    assert run.failed == ()
    tips = [step.pose.tip_position for step in run.steps if step.pose]
    np.testing.assert_allclose(tips[0], tips[4], atol=1e-6 * robot.length)


def test_a_failed_step_does_not_stop_the_run_and_carries_no_numbers() -> None:
    slim = replace(ROBOTS["D20L60"], chamber_diameter=3e-3)  # whose GJ outlasts the limit pressure
    run = forward(slim, silicone("Ecoflex 00-30", "yeoh"), [[3e4] * 3, [6e5] * 3, [3e4] * 3],
                  coefficients=Coefficients(elongation=0.0))  # fmt: skip
    assert [step.status for step in run.steps] == [Status.SOLVED, Status.NO_EQUILIBRIUM, Status.SOLVED]
    failed = run.steps[1]
    assert failed.pose is None
    assert run.failed == (failed,)
    np.testing.assert_allclose(run.steps[2].pose.tip_position, run.steps[0].pose.tip_position, atol=1e-12)


def test_a_given_number_of_intervals_is_used_and_what_it_cannot_reach_is_said() -> None:
    robot, pressure = ROBOTS["D10L60"], [1.2e5, 0, 0]
    loads = Loads(tip_force=(0.001, 0.002, 0.0))
    coarse = solve(robot, ECOFLEX_50, pressure, loads=loads, numerics=Numerics(intervals=12))
    assert coarse.intervals == 12
    assert coarse.discretisation_error is not None
    assert coarse.discretisation_error > 1e-6
    assert any("discretisation" in warning for warning in coarse.warnings)
    fine = solve(robot, ECOFLEX_50, pressure, loads=loads)
    assert fine.discretisation_error is not None
    assert fine.discretisation_error < 1e-6
    assert fine.warnings == ()


@pytest.mark.parametrize("enough", [True, False])
def test_the_finest_grid_either_meets_the_accuracy_or_gives_no_pose(
    enough: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Refinement aims at a third of the accuracy; where no finer grid is left, the accuracy itself decides."""
    robot, pressure, loads = ROBOTS["D25L60"], [0.9e5, 0.2e5, 0.0], Loads(tip_force=(0.02, 0.05, 0.0))
    error = solve(robot, ECOFLEX_50, pressure, loads=loads, numerics=Numerics(intervals=10)).discretisation_error
    assert error is not None
    monkeypatch.setattr(grid_size, "MOST_INTERVALS", 10)
    accuracy = error * (1.5 if enough else 0.1)
    step = forward(robot, ECOFLEX_50, pressure, loads=loads, numerics=Numerics(accuracy=accuracy)).steps[0]
    if enough:
        assert step.status is Status.SOLVED
        assert step.intervals == 10
        assert step.discretisation_error == pytest.approx(error, rel=1e-6)
        assert step.warnings == ()
    else:
        assert step.status is Status.INACCURATE
        assert f"; with 10 intervals it is {error:.2g} L_0" in step.message
        assert step.pose is None
        assert step.residual is not None
        assert step.residual < 1e-10  # the equations of the grid are solved; the grid is what is too coarse


def test_what_a_designer_should_know_is_a_warning() -> None:
    step = solve(ROBOTS["laparoscope-9"], ECOFLEX_50, [2e5, 2e5, 2e5])
    assert any("touch" in warning for warning in step.warnings)
    far = solve(ROBOTS["D25L60"], ECOFLEX_50, [3e5, 3e5, 3e5])
    assert any("fitted" in warning for warning in far.warnings)


@pytest.mark.parametrize(
    ("pressures", "loads", "key"),
    [
        ([1e5, 0], Loads(), "pressures"),
        ([-1.0, 0, 0], Loads(), "pressures"),
        ([np.nan, 0, 0], Loads(), "pressures"),
        (["much", 0, 0], Loads(), "pressures"),
        ([1e5, 0, 0], Loads(tip_force=(1, 2)), "tip_force"),
        ([1e5, 0, 0], Loads(gravity=(0, 0, np.inf)), "gravity"),
    ],
)
def test_impossible_input_is_refused_by_name(pressures: object, loads: Loads, key: str) -> None:
    with pytest.raises(InputError) as caught:
        forward(ROBOTS["D25L60"], ECOFLEX_50, pressures, loads=loads)
    assert caught.value.key == key
