"""What a browser tab keeps of its session, for when the page is loaded again or the server started again."""

from __future__ import annotations

import asyncio
import json
from functools import partial

from nicegui import Client, ui
from starlette.requests import Request
from starlette.responses import Response

from softnlp.app.links import unpacked
from softnlp.app.session import Session
from softnlp.app.theme import Redraw
from softnlp.base.errors import SoftnlpError

_KEPT, _FILES = "softnlp.scenario", "softnlp.files"
_PIECE = 400_000  # characters; a browser sends no message of more than a million bytes
CLOSED = "/closed"
# A tab that is closed says so, and its memory is free at once; one that only lost its connection may come back.
_LEAVING = f"""addEventListener("pagehide", event => {{
  const who = `${{window.clientId}} ${{window.documentId}}`;
  if (!event.persisted) navigator.sendBeacon(window.path_prefix + "{CLOSED}", who);
}});"""


def keep(session: Session) -> None:
    """Let the browser tab keep its scenario and files from now on, soon after each change."""
    parts = {_KEPT: session.kept, _FILES: session.kept_files}
    changed = set(parts)
    written: dict[str, str] = {}

    def write() -> None:
        for key in tuple(changed):
            text = parts[key]()
            if written.get(key) != text:
                written[key] = text
                ui.run_javascript(f"sessionStorage.setItem({json.dumps(key)}, {json.dumps(text)})")
        changed.clear()

    def note(*keys: str) -> None:
        changed.update(keys)
        soon()

    soon = Redraw(ui.context.client.content, write)
    session.on_scenario(partial(note, *parts))
    session.on_pressure(partial(note, _KEPT))  # files need not be read again for a slider
    soon()


async def recall(session: Session, link: str = "") -> None:
    """Show the state of a link, or else what the browser tab kept; the link then leaves the address."""
    kept, files = [await read_kept(key) for key in (_KEPT, _FILES)]
    if link:
        ui.run_javascript("history.replaceState(null, '', location.pathname)")  # a reload shows what the tab kept
        try:
            kept, files = unpacked(link)
        except SoftnlpError as error:
            ui.notify(f"the link could not be opened: {error}", type="warning", multi_line=True)
    if kept:
        try:
            session.recall(kept, files or "{}")
        except SoftnlpError as error:
            ui.notify(f"what this tab showed before could not be opened again: {error}", type="warning")


async def read_kept(key: str) -> str:
    """Return what the browser tab keeps under a key, "" for nothing."""
    stored = f"(sessionStorage.getItem({json.dumps(key)}) ?? '')"
    size = await ui.run_javascript(f"return {stored}.length", timeout=10.0)
    starts = range(0, size or 0, _PIECE)
    pieces = [await ui.run_javascript(f"return {stored}.slice({k}, {k + _PIECE})", timeout=10.0) for k in starts]
    return "".join(map(str, pieces))


async def wants_dark() -> bool:
    """Return whether a person turned the page dark before, or else whether the browser prefers dark pages."""
    preferred = "String(matchMedia('(prefers-color-scheme: dark)').matches)"
    told = await ui.run_javascript(f"return sessionStorage.getItem('softnlp.dark') ?? {preferred}", timeout=10.0)
    return bool(told == "true")


def tell_when_closed() -> None:
    """Let the browser tell when the page of the current slot is closed or another takes its place."""
    ui.run_javascript(_LEAVING)


async def closed(request: Request) -> Response:
    """Delete the page that a browser tells of."""
    name, _, document = (await request.body()).decode(errors="replace").partition(" ")
    client = Client.instances.get(name)
    if client is not None:
        for task in asyncio.all_tasks():  # of NiceGUI, which deletes it too some time after the connection has gone
            if task.get_name() == f"delete content {document}":
                task.cancel()
        client.delete()
    return Response(status_code=204)


def close_all() -> None:
    """Delete every page, since a server that is told to end has no time to tidy up after that."""
    for client in tuple(Client.instances.values()):
        client.delete()
