"""The figure of tip positions: simulated and measured clouds, errors by axis as boxes, distances as a histogram."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.units import MILLIMETRE
from softnlp.figures.boxes import draw_boxes
from softnlp.figures.cloud import mark_size
from softnlp.figures.compare_parts import LEGEND_ROW, MEASURED, Look, legend, legend_rows, looks, shown_labels
from softnlp.figures.space import around, space_axes
from softnlp.figures.style import GREY, INK, SMALL, TEXT, WRONG, in_own_style, new_figure, plain
from softnlp.studies.comparison import AXES, OBSERVABLES, Comparison
from softnlp.sweep.boundary import thinned

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

_WIDTH, _HEIGHT = 11.0, 6.8
_MOST_SHOWN = 4_000
_BINS = 24


@in_own_style
def tips_figure(found: Comparison, title: str) -> Figure:
    """Draw measured and simulated tips, and how far they are apart.

    Left, the tips in 3-D: measured ones hollow, simulated ones of the best variant filled, each pair joined by a line.
    Right, the errors of every variant by axis and as a distance (boxes), and a histogram of the distances.
    """
    best = found.best_of("tip_position")
    parts = [", ".join(o.label for o in found.observed[:4]), found.variants[0].material.name]
    parts.append(f"{found.measured('tip_position'):,} tips")
    if best is not None:
        s = found.statistics(best, "tip_position")
        least = f"{found.labels[best]}: " if len(found.variants) > 1 else ""
        parts.append(f"{least}mean {s.mean / MILLIMETRE:.3g} mm, {s.mape:.3g} % of the length")
    columns, lines = legend_rows(found, _WIDTH)
    foot = 0.12 + LEGEND_ROW * lines
    height = _HEIGHT + LEGEND_ROW * lines
    figure = new_figure(_WIDTH, height, f"{title}: tip position", "  ·  ".join(parts))
    if best is None:
        figure.text(0.5, 0.5, "No row has a solution", size=TEXT, color=WRONG, ha="center")
        return figure
    made = looks(found)
    bottom, top = (foot + 0.5) / height, 1 - 0.75 / height
    _clouds(figure, found, best, made[best], (-0.01, foot / height, 0.54, top - foot / height + 0.02))
    half = (top - bottom - 0.7 / height) / 2
    _axis_boxes(figure.add_axes((0.62, top - half, 0.37, half)), found, made)
    _histogram(figure.add_axes((0.62, bottom, 0.37, half)), found, made)
    legend(figure, _handles(found, made, best), columns, "; thin lines: mean distances")
    return figure


def _handles(found: Comparison, made: list[Look], best: int) -> list[Any]:
    from matplotlib.lines import Line2D

    dot: dict[str, Any] = {"linestyle": "none", "marker": "o", "markersize": 5}
    handles = [Line2D([], [], color=INK, markerfacecolor="white", label=MEASURED, **dot)]
    for v, (look, label) in enumerate(zip(made, shown_labels(found), strict=True)):
        mark = {"marker": "o", "markersize": 4} if v == best else {}
        handles.append(
            Line2D([], [], color=look.colour, linestyle=look.line, linewidth=1.8, label=label, **mark)  # type: ignore[arg-type]
        )
    return handles


def _clouds(figure: Figure, found: Comparison, v: int, look: Look, place: tuple[float, float, float, float]) -> None:
    """Draw pairs of tips in 3-D."""
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    measured = np.concatenate([o.values[:, :3] for o in found.observed]) / MILLIMETRE
    simulated = np.concatenate([s.values[:, :3] for s in found.simulated[v]]) / MILLIMETRE
    both = np.isfinite(measured).all(axis=1) & np.isfinite(simulated).all(axis=1)
    measured, simulated = measured[both], simulated[both]
    k = thinned(measured, _MOST_SHOWN)
    measured, simulated = measured[k], simulated[k]
    axes = space_axes(figure, place, around(np.vstack([measured, simulated])))
    pairs = Line3DCollection(np.stack([measured, simulated], axis=1), colors=GREY, linewidths=0.6, zorder=1)
    pairs.set_label("pairs")
    axes.add_collection3d(pairs)
    size = max(mark_size(len(k), 9_000), 4.0)
    plot: dict[str, Any] = {"s": size, "depthshade": False, "rasterized": True}
    axes.scatter(*simulated.T, color=look.colour, linewidths=0, zorder=3, label=found.labels[v], **plot)
    axes.scatter(*measured.T, facecolors="none", edgecolors=INK, linewidths=0.8, zorder=3, label=MEASURED, **plot)


def _axis_boxes(axes: Axes, found: Comparison, made: list[Look]) -> None:
    """Draw the errors along each axis and the distance, a box a variant."""
    plain(axes, "", "simulated - measured [mm]")
    width = 0.8 / len(made)
    names = (*AXES, "tip_position")
    values, faces, hatches, places = [], [], [], []
    for g, name in enumerate(names):
        for v, look in enumerate(made):
            values.append(found.errors(v, name)[0] / MILLIMETRE)
            faces.append(look.colour)
            hatches.append(look.hatch)
            places.append(g + (v - (len(made) - 1) / 2) * width)
    axes.axhline(0, color=GREY, linewidth=0.8, zorder=1)
    draw_boxes(
        axes, values, faces, hatches=hatches, positions=places, width=0.85 * width, mean=len(made) <= 3, upright=True
    )
    axes.set_xticks(range(len(names)), ["x", "y", "z", "distance"])
    axes.tick_params(axis="x", length=0, labelsize=TEXT)
    axes.grid(False, axis="x")
    axes.set_xlim(-0.55, len(names) - 0.45)


def _histogram(axes: Axes, found: Comparison, made: list[Look]) -> None:
    """Draw how many tips are how far apart."""
    distances = [found.errors(v, "tip_position")[0] / MILLIMETRE for v in range(len(made))]
    highest = max((float(d.max()) for d in distances if d.size), default=0.0) or 1.0
    edges = np.linspace(0.0, highest, _BINS + 1)
    plain(axes, OBSERVABLES["tip_position"].axis, "tips")
    for d, look, label in zip(distances, made, found.labels, strict=True):
        counts, _ = np.histogram(d, edges)
        axes.stairs(counts, edges, color=look.colour, linestyle=look.line, linewidth=1.6, label=label)
        if len(made) == 1:
            axes.stairs(counts, edges, color=look.colour, alpha=0.25, fill=True)
        if d.size:
            axes.axvline(float(np.mean(d)), color=look.colour, linestyle=look.line, linewidth=0.9, alpha=0.8)
    axes.set_xlim(0.0, highest)
    axes.set_ylim(bottom=0)
    axes.tick_params(labelsize=SMALL)
