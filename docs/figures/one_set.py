"""Shapes, bending angle and elongation of the README's scenario."""

from docs.figures._shared import figure_of


def figure():
    """Draw the run."""
    return figure_of("D25L60_one_set.toml")
