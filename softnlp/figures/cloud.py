"""Which poses of a cloud are drawn, how large, and its outlines: what a workspace figure is made of. Lengths in mm."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softnlp.sweep.boundary import alpha_shape, convex_hull, thinned

Array = NDArray[np.float64]
Index = NDArray[np.int64]

MOST_SHOWN = 20_000  # of a panel
MOST_OUTLINED = 4_000
LARGEST_MARK, SMALLEST_MARK = 26.0, 1.6  # area of a marker [pt^2]

# The two axes of a projection and the line of sight, with the sign of the side that it is seen from.
VIEWS = ((0, 1, 2, 1.0), (0, 2, 1, -1.0), (1, 2, 0, 1.0))


@dataclass(frozen=True, eq=False)
class Outline:
    """Closed lines round a projected cloud. boundary, hull : (edges, 2, 2)."""

    boundary: Array
    hull: Array


def shown(points: Array, most: int = MOST_SHOWN) -> Index:
    """Return which points are drawn: all, or the first in each cell of a grid."""
    return thinned(points, most)


def seen(points: Array, view: tuple[int, int, int, float], most: int = MOST_SHOWN) -> Index:
    """Return which points a projection draws, the farthest from the viewer first.

    Where there are more than `most`, the one nearest to the viewer in each cell of a grid over the projection.
    """
    first, second, sight, side = view
    front = np.argsort(-side * points[:, sight], kind="stable")
    kept = front[thinned(points[front][:, [first, second]], most)]
    return np.asarray(kept[np.argsort(side * points[kept, sight], kind="stable")])


def mark_size(count: int, area: float) -> float:
    """Return the area [pt^2] of markers that leave so many readable on a panel of so many pt^2."""
    return float(np.clip(0.45 * area / max(count, 1), SMALLEST_MARK, LARGEST_MARK))


def outline(points: Array, view: tuple[int, int, int, float], parameters: int) -> Outline:
    """Return the concave boundary and the convex hull of a projected cloud."""
    flat = np.zeros((len(points), 3))
    flat[:, :2] = points[:, list(view[:2])]
    flat = flat[thinned(flat[:, :2], MOST_OUTLINED)]
    edges = []
    for body in (alpha_shape(flat, parameters=parameters), convex_hull(flat, parameters)):
        edges.append(body.vertices[body.facets][:, :, :2] if body.facets.shape[1] == 2 else np.zeros((0, 2, 2)))
    return Outline(*edges)
