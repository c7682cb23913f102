"""The pressure sequence: list, ramp and file are the scenario's own, every step is the study's, any can be shown."""

from __future__ import annotations

import asyncio
import csv
import io
import tomllib

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")

from app_stage import done, enter, field, opened, ran
from hypothesis import given
from hypothesis import strategies as st
from nicegui import ui

from softnlp import forward
from softnlp.app.asking import scenario_with
from softnlp.app.document import START
from softnlp.app.parts import MOST_MARKS, csv_text, line, number_text
from softnlp.app.tabs.sequence import rows_of_text, rows_text, sequence_tab, source_of
from softnlp.base.errors import InputError
from softnlp.base.units import BAR, DEGREE

BARS = st.floats(0, 100).map(lambda p: float(f"{p:.12g}"))


@given(st.lists(st.lists(BARS, min_size=1, max_size=6), min_size=1, max_size=8))
def test_rows_of_pressures_survive_the_text_field(rows: list[list[float]]) -> None:
    assert rows_of_text(rows_text(rows)) == rows
    assert rows_of_text(rows_text(rows).replace(",", ";\t")) == rows


@given(st.text(max_size=60))
def test_any_text_is_rows_or_one_clear_line(text: str) -> None:
    try:
        rows = rows_of_text(text)
    except InputError as error:
        said = str(error)
    else:
        said = ""
        assert np.isfinite(np.concatenate(rows)).all()
    assert "\n" not in said


def test_where_pressures_come_from() -> None:
    assert [source_of({k: 1}) for k in ("sequence_bar", "ramp", "file")] == ["list", "ramp", "file"]
    assert source_of({}) == "list"


def test_numbers_are_text_and_csv_as_a_person_reads_them() -> None:
    assert [number_text(v) for v in (-0.0, 1 / 3, 12, float("nan"), None, True, "word")] == [
        *("0", "0.33333", "12", "", "", "yes", "word")
    ]
    rows = list(csv.reader(io.StringIO(csv_text(["a [mm]", "b"], [[1 / 3, None], [float("nan"), 'x "y", z']]))))
    assert rows == [["a [mm]", "b"], [repr(1 / 3), ""], ["", 'x "y", z']]


def test_a_long_line_is_thinned_from_end_to_end() -> None:
    x = [0.5 * k for k in range(9001)]
    trace = line(x, [float("nan"), *x[1:]], "#000000")
    assert MOST_MARKS / 2 < len(trace["x"]) <= MOST_MARKS + 1
    assert (trace["x"][0], trace["x"][-1], trace["y"][0], trace["y"][-1]) == (0.0, 4500.0, None, 4500.0)
    assert line([], [], "#000000")["x"] == []
    assert line([2.0], [3.0], "#000000")["y"] == [3.0]


async def _visit() -> None:
    async with opened(sequence_tab, "forward") as (user, stage):
        session = stage.session
        # a list, typed; what is no number is said, and the scenario keeps what it had
        enter(user, "pressure.sequence_bar", "0.2 0 0\n0.4, 0.1, 0\n")
        assert session.document.get("pressure", "sequence_bar") == [[0.2, 0, 0], [0.4, 0.1, 0]]
        assert session.pressure == pytest.approx(np.array([0.4, 0.1, 0]) * BAR)
        enter(user, "pressure.sequence_bar", "0.2 0 0\nimport os\n")
        assert "line 2" in field(user, "pressure.problem").text
        assert session.document.get("pressure", "sequence_bar") == [[0.2, 0, 0], [0.4, 0.1, 0]]
        # a ramp, run: each step is that of the study
        enter(user, "pressure.source", "ramp")
        enter(user, "pressure.ramp.sets", [1, 2])
        enter(user, "pressure.ramp.to_bar", 1.2)
        enter(user, "pressure.ramp.steps", 5)
        assert tomllib.loads(session.text())["pressure"] == {"ramp": {"sets": [1, 2], "to_bar": 1.2, "steps": 5}}
        await ran(user, "sequence", "5 of 5 steps solved")
        asked = scenario_with(session, "forward")
        run = forward(asked.robot, asked.material, asked.pressures)
        angles = [step.pose.bending_angle / DEGREE for step in run.steps if step.pose is not None]
        (trace,) = field(user, "sequence.chart").figure["data"]
        assert trace["y"] == pytest.approx(angles, rel=1e-9)
        assert trace["x"] == pytest.approx([0, 0.3, 0.6, 0.9, 1.2])
        enter(user, "sequence.quantity", "tip")
        assert [t["name"] for t in field(user, "sequence.chart").figure["data"]] == ["tip x", "tip y", "tip z"]
        # a step is shown by the slider, and the slider follows
        enter(user, "sequence.step", 2)
        assert session.pressure == pytest.approx(np.array([0.3, 0.3, 0]) * BAR)
        session.show_step(3)
        assert field(user, "sequence.step").value == 4
        assert field(user, "sequence.shown").text == "Step 4 of 5"
        session.set_pressure(np.array([0.7, 0.0, 0.0]) * BAR)  # a pose of its own is no step
        assert field(user, "sequence.step").value == 4
        assert field(user, "sequence.shown").text == "5 steps"
        # steps that fail are named, and their numbers are not there
        session.change_all("stiffening", {"elongation": 0.0, "bending": 0.0})
        enter(user, "pressure.ramp.to_bar", 60.0)
        await ran(user, "sequence", "First failed")
        rows = field(user, "sequence.table").rows
        failed = [row for row in rows if row["failed"]]
        assert failed
        assert failed[0]["c4"] == ""
        assert failed[0]["c9"] != "solved"
        assert len(failed[0]["c10"]) > 10
        enter(user, "pressure.ramp.to_bar", -4.0)
        await ran(user, "sequence", "[pressure] ramp.to_bar")
        enter(user, "pressure.ramp.to_bar", 0.5)
        enter(user, "pressure.ramp.steps", 20_000)
        await ran(user, "sequence", "too many for this page")
        # a file; one that cannot be read leaves the sequence as it was
        enter(user, "pressure.source", "file")
        before = session.document.table("pressure")
        for content, words in ((b"p1_bar,p2_bar\n1,2\n", "p3_bar"), (b"\x00\xff", "UTF-8"), (b"", "empty")):
            await _drop(user, content)
            assert any(words in message for message in user.notify.messages), (words, user.notify.messages)
            assert session.document.table("pressure") == before
        await _drop(user, b"t_s,p1_bar,p2_bar,p3_bar\n0,0,0,0\n2.5,0.3,0,0\n3,0.1,0,0\n")
        assert session.document.table("pressure") == {"file": "path.csv"}
        session.change_all("stiffening", None)
        await ran(user, "sequence", "3 of 3 steps solved")
        assert field(user, "sequence.chart").figure["data"][0]["x"] == [
            0.0,
            2.5,
            3.0,
        ]  # the time: it does not only rise
        enter(user, "pressure.source", "list")
        assert session.document.get("pressure", "sequence_bar") == [[0, 0, 0], [0.3, 0, 0], [0.1, 0, 0]]


async def _drop(user: object, content: bytes) -> None:
    box = field(user, "pressure.drop")  # type: ignore[arg-type]
    with user:  # type: ignore[attr-defined]
        await box.handle_uploads([ui.upload.SmallFileUpload("path.csv", "text/csv", content)])
    await asyncio.sleep(0.1)


def test_a_sequence_on_the_page() -> None:
    done(_visit())


async def _open() -> None:
    text = START.replace("[[0.8, 0.0, 0.0]]", "[[0, 0, 0], [0.4, 0, 0], [0.8, 0, 0], [0.8, 0, 0], [0.8, 0.8, 0]]")
    async with opened(sequence_tab, "forward", text) as (user, stage):
        shown, session = field(user, "sequence.shown"), stage.session
        for _ in range(2):  # opened, and after a run
            assert shown.text == "Step 5 of 5"
            assert field(user, "sequence.step").value == 5
            assert session.pressure == pytest.approx(np.array([0.8, 0.8, 0]) * BAR)
            await ran(user, "sequence", "5 of 5 steps solved")
        enter(user, "sequence.step", 4)  # one of two alike
        assert shown.text == "Step 4 of 5"
        session.open(text.replace("[0.4, 0, 0], ", ""), "shorter.toml")
        assert shown.text == "Step 4 of 4"
        assert session.follows_file


def test_the_step_named_is_the_pose_shown() -> None:
    done(_open())
