"""A page with one session, for tests that use its controls as a person would, without a browser."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

from app_stage import done
from nicegui import ElementFilter
from nicegui.testing import User
from nicegui.testing.user_simulation import user_simulation

from softnlp.app.session import Session


def use(build: Callable[[Session], None], person: Callable[[User, Session], Awaitable[None]]) -> Session:
    """Open a page that `build` fills, let a person use it, and return its session, closed."""
    session = Session()

    async def run() -> None:
        async with user_simulation(root=lambda: build(session)) as user:
            await user.open("/")
            await person(user, session)

    try:
        done(run())
    finally:
        session.close()
    return session


def control(user: User, marker: str, index: int = 0) -> Any:
    """Return a control by its marker; of several, the one with this index."""
    with user:
        return sorted(ElementFilter(marker=marker), key=lambda element: element.id)[index]


def put(user: User, marker: str, value: object, index: int = 0) -> None:
    """Give a control a value as if it was typed or chosen."""
    with user:
        control(user, marker, index).value = value


async def drawn() -> None:
    """Wait until what is drawn a moment after a change is drawn."""
    await asyncio.sleep(0.4)
