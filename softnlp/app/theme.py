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
.softnlp-page {{ height: calc(100vh - 49px); }}
.softnlp-middle {{ flex: 1 1 0; height: 100%; background: #f6f7f9; }}
.body--dark .softnlp-middle {{ background: #14171b; }}
.q-tooltip {{ font-size: 12px; }}
.softnlp-inputs {{ width: 330px; }}
.softnlp-results {{ width: 390px; }}
.softnlp-tabs .q-tab {{ padding: 0 14px; }}
.softnlp-tabs {{ order: 0; max-width: calc(100vw - 300px); }}
.softnlp-panel .q-item {{ padding: 2px 0; min-height: 32px; }}
.softnlp-panel .nicegui-expansion-content {{ padding: 0; }}
/* What is read has at least 12 px, what is pressed at least 24. */
.q-btn[style*="font-size: 10px"] {{ font-size: 12px !important; min-height: 26px !important; }}
.q-field--dense .q-field__bottom {{ font-size: 12px; line-height: 1.2; padding: 3px 4px 0; }}
.q-field--dense.q-field--float .q-field__label {{ transform: translateY(-38%) scale(0.86); }}
.q-toggle--dense {{ min-height: 24px; }}
.q-slider--h {{ padding: 4px 0; }}
.q-btn-toggle .q-btn {{ min-width: 30px; min-height: 26px; }}
.q-chip__icon--remove {{ font-size: 24px; margin-left: 2px; }}
:focus-visible {{ outline: 2px solid var(--q-primary) !important; outline-offset: 1px; }}
/* A tablet: the robot on top, what goes in and what comes out beside each other. */
@media (max-width: 1023px) {{
  .softnlp-header {{ flex-wrap: wrap; }}
  .softnlp-tabs {{ order: 3; width: 100%; max-width: 100%; }}
  .softnlp-page {{ height: calc(100vh - 90px); flex-wrap: wrap; overflow-y: auto; align-content: flex-start; }}
  .softnlp-middle {{ order: -1; flex: 1 0 100%; height: 46vh; position: sticky; top: 0; z-index: 5; }}
  .softnlp-column {{ height: auto; width: 50%; overflow: visible; }}
}}
/* A phone: one column, the robot on top, then its pressures and the numbers. */
@media (max-width: 699px) {{
  .softnlp-page {{ flex-direction: column; flex-wrap: nowrap; }}
  .softnlp-middle {{ flex: 0 0 42vh; width: 100%; }}
  .softnlp-column {{ display: contents; }}
  .softnlp-column > * {{ order: 3; width: calc(100% - 24px) !important; margin: 0 12px; flex: none; }}
  .softnlp-column > [data-testid=panel-pressures] {{ order: 1; }}
  .softnlp-column > .softnlp-shown {{ order: 2; }}
  .softnlp-inputs > * {{ order: 4; }}
}}
"""


# NiceGUI resizes a plot when its size changes, which it does too when it is hidden: plotly refuses that by a promise.
_QUIET = """window.addEventListener("unhandledrejection", event => {
  if (/Resize must be passed/.test(String(event.reason?.message))) event.preventDefault();
});"""


# What the libraries leave without a name or out of reach of the keyboard: language, files to choose, tables, editor.
_NAMED = """document.documentElement.lang = "en";
let waiting = null;
const name = () => {
  waiting = null;
  for (const input of document.querySelectorAll(".q-uploader__input:not([aria-label])")) {
    const title = input.closest(".q-uploader").querySelector(".q-uploader__title")?.textContent;
    input.setAttribute("aria-label", title || "Choose files");
    input.tabIndex = 0;  // the field itself is reached by the keyboard, and no button around it
    const around = input.closest(".q-btn");
    around?.removeAttribute("tabindex");
    around?.removeAttribute("role");
  }
  for (const rows of document.querySelectorAll(".q-table__middle:not([tabindex])"))
    rows.tabIndex = 0;  // what scrolls is reached by the keyboard
  for (const editor of document.querySelectorAll(".cm-content:not([aria-label])")) {
    editor.setAttribute("aria-label", "Scenario file");
    editor.tabIndex = 0;
  }
};
const later = new MutationObserver(() => { waiting ??= setTimeout(name, 150); });
later.observe(document.body, {childList: true, subtree: true});
name();"""


def style_page() -> None:
    """Give the page its colours and spacing; the accents are those of the figures."""
    ui.run_javascript(_QUIET)
    ui.run_javascript(f"(() => {{ {_NAMED} }})()")
    ui.colors(primary=_BLUE, secondary=_VERMILION, accent=_GREEN, warning=_ORANGE, negative=WRONG)
    ui.add_css(_STYLE)


def figure_layout(dark: bool) -> dict[str, Any]:
    """Return the layout that plotly figures start from: no box, a pale grid, texts for the page's background."""
    ink, grid = ("#E6E6E6", "#4A4A4A") if dark else ("#222222", "#DDDDDD")
    axis = {"gridcolor": grid, "zerolinecolor": grid, "linecolor": grid, "automargin": True}
    return {
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "font": {"color": ink, "size": 12},
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
