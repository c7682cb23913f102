"""A tab that is closed leaves nothing behind: its session, its compiled solvers, its files on disk, its page."""

from __future__ import annotations

import asyncio
import gc
import weakref
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")

from nicegui import Client, ElementFilter, ui
from nicegui.testing.user_simulation import user_simulation
from starlette.requests import Request

from softnlp.app.kept import closed
from softnlp.app.page import build_page
from softnlp.app.session import Session
from tests.app_stage import done


async def tell_closed(name: str) -> None:
    """Say what a browser says when a tab is closed."""

    async def receive() -> dict[str, Any]:
        return {"type": "http.request", "body": f"{name} document".encode(), "more_body": False}

    assert (await closed(Request({"type": "http"}, receive))).status_code == 204


@pytest.mark.thorough
def test_closed_tabs_give_their_memory_back_and_an_open_one_stays() -> None:
    held: list[dict[str, weakref.ref[Any]]] = []
    folders: list[Path] = []

    def page() -> None:
        session, client = Session(), ui.context.client
        client.on_delete(session.close)
        build_page(session)
        for tabs in ElementFilter(kind=ui.tabs):
            tabs.set_value("identify")  # where files are dropped
        held.append({name: weakref.ref(thing) for name, thing in vars(session).items() if name in ("live", "document")})
        held[-1] |= {"session": weakref.ref(session), "client": weakref.ref(client)}
        folders.append(session.folder)

    def solvers(tab: dict[str, weakref.ref[Any]]) -> int:
        live = tab["live"]()
        return 0 if live is None else len(live._poses)

    async def visit() -> None:
        async with user_simulation(page) as user:
            for _ in range(3):
                await user.open("/")
                while not solvers(held[-1]):
                    await asyncio.sleep(0.05)
            last = user.client.id if user.client else ""
            for name in [*Client.instances, "of no page"]:
                if name != last:
                    await tell_closed(name)
            for _ in range(1200):  # a pose that is drawn a moment later holds its page until then
                gc.collect()
                if not any(thing() for tab in held[:-1] for thing in tab.values()):
                    break
                await asyncio.sleep(0.05)
            alive = [{name for name, thing in tab.items() if thing() is not None} for tab in held]
            assert alive == [set(), set(), {"live", "document", "session", "client"}]
            assert [folder.exists() for folder in folders] == [False, False, True]
            await tell_closed(last)
            assert not folders[-1].exists()

    done(visit())
