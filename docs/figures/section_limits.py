"""What a stretched section loses: area by the printed radii, and the gap between neighbouring chambers."""

from __future__ import annotations

import numpy as np

from docs.figures._shared import markdown
from softnlp import REPRODUCTION, ROBOTS, Coefficients, material
from softnlp.model.round_chambers import deform

STRETCHES = (1.2, 1.4, 1.6, 2.0)


def touching(body) -> float:
    """Return the stretch at which neighbouring reinforced chambers touch."""
    x, y = np.array([[float(c) for c in centre] for centre in body.chamber_centres()]).T
    nearest = np.hypot(x - np.roll(x, 1), y - np.roll(y, 1)).min()
    return float((nearest / (2 * body.chamber_radius)) ** 2)


def area_lost(body, stretch: float) -> float:
    """Return how much less area than A_0 / lambda the radii of (S2) and Eq. (22) leave [%]."""
    section = deform(body, material("Ecoflex 00-50"), [0.0] * 3, stretch, Coefficients(), REPRODUCTION)
    r_r, r_i, r_ci = (float(r) for r in (section.outer_radius, section.lumen_radius, section.bore_radius))
    area = np.pi * (r_r**2 - r_i**2 - body.chambers * r_ci**2)
    return 100 * (1 - area / float(section.area))


def text() -> str:
    """Return both, by robot."""
    bodies = [body for name, body in ROBOTS.items() if not name.endswith("L40")]
    rows = [[b.name, *(f"{area_lost(b, x):.1f}" for x in STRETCHES), f"{touching(b):.2f}"] for b in bodies]
    header = ["robot", *(f"less area at {x} [%]" for x in STRETCHES), "chambers touch at"]
    return markdown(header, rows)


if __name__ == "__main__":
    print(text())
