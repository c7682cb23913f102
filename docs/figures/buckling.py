"""Which robots stand by themselves in the softest silicone: Greenhill's number, and what the stability test says."""

from __future__ import annotations

import numpy as np

from docs.figures._shared import markdown
from softnlp import REPRODUCTION, Coefficients, Loads, Numerics, material, robot
from softnlp.model.quantities import Model
from softnlp.model.round_chambers import deform
from softnlp.statics.solver import PoseSolver

GRAVITY = 9.80665
ROBOTS = ("D25L60", "D20L60", "D15L60", "D10L60")


def text() -> str:
    """Return the number and the verdict of each robot without pressure."""
    silicone = material("Ecoflex 00-10")
    poses = PoseSolver(Model(robot(ROBOTS[0]), silicone), Numerics())
    rows = []
    for name in ROBOTS:
        body = robot(name)
        at_rest = deform(body, silicone, [0.0] * 3, 1.0, Coefficients(), REPRODUCTION)
        EI = float(at_rest.bending_stiffness[0])
        number = silicone.density * float(at_rest.area) * GRAVITY * body.length**3 / EI
        upright = Loads(gravity=(0.0, 0.0, -GRAVITY))
        step, _ = poses.with_model(Model(body, silicone)).solve(np.zeros(3), upright)
        leaning = float(np.linalg.norm(step.pose.tip_position[:2])) > 1e-6
        says = "stands" if step.pose.stable and not leaning else "leans, stable" if step.pose.stable else "not stable"
        rows.append([name, f"{number:.2f}", says])
    return markdown(["robot", "rho A g L^3 / EI", "without pressure"], rows)


if __name__ == "__main__":
    print(text())
