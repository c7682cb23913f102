"""How quickly the app answers: `python -m benchmarks.app`. Needs the extra gui, playwright and a Chromium.

Times the start of `softnlp gui` until its page answers, and from a key press on a slider until the 3-D view has
drawn the new shape, as the browser sees both: the press travels to the server, the pose is solved, the frame travels
back and is drawn. Beside it stand the same way without solving (a frame that is drawn again) and the processor time
that the server spends on a press and on its start, which other work on the machine changes little.
"""

from __future__ import annotations

import argparse
import os
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from shutil import which
from statistics import median, quantiles
from typing import Any

HOST = "127.0.0.1"
FLAGS = (
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)
SCENARIOS = Path(__file__).parents[1] / "scenarios"
CASES: dict[str, tuple[str, dict[str, str]]] = {
    "no load": ("", {}),
    "tip force and gravity": ("", {"tip_load.force_N.0": "0.05", "tip_load.force_N.1": "0.02"}),
    "two segments": ("two_segments.toml", {}),
    "energy section": ("D25L60_energy.toml", {}),
    "obstacle": ("contact/sphere.toml", {}),
}
"""Scenario, the first robot for "", and fields of the page that are filled."""
# Notes when a key goes down and when the view has drawn the next frame.
WATCH = """
() => {
  const view = document.querySelector('[data-frame]');
  window.times = [];
  let began = 0;
  document.addEventListener('keydown', () => { began = performance.now(); }, true);
  new MutationObserver(() => { if (began) { window.times.push(performance.now() - began); began = 0; } })
    .observe(view, { attributes: true, attributeFilter: ['data-frame'] });
}
"""


def chromium() -> str | None:
    """Return the browser's path."""
    return next((path for name in ("chromium", "chromium-browser", "google-chrome") if (path := which(name))), None)


def free_port() -> int:
    """Return a port on which nobody listens."""
    with socket.socket() as probe:
        probe.bind((HOST, 0))
        port: int = probe.getsockname()[1]
        return port


def processor_time(process: subprocess.Popen[bytes]) -> float:
    """Return the processor time of a process so far [s]; nan where the system does not tell."""
    try:
        user, system = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()[11:13]
    except OSError:
        return float("nan")
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


@contextmanager
def served(*arguments: str, port: int | None = None) -> Iterator[tuple[str, float]]:
    """Start the app; yield its address and how long it took until the page answered [s]."""
    with server(*arguments, port=port) as (address, seconds, _):
        yield address, seconds


@contextmanager
def server(*arguments: str, port: int | None = None) -> Iterator[tuple[str, float, subprocess.Popen[bytes]]]:
    """Start the app; yield its address, how long it took until the page answered [s], and its process."""
    port = port or free_port()
    began = time.perf_counter()
    command = [sys.executable, "-m", "softnlp", "gui", *arguments, "--no-browser", "--port", str(port)]
    # NiceGUI behaves otherwise where it believes itself under test
    environment = {key: value for key, value in os.environ.items() if not key.startswith("PYTEST")}
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, env=environment)
    address = f"http://{HOST}:{port}/"
    try:
        while process.poll() is None:
            try:
                urllib.request.urlopen(address, timeout=10).read()
                break
            except OSError:
                time.sleep(0.02)
        else:
            raise RuntimeError(f"softnlp gui ended with status {process.returncode}")
        yield address, time.perf_counter() - began, process
    finally:
        process.terminate()
        process.wait(10)


def presses(page: Any, count: int) -> list[float]:
    """Press a key on the slider of set 1 so often; return from press to drawn [ms]."""
    page.evaluate(WATCH)
    page.locator("[data-testid=pressure-slider-1] [tabindex='0']").first.focus()
    for k in range(count):
        page.keyboard.press("ArrowRight")
        page.wait_for_function(f"window.times.length > {k}", timeout=120_000)
        page.wait_for_timeout(30)
    times: list[float] = page.evaluate("window.times")
    return times


def drawn_only(page: Any, count: int) -> list[float]:
    """Return how long the browser takes to draw a frame that it has [ms]."""
    return [float(page.evaluate("() => new Promise(done => { const t = performance.now(); requestAnimationFrame(() => "
                                "requestAnimationFrame(() => done(performance.now() - t))); })"))
            for _ in range(count)]  # fmt: skip


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--presses", type=int, default=60)
    parser.add_argument("--starts", type=int, default=3)
    chosen = parser.parse_args()
    from playwright.sync_api import sync_playwright

    browser_path = chromium()
    if browser_path is None:
        sys.exit("no Chromium found; install one to measure")
    starts, spent = [], []
    for _ in range(chosen.starts):
        with server() as (_, seconds, process):
            starts.append(seconds)
            spent.append(processor_time(process))
    print(f"softnlp gui until the page answers: median {median(starts):.2f} s of {len(starts)}, "
          f"of which {median(spent):.2f} s of processor time")  # fmt: skip
    with tempfile.TemporaryDirectory() as profile, sync_playwright() as play:
        browser = play.chromium.launch_persistent_context(
            profile, executable_path=browser_path, args=list(FLAGS), viewport={"width": 1280, "height": 800}
        )
        for name, (scenario, fields) in CASES.items():
            with server(*([str(SCENARIOS / scenario)] if scenario else [])) as (address, _, process):
                page = browser.new_page()
                _filled(page, address, fields)
                before = processor_time(process)
                times = presses(page, chosen.presses)
                each = 1e3 * (processor_time(process) - before) / len(times)
                frame = median(drawn_only(page, 20))
                page.close()
            ninth = quantiles(times, n=10)[-1]
            print(f"{name}: slider to redrawn shape, median {median(times):.0f} ms, nine in ten within {ninth:.0f} ms; "
                  f"{each:.0f} ms of the server's processor; two frames of the browser alone {frame:.0f} ms",
                  flush=True)  # fmt: skip
        browser.close()


def _filled(page: Any, address: str, fields: dict[str, str]) -> None:
    """Open the app and fill fields of the loads."""
    page.goto(address)
    page.wait_for_selector("[data-frame]", state="attached", timeout=60_000)
    page.fill("input[data-testid=pressure-number-1]", "0.3")
    if fields:
        page.click("[data-testid=panel-loads] .q-item")
        page.wait_for_timeout(500)
    for field, value in fields.items():
        page.fill(f"input[data-testid='{field}']", value)
    page.wait_for_timeout(2500)


if __name__ == "__main__":
    main()
