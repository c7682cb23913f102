"""The eight measured blocked forces beside those of the tip's axis and of its rim, at 1.5 bar."""

from __future__ import annotations

import numpy as np

from docs.figures._shared import markdown, measured
from softnlp import ENERGY, Coefficients, Numerics, Plane, forward, material, robot
from softnlp.model.conventions import REPRODUCTION

PARTS = ("tip axis", "tip rim")
CONVENTIONS = {"reproduction": REPRODUCTION, "energy": ENERGY}
_STEPS = 4  # on the way to the pressure, zero among them


def force(name: str, pressures: list[float], part: str, conventions: str) -> float:
    """Return the force on a wall that the part touches without pressure [N], NaN without a solution."""
    body = robot(name)
    place = 0.0 if part == "tip axis" else -body.outer_diameter / 2
    wall = Plane(point=(place, 0, 0), normal=(1, 0, 0), part=part)
    run = forward(
        body,
        material("Ecoflex 00-50"),
        np.linspace(0, 1, _STEPS)[1:, None] * np.array(pressures),
        coefficients=Coefficients(),
        conventions=CONVENTIONS[conventions],
        numerics=Numerics(engine="newton"),
        obstacles=[wall],
    )
    last = run.steps[-1]
    return float(last.contacts[0].force[0]) if last.status.has_solution else float("nan")


def text():
    """Return the table, with the mean of the absolute deviations at its end."""
    header = ["robot", "measured [N]", *(f"{part}, {name} [N]" for name in CONVENTIONS for part in PARTS)]
    rows, off = [], []
    for name, pressures, value in measured("measured_forces.csv", "blocked_force_N"):
        found = [force(name, pressures, part, conventions) for conventions in CONVENTIONS for part in PARTS]
        off.append([abs(one / value - 1) for one in found])
        rows.append([name, f"{value:.2f}", *(f"{one:.2f}" for one in found)])
    rows.append(["mean deviation", "", *(f"{100 * mean:.0f} %" for mean in np.nanmean(off, axis=0))])
    return markdown(header, rows)
