"""The figure of a dexterity: which tilts and how many directions of the tip are reached at which places."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.columns import OUTPUTS
from softnlp.base.units import DEGREE, MILLIMETRE
from softnlp.figures.cloud import VIEWS
from softnlp.figures.style import GREY, INK, SMALL, TEXT, in_own_style, new_figure, plain
from softnlp.sweep.dexterity import Dexterity, seen_along

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

_WIDTH, _HEIGHT, _ROW = 11.0, 11.8, 2.65
_LEFT, _RIGHT, _GAP = 0.17, 0.985, 0.05


TILT = OUTPUTS["tilt"]


@in_own_style
def dexterity_figure(found: Dexterity, title: str, robot: str) -> Figure:
    """Draw maps of four numbers of the voxels, each seen along z, y and x: the largest of those behind each other.

    Rows: how many poses, the highest tilt, the range of tilts, and the part of all directions that the tip axis takes.
    """
    from matplotlib.colors import LogNorm, Normalize

    parts = [
        robot,
        f"{len(found.voxel):,} voxels of {found.size / MILLIMETRE:.3g} mm",
        f"{found.directions} directions of {found.resolution / DEGREE:.3g} deg",
        f"{100 * found.overall:.3g} % taken anywhere",
    ]
    figure = new_figure(_WIDTH, _HEIGHT, f"{title}: dexterity", "  ·  ".join(parts))
    highest, spread = TILT.shown(found.highest_tilt), TILT.shown(found.tilt_range)
    rows: tuple[tuple[str, Array, Any], ...] = (
        ("poses in a voxel", found.poses.astype(float), LogNorm(1, max(2, int(found.poses.max())))),
        (f"highest tilt [{TILT.unit}]", highest, Normalize(0, float(highest.max()) or 1)),
        (f"range of tilts [{TILT.unit}]", spread, Normalize(0, float(spread.max()) or 1)),
        ("directions taken [%]", 100 * found.coverage, Normalize(0, 100 * float(found.coverage.max()))),
    )
    spans = (found.voxel.max(axis=0) + 1) * found.size
    width = (_RIGHT - _LEFT - 2 * _GAP) * _WIDTH
    inch = min(width / float(spans[0] + spans[0] + spans[1]), 2.15 / float(max(spans[1], spans[2])))  # for a metre
    for row, (label, values, norm) in enumerate(rows):
        left, bottom = _LEFT * _WIDTH, _HEIGHT - 0.75 - (row + 1) * _ROW + 0.45
        drawn: Any = None
        for first, second, sight, side in VIEWS:
            w, h = float(spans[first]) * inch, float(spans[second]) * inch
            axes = figure.add_axes((left / _WIDTH, bottom / _HEIGHT, w / _WIDTH, h / _HEIGHT))
            plain(axes, f"{'xyz'[first]} [mm]", f"{'xyz'[second]} [mm]")
            across, up, seen = seen_along(found, values, sight)
            drawn = axes.pcolormesh(
                across / MILLIMETRE, up / MILLIMETRE, seen.T, cmap="viridis", norm=norm, rasterized=True, label=label
            )
            axes.set_aspect("equal")
            if row == 0:
                words = f"seen from {'+' if side > 0 else '−'}{'xyz'[sight]}"
                axes.set_title(words, size=SMALL, color=GREY, loc="left", pad=3)
            left += w + _GAP * _WIDTH
        bar_axes = figure.add_axes((0.085, bottom / _HEIGHT, 0.012, 2.0 / _HEIGHT))
        bar = figure.colorbar(drawn, cax=bar_axes)
        bar.outline.set_visible(False)
        bar.ax.yaxis.set_ticks_position("left")
        bar.ax.yaxis.set_label_position("left")
        bar.ax.tick_params(labelsize=SMALL, colors=INK, color=GREY)
        bar.set_label(label, size=TEXT, color=INK)
    text = "Each map shows the largest value of the voxels behind each other"
    figure.text(0.018, 0.012, text, size=SMALL, color=GREY)
    return figure
