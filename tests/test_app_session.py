"""One browser tab: what controls change is what is read, solved and saved."""

from __future__ import annotations

import asyncio
import json
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("tomlkit", reason="the extra gui is not installed")

from app_stage import done, enter, field, opened
from nicegui import ui

from softnlp.app.asking import scenario_with
from softnlp.app.controls import button
from softnlp.app.files import save, saved
from softnlp.app.panels.equations import loads_panel
from softnlp.app.panels.results import certificate_words, step_lines
from softnlp.app.session import Session, Stage
from softnlp.app.taken import LARGEST_FILE
from softnlp.base.errors import InputError
from softnlp.base.units import BAR
from softnlp.results import to_json
from softnlp.scenario.check import SCHEMAS
from softnlp.scenario.read import load_scenario
from softnlp.scenario.run import run_scenario

SCENARIOS = Path(__file__).parents[1] / "scenarios"


@pytest.fixture
def session() -> Iterator[Session]:
    made = Session()
    yield made
    made.close()


def live_step(session: Session) -> dict[str, object]:
    assert session.scenario is not None
    solve = session.live.blocked if session.document.study == "blocked-force" else session.live.pose
    step: dict[str, object] = to_json(solve(session.scenario, session.pressure)[0])["steps"][0]
    return step


@pytest.mark.parametrize("study", ["forward", "blocked-force"])
def test_a_live_pose_is_the_step_of_the_saved_scenario(session: Session, study: str) -> None:
    session.choose(study)
    if study == "forward":
        session.change("tip_load", "force_N", [0.0, 0.05, -0.02])
        session.change("gravity", "direction", "-z")
    for bar in (0.2, 0.5, 0.9):  # a slider on its way: each pose starts from the last
        session.set_pressure(np.array([bar * BAR, 0.0, 0.0]))
        shown = live_step(session)
    alone = to_json(run_scenario(session.asked()))["steps"][-1]
    assert alone["pressure_bar"] == shown["pressure_bar"] == [0.9, 0.0, 0.0]
    for key in ("tip_position_mm", "bending_angle_deg", "backbone_length_mm", "chamber_length_mm", "stretch"):
        np.testing.assert_allclose(shown[key], alone[key], rtol=2e-6, atol=1e-4)
    if study == "blocked-force":
        assert shown["blocked_force_N"] == pytest.approx(alone["blocked_force_N"], rel=1e-6)


def test_the_loads_say_how_the_robot_is_held() -> None:
    async def visit() -> None:
        async with opened(lambda stage: loads_panel(stage.session), "forward") as (user, stage):
            assert field(user, "gravity.words").text == "no gravity"
            for direction, words in (
                ("hanging", "hanging, gravity away from the base (+z)"),
                ("-z", "standing, gravity towards the base (-z)"),
            ):
                enter(user, "gravity.direction", direction)
                assert stage.session.document.get("gravity", "direction") == direction
                assert field(user, "gravity.words").text == words
            stage.session.change("gravity", "direction", [3, 0, -4])
            assert "tilted by 36.9 deg" in field(user, "gravity.words").text

    done(visit())


def test_live_poses_follow_the_robot_its_silicone_and_the_coefficients(session: Session) -> None:
    for table, key, value in (
        ("robot", "length_mm", 52.0),
        ("material", "name", "Dragon Skin 10"),
        ("material", "model", "yeoh"),
        ("stiffening", "bending", 0.3),
        ("corrections", "conventions", "as_printed"),
        ("solver", "transcription", "collocation"),
        ("robot", "chambers_per_set", 1),
        ("robot", "chamber_sets", 4),
    ):
        session.change(table, key, value)
        assert session.problem is None, session.problem
        shown = live_step(session)
        saved = to_json(run_scenario(session.asked()))["steps"][-1]
        np.testing.assert_allclose(shown["tip_position_mm"], saved["tip_position_mm"], atol=1e-4)
    assert len(session.pressure) == 4


def test_what_does_not_fit_is_said_and_the_last_good_scenario_stays(session: Session) -> None:
    told = []
    session.on_scenario(lambda: told.append(session.problem))
    before = session.scenario
    session.change("robot", "outer_diameter_mm", 10.0)
    assert session.problem is not None
    assert session.problem.table == "robot"
    assert session.scenario is before
    session.change("robot", "outer_diameter_mm", None)
    assert session.problem is None
    assert len(told) == 2


@pytest.mark.parametrize("value", ["a lot", [], {}, True, float("nan"), float("inf"), -3.0, 1e300, 10**400, ""])
@pytest.mark.parametrize(("table", "key"), [("robot", "length_mm"), ("solver", "accuracy"), ("tip_load", "force_N")])
def test_wild_values_are_a_problem_not_an_exception(session: Session, table: str, key: str, value: object) -> None:
    before = session.scenario
    session.change(table, key, value)
    assert session.problem is not None
    assert session.scenario is before
    session.change(table, key, None)
    assert session.problem is None


def test_a_formula_with_code_in_it_is_refused(session: Session) -> None:
    formula = "__import__('os').system('true')"
    session.change_all("material", {"name": "mine", "model": "own", "formula": formula, "constants": {"c": 1.0}})

    assert session.problem is not None
    assert session.problem.table == "material"


@pytest.mark.parametrize("file", sorted(SCENARIOS.rglob("*.toml")), ids=lambda f: f.name)
def test_a_shipped_scenario_opens_with_its_files(session: Session, file: Path) -> None:
    if "study" not in file.read_text():
        pytest.skip("a material file")
    if "[[chamber]]" in file.read_text():
        with pytest.raises(InputError, match="this page takes a round layout of chambers so far"):
            session.open_path(file)
        return
    session.open_path(file)
    assert session.problem is None
    asked = session.asked()
    assert asked.study == session.document.study
    again = Session()
    again.recall(session.kept(), session.kept_files())
    assert again.text() == session.text()
    assert np.array_equal(again.asked().pressures, asked.pressures)
    again.close()


@pytest.mark.parametrize("looked", [study for study in SCHEMAS if study not in ("design", "blocked-force")])
@pytest.mark.parametrize(
    "file", ["D25L60_loaded_tip.toml", "inverse/circle.toml", "identify/tensile.toml", "workspace/D25L60_grid.toml"]
)
def test_a_look_at_a_study_leaves_the_file_as_it_is(session: Session, file: str, looked: str) -> None:
    session.open_path(SCENARIOS / file)
    before = session.text()
    session.choose(looked)
    assert (session.text(), session.file_name) == (before, Path(file).name)
    assert session.asked().study == session.opened_study
    again = Session()
    again.recall(session.kept(), session.kept_files())
    assert (tomllib.loads(again.text()), again.document.study) == (tomllib.loads(before), looked)
    again.close()


def test_a_study_that_was_changed_or_run_is_that_of_the_file_which_has_a_name_of_its_own(session: Session) -> None:
    session.open_path(SCENARIOS / "D25L60_loaded_tip.toml")
    session.choose("inverse")
    session.change("robot", "length_mm", 55.0)  # which the opened study has too
    assert (session.study, session.left_out()) == ("forward", [])
    session.change("target", "tip_position_mm", [[-15.0, 0.0, 60.0]])
    assert (session.asked().study, session.left_out()) == ("inverse", ["pressure"])
    assert saved(session)[0] == "D25L60_loaded_tip_inverse.toml"
    again = Session()
    again.recall(session.kept(), session.kept_files())
    assert saved(again)[0] == saved(session)[0]
    assert tomllib.loads(again.text()) == tomllib.loads(session.text())
    again.close()
    session.choose("workspace")
    assert session.asked().study == "inverse"
    session.choose("blocked-force")
    assert session.asked().study == "inverse"
    session.choose("workspace")
    scenario_with(session, "workspace")
    assert session.asked().study == "workspace"
    session.choose("forward")
    assert (session.asked().study, saved(session)[0]) == ("forward", "D25L60_loaded_tip.toml")
    session.choose("blocked-force")  # the page shows its numbers
    assert (session.asked().study, saved(session)[0]) == ("blocked-force", "D25L60_loaded_tip_blocked-force.toml")
    session.choose("inverse")
    assert session.asked().study == "inverse"
    session.choose("identify")
    assert session.asked().study == "inverse"


def test_an_opened_scenario_keeps_its_pressures_until_a_slider_moves(session: Session) -> None:
    session.open_path(SCENARIOS / "D25L60_one_set.toml")
    assert session.text() == (SCENARIOS / "D25L60_one_set.toml").read_text()
    session.set_pressure(np.array([0.7, 0.0, 0.1]) * BAR)
    assert session.asked().pressures.tolist() == [pytest.approx([0.7 * BAR, 0.0, 0.1 * BAR])]
    session.show_step(3)
    assert len(session.asked().pressures) == 11


def test_what_cannot_be_opened_leaves_the_screen_as_it_was(session: Session) -> None:
    before = session.text()
    for text in ("", "study = 3", "nonsense", 'study = "forward"\n[robot]\nname = "D25L61"'):
        with pytest.raises(InputError):
            session.open(text, "x.toml")
    with pytest.raises(InputError, match="open both together"):
        session.open(before.replace("sequence_bar = [[0.8, 0.0, 0.0]]", 'file = "p.csv"'), "x.toml")
    for elsewhere in ("/etc/passwd", "../p.csv", "sub/p.csv"):
        with pytest.raises(InputError, match="beside the scenario"):
            session.open(before.replace("sequence_bar = [[0.8, 0.0, 0.0]]", f'file = "{elsewhere}"'), "x.toml")
    session.keep("p.csv", b"of the screen")
    with pytest.raises(InputError):  # read, and not a table of pressures
        session.open(before.replace("sequence_bar = [[0.8, 0.0, 0.0]]", 'file = "p.csv"'), "x.toml", {"p.csv": b"x"})
    assert (session.folder / "p.csv").read_bytes() == b"of the screen"
    with pytest.raises(InputError, match="at most"):
        session.keep("big.csv", b"0" * (LARGEST_FILE + 1))
    with pytest.raises(InputError, match="with a name"):
        session.keep("..", b"")
    for kept in ("{", "{}", json.dumps({"name": "a", "source": "=", "study": "forward", "pressure": None})):
        with pytest.raises(InputError):
            session.recall(kept)
    for files in ("{", "[]", '{"a.csv": 3}', '{"a.csv": "x"}'):
        with pytest.raises(InputError):
            session.recall(session.kept(), files)
    assert session.text() == before


def test_a_file_that_cannot_be_opened_is_named_as_the_commands_name_it(session: Session, tmp_path: Path) -> None:
    (tmp_path / "broken.toml").write_text("study = [")
    (tmp_path / "unknown.toml").write_text('study = "forward"\n[robot]\nname = "D25L61"\n')
    for name in ("broken.toml", "unknown.toml", "missing.toml"):
        with pytest.raises(InputError) as opened:
            session.open_path(tmp_path / name)
        with pytest.raises(InputError) as loaded:
            load_scenario(tmp_path / name)
        assert str(opened.value) == str(loaded.value)
        assert name in str(opened.value)
    with pytest.raises(InputError, match=r"^x\.toml: \[pressure\] file: p\.csv: line 1: "):
        session.open(
            session.text().replace("sequence_bar = [[0.8, 0.0, 0.0]]", 'file = "p.csv"'), "x.toml", {"p.csv": b"x"}
        )


def test_a_value_that_makes_no_sense_is_recalled_with_the_last_that_did(session: Session) -> None:
    session.change("robot", "length_mm", 50.0)
    session.set_pressure(np.array([0.3, 0.1, 0.0]) * BAR)
    for table, key, value in (("robot", "length_mm", -5.0), ("material", "name", "no such"), ("robot", "name", 7)):
        session.change(table, key, value)
        assert session.problem is not None
        other = Session()
        other.recall(session.kept(), session.kept_files())
        assert str(other.problem) == str(session.problem)
        assert other.document.source() == session.document.source()
        assert other.scenario is not None
        assert session.scenario is not None
        assert repr(other.scenario.robot) == repr(session.scenario.robot)
        assert repr(other.scenario.material) == repr(session.scenario.material)
        np.testing.assert_array_equal(other.pressure, session.pressure)
        other.close()
    session.change("robot", "name", "D25L60")
    session.change("material", "name", "Ecoflex 00-50")
    session.choose("identify")  # which awaits a file
    other = Session()
    other.recall(session.kept(), session.kept_files())
    assert other.document.study == "identify"
    other.close()


def test_two_sessions_do_not_mix(session: Session) -> None:
    other = Session()
    other.change("robot", "name", "D10L40")
    assert session.document.get("robot", "name") == "D25L60"
    assert other.folder != session.folder
    folder = other.folder
    other.close()
    assert not folder.exists()


def test_the_page_says_in_words_how_a_step_ended(session: Session) -> None:
    assert session.scenario is not None
    run, ghost = session.live.pose(session.scenario, session.pressure)
    assert ghost is None  # nothing loads it
    assert certificate_words(run).startswith("Solved, residual")
    shown = step_lines(run)
    lines = {line.key: line for line in (*shown.numbers, *shown.chambers)}
    assert lines["bending_angle_deg"].text == f"{np.degrees(run.steps[0].pose.bending_angle):.3f}"  # type: ignore[union-attr]
    assert lines["chamber_length_mm.5"].unit == "mm"
    session.change_all("stiffening", {"elongation": 0.0, "bending": 0.0})
    run, _ = session.live.pose(session.scenario, np.full(3, 9 * BAR))
    assert not run.steps[0].status.has_solution
    assert "lower the pressure" in certificate_words(run)
    assert {line.text for line in step_lines(run).numbers} == {"–"}


def test_a_load_leaves_the_free_shape_as_a_ghost(session: Session) -> None:
    session.change("tip_load", "force_N", [0.1, 0.0, 0.0])
    assert session.scenario is not None
    run, ghost = session.live.pose(session.scenario, session.pressure)
    assert ghost is not None
    pose = run.steps[0].pose
    assert pose is not None
    np.testing.assert_allclose(pose.tip_position - ghost.tip_position, pose.tip_displacement, atol=1e-9)


async def _saves() -> None:
    text = (SCENARIOS / "D25L60_loaded_tip.toml").read_text()
    given: list[tuple[str, str]] = []

    def page(stage: Stage) -> None:
        button("Save", None, "save", lambda: save(stage.session))

    async with opened(page, "identify", text) as (user, stage):  # identification has no data yet
        session = stage.session
        assert session.problem is not None
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(ui.download, "content", lambda content, name: given.append((name, content.decode())))
            user.find(marker="save").click()
            await user.should_see("saved scenario.toml: study forward")
            assert given == [("scenario.toml", text)]
            session.choose("forward")
            session.change("robot", "length_mm", -1.0)
            user.find(marker="save").click()
            await user.should_see("not saved: [robot] length_mm")
            (red,) = user.find(ui.notification).elements
            # "Close" can be read on red
            assert red.props["options"]["actions"] == [{"label": "Close", "color": "white"}]
            taken: list[bool] = []
            patch.setattr(ui.notification, "dismiss", lambda self: taken.append(True))
            session.change("robot", "length_mm", 60.0)
            user.find(marker="save").click()
            await asyncio.sleep(0.1)
        assert len(given) == 2
        assert taken == [True]


def test_save_gives_the_file_that_was_opened_and_takes_back_an_earlier_refusal() -> None:
    done(_saves())


def test_what_a_warning_says_stands_in_no_other_line(session: Session) -> None:
    session.open_path(SCENARIOS / "D25L60_loaded_tip.toml")
    assert session.scenario is not None
    run, _ = session.live.pose(session.scenario, session.pressure)
    assert any("stability is undefined" in warning for warning in run.steps[0].warnings)
    assert "stab" not in certificate_words(run)


def test_the_recipe_of_an_import_is_not_taken(session: Session, tmp_path: Path) -> None:
    """A page in the network would read any file of the server's machine through it."""
    session.choose("identify")
    (tmp_path / "own.csv").write_text("stretch,stress_MPa\n1,0\n1.5,0.01\n2,0.02\n")
    recipe = f'kind = "tensile"\nfiles = ["{(tmp_path / "own.csv").as_posix()}"]\n'.encode()
    text = 'study = "identify"\n[tensile]\nfile = "a.import.toml"\n'
    with pytest.raises(InputError, match="names further files"):
        session.take_file("tensile", "a.import.toml", recipe, {}, lambda problem: False)
    with pytest.raises(InputError, match="names further files"):
        session.open(text, "a.toml", {"a.import.toml": recipe})
    assert not (session.folder / "a.import.toml").exists()
    assert session.table("tensile") == {}
