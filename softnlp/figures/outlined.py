"""The cross-section of a robot of any outline to scale, as made and stretched, and the rules that it breaks."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from math import isfinite
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from softnlp.base.arrays import Array
from softnlp.base.errors import InputError
from softnlp.base.units import MILLIMETRE
from softnlp.figures.mesh.outlines import Ringed, drawn_section
from softnlp.figures.style import INK, SMALL, TEXT, WRONG, colour, ink_on, legend, new_figure
from softnlp.model.outlined import OutlinedRobot
from softnlp.model.robot import Violation
from softnlp.model.section import SectionRadii

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SILICONE = "#EFEBE4"
_PANEL = 4.4  # side of a drawing [inch]
_HEADER, _LINE = 0.95, 0.19  # above the drawings, and of a line of text below [inch]
_FACETS = 180
_WIDEST = 1.28  # half the width of a drawing, of the circle that the body fits in
_THREAD: dict[str, Any] = {"color": INK, "linewidth": 1.0, "linestyle": (0, (2, 1.2))}


def outlined_figure(robot: OutlinedRobot, violations: Sequence[Violation], stretch: float) -> Figure:
    """Draw a section as `softnlp.figures.section.section_figure` does.

    Raises
    ------
    InputError
        When the stretch is impossible.
    """
    least = max(
        1 - chamber.bore().area / area.area for chamber, area in zip(robot.chamber_list, robot.held, strict=True)
    )
    if not isfinite(stretch) or stretch <= max(least, 0.0):
        raise InputError(f"expected a stretch above {max(least, 0.0):.3g}, got {stretch:g}", key="stretch")
    states = [("as made", 1.0)] + ([(f"at stretch {stretch:g}", stretch)] if stretch != 1.0 else [])
    lines = [line for v in violations for line in wrap(f"{v.rule}: {v.message}", 62 * len(states))]
    width = _PANEL * len(states)
    height = _PANEL + _HEADER + _LINE * len(lines) + 0.1 * bool(lines)
    around = "each chamber" if robot.reinforcement == "chamber" else "the body"
    subtitle = f"length {robot.length / MILLIMETRE:.4g} mm  ·  thread around {around}"
    figure = new_figure(width, height, robot.name, subtitle)
    broken = {n for v in violations for n in v.chambers}
    for k, (title, value) in enumerate(states):
        box = (k / len(states), 1 - (_HEADER + _PANEL) / height, 1 / len(states), _PANEL / height)
        draw_outlined(figure.add_axes(box), robot, value, title, broken if k == 0 else set())
    for j, line in enumerate(lines):
        figure.text(
            0.18 / width, (0.12 + _LINE * (len(lines) - 1 - j)) / height, line, size=SMALL, color=WRONG, va="bottom"
        )
    _legend(figure, robot, height)
    return figure


def outlined_radii(robot: OutlinedRobot, stretch: float) -> SectionRadii:
    """Return the radii that say how far a section has shrunk; of a body that is wound as a whole it has not."""
    shrink = stretch**-0.5 if robot.reinforcement == "chamber" else 1.0
    return SectionRadii(robot.outer_radius * shrink, robot.lumen_radius * shrink, np.nan, np.nan, np.nan)


def draw_outlined(axes: Axes, robot: OutlinedRobot, stretch: float, title: str, red: Collection[int]) -> None:
    """Draw one section [mm] with axes, sizes and title. red : chambers (from 0) to mark."""
    R = robot.outer_radius / MILLIMETRE
    drawn = drawn_section(robot, outlined_radii(robot, stretch), _FACETS)
    axes.set_aspect("equal")
    axes.set_axis_off()
    axes.set_xlim(-_WIDEST * R, _WIDEST * R)
    axes.set_ylim(-_WIDEST * R, _WIDEST * R)
    axes.text(-_WIDEST * R + 0.1 * R, 1.2 * R, title, size=TEXT, weight="bold", color=INK, va="top")
    _fill(axes, Ringed(drawn.surface, None), facecolor=SILICONE, edgecolor=INK, linewidth=1.2, zorder=1, label="body")
    if drawn.lumen is not None:
        _fill(axes, Ringed(drawn.lumen, None), facecolor="white", edgecolor=INK, linewidth=1.0, zorder=2, label="lumen")
    for n, (bore, chamber_set) in enumerate(zip(drawn.bores, robot.set_of_chamber, strict=True)):
        own = colour(chamber_set)
        if drawn.threads:
            _fill(axes, drawn.threads[n], facecolor=own, alpha=0.30, linewidth=0, zorder=3)
            _lines(axes, drawn.threads[n], **_THREAD, zorder=5, label="thread")
        _fill(axes, bore, facecolor=own, edgecolor="none", zorder=4, label="bore")
        if n in red:
            _lines(axes, (drawn.threads or drawn.bores)[n], color=WRONG, linewidth=2.2, zorder=6, label="broken rule")
        x, y = _label_place(bore) / MILLIMETRE
        axes.text(
            x, y, str(n + 1), color=ink_on(own), size=TEXT, weight="bold", ha="center", va="center_baseline", zorder=7
        )
    if not drawn.threads:
        _lines(axes, Ringed(drawn.surface * 1.0, None), **_THREAD | {"linewidth": 2.4}, zorder=5, label="thread")
    arrow: dict[str, Any] = {"arrowstyle": "-|>", "color": INK, "linewidth": 0.8, "shrinkA": 0, "shrinkB": 0}
    for u, w, name in ((1.14, 0.0, "x"), (0.0, 1.14, "y")):
        axes.annotate("", (u * R, w * R), (0, 0), arrowprops=arrow, zorder=5.5)
        axes.text(1.06 * u * R, 1.06 * w * R, name, size=TEXT, color=INK, ha="center", va="center")
    low, high = drawn.surface.min(axis=0) / MILLIMETRE, drawn.surface.max(axis=0) / MILLIMETRE
    level = low[1] - 0.1 * R
    axes.annotate("", (low[0], level), (high[0], level), arrowprops={**arrow, "arrowstyle": "<->"})
    axes.text(
        (low[0] + high[0]) / 2, level, f"{high[0] - low[0]:.4g} mm", size=SMALL, color=INK, ha="center", va="center",
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.2},
    )  # fmt: skip


def _label_place(bore: Ringed) -> Array:
    """Return where a chamber's number stands: in the middle of its bore, or of an annulus on its left."""
    if bore.inner is None:
        return np.asarray((bore.outer.min(axis=0) + bore.outer.max(axis=0)) / 2)
    outer, inner = bore.outer[bore.outer[:, 0].argmin()], bore.inner[bore.inner[:, 0].argmin()]
    return np.asarray((outer + inner) / 2)


def _fill(axes: Axes, area: Ringed, **style: object) -> None:
    """Fill an area given in m."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    loops = [area.outer] + ([] if area.inner is None else [area.inner[::-1]])
    parts = [Path(np.vstack([loop, loop[:1]]) / MILLIMETRE, closed=True) for loop in loops]
    axes.add_patch(PathPatch(Path.make_compound_path(*parts), **style))


def _lines(axes: Axes, area: Ringed, label: str = "", **style: Any) -> None:
    """Draw the outlines of an area given in m."""
    for loop in [area.outer] + ([] if area.inner is None else [area.inner]):
        axes.plot(*(np.vstack([loop, loop[:1]]) / MILLIMETRE).T, label=label, **style)


def _legend(figure: Figure, robot: OutlinedRobot, height: float) -> None:
    from matplotlib.patches import Patch

    handles = []
    for k in range(robot.chamber_sets):
        own = [str(n + 1) for n, chamber_set in enumerate(robot.set_of_chamber) if chamber_set == k]
        many = "chamber" if len(own) == 1 else "chambers"
        handles.append(Patch(color=colour(k), label=f"set {k + 1}: {many} {', '.join(own)}"))
    place: dict[str, Any] = {"loc": "upper left", "bbox_to_anchor": (0.01, 1 - 0.56 / height), "ncols": 3}
    legend(figure, handles, handlelength=1.2, columnspacing=1.4, **place)
