"""Whether a body can take a shape: closed forms of arcs and helices, and a count of the parts that a point lies in."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from softnlp import (
    BAR,
    DEGREE,
    ContactSettings,
    Loads,
    Numerics,
    Status,
    force_against_offset,
    forward,
    inverse,
    material,
    robot,
)
from softnlp.batch.chunk import ChunkSolver
from softnlp.batch.plan import Plan
from softnlp.model.quantities import Model
from softnlp.results import to_dataset, to_json
from softnlp.statics.body import Fit, fit_of, overlapping
from softnlp.statics.loadcase import rod_functions
from softnlp.statics.reduced import larger_curvature


def helix(turn: float, radius: float, pitch: float = 0.0, points: int = 61) -> tuple[np.ndarray, np.ndarray]:
    """Return positions and rotations of a helix, or without pitch a circle, over an angle [rad]."""
    t, rise = np.linspace(0, turn, points), pitch / (2 * np.pi)
    position = np.column_stack([radius * np.cos(t), radius * np.sin(t), rise * t])
    tangent = np.column_stack([-radius * np.sin(t), radius * np.cos(t), np.full(points, rise)])
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    inwards = np.column_stack([-np.cos(t), -np.sin(t), 0 * t])
    return position, np.stack([inwards, np.cross(tangent, inwards), tangent], axis=2)


def random_rod(rng: np.random.Generator, length: float, points: int = 601) -> tuple[np.ndarray, np.ndarray]:
    """Return a rod of smooth random curvature, at most 0.2 to 0.97, as a chain of screws."""
    s = np.linspace(0, 1, points - 1)
    waves = [rng.normal(size=3) * np.cos(m * np.pi * s + rng.uniform(0, 6))[:, None] / (1 + m) for m in range(4)]
    u = sum(waves) * [1, 1, 0.5]
    u *= rng.uniform(0.2, 0.97) / np.hypot(u[:, 0], u[:, 1]).max()
    step = length / (points - 1)
    position, rotation = np.zeros((points, 3)), np.tile(np.eye(3), (points, 1, 1))
    for k, w in enumerate(u * step):
        angle = np.linalg.norm(w)
        W = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        half = np.eye(3) + W / 2 + W @ W / 8  # of a small turn
        full = np.eye(3) + np.sin(angle) / angle * W + (1 - np.cos(angle)) / angle**2 * W @ W
        position[k + 1] = position[k] + step * (rotation[k] @ half)[:, 2]
        rotation[k + 1] = rotation[k] @ full
    return position, rotation


def has_a_point_twice(position: np.ndarray, rotation: np.ndarray, rng: np.random.Generator) -> bool:
    """Whether one of many random points of a body of radius 1 lies in another part of it as well."""
    count, last = 6000, len(position) - 1
    k = np.concatenate([np.zeros(count // 4, int), np.full(count // 4, last), rng.integers(0, last + 1, count // 2)])
    angle, r = rng.uniform(0, 2 * np.pi, count), 0.999 * np.sqrt(rng.uniform(0, 1, count))
    points = position[k] + r[:, None] * (
        np.cos(angle)[:, None] * rotation[k, :, 0] + np.sin(angle)[:, None] * rotation[k, :, 1]
    )
    axis = rotation[:, :, 2]
    ahead = points @ axis.T - (position * axis).sum(axis=1)
    point, at = np.nonzero((ahead[:, :-1] >= 0) & (ahead[:, 1:] < 0))
    part = (ahead[point, at] / (ahead[point, at] - ahead[point, at + 1]))[:, None]
    centre = position[at] + part * (position[at + 1] - position[at])
    inside = np.linalg.norm(points[point] - centre, axis=1) < 0.999
    length = np.linalg.norm(np.diff(position, axis=0), axis=1).sum()
    elsewhere = np.abs(at - k[point]) > 2 * last / length
    return bool((inside & elsewhere).any())


@pytest.mark.parametrize("radius", [1.05, 1.5, 3.0, 10.0])
@pytest.mark.parametrize("turn", [170, 300, 340, 359, 361, 413, 800])
def test_a_circle_meets_itself_after_a_whole_turn(radius: float, turn: float) -> None:
    fit = fit_of(*helix(turn * DEGREE, radius), 1.0)
    assert fit.tightness == pytest.approx(1 / radius)
    assert fit.overlaps == fit.self_intersecting == (turn > 360)


@pytest.mark.parametrize("pitch", [0.5, 1.97, 1.99, 2.02, 2.2, 6.0])
def test_turns_of_a_helix_meet_where_they_are_less_than_two_radii_apart(pitch: float) -> None:
    t = np.linspace(3, 9, 20001)
    apart = np.sqrt((10 * np.sin(t / 2)) ** 2 + (pitch / (2 * np.pi) * t) ** 2).min()
    assert fit_of(*helix(1000 * DEGREE, 5.0, pitch), 1.0).overlaps == (apart < 2)


def test_a_straight_body_fits() -> None:
    position = np.column_stack([np.zeros((61, 2)), np.linspace(0, 50, 61)])
    assert fit_of(position, np.tile(np.eye(3), (61, 1, 1)), 1.0) == Fit(0.0, False)


def test_an_axis_that_runs_backwards_has_negative_length() -> None:
    """Also straight, without any curvature, and where it only stands still on the way."""
    height = np.linspace(0, 50, 61)
    for z in (-height, np.where(height < 25, height, 50 - height), np.minimum(height, 25)):
        fit = fit_of(np.column_stack([np.zeros((61, 2)), z]), np.tile(np.eye(3), (61, 1, 1)), 1.0)
        assert fit.inside_out
        assert fit.self_intersecting
        assert "negative length" in fit.warnings[0]


@pytest.mark.parametrize("tightness", [1e2, 1e3, 4e300, np.inf])
def test_a_warning_is_short_whatever_the_curvature(tightness: float) -> None:
    assert all(len(words) < 200 for words in Fit(tightness, False).warnings)


@pytest.mark.parametrize(
    ("force", "inside_out"), [((0, 0, -20.0), False), ((0, 0, -100.0), True), ((5.0, 0, -60.0), True)]
)
def test_a_rod_turned_inside_out_is_never_stable(force: tuple[float, float, float], inside_out: bool) -> None:
    short = replace(robot("D25L60"), length=8e-3)
    silicone, loads = material("Ecoflex 00-50"), Loads(tip_force=force)
    run = forward(short, silicone, [[0.0, 0, 0]], loads=loads)
    pose = run.steps[0].pose
    assert pose is not None
    assert (pose.shape.shear_extension[:, 2].min() <= 0) == inside_out
    told = to_json(run)["steps"][0]
    assert (told["stable"], told["self_intersecting"]) == ((None, True) if inside_out else (True, False))
    assert any("(v_z <= 0); the model" in words for words in run.steps[0].warnings) == inside_out
    assert any("(v_z)" in words for words in run.steps[0].warnings) == (not inside_out)
    rows = (
        ChunkSolver(
            Plan(Model(short, silicone), loads, Numerics(), None, ("pressure",), np.zeros((1, 3)), np.arange(1))
        )
        .solve(0)
        .rows
    )
    assert (rows["stable"][0], rows["self_intersecting"][0]) == ((-1, 1) if inside_out else (1, 0))
    if force == (0, 0, -100.0):
        found = inverse(short, silicone, positions=[pose.tip_position], bounds=(0.0, 0.1 * BAR), loads=loads).steps[0]
        assert found.status is Status.OUT_OF_REACH


def test_many_poses_at_once_know_an_axis_that_runs_backwards() -> None:
    """By nodes: the curvature is infinite where v_z <= 0, without any bend too, and that of the axis elsewhere."""
    functions = rod_functions(Model(robot("D25L60"), material("Ecoflex 00-50")))
    x, c = ca.SX.sym("x", 18), ca.SX.sym("c", functions.field.size1_in(1))
    largest = ca.Function("largest", [x, c], [larger_curvature(functions, ca.SX(0), [x], c)])
    column = np.concatenate([q.nominal for q in functions.declared().values()])
    constants, _, _ = functions.section(column, 1.0)
    state = np.asarray(functions.arc(column, 1.0, 0.5)).ravel()
    axial = float(constants[1])  # EA over EI / L_0^2
    for part, moment in ((0.0, 0.5), (0.9, 0.5), (1.1, 0.5), (1.1, 0.0)):
        state[14], state[15] = -part * axial, moment
        found = float(largest(state, constants))
        bend = moment / float(constants[2])
        assert found == (np.inf if part > 1 else pytest.approx(bend / (1 - part), rel=1e-9))


def test_a_wall_that_presses_a_robot_through_itself_leaves_no_stable_shape() -> None:
    contact = ContactSettings(wall_point=(0, 0, 8e-3), wall_normal=(0, 0, -1), closure="free")
    short = replace(robot("D25L60"), length=8e-3)
    step = force_against_offset(short, material("Ecoflex 00-50"), [0.1 * BAR] * 3, [9e-3], contact).steps[0]
    assert step.pose is not None
    assert step.pose.fit.inside_out
    assert step.pose.stable is None


@pytest.mark.parametrize("tightness", [0.89, 0.9, 0.99, 1.0, 1.14])
def test_a_bend_is_told_of_before_it_is_impossible(tightness: float) -> None:
    fit = Fit(tightness, False)
    assert fit.self_intersecting == (tightness >= 1)
    assert bool(fit.warnings) == (tightness >= 0.9)
    assert any("negative length" in words for words in fit.warnings) == (tightness >= 1)


def test_random_bodies_agree_with_a_count_of_their_points() -> None:
    rng = np.random.default_rng(5)
    rods = [random_rod(rng, rng.uniform(8, 40), 401) for _ in range(16)]
    told = [has_a_point_twice(*rod, rng) for rod in rods]
    some = slice(0, None, 10)
    found = [fit_of(position[some], rotation[some], 1.0).overlaps for position, rotation in rods]
    assert found == told
    assert {*told} == {True, False}
    together = overlapping(
        np.array([position[some] for position, _ in rods]),
        np.array([rotation[some, :, 2] for _, rotation in rods]),
        np.ones(len(rods)),
    )
    np.testing.assert_array_equal(together, told)


def test_a_pose_is_judged_by_its_deformed_body() -> None:
    body = replace(robot("D25L60"), outer_diameter=14e-3, lumen_diameter=5e-3)
    body = replace(body, chamber_circle_diameter=9.5e-3, chamber_diameter=2e-3)
    run = forward(body, material("Ecoflex 00-30"), [[0, 0, 0], [2.2 * BAR, 0, 0]])
    for step in run.steps:
        assert step.pose is not None
        shape = step.pose.shape
        kappa = np.hypot(shape.curvature[:, 0], shape.curvature[:, 1])
        assert step.pose.fit.tightness == pytest.approx(float(kappa.max()) * step.pose.radii.outer)
        assert step.pose.fit.overlaps == (step.pose.bending_angle > 2 * np.pi)  # an arc
        assert set(step.pose.fit.warnings) <= set(step.warnings)
    flags = [step["self_intersecting"] for step in to_json(run)["steps"]]
    assert flags == [False, True]
    assert to_dataset(run)["self_intersecting"].values.tolist() == [0, 1]


def test_an_unsolved_step_says_neither() -> None:
    run = forward(robot("D25L60"), material("Ecoflex 00-50", "ogden"), [100 * BAR, 0, 0])
    assert to_json(run)["steps"][0]["self_intersecting"] is None
    assert to_dataset(run)["self_intersecting"].values.tolist() == [-1]


def test_the_measured_angle_of_a_thin_robot_passes_through_itself() -> None:
    """The two sets of D10L60 were measured at 413 degrees: a whole turn and more in a plane."""
    stretch = 1.57  # where the calibrated model bends as far
    length, outer = 60e-3 * stretch, 5e-3 * stretch**-0.5
    fit = fit_of(*helix(413 * DEGREE, length / (413 * DEGREE)), outer)
    assert fit.self_intersecting
    assert fit.tightness < 0.4
