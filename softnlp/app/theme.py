"""The colours of the page's figures, on a light and on a dark page."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui import ui

_INK = {False: "#222222", True: "#e6e6e6", None: "#808080"}
_LINES = {False: "#dddddd", True: "#444444", None: "#a0a0a060"}


def figure_layout(dark: bool | None) -> dict[str, Any]:
    """Return the layout that all plotly figures share, without titles; None: where the browser chooses, unknown here.

    Paper and plot are clear, so that the page is seen through them.
    """
    axis = {
        "gridcolor": _LINES[dark],
        "linecolor": _INK[dark],
        "zerolinecolor": _LINES[dark],
        "automargin": True,
        "ticks": "outside",
        "tickcolor": _LINES[dark],
        "title": {"standoff": 6},
    }
    return {
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "font": {"family": "inherit", "size": 12, "color": _INK[dark]},
        "margin": {"l": 8, "r": 12, "t": 8, "b": 8},
        "xaxis": dict(axis),
        "yaxis": dict(axis),
        "legend": {"orientation": "h", "yanchor": "bottom", "y": 1.0, "x": 0.0, "xanchor": "left"},
        "hovermode": "closest",
        "uirevision": "kept",
    }


def dark_page(redraw: Callable[[], None]) -> Callable[[], bool | None]:
    """Return what tells whether this page is dark; `redraw` is called where that changes."""
    modes = [element for element in ui.context.client.elements.values() if isinstance(element, ui.dark_mode)]
    if not modes:
        return lambda: False
    mode = modes[0]
    mode.on_value_change(lambda _: redraw())
    return lambda: mode.value
