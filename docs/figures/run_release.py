"""A robot that is let go of a sideways load."""

from typing import Any

from docs.figures._shared import figure_of


def figure() -> Any:
    """Return the figure of the scenario."""
    return figure_of("dynamic/D25L60_release.toml")
