"""Which unknowns each equation knows: a loaded pose with free pressures on five intervals."""

from __future__ import annotations

from docs.figures._nlp import posed
from softnlp.figures import sparsity_figure


def figure():
    """Return the figure."""
    return sparsity_figure(posed("MultipleShooting(5)"))
