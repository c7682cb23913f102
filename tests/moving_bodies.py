"""Bodies that tests of motions share: two segments with connectors, and a section whose strains are not linear."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca

from softnlp import Segment, material, robot, segmented_robot
from softnlp.model.round_chambers import RoundChambers


class Stiffening(RoundChambers):
    """A section that bends less the more it is bent: u = m/EI (1 - (m/m_0)^2/3), of a potential of the resultants."""

    def strains(self, section: Any, own: Any, force: Any, moment: Any) -> tuple[Any, Any]:
        v, u = super().strains(section, own, force, moment)
        m_x, m_y = moment[0] + section.pressure_moment_x, moment[1] + section.pressure_moment_y
        factor = 1 - (m_x**2 + m_y**2) / (3 * (section.bending_x / section.length * 4) ** 2)
        return v, ca.vertcat(u[0] * factor, u[1] * factor, u[2])


TWO = segmented_robot(
    [
        Segment(replace(robot("D25L60"), length=0.03), material("Ecoflex 00-50"), connector=0.005, lines="bonded"),
        Segment(replace(robot("D20L40"), length=0.02), material("Ecoflex 00-30"), turn=0.7, connector=0.004),
    ]
)
