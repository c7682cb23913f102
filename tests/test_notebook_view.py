"""The 3-D view in a notebook: one page that holds all it needs, and a browser that draws each step of it alone."""

from __future__ import annotations

import json
import re
import shutil
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")

from view_browser import FLAGS

from softnlp import (
    AS_PRINTED,
    BAR,
    InputError,
    Loads,
    Run,
    Segment,
    blocked_force,
    forward,
    material,
    robot,
    segmented_robot,
)
from softnlp.app.view import NotebookView
from softnlp.app.view import notebook as written
from softnlp.app.view.frame import frame_message, frame_of
from softnlp.results import view_of_run

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
ARM, SILICONE = robot("D25L60"), material("Ecoflex 00-50", "yeoh")


@pytest.fixture(scope="module")
def loaded() -> Run:
    """Three poses under loads, the last without an equilibrium."""
    loads = Loads(tip_force=(0, 0, -0.05), gravity="standing")
    P = BAR * np.array([[0.0, 0, 0], [1.0, 0, 0], [1.5, 1.5, 1.5]])
    return forward(ARM, SILICONE, P, loads=loads, conventions=AS_PRINTED, title="</script>&<b>")


def data(page: str) -> dict[str, Any]:
    found = re.search(r'<script id="data" type="application/json">(.*?)</script>', page, re.DOTALL)
    assert found is not None
    message: dict[str, Any] = json.loads(found[1])
    return message


def test_the_page_holds_the_frame_of_each_solved_step(loaded: Run) -> None:
    frames = data(NotebookView(loaded).page)["frames"]
    assert [frame["id"] for frame in frames] == [1, 2]
    body = view_of_run(loaded).bodies[1]
    assert body is not None
    own = frame_of(ARM, body, loaded.steps[1].pressure, tip_force=(0, 0, -0.05), gravity=loaded.loads.gravity)
    assert {key: frames[1][key] for key in ("body", "arrows")} == {
        key: frame_message(own, 2, 1.5)[key] for key in ("body", "arrows")
    }
    assert frames[1]["said"].startswith("step 2 of 3: 1, 0, 0 bar, bending ")


def test_a_wall_its_force_and_the_free_shape_are_shown() -> None:
    run = blocked_force(ARM, SILICONE, [[1.0 * BAR, 0, 0]])
    (frame,) = data(NotebookView(run).page)["frames"]
    assert frame["wall"]["normal"] == [1.0, 0.0, 0.0]
    assert frame["ghost"] is not None
    assert frame["said"].endswith(f"force {run.steps[0].contact.force:.3g} N")


def test_the_cell_is_the_page_in_a_frame_and_the_page_needs_no_other_file(loaded: Run, tmp_path: Path) -> None:
    view = NotebookView(loaded, height=300)
    cell = re.fullmatch(
        r'<iframe srcdoc="([^"]*)" title="[^"]+" style="width:100%;height:300px;border:0"></iframe>', view._repr_html_()
    )
    assert cell is not None
    assert unescape(cell[1]) == view.page == view.save(tmp_path / "robot.html").read_text()
    assert view.page.count("</script>") == 3  # no title ends a script
    assert not re.search(r'(?:src|href)="(?!data:)', view.page)
    imported = re.search(r'<script type="importmap">(.*?)</script>', view.page)
    assert imported is not None
    assert all(address.startswith("data:") for address in json.loads(imported[1])["imports"].values())


def test_what_cannot_be_shown_is_one_line(loaded: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    half = Segment(robot("D25L60", length=0.03), SILICONE)
    two = segmented_robot([half, half])
    with pytest.raises(InputError, match="a robot of one segment"):
        NotebookView(forward(two, two.material, [[0.0] * 6]))
    with pytest.raises(InputError, match="this run has none"):
        NotebookView(forward(ARM, SILICONE, [[1.5 * BAR] * 3], conventions=AS_PRINTED))
    written._modules.cache_clear()
    monkeypatch.setattr(written, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"needs the extra gui: pip install -e '.\[gui\]'"):
        NotebookView(loaded)


@pytest.mark.thorough
@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium on this machine")
def test_a_browser_draws_each_step_and_asks_nobody(loaded: Run, tmp_path: Path) -> None:
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    (tmp_path / "cell.html").write_text(f"<!DOCTYPE html><title>cell</title>{NotebookView(loaded)._repr_html_()}")
    said: list[str] = []
    asked: list[str] = []
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        page = browser.new_page(viewport={"width": 500, "height": 460})
        page.on("console", lambda message: said.append(message.text) if message.type in ("error", "warning") else None)
        page.on("pageerror", lambda error: said.append(str(error)))
        page.on("request", lambda request: asked.append(request.url))
        page.goto((tmp_path / "cell.html").as_uri())
        cell = page.frame_locator("iframe")
        cell.locator("#view[data-frame='2']").wait_for(timeout=60_000)
        bent = page.screenshot()
        cell.locator("#step").focus()
        page.keyboard.press("ArrowLeft")
        cell.locator("#view[data-frame='1']").wait_for(timeout=60_000)
        assert cell.locator("#said").inner_text().startswith("step 1 of 3")
        assert page.screenshot() != bent
        browser.close()
    assert not said
    assert all(url.startswith(("file:", "data:", "about:")) for url in asked)
