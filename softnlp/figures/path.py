"""The panels of a path: rates and pressures over time, with what limits them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from softnlp.base.arrays import Array
from softnlp.base.columns import BAR_PER_S, OUTPUTS
from softnlp.base.units import BAR
from softnlp.figures.series import Abscissa, finish_panels
from softnlp.figures.style import WRONG, colour, plain
from softnlp.results import RunView

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LIMIT: dict[str, Any] = {"color": WRONG, "linewidth": 0.9, "linestyle": (0, (4, 2)), "zorder": 1}


def path_panels(figure: Figure, panels: Sequence[Axes], view: RunView, times: Array) -> Abscissa:
    """Draw rates and pressures in the last two of three panels, and return what all are drawn against."""
    x = Abscissa(times, OUTPUTS["t"].axis, False)
    _rates(panels[1], view, times)
    _pressures(panels[2], view, times)
    finish_panels(figure, panels, view, x)
    return x


def _rates(axes: Axes, view: RunView, times: Array) -> None:
    """Draw the rate of each set between steps, and the largest that is allowed."""
    plain(axes, OUTPUTS["t"].axis, f"rate [{BAR_PER_S}]")
    rates = np.diff(view.pressure, axis=0) / np.diff(times)[:, None] / BAR
    middle = (times[1:] + times[:-1]) / 2
    for k in range(rates.shape[1]):
        axes.plot(middle, rates[:, k], color=colour(k), linewidth=1.2, label=f"set {k + 1}")
    if (most := view.limits.get("rate_bar_per_s")) is not None:
        for sign in (-1, 1):
            axes.axhline(sign * most, **_LIMIT)


def _pressures(axes: Axes, view: RunView, times: Array) -> None:
    """Draw the pressure of each set, and the bounds of all."""
    plain(axes, OUTPUTS["t"].axis, "pressure [bar]")
    for k in range(view.pressure.shape[1]):
        axes.plot(times, view.pressure[:, k] / BAR, color=colour(k), linewidth=1.4, label=f"set {k + 1}")
    for bound in {value for pair in view.limits.get("pressure_bar", ()) for value in pair}:
        axes.axhline(bound, **_LIMIT)
