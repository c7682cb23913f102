"""Two segments in series, as shipped."""

from __future__ import annotations

from docs.figures._shared import figure_of


def figure():
    """Draw the run."""
    return figure_of("two_segments.toml")
