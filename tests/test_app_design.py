"""The design tab: its fields write the tables of a design, candidates come in a table, and one becomes the robot."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")

from app_stage import done, enter, field, opened, ran

from softnlp.app import wanted
from softnlp.app.document import Document
from softnlp.app.tabs import candidates
from softnlp.app.tabs.design import design_tab
from softnlp.base.units import BAR
from softnlp.scenario.design import run_design
from softnlp.scenario.read import load_scenario, scenario_from_text

SCENARIOS = Path(__file__).parents[1] / "scenarios"


@pytest.mark.parametrize("file", sorted((SCENARIOS / "design").glob("*.toml")), ids=lambda file: file.stem)
def test_the_rows_of_the_page_are_the_choices_of_the_file(file: Path) -> None:
    document = Document(file.read_text())
    choices = document.table("choices")
    assert wanted.choices_of(wanted.chosen(choices)) == choices
    assert set(wanted.chosen(choices)) <= set(wanted.CHOICES)
    document.replace("choices", {"robot": {"length_mm": {"from": 50.0, "to": 60.0}, "chambers_per_set": [1, 2]}})
    document.replace("requirements", wanted.with_limit(document.table("requirements"), "tip_x_mm", "at_least", 1.0))
    written = scenario_from_text(document.text(), file)  # is read again, and not as a table of another name
    assert set(written.task.choices) == {"length", "chambers_per_set"}  # type: ignore[union-attr]
    assert written.task.requirements["tip_x"].lower == 1e-3  # type: ignore[union-attr]


def test_a_requirement_without_limits_goes_and_pressures_keep_their_end() -> None:
    limits = wanted.with_limit({}, "stretch", "at_most", 1.4)
    assert wanted.with_limit(limits, "stretch", "at_least", 1.1) == {"stretch": {"at_most": 1.4, "at_least": 1.1}}
    assert wanted.with_limit(limits, "stretch", "at_most", None) == {}
    value: Any = 0.9
    for kind in ("range", "steps", "fixed", "steps", "range", "fixed"):
        value = wanted.as_pressure(kind, value)
        assert wanted.pressure_kind(value) == kind
    assert value == 0.9
    assert wanted.numbers("3, 4.5;5", whole=False) == [3.0, 4.5, 5.0]


async def _visit() -> None:
    async with opened(design_tab, "design") as (user, stage):
        session = stage.session
        before = session.text()
        assert session.problem is None
        assert tomllib.loads(before)["study"] == "forward"  # a look is no change
        enter(user, "choices.add", "robot.chambers_per_set")
        enter(user, "choices.robot.chambers_per_set", "1, 2")
        user.find(marker="choices.remove.robot.chamber_diameter_mm").click()
        enter(user, "requirements.add", "stretch")
        enter(user, "requirements.stretch.at_most", 1.5)
        enter(user, "requirements.stretch.at_least", None)
        enter(user, "actuation.one", 0.6)
        enter(user, "objective.of", "bending_angle_deg")
        await ran(user, "design", "candidates feasible")
        table = field(user, "design.table")
        assert [row["c1"] for row in table.rows] == ["best", "yes"]
        assert [row["c0"] for row in table.rows] == ["2", "1"]
        chart = field(user, "design.chart").figure["data"]
        assert [trace["name"] for trace in chart] == ["feasible", "best"]
        # the numbers are those of the study alone
        alone = run_design(scenario_from_text(session.text(), session.folder / "alone.toml"))
        assert alone.best is not None
        assert chart[-1]["y"][0] == pytest.approx(alone.best.objective * 57.29577951308232, rel=1e-9)
        # the other one becomes the robot on the screen
        for listener in table._event_listeners.values():
            if listener.type == "rowClick":
                listener.handler(type("Click", (), {"args": [None, {"row": 1}, 1]}))
        assert "Candidate 1" in field(user, "design.why").text
        user.find(marker="design.use").click()
        assert session.problem is None
        assert session.scenario is not None
        assert session.scenario.robot.chambers == 3
        assert session.pressure == pytest.approx([0.6 * BAR, 0.0, 0.0])
        # and its moulds are asked for
        session.change("robot", "length_mm", 70.0)
        user.find(marker="design.make").click()
        assert stage.asked == {"mould"}
        assert session.scenario.robot.length == pytest.approx(0.06)
        # what cannot be asked is said
        enter(user, "requirements.stretch.at_least", 2.0)
        await ran(user, "design", "[requirements]")


def test_a_design_on_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(candidates, "workers", lambda: 1)
    done(_visit())


def test_a_stopped_design_keeps_what_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(candidates, "workers", lambda: 1)
    asked = load_scenario(SCENARIOS / "design" / "laparoscope_paper.toml")

    class StopsAfterOne(candidates.Progress):
        def __call__(self, done: float, total: float, text: str = "") -> None:
            super().__call__(done, total, text)
            self.stop()

    found = candidates.Found(asked)  # of 15
    whole = candidates.work_of(found)(StopsAfterOne()).whole
    assert whole is not None
    assert len(whole.candidates) == 1
    assert candidates.verdict(whole, whole.candidates[0]) in ("best", "yes") or whole.candidates[0].reasons
    assert json.loads(candidates.design_json(whole))["candidates"][0]["number"] == 1
