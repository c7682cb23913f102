"""The server of the app: one session a browser tab, on this machine only if nobody asks otherwise."""

from __future__ import annotations

import errno
import socket
import sys
from collections.abc import Sequence
from ipaddress import ip_address
from pathlib import Path
from urllib.parse import urlsplit

from nicegui import Client, app, ui
from nicegui.helpers import schedule_browser
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response

from softnlp.app.guard import Guard, root_path, trusted_host
from softnlp.app.kept import CLOSED, close_all, closed, keep, read_kept, recall, tell_when_closed, wants_dark
from softnlp.app.page import build_page
from softnlp.app.panels.pins import KEPT as PINS
from softnlp.app.session import Session
from softnlp.base.errors import InputError, SoftnlpError
from softnlp.base.reading import shown

HOST = "127.0.0.1"
FIRST_PORT, LAST_PORT = 8080, 8179
RECONNECT_S = 60.0


def serve(
    scenario: Path | None = None,
    port: int | None = None,
    show: bool = True,
    *,
    host: str = HOST,
    root: str = "",
    trusted: Sequence[str] = (),
) -> None:
    """Serve the app until Ctrl-C.

    Parameters
    ----------
    scenario
        File that each new tab shows; a first robot without one.
    port
        Where to listen; the first free one from 8080 for None.
    show
        Whether to open the browser.
    host
        Name or address to listen at.
    root
        Path under which a proxy shows the app.
    trusted
        Hosts under which a person opens the app besides the server's own.

    Raises
    ------
    InputError
        For a scenario that cannot be read, a port that is taken, or where another argument is no such thing.
    """
    path, names = root_path(root), frozenset(map(trusted_host, trusted))
    first = Session()
    if scenario is not None:
        first.open_path(scenario)
    first.close()
    address = address_of(host)
    chosen = free_port(port, address)
    said = url_of(address, chosen)
    # Poses are solved in threads in many short calls; each would else wait 5 ms wherever the page is busy.
    sys.setswitchinterval(0.0005)

    @ui.page("/", title="softnlp")
    async def page(client: Client, state: str = "") -> None:
        await client.connected()
        if not client.is_deleted:
            await open_tab(client, scenario, state)

    def begin() -> None:
        assert app.middleware_stack is not None  # built by now; what NiceGUI adds stands behind the guard as well
        app.middleware_stack = Guard(app.middleware_stack, names, path)
        print(f"softnlp at {said}  (Ctrl-C ends it)", flush=True)
        if show:
            schedule_browser("http", urlsplit(said).hostname or HOST, chosen, "/")

    app.on_startup(begin)
    app.on_shutdown(close_all)
    app.add_exception_handler(404, _not_found)
    app.add_route(CLOSED, closed, methods=["POST"])
    ui.add_head_html(_ALONE, shared=True)
    if not ip_address(address).is_loopback:
        print(_OPEN.format(address=address), file=sys.stderr, flush=True)
    ui.run(
        host=address,
        port=chosen,
        title="softnlp",
        reload=False,
        show=False,
        show_welcome_message=False,
        reconnect_timeout=RECONNECT_S,
        favicon=_FAVICON,
    )


async def open_tab(client: Client, scenario: Path | None, state: str = "") -> None:
    """Fill a page that a browser has opened: with a link's state, or what this tab kept, or the file's scenario."""
    session = Session()
    client.on_delete(session.close)
    if scenario is not None:
        try:
            session.open_path(scenario)
        except SoftnlpError as error:  # it was there when the server started
            ui.notify(f"not opened: {error}", type="warning", multi_line=True)
    await recall(session, state)
    build_page(session, await read_kept(PINS), await wants_dark())
    keep(session)
    tell_when_closed()


def address_of(host: str) -> str:
    """Return the address of a host to listen at, that of IPv4 first; raises `InputError` where it has none."""
    try:
        found = socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)
    except (OSError, ValueError):
        expected = "expected a name or address of this machine, such as 127.0.0.1, localhost or 0.0.0.0"
        raise InputError(f"{expected}; got {shown(host)}", key="--host") from None
    return str(min(found, key=lambda entry: entry[0] != socket.AF_INET)[4][0])


def url_of(address: str, port: int) -> str:
    """Return where a browser on this machine finds a server that listens at an address, which may be all of them."""
    listens = ip_address(address)
    if listens.is_unspecified:
        address = HOST if listens.version == 4 else "::1"
    return f"http://{f'[{address}]' if listens.version == 6 else address}:{port}"


def free_port(port: int | None, address: str = HOST) -> int:
    """Return a port of an address on which nobody listens; any free one for 0.

    Raises
    ------
    InputError
        Where the one asked for is taken, or all are, or the address is not one of this machine.
    """
    for candidate in range(FIRST_PORT, LAST_PORT + 1) if port is None else [port]:
        with socket.socket(socket.AF_INET6 if ":" in address else socket.AF_INET) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((address, candidate))
            except (OSError, OverflowError) as error:
                if getattr(error, "errno", None) == errno.EADDRNOTAVAIL:
                    words = f"{address} is not an address of this machine; give one of its own, or 0.0.0.0 for all"
                    raise InputError(words, key="--host") from None
                continue
            return int(probe.getsockname()[1])
    taken = "ports from 8080 to 8179 are taken" if port is None else f"port {port} cannot be used"
    raise InputError(f"{taken}; give another one", key="--port")


def _not_found(request: Request, error: Exception) -> Response:
    """Say which addresses there are, also to a person whose proxy hands on its own path."""
    words = f"softnlp has nothing at {request.url.path}. Its page is at {request.scope.get('root_path', '')}/."
    return PlainTextResponse(
        f"{words} Behind a proxy that shows it under another path, start it with that path: "
        "softnlp gui --root-path PATH\n",
        404,
    )


_FAVICON = (
    '<svg viewBox="0 0 32 32" xmlns="http://www.w3.org/2000/svg"><rect width="32" height="32" rx="6" fill="#0072B2"/>'
    '<path d="M9 27C9 17 12 12 23 8" stroke="#fff" stroke-width="6" fill="none" stroke-linecap="round"/></svg>'
)

_OPEN = (
    "note: at {address} every machine that reaches this one can use the app, without a password; it answers to this "
    "machine's addresses, and to the names of --trusted-host"
)
# Says what is wrong where a proxy takes a path away, so that no file is found, or names another host to the server.
_ALONE = r"""<script>addEventListener("load", async () => {
  const say = words => {
    document.body.style = "font: 16px sans-serif; margin: 3em";
    document.body.textContent = words;
  };
  const refused = words => { if (words.startsWith("Refused")) say(words); };
  window.socket?.on("connect_error", error => { if (error.description === 403) refused(error.context.responseText); });
  if (window.socket) return;
  const path = location.pathname.replace(/\/+$/, "");
  if (!window.io) say("softnlp cannot load its own files. " + (path
    ? `A proxy takes the path ${path} away. Start softnlp with that path: softnlp gui --root-path ${path}`
    : "Look whether its server still runs, then load this page again."));
  else refused(await (await fetch(location.href, { method: "POST" })).text());  // a browser sends Origin with it
});</script>"""
