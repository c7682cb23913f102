"""Error of the tip against the number of intervals, by both transcriptions, and what the package estimates."""

from __future__ import annotations

import numpy as np

from softnlp import BAR, Loads, Numerics, forward, material, robot
from softnlp.figures.style import GREY, SMALL, colour, in_own_style, new_figure, plain

INTERVALS = (4, 8, 16, 32, 64)
LOADS = Loads(tip_force=(0.05, 0.02, -0.05), gravity=(0.0, 0.0, -9.80665))
PRESSURE = [[0.8 * BAR, 0.4 * BAR, 0.0]]


def solved(transcription: str, intervals: int):
    """Return the step on a grid."""
    numerics = Numerics(intervals=intervals, transcription=transcription)
    return forward(robot("D25L60"), material("Ecoflex 00-50"), PRESSURE, loads=LOADS, numerics=numerics).steps[0]


@in_own_style
def figure():
    """Draw both on logarithmic axes."""
    best = solved("collocation", 32).pose.tip_position
    drawn = new_figure(
        6.4, 3.9, "Error of the tip against the grid", "D25L60 under tip force and gravity, 0.8 and 0.4 bar"
    )
    axes = drawn.add_axes((0.13, 0.14, 0.83, 0.69))
    plain(axes, "intervals", "error of the tip, of the length")
    labels = {"multiple-shooting": "multiple shooting, RK4", "collocation": "collocation, degree 4"}
    for k, (name, label) in enumerate(labels.items()):
        counts = INTERVALS if k == 0 else INTERVALS[:3]
        steps = [solved(name, n) for n in counts]
        errors = [np.linalg.norm(step.pose.tip_position - best) / 0.06 for step in steps]
        axes.loglog(counts, errors, "os"[k] + "-", color=colour(k), label=label)
        estimates = [step.discretisation_error for step in steps]
        axes.loglog(counts, estimates, "+", color=GREY, markersize=9, label="estimated" if k else None, zorder=3)
    axes.axhline(1e-6, color=GREY, linewidth=0.8, linestyle=":")
    axes.text(INTERVALS[-1], 1.3e-6, "accuracy asked for by default", size=SMALL, color=GREY, ha="right")
    axes.set_xticks(INTERVALS, [str(n) for n in INTERVALS])
    axes.minorticks_off()
    axes.legend(frameon=False, fontsize=SMALL)
    return drawn
