"""A page for the tests of one tab: a session, and a view that notes what it is asked to show."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from typing import Any

import numpy as np
from nicegui import background_tasks
from nicegui.testing import User
from nicegui.testing.user_simulation import user_simulation

from softnlp.app.session import Session, Stage


class NotedView:
    """Stands where the 3-D view does."""

    def __init__(self) -> None:
        self.points_shown: Any = None
        self.colours_shown: Any = None
        self.targets_shown: Any = None
        self.pins_shown: Any = []
        self.parts_shown: Any = None
        self.handlers: list[Callable[..., None]] = []

    def points(self, xyz_mm: Any, colours: Any = None) -> None:
        self.points_shown = None if xyz_mm is None else np.asarray(xyz_mm)
        self.colours_shown = colours

    def pins(self, messages: Any) -> None:
        self.pins_shown = messages

    def parts(self, message: Any) -> None:
        self.parts_shown = message

    def explode(self, share: float) -> None:
        self.parts_shown["apart"] = share

    async def picture(self) -> bytes:
        raise RuntimeError("there is no browser")

    def targets(self, xyz_mm: Any) -> None:
        self.targets_shown = None if xyz_mm is None else np.asarray(xyz_mm)

    def on_pick(self, handler: Callable[[tuple[float, float, float]], None]) -> None:
        self.handlers.append(handler)

    def on_sight(self, handler: Callable[[Any, Any], None]) -> None:
        self.handlers.append(handler)


@asynccontextmanager
async def opened(
    tab: Callable[[Stage], None], study: str, text: str | None = None
) -> AsyncIterator[tuple[User, Stage]]:
    """Yield a person in front of a page with one tab."""
    stages: list[Stage] = []

    def page() -> None:
        session = Session() if text is None else Session(text)
        session.choose(study)
        stage = Stage(session, NotedView())  # type: ignore[arg-type]
        stages.append(stage)
        tab(stage)

    async with user_simulation(page) as user:
        await user.open("/")
        try:
            yield user, stages[-1]
        finally:
            stages[-1].session.close()


def field(user: User, marker: str) -> Any:
    """Return the one control with a marker."""
    (found,) = user.find(marker=marker).elements
    return found


async def until(user: User, marker: str, words: str, tries: int = 1200) -> str:
    """Wait until a line of text holds some words, and return it."""
    for _ in range(tries):
        text = str(field(user, marker).text)
        if words in text:
            return text
        await asyncio.sleep(0.05)
    raise AssertionError(f"{marker} says {field(user, marker).text!r}, not {words!r}")


async def ran(user: User, marker: str, words: str) -> str:
    """Press run, wait until the line beneath holds some words, and return it."""
    user.find(marker=f"{marker}.run").click()
    await asyncio.sleep(0.05)  # the click is handled in a task, which first clears the line
    return await until(user, f"{marker}.message", words)


def enter(user: User, marker: str, value: Any) -> None:
    """Set what a control holds, as its page would."""
    with user:
        field(user, marker).set_value(value)


def done(visit: Coroutine[Any, Any, None]) -> None:
    """Run what a person does on a page, and leave the page's own loops where they are.

    asyncio.run would cancel them and wait until they have ended. In Python 3.11 `wait_for` loses a cancellation that
    comes as what it waits for is there, and the loop that sends a page's changes then goes on for ever.
    """
    loop = asyncio.new_event_loop()
    try:
        loop.run_until_complete(visit)
    finally:
        loop.run_until_complete(loop.shutdown_default_executor())
        loop.close()
        background_tasks.running_tasks.clear()  # of a visit that failed, which else fail the next one
        background_tasks.lazy_tasks_running.clear()
