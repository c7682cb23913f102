"""The four closures of the blocked force beside the measured force of D25L60."""

from __future__ import annotations

import numpy as np

from docs.figures._shared import measured
from softnlp import BAR, COEFFICIENT_SETS, ClosureWeights, ContactSettings, blocked_force, material, robot
from softnlp.figures.style import INK, SMALL, colour, in_own_style, new_figure, plain

WEIGHTS = ClosureWeights(force=10.0, moment=10.0, length=20.0)  # [1/N], [1/(N m)], [1/m]
MODELS = (
    ("free", "reproduction"),
    ("compliant", "reproduction"),
    ("compliant", "calibrated"),
    ("weighted", "reproduction"),
    ("rigid", "reproduction"),
)


@in_own_style
def figure():
    """Draw force against pressure."""
    P = np.linspace(0, 1.5, 6)
    drawn = new_figure(7.2, 4.0, "Blocked force of D25L60", "Ecoflex 00-50, Mooney-Rivlin, one set, tip held at x = 0")
    axes = drawn.add_axes((0.09, 0.13, 0.88, 0.71))
    plain(axes, "pressure of set 1 [bar]", "blocked force [N]")
    for k, (closure, coefficients) in enumerate(MODELS):
        contact = ContactSettings(closure=closure, weights=WEIGHTS)
        table = np.zeros((P.size, 3))
        table[:, 0] = P * BAR
        run = blocked_force(
            robot("D25L60"),
            material("Ecoflex 00-50"),
            table,
            contact,
            coefficients=COEFFICIENT_SETS[coefficients],
        )
        F = [step.contact.force if step.status.has_solution else np.nan for step in run.steps]
        ends = "" if np.all(np.isfinite(F)) else ", folds"
        line = "--" if coefficients == "calibrated" else "-"
        axes.plot(P, F, line, marker=".", color=colour(k), label=f"{closure}, {coefficients}{ends}")
    value = next(force for name, _, force in measured("measured_forces.csv", "blocked_force_N") if name == "D25L60")
    axes.plot([1.5], [value], "*", color=INK, markersize=13, label="measured", clip_on=False, zorder=5)
    axes.set_xlim(0, 1.52)
    axes.set_ylim(0, 2.0)  # `rigid` goes far beyond
    axes.legend(frameon=False, fontsize=SMALL)
    return drawn
