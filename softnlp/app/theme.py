"""How the page and its plots look, light and dark, and when they are drawn anew."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from nicegui import ElementFilter, ui

from softnlp.figures.style import COLOURS, WRONG, user_text

_BLUE, _VERMILION, _GREEN, _, _ORANGE, _SKY, _ = COLOURS
_STYLE = f"""
body {{ overflow: hidden; }}
.nicegui-content {{ padding: 0; gap: 0; }}
.softnlp-surface {{ background: white !important; color: #222 !important; }}
.body--dark .softnlp-surface {{ background: #1d1d1d !important; color: #e6e6e6 !important; }}
.body--dark {{ --q-primary: {_SKY} !important; }}
.body--dark {{ --q-negative: #FF8A80 !important; }}
@layer overrides {{ .body--dark .bg-primary {{ color: #111 !important; }} }}
.softnlp-stale .softnlp-view, .softnlp-column .softnlp-stale {{ filter: grayscale(1); opacity: 0.62; }}
.softnlp-panel .q-item {{ padding: 2px 0; min-height: 32px; }}
.softnlp-panel .nicegui-expansion-content {{ padding: 0; }}
"""


# NiceGUI resizes a plot when its size changes, which it does too when it is hidden: plotly refuses that by a promise.
_QUIET = """window.addEventListener("unhandledrejection", event => {
  if (/Resize must be passed/.test(String(event.reason?.message))) event.preventDefault();
});"""


def style_page() -> None:
    """Give the page its colours and spacing; the accents are those of the figures."""
    ui.run_javascript(_QUIET)
    ui.colors(primary=_BLUE, secondary=_VERMILION, accent=_GREEN, warning=_ORANGE, negative=WRONG)
    ui.add_css(_STYLE)


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


def figure_text(text: str) -> str:
    """Return a person's text without what plotly would read as markup."""
    return user_text(text).replace("&", "&amp;").replace("<", "&lt;").replace("%", "％")


def figure_config() -> dict[str, Any]:
    """Return plotly's settings: tools while the pointer is over the figure, nothing that leads out of the page."""
    return {
        "displaylogo": False,
        "showLink": False,
        "plotlyServerURL": "",
        "modeBarButtonsToRemove": ["select2d", "lasso2d", "autoScale2d"],
        "toImageButtonOptions": {"format": "png", "scale": 3},
    }


def darkness() -> Callable[[], bool]:
    """Return what tells whether the page of the current slot is dark."""
    modes = list(ElementFilter(kind=ui.dark_mode))
    return lambda: any(bool(mode.value) for mode in modes)


def on_dark(redraw: Callable[[], None]) -> None:
    """Call a function after each turn of the page of the current slot from light to dark or back."""
    for mode in ElementFilter(kind=ui.dark_mode):
        mode.on_value_change(lambda: redraw())


class Redraw:
    """Calls a function some time after the first of several requests; not once its element has left the page.

    at_rest : after the last request instead, so that nothing is drawn while a slider moves.
    """

    def __init__(
        self, element: ui.element, draw: Callable[[], None], seconds: float = 0.12, *, at_rest: bool = False
    ) -> None:
        self._element = element
        self._draw = draw
        self._seconds = seconds
        self._at_rest = at_rest
        self._waiting: asyncio.TimerHandle | None = None

    def __call__(self) -> None:
        """Ask for a drawing."""
        if self._waiting is not None and self._at_rest:
            self._waiting.cancel()
            self._waiting = None
        if self._waiting is None:
            self._waiting = asyncio.get_running_loop().call_later(self._seconds, self._now)

    def _now(self) -> None:
        self._waiting = None
        if not self._element.is_deleted:
            with self._element:  # a timer of the loop has no page of its own
                self._draw()
