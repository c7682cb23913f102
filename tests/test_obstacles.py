"""Obstacles as solids: exact distances, and what cannot be one."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from softnlp.base.errors import InputError
from softnlp.model.obstacle_distance import signed_distance
from softnlp.model.obstacle_tables import obstacle_tables, obstacles_of_tables
from softnlp.model.obstacles import Capsule, Cylinder, Obstacle, Plane, Sphere, Trocar, Tube

EVERY: list[Obstacle] = [
    Plane(point=(0.1, 0, 0), normal=(1, 0, 0)),
    Sphere(centre=(0.2, -0.1, 0.3), radius=0.4),
    Cylinder(start=(0, 0, -0.5), end=(0, 0, 0.5), radius=0.3),
    Capsule(start=(0, 0, -0.5), end=(0, 0, 0.5), radius=0.3),
    Tube(start=(0, 0, -0.5), end=(0, 0, 0.5), radius=0.3),
    Trocar(point=(0, 0, 0), axis=(0, 0, 2), radius=0.3, length=1.0),
]


def at(obstacle: Obstacle, point: tuple[float, float, float]) -> float:
    return float(signed_distance(obstacle, ca.DM(point), ca.DM(obstacle.numbers)))


@pytest.mark.parametrize(
    ("k", "point", "distance"),
    [
        *((0, (0.5, 3, 1), 0.4), (0, (-0.2, 0, 0), -0.3), (1, (0.2, -0.1, 1.0), 0.3), (1, (0.2, 0.1, 0.3), -0.2)),
        *((2, (0.5, 0, 0), 0.2), (2, (0, 0.1, 0.9), 0.4), (2, (0.6, 0, 0.9), 0.5), (2, (0.1, 0, 0.45), -0.05)),
        *((3, (0.5, 0, 0.2), 0.2), (3, (0.3, 0, 0.9), 0.2), (3, (0, 0.1, 0), -0.2)),
        *((4, (0.1, 0, 0.2), 0.2), (4, (0.6, 0, 0.9), 0.4), (4, (0.1, 0, 0.9), 0.2**0.5), (4, (0.4, 0, 0.1), -0.1)),
        (5, (0.1, 0, 0.2), 0.2),
    ],
)
def test_distances_are_those_of_the_solids(k: int, point: tuple[float, float, float], distance: float) -> None:
    assert at(EVERY[k], point) == pytest.approx(distance, abs=1e-7)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 5), st.tuples(*[st.floats(-2, 2)] * 3), st.tuples(*[st.floats(-2, 2)] * 3))
def test_a_distance_changes_by_no_more_than_the_point_moves(k: int, a: tuple, b: tuple) -> None:
    moved = float(np.linalg.norm(np.subtract(a, b)))
    assert abs(at(EVERY[k], a) - at(EVERY[k], b)) <= moved * (1 + 1e-9) + 4e-5  # rounded at axes and centres


def test_tables_there_and_back() -> None:
    again = obstacles_of_tables(obstacle_tables(EVERY))
    for one, other in zip(EVERY, again, strict=True):
        assert type(one) is type(other)
        assert other.numbers == pytest.approx(one.numbers, abs=1e-15)


@pytest.mark.parametrize(
    ("table", "key", "said"),
    [
        ({"kind": "ball", "radius_mm": 1.0}, "kind", "expected one of plane"),
        ({"kind": "sphere", "radius_mm": 1.0}, "centre_mm", "missing; a sphere takes centre_mm, radius_mm"),
        ({"kind": "sphere", "centre_mm": [0, 0, 0], "radius_mm": 0.0}, "radius_mm", "above 0"),
        ({"kind": "plane", "point_mm": [0, 0, 0], "normal": [0, 0, 0]}, "normal", "got zeros"),
        ({"kind": "plane", "point_mm": [0, 0], "normal": [0, 0, 1]}, "point_mm", "3 finite numbers"),
        (
            {"kind": "plane", "point_mm": [0, 0, 0], "normal": [1, 0, 0], "radius_mm": 3},
            "radius_mm",
            "a plane has none",
        ),
        ({"kind": "tube", "from_mm": [0, 0, 1], "to_mm": [0, 0, 1], "radius_mm": 3}, "to_mm", "two different points"),
        ({"kind": "sphere", "centre_mm": [0, 0, 9], "radius_mm": 1, "part": "tip rim"}, "part", "a plane only"),
        ({"kind": "sphere", "centre_mm": [0, 0, 9], "radius_mm": 1, "part": "foot"}, "part", "expected one of body"),
    ],
)
def test_what_is_no_obstacle_is_refused_by_its_key(table: dict, key: str, said: str) -> None:
    with pytest.raises(InputError, match=said) as refused:
        obstacles_of_tables([{"kind": "plane", "point_mm": [0, 0, 0], "normal": [0, 0, 1]}, table])
    assert (refused.value.table, refused.value.key) == ("obstacle.2", key)
