"""The figure of a workspace: the tips in 3-D and three projections, coloured by a number of the poses."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.columns import DEG, ONE, OUTPUTS
from softnlp.base.units import MILLIMETRE
from softnlp.figures.body import disc
from softnlp.figures.cloud import VIEWS, Outline, mark_size, outline, seen, shown
from softnlp.figures.space import space_axes
from softnlp.figures.style import GREY, INK, SMALL, TEXT, WRONG, in_own_style, new_figure, plain
from softnlp.model.gravity import gravity_lines, is_hanging
from softnlp.statics.step import STABLE_FLAGS
from softnlp.sweep.read import Column, Workspace, read_column
from softnlp.sweep.summary import parameters

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

COLOUR = OUTPUTS["bending_angle"].key
_MAP = "viridis"
_LOGARITHMIC = ("residual", "discretisation_error")
_ROUND_OFF = 1e-20
_AXES = "xyz"
_WIDTH, _HEIGHT = 11.0, 7.6


@in_own_style
def workspace_figure(workspace: Workspace, colour: str = COLOUR) -> Figure:
    """Draw where the tip goes: all poses in 3-D and seen along each axis.

    colour : a number of the poses by its name in the file (`softnlp.sweep.read.column_names`), with its unit:
    "stretch", "p1_bar", "tip_position_z_mm".

    Every panel has the same scale. Of many poses one in each small cell is drawn, which the figure says. Outlines are
    the concave boundary (dark) and the convex hull (dashed) of each projection; in 3-D they are on the walls.

    Raises
    ------
    InputError
        For a colour that is not a number of the poses.
    """
    column = read_column(workspace, colour)
    solved = workspace.solved & np.isfinite(column.values)
    tips = workspace.tip_position[solved] / MILLIMETRE
    numbers = column.values[solved]
    failed = workspace.poses - int(workspace.solved.sum())
    parts = [
        workspace.robot.name,
        workspace.material,
        f"{workspace.poses - failed:,} of {workspace.poses:,} poses solved",
    ]
    for what, words in (("unstable", "unstable"), ("undefined", "of undefined stability")):
        if count := int(np.count_nonzero(workspace.stable[workspace.solved] == STABLE_FLAGS[what])):
            parts.append(f"{count:,} {words}")
    if through := int(np.count_nonzero(workspace.self_intersecting == 1)):
        parts.append(f"{through:,} through themselves")
    parts += gravity_lines(workspace.gravity)
    figure = new_figure(_WIDTH, _HEIGHT, workspace.title, "  ·  ".join(parts))
    if not len(tips):
        figure.text(0.5, 0.5, "No pose has a solution with this number", size=TEXT, color=WRONG, ha="center")
        return figure
    scale = _scale(column, numbers)
    size = 2 * workspace.robot.outer_radius / MILLIMETRE
    low, high = _limits(tips, size)
    count = parameters(workspace)
    outlines = [outline(tips, view, count) for view in VIEWS]

    drawn_3d = _cloud_panel(
        figure, tips, numbers, scale, (low, high), outlines, size, hanging=is_hanging(workspace.gravity)
    )
    drawn = [
        _projection(_place(figure, k, high - low), tips, numbers, scale, k, (low, high), outlines[k], size)
        for k in range(len(VIEWS))
    ]
    _colour_bar(figure, column, scale)
    _captions(figure, len(tips), drawn_3d, drawn, outlines)
    return figure


def _scale(column: Column, numbers: Array) -> Any:
    """Return how numbers become colours: logarithmic for errors, which span decades."""
    from matplotlib.colors import LogNorm, Normalize

    if column.name in _LOGARITHMIC and np.any(numbers > 0):
        positive = numbers[numbers > 0]
        return LogNorm(max(float(positive.min()), _ROUND_OFF), max(float(positive.max()), 10 * _ROUND_OFF))
    low, high = float(numbers.min()), float(numbers.max())
    if high - low <= 1e-12 * max(abs(low), abs(high)):
        low, high = low - 0.5, high + 0.5  # a constant is the middle of the scale
    return Normalize(low, high)


def _limits(tips: Array, size: float) -> tuple[Array, Array]:
    """Return the corners (3,) of the box that every panel shows: the tips, the base plate, and a margin."""
    plate = np.array([size / 2, size / 2, 0.0])
    low, high = np.minimum(tips.min(axis=0), -plate), np.maximum(tips.max(axis=0), plate)
    margin = 0.05 * float((high - low).max())
    return low - margin, high + margin


def _cloud_panel(
    figure: Figure,
    tips: Array,
    numbers: Array,
    scale: Any,
    limits: tuple[Array, Array],
    outlines: list[Outline],
    size: float,
    *,
    hanging: bool,
) -> int:
    """Draw the cloud in 3-D with the outlines on the walls behind it; return how many poses are drawn."""
    from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

    low, high = limits
    axes = space_axes(figure, (-0.025, 0.05, 0.56, 0.86), limits, zoom=0.96, hanging=hanging)
    floor, side = (high[2], high[0]) if hanging else (low[2], low[0])
    # the walls that the viewer sees behind the cloud, one for each projection
    for (first, second, sight, _), wall, found in zip(VIEWS, (floor, high[1], side), outlines, strict=True):
        for edges, style in ((found.boundary, _BOUNDARY), (found.hull, _HULL)):
            if len(edges):
                lines = np.full((len(edges), 2, 3), wall)
                lines[:, :, first], lines[:, :, second] = edges[:, :, 0], edges[:, :, 1]
                lines[:, :, sight] = wall
                axes.add_collection3d(Line3DCollection(lines, zorder=1, **{**style, "alpha": 0.55}))
    plate = disc(size / 2, 40, 0.0)
    axes.add_collection3d(
        Poly3DCollection(plate, facecolors="#EEEEEE", edgecolors=GREY, linewidths=0.8, zorder=2, label="base")
    )
    k = shown(tips)
    axes.scatter(
        *tips[k].T,
        c=numbers[k],
        s=mark_size(len(k), 90_000),
        cmap=_MAP,
        norm=scale,
        depthshade=False,
        linewidths=0,
        rasterized=True,
        zorder=3,
        label="poses",
    )
    return len(k)


_BOUNDARY: dict[str, Any] = {"colors": INK, "linewidths": 1.1}
_HULL: dict[str, Any] = {"colors": GREY, "linewidths": 0.9, "linestyles": (0, (4, 3))}

# Places of the projections: xz above xy, which share x; yz beside xz, which share z.
_LEFT, _BOTTOM, _RIGHT, _TOP, _GAP = 0.605, 0.075, 0.985, 0.885, 0.055


def _place(figure: Figure, k: int, spans: Array) -> Axes:
    """Return the axes of projection k: first-angle views that share x and z, all at one scale."""
    width, height = (_RIGHT - _LEFT - _GAP) * _WIDTH, (_TOP - _BOTTOM - 1.5 * _GAP) * _HEIGHT
    inch = min(width / (spans[0] + spans[1]), height / (spans[2] + spans[1]))  # for a mm
    dx, dy, dz = spans * inch
    left, top = _LEFT * _WIDTH, _TOP * _HEIGHT
    gap_x, gap_y = _GAP * _WIDTH, 1.5 * _GAP * _HEIGHT
    boxes = (
        (left, top - dz - gap_y - dy, dx, dy),
        (left, top - dz, dx, dz),
        (left + dx + gap_x, top - dz, dy, dz),
    )
    x, y, w, h = boxes[k]
    return figure.add_axes((x / _WIDTH, y / _HEIGHT, w / _WIDTH, h / _HEIGHT))


def _projection(
    axes: Axes,
    tips: Array,
    numbers: Array,
    scale: Any,
    k: int,
    limits: tuple[Array, Array],
    found: Outline,
    size: float,
) -> int:
    """Draw the cloud seen along an axis; return how many poses are drawn."""
    from matplotlib.collections import LineCollection
    from matplotlib.patches import Circle

    view = VIEWS[k]
    first, second, sight, side = view
    plain(axes, f"{_AXES[first]} [mm]", f"{_AXES[second]} [mm]")
    low, high = limits
    axes.set(xlim=(low[first], high[first]), ylim=(low[second], high[second]), aspect="equal")
    axes.set_title(f"seen from {'+' if side > 0 else '−'}{_AXES[sight]}", size=SMALL, color=GREY, loc="left", pad=3)
    if sight == 2:
        axes.add_patch(Circle((0, 0), size / 2, facecolor="#EEEEEE", edgecolor=GREY, linewidth=0.8, label="base"))
    else:
        axes.plot([-size / 2, size / 2], [0, 0], color=GREY, linewidth=2.0, label="base")
    chosen = seen(tips, view)
    box = axes.get_position()
    area = box.width * _WIDTH * box.height * _HEIGHT * 72**2
    axes.scatter(
        tips[chosen, first],
        tips[chosen, second],
        c=numbers[chosen],
        s=mark_size(len(chosen), area),
        cmap=_MAP,
        norm=scale,
        linewidths=0,
        rasterized=True,
        zorder=2,
        label="poses",
    )
    axes.add_collection(LineCollection(list(found.boundary), zorder=3, label="boundary", **_BOUNDARY))
    axes.add_collection(LineCollection(list(found.hull), zorder=3, label="convex hull", **_HULL))
    return len(chosen)


def _colour_bar(figure: Figure, column: Column, scale: Any) -> None:
    """Say what the colours mean, above the 3-D panel."""
    from matplotlib.cm import ScalarMappable

    axes = figure.add_axes((0.05, 0.862, 0.36, 0.018))
    bar = figure.colorbar(ScalarMappable(scale, _MAP), cax=axes, orientation="horizontal")
    bar.outline.set_visible(False)
    bar.ax.tick_params(labelsize=SMALL, colors=INK, color=GREY)
    bar.set_label(column_label(column), size=TEXT, color=INK)


def column_label(column: Column) -> str:
    """Return the words and the unit of a number for an axis."""
    unit = {DEG.attribute: DEG.label, ONE.attribute: "-"}.get(column.unit, column.unit)
    pressure = column.name[1:-4]
    if column.name.startswith("p") and column.name.endswith("_bar") and pressure.isdigit():
        return f"pressure of set {pressure} [bar]"
    words = column.name.rpartition("_")[0] if column.unit != "1" and "_" in column.name else column.name
    return f"{words.replace('_', ' ')} [{unit}]"


def _captions(figure: Figure, poses: int, drawn_3d: int, drawn: list[int], outlines: list[Outline]) -> None:
    """Explain the lines, and say how many poses are drawn where not all are."""
    from matplotlib.lines import Line2D

    kinds: tuple[tuple[str, Any], ...] = (("boundary", "-"), ("hull", (0, (4, 3))))
    lines = [
        Line2D([], [], color=style["colors"], linewidth=style["linewidths"], linestyle=dashes, label=words)
        for (name, dashes), style, words in zip(kinds, (_BOUNDARY, _HULL), ("boundary", "convex hull"), strict=True)
        if any(len(getattr(found, name)) for found in outlines)
    ]
    style: dict[str, Any] = {"fontsize": SMALL, "frameon": False, "labelcolor": INK}
    if lines:
        figure.legend(handles=lines, loc="upper right", bbox_to_anchor=(0.99, 0.945), ncols=2, **style)
    least, most = min(drawn), max(drawn)
    flat = f"{least:,}" if least == most else f"{least:,} to {most:,}"
    if drawn_3d == poses == least:
        text = "All solved poses are drawn; the disc is the robot's base"
    else:
        text = (
            f"Drawn of {poses:,} solved poses: {drawn_3d:,} in 3-D, the first of each small cell; {flat} in the "
            "projections, the nearest to the viewer"
        )
    figure.text(0.018, 0.014, text, size=SMALL, color=GREY)
