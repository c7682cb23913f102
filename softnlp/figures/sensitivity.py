"""The figure of sensitivities: the shape with ellipsoids at its tip, the Jacobian, and what error bars come from."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softnlp.base.arrays import Array
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.figures.body import frame, side_camera, tube
from softnlp.figures.space import axes_3d, draw_faces
from softnlp.figures.style import (
    GREY,
    INK,
    PALE,
    SMALL,
    TEXT,
    colour,
    in_own_style,
    legend,
    new_figure,
    plain,
    user_text,
)
from softnlp.model.gravity import gravity_lines
from softnlp.results import Body
from softnlp.results.sensitivity import shown
from softnlp.studies.derivatives import entries_of
from softnlp.studies.ellipsoids import Ellipsoid
from softnlp.studies.report import SensitivityReport

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_SIZE = 0.3  # largest semi-axis of an ellipsoid drawn, of L_0
_MOST_BARS = 10


@in_own_style
def sensitivity_figure(report: SensitivityReport, title: str) -> Figure:
    """Draw the shape with its ellipsoids, the tip's Jacobian, and what each tolerance, or 1 %, does to the tip.

    The ellipsoids are scaled to one size; their semi-axes are in the caption. Without a solution the figure says so.
    """
    s = report.sensitivities
    figure = new_figure(10.0, 5.4, title, f"{report.robot.name}  ·  {report.material.name}  ·  {s.step.status.value}")
    if not report.solved or report.pose is None:
        figure.text(0.5, 0.5, "No solution, so no sensitivities", size=TEXT, color=GREY, ha="center")
        return figure
    _tip_panel(figure, report)
    _jacobian(figure.add_axes((0.60, 0.60, 0.37, 0.26)), report)
    _tornado(figure.add_axes((0.70, 0.115, 0.27, 0.36)), report)
    return figure


def _tip_panel(figure: Figure, report: SensitivityReport) -> None:
    """Draw the body's axis and outline, and the ellipsoids about the tip [mm]."""
    pose = report.pose
    assert pose is not None
    axes = axes_3d(figure, (0.0, 0.12, 0.52, 0.7))
    gravity = report.loads.gravity
    side_camera(pose.tip_position[:2], 0.02 * report.robot.length, gravity).aim(axes)
    for words in gravity_lines(gravity):
        figure.text(0.018, 0.053, words, size=SMALL, color=GREY)
    quads, _ = tube(Body(pose.shape.position, pose.shape.rotation, pose.radii), pose.radii.outer, (0, 0), 24, 16)
    draw_faces(axes, quads, "#F3F1EE", PALE, 0.3, alpha=0.35, zorder=2)
    line = pose.shape.position / MILLIMETRE
    axes.plot(*line.T, color=GREY, linewidth=1.2, zorder=3)
    reach = [quads.reshape(-1, 3)]
    notes = []
    drawn = (
        ("moved by pressure", report.manipulability.translation, colour(0), MILLIMETRE / BAR, "mm/bar"),
        ("compliance", report.compliance, colour(1), MILLIMETRE, "mm/N"),
    )
    for name, ellipsoid, ink, scale, unit in drawn:
        reach.append(_draw_ellipsoid(axes, ellipsoid, line[-1], _SIZE * report.robot.length / MILLIMETRE, ink, name))
        sizes = ", ".join(f"{v / scale:.3g}" for v in ellipsoid.semi_axes)
        notes.append((f"{name}: semi-axes {sizes} {unit}", ink))
    stiff = ", ".join(f"{v * MILLIMETRE:.3g}" for v in report.stiffness.semi_axes)
    notes.append((f"stiffness, the inverse of compliance: {stiff} N/mm", GREY))
    frame(axes, np.vstack(reach))
    for k, (text, ink) in enumerate(notes):
        figure.text(0.018, 0.865 - 0.034 * k, text, size=SMALL, color=ink)


def _draw_ellipsoid(axes: Any, ellipsoid: Ellipsoid, centre: Array, size: float, ink: str, label: str) -> Array:
    """Draw an ellipsoid scaled to a largest semi-axis [mm]; return points it reaches."""
    a, b = np.meshgrid(np.linspace(0, 2 * np.pi, 25), np.linspace(0, np.pi, 13))
    ball = np.stack([np.cos(a) * np.sin(b), np.sin(a) * np.sin(b), np.cos(b)])
    scaled = ellipsoid.axes * (ellipsoid.semi_axes / max(float(ellipsoid.semi_axes[0]), 1e-300) * size)
    points = np.einsum("ij,jkl->ikl", scaled, ball) + centre[:, None, None]
    axes.plot_wireframe(*points, color=ink, linewidth=0.5, alpha=0.7, rstride=2, cstride=2, zorder=5, label=label)
    for k in range(3):
        ends = np.array([centre - scaled[:, k], centre + scaled[:, k]])
        axes.plot(*ends.T, color=ink, linewidth=1.4, zorder=6)
    corners: Array = points.reshape(3, -1).T
    return corners


def _jacobian(axes: Axes, report: SensitivityReport) -> None:
    """Draw how far a bar more in each set moves the tip, a group of bars an axis."""
    J = report.sensitivities.of("tip_position", "pressure") * BAR / MILLIMETRE
    plain(axes, "", "tip by pressure [mm/bar]")
    sets = J.shape[1]
    width = 0.8 / sets
    for k in range(sets):
        place = np.arange(3) + (k - (sets - 1) / 2) * width
        axes.bar(place, J[:, k], width, color=colour(k), label=f"set {k + 1}")
    axes.axhline(0, color=GREY, linewidth=0.8)
    axes.set_xticks(np.arange(3), ["x", "y", "z"])
    legend(axes, ncols=min(sets, 6), loc="lower right", bbox_to_anchor=(1.0, 1.0))


def _tornado(axes: Axes, report: SensitivityReport) -> None:
    """Draw what each tolerance adds to the bending angle's and tip's deviation; without tolerances what 1 % does."""
    s, bars = report.sensitivities, report.bars
    rows = entries_of(s.outputs, "tip_position")
    if bars is not None:
        names, moved = bars.quantities, bars.contribution[rows]
        total = float(np.linalg.norm(bars.total[rows])) / MILLIMETRE
        label = f"tip deviation by tolerance [mm], together {total:.3g}"
    else:
        kept = [k for k, q in enumerate(s.quantities) if not q.startswith(("tip_", "gravity")) and s.nominal[k] != 0]
        names, moved = tuple(s.quantities[k] for k in kept), 0.01 * s.matrix[np.ix_(rows, kept)] * s.nominal[kept]
        label = "tip moved by 1 % more [mm]"
    sizes = np.linalg.norm(moved, axis=0) / MILLIMETRE
    order = np.argsort(sizes)[::-1][:_MOST_BARS][::-1]
    plain(axes, label, "")
    axes.barh(np.arange(len(order)), sizes[order], color=colour(2), height=0.7)
    axes.set_yticks(np.arange(len(order)), [user_text(names[k]) for k in order])
    if bars is not None and report.sampled is not None:
        angle = s.outputs.index("bending_angle")
        unit, scale = shown(s.output_units[angle])
        axes.set_title(
            f"bending ± {bars.total[angle] / scale:.3g} {unit}, sampled {report.sampled.deviation[angle] / scale:.3g}",
            size=SMALL,
            color=INK,
            loc="right",
        )
