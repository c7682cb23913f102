"""The studies of the app in a real Chromium: each is run, shown and saved, and nothing on the page is cut off."""

from __future__ import annotations

import tomllib
import zipfile
from pathlib import Path

import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")
pytest.importorskip("playwright", reason="playwright is not installed")

from laboratory_files import MODULUS, machine_text

from benchmarks.app import chromium
from tests.browser import WINDOW, Watched, assert_same_as_the_command, keeps, reload, run_json

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine"),
]
SCENARIOS = Path(__file__).parents[1] / "scenarios"


def run(tab: Watched, marker: str) -> str:
    """Press a study's button, wait until it has ended, and return what it says."""
    # On a busy machine the run begins long after it was asked for: what the last one said is not what this one says.
    tab.page.evaluate(
        """name => {
          window.began = false;
          const watch = new MutationObserver(() => { window.began = true; });
          for (const part of ['message', 'stop'])
            watch.observe(document.querySelector(`[data-testid='${name}.${part}']`),
                          {subtree: true, childList: true, characterData: true, attributes: true});
        }""",
        marker,
    )
    tab.press(f"{marker}.run")
    tab.page.wait_for_function("window.began", timeout=600_000)
    return ended(tab, marker)


def ended(tab: Watched, marker: str) -> str:
    """Wait until a study has ended, and return what it says."""
    tab.page.wait_for_function(
        f"""() => {{
          const part = name => document.querySelector(`[data-testid='{marker}.${{name}}']`);
          return !part('stop').checkVisibility() && !part('message').textContent.endsWith('…');
        }}""",
        timeout=600_000,
    )
    return tab.text(f"{marker}.message")


def download(tab: Watched, testid: str) -> bytes:
    with tab.page.expect_download() as waiting:
        tab.press(testid)
    return Path(waiting.value.path()).read_bytes()


@pytest.mark.slow
def test_the_robot_and_its_silicone_are_designed(tab: Watched, tmp_path: Path) -> None:
    tab.choose("robot-name", "D15L60")
    tab.type("robot-length_mm", "50")
    tab.type("robot-chambers_per_set", "1")
    tab.type("robot-outer_diameter_mm", "14")
    tab.type("robot-lumen_diameter_mm", "6.4")
    tab.page.wait_for_selector("[data-testid=robot-lumen_diameter_mm-said]:visible")
    assert "wall" in tab.text("robot-lumen_diameter_mm-said")
    tab.press("robot-allow-wall_thickness")
    tab.settled()
    assert_same_as_the_command(tab, tmp_path)
    dimensions = {
        "chamber_circle_diameter_mm": "10",
        "chamber_diameter_mm": "2.4",
        "chamber_wall_mm": "0.45",
        "chamber_angle_deg": "20",
        "minimum_wall_mm": "0.3",
        "chamber_sets": "2",
    }
    for key, value in dimensions.items():
        tab.type(f"robot-{key}", value)
    tab.press("robot-allow-chamber_overlap")
    tab.type("pressure-number-2", "0.3")
    assert_same_as_the_command(tab, tmp_path)
    tab.press("robot-stretched")
    tab.page.wait_for_selector("[data-testid=robot-section] svg")
    tab.open_panel("material")
    tab.choose("material-name", "Dragon Skin 10")
    tab.choose("material-model", "Ogden")
    assert_same_as_the_command(tab, tmp_path)
    for form in ("Own constants", "Own formula"):
        tab.page.locator("[data-testid=material-form] button", has_text=form).click()
        tab.page.wait_for_timeout(500)
    tab.type("material-own_name", "my silicone")
    tab.type("material-own_model", "my law")
    tab.press("material-add")
    tab.page.locator("[data-testid=material-constant-name]").nth(1).fill("d")
    tab.page.locator("[data-testid=material-remove]").nth(1).click()
    tab.page.locator("[data-testid=material-constant-name]").first.fill("c")
    tab.page.locator("[data-testid=material-constant-value]").first.fill("0.02")
    tab.page.fill("textarea[data-testid=material-formula]", "import os")
    assert tab.said()
    tab.page.fill("textarea[data-testid=material-formula]", "c * (stretch - stretch**-2)")
    tab.type("material-density_kg_m3", "1100")
    tab.type("material-fitted_stretch-0", "1")
    tab.type("material-fitted_stretch-1", "1.8")
    for measure in ("True", "Modulus", "Engineering"):
        tab.page.locator("[data-testid=material-measure] button", has_text=measure).click()
    assert_same_as_the_command(tab, tmp_path)
    text = tab.saved(tmp_path).read_text()
    assert 'formula = "c * (stretch - stretch**-2)"' in text
    tab.press("robot-reset")
    tab.choose("robot-name", "Own dimensions")
    tab.type("robot-own_name", "mine")
    tab.settled()
    assert 'name = "mine"' in tab.saved(tmp_path).read_text()


def test_a_sequence_is_run_and_shown(tab: Watched, tmp_path: Path) -> None:
    tab.page.locator("textarea[data-testid='pressure.sequence_bar']").fill("0.1, 0, 0\n0.2, 0.1, 0")
    tab.value_becomes("pressure-number-2", "0.1")
    tab.press("pressure.add")
    tab.page.locator("[data-testid='pressure.source'] button", has_text="Ramp").click()
    tab.page.wait_for_timeout(600)
    tab.choose("pressure.ramp.sets", "2")
    tab.page.keyboard.press("Escape")
    tab.type("pressure.ramp.from_bar", "0.1")
    tab.type("pressure.ramp.to_bar", "1")
    tab.type("pressure.ramp.steps", "5")
    tab.settled()
    run(tab, "sequence")
    table = download(tab, "sequence.table.download").decode()
    steps = run_json(tab.saved(tmp_path))["steps"]
    assert len(steps) == len(table.splitlines()) - 1 == 5
    assert steps[-1]["pressure_bar"] == [1.0, 1.0, 0.0]
    tab.choose("sequence.quantity", "ength")
    tab.choose("sequence.axis", "step")
    tab.page.locator("[data-testid='sequence.step'] [tabindex='0']").first.focus()
    for _ in range(8):  # the first step is the last of as many presses as it takes
        tab.page.keyboard.press("ArrowLeft")
        tab.page.wait_for_timeout(500)
    tab.value_becomes("pressure-number-1", "0.1")
    tab.press("sequence.table.copy")
    tab.page.locator("[data-testid='pressure.source'] button", has_text="CSV").click()
    tab.page.set_input_files("[data-testid='pressure.drop'] input", SCENARIOS / "files" / "circling.csv")
    tab.settled()
    assert (
        "circling.csv" in tab.text("tab-kinematics")
        or "file" in zipfile.ZipFile(tab.saved(tmp_path)).read("scenario.toml").decode()
    )


@pytest.mark.slow
def test_a_blocked_force_and_its_curve(tab: Watched, tmp_path: Path) -> None:
    tab.press("tab-blocked")
    assert_same_as_the_command(tab, tmp_path)
    assert float(tab.numbers()["blocked_force_N"]) > 0.3
    tab.type("contact.offset_mm", "-3")
    tab.type("contact.tip_cap_mm", "2")
    tab.type("contact.chamber_reaction", "1.3")
    assert_same_as_the_command(tab, tmp_path)
    tab.press("contact.wall")
    tab.type("contact.wall_point_mm.0", "-4")
    tab.type("contact.wall_normal.2", "0.1")
    assert_same_as_the_command(tab, tmp_path)
    tab.press("contact.wall")
    tab.choose("contact.closure", "Weighted")
    tab.type("contact.weight_length_per_mm", "0.002")
    assert_same_as_the_command(tab, tmp_path)
    tab.choose("contact.closure", "Rigid")
    tab.type("pressure-number-1", "0.5")
    assert_same_as_the_command(tab, tmp_path)
    tab.choose("contact.closure", "Compliant")
    tab.type("blocked.steps", "4")
    run(tab, "blocked")
    tab.press("blocked.keep")
    tab.choose("contact.closure", "Free")
    run(tab, "blocked")
    tab.page.wait_for_selector("[data-testid='blocked.chart'] .scatterlayer .trace", state="attached")
    tab.press("blocked.clear")
    tab.choose("contact.closure", "Compliant")
    tab.page.locator("[data-testid='blocked.source'] button", has_text="steps").click()
    tab.type("blocked.target", "0.2")
    tab.type("blocked.highest", "1.4")
    run(tab, "blocked.find")
    tab.press("blocked.use")
    tab.shows("blocked_force_N", 0.2, within=2e-3)
    tab.page.locator("[data-testid='contact.mode'] button", has_text="Chambers held").click()
    tab.shows("blocked_force_N", 0.0)


def test_a_workspace_is_swept_stopped_and_shown(tab: Watched, pictures: Path) -> None:
    tab.press("tab-workspace")
    tab.type("workspace.workers", "1")
    run(tab, "workspace")
    tab.page.set_viewport_size(WINDOW)
    tab.page.mouse.move(600, 700)
    tab.page.wait_for_timeout(1500)  # still pictures are drawn smoothly
    tab.page.screenshot(path=pictures / "app.png")
    tab.type("workspace.levels", "5")
    tab.type("workspace.from_bar", "0.1")
    tab.type("workspace.to_bar", "1")
    tab.settled()
    run(tab, "workspace")
    tab.choose("workspace.colour", "tretch")
    tab.press("workspace.pick")
    box = tab.page.locator("[data-testid=view] canvas").bounding_box()
    tab.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] * 0.45)
    header = download(tab, "workspace.csv").decode().splitlines()
    assert len(header) >= 126
    assert download(tab, "workspace.netcdf")[:4] == b"\x89HDF"
    tab.page.locator("[data-testid='workspace.kind'] button", has_text="Samples").click()
    tab.page.wait_for_timeout(500)
    tab.type("workspace.samples", "400000")
    tab.settled()
    tab.press("workspace.run")
    tab.page.wait_for_selector("[data-testid='workspace.message']:has-text('poses/s')")
    drawn = tab.get_attribute("[data-frame]", "data-frame")
    tab.type("pressure-number-2", "0.4")  # the page is alive meanwhile
    tab.page.wait_for_function(f"document.querySelector('[data-frame]').dataset.frame !== '{drawn}'")
    tab.press("workspace.stop")
    assert "kept" in ended(tab, "workspace")


@pytest.mark.slow
def test_a_target_is_reached(tab: Watched) -> None:
    tab.press("tab-inverse")
    tab.page.wait_for_selector("[data-testid='target.add']")
    for axis, value in zip("012", ("-15", "6", "62"), strict=True):
        tab.page.locator(f"[data-testid^='target.tip_position_mm.0.{axis}']").first.fill(value)
    tab.settled()
    run(tab, "inverse")
    for k, value in enumerate((-15, 6, 62)):
        tab.shows(f"tip_position_mm.{k}", value, within=0.01)
    tab.press("target.pick")
    box = tab.page.locator("[data-testid=view] canvas").bounding_box()
    tab.page.mouse.click(box["x"] + box["width"] * 0.45, box["y"] + box["height"] * 0.4)
    tab.page.wait_for_timeout(800)
    tab.press("target.add")
    tab.page.wait_for_selector("[data-testid='target.remove.1']")
    tab.press("target.remove.1")
    tab.page.locator("[data-testid='target.kind'] button", has_text="Both").click()
    tab.type("bounds.lowest", "0.05")
    tab.type("bounds.highest", "1.2")
    tab.settled()


@pytest.mark.slow
def test_constants_are_identified_from_a_dropped_file(tab: Watched) -> None:
    tab.press("tab-identify")
    tab.page.wait_for_selector("[data-testid='measurements.drop'] input", state="attached")
    tab.page.set_input_files("[data-testid='measurements.drop'] input", SCENARIOS / "files" / "measured_angles.csv")
    tab.page.wait_for_selector("[data-testid='measurements.free']:visible")
    tab.page.locator("[data-testid=sigma] .q-item").first.click()
    tab.type("sigma.bending_angle_deg", "10")
    tab.settled()
    keeps(tab, "measured_angles.csv")
    reload(tab)
    run(tab, "identify")
    tab.choose("identify.observable", "angle")
    assert b"bending = " in download(tab, "identify.toml")
    assert len(download(tab, "identify.csv").splitlines()) >= 9
    tab.press("identify.use")
    tab.settled()
    tab.page.locator("[data-testid='identify.kind'] button", has_text="Tensile").click()
    tab.page.set_input_files("[data-testid='tensile.drop'] input", SCENARIOS / "files" / "tensile.csv")
    tab.settled()
    run(tab, "tensile")
    tab.choose("tensile.law", "yeoh")
    tab.press("tensile.use")
    assert b"yeoh" in download(tab, "tensile.toml")
    tab.press("tab-kinematics")
    tab.open_panel("coefficients")
    assert tab.input_value("input[data-testid=stiffening-bending]") != "1.23"


def test_a_test_of_a_machine_is_imported_corrected_and_used(tab: Watched, tmp_path: Path, pictures: Path) -> None:
    file = tmp_path / "utm.csv"
    file.write_text(machine_text())
    tab.page.set_viewport_size(WINDOW)
    tab.press("tab-identify")
    tab.page.locator("[data-testid=import] .q-item").first.click()
    tab.page.set_input_files("[data-testid='import.drop'] input", file)
    tab.page.wait_for_selector("[data-testid='import.message']:has-text('31 rows')")
    tab.page.wait_for_selector("[data-testid='import.chart'] .scatterlayer .trace", state="attached")
    assert "width_mm" in tab.text("import.settings")
    assert "given" not in tab.text("import.settings")
    tab.type("import.width_mm", "8")  # half the stress
    tab.page.wait_for_selector("[data-testid='import.settings']:has-text('given')")
    tab.page.wait_for_selector("[data-testid='import.use']:not([disabled])")
    tab.page.locator("[data-testid='import.use']").scroll_into_view_if_needed()
    tab.page.screenshot(path=pictures / "app_import.png")
    assert tab.evaluate(TOO_WIDE) == []
    assert tab.evaluate(FAINT) == []
    assert "width_mm = 8" in download(tab, "import.import.toml").decode()
    assert len(download(tab, "import.csv").splitlines()) == 32
    tab.press("import.use")
    tab.page.wait_for_selector("[data-testid='tensile.run']:visible")
    run(tab, "tensile")
    tab.choose("tensile.law", "neo-hookean")
    (silicone,) = tomllib.loads(download(tab, "tensile.toml").decode()).values()
    assert silicone["neo-hookean"]["mu0_MPa"] == pytest.approx(MODULUS / 2, rel=0.01)
    tab.press("tensile.use")
    tab.settled()


@pytest.mark.parametrize("dark", [pytest.param(False, marks=pytest.mark.slow), True], ids=["light", "dark"])
def test_nothing_is_cut_off_and_texts_can_be_read(tab: Watched, dark: bool, pictures: Path) -> None:
    """Contrast of every text against its background, and no part wider than its column."""
    tab.page.set_viewport_size(WINDOW)
    if dark:
        tab.press("dark")
    for name in ("kinematics", "blocked", "workspace", "inverse", "identify", "scenario"):
        tab.press(f"tab-{name}")
        tab.settled()
        tab.page.wait_for_function(SHOWN)
        tab.page.screenshot(path=pictures / f"app_{name}_{'dark' if dark else 'light'}.png")
        assert tab.evaluate(TOO_WIDE) == [], name
        assert tab.evaluate(FAINT) == [], name


# What is on the screen is of the controls, and has its colours: what is stale is grey until it is solved again.
SHOWN = """
!document.querySelector('.softnlp-stale') && !document.getAnimations().some(a => a instanceof CSSTransition)
"""
# Elements that are wider than the column they stand in.
TOO_WIDE = """
() => [...document.querySelectorAll('.softnlp-column')].filter(c => c.scrollWidth > c.clientWidth + 1).map(c => {
  const edge = c.getBoundingClientRect().right + 1;
  const beyond = [...c.querySelectorAll('*')].filter(e => e.getBoundingClientRect().right > edge);
  return beyond.slice(0, 3).map(e => e.outerHTML.slice(0, 120));
})
"""
# Texts whose contrast against what is behind them is below 4.5 : 1 (WCAG AA), large ones and disabled ones apart.
FAINT = """
() => {
  const channels = text => (text.match(/[\\d.]+/g) || []).map(Number);
  const light = ([r, g, b]) => {
    const f = [r, g, b].map(v => { v /= 255; return v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4; });
    return 0.2126 * f[0] + 0.7152 * f[1] + 0.0722 * f[2];
  };
  const over = (top, below) => top.slice(0, 3).map((v, k) => v * (top[3] ?? 1) + below[k] * (1 - (top[3] ?? 1)));
  const behind = element => {
    const layers = [];
    for (let e = element; e; e = e.parentElement) layers.push(channels(getComputedStyle(e).backgroundColor));
    return layers.reverse().reduce((below, layer) => over(layer, below), [255, 255, 255]);
  };
  const found = [];
  for (const element of document.querySelectorAll('.softnlp-column *, .q-header *')) {
    const own = [...element.childNodes].some(n => n.nodeType === 3 && n.textContent.trim());
    const apart = element.closest('svg, .q-icon, .cm-editor, .disabled, [aria-hidden=true]');
    if (!own || apart || !element.checkVisibility()) continue;
    let opacity = 1;
    for (let e = element; e; e = e.parentElement) opacity *= Number(getComputedStyle(e).opacity);
    const ground = behind(element);
    const ink = channels(getComputedStyle(element).color);
    const shown = over([...ink.slice(0, 3), (ink[3] ?? 1) * opacity], ground);
    const [a, b] = [light(shown), light(ground)];
    const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (contrast < 4.5) found.push(`${element.textContent.trim().slice(0, 40)}: ${contrast.toFixed(2)}`);
  }
  return found;
}
"""
