"""Which unknowns each equation knows: a loaded pose with free pressures on five intervals."""

from __future__ import annotations

import casadi as ca
import numpy as np

from softnlp import BAR, DEGREE, Body, Constraint, MultipleShooting, Segment, case, material, problem, robot
from softnlp.figures import sparsity_figure


def figure():
    """Return the figure."""
    body = Body([Segment(robot("D25L60"), material("Ecoflex 00-50"))])
    pose = case("pose", body, method=MultipleShooting(5))
    angle = Constraint("bending angle", pose.outputs["bending_angle"], 60 * DEGREE, np.inf, unit="rad")
    least = ca.sumsqr(body.quantities["pressure"].symbol / BAR)
    return sparsity_figure(problem([pose], free=["pressure"], constraints=[angle], objective=least))
