"""What a browser tab keeps of its session, for when the page is loaded again or the server started again."""

from __future__ import annotations

import json
from functools import partial

from nicegui import Client, ui

from softnlp.app.redraw import Redraw
from softnlp.app.session import Session
from softnlp.errors import SoftnlpError

_KEPT, _FILES = "softnlp.scenario", "softnlp.files"
_PIECE = 400_000  # characters; a browser sends no message of more than a million bytes
# A tab that is closed says so, and its memory is free at once; one that only lost its connection may come back.
_LEAVING = """addEventListener("pagehide", event => { if (!event.persisted) emitEvent("softnlp-closed"); });"""


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


async def recall(session: Session) -> None:
    """Show what the browser tab kept."""
    kept, files = [await _read(key) for key in (_KEPT, _FILES)]
    if kept:
        try:
            session.recall(kept, files or "{}")
        except SoftnlpError as error:
            ui.notify(f"what this tab showed before could not be opened again: {error}", type="warning")


async def _read(key: str) -> str:
    """Return what the browser tab keeps under a key, "" for nothing."""
    stored = f"(sessionStorage.getItem({json.dumps(key)}) ?? '')"
    size = await ui.run_javascript(f"return {stored}.length", timeout=10.0)
    starts = range(0, size or 0, _PIECE)
    pieces = [await ui.run_javascript(f"return {stored}.slice({k}, {k + _PIECE})", timeout=10.0) for k in starts]
    return "".join(map(str, pieces))


def free_when_left(client: Client) -> None:
    """Delete a page when its tab is closed or shows another one."""

    def left() -> None:
        if not client.is_deleted:
            client.delete()

    ui.on("softnlp-closed", left)
    ui.run_javascript(_LEAVING)
