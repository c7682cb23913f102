"""The whole app in a real Chromium: every control, the same numbers as the command, nothing leaves the machine."""

from __future__ import annotations

import time
import zipfile
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")
pytest.importorskip("playwright", reason="playwright is not installed")

from benchmarks.app import chromium, served
from tests.browser import Watched, assert_same_as_the_command, keeps, reload

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.skipif(chromium() is None, reason="no Chromium on this machine"),
]
SCENARIOS = Path(__file__).parents[1] / "scenarios"


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
        opened.page.wait_for_selector("[data-testid=message]:has-text('Grey')")
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


@pytest.mark.slow
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
