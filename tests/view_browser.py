"""A server of `view_page` and a browser without a graphics card: what the test and the benchmark of the view share."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

PAGE = Path(__file__).with_name("view_page.py")
FLAGS = [
    *("--headless=new", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking"),
    *("--disable-component-update", "--disable-sync"),
    *("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"),
]
STAGE = "getElement(Number(document.querySelector('.softnlp-view').id.slice(1))).stage"


@contextmanager
def served() -> Iterator[str]:
    """Serve the page on a free port of this machine; yield its address."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    known = os.pathsep.join([str(PAGE.parents[1]), *filter(None, [os.environ.get("PYTHONPATH")])])
    # NiceGUI would take a run below pytest for a test of its own.
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST_")} | {"PYTHONPATH": known}
    process = subprocess.Popen(
        [sys.executable, str(PAGE), str(port)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment
    )
    try:
        for _ in range(300):
            try:
                socket.create_connection(("127.0.0.1", port)).close()
                break
            except OSError:
                assert process.poll() is None, "the page did not start"
                time.sleep(0.1)
        yield f"http://127.0.0.1:{port}/"
    finally:
        process.terminate()
        process.wait()


def drawn(page: Any, number: int) -> None:
    """Wait until the view on a page has drawn a frame."""
    page.wait_for_selector(f'.softnlp-view[data-frame="{number}"]', timeout=30_000)
