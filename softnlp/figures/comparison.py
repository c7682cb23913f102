"""The figure of a comparison: where the tips are apart, in which direction, and by how much for which chamber sets."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from softnlp.base.arrays import Array
from softnlp.base.columns import OUTPUTS
from softnlp.base.statistics import groups, statistics
from softnlp.base.units import MILLIMETRE
from softnlp.figures.compare_parts import draw_boxes
from softnlp.figures.space import around, colour_bar, draw_cloud, space_axes
from softnlp.figures.style import GREY, INK, SMALL, TEXT, colour, in_own_style, new_figure, plain
from softnlp.model.gravity import gravity_lines, is_hanging
from softnlp.studies.comparison import OBSERVABLES
from softnlp.sweep.boundary import thinned
from softnlp.sweep.comparison import Comparison
from softnlp.sweep.read import Workspace

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MAP = "cividis_r"
_MOST_LINES, _MOST_POINTS = 2_000, 20_000
_WIDTH, _HEIGHT = 11.0, 7.2
_ALL = "all"

BENDING, DISTANCE = OUTPUTS["bending_angle"], OBSERVABLES["tip_position"]


@in_own_style
def comparison_figure(workspace: Workspace, comparison: Comparison) -> Figure:
    """Draw how far the tips of a workspace are from the other's.

    Left, the other's tips in 3-D, each with a line to this workspace's at the same pressure, coloured by their
    distance; above right, the error as a vector seen along y and along z; below right, box plots of the distance (and
    of the difference in bending angle of two workspaces) by which sets have pressure. Boxes are quartiles with the
    median, whiskers reach the last value within 1.5 times their height, diamonds are means.
    """
    found = statistics(comparison.distance / MILLIMETRE)
    part = 100 * MILLIMETRE / comparison.length  # % of length in a mm
    parts = [
        workspace.robot.name,
        workspace.material,
        f"{found.count:,} pairs",
        f"mean {found.mean:.3g} mm ({found.mean * part:.3g} % of length), largest {found.largest:.3g} mm",
    ]
    parts += gravity_lines(workspace.gravity)
    figure = new_figure(_WIDTH, _HEIGHT, f"{workspace.title} against {comparison.against}", "  ·  ".join(parts))
    norm = _norm(comparison)
    tips = _tips(figure, comparison, norm, hanging=is_hanging(workspace.gravity))
    places = ((0.6, 0.55, 0.17, 0.32), (0.82, 0.55, 0.17, 0.32))
    half = 1.08 * float(np.abs(comparison.error).max()) / MILLIMETRE or 1.0
    for place, (first, second) in zip(places, ((0, 2), (0, 1)), strict=True):
        _errors(figure.add_axes(place), comparison, norm, first, second, half)
    with_angle = comparison.angle is not None
    boxes = figure.add_axes((0.6, 0.085, 0.17 if with_angle else 0.39, 0.34))
    _boxes(boxes, comparison, comparison.distance / MILLIMETRE, DISTANCE.axis)
    boxes.set_xlim(left=0)
    if comparison.angle is not None:
        other = figure.add_axes((0.82, 0.085, 0.17, 0.34))
        _boxes(other, comparison, BENDING.shown(comparison.angle), f"bending difference [{BENDING.unit}]")
        other.tick_params(labelleft=False)
    else:
        percent = boxes.secondary_xaxis("top", functions=(partial(np.multiply, part), partial(np.multiply, 1 / part)))
        percent.set_xlabel("of the length [%]", size=TEXT, color=INK)
        percent.tick_params(labelsize=SMALL, colors=INK, color=GREY)
    figure.text(0.018, 0.014, _caption(comparison, tips), size=SMALL, color=GREY)
    return figure


def _norm(comparison: Comparison) -> Any:
    from matplotlib.colors import Normalize

    return Normalize(0.0, float(comparison.distance.max()) / MILLIMETRE or 1.0)


def _tips(figure: Figure, comparison: Comparison, norm: Any, *, hanging: bool) -> int:
    """Draw pairs of tips in 3-D, upside down where the robot hangs; return how many."""
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    k = thinned(comparison.other, _MOST_LINES)
    other, mine = comparison.other[k] / MILLIMETRE, comparison.tip_position[k] / MILLIMETRE
    axes = space_axes(figure, (-0.02, 0.05, 0.56, 0.84), around(np.vstack([other, mine])), hanging=hanging)
    distance = comparison.distance[k] / MILLIMETRE
    lines = Line3DCollection(np.stack([other, mine], axis=1), cmap=_MAP, norm=norm, linewidths=0.9, zorder=2)
    lines.set_array(distance)
    lines.set_label("pairs")
    axes.add_collection3d(lines)
    draw_cloud(axes, other, distance, norm, _MAP, 50_000, "other tips")
    colour_bar(figure, (0.05, 0.86, 0.36, 0.018), (norm, _MAP), DISTANCE.axis)
    return len(k)


def _errors(axes: Axes, comparison: Comparison, norm: Any, first: int, second: int, half: float) -> None:
    """Draw the error vectors seen along an axis, with the mean as a cross."""
    error = comparison.error / MILLIMETRE
    k = thinned(error[:, [first, second]], _MOST_POINTS)
    plain(axes, f"error in {'xyz'[first]} [mm]", f"error in {'xyz'[second]} [mm]")
    axes.set(xlim=(-half, half), ylim=(-half, half), aspect="equal")
    axes.axhline(0, color=GREY, linewidth=0.8)
    axes.axvline(0, color=GREY, linewidth=0.8)
    distance = comparison.distance[k] / MILLIMETRE
    draw_cloud(axes, error[k][:, [first, second]], distance, norm, _MAP, 15_000, "errors")
    mean = error.mean(axis=0)
    axes.plot(mean[first], mean[second], "+", color=colour(1), markersize=11, markeredgewidth=2, label="mean")


def _boxes(axes: Axes, comparison: Comparison, values: Array, label: str) -> None:
    """Draw a box for the whole and one for each group of rows, the whole on top."""
    plain(axes, label, "")
    named = [(_ALL, np.ones(len(values), bool)), *groups(comparison.pressure)][::-1]
    faces = [colour(0) if name == _ALL else colour(5) for name, _ in named]
    draw_boxes(axes, [values[mask] for _, mask in named], faces, mean=True)
    axes.set_yticks(range(1, len(named) + 1), [f"{name}  ({mask.sum():,})" for name, mask in named])
    axes.tick_params(labelsize=SMALL)


def _caption(comparison: Comparison, drawn: int) -> str:
    """Say what was left out and what is drawn."""
    c = comparison
    left = [(c.unmatched, "without a pose at their pressure"), (c.unsolved, "not solved"), (c.skipped, "with blanks")]
    text = "; ".join(f"{n:,} {words}" for n, words in left if n)
    pairs = f"{len(c.row):,} of {c.rows:,} rows compared{f' ({text})' if text else ''}"
    if c.solved_again.any():
        pairs += f", {int(c.solved_again.sum()):,} of them solved for this"
    if drawn < len(c.row):
        pairs += f"; {drawn:,} are drawn in 3-D, the first of each small cell"
    return f"{pairs}. Boxes: quartiles and median, diamonds: mean, +: mean error"
