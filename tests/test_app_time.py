"""The tab of motion: pressures drawn and typed over time, the run that can be stopped, its pictures, and the modes."""

from __future__ import annotations

import asyncio
import tomllib
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")

from app_pages import control, drawn
from app_stage import done, enter, field, opened, ran, until
from hypothesis import given, settings
from hypothesis import strategies as st

from softnlp.app.asking import Progress, run_steps
from softnlp.app.document import Document
from softnlp.app.session import Session
from softnlp.app.tabs.time import at_time, time_tab
from softnlp.app.tabs.time_series import curves, table_rows
from softnlp.app.time_rows import curves_of, simplified, table_of, table_of_text, text_of, timed
from softnlp.app.time_rows import drawn as with_stroke
from softnlp.base.errors import InputError
from softnlp.base.status import Status
from softnlp.scenario.dynamic import DynamicTask
from softnlp.scenario.read import scenario_from_text
from softnlp.scenario.run import run_scenario
from softnlp.statics.step import Step

SCENARIOS = Path(__file__).parents[1] / "scenarios"
STEP, RELEASE = (SCENARIOS / "dynamic" / f"D25L60_{name}.toml" for name in ("step", "release"))
SHORT = STEP.read_text().replace("duration_s = 1.0", "duration_s = 0.1")

numbers = st.floats(0, 2, allow_nan=False).map(lambda x: round(x, 3))
strokes = st.lists(st.tuples(st.floats(0, 1), st.floats(0, 1.5)), min_size=2, max_size=30)


def _at(times: list[float], rows: list[list[float]], t: float) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array([np.interp(t, times, column) for column in np.array(rows).T])


@given(st.lists(st.tuples(numbers, numbers, numbers), min_size=1, max_size=12))
def test_rows_are_the_same_by_text_and_by_set(rows: list[tuple[float, float, float]]) -> None:
    times = np.linspace(0.0, 1.0, len(rows)).round(4).tolist()
    plain = [list(row) for row in rows]
    assert table_of_text(text_of(times, plain), 3) == {"t_s": times, "sequence_bar": plain}
    made = table_of(curves_of(times, plain))
    assert len(made["t_s"]) <= len(times)
    for t in np.linspace(0, 1, 23):
        assert np.allclose(_at(made["t_s"], made["sequence_bar"], t), _at(times, plain, t), atol=2e-4)


@given(strokes)
@settings(max_examples=80)
def test_a_stroke_takes_the_place_of_what_was_there_and_of_nothing_else(stroke: list[tuple[float, float]]) -> None:
    points = [(0.0, 0.3), (0.5, 0.3), (0.5, 0.9), (1.0, 0.6)]
    made = with_stroke(points, [list(point) for point in stroke], 1.0, 1.5)
    times = [t for t, _ in made]
    assert times == sorted(times)
    start, end = min(t for t, _ in stroke), max(t for t, _ in stroke)
    for t in np.linspace(0, 1, 41):
        now = np.interp(t, times, [p for _, p in made])
        if t < start - 1e-9 or t > end + 1e-9:
            assert np.isclose(now, np.interp(t, *zip(*points, strict=True)), atol=1e-9) or np.isclose(t, 0.5)
        assert 0 <= now <= 1.5 + 1e-9
    again = table_of([made, [(0.0, 0.1)]])
    assert again["t_s"] == sorted(again["t_s"])
    assert all(row[1] == 0.1 for row in again["sequence_bar"])


def test_a_jump_stays_a_jump_of_the_sets_that_have_it() -> None:
    table = {"t_s": [0.0, 0.05, 0.05, 0.2], "sequence_bar": [[0.0, 0.2], [0.0, 0.3], [0.5, 0.3], [0.5, 0.6]]}
    assert table_of(curves_of(table["t_s"], table["sequence_bar"])) == table


def test_a_straight_line_needs_two_points() -> None:
    line = [(t, 0.5 * t) for t in np.linspace(0, 1, 50).tolist()]
    assert simplified(line, 1.0, 1.0) == [line[0], line[-1]]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "expected a line for each time"),
        ("0 0 0", "line 1: expected a time and 3 pressures, got 3 numbers"),
        ("0, 0, 0, 0\n\n0.1, x, 0, 0", "line 3: expected numbers, got 'x'"),
        ("0.2, 0, 0, 0\n0.1, 0, 0, 0", "line 2: expected a time of at least 0.2 s"),
        ("nan 0 0 0", "line 1: expected a finite number"),
    ],
)
def test_what_is_no_table_of_times_is_told_with_its_line(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        table_of_text(text, 3)


@pytest.mark.parametrize(
    "table", [{"sequence_bar": [[0.8, 0.0, 0.0]]}, {"ramp": {"sets": [2], "to_bar": 1.0, "steps": 5}}]
)
def test_pressures_without_times_become_a_motion(table: dict[str, object]) -> None:
    made = timed(table, 0.5, 3, step=True)
    assert made["t_s"][-1] <= 0.5
    assert made["sequence_bar"][0] == [0.0, 0.0, 0.0]
    assert max(map(max, made["sequence_bar"])) in (0.8, 1.0)
    assert timed(made, 2.0, 3, step=True) == made
    assert timed({"sequence_bar": [[0.8, 0.0, 0.0]]}, 0.5, 3, step=False) == {"sequence_bar": [[0.8, 0.0, 0.0]]}
    assert timed({"file": "a.csv"}, 0.5, 3, step=True) == {"file": "a.csv"}


@pytest.mark.parametrize("file", [STEP, RELEASE], ids=lambda f: f.stem)
def test_a_motion_is_the_same_file_after_other_tabs_and_after_a_reload(file: Path) -> None:
    session = Session()
    try:
        session.open_path(file)
        text = session.text()
        assert tomllib.loads(text) == tomllib.loads(file.read_text())
        for study in ("forward", "workspace", "inverse", "dynamic"):
            session.choose(study)
            assert session.problem is None, study
            assert session.text() == text
        session.set_pressure(np.array([1e4, 0.0, 0.0]))  # a look at another pose
        assert session.text() == text
        again = Session()
        again.recall(session.kept(), session.kept_files())
        assert tomllib.loads(again.text()) == tomllib.loads(text)
        again.close()
        assert "t_s" not in Document(text).text("forward")
    finally:
        session.close()


def test_a_look_at_the_tab_edits_nothing_and_a_run_makes_it_a_motion() -> None:
    session = Session()
    try:
        text, before = session.text(), session.state()
        session.choose("dynamic")
        assert session.problem is None
        assert session.text() == text
        assert session.state().is_same(before)
        task = session.scenario.task  # type: ignore[union-attr]
        assert isinstance(task, DynamicTask)
        assert task.times.tolist() == [0.0, 0.05, 0.05]  # a step to the pressures of the file
        session.change("dynamic", "duration_s", 0.2)
        assert session.study == "dynamic"
        assert tomllib.loads(session.text())["pressure"]["sequence_bar"][-1] == [0.8, 0.0, 0.0]
        scenario_from_text(session.text(), "x.toml")
    finally:
        session.close()


def test_the_run_is_that_of_the_command_and_a_stop_keeps_what_is_there() -> None:
    asked = scenario_from_text(SHORT, "step.toml")
    seen: list[Step] = []
    run = run_steps(asked, Progress(), seen.append)
    wanted = run_scenario(asked).steps  # type: ignore[union-attr]
    assert [step.time for step in run.steps] == [step.time for step in wanted]
    assert run.steps[-1].pose is not None
    assert wanted[-1].pose is not None
    assert np.array_equal(run.steps[-1].pose.tip_position, wanted[-1].pose.tip_position)
    progress = Progress()

    def stop_at_third(step: Step) -> None:
        if len(seen) == 3:
            progress.stop()
        seen.append(step)

    seen.clear()
    stopped = run_steps(asked, progress, stop_at_third)
    assert 3 <= len(stopped.steps) < len(wanted)
    assert any(note.startswith("stopped") for note in stopped.warnings)
    header, rows = table_rows(run.steps)
    assert header[:2] == ["t [s]", "p1 [bar]"]
    assert rows[-1][0] == 0.1
    assert set(curves(run.steps, "pressure")) == {"set 1", "set 2", "set 3", "set 1, regulator"}
    energy = curves(run.steps, "energy")
    assert "kinetic" in energy
    assert "numerical" not in energy  # of the trapezoid
    moved = np.array([curves(run.steps, "tip")[axis] for axis in "xyz"])
    assert np.allclose(moved[:, 0], 0)


def test_the_tip_load_of_a_release_is_drawn_at_its_start_alone() -> None:
    asked = scenario_from_text(RELEASE.read_text(), "release.toml")
    first, later = (Step(np.zeros(3), Status.SOLVED, "", time=t) for t in (0.0, 0.1))
    assert tuple(at_time(asked, first).loads.tip_force) == (0.03, 0.0, 0.0)
    assert tuple(at_time(asked, later).loads.tip_force) == (0.0, 0.0, 0.0)


def test_a_person_types_runs_scrubs_and_finds_the_modes() -> None:
    async def visit() -> None:
        async with opened(time_tab, "dynamic", SHORT) as (user, stage):
            shown: list[float] = []
            stage.plays.append(lambda scenario, step: shown.append(float(step.time or 0.0)))
            enter(user, "motion.rows", "0, 0, 0, 0\n0.02, 0, 0, 0\n0.04, 0.3, 0, 0")
            await drawn()
            assert stage.session.table("pressure")["t_s"] == [0.0, 0.02, 0.04]
            enter(user, "motion.rows", "0, 0")
            assert "line 1" in control(user, "motion.problem").text
            assert stage.session.table("pressure")["t_s"] == [0.0, 0.02, 0.04]
            with user:
                stage.session.change("dynamic", "duration_s", -1.0)
            assert "above 0" in str(control(user, "dynamic.duration_s").props["error-message"])
            with user:
                stage.session.change("dynamic", "duration_s", 0.1)
            words = await ran(user, "motion", "of 11 times solved")
            assert "Energy is balanced" in words
            assert shown == [0.0]
            enter(user, "motion.slider", 6)
            assert np.isclose(shown[-1], 0.06)
            assert field(user, "motion.at").text == "t = 0.06 s"
            user.find(marker="motion.play").click()
            for _ in range(200):
                await asyncio.sleep(0.05)
                if np.isclose(shown[-1], 0.1):
                    break
            assert np.isclose(shown[-1], 0.1)
            assert shown == sorted(shown[:1]) + sorted(shown[1:])
            user.find(marker="modes.run").click()
            await until(user, "modes.message", "About the pose of the sliders")
            table = field(user, "modes.table")
            assert len(table.rows) > 3
            frequencies = [float(row["c1"]) for row in table.rows]
            assert frequencies == sorted(frequencies)
            user.find(marker="motion.step").click()
            await drawn()
            assert stage.session.table("pressure")["sequence_bar"][-1][0] == 0.5  # of the sliders

    done(visit())
