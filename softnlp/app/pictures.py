"""The commands' figures on the page: drawn beside it, shown in the text column, to be taken away."""

from __future__ import annotations

import asyncio
import base64
import io
import warnings
from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING

from nicegui import ui

from softnlp.app.controls import button, named
from softnlp.base.errors import SoftnlpError
from softnlp.figures.style import import_alone

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Makers = Mapping[str, Callable[[], "Figure"]]


def png_of(make: Callable[[], Figure]) -> bytes:
    """Return a figure as PNG."""
    import_alone()
    content = io.BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of characters without a font: boxes are seen
        make().savefig(content, format="png")
    return content.getvalue()


class Pictures:
    """A place for figures; each has its caption as its text for those who do not see it."""

    def __init__(self, marker: str) -> None:
        """Build the place, empty."""
        self._marker = marker
        self._place = ui.column().classes("w-full gap-2")
        self.images: dict[str, bytes] = {}

    async def draw(self, makers: Makers) -> None:
        """Draw figures in the background and show them; one that cannot be drawn is said."""
        self.images = {}
        self._place.clear()
        for caption, make in makers.items():
            try:
                png = await asyncio.to_thread(png_of, make)
            except (SoftnlpError, ValueError, ArithmeticError) as error:
                with self._place:
                    ui.label(f"{caption} could not be drawn: {error}").classes("text-sm text-negative")
                continue
            self.images[caption] = png
            with self._place:
                self._show(caption, png)

    def _show(self, caption: str, png: bytes) -> None:
        url = f"data:image/png;base64,{base64.b64encode(png).decode('ascii')}"
        picture = ui.element("img").classes("w-full rounded bg-white")
        named(picture, f"{self._marker}.{caption}")
        picture.props["src"], picture.props["alt"] = url, caption
        with ui.dialog().props("maximized") as whole, ui.card().classes("items-center overflow-auto p-2"):
            large = ui.element("img").classes("w-full max-w-6xl bg-white rounded")
            large.props["src"], large.props["alt"] = url, caption
            button("Close", "close", f"{self._marker}.close.{caption}", whole.close)
        take = partial(ui.download.content, png, f"{caption.replace(' ', '_')}.png", "image/png")
        with ui.row().classes("gap-1"):
            button("Enlarge", "zoom_in", f"{self._marker}.enlarge.{caption}", whole.open)
            button(f"{caption}.png", "download", f"{self._marker}.take.{caption}", take)
