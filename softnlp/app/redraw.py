"""Drawing after changes, at most so often: many changes in a row give one drawing."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from nicegui import ui


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
