"""What the sign of the stiffening force, as it is printed, does to the stretch of three sets at 1.5 bar."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from docs.figures._shared import MEASURED_ELONGATION, markdown
from softnlp import BAR, REPRODUCTION, Numerics, material, robot
from softnlp.model.quantities import Model
from softnlp.statics.arc import unloaded_arc
from softnlp.statics.solver import PoseSolver

PRINTED = replace(REPRODUCTION, name="printed sign", stiffening_opposes_pressure=False)
LAWS = ("mooney-rivlin", "neo-hookean", "yeoh", "ogden")
ROBOTS = ("D25L60", "D20L60", "D15L60", "D10L60")
HIGHEST = 1.5  # [bar]


def stretches(conventions) -> dict[str, list[str]]:
    """Return, by robot, the stretch by each law in Ecoflex 00-50, or how far the branch from zero pressure goes."""
    found: dict[str, list[str]] = {name: [] for name in ROBOTS}
    for law in LAWS:
        silicone = material("Ecoflex 00-50", law)
        first = PoseSolver(Model(robot(ROBOTS[0]), silicone, conventions=conventions), Numerics())
        for name in ROBOTS:
            poses = first.with_model(replace(first.model, robot=robot(name)))
            branch, arc = unloaded_arc(poses, np.full(3, HIGHEST * BAR))
            ends = f"ends at {branch.fraction * HIGHEST:.2f} bar"
            found[name].append(f"{arc.stretch:.2f}" if branch.fraction >= 1 else ends)
    return found


def text() -> str:
    """Return the stretches by the settled sign and by the printed one, beside the measured range."""
    settled, printed = stretches(REPRODUCTION), stretches(PRINTED)
    low, high = (1 + mm / 60 for mm in MEASURED_ELONGATION["L60"])
    rows = [[f"settled, {law}", *(settled[name][k] for name in ROBOTS)] for k, law in enumerate(LAWS)]
    rows += [[f"printed, {law}", *(printed[name][k] for name in ROBOTS)] for k, law in enumerate(LAWS)]
    rows.append(["measured, all robots of 60 mm", f"{low:.2f} to {high:.2f}", "", "", ""])
    return markdown(["sign and law", *ROBOTS], rows)


if __name__ == "__main__":
    print(text())
