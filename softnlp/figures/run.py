"""The figure of a run: every step's shape to scale, and what it did against pressure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from softnlp.base.columns import OUTPUTS
from softnlp.figures.abscissa import abscissa
from softnlp.figures.blocked import blocked_figure
from softnlp.figures.body import body_panel
from softnlp.figures.inverse import inverse_figure
from softnlp.figures.series import finish_panels, new_panels, series
from softnlp.figures.style import GREY, INK, SMALL, WRONG, colour, in_own_style, new_figure
from softnlp.results import RunView
from softnlp.statics.step import STABLE_FLAGS

if TYPE_CHECKING:
    from matplotlib.figure import Figure


BENDING, ELONGATION = OUTPUTS["bending_angle"], OUTPUTS["elongation"]


@in_own_style
def run_figure(view: RunView, measured: Sequence[tuple[float, float]] = ()) -> Figure:
    """Draw a run: a 3-D panel of all shapes, and bending angle and elongation against pressure, time or step.

    A blocked force is drawn at its wall, with `measured` forces over it if given (`blocked_figure`).

    The last solved step is drawn in full, chambers coloured by set, a few others faintly, and the axis of each. Steps
    without a solution are crosses at the foot of the panels; unstable ones are hollow.
    """
    if view.contact is not None:
        return blocked_figure(view, view.contact, measured)
    if view.targets is not None:
        return inverse_figure(view, view.targets)
    total, solved = len(view.status), len(view.solved)
    parts = [view.robot.name, view.material, view.conventions, f"{solved} of {total} steps solved"]
    figure = new_figure(10.0, 5.4, view.title or view.robot.name, "  ·  ".join(parts))
    body_panel(figure, (2.85, 2.55), view)
    _set_legend(figure, view)

    x = abscissa(view)
    panels = new_panels(figure, 3 if x.with_pressures else 2)
    series(panels[0], view, x, BENDING.shown(view.bending_angle), BENDING.heading)
    longer = ELONGATION.shown(view.backbone_length - view.robot.length)
    series(panels[1], view, x, longer, ELONGATION.axis)
    finish_panels(figure, panels, view, x)
    return figure


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
    stable = view.stable[list(view.solved)]
    if np.any(stable == STABLE_FLAGS["unstable"]):
        marks.append(Line2D([], [], color=GREY, marker="o", markerfacecolor="white", linestyle="", label="unstable"))
    if np.any(stable == STABLE_FLAGS["undefined"]):
        marks.append(Line2D([], [], color=GREY, marker="o", linestyle="", label="stability undefined"))
    if marks:
        figure.legend(handles=marks, loc="upper right", bbox_to_anchor=(0.99, 0.935), ncols=len(marks), **style)
    if view.solved:
        caption = f"Step {view.solved[-1] + 1} cut open, chambers without pressure pale"
        if len(view.solved) > 1:
            caption += "; other steps in the colours of the markers on the right"
    else:
        caption = "No step has a solution, so no shape is shown"
    figure.text(0.018, 0.018, caption, size=SMALL, color=GREY)
