"""The section of D25L60 with its rings of thread, as cast and stretched."""

from softnlp import material, robot
from softnlp.figures import rings_figure


def figure():
    """Draw it with its mesh and the energy density."""
    return rings_figure(robot("D25L60"), material("Ecoflex 00-50"), stretch=1.5)
