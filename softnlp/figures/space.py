"""Axes in space for clouds of tips."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softnlp.figures.style import GREY, INK, PALE, SMALL, TEXT

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]


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
    axes: Any = figure.add_axes(place, projection="3d", computed_zorder=False)
    axes.patch.set_visible(False)
    axes.set_proj_type("ortho")
    axes.view_init(**({"elev": -18, "azim": -122, "roll": 180} if hanging else {"elev": 18, "azim": -58}))
    low, high = limits
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low, zoom=zoom)
    for name, pane in zip("xyz", (axes.xaxis, axes.yaxis, axes.zaxis), strict=True):
        pane.set_pane_color((1, 1, 1, 0))
        pane._axinfo["grid"].update(color=PALE, linewidth=0.6)
        pane.line.set_color(GREY)
        getattr(axes, f"set_{name}label")(f"{name} [mm]", size=TEXT, color=INK)
    axes.tick_params(labelsize=SMALL, colors=INK)
    return axes
