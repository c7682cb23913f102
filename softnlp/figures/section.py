"""The cross-section of a robot to scale, as made and stretched, with its dimensions and the rules it breaks."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from itertools import permutations
from math import cos, degrees, hypot, isfinite, pi, radians, sin
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from softnlp.base.errors import InputError
from softnlp.base.units import MILLIMETRE
from softnlp.figures.outlined import outlined_figure
from softnlp.figures.style import GREY, INK, SMALL, TEXT, WRONG, colour, in_own_style, ink_on, legend, new_figure
from softnlp.model.outlined import OutlinedRobot
from softnlp.model.robot import Robot, Violation, touching_stretch
from softnlp.model.round_chambers import radii
from softnlp.statics.step import SectionRadii

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SILICONE = "#EFEBE4"
Point = tuple[float, float]

PANEL = (5.0, 4.45)  # width and height of a drawing [inch]
_WINDOW = (-1.25, 2.17, -1.8, 1.25)  # left, right, bottom, top of a drawing, in outer radii of the undeformed body
_LEADER_ANGLE = radians(35)  # where the labelled chamber is looked for
_COLUMN = 1.3  # left edge of the labels beside a drawing, in outer radii
_LEGEND_COLUMNS = 3  # a drawing
_ARROW: dict[str, Any] = {"color": INK, "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0}
_LINE = 0.19  # height of a line of text below the drawings [inch]


def stretched_radii(robot: Robot, stretch: float) -> SectionRadii:
    """Return the radii of a section at a stretch, Eq. (22) and (S2) [m].

    Raises
    ------
    InputError
        When the stretch is not above 1 - (r_ci0 / r_co)^2, where the bores close.
    """
    r_co, r_ci0 = robot.chamber_radius, robot.bore_radius
    least = 1 - (r_ci0 / r_co) ** 2
    if not isfinite(stretch) or stretch <= least:
        raise InputError(f"expected a stretch above {least:.3g}, where the bores close, got {stretch:g}", key="stretch")
    return radii(robot, stretch)


@in_own_style
def section_figure(robot: Robot, violations: Sequence[Violation] = (), stretch: float = 1.0) -> Figure:
    """Draw a robot's cross-section to scale with its dimensions, and beside it the section at a stretch other than 1.

    The thread is the dashed ring around each bore. Chambers that break a rule have a red ring, the rules are below.

    Raises
    ------
    InputError
        When the stretch is impossible.
    """
    if isinstance(robot, OutlinedRobot):
        return outlined_figure(robot, violations, stretch)
    states = [("as made", 1.0)] + ([(f"at stretch {stretch:g}", stretch)] if stretch != 1.0 else [])
    radii = [stretched_radii(robot, value) for _, value in states]
    notes = [f"{v.rule}: {v.message}" for v in violations]
    touching = touching_stretch(robot)
    if 1.0 <= touching < stretch:
        notes.append(f"at stretch {stretch:g}: neighbouring reinforced chambers touch above stretch {touching:.3g}")
    lines = [line for note in notes for line in wrap(note, 62 * len(states), subsequent_indent="    ")]

    columns = _LEGEND_COLUMNS * len(states)
    header = 0.85 + _LINE * ((robot.chamber_sets - 1) // columns)
    width, height = PANEL[0] * len(states), PANEL[1] + header + _LINE * len(lines) + 0.1 * bool(lines)
    subtitle = f"length {_number(robot.length / MILLIMETRE)} mm  ·  dimensions in mm"
    figure = new_figure(width, height, robot.name, subtitle)
    broken = {n for v in violations for n in v.chambers}
    for k, (title, _) in enumerate(states):
        bottom = height - header - PANEL[1]
        axes = figure.add_axes((k / len(states), bottom / height, 1 / len(states), PANEL[1] / height))
        red = broken if k == 0 else set(range(robot.chambers)) if touching < stretch else set()
        draw_section(axes, robot, radii[k], title, red, made=k == 0)
        if k == 1:
            _circle(axes, (0, 0), robot.outer_radius, fill=False, edgecolor=GREY, linestyle=(0, (2, 3)), zorder=0)
    for j, line in enumerate(lines):
        y = (0.12 + _LINE * (len(lines) - 1 - j)) / height
        figure.text(0.18 / width, y, line, size=SMALL, color=WRONG, va="bottom")
    _legend(figure, robot, height, columns)
    return figure


def draw_section(axes: Axes, robot: Robot, radii: SectionRadii, title: str, red: Collection[int], made: bool) -> None:
    """Draw one section [mm] with axes, dimensions and title.

    red : chambers (from 0) to mark. made : letters of the section as made (D_r), else of a deformed one (r_r).
    """
    R = robot.outer_radius / MILLIMETRE
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_xlim(_WINDOW[0] * R, _WINDOW[1] * R)
    axes.set_ylim(_WINDOW[2] * R, _WINDOW[3] * R)
    axes.text(_WINDOW[0] * R + 0.1 * R, 1.17 * R, title, size=TEXT, weight="bold", color=INK, va="top")

    _circle(axes, (0, 0), radii.outer, facecolor=SILICONE, edgecolor=INK, linewidth=1.2, zorder=1, label="body")
    _circle(axes, (0, 0), radii.lumen, facecolor="white", edgecolor=INK, linewidth=1.0, zorder=2, label="lumen")
    _circle(
        axes, (0, 0), radii.chamber_circle, fill=False, edgecolor=GREY, linewidth=0.7, linestyle=(0, (8, 3, 2, 3)),
        zorder=2, label="chamber circle",
    )  # fmt: skip
    bore_points = 2 * radii.bore / robot.outer_radius * PANEL[1] * 72 / (_WINDOW[3] - _WINDOW[2])
    for n, (theta, chamber_set) in enumerate(zip(robot.chamber_angles(), robot.set_of_chamber, strict=True)):
        centre = (radii.chamber_circle * cos(theta), radii.chamber_circle * sin(theta))
        _circle(axes, centre, radii.chamber, facecolor=colour(chamber_set), alpha=0.30, linewidth=0, zorder=3)
        _circle(
            axes, centre, radii.chamber, fill=False, edgecolor=INK, linewidth=1.0, linestyle=(0, (2, 1.2)), zorder=4,
            label="thread",
        )  # fmt: skip
        _circle(axes, centre, radii.bore, facecolor=colour(chamber_set), edgecolor="none", zorder=4, label="bore")
        if n in red:
            _circle(
                axes, centre, radii.chamber, fill=False, edgecolor=WRONG, linewidth=2.2, zorder=6, label="broken rule"
            )
        axes.text(
            centre[0] / MILLIMETRE, centre[1] / MILLIMETRE, str(n + 1), color=ink_on(colour(chamber_set)),
            size=min(TEXT, 0.55 * bore_points), weight="bold", ha="center", va="center_baseline", zorder=7,
        )  # fmt: skip
    _axes_cross(axes, R)
    _diameters(axes, radii, R, made)
    _leaders(axes, robot, radii, R, made)


def _circle(axes: Axes, centre: Point, radius: float, **style: object) -> None:
    """Draw a circle given in m."""
    from matplotlib.patches import Circle

    x, y = centre
    axes.add_patch(Circle((x / MILLIMETRE, y / MILLIMETRE), radius / MILLIMETRE, **style))


def _axes_cross(axes: Axes, R: float) -> None:
    """Draw the body axes x and y through the centre; +z points at the reader."""
    arrow = {"arrowstyle": "-|>", **_ARROW}
    for x, y, name in ((1.16, 0.0, "x"), (0.0, 1.16, "y")):
        axes.annotate("", (x * R, y * R), (0, 0), arrowprops=arrow, zorder=2.6)
        axes.text(1.05 * x * R, 1.05 * y * R, name, size=TEXT, color=INK, ha="center", va="center")


def _diameters(axes: Axes, radii: SectionRadii, R: float, made: bool) -> None:
    """Draw the diameters of lumen, chamber circle and body as stacked dimension lines below the section."""
    letters = ("D_i", "D_{cp}", "D_r") if made else ("2 r_i", "2 r_{cp}", "2 r_r")
    stacked = zip((radii.lumen, radii.chamber_circle, radii.outer), letters, strict=True)
    for k, (radius, letter) in enumerate(stacked):
        r, y = radius / MILLIMETRE, -(1.17 + 0.2 * k) * R
        for x in (-r, r):
            axes.plot([x, x], [0, y - 0.04 * R], color=GREY, linewidth=0.5, zorder=2.5)
        axes.annotate("", (-r, y), (r, y), arrowprops={"arrowstyle": "<->", **_ARROW})
        axes.text(
            0, y, f"${letter}$ {_number(2 * r)}", size=SMALL, color=INK, ha="center", va="center", parse_math=True,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.2},
        )  # fmt: skip


def _leaders(axes: Axes, robot: Robot, radii: SectionRadii, R: float, made: bool) -> None:
    """Label walls and bore of one chamber, and the angle between neighbours of a set, in a column on the right."""
    angles = robot.chamber_angles()
    theta = min(angles, key=lambda a: abs((a - _LEADER_ANGLE + pi) % (2 * pi) - pi))
    r_cp, r_co, r_ci, r_r = (r / MILLIMETRE for r in (radii.chamber_circle, radii.chamber, radii.bore, radii.outer))
    along, across = (cos(theta), sin(theta)), (sin(theta), -cos(theta))
    letters = (r"$\delta_c$ ", "$D_c$ ") if made else ("", "$2 r_{ci}$ ")
    points = {
        f"outer wall {_number(r_r - r_cp - r_co)}": _sum(along, (r_cp + r_co + r_r) / 2),
        f"chamber wall {letters[0]}{_number(r_co - r_ci)}": _sum(along, r_cp + (r_ci + r_co) / 2),
        f"bore {letters[1]}{_number(2 * r_ci)}": _sum(along, r_cp, across, 0.75 * r_ci),
        f"thread $2 r_{{co}}$ {_number(2 * r_co)}": _sum(along, r_cp, across, r_co),
    }
    heights = [(0.92 - 0.17 * k) * R for k in range(len(points))]
    # The shortest leaders in total do not cross.
    order = min(
        permutations(points),
        key=lambda names: sum(
            hypot(_COLUMN * R - points[n][0], h - points[n][1]) for n, h in zip(names, heights, strict=True)
        ),
    )
    for text, level in zip(order, heights, strict=True):
        _leader(axes, points[text], level, text, R)
    if robot.chambers_per_set > 1:
        first, second = angles[0], angles[1]
        _angle(axes, first, second, 1.06 * R)
        anchor = first + 0.3 * (second - first)
        text = rf"$\alpha_1$ {_number(degrees(robot.chamber_angle))}°"
        _leader(axes, (1.06 * R * cos(anchor), 1.06 * R * sin(anchor)), -0.25 * R, text, R)


def _sum(a: Point, x: float, b: Point = (0.0, 0.0), y: float = 0.0) -> Point:
    """Return x a + y b."""
    return x * a[0] + y * b[0], x * a[1] + y * b[1]


def _leader(axes: Axes, point: Point, height: float, text: str, R: float) -> None:
    """Write a label in the column at a height, with a line to a point of the drawing."""
    x = _COLUMN * R
    axes.plot([point[0], x - 0.08 * R, x - 0.02 * R], [point[1], height, height], color=INK, linewidth=0.6, zorder=8)
    axes.plot(*point, ".", color=INK, markersize=3, zorder=8)
    axes.text(x, height, text, size=SMALL, color=INK, va="center", parse_math=True)


def _angle(axes: Axes, first: float, second: float, radius: float) -> None:
    """Draw an arc between two angles with a ray to each end."""
    from matplotlib.patches import Arc

    arc = Arc((0, 0), 2 * radius, 2 * radius, theta1=degrees(first), theta2=degrees(second), color=INK, linewidth=0.8)
    axes.add_patch(arc)
    for angle in (first, second):
        end = 1.03 * radius
        axes.plot([0, end * cos(angle)], [0, end * sin(angle)], color=GREY, linewidth=0.5, zorder=2.5)


def _legend(figure: Figure, robot: Robot, height: float, columns: int) -> None:
    from matplotlib.patches import Patch

    handles = []
    for k in range(robot.chamber_sets):
        first, last = k * robot.chambers_per_set + 1, (k + 1) * robot.chambers_per_set
        members = f"chamber {first}" if first == last else f"chambers {first} to {last}"
        handles.append(Patch(color=colour(k), label=f"set {k + 1}: {members}"))
    place: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (0.01, 1 - 0.56 / height), "ncols": columns}
    legend(figure, handles, handlelength=1.2, columnspacing=1.4, **place)


def _number(value: float) -> str:
    """Return a dimension to a thousandth."""
    return f"{round(value, 3):g}"
