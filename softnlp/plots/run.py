"""The figure of a run: every step's shape to scale, and what it did against pressure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from softnlp.plots.body import body_panel
from softnlp.plots.style import GREY, INK, SMALL, WRONG, colour, listed, new_figure, plain, step_colours
from softnlp.results import RunView
from softnlp.units import BAR, DEGREE, MILLIMETRE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]


STEP = "step"
LEAST_SPAN = 1.0  # of a vertical axis [deg or mm]


@dataclass(frozen=True, eq=False)
class Abscissa:
    """What the panels are drawn against. values : (steps,). with_pressures : whether a panel of pressures is needed."""

    values: Array
    label: str
    with_pressures: bool


def abscissa(view: RunView) -> Abscissa:
    """Choose the pressure where one number tells it, else time, else the step.

    One number tells the pressure where the sets that are used all have the same, and others none.
    """
    P = view.pressure
    used = [k for k in range(P.shape[1]) if np.any(P[:, k] > 0)]
    if used and np.ptp(P[:, used[0]]) > 0 and all(np.allclose(P[:, k], P[:, used[0]]) for k in used):
        names = listed([str(k + 1) for k in used])
        label = f"pressure of set{'s' if len(used) > 1 else ''} {names} [bar]"
        return Abscissa(P[:, used[0]] / BAR, label, False)
    if view.time is not None:
        return Abscissa(view.time, "time [s]", True)
    return Abscissa(np.arange(1, len(P) + 1, dtype=float), STEP, True)


def run_figure(view: RunView) -> Figure:
    """Draw a run: a 3-D panel of all shapes, and bending angle and elongation against pressure, time or step.

    The last solved step is drawn in full, chambers coloured by set, a few others faintly, and the axis of each. Steps
    without a solution are crosses at the foot of the panels; unstable ones are hollow.
    """
    from matplotlib.ticker import MaxNLocator

    total, solved = len(view.status), len(view.solved)
    parts = [view.robot.name, view.material, view.conventions, f"{solved} of {total} steps solved"]
    figure = new_figure(10.0, 5.4, view.title or view.robot.name, "  ·  ".join(parts))
    body_panel(figure, (2.85, 2.55), view)
    _set_legend(figure, view)

    x = abscissa(view)
    rows = 3 if x.with_pressures else 2
    panels: list[Axes] = []
    top, bottom, gap = 0.865, 0.105, 0.055
    height = (top - bottom - gap * (rows - 1)) / rows
    for row in range(rows):
        box = (0.645, top - (row + 1) * height - row * gap, 0.335, height)
        panels.append(figure.add_axes(box, sharex=panels[0] if panels else None))
    _series(panels[0], view, x, view.bending_angle / DEGREE, "bending [deg]")
    _series(panels[1], view, x, (view.backbone_length - view.robot.length) / MILLIMETRE, "elongation [mm]")
    if x.with_pressures:
        _pressures(panels[2], view, x)
    for panel in panels[:-1]:
        panel.set_xlabel("")
        panel.tick_params(labelbottom=False)
    if x.label == STEP:
        panels[0].set_xlim(0.5, total + 0.5)
        panels[0].xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    figure.align_ylabels(panels)
    return figure


def _series(axes: Axes, view: RunView, x: Abscissa, y: Array, label: str) -> None:
    plain(axes, x.label, label)
    shades = step_colours(len(y))
    axes.plot(x.values, y, color=GREY, linewidth=1.0, zorder=2)
    faces = np.where(view.stable[:, None], shades, 1.0)
    size = float(np.clip(1000 / len(y), 5, 26))
    axes.scatter(
        x.values, y, s=size, c=faces, edgecolors=list(map(tuple, shades)), linewidths=1.2, zorder=3, label="steps"
    )
    failed = [k for k in range(len(y)) if k not in view.solved]
    if failed:
        foot, place = axes.get_xaxis_transform(), [0.05] * len(failed)
        axes.plot(x.values[failed], place, "x", color=WRONG, markersize=6, transform=foot, label="no solution")
    axes.ticklabel_format(useOffset=False)
    known = y[np.isfinite(y)]
    if known.size == 0:
        axes.set_yticks([])
    elif np.ptp(known) < LEAST_SPAN:
        # Rounding errors about a constant are not worth a panel's height.
        middle = (known.min() + known.max()) / 2
        axes.set_ylim(middle - 0.55 * LEAST_SPAN, middle + 0.55 * LEAST_SPAN)


def _pressures(axes: Axes, view: RunView, x: Abscissa) -> None:
    plain(axes, x.label, "pressure [bar]")
    for k in range(view.pressure.shape[1]):
        axes.plot(x.values, view.pressure[:, k] / BAR, color=colour(k), linewidth=1.5, marker=".", label=f"set {k + 1}")


def _set_legend(figure: Figure, view: RunView) -> None:
    """Say what colours and marks mean, in one line for the shapes and one for the panels where it is needed."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    style = {"fontsize": SMALL, "frameon": False, "labelcolor": INK, "handlelength": 1.2, "columnspacing": 1.4}
    sets = [Patch(color=colour(k), label=f"set {k + 1}") for k in range(view.robot.chamber_sets)]
    figure.legend(handles=sets, loc="upper left", bbox_to_anchor=(0.01, 0.885), ncols=min(len(sets), 6), **style)

    marks = []
    if len(view.solved) < len(view.status):
        marks.append(Line2D([], [], color=WRONG, marker="x", linestyle="", label="no solution"))
    if not view.stable[list(view.solved)].all():
        marks.append(Line2D([], [], color=GREY, marker="o", markerfacecolor="white", linestyle="", label="unstable"))
    if marks:
        figure.legend(handles=marks, loc="upper right", bbox_to_anchor=(0.99, 0.935), ncols=len(marks), **style)
    if view.solved:
        caption = f"Step {view.solved[-1] + 1} cut open, chambers without pressure pale"
        if len(view.solved) > 1:
            caption += "; other steps in the colours of the markers on the right"
    else:
        caption = "No step has a solution, so no shape is shown"
    figure.text(0.018, 0.018, caption, size=SMALL, color=GREY)
