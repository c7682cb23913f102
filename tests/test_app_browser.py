"""The whole app in a real Chromium: every control, the same numbers as the command, nothing leaves the machine."""

from __future__ import annotations

import time
import zipfile
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")
pytest.importorskip("playwright", reason="playwright is not installed")

from benchmarks.app import chromium, served
from tests.browser import WINDOW, Watched, browser, run_json, shown_like

pytestmark = [
    pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine"),
]
SCENARIOS = Path(__file__).parents[1] / "scenarios"


@pytest.fixture(scope="module")
def opener() -> Iterator[Any]:
    with browser() as open_tab:
        yield open_tab


@pytest.fixture(scope="module")
def new_tab(opener: Any) -> Iterator[Any]:
    with served() as (address, _):
        yield lambda: opener(address)


@pytest.fixture
def tab(new_tab: Any) -> Iterator[Watched]:
    opened: Watched = new_tab()
    opened.settled()
    yield opened
    assert not opened.outside, "the page asked for something outside of this machine"
    assert not opened.complaints, "the browser's console has errors"
    opened.page.close()


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


def test_pressures_bend_the_robot_and_the_command_agrees(tab: Watched, tmp_path: Path) -> None:
    frame = int(tab.get_attribute("[data-frame]", "data-frame"))
    slider = tab.locator("[data-testid=pressure-slider-2] [tabindex='0']").first
    slider.focus()
    for _ in range(20):
        tab.keyboard.press("ArrowRight")
    tab.settled()
    assert int(tab.get_attribute("[data-frame]", "data-frame")) > frame
    tab.value_becomes("pressure-number-2", "0.2")
    tab.type("pressure-number-1", "1.1")
    assert_same_as_the_command(tab, tmp_path)
    tab.page.locator("[data-testid=pressure-unit] button", has_text="kPa").click()
    tab.value_becomes("pressure-number-1", "110")
    tab.type("pressure-number-3", "35")
    tab.settled()
    tab.page.locator("[data-testid=pressure-unit] button", has_text="psi").click()
    tab.value_becomes("pressure-number-3", "5.08")
    tab.type("pressure-limit", "40")
    assert_same_as_the_command(tab, tmp_path)
    tab.press("pressure-zero")
    tab.shows("bending_angle_deg", 0.0)


def test_loads_coefficients_and_solver_reach_the_file(tab: Watched, tmp_path: Path) -> None:
    tab.open_panel("loads")
    tab.choose("gravity-direction", "hanging")
    tab.type("tip_load.force_N.0", "0.08")
    tab.type("tip_load.moment_Nmm.2", "-1.5")
    tab.open_panel("coefficients")
    tab.choose("stiffening-set", "calibrated")
    tab.type("stiffening-bending", "1.9")
    for field, value in (("area", "0.98"), ("inertia", "1.05"), ("bore_fraction", "0.2")):
        tab.type(f"corrections-{field}", value)
    tab.choose("conventions", "as printed")
    tab.open_panel("solver")
    tab.choose("solver-transcription", "collocation")
    tab.type("solver-intervals", "12")
    tab.type("solver-accuracy", "1e-5")
    tab.type("solver-tolerance", "1e-9")
    assert_same_as_the_command(tab, tmp_path)
    text = tab.saved(tmp_path).read_text()
    for line in (
        'direction = "hanging"',
        "force_N = [0.08, 0.0, 0.0]",
        "bending = 1.9",
        "area = 0.98",
        "intervals = 12",
    ):
        assert line in text
    assert "tip_displacement_mm.0" in tab.numbers()
    tab.press("coefficients-back")
    tab.press("no-stiffening")
    assert_same_as_the_command(tab, tmp_path)


def test_past_the_last_equilibrium_the_sliders_stay(tab: Watched, tmp_path: Path) -> None:
    tab.open_panel("coefficients")
    tab.press("no-stiffening")
    tab.open_panel("material")
    tab.choose("material-model", "Yeoh")
    assert_same_as_the_command(tab, tmp_path)
    before = tab.numbers()
    for number, stays in ((1, "0.8"), (2, "0"), (3, "0")):
        tab.type(f"pressure-number-{number}", "9")
        tab.value_becomes(f"pressure-number-{number}", stays)
        tab.page.wait_for_selector("[data-testid=message]:has-text('sliders stay')")
    tab.shows_again(before)
    tab.type("pressure-number-3", "0.2")
    tab.says_nothing()
    assert_same_as_the_command(tab, tmp_path)
    assert tab.numbers() != before


def test_results_are_copied_and_saved(tab: Watched, tmp_path: Path) -> None:
    tab.page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    tab.press("results-copy")
    tab.page.wait_for_timeout(500)
    copied = tab.evaluate("navigator.clipboard.readText()")
    assert f"Bending angle\t{tab.numbers()['bending_angle_deg']}\t°" in copied
    tab.page.locator("[data-testid=along] .q-item").first.click()
    tab.page.wait_for_selector("[data-testid=along] .js-plotly-plot .scatterlayer .trace", state="attached")
    for quantity in ("Internal force", "Internal moment", "Shear", "Position"):
        tab.choose("along-quantity", quantity)
    for button, holds in (
        ("results-csv", b"bending_angle_deg"),
        ("results-json", b'"steps"'),
        ("along-csv", b"moment_z_Nmm"),
    ):
        with tab.page.expect_download() as waiting:
            tab.press(button)
        assert holds in Path(waiting.value.path()).read_bytes()
    for name in ("chambers", "equations"):
        tab.page.locator(f"[data-testid={name}] .q-item").first.click()
    assert float(tab.numbers()["chamber_length_mm.0"]) > 60


def test_the_view_turns_and_is_saved_and_bodies_are_exported(tab: Watched, tmp_path: Path) -> None:
    box = tab.page.locator("[data-testid=view] canvas").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    first = tab.page.locator("[data-testid=view]").screenshot()
    tab.page.mouse.move(x, y)
    tab.page.mouse.down()
    tab.page.mouse.move(x + 120, y + 30, steps=4)
    tab.page.mouse.up()
    tab.page.mouse.wheel(0, 200)
    tab.page.wait_for_timeout(400)
    assert tab.page.locator("[data-testid=view]").screenshot() != first
    tab.press("view-trail")
    tab.press("view-reset")
    with tab.page.expect_download() as waiting:
        tab.press("view-picture")
    assert Path(waiting.value.path()).read_bytes().startswith(b"\x89PNG")
    for body in ("deformed", "undeformed"):
        for kind, starts in (("stl", b""), ("glb", b"glTF")):
            tab.press("export")
            with tab.page.expect_download() as waiting:
                tab.press(f"mesh-{body}-{kind}")
            content = Path(waiting.value.path()).read_bytes()
            assert content.startswith(starts)
            assert len(content) > 10_000


def test_a_scenario_is_opened_with_its_files_and_saved_with_its_comments(tab: Watched, tmp_path: Path) -> None:
    tab.press("open")
    files = [SCENARIOS / "D25L60_circling.toml", SCENARIOS / "files" / "circling.csv"]
    text = files[0].read_text().replace("files/circling.csv", "circling.csv") + "# a remark at the end\n"
    (tmp_path / "mine.toml").write_text(text)
    tab.page.set_input_files("[data-testid=open-upload] input", [tmp_path / "mine.toml", files[1]])
    tab.page.wait_for_selector("[data-testid=open-upload]", state="hidden")
    tab.settled()
    saved = tab.saved(tmp_path)
    with zipfile.ZipFile(saved) as archive:
        assert archive.read("mine.toml").decode() == text
        assert archive.read("circling.csv") == files[1].read_bytes()


def test_a_reload_and_another_tab(tab: Watched, new_tab: Any) -> None:
    tab.type("pressure-number-1", "0.37")
    keeps(tab, "37000")
    other = new_tab()
    other.settled()
    assert other.input_value("input[data-testid=pressure-number-1]") == "0.8"
    tab.settled()
    before = tab.numbers()
    reload(tab)
    tab.value_becomes("pressure-number-1", "0.37")
    assert tab.numbers() == before
    other.page.close()


def keeps(tab: Watched, text: str) -> None:
    """Wait until the browser keeps a text of what is on the screen."""
    kept = "Object.values(sessionStorage).join()"
    tab.page.wait_for_function(f"{kept}.includes({text!r})")


def reload(tab: Watched) -> None:
    """Load the page again, as a person does who is lost."""
    tab.page.reload()
    tab.page.wait_for_selector("[data-frame]", state="attached")
    tab.settled()


def test_a_server_that_was_started_again_is_found_again(
    opener: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The tab keeps its scenario while there is no server, and shows it when there is one.

    Neither the server that was stopped nor a tab that is closed leaves files behind.
    """
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    with ExitStack() as first:
        address, _ = first.enter_context(served())
        opened: Watched = opener(address)
        opened.press("tab-blocked")
        force = "[data-testid='value-blocked_force_N']"
        before = opened.page.locator(force).text_content()
        opened.type("pressure-number-1", "0.41")
        opened.page.wait_for_function(f"document.querySelector({force!r}).textContent !== {before!r}")
        opened.type("robot-length_mm", "-60")  # which the picture does not follow
        opened.page.wait_for_selector("[data-testid=message]:has-text('Not used')")
        opened.settled()
        keeps(opened, "-60")
        shown, said = opened.numbers(), opened.text("message")
        assert "blocked_force_N" in shown
    assert not list(tmp_path.glob("softnlp-*"))
    opened.type("pressure-number-1", "0.9")  # into the void
    with served(port=int(address.rsplit(":", 1)[1].strip("/"))):
        opened.page.wait_for_function("document.querySelector('[data-frame]') !== null")
        opened.value_becomes("pressure-number-1", "0.41")
        opened.shows_again(shown)
        assert opened.text("message") == said
        assert opened.input_value("input[data-testid=robot-length_mm]") == "-60"
        assert len(list(tmp_path.glob("softnlp-*"))) == 1
        opened.page.close(run_before_unload=True)
        for _ in range(150):
            if not list(tmp_path.glob("softnlp-*")):
                break
            time.sleep(0.1)
        assert not list(tmp_path.glob("softnlp-*"))


def test_a_path_that_a_proxy_takes_away_is_said_in_words(new_tab: Any) -> None:
    """A proxy that shows the page under /lab, while its files are looked for at the top, where there is nothing."""
    page = new_tab().page
    address = page.url
    page.route("**/_nicegui/**", lambda route: route.fulfill(status=404))
    page.route("**/lab/", lambda route: route.fulfill(response=route.fetch(url=address)))
    page.goto(f"{address}lab/")
    page.wait_for_selector("text=softnlp gui --root-path /lab")
    page.close()


def test_the_scenario_tab_edits_and_runs(tab: Watched) -> None:
    tab.press("tab-scenario")
    tab.page.wait_for_selector("[data-testid=scenario-text] .cm-content")
    tab.page.locator("[data-testid=scenario-text] .cm-content").fill(
        'title = "typed"\nstudy = "forward"\n[robot]\nname = "D10L40"\n'
        '[material]\nname = "Ecoflex 00-30"\nmodel = "yeoh"\n'
        "[pressure]\nsequence_bar = [[0.1, 0, 0], [0.2, 0, 0]]\n"
    )
    tab.page.wait_for_timeout(500)
    tab.press("scenario-apply")
    tab.settled()
    tab.value_becomes("pressure-number-1", "0.2")
    tab.press("scenario-run")
    tab.page.wait_for_selector("[data-testid=scenario-stop]:visible")
    tab.press("scenario-stop")
    tab.page.wait_for_selector("[data-testid=scenario-run]:visible")
    tab.press("scenario-back")
    tab.press("scenario-run")
    tab.page.wait_for_selector("text=every step solved")
    with tab.page.expect_download() as waiting:
        tab.press("scenario-results")
    with zipfile.ZipFile(waiting.value.path()) as archive:
        assert {"figure.png", "table.csv", "results.json"} <= set(archive.namelist())


WILD = (
    ("pressure-number-1", "", None),
    ("pressure-number-1", "-3", None),
    ("pressure-number-1", "1e9", None),
    ("robot-length_mm", "-60", "robot"),
    ("robot-length_mm", "1e300", "robot"),
    ("robot-outer_diameter_mm", "0", "robot"),
    ("robot-chamber_wall_mm", "1e-300", "robot"),
    ("robot-chambers_per_set", "0.5", "robot"),
    ("robot-chamber_angle_deg", "-20", "robot"),
    ("tip_load.force_N.0", "1e308", "loads"),
    ("stiffening-elongation", "-1", "coefficients"),
    ("corrections-bore_fraction", "7", "coefficients"),
    ("solver-intervals", "0.5", "solver"),
    ("solver-accuracy", "1", "solver"),
    ("solver-tolerance", "-1", "solver"),
)


def test_wild_input_leaves_the_page_alive_with_a_message(tab: Watched, tmp_path: Path) -> None:
    good = tab.numbers()
    for field, value, panel in WILD:
        if panel is not None:
            tab.open_panel(panel)
        was = tab.input_value(f"[data-testid='{field}']")
        tab.type(field, value)
        assert tab.said(), f"{field} = {value!r}: nothing is said"
        tab.type(field, was)
        tab.says_nothing()
    tab.shows_again(good)
    tab.page.locator("input[data-testid=pressure-number-1]").press_sequentially("abc")
    tab.shows_again(good)
    tab.press("tab-identify")
    (tmp_path / "big.csv").write_bytes(b"p1_bar,x_mm\n" + b"0.1,0.2\n" * 6_250_000)
    tab.page.set_input_files("[data-testid='measurements.drop'] input", tmp_path / "big.csv")
    tab.page.wait_for_selector(".q-notification")
    tab.press("tab-kinematics")
    broken = {
        "broken.toml": b"study = [",
        "binary.toml": b"study\xff\xfe",
        "other.csv": b"a,b\n1,2\n",
        "code.toml": (SCENARIOS / "own_formula.toml").read_bytes().replace(b'formula = "', b'formula = "__import__ + '),
    }
    for name, content in broken.items():
        (tmp_path / name).write_bytes(content)
        tab.press("open")
        tab.page.set_input_files("[data-testid=open-upload] input", tmp_path / name)
        refused = tab.page.locator(".q-notification.bg-negative")
        refused.wait_for()
        tab.page.keyboard.press("Escape")
        refused.locator("button").click()
        refused.wait_for(state="detached")
    tab.shows_again(good)


def run(tab: Watched, marker: str) -> str:
    """Press a study's button, wait until it has ended, and return what it says."""
    tab.press(f"{marker}.run")
    return ended(tab, marker)


def ended(tab: Watched, marker: str) -> str:
    """Wait until a study has ended, and return what it says."""
    tab.page.wait_for_timeout(600)
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


def test_a_blocked_force_and_its_curve(tab: Watched, tmp_path: Path) -> None:
    tab.press("tab-blocked")
    assert_same_as_the_command(tab, tmp_path)
    assert float(tab.numbers()["blocked_force_N"]) > 0.3
    tab.type("contact.offset_mm", "-3")
    tab.type("contact.tip_cap_mm", "2")
    assert_same_as_the_command(tab, tmp_path)
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


def test_a_target_is_reached(tab: Watched) -> None:
    tab.press("tab-inverse")
    tab.page.wait_for_selector("[data-testid='target.add']")
    for axis, value in zip("012", ("-15", "6", "62"), strict=True):
        tab.page.locator(f"[data-testid^='target.tip_position_mm.0.{axis}']").first.fill(value)
    tab.settled()
    run(tab, "inverse")
    tab.press("inverse.use")
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


@pytest.mark.parametrize("dark", [pytest.param(False, marks=pytest.mark.slow), True], ids=["light", "dark"])
def test_nothing_is_cut_off_and_texts_can_be_read(tab: Watched, dark: bool, pictures: Path) -> None:
    """Contrast of every text against its background, and no part wider than its column."""
    tab.page.set_viewport_size(WINDOW)
    if dark:
        tab.press("dark")
    for name in ("kinematics", "blocked", "workspace", "inverse", "identify", "scenario"):
        tab.press(f"tab-{name}")
        tab.settled()
        tab.page.screenshot(path=pictures / f"app_{name}_{'dark' if dark else 'light'}.png")
        assert tab.evaluate(TOO_WIDE) == [], name
        assert tab.evaluate(FAINT) == [], name


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
