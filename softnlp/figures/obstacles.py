"""Obstacles in a figure in 3-D: clear surfaces to scale beside the robot."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from softnlp.base.arrays import Array
from softnlp.base.units import MILLIMETRE
from softnlp.figures.body import frame
from softnlp.figures.space import draw_faces
from softnlp.model.obstacles import Capsule, Cylinder, Obstacle, Plane, Sphere, Trocar, Tube

COLOUR, TINT = "#56B4E9", 0.2
_SIDES, _RINGS = 32, 12
_PLANE = 1.1  # half the side of the piece of a plane that is drawn, of the robot's length
_CLEAR = [(0.0, 0.0, 0.0, 0.0)]


def draw_obstacles(axes: Any, obstacles: Sequence[Obstacle], length: float) -> None:
    """Draw obstacles and make room for them. length : of the robot [m]."""
    reach = [np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()]).T]
    for obstacle in obstacles:
        faces = surface(obstacle, length) / MILLIMETRE
        draw_faces(axes, faces, COLOUR, width=0.0, alpha=TINT, zorder=3, label="obstacle")
        if isinstance(obstacle, Plane):
            draw_faces(axes, faces, _CLEAR, COLOUR, 1.0, zorder=3.1)
        reach.append(faces.reshape(-1, 3))
    frame(axes, np.vstack(reach))


def surface(obstacle: Obstacle, length: float) -> Array:
    """Return quadrilaterals (n, 4, 3) of an obstacle's surface [m]; of a plane a piece as large as the robot."""
    if isinstance(obstacle, Plane):
        n = np.array(obstacle.normal)
        middle = np.array([0.0, 0.0, length / 2])
        middle = middle - n * float((middle - np.array(obstacle.point)) @ n)
        a, b = _across(n)
        half = _PLANE * length
        return np.array([[middle + half * (i * a + j * b) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]])
    if isinstance(obstacle, Sphere):
        turn = np.linspace(0, np.pi, _RINGS + 1)
        profile = np.column_stack([np.sin(turn), np.cos(turn)]) * obstacle.radius
        return _turned(np.array(obstacle.centre), np.array([0.0, 0.0, 1.0]), profile)
    assert isinstance(obstacle, Cylinder | Capsule | Tube | Trocar)
    numbers = np.array(obstacle.numbers)
    start, end, radius = numbers[:3], numbers[3:6], numbers[6]
    size = float(np.linalg.norm(end - start))
    profile = np.array([[radius, 0.0], [radius, size]])
    if isinstance(obstacle, Cylinder):
        profile = np.array([[0.0, 0.0], [radius, 0.0], [radius, size], [0.0, size]])
    if isinstance(obstacle, Capsule):
        turn = np.linspace(0, np.pi / 2, _RINGS // 2 + 1)
        cap = np.column_stack([np.sin(turn), -np.cos(turn)]) * radius
        profile = np.vstack([cap, cap[::-1] * [1, -1] + [0, size]])
    return _turned(start, (end - start) / size, profile)


def _across(axis: Array) -> tuple[Array, Array]:
    """Return two unit vectors at right angles to a unit vector and to each other."""
    other = np.eye(3)[int(np.argmin(np.abs(axis)))]
    a = np.cross(axis, other)
    a /= np.linalg.norm(a)
    return a, np.cross(axis, a)


def _turned(origin: Array, axis: Array, profile: Array) -> Array:
    """Return what a profile of radius and height (n, 2) becomes when it turns about an axis, ((n - 1) sides, 4, 3)."""
    a, b = _across(axis)
    angle = np.linspace(0, 2 * np.pi, _SIDES + 1)
    ring = np.cos(angle)[:, None] * a + np.sin(angle)[:, None] * b
    points = origin + profile[:, None, :1] * ring + profile[:, None, 1:] * axis
    quads = [points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]]
    return np.stack(quads, axis=2).reshape(-1, 4, 3)
