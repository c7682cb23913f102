"""Long work beside the page: in a thread of its own, with progress that the page reads and a way to stop it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from threading import Event
from typing import TypeVar

T = TypeVar("T")


class Stopped(Exception):
    """A person stopped the work."""


class Progress:
    """How far work is; the work calls it between two steps, the page reads `fraction` and `text`."""

    def __init__(self) -> None:
        self.fraction = 0.0
        self.text = ""
        self._stop = Event()

    def __call__(self, done: float, total: float, text: str = "") -> None:
        """Note how far the work is.

        Raises
        ------
        Stopped
            Where a person wants it to end.
        """
        if self._stop.is_set():
            raise Stopped
        self.fraction = min(1.0, done / total) if total else 0.0
        self.text = text

    @property
    def stopping(self) -> bool:
        """Whether a person wants the work to end."""
        return self._stop.is_set()

    def stop(self) -> None:
        """Ask the work to end at its next step."""
        self._stop.set()


async def in_background(work: Callable[[Progress], T], progress: Progress) -> T:
    """Do work in a thread, so that the page stays alive; what it raises is raised here."""
    return await asyncio.to_thread(work, progress)
