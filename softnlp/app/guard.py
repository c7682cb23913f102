"""Which requests the server answers: those of its own pages, directly, through a tunnel, or behind a proxy.

A page of somewhere else that a person has open can send requests to this machine, and by a name that it lets point
here it could read the answers. Both show in the headers Host and Origin, which a page cannot choose.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from ipaddress import ip_address
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote

from softnlp.base.errors import InputError
from softnlp.base.reading import shown

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Receive, Scope, Send

Authority = tuple[str, int | None]
"""A host in one spelling, and its port where one is named."""

_LOOPBACK = ("localhost", "127.0.0.1", "::1")
_PORTS = {"http": 80, "https": 443}
_AUTHORITY = re.compile(r"(?P<name>\[[0-9a-f:.]+\]|[a-z0-9_-]+(\.[a-z0-9_-]+)*)\.?(:(?P<port>[0-9]{1,5}))?")
_SEGMENT = re.compile(r"[A-Za-z0-9._~!$&'()*+,;=:@%-]+")
_PREFIX = b"x-forwarded-prefix"


def authority(text: str) -> Authority | None:
    """Return what HOST or HOST:PORT names; None for text that is neither."""
    found = _AUTHORITY.fullmatch(text.lower())
    if found is None or int(found["port"] or 0) > 65535:
        return None
    name = found["name"].strip("[]")
    try:
        address = ip_address(name)
    except ValueError:
        pass
    else:
        name = str(getattr(address, "ipv4_mapped", None) or address)
    return name, None if found["port"] is None else int(found["port"])


def trusted_host(text: str) -> Authority:
    """Return a host that a person trusts; raises `InputError` for what is not HOST or HOST:PORT."""
    found = authority(text)
    if found is None:
        expected = "expected a name or address with or without a port, such as lab.example.org or lab.example.org:8443"
        raise InputError(f"{expected}; got {shown(text)}", key="--trusted-host")
    return found


def root_path(text: str) -> str:
    """Return the path under which a proxy shows the app, "" for none; raises `InputError` for what is no path."""
    path = text.strip("/")
    segments = path.split("/") if path else []
    if any(segment in (".", "..") or not _SEGMENT.fullmatch(segment) for segment in segments):
        raise InputError(f"expected the path of an address, such as /softnlp; got {shown(text)}", key="--root-path")
    return "".join(f"/{segment}" for segment in segments)


def refusal(
    hosts: Sequence[str], origins: Sequence[str], server: Authority, trusted: Collection[Authority]
) -> str | None:
    """Return why a request is not answered, in words; None for one that is.

    Its host is the address at which it arrived, a name of loopback if that is one (by any port, as tunnels have
    another), or trusted. An origin, which pages send along, is that same host, the server itself, or trusted.

    hosts, origins : values of these headers. server : address and port at which the request arrived.
    """
    own = {server[0], *(_LOOPBACK if _is_loopback(server[0]) else ())}
    host = authority(hosts[0]) if len(hosts) == 1 else None
    if host is None or not (host[0] in own or _trusts(trusted, host)):
        return _words("Host", hosts, host)
    for origin in origins:
        scheme, _, rest = origin.lower().partition("://")
        port = _PORTS.get(scheme)
        asked = None if port is None else authority(rest)
        if asked is None:
            return _words("Origin", [origin])
        name, asked_port = asked[0], asked[1] or port
        same = (name, asked_port) == (host[0], host[1] or port)
        if not (same or (name in own and asked_port == server[1]) or _trusts(trusted, asked)):
            return _words("Origin", [origin], asked)
    return None


def inside(path: str, root: str) -> str:
    """Return the path of a request with the root path in front, whether or not the proxy took that away."""
    taken = unquote(root)
    rest = path[len(taken) :] if path == taken or path.startswith(f"{taken}/") else path
    return root + (rest or "/")


@dataclass(frozen=True)
class Guard:
    """Stands in front of an ASGI app: refuses with status 403, on pages, files and sockets alike, or hands on.

    trusted : hosts besides the server's own. root : path under which a proxy shows the app, "" for none.
    """

    app: ASGIApp
    trusted: Collection[Authority] = ()
    root: str = ""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request or one socket."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        address, port = scope.get("server") or ("", None)
        server = ((authority(f"[{address}]" if ":" in address else address) or (address, None))[0], port)
        words = refusal(_values(scope, b"host"), _values(scope, b"origin"), server, self.trusted)
        if words is not None:
            await _refuse(scope, send, words)
            return
        if self.root:  # it says what the header of a proxy says, which else would count twice
            headers = [(name, value) for name, value in scope["headers"] if name != _PREFIX]
            scope = {**scope, "root_path": self.root, "path": inside(scope["path"], self.root), "headers": headers}
        await self.app(scope, receive, send)


async def _refuse(scope: Scope, send: Send, words: str) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.close", "code": 1008, "reason": ""})  # before it was accepted: status 403
        return
    headers = [(b"content-type", b"text/plain; charset=utf-8"), (b"cache-control", b"no-store")]
    await send({"type": "http.response.start", "status": 403, "headers": headers})
    await send({"type": "http.response.body", "body": f"{words}\n".encode()})


def _values(scope: Any, name: bytes) -> list[str]:
    return [value.decode("latin-1") for key, value in scope["headers"] if key == name]


def _is_loopback(address: str) -> bool:
    try:
        return ip_address(address).is_loopback
    except ValueError:
        return False


def _trusts(trusted: Collection[Authority], asked: Authority) -> bool:
    return asked in trusted or (asked[0], None) in trusted


def _words(header: str, values: Sequence[str], asked: Authority | None = None) -> str:
    got = ", ".join(shown(value) for value in values) or "missing"
    name = "NAME" if asked is None else asked[0]
    return (
        f"Refused: the header {header} of this request is {got}, which is not this server's own. If people shall open "
        f"softnlp under that name, start it with softnlp gui --trusted-host {name}"
    )
