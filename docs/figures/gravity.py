"""What gravity does to a slender robot: bending angle without it, standing and hanging."""

from __future__ import annotations

from dataclasses import replace

from docs.figures._shared import SCENARIOS
from softnlp import BAR, DEGREE, Loads, load_scenario, run_scenario
from softnlp.figures.style import SMALL, colour, in_own_style, new_figure, plain


@in_own_style
def figure():
    """Draw the three curves."""
    standing, hanging = (load_scenario(SCENARIOS / f"D15L60_{how}.toml") for how in ("standing", "hanging"))
    asked = {"standing, towards the base (-z)": standing, "no gravity": replace(standing, loads=Loads())}
    asked["hanging, away from the base (+z)"] = hanging
    drawn = new_figure(6.4, 3.6, "Gravity on D15L60", "Ecoflex 00-30, Mooney-Rivlin, one set")
    axes = drawn.add_axes((0.11, 0.15, 0.85, 0.68))
    plain(axes, "pressure of set 1 [bar]", "bending angle [deg]")
    for k, (label, scenario) in enumerate(asked.items()):
        steps = run_scenario(scenario).steps
        P = [step.pressure[0] / BAR for step in steps]
        axes.plot(P, [step.pose.bending_angle / DEGREE for step in steps], "os^"[k] + "-", color=colour(k), label=label)
    axes.legend(frameon=False, fontsize=SMALL)
    return drawn
