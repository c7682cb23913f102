"""The figure of a run in time: shapes in 3-D; the tip, the pressures and the energies over time."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from softnlp.base.columns import OUTPUTS
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.figures.body import body_panel
from softnlp.figures.series import LEAST_SPAN, new_panels
from softnlp.figures.style import GREY, INK, SMALL, WRONG, colour, in_own_style, legend, new_figure, plain
from softnlp.results import MovingView, RunView

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_CENTRE = (2.85, 2.55)  # of the panel in 3-D [inch]
_ENERGIES = ("kinetic", "elastic", "gravity", "dissipated", "numerical")
_WORKS = ("pressure_work", "load_work")
_COUNTS = 1e-4  # of the largest energy: what is drawn
_DASHES: Any = (0, (4, 2))


@in_own_style
def dynamic_figure(view: RunView, moving: MovingView) -> Figure:
    """Draw a run in time.

    In 3-D the last shape in full, a few others and the axes of all. Beside them where the tip is, pressures in the
    chambers and, dashed, at the regulators, and the energies with the works that they come from, dashed.
    """
    assert view.time is not None
    head = (view.robot.name, view.material, view.conventions, f"{len(view.solved)} of {len(view.status)} times solved")
    figure = new_figure(10.0, 6.4, view.title or view.robot.name, "  ·  ".join(head))
    body_panel(figure, _CENTRE, view)
    panels = new_panels(figure, 3)
    tip, pressures, energies = panels
    _tip(tip, view, moving)
    _pressures(pressures, view, moving)
    _energies(energies, view, moving)
    for panel in panels[:-1]:
        panel.set_xlabel("")
        panel.tick_params(labelbottom=False)
    figure.align_ylabels(panels)
    for panel in panels:
        if panel.get_legend_handles_labels()[0]:  # none where nothing moved or no pressure or energy is other than 0
            legend(panel, None, loc="upper right", ncols=4, handlelength=1.2, columnspacing=1.0)
        low, high = panel.get_ylim()
        panel.set_ylim(low, high + 0.3 * (high - low))  # room for the legend
    last = view.solved[-1] if view.solved else None
    caption = "no time is solved, so no shape is shown"
    if last is not None:
        caption = f"the shape at t = {view.time[last]:g} s cut open, chambers without pressure pale; others behind it"
    figure.text(0.018, 0.018, caption, size=SMALL, color=GREY)
    return figure


def _tip(axes: Axes, view: RunView, moving: MovingView) -> None:
    plain(axes, OUTPUTS["t"].axis, "tip moved by [mm]")
    first = moving.tip[view.solved[0]] if view.solved else np.zeros(3)
    moved = (moving.tip - first) / MILLIMETRE
    for k, name in enumerate("xyz"):
        axes.plot(view.time, moved[:, k], color=(INK, colour(1), GREY)[k], linewidth=1.3, label=name)  # type: ignore[arg-type]
    known = moved[np.isfinite(moved)]
    if known.size and np.ptp(known) < LEAST_SPAN * 1e-3:
        axes.set_ylim(-0.5 * LEAST_SPAN, 0.5 * LEAST_SPAN)
    failed = [k for k in range(len(view.status)) if k not in view.solved]
    if failed:
        foot, time = axes.get_xaxis_transform(), np.asarray(view.time)
        axes.plot(time[failed], [0.05] * len(failed), "x", color=WRONG, markersize=6, transform=foot, label="failed")


def _pressures(axes: Axes, view: RunView, moving: MovingView) -> None:
    plain(axes, OUTPUTS["t"].axis, "pressure [bar]")
    for k in range(view.pressure.shape[1]):
        chamber, regulator = view.pressure[:, k] / BAR, moving.regulator[:, k] / BAR
        axes.plot(view.time, chamber, color=colour(k), linewidth=1.4, label=f"set {k + 1}")  # type: ignore[arg-type]
        if np.nanmax(np.abs(regulator - chamber), initial=0.0) > 1e-6:
            axes.plot(view.time, regulator, color=colour(k), linewidth=0.9, linestyle=_DASHES)  # type: ignore[arg-type]


def _energies(axes: Axes, view: RunView, moving: MovingView) -> None:
    plain(axes, OUTPUTS["t"].axis, "energy [mJ]")
    largest = max(float(np.nanmax(np.abs(values), initial=0.0)) for values in moving.energy.values())
    for k, name in enumerate((*_ENERGIES, *_WORKS)):
        values = moving.energy[name]
        if np.nanmax(np.abs(values), initial=0.0) <= _COUNTS * largest:
            continue
        line = _DASHES if name in _WORKS else "-"
        label = name.replace("_", " ")
        axes.plot(view.time, 1e3 * values, color=colour(k), linewidth=1.2, linestyle=line, label=label)  # type: ignore[arg-type]
