"""The way back, pinned states and links: what was shown is shown again, and what differs is said with its numbers."""

from __future__ import annotations

import asyncio
import csv
import html
import io
import json
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("tomlkit", reason="the extra gui is not installed")

from app_stage import NotedView, done
from hypothesis import given, settings
from hypothesis import strategies as st
from nicegui import ui
from nicegui.testing import User
from nicegui.testing.user_simulation import user_simulation

from softnlp.app.history import History, changes
from softnlp.app.links import packed, unpacked
from softnlp.app.panels.past import Past
from softnlp.app.panels.pins import difference
from softnlp.app.panels.results import certificate_words, step_lines
from softnlp.app.pins import MOST_PINS, Pin, pin_of, pins_csv, recalled, rows, stored
from softnlp.app.report import report_text
from softnlp.app.session import Session, Stage
from softnlp.base.errors import InputError
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.figures.section import section_figure
from softnlp.scenario.check import SCHEMAS
from softnlp.statics.step import Run

SCENARIOS = Path(__file__).parents[1] / "scenarios"


@pytest.fixture
def session() -> Iterator[Session]:
    made = Session()
    yield made
    made.close()


def shown(session: Session) -> Run:
    assert session.scenario is not None
    return session.live.pose(session.scenario, session.pressure)[0]


@pytest.mark.parametrize("file", ["D25L60_three_sets.toml", "workspace/D25L60_grid.toml", "D25L60_circling.toml"])
def test_a_look_at_any_tab_is_no_change(session: Session, file: str) -> None:
    session.open_path(SCENARIOS / file)
    first, history = session.text(), History(session.state())
    for study in (*SCHEMAS, session.document.study):
        session.choose(study)
        assert not history.note(session.state()), study
    assert session.text() == first
    assert len(history.states) == 1


def test_what_a_study_starts_with_is_a_change_once_it_is_changed(session: Session) -> None:
    session.choose("inverse")
    history = History(session.state())
    session.change("target", "tip_position_mm", [[-10.0, 0.0, 60.0]])
    assert history.note(session.state())
    assert "tip position" in history.states[-1].what


@settings(max_examples=10)
@given(st.lists(st.sampled_from(["length", "robot", "law", "load", "pressure", "choice", "study"]), max_size=8))
def test_every_state_comes_back_as_it_was(edits: list[str]) -> None:
    session = Session()
    try:
        history, texts = History(session.state()), [tomllib.loads(session.text())]
        for k, edit in enumerate(edits):
            if edit == "length":
                session.change("robot", "length_mm", 50.0 + k)
            elif edit == "robot":
                session.change_all("robot", {"name": "D10L40" if k % 2 else "D15L60"})
            elif edit == "law":
                session.change("material", "model", "yeoh" if k % 2 else "neo-hookean")
            elif edit == "load":
                session.change("tip_load", "force_N", [0.0, 0.01 * (k + 1), 0.0])
            elif edit == "pressure":
                session.set_pressure(np.array([0.1 * k, 0.2, 0.0]) * BAR)
            elif edit == "choice":
                session.put("choices", {"robot": {"length_mm": {"from": 40.0 + k, "to": 60.0}}})
            else:
                session.choose("workspace" if k % 2 else "identify")
            if history.note(session.state()):
                texts.append(tomllib.loads(session.text()))
        assert history.at == len(history.states) - 1 == len(texts) - 1
        for place in [*reversed(range(len(texts))), *range(len(texts))]:
            state = history.go(place)
            session.restore(state)
            assert tomllib.loads(session.text()) == texts[place]
            assert session.state().is_same(state)
    finally:
        session.close()


def test_changes_are_told_with_their_numbers(session: Session) -> None:
    before = session.state()
    session.change("robot", "length_mm", 70.0)
    session.set_pressure(np.array([0.8, 0.25, 0.0]) * BAR)
    assert changes(before, session.state()) == ["robot: length 60 → 70 mm", "set 2: 0 → 0.25 bar"]
    session.change_all("robot", {"name": "D10L40"})
    assert changes(before, session.state())[0] == "robot D25L60 → D10L40"


def test_a_new_state_takes_the_place_of_those_undone(session: Session) -> None:
    history = History(session.state())
    for length in (61.0, 62.0):
        session.change("robot", "length_mm", length)
        history.note(session.state())
    session.restore(history.go(0))
    session.change("robot", "length_mm", 63.0)
    history.note(session.state())
    assert [state.what for state in history.states] == ["opened", "robot: length 60 → 63 mm"]
    assert history.forth is None


def test_a_link_opens_what_was_on_the_screen(session: Session) -> None:
    session.change("gravity", "direction", "-z")
    session.set_pressure(np.array([0.3, 0.0, 0.1]) * BAR)
    other = Session()
    other.recall(*unpacked(packed(session.kept(), session.kept_files())))
    assert other.text() == session.text()
    assert other.pressure == pytest.approx(session.pressure)
    other.close()
    code = packed(session.kept(), "{}")
    for wrong in (code[:-9], "x" * 40, "", code[:20] + "AAAA" + code[24:]):
        with pytest.raises(InputError, match="whole address"):
            unpacked(wrong)
    with pytest.raises(InputError, match="files belong"):
        packed(session.kept(), json.dumps({"a.csv": np.random.default_rng(1).bytes(9000).hex()}))


def test_pins_say_what_differs_and_are_kept(session: Session) -> None:
    pins: list[Pin] = []
    first = shown(session)
    pins.append(pin_of(first, session.state(), "first", pins))
    session.set_pressure(np.array([0.5, 0.0, 0.0]) * BAR)
    second = shown(session)
    now = step_lines(second).numbers
    angles = [run.steps[0].pose.bending_angle * 180 / np.pi for run in (first, second) if run.steps[0].pose]
    by_key = {line.key: (pinned, less) for line, pinned, less in rows(now, pins)}
    assert by_key["bending_angle_deg"][0] == [pytest.approx(angles[0])]
    assert by_key["bending_angle_deg"][1] == [pytest.approx(angles[1] - angles[0])]
    assert pins[0].differs(session.state()) == "set 1: 0.8 → 0.5 bar"
    # the ghost ends where the robot did
    assert first.steps[0].pose is not None
    assert pins[0].tube.position[-1] == pytest.approx(first.steps[0].pose.tip_position / MILLIMETRE, abs=1e-6)
    table = list(csv.reader(io.StringIO(pins_csv(now, pins))))
    assert table[0] == ["number", "unit", "now", "first", "now less first"]
    assert all(float(row[2]) - float(row[3]) == pytest.approx(float(row[4])) for row in table[1:] if row[4])
    # kept by the browser
    (again,) = recalled(stored(pins))
    assert again.numbers == pins[0].numbers
    assert again.robot == pins[0].robot or vars(again.robot) == pytest.approx(vars(pins[0].robot))
    assert again.message()["tube"] == pins[0].message()["tube"]
    session.restore(again.state)
    assert session.pressure == pytest.approx([0.8 * BAR, 0.0, 0.0])
    for wrong in ("", "[1]", '[{"name": "a"}]', "{}x"):
        with pytest.raises(InputError):
            recalled(wrong)


def test_four_states_are_pinned_and_a_freed_place_is_taken(session: Session) -> None:
    run, pins = shown(session), list[Pin]()
    for _ in range(MOST_PINS):
        pins.append(pin_of(run, session.state(), "", pins))
    assert [pin.name for pin in pins] == ["A", "B", "C", "D"]
    with pytest.raises(InputError, match="take one away"):
        pin_of(run, session.state(), "", pins)
    assert pin_of(run, session.state(), "", pins[:1] + pins[2:]).letter == "B"
    assert [difference(x) for x in (1.5, -0.0001, None)] == ["+1.500", "0", "–"]


def test_the_report_has_what_is_on_the_screen(session: Session) -> None:
    run, pins = shown(session), list[Pin]()
    pins.append(pin_of(run, session.state(), "before <b>", pins))
    session.set_pressure(np.array([0.5, 0.0, 0.0]) * BAR)
    session.change("", "title", "my <i>robot</i>")
    run = shown(session)
    stage = Stage(session, NotedView())  # type: ignore[arg-type]
    stage.figures["Sequence"] = {"": lambda: section_figure(run.robot)}
    page = asyncio.run(report_text(stage, run, pins))
    assert page.count('src="data:image/png;base64,') == page.count("<img") == 2
    assert "http" not in page.replace(session.text(), "")
    assert "before &lt;b&gt;" in page
    assert "my &lt;i&gt;robot&lt;/i&gt;" in page
    for line in step_lines(run).numbers:
        assert f"<td>{line.label}</td><td>{line.text}</td><td>{line.unit}</td>" in page
    assert certificate_words(run) in page
    assert "set 1: 0.8 → 0.5 bar" in page
    assert "sequence_bar = [[0.5, 0.0, 0.0]]" in page
    assert '"casadi"' in html.unescape(page)
    session.change("robot", "length_mm", -1.0)
    with pytest.raises(InputError, match="length"):
        asyncio.run(report_text(stage, run, pins))


async def _steps_back() -> None:
    pasts: list[Past] = []
    session = Session()

    def page() -> None:
        pasts.append(Past(session))
        ui.label("page")

    async with user_simulation(page) as user:
        await user.open("/")
        assert isinstance(user, User)
        session.change("robot", "length_mm", 66.0)
        await asyncio.sleep(0.6)  # a drag of a slider is one state
        user.find(marker="undo").click()
        assert session.document.get("robot", "length_mm") is None
        user.find(marker="redo").click()
        assert session.document.get("robot", "length_mm") == 66.0
        assert [state.what for state in pasts[0].history.states] == ["opened", "robot: length 60 → 66 mm"]
    session.close()


def test_undo_and_redo_on_the_page() -> None:
    done(_steps_back())
