"""The cross-section of D25L60 at rest and stretched."""

from softnlp import robot
from softnlp.figures import section_figure


def figure():
    """Draw it with its dimensions."""
    return section_figure(robot("D25L60"), stretch=1.5)
