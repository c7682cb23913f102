"""The eight measured blocked forces beside those of the tip's axis and of its rim, at 1.5 bar."""

from __future__ import annotations

import numpy as np

from docs.figures._shared import markdown, measured
from softnlp import Numerics, Plane, forward, material, robot

PARTS = ("tip axis", "tip rim")


def force(name: str, pressures: list[float], part: str) -> float:
    """Return the force on a wall that the part touches without pressure [N], NaN without a solution."""
    body = robot(name)
    place = 0.0 if part == "tip axis" else -body.outer_diameter / 2
    wall = Plane(point=(place, 0, 0), normal=(1, 0, 0), part=part)
    newton = Numerics(engine="newton")
    step = forward(body, material("Ecoflex 00-50"), [pressures], numerics=newton, obstacles=[wall]).steps[0]
    return float(step.contacts[0].force[0]) if step.status.has_solution else float("nan")


def text():
    """Return the table, with the mean of the absolute deviations at its end."""
    rows, off = [], []
    for name, pressures, value in measured("measured_forces.csv", "blocked_force_N"):
        found = [force(name, pressures, part) for part in PARTS]
        off.append([abs(one / value - 1) for one in found])
        rows.append([name, f"{value:.2f}", *(f"{one:.2f}" for one in found)])
    rows.append(["mean deviation", "", *(f"{100 * mean:.0f} %" for mean in np.nanmean(off, axis=0))])
    return markdown(["robot", "measured [N]", *(f"{part} [N]" for part in PARTS)], rows)
