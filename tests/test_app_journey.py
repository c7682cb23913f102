"""A person who has only the app: designs a robot, pins it, tries another, goes back, and takes the report along."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")
pytest.importorskip("playwright", reason="playwright is not installed")

from benchmarks.app import chromium
from docs.tools.steps import Step, action, steps
from tests.browser import Watched, keeps, reload

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine"),
]


def follow(tab: Watched, step: Step) -> None:
    """Do what a step says, to what bears the name that it says."""
    verb, name, number = action(step)
    page = tab.page
    if verb == "Put":
        page.locator(f"//*[text()='{name}']/following::input[@type='number'][1]").fill(number)
    elif verb == "Open the tab":
        page.get_by_role("tab", name=name).click()
    else:
        page.get_by_text(name, exact=True).locator("visible=true").first.click()


def test_a_design_is_pinned_compared_and_reported(tab: Watched, new_tab: Any, tmp_path: Path, pictures: Path) -> None:
    """The steps of a person, by what docs/how-to/first-tasks.md says to press, and by nothing else."""
    told = iter(steps("how-to/first-tasks", "Only the app: design, pin, compare, report"))
    first = tab.numbers()
    for _ in range(3):  # the robot to beat is pinned, and an example of a design opened
        follow(tab, next(told))
    tab.settled()
    follow(tab, next(told))
    tab.page.wait_for_selector("[data-testid='design.use']:visible", timeout=300_000)
    found = re.search(r"bending angle ([\d.]+) ° at 0.8 bar", tab.text("design.why"))
    assert found
    follow(tab, next(told))
    tab.settled()
    tab.shows("bending_angle_deg", float(found[1]), 0.05)  # solved again by the page
    assert float(found[1]) > 2 * float(first["bending_angle_deg"])
    follow(tab, next(told))
    follow(tab, next(told))
    tab.settled()
    less = float(tab.text("pin.A.bending_angle_deg"))
    now = float(tab.numbers()["bending_angle_deg"])
    assert less == pytest.approx(now - float(first["bending_angle_deg"]), abs=2e-3)
    tab.page.screenshot(path=pictures / "app_pins.png")
    follow(tab, next(told))
    with tab.page.expect_download() as waiting:
        follow(tab, next(told))
    assert next(told, None) is None
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
