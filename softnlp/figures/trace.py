"""The figure of a tip over time: what was measured, what is simulated, and how far they are apart."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from softnlp.base.columns import OUTPUTS
from softnlp.base.units import MILLIMETRE
from softnlp.figures.series import LEAST_SPAN
from softnlp.figures.style import GREY, INK, SMALL, colour, in_own_style, legend, new_figure, plain

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from softnlp.studies.trace import Trace, TraceErrors

Array = NDArray[np.float64]
_DASHES = ("--", "-")


@in_own_style
def trace_figure(title: str, trace: Trace, simulated: Mapping[str, Array], errors: TraceErrors | None) -> Figure:
    """Draw the tip along each axis that was seen, measured and simulated, and the distance of the last of these.

    simulated : (rows, 3) by name, such as before and after [m].
    """
    axes = [k for k in range(3) if trace.seen[:, k].any()]
    said = "" if errors is None else f"rmse {errors.rmse / MILLIMETRE:.3g} mm"
    if errors is not None and (first := errors.harmonic) is not None and first.measured:
        ratio, phase = abs(first.simulated) / abs(first.measured), np.rad2deg(first.phase)
        said += f"  ·  at {first.frequency:.3g} Hz {ratio:.3g} of the amplitude, {phase:+.3g} deg ahead"
    figure = new_figure(8.4, 1.6 + 1.45 * (len(axes) + 1), title, said)
    count, top, foot = len(axes) + 1, 1 - 0.75 / figure.get_figheight(), 0.7 / figure.get_figheight()
    height = (top - foot) / count
    last = list(simulated)[-1]
    for row in range(count):
        panel = figure.add_axes((0.1, top - (row + 1) * height + 0.02, 0.87, height - 0.03))
        if row < len(axes):
            k = axes[row]
            plain(panel, "", f"tip {'xyz'[k]} [mm]")
            panel.plot(trace.times, trace.tip[:, k] / MILLIMETRE, ".", color=INK, markersize=3.5, label="measured")
            for style, (name, tips) in zip(_DASHES[-len(simulated) :], simulated.items(), strict=True):
                shade = GREY if name != last else colour(0)
                panel.plot(trace.times, tips[:, k] / MILLIMETRE, style, color=shade, linewidth=1.3, label=name)
            shown = np.concatenate([tips[:, k] for tips in (trace.tip, *simulated.values())]) / MILLIMETRE
            known = shown[np.isfinite(shown)]
            middle, span = (known.max() + known.min()) / 2, max(np.ptp(known), LEAST_SPAN * 1e-3)
            panel.set_ylim(middle - 0.58 * span, middle + 0.72 * span)
            if row == 0:
                legend(panel, None, loc="upper right", ncols=3)
            panel.tick_params(labelbottom=False)
        else:
            plain(panel, OUTPUTS["t"].axis, "tip's distance [mm]")
            off = np.sqrt(np.nansum((simulated[last] - trace.tip) ** 2, axis=1)) / MILLIMETRE
            panel.plot(trace.times, off, color=colour(0), linewidth=1.2)
            panel.set_ylim(0, max(1.1 * float(off.max()), 1e-3))
    figure.text(0.018, 0.018, "time as the pressures have it, tips in the robot's frame", size=SMALL, color=GREY)
    return figure
