"""Reaching past a ball, as shipped."""

from __future__ import annotations

from docs.figures._shared import figure_of


def figure():
    """Draw the run."""
    return figure_of("contact/reach.toml")
