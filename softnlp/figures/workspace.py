"""Figures of a workspace: its tips in 3-D and three projections, coloured by a number; and maps of its dexterity."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softnlp.base.arrays import Array
from softnlp.base.columns import DEG, ONE, OUTPUTS
from softnlp.base.units import DEGREE, MILLIMETRE
from softnlp.figures.body import disc
from softnlp.figures.space import (
    VIEWS,
    Outline,
    View,
    colour_bar,
    draw_cloud,
    draw_faces,
    draw_lines,
    outline,
    seen,
    shown,
    space_axes,
    view_axes,
)
from softnlp.figures.style import GREY, INK, SMALL, TEXT, WRONG, in_own_style, legend, mark, new_figure
from softnlp.model.gravity import gravity_lines, is_hanging
from softnlp.statics.step import STABLE_FLAGS
from softnlp.sweep.dexterity import Dexterity, seen_along
from softnlp.sweep.read import Column, Workspace, read_column
from softnlp.sweep.summary import parameters

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOUR, TILT = OUTPUTS["bending_angle"].key, OUTPUTS["tilt"]
_MAP = "viridis"
_LOGARITHMIC = ("residual", "discretisation_error")
_ROUND_OFF = 1e-20
_WIDTH, _LOWEST, _HIGHEST = 11.0, 6.0, 7.6  # of the figure, which is as high as its projections [inch]


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
    subtitle = "  ·  ".join(parts)
    if not len(tips):
        figure = new_figure(_WIDTH, _LOWEST, workspace.title, subtitle)
        figure.text(0.5, 0.5, "No pose has a solution with this number", size=TEXT, color=WRONG, ha="center")
        return figure
    scale = _scale(column, numbers)
    size = 2 * workspace.robot.outer_radius / MILLIMETRE
    low, high = _limits(tips, size)
    height, places, free = _places(high - low)
    figure = new_figure(_WIDTH, height, workspace.title, subtitle)
    count = parameters(workspace)
    outlines = [outline(tips, view, count) for view in VIEWS]

    drawn_3d = _cloud_panel(
        figure, tips, numbers, scale, (low, high), outlines, size, hanging=is_hanging(workspace.gravity)
    )
    drawn = []
    for view, place, found in zip(VIEWS, places, outlines, strict=True):
        axes = view_axes(figure, place, view)
        drawn.append(_projection(axes, tips, numbers, scale, view, (low, high), found, size))
    colour_bar(figure, free, (scale, _MAP), column_label(column))
    _captions(figure, free, len(tips), drawn_3d, drawn, outlines)
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
    low, high = limits
    slender = high[2] - low[2] > _SLENDER * max((high - low)[:2])
    axes = space_axes(figure, (-0.015, 0.045, 0.56, 0.88), limits, zoom=0.9 if slender else 1.04, hanging=hanging)
    floor, side = (high[2], high[0]) if hanging else (low[2], low[0])
    # the walls that the viewer sees behind the cloud, one for each projection
    for (first, second, sight, _), wall, found in zip(VIEWS, (floor, high[1], side), outlines, strict=True):
        for edges, style in ((found.boundary, _BOUNDARY), (found.hull, _HULL)):
            if len(edges):
                lines = np.full((len(edges), 2, 3), wall)
                lines[:, :, first], lines[:, :, second] = edges[:, :, 0], edges[:, :, 1]
                lines[:, :, sight] = wall
                draw_lines(axes, lines, zorder=1, alpha=0.55, **style)
    draw_faces(axes, disc(size / 2, 40, 0.0), "#EEEEEE", GREY, 0.8, zorder=2, label="base")
    k = shown(tips)
    draw_cloud(axes, tips[k], numbers[k], scale, _MAP, 90_000, "poses")
    return len(k)


_SLENDER = 1.3  # height over width from which on the height bounds the picture in 3-D
_BOUNDARY: dict[str, Any] = {"colors": INK, "width": 1.1}
_HULL: dict[str, Any] = {"colors": GREY, "width": 0.9, "linestyles": (0, (4, 3))}

# Places of the projections: xz above xy, which share x; yz beside xz, which share z; beside xy what explains them.
_LEFT, _RIGHT, _GAP = 0.605, 0.985, 0.055
_ABOVE, _BETWEEN, _BELOW = 0.87, 0.63, 0.57  # heights of what is not a projection [inch]

Place = tuple[float, float, float, float]


def _places(spans: Array) -> tuple[float, list[Place], Place]:
    """Return the height of the figure, where the projections are, and where its colours are explained.

    They are first-angle views that share x and z, all at one scale.
    """
    width, room = (_RIGHT - _LEFT - _GAP) * _WIDTH, _HIGHEST - _ABOVE - _BETWEEN - _BELOW
    inch = min(width / (spans[0] + spans[1]), room / (spans[2] + spans[1]))  # for a mm
    dx, dy, dz = spans * inch
    height = max(_LOWEST, float(_ABOVE + dz + _BETWEEN + dy + _BELOW))
    left, top = _LEFT * _WIDTH, height - _ABOVE
    gap_x, gap_y = _GAP * _WIDTH, _BETWEEN
    boxes = (
        (left, top - dz - gap_y - dy, dx, dy),
        (left, top - dz, dx, dz),
        (left + dx + gap_x, top - dz, dy, dz),
    )
    bar = (left + dx + gap_x, top - dz - gap_y - dy / 2, _RIGHT * _WIDTH - left - dx - gap_x, 0.14)
    first, *others = ((x / _WIDTH, y / height, w / _WIDTH, h / height) for x, y, w, h in (bar, *boxes))
    return height, others, first


def _projection(
    axes: Axes,
    tips: Array,
    numbers: Array,
    scale: Any,
    view: View,
    limits: tuple[Array, Array],
    found: Outline,
    size: float,
) -> int:
    """Draw the cloud seen along an axis; return how many poses are drawn."""
    from matplotlib.collections import LineCollection
    from matplotlib.patches import Circle

    first, second, sight, _ = view
    low, high = limits
    axes.set(xlim=(low[first], high[first]), ylim=(low[second], high[second]), aspect="equal")
    if sight == 2:
        axes.add_patch(Circle((0, 0), size / 2, facecolor="#EEEEEE", edgecolor=GREY, linewidth=0.8, label="base"))
    else:
        axes.plot([-size / 2, size / 2], [0, 0], color=GREY, linewidth=2.0, label="base")
    chosen = seen(tips, view)
    area = float(np.prod(axes.bbox.size)) * (72 / axes.figure.dpi) ** 2
    draw_cloud(axes, tips[chosen][:, [first, second]], numbers[chosen], scale, _MAP, area, "poses")
    for words, edges, style in (("boundary", found.boundary, _BOUNDARY), ("convex hull", found.hull, _HULL)):
        look = {"linewidths" if key == "width" else key: value for key, value in style.items()}
        axes.add_collection(LineCollection(list(edges), zorder=3, label=words, **look))
    return len(chosen)


def column_label(column: Column) -> str:
    """Return the words and the unit of a number for an axis."""
    unit = {DEG.attribute: DEG.label, ONE.attribute: "-"}.get(column.unit, column.unit)
    pressure = column.name[1:-4]
    if column.name.startswith("p") and column.name.endswith("_bar") and pressure.isdigit():
        return f"pressure of set {pressure} [bar]"
    words = column.name.rpartition("_")[0] if column.unit != "1" and "_" in column.name else column.name
    return f"{words.replace('_', ' ')} [{unit}]"


def _captions(
    figure: Figure, free: Place, poses: int, drawn_3d: int, drawn: list[int], outlines: list[Outline]
) -> None:
    """Explain the lines above the colours, and say how many poses are drawn where not all are."""
    lines = [
        mark(words, style["colors"], line=style.get("linestyles", "-"), linewidth=style["width"])
        for name, style, words in (("boundary", _BOUNDARY, "boundary"), ("hull", _HULL, "convex hull"))
        if any(len(getattr(found, name)) for found in outlines)
    ]
    if lines:
        legend(figure, lines, loc="lower left", bbox_to_anchor=(free[0] - 0.01, free[1] + 1.6 * free[3]))
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


# --- dexterity --------------------------------------------------------------------------------------------------------

_MAPS_HEIGHT, _ROW, _MAPS_LEFT, _MAPS_GAP = 11.8, 2.65, 0.17, 0.05


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
    figure = new_figure(_WIDTH, _MAPS_HEIGHT, f"{title}: dexterity", "  ·  ".join(parts))
    highest, spread = TILT.shown(found.highest_tilt), TILT.shown(found.tilt_range)
    rows: tuple[tuple[str, Array, Any], ...] = (
        ("poses in a voxel", found.poses.astype(float), LogNorm(1, max(2, int(found.poses.max())))),
        (f"highest tilt [{TILT.unit}]", highest, Normalize(0, float(highest.max()) or 1)),
        (f"range of tilts [{TILT.unit}]", spread, Normalize(0, float(spread.max()) or 1)),
        ("directions taken [%]", 100 * found.coverage, Normalize(0, 100 * float(found.coverage.max()))),
    )
    spans = (found.voxel.max(axis=0) + 1) * found.size
    width = (_RIGHT - _MAPS_LEFT - 2 * _MAPS_GAP) * _WIDTH
    inch = min(width / float(spans[0] + spans[0] + spans[1]), 2.15 / float(max(spans[1], spans[2])))  # for a metre
    for row, (label, values, norm) in enumerate(rows):
        left, bottom = _MAPS_LEFT * _WIDTH, _MAPS_HEIGHT - 0.75 - (row + 1) * _ROW + 0.45
        drawn: Any = None
        for view in VIEWS:
            first, second, sight, _ = view
            w, h = float(spans[first]) * inch, float(spans[second]) * inch
            place = (left / _WIDTH, bottom / _MAPS_HEIGHT, w / _WIDTH, h / _MAPS_HEIGHT)
            axes = view_axes(figure, place, view, titled=row == 0)
            across, up, largest = seen_along(found, values, sight)
            drawn = axes.pcolormesh(
                across / MILLIMETRE, up / MILLIMETRE, largest.T, cmap="viridis", norm=norm, rasterized=True, label=label
            )
            axes.set_aspect("equal")
            left += w + _MAPS_GAP * _WIDTH
        colour_bar(figure, (0.085, bottom / _MAPS_HEIGHT, 0.012, 2.0 / _MAPS_HEIGHT), drawn, label, upright=True)
    text = "Each map shows the largest value of the voxels behind each other"
    figure.text(0.018, 0.012, text, size=SMALL, color=GREY)
    return figure
