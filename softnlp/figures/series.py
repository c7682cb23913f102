"""The flat panels of a run: numbers of its steps, one below the other, and what they are drawn against."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from softnlp.base.arrays import Array
from softnlp.base.columns import OUTPUTS
from softnlp.base.units import BAR
from softnlp.figures.style import GREY, WRONG, colour, listed, plain, step_colours
from softnlp.results import RunView
from softnlp.statics.step import STABLE_FLAGS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LEAST_SPAN = 1.0  # of a vertical axis [deg or mm]
STEP = "step"
BAND, BAND_LABEL = "#CBD9EA", "one standard deviation"


@dataclass(frozen=True, eq=False)
class Abscissa:
    """What the panels are drawn against. values : (steps,). with_pressures : whether a panel of pressures is needed.

    unit : of the values in SI.
    """

    values: Array
    label: str
    with_pressures: bool
    unit: float = 1.0


def abscissa(view: RunView) -> Abscissa:
    """Choose the pressure where one number tells it, else time, else the step.

    One number tells the pressure where the sets that are used all have the same, and others none.
    """
    P = view.pressure
    used = [k for k in range(P.shape[1]) if np.any(P[:, k] > 0)]
    if used and np.ptp(P[:, used[0]]) > 0 and all(np.allclose(P[:, k], P[:, used[0]]) for k in used):
        names = listed([str(k + 1) for k in used])
        label = f"pressure of set{'s' if len(used) > 1 else ''} {names} [bar]"
        return Abscissa(P[:, used[0]] / BAR, label, False, BAR)
    if view.time is not None:
        return Abscissa(view.time, OUTPUTS["t"].axis, True)
    return Abscissa(np.arange(1, len(P) + 1, dtype=float), STEP, True)


def new_panels(figure: Figure, rows: int) -> list[Axes]:
    """Return panels at the right of a figure, one below the other, with one horizontal axis."""
    panels: list[Axes] = []
    top, bottom, gap = 0.865, 0.105, 0.055
    height = (top - bottom - gap * (rows - 1)) / rows
    for row in range(rows):
        box = (0.645, top - (row + 1) * height - row * gap, 0.335, height)
        panels.append(figure.add_axes(box, sharex=panels[0] if panels else None))
    return panels


def finish_panels(figure: Figure, panels: Sequence[Axes], view: RunView, x: Abscissa) -> None:
    """Draw the pressures where they need a panel, the last one; label the lowest panel alone."""
    from matplotlib.ticker import MaxNLocator

    if x.with_pressures:
        pressures(panels[-1], view, x)
    for panel in panels[:-1]:
        panel.set_xlabel("")
        panel.tick_params(labelbottom=False)
    if x.label == STEP:
        panels[0].set_xlim(0.5, len(view.status) + 0.5)
        panels[0].xaxis.set_major_locator(MaxNLocator(integer=True, min_n_ticks=1))
    figure.align_ylabels(panels)


def series(
    axes: Axes,
    view: RunView,
    x: Abscissa,
    y: Array,
    label: str,
    least_span: float = LEAST_SPAN,
    std: Array | None = None,
) -> None:
    """Draw one number of each step; steps without a solution are crosses at the foot, unstable ones hollow.

    std : one standard deviation, drawn as a band, or as a bar where its neighbours have none.
    """
    plain(axes, x.label, label)
    if std is not None:
        _band(axes, x.values, y, std)
    shades = step_colours(len(y))
    axes.plot(x.values, y, color=GREY, linewidth=1.0, zorder=2)
    faces = np.where((view.stable == STABLE_FLAGS["unstable"])[:, None], 1.0, shades)
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
    if std is not None:
        spread = np.nan_to_num(std)
        known = np.concatenate([known, (y - spread)[np.isfinite(y)], (y + spread)[np.isfinite(y)]])
    if known.size == 0:
        axes.set_yticks([])
    elif np.ptp(known) < least_span:
        # Rounding errors about a constant are not worth a panel's height.
        middle = (known.min() + known.max()) / 2
        axes.set_ylim(middle - 0.55 * least_span, middle + 0.55 * least_span)


def _band(axes: Axes, x: Array, y: Array, std: Array) -> None:
    """Draw a band of one standard deviation about steps whose x rises, and bars about others."""
    known = np.isfinite(y) & np.isfinite(std)
    look: dict[str, Any] = {"color": BAND, "zorder": 1.5, "label": BAND_LABEL}
    if np.all(np.diff(x) > 0):
        axes.fill_between(x, y - std, y + std, where=known, linewidth=0.0, **look)
        known &= ~(np.append(known[1:], False) | np.append(False, known[:-1]))
    if known.any():
        axes.errorbar(x[known], y[known], std[known], fmt="none", elinewidth=2.5, **look)


def pressures(axes: Axes, view: RunView, x: Abscissa) -> None:
    """Draw the pressure of each set."""
    plain(axes, x.label, "pressure [bar]")
    for k in range(view.pressure.shape[1]):
        axes.plot(x.values, view.pressure[:, k] / BAR, color=colour(k), linewidth=1.5, marker=".", label=f"set {k + 1}")
