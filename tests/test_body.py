"""Whether a body can take a shape: closed forms of arcs and helices, and a count of the parts that a point lies in."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from softnlp import BAR, DEGREE, forward, material, robot
from softnlp.results import to_dataset, to_json
from softnlp.statics.body import Fit, fit_of, overlapping


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
