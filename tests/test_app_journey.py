"""A person who has only the app: designs a robot, pins it, tries another, goes back, and takes the report along."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")
pytest.importorskip("playwright", reason="playwright is not installed")

from benchmarks.app import chromium
from tests.browser import Watched, keeps, reload

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine"),
]


def test_a_design_is_pinned_compared_and_reported(tab: Watched, new_tab: Any, tmp_path: Path, pictures: Path) -> None:
    """The ten steps of a person, as docs/app.md names them."""
    first = tab.numbers()
    tab.press("pin")  # 1: the robot to beat
    tab.press("tab-design")  # 2
    tab.press("design.example")  # 3
    tab.settled()
    tab.press("design.run")  # 4
    tab.page.wait_for_selector("[data-testid='design.use']:visible", timeout=300_000)
    found = re.search(r"bending angle ([\d.]+) ° at 0.8 bar", tab.text("design.why"))
    assert found
    tab.press("design.use")  # 5
    tab.settled()
    tab.shows("bending_angle_deg", float(found[1]), 0.05)  # solved again by the page
    assert float(found[1]) > 2 * float(first["bending_angle_deg"])
    tab.press("pin")  # 6
    tab.type("pressure-number-1", "0.5")  # 7
    tab.settled()
    less = float(tab.text("pin.A.bending_angle_deg"))
    now = float(tab.numbers()["bending_angle_deg"])
    assert less == pytest.approx(now - float(first["bending_angle_deg"]), abs=2e-3)
    tab.page.screenshot(path=pictures / "app_pins.png")
    tab.press("export")  # 8
    with tab.page.expect_download() as waiting:
        tab.press("report")  # 9
    report = Path(waiting.value.path()).read_text()
    assert report.count("<img") >= 3  # picture, section, design
    assert "Pinned states" in report
    # back by the keyboard, there again, and the pins outlive a reload
    tab.page.locator("[data-testid=view]").focus()
    drawn = tab.page.locator("[data-testid=view]").screenshot()
    tab.page.keyboard.press("ArrowLeft")
    tab.page.wait_for_timeout(600)
    assert tab.page.locator("[data-testid=view]").screenshot() != drawn
    tab.page.keyboard.press("Control+z")
    tab.value_becomes("pressure-number-1", "0.8")
    tab.page.keyboard.press("Control+y")
    tab.value_becomes("pressure-number-1", "0.5")
    # a robot that cannot be made is grey, and said once
    tab.type("robot-outer_diameter_mm", "15")
    tab.page.wait_for_selector("[data-testid=message]:has-text('Grey')")
    assert tab.page.locator(".softnlp-stale").count() == 2
    said = tab.page.locator("[data-testid='robot-outer_diameter_mm-said']").inner_text()
    assert "outer diameter at least 2" in said
    tab.page.screenshot(path=pictures / "app_grey.png")
    tab.page.locator("[data-testid=view]").focus()
    tab.page.keyboard.press("Control+z")
    tab.says_nothing()
    assert tab.page.locator(".softnlp-stale").count() == 0
    shown = tab.numbers()
    tab.page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    tab.press("history")
    tab.press("history-link")
    tab.page.wait_for_selector("text=copied a link")
    link = tab.evaluate("navigator.clipboard.readText()")
    other = new_tab()
    other.page.goto(link)
    other.page.wait_for_selector("[data-frame]", state="attached")
    other.shows_again(shown)
    assert "state=" not in other.page.url
    other.page.close()
    keeps(tab, "sequence_bar")
    reload(tab)
    assert tab.page.locator("[data-testid='pin.B.name']").count() == 1
