"""Hull, alpha shape and reach of clouds whose volume, area and extent are known."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softnlp.base.errors import InputError
from softnlp.sweep.boundary import WIDENING, Extent, alpha_shape, convex_hull, reach, thinned

RNG = np.random.default_rng(4)


def directions(n: int) -> np.ndarray:
    v = RNG.normal(size=(n, 3))
    return np.asarray(v / np.linalg.norm(v, axis=1)[:, None])


def shell(n: int, inner: float) -> np.ndarray:
    """Return points spread evenly between radius `inner` and 1."""
    return directions(n) * (inner**3 + (1 - inner**3) * RNG.random((n, 1))) ** (1 / 3)


def lattice(n: int) -> np.ndarray:
    return np.stack(np.meshgrid(*[np.linspace(0, 1, n)] * 3), axis=-1).reshape(-1, 3)


def turn(angle: float) -> np.ndarray:
    """Return a rotation about a skew axis."""
    x, y, z = np.array([1.0, 2.0, -0.5]) / np.sqrt(5.25)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K)


CUBE = lattice(9)


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_a_cube_of_grid_points_is_exact(angle: float) -> None:
    """Grid points lie on common spheres, which makes flat simplices."""
    cube = CUBE @ turn(angle).T * 0.04
    for body in (convex_hull(cube), alpha_shape(cube)):
        assert body.extent is Extent.SOLID
        assert body.volume == pytest.approx(0.04**3, rel=1e-9)
        assert body.area == pytest.approx(6 * 0.04**2, rel=1e-9)
    assert convex_hull(cube).radius is None
    assert alpha_shape(cube).outside == 0
    # half the space diagonal of a cell takes in every point; the default is wider
    assert alpha_shape(cube).radius == pytest.approx(WIDENING * 0.04 / 8 * 3**0.5 / 2, rel=1e-6)


def test_a_ball_is_approached_from_within() -> None:
    volumes = [alpha_shape(shell(n, 0.0)).volume for n in (500, 8000)]
    assert volumes[0] < volumes[1] < 4 / 3 * pi
    assert volumes[1] == pytest.approx(4 / 3 * pi, rel=0.11)
    ball = directions(3000)
    assert convex_hull(ball).volume == pytest.approx(4 / 3 * pi, rel=0.01)
    assert convex_hull(ball).area == pytest.approx(4 * pi, rel=0.01)


def test_the_hollow_of_a_shell_is_outside() -> None:
    cloud = shell(6000, 0.6)
    full, found = convex_hull(cloud), alpha_shape(cloud)
    assert full.volume > 0.93 * 4 / 3 * pi
    assert found.volume == pytest.approx(4 / 3 * pi * (1 - 0.6**3), rel=0.16)
    assert found.area == pytest.approx(4 * pi * (1 + 0.36), rel=0.1)
    # a radius as wide as the hollow fills it
    assert alpha_shape(cloud, 2.0).volume > 0.93 * 4 / 3 * pi


def test_a_notch_is_outside_and_the_area_counts_it() -> None:
    cloud = lattice(17) * 4  # a quarter out of a block, in whole cells
    cloud = cloud[~((cloud[:, 0] > 2.01) & (cloud[:, 1] > 2.01))]
    found = alpha_shape(cloud, 0.3)
    # the sphere does not reach into the corner: half a cell stays over it
    assert found.volume == pytest.approx(48.0 + 4 * 0.25**2 / 2, rel=1e-9)
    assert convex_hull(cloud).volume == pytest.approx(64 - 8, rel=1e-9)


def test_a_few_stray_points_do_not_fill_the_hollow() -> None:
    cloud = np.vstack([shell(6000, 0.6), [[0, 0, 1.5], [0.1, 0, -1.4], [0, 0, 0.05]]])
    found = alpha_shape(cloud)
    assert found.volume == pytest.approx(4 / 3 * pi * (1 - 0.6**3), rel=0.16)
    assert found.outside >= 3
    assert alpha_shape(cloud, 3.0).outside == 0


def test_a_closed_surface_has_the_facets_of_a_body() -> None:
    found = alpha_shape(shell(1500, 0.5))
    edges = np.sort(np.concatenate([found.facets[:, [0, 1]], found.facets[:, [1, 2]], found.facets[:, [0, 2]]]), axis=1)
    _, count = np.unique(edges, axis=0, return_counts=True)
    assert np.all(count % 2 == 0)
    corners = found.vertices[found.facets]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    assert areas.sum() == pytest.approx(found.area, rel=1e-12)


@given(angle=st.floats(0.0, 6.0), size=st.floats(1e-3, 1e3), shift=st.floats(-10.0, 10.0))
@settings(max_examples=12, deadline=None)
def test_bodies_turn_move_and_grow_with_their_points(angle: float, size: float, shift: float) -> None:
    cloud = np.random.default_rng(1).random((300, 3)) ** [1, 2, 3]
    first, moved = alpha_shape(cloud), alpha_shape(size * (cloud @ turn(angle).T + shift))
    assert moved.volume == pytest.approx(first.volume * size**3, rel=1e-6)
    assert moved.area == pytest.approx(first.area * size**2, rel=1e-6)
    assert first.volume <= convex_hull(cloud).volume


# --- clouds that fill no volume ---


def test_a_disc_and_a_ring_have_an_area_alone() -> None:
    angle, radius = 2 * pi * RNG.random(4000), np.sqrt(RNG.random(4000))
    disc = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle]) @ turn(0.4).T + [1, 2, 3]
    for found in (convex_hull(disc), alpha_shape(disc)):
        assert found.extent is Extent.FLAT
        assert found.volume == 0
        assert found.area == pytest.approx(pi, rel=0.06)
        assert found.length > 0.98 * 2 * pi
        assert found.facets.shape[1] == 2
        # the corners are the points themselves, in space
        assert np.linalg.norm(found.vertices - [1, 2, 3], axis=1).max() <= 1 + 1e-9
    ring = disc[radius > 0.7]
    assert alpha_shape(ring, 0.2).area == pytest.approx(pi * (1 - 0.49), rel=0.08)
    assert convex_hull(ring).area == pytest.approx(pi, rel=0.03)


@pytest.mark.parametrize(
    ("points", "extent", "length"),
    [
        (np.outer(np.linspace(0, 2, 7), [0.6, 0.0, 0.8]), Extent.LINE, 2.0),
        (np.array([[1.0, 2.0, 3.0], [1.0, 2.0, 4.0]]), Extent.LINE, 1.0),
        (np.full((4, 3), 0.05), Extent.POINT, 0.0),
        (np.zeros((1, 3)), Extent.POINT, 0.0),
        (np.zeros((0, 3)), Extent.EMPTY, 0.0),
    ],
)
def test_less_than_a_plane_is_named(points: np.ndarray, extent: Extent, length: float) -> None:
    for found in (convex_hull(points), alpha_shape(points)):
        assert found.extent is extent
        assert (found.volume, found.area) == (0, 0)
        assert found.length == pytest.approx(length)
        assert extent.meaning


def test_a_surface_and_a_curve_in_space_have_no_boundary() -> None:
    angle = np.linspace(0, 2, 50)
    curve = np.column_stack([np.cos(angle), np.sin(angle), angle])
    found = alpha_shape(curve, parameters=1)
    assert (found.extent, found.volume, found.area) == (Extent.CURVE, 0, 0)
    cap = directions(400)
    found = alpha_shape(cap, parameters=2)
    assert (found.extent, found.volume, found.area) == (Extent.SURFACE, 0, 0)
    hull = convex_hull(cap, 2)
    assert hull.extent is Extent.SURFACE
    assert hull.volume == pytest.approx(4 / 3 * pi, rel=0.1)
    assert alpha_shape(cap * [1, 1, 0], parameters=2).extent is Extent.FLAT


@pytest.mark.parametrize("points", [np.eye(3), np.vstack([np.zeros(3), np.eye(3)])])
def test_the_fewest_points_make_one_simplex(points: np.ndarray) -> None:
    found = alpha_shape(points)
    if len(points) == 3:
        assert (found.extent, found.area) == (Extent.FLAT, pytest.approx(3**0.5 / 2))
    else:
        assert (found.extent, found.volume) == (Extent.SOLID, pytest.approx(1 / 6))


def test_points_given_twice_change_nothing() -> None:
    cloud = RNG.random((200, 3))
    assert alpha_shape(np.vstack([cloud, cloud])).volume == pytest.approx(alpha_shape(cloud).volume, rel=1e-12)


# --- reach and thinning ---


def test_reach_of_known_points() -> None:
    found = reach(np.array([[3.0, 4.0, 0.0], [0.0, 1.0, 7.0], [0.6, 0.8, -2.0]]))
    assert (found.nearest_to_axis, found.farthest_from_axis) == (pytest.approx(1.0), 5.0)
    assert (found.lowest, found.highest) == (-2.0, 7.0)
    assert (found.nearest_to_base, found.farthest_from_base) == (pytest.approx(5**0.5), pytest.approx(50**0.5))
    assert np.isnan(reach(np.zeros((0, 3))).highest)


@pytest.mark.parametrize("dimension", [2, 3])
def test_thinning_keeps_the_outline_and_the_first_of_each_cell(dimension: int) -> None:
    cloud = RNG.random((50_000, 3))[:, :dimension]
    kept = thinned(cloud, 2000)
    assert 1000 < len(kept) <= 2000
    assert np.array_equal(kept, thinned(cloud, 2000))
    assert np.all(np.diff(kept) > 0)
    assert np.ptp(cloud[kept], axis=0) == pytest.approx(np.ptp(cloud, axis=0), abs=2 * len(kept) ** (-1 / dimension))
    assert np.array_equal(thinned(cloud[:10], 2000), np.arange(10))
    assert len(thinned(np.zeros((5000, 3)), 100)) == 1


def test_a_thinned_cloud_has_the_volume_of_the_whole() -> None:
    cloud = shell(30_000, 0.5)
    part = alpha_shape(cloud, most=5000)
    assert part.points <= 5000
    assert part.volume == pytest.approx(4 / 3 * pi * (1 - 0.125), rel=0.16)


def test_a_radius_that_leaves_everything_out_is_refused() -> None:
    with pytest.raises(InputError, match=r"expected a radius of at least 0\.00354 m") as caught:
        alpha_shape(CUBE * 0.04, 1e-9)
    assert caught.value.key == "radius"
