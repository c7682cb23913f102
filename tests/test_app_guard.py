"""Who is answered: the server's own pages, directly, through tunnels and behind proxies; nobody else, anywhere."""

from __future__ import annotations

import asyncio
import http.client
import re
from collections.abc import Iterator
from typing import Any
from urllib.parse import urlsplit

import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("nicegui", reason="the extra gui is not installed")

from benchmarks.app import served
from softnlp.app.guard import Guard, authority, inside, refusal, root_path, trusted_host
from softnlp.app.server import address_of, free_port, url_of
from softnlp.base.errors import InputError
from softnlp.cli import main

HERE = ("127.0.0.1", 8080)
OWN_HOSTS = ["127.0.0.1:8080", "localhost:8080", "LocalHost:8080", "localhost.:8080", "127.0.0.1.", "[::1]:8080"]
OWN_HOSTS += ["[0:0:0:0:0:0:0:1]", "localhost:9000", "localhost"]  # a tunnel has another port
OTHER_HOSTS = ["lab.example.org", "lab.example.org:8080", "127.0.0.1.example.org", "localhost.example.org", "10.0.0.7"]
OTHER_HOSTS += [
    "",
    "a@localhost",
    "localhost:",
    "localhost:99999",
    "localhost/",
    " localhost",
    "[::2]",
    "localhost:80:80",
]


def test_a_host_is_the_servers_own_or_it_is_refused() -> None:
    for host in OWN_HOSTS:
        assert refusal([host], [], HERE, ()) is None, host
    for host in OTHER_HOSTS:
        words = refusal([host], [], HERE, ())
        assert words is not None, host
        assert "the header Host" in words
    for hosts in ([], ["localhost", "localhost"]):
        assert refusal(hosts, [], HERE, ()) is not None
    assert refusal(["192.0.2.7:8080"], [], ("192.0.2.7", 8080), ()) is None
    assert refusal(["localhost:8080"], [], ("192.0.2.7", 8080), ()) is not None  # that is another server


def test_an_origin_is_the_host_that_was_asked_or_it_is_refused() -> None:
    for host, origin in (
        ("localhost:9000", "http://localhost:9000"),
        ("localhost:9000", "HTTP://LOCALHOST.:9000"),
        ("localhost", "http://localhost:80"),
        ("localhost:443", "https://localhost"),
        ("127.0.0.1:8080", "http://localhost:8080"),
        ("[::1]:8080", "http://[::1]:8080"),
    ):
        assert refusal([host], [origin], HERE, ()) is None, origin
    for origin in ("null", "", "http://localhost:9001", "http://localhost", "https://lab.example.org", "file://"):
        words = refusal(["localhost:9000"], [origin], HERE, ())
        assert words is not None, origin
        assert "the header Origin" in words
    assert refusal(["localhost:9000"], ["http://localhost:9000", "null"], HERE, ()) is not None


def test_a_trusted_host_is_answered_by_the_port_that_it_names() -> None:
    lab = trusted_host("Lab.Example.org")
    assert refusal(["lab.example.org"], ["https://lab.example.org"], HERE, {lab}) is None
    assert refusal(["127.0.0.1:8080"], ["https://lab.example.org"], HERE, {lab}) is None  # a proxy that says its own
    assert refusal(["x.lab.example.org"], [], HERE, {lab}) is not None
    one = trusted_host("lab.example.org:8443")
    assert refusal(["lab.example.org:8443"], [], HERE, {one}) is None
    assert refusal(["lab.example.org:8444"], [], HERE, {one}) is not None
    words = refusal(["lab.example.org:1"], [], HERE, ())
    assert words is not None
    assert words.endswith("--trusted-host lab.example.org")


@given(st.text(max_size=40))
def test_no_text_of_a_header_is_more_than_a_host_or_refused(text: str) -> None:
    named = authority(text)
    own = named is not None and named[0] in ("localhost", "127.0.0.1", "::1")
    assert (refusal([text], [], HERE, ()) is None) == own
    assert refusal(["localhost"], [f"data:{text}"], HERE, ()) is not None


def test_a_path_has_the_root_path_once_whether_a_proxy_took_it_away_or_not() -> None:
    for text, root in (("/softnlp", "/softnlp"), ("user/ada/proxy/8080/", "/user/ada/proxy/8080"), ("/", ""), ("", "")):
        assert root_path(text) == root
        assert inside("/", root) == inside(f"{root}/", root) == f"{root}/"
        assert inside("/x/y", root) == inside(f"{root}/x/y", root) == f"{root}/x/y"
    assert inside("/softnlp2", "/softnlp") == "/softnlp/softnlp2"
    assert inside("/user/a@b/x", "/user/a%40b") == "/user/a%40b/x"  # the server decodes the path
    for wrong in ("../x", "/a//b", "/a b", "http://host/a", '/"', "/a?b"):
        with pytest.raises(InputError, match="--root-path"):
            root_path(wrong)


def test_nothing_behind_the_guard_sees_what_it_refuses() -> None:
    seen: list[Any] = []

    async def behind(scope: Any, receive: Any, send: Any) -> None:
        seen.append(scope)

    def ask(kind: str, host: str) -> list[Any]:
        sent: list[Any] = []

        async def send(message: Any) -> None:
            sent.append(message)

        scope = {"type": kind, "server": HERE, "path": "/a", "headers": [(b"host", host.encode())]}
        scope["headers"] += [(b"x-forwarded-prefix", b"/softnlp")]
        asyncio.run(Guard(behind, root="/softnlp")(scope, None, send))  # type: ignore[arg-type]
        return sent

    assert ask("http", "lab.example.org")[0]["status"] == 403
    assert ask("websocket", "lab.example.org") == [{"type": "websocket.close", "code": 1008, "reason": ""}]
    assert not seen
    for kind in ("http", "websocket"):
        assert ask(kind, "localhost") == []
        assert seen[-1]["path"] == "/softnlp/a"
        assert seen[-1]["root_path"] == "/softnlp"
        assert dict(seen[-1]["headers"]) == {b"host": b"localhost"}
    ask("lifespan", "lab.example.org")
    assert seen[-1]["type"] == "lifespan"


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with served("--root-path", "/softnlp", "--trusted-host", "lab.example.org") as (url, _):
        yield url


def asked(address: str, path: str, *, method: str = "GET", **headers: str) -> tuple[int, str]:
    """Return status and text of an answer; that of a socket has no text."""
    connection = http.client.HTTPConnection(urlsplit(address).netloc, timeout=60)
    connection.request(method, path, headers={key.replace("_", "-"): value for key, value in headers.items()})
    answer = connection.getresponse()
    text = "" if answer.status == 101 else answer.read().decode()
    connection.close()
    return answer.status, text


SOCKET = "/_nicegui_ws/socket.io/?EIO=4&transport="
UPGRADE = {"Connection": "Upgrade", "Upgrade": "websocket", "Sec_WebSocket_Version": "13"}
UPGRADE["Sec_WebSocket_Key"] = "AAAAAAAAAAAAAAAAAAAAAA=="
STRANGE = [{"Host": "other.example.org"}, {"Origin": "https://other.example.org"}, {"Origin": "null"}]
STRANGE += [{"Host": "localhost:9000", "Origin": "http://localhost:9001"}]


def test_pages_files_polling_and_sockets_are_guarded_alike(address: str) -> None:
    page = asked(address, "/")[1]
    file = next(iter(re.findall(r'src="/softnlp(/_nicegui/[^"]+/socket.io[^"]*)"', page)))
    places: list[tuple[str, dict[str, str], int]] = [
        *[(path, {}, 200) for path in ("/", "/softnlp/", "/softnlp", file, f"/softnlp{file}", "/favicon.ico")],
        *[(f"{root}{SOCKET}polling", {}, 200) for root in ("", "/softnlp")],
        *[(f"{root}{SOCKET}websocket", UPGRADE, 101) for root in ("", "/softnlp")],
    ]
    origin = address.rstrip("/")
    own = [{}, {"Origin": origin}, {"Host": "localhost:9000", "Origin": "http://localhost:9000"}]
    own += [{"Host": "lab.example.org", "Origin": "https://lab.example.org"}, {"Origin": "http://lab.example.org:8443"}]
    for path, headers, status in places:
        for more in own:
            assert asked(address, path, **headers, **more)[0] == status, (path, more)
        for more in STRANGE:
            assert asked(address, path, **headers, **more)[0] == 403, (path, more)
    assert asked(address, f"{SOCKET}polling", method="POST", **STRANGE[1])[0] == 403
    assert asked(address, f"{SOCKET}polling", method="OPTIONS", **STRANGE[1])[0] == 403
    assert asked(address, "/closed", method="POST", **STRANGE[1])[0] == 403


def test_an_address_that_is_not_there_says_where_the_page_is(address: str) -> None:
    for path in ("/other/", "/other/_nicegui/3/static/nicegui.js"):
        status, words = asked(address, path)
        assert status == 404
        assert "Its page is at /softnlp/" in words
        assert "--root-path" in words
    assert "/softnlp/softnlp/" not in asked(address, "/", X_Forwarded_Prefix="/softnlp")[1]


@pytest.mark.parametrize(
    ("option", "value"),
    [
        *[("--host", value) for value in ("no.such.host.invalid", "", "http://127.0.0.1", "192.0.2.77", "x" * 300)],
        *[("--root-path", value) for value in ("../up", "a b", "http://lab.example.org/softnlp")],
        *[("--trusted-host", value) for value in ("https://lab.example.org", "*", "", "lab.example.org:x")],
        *[("--port", value) for value in ("99999", "-1", "x")],
    ],
)
def test_a_wrong_option_is_one_line(option: str, value: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["gui", "--no-browser", option, value]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert option in err


def test_a_port_that_is_taken_is_one_line(address: str, capsys: pytest.CaptureFixture[str]) -> None:
    port = str(urlsplit(address).port)
    assert main(["gui", "--no-browser", "--port", port]) == 2
    assert capsys.readouterr().err == f"softnlp: --port: port {port} cannot be used; give another one\n"


def test_where_it_listens_and_where_a_browser_finds_it() -> None:
    assert address_of("localhost") == "127.0.0.1"
    assert free_port(0) > 0
    for listens, url in (("0.0.0.0", "127.0.0.1"), ("::", "[::1]"), ("::1", "[::1]"), ("192.0.2.7", "192.0.2.7")):
        assert url_of(listens, 8080) == f"http://{url}:8080"
