"""Force and energy over those of uniaxial stress, and the chambers' circle, by robot and by law."""

from __future__ import annotations

import numpy as np

from docs.figures._shared import markdown
from softnlp import material, robot
from softnlp.model.energies import PlaneEnergy
from softnlp.rings import RingResponse, energy_of, robot_response

ROBOTS = ("D25L60", "D20L60", "D15L60", "D10L60", "laparoscope-9", "laparoscope-3")
LAWS = ("mooney-rivlin", "neo-hookean", "yeoh", "ogden", "linear")
STRETCHES = np.array([1.0, 1.1, 1.3, 1.5, 1.7])


def force_ratio(response: RingResponse, law: PlaneEnergy) -> list[float]:
    """Return the derivative of the energy over that of the energy in uniaxial stress, at `STRETCHES`."""
    ratio, h = response.energy_ratio(law), 1e-3
    high, low = (np.maximum(STRETCHES, 1 + 2 * h) + side for side in (h, -h))
    rise = ratio(high) * law.uniaxial(high) - ratio(low) * law.uniaxial(low)
    return list(rise / (law.uniaxial(high) - law.uniaxial(low)))


def text():
    """Return both tables."""
    header = [f"stretch {stretch:g}" for stretch in STRETCHES]
    law = energy_of(material("Ecoflex 00-50"))
    rows = []
    for name in ROBOTS:
        response = robot_response(robot(name))
        forces, arms = force_ratio(response, law), response.circle_ratio(STRETCHES)
        rows.append([name, *(f"{force:.2f}, {arm:.3f}" for force, arm in zip(forces, arms, strict=True))])
    rows.append(["no rings", *(f"1.00, {stretch**-0.5:.3f}" for stretch in STRETCHES)])
    by_law = []
    for name in LAWS:
        response, law = robot_response(robot("D25L60")), energy_of(material("Ecoflex 00-50", name))
        by_law.append([name, *(f"{force:.2f}" for force in force_ratio(response, law))])
    return "\n".join(
        [
            markdown(["robot: force ratio, r_cp / r_cp0", *header], rows),
            "\n",
            markdown(["law of Ecoflex 00-50: force ratio of D25L60", *header], by_law),
        ]
    )
