"""Figures in space: axes, faces and lines in 3-D, and clouds of tips with their outlines. Lengths in mm."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from softnlp.base.arrays import Array, Index
from softnlp.figures.style import GREY, INK, PALE, SMALL, TEXT, plain
from softnlp.sweep.boundary import alpha_shape, convex_hull, thinned

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_SHOWN = 20_000  # of a panel
MOST_OUTLINED = 4_000
LARGEST_MARK, SMALLEST_MARK = 26.0, 1.6  # area of a marker [pt^2]

# The two axes of a projection and the line of sight, with the sign of the side that it is seen from.
View = tuple[int, int, int, float]
VIEWS: tuple[View, ...] = ((0, 1, 2, 1.0), (0, 2, 1, -1.0), (1, 2, 0, 1.0))


# --- axes, faces and lines --------------------------------------------------------------------------------------------


def axes_3d(figure: Figure, place: tuple[float, float, float, float]) -> Any:
    """Return bare axes in 3-D at a place of a figure, which draw in the order that they are told."""
    axes: Any = figure.add_axes(place, projection="3d", computed_zorder=False)
    axes.patch.set_visible(False)
    axes.set_proj_type("ortho")
    return axes


def draw_faces(axes: Any, faces: Any, inside: Any, edges: Any = None, width: float = 0.4, **look: Any) -> None:
    """Draw polygons (n, corners, 3); their edges are of the same colour where no other is given."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    edges = inside if edges is None else edges
    axes.add_collection3d(Poly3DCollection(faces, facecolors=inside, edgecolors=edges, linewidths=width, **look))


def draw_lines(axes: Any, lines: Any, width: float, **look: Any) -> None:
    """Draw lines, each (points, 3)."""
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    axes.add_collection3d(Line3DCollection(lines, linewidths=width, **look))


def around(points: Array) -> tuple[Array, Array]:
    """Return the corners of a box round points (M, 3) with a margin."""
    low, high = points.min(axis=0), points.max(axis=0)
    margin = max(0.05 * float((high - low).max()), 1e-3)
    return low - margin, high + margin


def space_axes(
    figure: Figure,
    place: tuple[float, float, float, float],
    limits: tuple[Array, Array],
    zoom: float = 0.94,
    *,
    hanging: bool = False,
) -> Any:
    """Return axes in 3-D at a place of a figure, of one scale, between two corners (3,) [mm].

    hanging : whether the base is to be on top.
    """
    axes = axes_3d(figure, place)
    axes.view_init(**({"elev": -18, "azim": -122, "roll": 180} if hanging else {"elev": 18, "azim": -58}))
    low, high = limits
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low, zoom=zoom)
    plain_3d(axes)
    axes.tick_params(labelsize=SMALL, colors=INK)
    return axes


def plain_3d(axes: Any) -> tuple[Any, ...]:
    """Give axes in 3-D their labels and a pale grid on clear walls; return x, y and z."""
    every = (axes.xaxis, axes.yaxis, axes.zaxis)
    for axis, name in zip(every, "xyz", strict=True):
        axis.set_pane_color((1, 1, 1, 0))
        axis.line.set_color(GREY)
        axis._axinfo["grid"].update(color=PALE, linewidth=0.6)
        axis.set_label_text(f"{name} [mm]", size=TEXT, color=INK)
    return every


def view_axes(figure: Figure, place: tuple[float, float, float, float], view: View, *, titled: bool = True) -> Axes:
    """Return flat axes of a projection at a place of a figure; its title says from where it is seen."""
    first, second, sight, side = view
    axes = figure.add_axes(place)
    plain(axes, f"{'xyz'[first]} [mm]", f"{'xyz'[second]} [mm]")
    if titled:
        words = f"seen from {'+' if side > 0 else '−'}{'xyz'[sight]}"
        axes.set_title(words, size=SMALL, color=GREY, loc="left", pad=3)
    return axes


def colour_bar(
    figure: Figure, place: tuple[float, float, float, float], of: Any, label: str, *, upright: bool = False
) -> None:
    """Say what colours mean, those of a drawing or (norm, map); the numbers of an upright bar are on its left."""
    from matplotlib.cm import ScalarMappable

    mappable = ScalarMappable(*of) if isinstance(of, tuple) else of
    where = "vertical" if upright else "horizontal"
    bar = figure.colorbar(mappable, cax=figure.add_axes(place), orientation=where)
    bar.outline.set_visible(False)
    if upright:
        bar.ax.yaxis.set_ticks_position("left")
        bar.ax.yaxis.set_label_position("left")
    bar.ax.tick_params(labelsize=SMALL, colors=INK, color=GREY)
    bar.set_label(label, size=TEXT, color=INK)


# --- clouds -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Outline:
    """Closed lines round a projected cloud. boundary, hull : (edges, 2, 2)."""

    boundary: Array
    hull: Array


def draw_cloud(axes: Any, points: Array, numbers: Array, scale: Any, colours: str, area: float, label: str) -> None:
    """Draw points (M, 2 or 3) in the colours of their numbers, on a panel of so many pt^2."""
    solid = points.shape[1] == 3
    size = mark_size(len(points), area)
    look: dict[str, Any] = {"zorder": 3, "depthshade": False} if solid else {"zorder": 2}
    look |= {"cmap": colours, "norm": scale, "linewidths": 0, "rasterized": True}
    axes.scatter(*points.T, c=numbers, s=size, label=label, **look)


def shown(points: Array, most: int = MOST_SHOWN) -> Index:
    """Return which points are drawn: all, or the first in each cell of a grid."""
    return thinned(points, most)


def seen(points: Array, view: View, most: int = MOST_SHOWN) -> Index:
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


def outline(points: Array, view: View, parameters: int) -> Outline:
    """Return the concave boundary and the convex hull of a projected cloud."""
    flat = np.zeros((len(points), 3))
    flat[:, :2] = points[:, list(view[:2])]
    flat = flat[thinned(flat[:, :2], MOST_OUTLINED)]
    edges = []
    for body in (alpha_shape(flat, parameters=parameters), convex_hull(flat, parameters)):
        edges.append(body.vertices[body.facets][:, :, :2] if body.facets.shape[1] == 2 else np.zeros((0, 2, 2)))
    return Outline(*edges)
