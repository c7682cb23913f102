"""How the page and its plots look, light and dark."""

from __future__ import annotations

from typing import Any


def figure_layout(dark: bool) -> dict[str, Any]:
    """Return the layout that plotly figures start from: no box, a pale grid, texts for the page's background."""
    ink, grid = ("#E6E6E6", "#4A4A4A") if dark else ("#222222", "#DDDDDD")
    axis = {"gridcolor": grid, "zerolinecolor": grid, "linecolor": grid, "automargin": True}
    return {
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "font": {"color": ink, "size": 11},
        "xaxis": dict(axis),
        "yaxis": dict(axis),
        "legend": {"orientation": "h", "y": 1.12},
        "margin": {"l": 48, "r": 8, "t": 8, "b": 40},
    }
