"""The figure of inverse kinematics: targets and tips with the shapes, and pressures and what is left a target."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.columns import OUTPUTS
from softnlp.base.units import MILLIMETRE
from softnlp.figures.abscissa import STEP, Abscissa
from softnlp.figures.body import body_panel, frame
from softnlp.figures.series import finish_panels, new_panels, series
from softnlp.figures.style import GREY, INK, SMALL, WRONG, colour, in_own_style, new_figure, plain
from softnlp.results import RunView, TargetView

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

_LEAST_LEFT = 1e-9  # [mm] or [deg]: below it what is left is drawn at the foot of its axis
_ARROW = 0.22  # of L_0


BENDING, DISTANCE, ANGLE = (OUTPUTS[name] for name in ("bending_angle", "distance", "direction_error"))


@in_own_style
def inverse_figure(view: RunView, targets: TargetView) -> Figure:
    """Draw a run of inverse kinematics.

    In 3-D the shapes, the path of targets as open squares and of tips as dots, joined where the target is out of reach.
    Beside it what is left of each target, on a logarithmic axis, the bending angle and the pressure of each set.
    """
    total, solved = len(view.status), len(view.solved)
    parts = [view.robot.name, view.material, view.conventions, f"{solved} of {total} targets met"]
    figure = new_figure(10.0, 5.4, view.title or view.robot.name, "  ·  ".join(parts))
    axes = body_panel(figure, (2.85, 2.55), view)
    _draw_targets(axes, view, targets)

    x = Abscissa(np.arange(1, total + 1, dtype=float), STEP, True)
    panels = new_panels(figure, 3)
    _left(panels[0], x, targets)
    series(panels[1], view, x, BENDING.shown(view.bending_angle), BENDING.heading)
    finish_panels(figure, panels, view, x)
    panels[-1].set_xlabel("target")
    _legend(figure, view, targets)
    return figure


def _draw_targets(axes: Any, view: RunView, targets: TargetView) -> None:
    """Draw targets and tips [mm] and make room for them."""
    goal, tip = targets.position / MILLIMETRE, targets.tip / MILLIMETRE
    reach = [np.array([axes.get_xlim(), axes.get_ylim(), axes.get_zlim()]).T]
    known = np.asarray(np.isfinite(tip).all(axis=1))
    if known.any():
        axes.plot(*tip[known].T, ".", color=INK, markersize=3.5, zorder=7, label="tips")
        reach.append(tip[known])
    there = np.asarray(np.isfinite(goal).all(axis=1))
    if there.any():
        line = "-" if there.sum() > 1 else ""
        style: dict[str, Any] = {"markerfacecolor": "none", "markersize": 5, "linewidth": 0.7, "zorder": 6.5}
        axes.plot(*goal[there].T, marker="s", linestyle=line, color=WRONG, label="targets", **style)
        reach.append(goal[there])
    for k in range(len(goal)):
        if targets.distance[k] > 1e-3 * view.robot.length:
            axes.plot(*np.array([goal[k], tip[k]]).T, color=GREY, linewidth=0.8, linestyle=":", zorder=6.4)
    size = _ARROW * view.robot.length / MILLIMETRE
    for k in range(len(goal)):
        if not (np.isfinite(targets.direction[k]).all() and (there[k] or known[k])):
            continue
        start = goal[k] if there[k] else tip[k]
        end = start + size * targets.direction[k]
        axes.plot(*np.array([start, end]).T, color=WRONG, linewidth=0.9, zorder=6.5)
        reach.append(end[None])
    frame(axes, np.vstack(reach))


def _left(axes: Axes, x: Abscissa, targets: TargetView) -> None:
    """Draw distance and angle left."""
    distance, angle = DISTANCE.shown(targets.distance), ANGLE.shown(targets.angle)
    names = []
    for values, unit, name, mark, ink in (
        (distance, DISTANCE.unit, "distance", "o", INK),
        (angle, ANGLE.unit, "direction", "^", colour(1)),
    ):
        if np.isfinite(values).any():
            names.append(f"{name} [{unit}]")
            shown = np.maximum(values, _LEAST_LEFT)
            axes.plot(x.values, shown, mark, color=ink, markersize=3.5, label=f"{name} left")
    plain(axes, x.label, f"left: {', '.join(names)}" if len(names) == 1 else f"left [{DISTANCE.unit}], [{ANGLE.unit}]")
    axes.set_yscale("log")
    everything = np.concatenate([distance, angle, [_LEAST_LEFT]])
    axes.set_ylim(_LEAST_LEFT / 3, max(1e-3, 5 * float(np.nanmax(everything))))
    if len(names) > 1:
        axes.legend(fontsize=SMALL, frameon=False, labelcolor=INK)


def _legend(figure: Figure, view: RunView, targets: TargetView) -> None:
    """Say what colours and marks mean."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    style: dict[str, Any] = {"fontsize": SMALL, "frameon": False, "labelcolor": INK, "handlelength": 1.2}
    marks: list[Any] = [Patch(color=colour(k), label=f"set {k + 1}") for k in range(view.robot.chamber_sets)]
    if np.isfinite(targets.position).any():
        marks.append(Line2D([], [], color=WRONG, marker="s", markerfacecolor="none", linestyle="", label="target"))
    if np.isfinite(targets.direction).any():
        marks.append(Line2D([], [], color=WRONG, linewidth=0.9, label="its direction"))
    marks.append(Line2D([], [], color=INK, marker=".", linestyle="", label="tip"))
    if len(view.solved) < len(view.status):
        marks.append(Line2D([], [], color=WRONG, marker="x", linestyle="", label="out of reach"))
    figure.legend(handles=marks, loc="upper left", bbox_to_anchor=(0.01, 0.885), ncols=6, columnspacing=1.2, **style)
    caption = "No target is met, so no shape is shown; dots are the nearest tips"
    if view.solved:
        caption = f"Target {view.solved[-1] + 1} cut open, chambers without pressure pale"
    figure.text(0.018, 0.018, caption, size=SMALL, color=GREY)
