"""Obstacles as the 3-D view draws them: triangles, edges and a name, in millimetres."""

from __future__ import annotations

from typing import Any

import numpy as np

from softnlp.app.view.frame import packed
from softnlp.base.arrays import Array
from softnlp.base.units import MILLIMETRE
from softnlp.figures.obstacles import surface
from softnlp.model.obstacles import Obstacle, Plane, Sphere

_RINGS = 8  # of a round obstacle: every so many of its lines are drawn


def obstacle_message(obstacle: Obstacle, name: str, length: float) -> dict[str, Any]:
    """Return an obstacle as it goes to the browser. length : of the robot, as large as which a plane is drawn [m]."""
    quads = surface(obstacle, length) / MILLIMETRE
    triangles = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    lines = quads[:, [0, 1, 1, 2, 2, 3, 3, 0]] if isinstance(obstacle, Plane) else quads[::_RINGS][:, [1, 2, 3, 0]]
    return {
        "triangles": packed(triangles, np.float32),
        "edges": packed(lines.reshape(-1, 3), np.float32),
        "name": name,
        "flat": isinstance(obstacle, Plane),
        "at": [round(float(x), 3) for x in _named_at(obstacle, quads)],
    }


def _named_at(obstacle: Obstacle, quads: Array) -> Array:
    """Return where the name stands [mm]: at the middle of a ball, else at the top of the surface."""
    if isinstance(obstacle, Sphere):
        return np.asarray(obstacle.centre) / MILLIMETRE
    points = quads.reshape(-1, 3)
    highest: Array = points[np.argmax(points[:, 2])]
    return highest if isinstance(obstacle, Plane) else points.mean(axis=0)
