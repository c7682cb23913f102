"""Drawing after changes, at most so often: many changes in a row give one drawing."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from nicegui import ui


class Redraw:
    """Calls a function some time after the first of several requests; not once its element has left the page."""

    def __init__(self, element: ui.element, draw: Callable[[], None], seconds: float = 0.12) -> None:
        self._element = element
        self._draw = draw
        self._seconds = seconds
        self._waits = False

    def __call__(self) -> None:
        """Ask for a drawing."""
        if not self._waits:
            self._waits = True
            asyncio.get_running_loop().call_later(self._seconds, self._now)

    def _now(self) -> None:
        self._waits = False
        if not self._element.is_deleted:
            with self._element:  # a timer of the loop has no page of its own
                self._draw()
