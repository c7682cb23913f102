"""Grids of small panels in the style of the project's figures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softnlp.figures.style import INK, SMALL, TEXT, in_own_style, new_figure, plain, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH, _ROW = 10.5, 2.55  # of a figure, of a row of panels [inch]
_HEAD, _FOOT, _LEFT, _RIGHT = 0.85, 0.95, 0.7, 0.2  # around the panels [inch]
MEASURED: dict[str, Any] = {
    "color": INK, "marker": "D", "markersize": 6, "linestyle": "none", "zorder": 5, "clip_on": False,
}  # fmt: skip


@in_own_style
def panels(
    title: str,
    subtitle: str,
    rows: int,
    columns: int,
    *,
    row_height: float = _ROW,
    right: float = _RIGHT,
    left: float = _LEFT,
) -> tuple[Figure, list[Axes]]:
    """Return a figure with its heading, and empty panels row by row.

    row_height : of one; left, right : room beside them [inch].
    """
    height = _HEAD + rows * row_height + _FOOT
    figure = new_figure(_WIDTH, height, title, subtitle)
    grid = figure.add_gridspec(
        rows,
        columns,
        left=left / _WIDTH,
        right=1 - right / _WIDTH,
        top=1 - _HEAD / height,
        bottom=_FOOT / height,
        hspace=0.38,
        wspace=0.28,
    )
    return figure, [figure.add_subplot(grid[row, column]) for row in range(rows) for column in range(columns)]


def label_outer(axes: Sequence[Axes], columns: int, x_label: str, y_label: str) -> None:
    """Style panels that share their axes; labels at the left and at the foot alone."""
    for k, panel in enumerate(axes):
        plain(panel, x_label if k >= len(axes) - columns else "", y_label if k % columns == 0 else "")


def named(panel: Axes, name: str) -> None:
    """Write a panel's name over it."""
    panel.set_title(name, size=TEXT, weight="bold", color=INK, loc="left")


def legend(figure: Figure, axes: Axes, columns: int = 6) -> None:
    """Put the legend of one panel at the foot of the figure."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="lower center", ncols=columns, fontsize=SMALL, frameon=False, labelcolor=INK,
        bbox_to_anchor=(0.5, 0.005), handlelength=2.4, columnspacing=1.4,
    )  # fmt: skip


def saved(figure: Figure, folder: Path, name: str) -> None:
    """Write a figure beside its page."""
    save_figure(figure, folder / f"{name}.png")
