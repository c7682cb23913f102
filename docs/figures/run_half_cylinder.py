"""The half-cylinder bender, as shipped."""

from __future__ import annotations

from docs.figures._shared import figure_of


def figure():
    """Draw the run."""
    return figure_of("half_cylinder.toml")
