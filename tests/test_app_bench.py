"""Obstacles, segments and motion in a real Chromium, as a designer uses them: dragged, by keys, played, saved."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")
pytest.importorskip("playwright", reason="playwright is not installed")

from benchmarks.app import chromium
from tests.browser import Watched, assert_same_as_the_command

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine"),
]
WIDE = {"width": 1280, "height": 900}
BALL = "[data-testid='obstacle.1.centre_mm.{}']"


def _centre(tab: Watched) -> list[float]:
    return [float(tab.page.locator(BALL.format(k)).input_value()) for k in range(3)]


def test_an_obstacle_is_placed_by_numbers_by_dragging_and_by_keys(tab: Watched, tmp_path: Path) -> None:
    tab.page.set_viewport_size(WIDE)
    tab.open_panel("obstacles")
    tab.press("obstacle.add")
    tab.page.wait_for_selector("[data-testid='obstacle.1.radius_mm']")
    tab.type("obstacle.1.name", "liver")
    tab.type("obstacle.1.radius_mm", "16")  # so large that the middle of the ball is easy to take
    tab.type("obstacle.1.centre_mm.0", "-38")
    tab.shows("tip_position_mm.1", 0.0, within=0.01)
    assert_same_as_the_command(tab, tmp_path)
    row = tab.page.locator("[data-testid=contacts] tbody tr").first.inner_text()
    assert row.split("\t")[0].strip() == "liver"
    assert float(row.split("\t")[1]) > 0.01
    assert "N mm" in tab.text("complementarity")
    before = _centre(tab)
    view = tab.page.locator("[data-testid=view]")
    view.focus()
    tab.page.keyboard.press("o")
    assert view.locator("[role=status]").inner_text() == "liver"
    tab.page.keyboard.press("Shift+ArrowLeft")
    tab.page.wait_for_function(f'parseFloat(document.querySelector("{BALL.format(0)}").value) !== {before[0]}')
    assert np.isclose(np.linalg.norm(np.subtract(_centre(tab), before)), 1.0, atol=2e-3)
    by_key = _centre(tab)
    box = view.locator("canvas").bounding_box()
    taken = False
    for k in range(12):  # from the left to the middle: the first point of the ball that a pointer meets
        x, y = box["x"] + box["width"] * (0.14 + 0.03 * k), box["y"] + box["height"] * 0.47
        tab.page.mouse.move(x, y)
        tab.page.mouse.down()
        tab.page.mouse.move(x - 8, y, steps=2)
        tab.page.mouse.up()
        tab.page.wait_for_timeout(400)
        if _centre(tab) != by_key:
            taken = True
            break
        tab.press("view-reset")  # it was the view that turned
    assert taken
    moved = np.subtract(_centre(tab), by_key)
    assert moved[0] < 0
    assert np.linalg.norm(moved) < 30
    tab.type("obstacle.1.centre_mm.0", "-20")
    tab.page.wait_for_selector("[data-testid=message]:has-text('The robot overlaps liver by')")
    tab.type("obstacle.1.centre_mm.0", "-45")
    tab.says_nothing()
    text = tab.saved(tmp_path).read_text()
    (row,) = tomllib.loads(text)["obstacle"]
    assert row["name"] == "liver"
    tab.press("obstacle.1.remove")
    tab.page.wait_for_selector("[data-testid=contacts]", state="hidden")
    assert tab.complaints == []


def test_a_robot_gets_a_second_segment_with_sliders_of_its_own(tab: Watched, tmp_path: Path) -> None:
    tab.open_panel("segments")
    tab.press("segment.duplicate")
    tab.page.wait_for_selector("[data-testid=pressure-slider-6]")
    tab.type("pressure-number-5", "0.4")
    tab.type("segment.connector_mm", "4")
    tab.choose("segment.choice", "1: D25L60")
    tab.type("robot-length_mm", "45")
    assert_same_as_the_command(tab, tmp_path)
    rows = tab.page.locator("[data-testid=segments] tbody tr").all_inner_texts()
    assert len(rows) == 2
    assert rows[0].split("\t")[0].strip() == "1"
    first, second = tomllib.loads(tab.saved(tmp_path).read_text())["segment"]
    assert (first["robot"]["length_mm"], second["connector_mm"]) == (45, 4)
    tab.press("tab-design")
    tab.page.wait_for_selector("[data-testid='design.note']:has-text('several segments')")
    assert tab.complaints == []


def test_a_pressure_is_drawn_run_and_played(tab: Watched, tmp_path: Path) -> None:
    tab.page.set_viewport_size(WIDE)
    tab.press("tab-time")
    picture = tab.page.locator("[data-testid='motion.draw'] svg")
    picture.wait_for()
    box = picture.bounding_box()
    begin, end, height = box["x"] + 60, box["x"] + box["width"] - 40, box["y"] + 0.6 * box["height"]
    tab.page.mouse.move(begin, height)
    tab.page.mouse.down()
    for k in range(1, 21):
        tab.page.mouse.move(begin + k / 20 * (end - begin), height - 30 * np.sin(k / 20 * np.pi))
    tab.page.mouse.up()
    rows = "document.querySelector(\"[data-testid='motion.rows']\")"
    tab.page.wait_for_function(f"({rows}.value ?? {rows}.querySelector('textarea').value).split('\\n').length > 5")
    tab.type("dynamic.duration_s", "0.3")
    tab.press("motion.run")
    tab.page.wait_for_selector("[data-testid='motion.message']:has-text('times solved')")
    frame = int(tab.get_attribute("[data-frame]", "data-frame"))
    tab.press("motion.play")
    tab.page.wait_for_function("document.querySelector(\"[data-testid='motion.at']\").textContent === 't = 0.3 s'")
    assert int(tab.get_attribute("[data-frame]", "data-frame")) > frame + 3
    tab.press("modes.run")
    tab.page.wait_for_selector("[data-testid='modes.message']:has-text('About the pose')")
    asked = tomllib.loads(tab.saved(tmp_path).read_text())
    assert asked["study"] == "dynamic"
    assert len(asked["pressure"]["t_s"]) > 5
    assert tab.complaints == []
