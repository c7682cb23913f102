"""Box plots: quartiles with the median, whiskers to the last value within 1.5 times their height, outliers as dots."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softnlp.figures.style import GREY, INK

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]


def draw_boxes(
    axes: Axes,
    values: Sequence[Array],
    faces: Sequence[str],
    *,
    hatches: Sequence[str] | None = None,
    positions: Sequence[float] | None = None,
    width: float = 0.6,
    mean: bool = False,
    upright: bool = False,
) -> None:
    """Draw a box for each array of values, 1, 2, … from below or at positions; `mean` adds diamonds."""
    drawn: dict[str, Any] = axes.boxplot(
        list(values),
        orientation="vertical" if upright else "horizontal",
        positions=positions,
        widths=width,
        showmeans=mean,
        patch_artist=True,
        medianprops={"color": INK, "linewidth": 1.5},
        whiskerprops={"color": GREY},
        capprops={"color": GREY},
        meanprops={"marker": "D", "markerfacecolor": "white", "markeredgecolor": INK, "markersize": 4},
        flierprops={"marker": ".", "markersize": 3, "markeredgecolor": GREY, "rasterized": True},
    )
    for k, (box, face) in enumerate(zip(drawn["boxes"], faces, strict=True)):
        box.set(facecolor=face, edgecolor=GREY, alpha=0.75)
        if hatches is not None and hatches[k]:
            box.set(hatch=hatches[k])
