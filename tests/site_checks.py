"""Checks of the built site, which .ci/run does after `mkdocs build`: nothing is fetched, formulas, figures are there.

Not collected by pytest on its own: the site needs to be built first.
"""

from __future__ import annotations

import re
from functools import partial
from html.parser import HTMLParser
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread

import pytest

import softnlp
from benchmarks.app import FLAGS, chromium

ROOT = Path(__file__).parents[1]
SITE = ROOT / "site"
PAGES = sorted(SITE.rglob("*.html"))
FETCHING = {
    ("link", "href"),
    ("script", "src"),
    ("img", "src"),
    ("img", "srcset"),
    ("source", "src"),
    ("iframe", "src"),
}
FETCHING |= {("video", "src"), ("object", "data"), ("embed", "src"), ("use", "href"), ("form", "action")}


class References(HTMLParser):
    """What a page makes a browser fetch, and its anchors."""

    def __init__(self) -> None:
        super().__init__()
        self.fetched: list[str] = []
        self.formulas = self.images = 0

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.fetched += [given[key] or "" for name, key in FETCHING if name == tag and key in given]
        self.formulas += tag == "math"
        self.images += tag == "img"


def read(page: Path) -> References:
    found = References()
    found.feed(page.read_text())
    return found


def outside(address: str) -> bool:
    """Whether a browser asks another host for it."""
    return bool(re.match(r"(?:[a-z]+:)?//", address))


def test_the_site_was_built() -> None:
    assert len(PAGES) > 30, "build it first: mkdocs build --strict"


def test_a_page_fetches_nothing_from_elsewhere() -> None:
    fetched = {(page.name, address) for page in PAGES for address in read(page).fetched}
    assert len(fetched) > 100
    assert not {item for item in fetched if outside(item[1])}


def test_style_sheets_fetch_nothing_from_elsewhere() -> None:
    sheets = sorted(SITE.rglob("*.css"))
    assert sheets
    for sheet in sheets:
        addresses = re.findall(r"(?:url\(|@import\s+)[\"']?([^\"')]+)", sheet.read_text())
        assert not [address for address in addresses if outside(address)], sheet.name


def test_every_local_file_is_there() -> None:
    for page in PAGES:
        if page.name == "404.html":  # its addresses count from the host
            continue
        for address in read(page).fetched:
            path = address.partition("#")[0].partition("?")[0]
            assert not path or path.startswith("data:") or (page.parent / path).exists(), f"{page.name}: {address}"


def test_formulas_are_mathml_and_none_is_left() -> None:
    assert read(SITE / "model.html").formulas > 80
    for page in PAGES:
        assert "arithmatex" not in page.read_text(), page.name


def test_figures_and_tables_stand_in_place_of_their_scripts() -> None:
    for page in PAGES:
        assert not re.search(r'href="[^"]*figures/\w+\.py"', page.read_text()), page.name
    assert read(SITE / "model.html").images >= 3
    assert "as settled" in (SITE / "model.html").read_text()
    assert "<td><code>tip_position_mm</code></td>" in (SITE / "formats.html").read_text()


@pytest.mark.parametrize("name", sorted(set(softnlp.__all__) - {"__version__"}))
def test_a_name_of_the_interface_has_its_entry(name: str) -> None:
    assert re.search(
        rf'id="softnlp\.[\w.]*\b{name}"', "".join(page.read_text() for page in sorted((SITE / "api").glob("*.html")))
    )


GUIDES = {
    "hanging": "how-to/loaded.html",
    "gravity": "how-to/loaded.html",
    "outer wall": "tutorial.html",
    "collocation": "nlp.html",
    "multipliers": "nlp.html",
    "kPa": "glossary.html",
    "closure": "how-to/blocked-force.html",
}
"""The page that a word of a person has to lead to first."""


@pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine")
def test_the_search_leads_to_guides_before_sources() -> None:
    """The search box of the site itself, in a browser."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    handler = partial(Quiet, directory=str(SITE))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server, sync_api.sync_playwright() as play:
        Thread(target=server.serve_forever, daemon=True).start()
        browser = play.chromium.launch(executable_path=chromium(), args=list(FLAGS))
        page = browser.new_page(viewport={"width": 1280, "height": 800})
        first = {}
        for words in GUIDES:
            page.goto(f"http://127.0.0.1:{server.server_port}/index.html")
            page.click(".md-search__input")
            page.keyboard.type(words)
            link = page.locator("a.md-search-result__link").first
            link.wait_for(state="attached", timeout=60_000)
            page.wait_for_timeout(500)  # for the results of the last letters
            address = str(link.get_attribute("href")).partition("?")[0].partition("#")[0]
            first[words] = address.split(f":{server.server_port}/")[-1]
        browser.close()
        server.shutdown()
    assert first == GUIDES


class Quiet(SimpleHTTPRequestHandler):
    """Serves the site without a line for each file."""

    def log_message(self, *args: object) -> None:
        """Say nothing."""
