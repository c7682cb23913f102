"""Tilts and directions at places where they are known."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.figure import Figure

from softnlp.base.errors import InputError
from softnlp.base.units import DEGREE
from softnlp.figures.workspace import dexterity_figure
from softnlp.sweep.dexterity import dexterity, nearest_direction, seen_along, spread_directions

UP = np.array([0.0, 0.0, 1.0])


def cone(tilt: float, count: int) -> np.ndarray:
    """Return axes at one tilt, all round."""
    around = np.linspace(0, 2 * pi, count, endpoint=False)
    return np.column_stack([np.sin(tilt) * np.cos(around), np.sin(tilt) * np.sin(around), np.full(count, np.cos(tilt))])


def test_directions_share_the_sphere_evenly() -> None:
    lattice = spread_directions(400)
    assert np.linalg.norm(lattice, axis=1) == pytest.approx(np.ones(400))
    many = np.random.default_rng(0).normal(size=(400_000, 3))
    counts = np.bincount(nearest_direction(many / np.linalg.norm(many, axis=1)[:, None], lattice), minlength=400)
    assert counts.std() / counts.mean() < 0.06  # 3 % of it is chance


def test_two_places_keep_their_own_tilts() -> None:
    positions = np.array([[0.5, 0.5, 0.5]] * 3 + [[2.5, 0.5, -0.5]] * 2)
    axes = np.vstack([cone(0.1, 1), cone(0.4, 1), cone(0.3, 1), cone(1.2, 1), cone(1.2, 1)])
    found = dexterity(positions, axes, voxel=1.0)
    assert sorted(found.poses.tolist()) == [2, 3]
    first = int(np.argmax(found.poses))
    assert found.centres[first] == pytest.approx([0.5, 0.5, 0.5])
    assert found.centres[1 - first] == pytest.approx([2.5, 0.5, -0.5])
    assert (found.lowest_tilt[first], found.highest_tilt[first]) == (pytest.approx(0.1), pytest.approx(0.4))
    assert found.tilt_range[1 - first] == pytest.approx(0.0, abs=1e-12)
    assert found.coverage[1 - first] == pytest.approx(1 / found.directions)
    assert found.volume == pytest.approx(2.0)


@pytest.mark.parametrize("half_angle", [0.5, 1.5, pi])
def test_a_filled_cone_of_directions_covers_its_solid_angle(half_angle: float) -> None:
    """A spherical cap takes (1 - cos a) / 2 of the sphere."""
    rng = np.random.default_rng(2)
    z = 1 - rng.random(60_000) * (1 - np.cos(half_angle))
    around = 2 * pi * rng.random(60_000)
    axes = np.column_stack([np.sqrt(1 - z**2) * np.cos(around), np.sqrt(1 - z**2) * np.sin(around), z])
    found = dexterity(np.zeros((60_000, 3)), axes, resolution=4 * DEGREE)
    assert found.coverage[0] == pytest.approx((1 - np.cos(half_angle)) / 2, abs=0.03)
    assert found.overall == found.coverage[0]
    assert found.highest_tilt[0] == pytest.approx(half_angle, abs=0.03)
    assert found.directions * found.resolution**2 == pytest.approx(4 * pi)


@given(st.integers(0, 1000), st.floats(0.05, 0.5))
@settings(max_examples=20, deadline=None)
def test_every_pose_is_counted_once_whatever_the_voxel(seed: int, voxel: float) -> None:
    rng = np.random.default_rng(seed)
    positions, tilts = rng.random((80, 3)) - 0.5, rng.random(80) * pi
    axes = np.vstack([cone(tilt, 1) for tilt in tilts])
    found = dexterity(positions, axes, voxel)
    assert found.poses.sum() == 80
    assert len(np.unique(found.voxel, axis=0)) == len(found.voxel)
    assert found.lowest_tilt.min() == pytest.approx(tilts.min(), abs=1e-7)
    assert found.highest_tilt.max() == pytest.approx(tilts.max(), abs=1e-7)
    assert found.overall >= found.coverage.max()
    assert np.all(found.coverage * found.directions <= found.poses + 1e-9)
    # voxels hold their poses
    offset = np.abs(positions[:, None] - found.centres[None]).max(axis=2).min(axis=1)
    assert offset.max() <= voxel / 2 * (1 + 1e-9)


def test_the_map_shows_the_largest_along_the_line_of_sight() -> None:
    positions = np.array([[0.5, 0.5, 0.5], [0.5, 0.5, 3.5], [2.5, 0.5, 0.5]])
    found = dexterity(positions, np.vstack([cone(0.2, 1), cone(0.9, 1), cone(0.4, 1)]), voxel=1.0)
    x, y, seen = seen_along(found, found.highest_tilt, 2)
    assert x == pytest.approx([0, 1, 2, 3])
    assert y == pytest.approx([0, 1])
    assert seen[:, 0] == pytest.approx([0.9, np.nan, 0.4], nan_ok=True)
    seen = seen_along(found, found.highest_tilt, 1)[2]
    assert seen.shape == (3, 4)
    assert (seen[0, 0], seen[0, 3], seen[2, 0]) == pytest.approx((0.2, 0.9, 0.4))


@pytest.mark.parametrize("wrong", [{"voxel": 0.0}, {"voxel": -1.0}, {"resolution": float("nan")}, {"voxel": 1e-9}])
def test_impossible_grids_are_refused(wrong: dict[str, float]) -> None:
    positions = np.array([[0.0, 0, 0], [1e3, 1e3, 1e3]])
    with pytest.raises(InputError, match=next(iter(wrong))):
        dexterity(positions, np.vstack([UP, UP]), **wrong)


def test_no_pose_is_refused_and_one_is_enough() -> None:
    with pytest.raises(InputError, match="at least one solved pose"):
        dexterity(np.zeros((0, 3)), np.zeros((0, 3)))
    found = dexterity(np.zeros((1, 3)), UP[None])
    assert (len(found.voxel), found.poses[0], found.tilt_range[0]) == (1, 1, 0)


def test_the_figure_shows_the_maps() -> None:
    rng = np.random.default_rng(5)
    found = dexterity(rng.random((500, 3)) * 0.05, np.vstack([cone(t, 1) for t in rng.random(500)]))
    figure = dexterity_figure(found, "a test", "D25L60")
    assert isinstance(figure, Figure)
    maps = [m for a in figure.axes for m in a.collections if m.get_label() == "range of tilts [deg]"]
    assert len(maps) == 3
    largest = max(float(np.nanmax(m.get_array())) for m in maps)
    assert largest == pytest.approx(found.tilt_range.max() / DEGREE)
    labels = {a.get_xlabel() for a in figure.axes} | {a.get_ylabel() for a in figure.axes}
    assert {"x [mm]", "y [mm]", "z [mm]", "highest tilt [deg]", "directions taken [%]"} <= labels
    dexterity_figure(dexterity(np.zeros((1, 3)), UP[None]), "one pose", "D25L60").canvas.draw()
