"""D25L60 by the energy section, as shipped."""

from __future__ import annotations

from docs.figures._shared import figure_of


def figure():
    """Draw the run."""
    return figure_of("D25L60_energy.toml")
