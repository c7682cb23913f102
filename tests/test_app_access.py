"""The page for everyone, in a real Chromium: axe finds nothing on any tab, nothing is cut off or hard to press."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")
pytest.importorskip("playwright", reason="playwright is not installed")

from benchmarks.app import chromium
from tests.browser import Watched

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine"),
]
TABS = ("kinematics", "blocked", "workspace", "inverse", "time", "identify", "design", "compare", "sensitivity")
TABS += ("mould", "scenario")
PANELS = ("segments", "material", "loads", "obstacles", "coefficients", "solver")
AXE = """async whole => {
  const asked = {runOnly: ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa']};
  if (!whole) asked.rules = {'color-contrast': {enabled: false}};  // takes long; test_app_studies.py looks at it too
  return (await axe.run(asked)).violations.map(v => `${v.id}: ${v.nodes[0].html.slice(0, 200)}`);
}"""
# Texts below 12 px or beyond the window, what is pressed below 24 px, and texts that stand over each other.
BOXES = """() => {
  const found = [], texts = [];
  const apart = 'svg, .cm-editor, .js-plotly-plot, .softnlp-view, [aria-hidden=true], .q-tabs__content';
  for (const e of document.querySelectorAll('.q-header *, .softnlp-page *')) {
    if (e.closest(apart) || !e.checkVisibility({checkOpacity: true, checkVisibilityCSS: true})) continue;
    const box = e.getBoundingClientRect();
    if (!box.width || !box.height) continue;
    const words = e.textContent.trim().slice(0, 40);
    if ([...e.childNodes].some(n => n.nodeType === 3 && n.textContent.trim())) {
      if (parseFloat(getComputedStyle(e).fontSize) < 12) found.push(`small: ${words}`);
      if (box.right > innerWidth + 1 || box.left < -1) found.push(`cut off: ${words}`);
      const loose = e.matches('.softnlp-column *') && !e.closest('.q-field, .q-table, .q-btn-toggle');
      if (loose) texts.push([box, words, e]);
    }
    if (e.matches('button, a[href], [role=button], [role=tab], [role=switch], [role=slider], [role=checkbox]')) {
      const whole = (e.closest('.q-toggle, .q-slider, .q-field__control') ?? e).getBoundingClientRect();
      if (whole.width < 24 || whole.height < 24) found.push(`hard to press: ${e.outerHTML.slice(0, 120)}`);
    }
  }
  for (const [k, [a, words, one]] of texts.entries())
    for (const [b, others, other] of texts.slice(k + 1)) {
      if (one.contains(other) || other.contains(one)) continue;
      const wide = Math.min(a.right, b.right) - Math.max(a.left, b.left);
      const high = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
      if (wide > 2 && high > 4) found.push(`over each other: ${words} | ${others}`);
    }
  const page = document.querySelector('.softnlp-page');
  if (page.scrollWidth > page.clientWidth + 1) found.push('the page is wider than the window');
  return found;
}"""


def _with_segments_and_an_obstacle(tab: Watched) -> None:
    """Let the panels show what they have for several segments, for a dimension that varies and for obstacles."""
    tab.press("segment.duplicate")
    tab.page.wait_for_selector("[data-testid='segment.lines']")
    for kind in ("sphere", "trocar"):
        tab.choose("obstacle.new", kind)
        tab.press("obstacle.add")
    tab.page.wait_for_selector("[data-testid='obstacle.2.length_mm']")


def _visit(tab: Watched, name: str) -> None:
    tab.page.locator(f"[data-testid=tab-{name}]").scroll_into_view_if_needed()
    tab.press(f"tab-{name}")
    tab.page.wait_for_function("document.querySelector('.q-tab-panel')?.getBoundingClientRect().height > 60")
    tab.page.wait_for_timeout(400)
    tab.page.wait_for_function("!document.querySelector('.q-uploader__input:not([aria-label])')")


@pytest.mark.parametrize(
    ("dark", "whole"),
    [(False, False), *(pytest.param(dark, True, marks=pytest.mark.slow) for dark in (False, True))],
    ids=["quick", "light", "dark"],
)
def test_axe_finds_nothing_on_any_tab(tab: Watched, dark: bool, whole: bool) -> None:
    axe = pytest.importorskip("axe_core_python", reason="axe-core-python is not installed")
    tab.page.evaluate((Path(axe.__file__).parent / "axe.min.js").read_text())
    if dark:
        tab.press("dark")
    for panel in PANELS:
        tab.open_panel(panel)
    _with_segments_and_an_obstacle(tab)
    for name in TABS:
        _visit(tab, name)
        assert tab.page.evaluate(AXE, whole) == [], name
    tab.press("open")
    tab.page.wait_for_selector("[data-testid=open-cancel]")
    assert tab.page.evaluate(AXE, whole) == [], "the dialog that opens files"
    tab.press("open-cancel")


@pytest.mark.parametrize(
    ("width", "names"),
    [(390, ("kinematics", "time")), pytest.param(820, TABS, marks=pytest.mark.slow)]
    + [pytest.param(width, TABS, marks=pytest.mark.slow) for width in (390, 1280, 1600)],
)
def test_nothing_is_cut_off_or_hard_to_press(tab: Watched, width: int, names: tuple[str, ...], pictures: Path) -> None:
    tab.page.set_viewport_size({"width": width, "height": 900})
    for panel in ("segments", "obstacles"):
        tab.open_panel(panel)
    _with_segments_and_an_obstacle(tab)
    for name in names:
        _visit(tab, name)
        tab.page.screenshot(path=pictures / f"app_{name}_{width}.png")
        assert tab.evaluate(BOXES) == [], (width, name)
    if width < 1024:  # the robot is on top
        tab.evaluate("document.querySelector('.softnlp-page').scrollTo(0, 0)")
        view = tab.page.locator("[data-testid=view]").bounding_box()
        panel = tab.page.locator("[data-testid=panel-pressures]").bounding_box()
        assert view["width"] >= width - 1
        assert view["y"] + view["height"] <= panel["y"] + 1
