"""A path of two segments through a port and around a ball, as shipped."""

from __future__ import annotations

from docs.figures._shared import figure_of


def figure():
    """Draw the run."""
    return figure_of("trajectory/trocar_and_sphere.toml")
