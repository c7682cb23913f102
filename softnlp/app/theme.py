"""How plotly figures look on the page, light and dark."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui import ElementFilter, ui

from softnlp.plots.style import COLOURS

_INK = {False: "#333333", True: "#E0E0E0", None: "#808080"}
"""Of text; where it is not known how the page looks, a grey that reads on both."""
_GRID = {False: "#E3E3E3", True: "#3C3C3C", None: "rgba(128,128,128,0.25)"}
_BEHIND = {False: "#FFFFFF", True: "#262626", None: "#808080"}


def figure_layout(dark: bool | None) -> dict[str, Any]:
    """Return what the layouts of all plotly figures share; merge titles and ranges of axes into it.

    dark : whether the page is dark, None where only the browser knows.
    """
    ink, grid = _INK[dark], _GRID[dark]
    axis = {
        "gridcolor": grid,
        "zerolinecolor": grid,
        "linecolor": ink,
        "tickcolor": ink,
        "ticks": "outside",
        "ticklen": 3,
        "showline": True,
        "automargin": True,
        "title": {"font": {"size": 12}, "standoff": 6},
    }
    return {
        "font": {"family": "Roboto, Helvetica, Arial, sans-serif", "size": 11, "color": ink},
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "colorway": list(COLOURS),
        "margin": {"l": 8, "r": 8, "t": 8, "b": 8},
        "xaxis": dict(axis),
        "yaxis": dict(axis),
        "legend": {"orientation": "h", "x": 0, "y": -0.28, "yanchor": "top", "font": {"size": 11}},
        "hoverlabel": {"bgcolor": _BEHIND[dark], "font": {"color": "#FFFFFF" if dark is None else ink}},
        "modebar": {"bgcolor": "rgba(0,0,0,0)", "color": ink, "activecolor": COLOURS[0]},
        "uirevision": "kept",  # a zoom stays as a figure is drawn again
    }


def figure_config() -> dict[str, Any]:
    """Return plotly's settings: tools while the pointer is over the figure, nothing that leads out of the page."""
    return {
        "displaylogo": False,
        "showLink": False,
        "plotlyServerURL": "",
        "modeBarButtonsToRemove": ["select2d", "lasso2d", "autoScale2d"],
        "toImageButtonOptions": {"format": "png", "scale": 3},
    }


def page_dark() -> bool | None:
    """Return whether the page of the current slot is dark; None where it follows the browser."""
    mode = _dark_mode()
    return mode.value if mode is not None else None


def on_dark(redraw: Callable[[], None]) -> None:
    """Call a function after each turn of the page of the current slot from light to dark or back."""
    mode = _dark_mode()
    if mode is not None:
        mode.on_value_change(lambda: redraw())


def _dark_mode() -> ui.dark_mode | None:
    return next(iter(ElementFilter(kind=ui.dark_mode)), None)
