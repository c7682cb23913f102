"""The server of the app: on this machine only, one session a browser tab."""

from __future__ import annotations

import json
import socket
import sys
from pathlib import Path

from nicegui import Client, app, ui

from softnlp.app.page import build_page
from softnlp.app.session import Session
from softnlp.errors import InputError, SoftnlpError

HOST = "127.0.0.1"
FIRST_PORT, LAST_PORT = 8080, 8179
RECONNECT_S = 60.0
# Where a browser tab keeps its scenario and the files of it, for when the connection or the server was lost.
_KEPT, _FILES = "softnlp.scenario", "softnlp.files"


def serve(scenario: Path | None, port: int | None, show: bool) -> None:
    """Serve the app until Ctrl-C.

    Parameters
    ----------
    scenario
        File that each new tab shows; a first robot without one.
    port
        Where to listen on 127.0.0.1; the first free one from 8080 for None.
    show
        Whether to open the browser.

    Raises
    ------
    InputError
        For a scenario that cannot be read, or a port that is taken.
    """
    first = Session()
    if scenario is not None:
        first.open_path(scenario)
    first.close()
    chosen = free_port(port)
    # Poses are solved in threads in many short calls; each would else wait 5 ms wherever the page is busy.
    sys.setswitchinterval(0.0005)

    @ui.page("/", title="softnlp")
    async def page(client: Client) -> None:
        await client.connected()
        if client.is_deleted:
            return
        session = Session()
        client.on_delete(session.close)
        if scenario is not None:
            try:
                session.open_path(scenario)
            except SoftnlpError as error:  # it was there when the server started
                ui.notify(f"not opened: {error}", type="warning", multi_line=True)
        await _recall(session)
        build_page(session)
        _keep(session)

    app.on_startup(lambda: print(f"softnlp at http://{HOST}:{chosen}  (Ctrl-C ends it)", flush=True))
    ui.run(
        host=HOST,
        port=chosen,
        title="softnlp",
        reload=False,
        show=show,
        show_welcome_message=False,
        reconnect_timeout=RECONNECT_S,
        favicon=_FAVICON,
    )


def free_port(port: int | None) -> int:
    """Return a port on which nobody listens.

    Raises
    ------
    InputError
        Where the one asked for is taken, or all are.
    """
    for candidate in range(FIRST_PORT, LAST_PORT + 1) if port is None else [port]:
        with socket.socket() as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((HOST, candidate))
            except (OSError, OverflowError):
                continue
            return candidate
    taken = "ports from 8080 to 8179 are taken" if port is None else f"port {port} cannot be used"
    raise InputError(f"{taken}; give another one", key="--port")


def _keep(session: Session) -> None:
    """Let the browser tab keep its scenario and files, so that a reload or a lost connection loses nothing."""
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

    session.on_scenario(lambda: changed.update(parts))
    session.on_pressure(lambda: changed.add(_KEPT))  # files need not be read again for a slider
    ui.timer(1.0, write)


async def _recall(session: Session) -> None:
    """Show what the browser tab kept."""
    asked = f"return {json.dumps([_KEPT, _FILES])}.map(key => sessionStorage.getItem(key))"
    kept, files = await ui.run_javascript(asked, timeout=10.0)
    if isinstance(kept, str):
        try:
            session.recall(kept, files if isinstance(files, str) else "{}")
        except SoftnlpError as error:
            ui.notify(f"what this tab showed before could not be opened again: {error}", type="warning")


_FAVICON = (
    '<svg viewBox="0 0 32 32" xmlns="http://www.w3.org/2000/svg"><rect width="32" height="32" rx="6" fill="#0072B2"/>'
    '<path d="M9 27C9 17 12 12 23 8" stroke="#fff" stroke-width="6" fill="none" stroke-linecap="round"/></svg>'
)
