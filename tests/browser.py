"""A real Chromium on a real server of the app: what it shows, asks for outside of this machine and complains of."""

from __future__ import annotations

import io
import json
import re
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchmarks.app import FLAGS, chromium
from softnlp.cli import main

SMALL, WINDOW = ({"width": w, "height": h} for w, h in ((1000, 700), (1280, 800)))  # the small one is drawn sooner
WAIT_MS = 400_000
# Nothing glides: without a graphics card each picture of a movement is drawn by a processor.
STILL = """
addEventListener('DOMContentLoaded', () => {
  const still = document.createElement('style');
  still.textContent = '*, ::before, ::after {animation: none !important; transition: none !important}';
  document.head.append(still);
});
"""


@dataclass
class Watched:
    """A browser tab. outside : addresses asked for that are not the server's. complaints : errors of the console."""

    page: Any
    outside: list[str] = field(default_factory=list)
    complaints: list[str] = field(default_factory=list)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.page, name)

    def text(self, testid: str) -> str:
        """Return what an element says."""
        return str(self.page.inner_text(f"[data-testid='{testid}']"))

    def press(self, testid: str) -> None:
        """Click an element."""
        self.page.click(f"[data-testid='{testid}']")

    def open_panel(self, name: str) -> None:
        """Open a panel on the left, if it is closed."""
        panel = self.page.locator(f"[data-testid=panel-{name}]")
        if "q-expansion-item--collapsed" in (panel.get_attribute("class") or ""):
            panel.locator(".q-item").first.click()
            self.page.wait_for_timeout(400)

    def value_becomes(self, testid: str, text: str) -> None:
        """Wait until a field shows a text."""
        found = f"document.querySelector(\"input[data-testid='{testid}']\")?.value === {json.dumps(text)}"
        self.page.wait_for_function(found)

    def type(self, testid: str, value: str) -> None:
        """Put text into a field."""
        self.page.fill(f"input[data-testid='{testid}'], [data-testid='{testid}'] input", value)

    def choose(self, testid: str, words: str) -> None:
        """Choose an entry of a select by what it says."""
        from playwright.sync_api import Error

        entry = self.page.locator(".q-menu .q-item", has_text=re.compile(re.escape(words))).first
        for _ in range(5):  # a list that opens while the page still moves closes again
            self.page.click(f"[data-testid='{testid}']")
            try:
                entry.click(timeout=4000)
            except Error:
                self.page.keyboard.press("Escape")
                self.page.wait_for_timeout(500)
                continue
            self.page.wait_for_timeout(200)
            return
        raise AssertionError(f"{testid} offers no {words!r}")

    def settled(self) -> None:
        """Wait until the pose shown is that of the controls: nothing changes for a while."""
        before, same = None, 0
        for _ in range(300):
            self.page.wait_for_timeout(120)
            now = (self.numbers(), self.page.get_attribute("[data-frame]", "data-frame"), self.text("certificate"))
            same = same + 1 if now == before else 0
            if same == 4:
                return
            before = now
        raise AssertionError("the page does not come to rest")

    def numbers(self) -> dict[str, str]:
        """Return the results shown, by their key of the JSON document."""
        found: dict[str, str] = self.page.evaluate(
            "() => Object.fromEntries([...document.querySelectorAll('[data-testid^=\"value-\"]')]"
            ".map(e => [e.dataset.testid.slice(6), e.textContent]))"
        )
        return {key: text for key, text in found.items() if not key.startswith("equation.")}

    def shows(self, key: str, value: float, within: float = 0.0) -> None:
        """Wait until a number of the results is a value."""
        for _ in range(60):
            text = self.numbers().get(key, "–")
            if text != "–" and abs(float(text) - value) <= within:
                return
            self.page.wait_for_timeout(250)
        raise AssertionError(f"{key}: {text} instead of {value}")

    def shows_again(self, numbers: dict[str, str]) -> None:
        """Wait until the results are these."""
        for _ in range(60):
            if self.numbers() == numbers:
                return
            self.page.wait_for_timeout(250)
        raise AssertionError(f"{self.numbers()} instead of {numbers}")

    def said(self) -> list[str]:
        """Return what the page says is wrong, beside fields and below the view, once it says something."""
        places = self.page.locator(".q-field__messages [role=alert], [data-testid=message]:visible")
        for _ in range(40):
            words = [text for text in places.all_inner_texts() if text and not text.startswith("Solving")]
            if words:
                return words
            self.page.wait_for_timeout(200)
        return []

    def says_nothing(self) -> None:
        """Wait until the page says of nothing that it is wrong."""
        places = self.page.locator(".q-field__messages [role=alert], [data-testid=message]:visible")
        for _ in range(150):
            if not any(places.all_inner_texts()):
                return
            self.page.wait_for_timeout(100)
        raise AssertionError(f"still said: {places.all_inner_texts()}")

    def saved(self, folder: Path) -> Path:
        """Save what is on the screen and return the file."""
        with self.page.expect_download(timeout=WAIT_MS) as waiting:
            self.press("save")
        file = folder / waiting.value.suggested_filename
        waiting.value.save_as(file)
        return file


@contextmanager
def browser() -> Iterator[Any]:
    """Yield a function that opens an address in a tab."""
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as profile, sync_playwright() as play:
        context = play.chromium.launch_persistent_context(
            profile, executable_path=chromium(), args=list(FLAGS), viewport=SMALL
        )
        context.set_default_timeout(WAIT_MS)
        context.add_init_script(STILL)

        def tab(address: str) -> Watched:
            watched = Watched(context.new_page())
            watched.page.on("request", lambda r: _note_request(watched, address, r.url))
            watched.page.on("console", lambda m: watched.complaints.append(m.text) if m.type == "error" else None)
            watched.page.on("pageerror", lambda e: watched.complaints.append(str(e)))
            watched.page.goto(address)
            watched.page.wait_for_selector("[data-frame]", state="attached")
            return watched

        yield tab
        context.close()


def _note_request(watched: Watched, address: str, url: str) -> None:
    if not url.startswith((address, address.replace("http", "ws"), "data:", "blob:")):
        watched.outside.append(url)


def run_json(scenario: Path) -> dict[str, Any]:
    """Return what the command prints for a scenario."""
    printed = io.StringIO()
    with redirect_stdout(printed):
        main(["run", str(scenario), "--json"])
    document: dict[str, Any] = json.loads(printed.getvalue())
    return document


def shown_like(text: str, value: float) -> bool:
    """Whether a number on the page is one of the command to the digits shown; a tie may be rounded either way."""
    decimals = len(text.partition(".")[2])
    return abs(float(text) - value) <= 0.5 * 10**-decimals + 2e-5


def assert_same_as_the_command(tab: Watched, folder: Path) -> None:
    """Compare every number shown with that of the last step of the saved scenario, run by the command."""
    tab.settled()
    step = run_json(tab.saved(folder))["steps"][-1]
    for _ in range(20):  # a busy machine may still be drawing
        differs = difference(tab.numbers(), step)
        if not differs:
            return
        tab.page.wait_for_timeout(500)
    raise AssertionError(differs)


def difference(shown: dict[str, str], step: dict[str, Any]) -> str:
    """Return what differs between numbers on the page and those of the command, "" for nothing."""
    compared = 0
    for key, text in shown.items():
        name, _, index = key.partition(".")
        if name in step:
            value = step[name][int(index)] if index else step[name]
            if text == "–" or value is None or not shown_like(text, value):
                return f"{key}: {text} on the page, {value} of the command"
            compared += 1
    return "" if compared >= 9 else f"only {compared} numbers are shown"


def keeps(tab: Watched, text: str) -> None:
    """Wait until the browser keeps a text of what is on the screen."""
    kept = "Object.values(sessionStorage).join()"
    tab.page.wait_for_function(f"{kept}.includes({text!r})")


def reload(tab: Watched) -> None:
    """Load the page again, as a person does who is lost."""
    tab.page.reload()
    tab.page.wait_for_selector("[data-frame]", state="attached")
    tab.settled()
