"""Obstacles on the page: fields of the schema, moves, what is said, and the same numbers as the command."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")

from app_pages import control, drawn, put, use
from hypothesis import given, settings
from hypothesis import strategies as st
from nicegui.testing import User

from softnlp.app.document import Document
from softnlp.app.history import changes
from softnlp.app.live import LivePoses
from softnlp.app.obstacle_rows import first_row, keys_of, kinds, middle, moved, of_kind, parts_of
from softnlp.app.panels.found import contact_rows, where
from softnlp.app.panels.obstacles import obstacles_panel
from softnlp.app.session import Session
from softnlp.app.view.frame import frame_of
from softnlp.app.view.obstacles import obstacle_message
from softnlp.base.errors import InputError
from softnlp.model.obstacle_tables import obstacles_of_tables
from softnlp.model.robot import ROBOTS
from softnlp.results import body_of_pose
from softnlp.scenario.read import scenario_from_text
from softnlp.scenario.run import run_scenario
from softnlp.statics.obstacle_solver import among_obstacles
from softnlp.statics.solver import PoseSolver

BALL = (Path(__file__).parents[1] / "scenarios" / "contact" / "sphere.toml").read_text()


@pytest.mark.parametrize("kind", kinds())
def test_a_first_obstacle_of_each_kind_is_one_that_no_robot_overlaps(kind: str) -> None:
    scenario = scenario_from_text(BALL, "ball.toml")
    rows = [first_row(kind, scenario.robot)]
    (made,) = obstacles_of_tables(rows)
    assert made.kind == kind
    assert set(keys_of(kind)) == set(rows[0]) - {"kind"}
    among_obstacles(PoseSolver(scenario.model, scenario.numerics), [made])
    message = obstacle_message(made, "it", scenario.robot.length)
    assert message["name"] == "it"
    assert message["triangles"]
    assert len(message["at"]) == 3


@given(st.sampled_from(kinds()), st.sampled_from(kinds()), st.lists(st.floats(-50, 50), min_size=3, max_size=3))
@settings(max_examples=60, deadline=None)
def test_another_kind_and_a_move_and_back_are_obstacles(kind: str, other: str, by: list[float]) -> None:
    robot = ROBOTS["D25L60"]
    row = {**first_row(kind, robot), "name": "it"}
    away = moved(row, by)
    here, there = middle(row), middle(away)
    assert here is not None
    assert there is not None
    assert np.allclose(np.subtract(there, here), by, atol=2e-3)
    turned = of_kind(row, other, robot)
    obstacles_of_tables([away, turned])
    assert turned["kind"] == other
    assert turned["name"] == "it"
    assert "tip rim" not in parts_of(other) or other == "plane"


def test_the_live_pose_is_that_of_the_command_with_its_forces_and_arrows() -> None:
    text = BALL.replace(
        "[[0.0, 0.0, 0.0], [0.3, 0.0, 0.0], [0.6, 0.0, 0.0], [0.9, 0.0, 0.0], [1.2, 0.0, 0.0]]", "[[0.7, 0, 0]]"
    )
    scenario = scenario_from_text(text, "ball.toml")
    live = LivePoses()
    run, free = live.pose(scenario, scenario.pressures[0])
    (asked,) = run_scenario(scenario).steps
    step = run.steps[0]
    assert step.pose is not None
    assert asked.pose is not None
    assert free is not None
    assert np.allclose(step.pose.tip_position, asked.pose.tip_position, atol=1e-12)
    assert step.contacts[0].force[0] > 0.01
    assert np.linalg.norm(free.tip_position - step.pose.tip_position) > 1e-3
    ((name, size, *parts, _, gap),) = contact_rows(step)
    assert name == "sphere 1"
    assert abs(gap) <= 0.02
    assert np.isclose(size, np.linalg.norm(parts), atol=2e-4)
    pushes = {
        a.kind: a for a in frame_of(scenario.robot, body_of_pose(step.pose), [7e4, 0, 0], contacts=step.contacts).arrows
    }
    arrow = pushes["contact 1"]
    way = step.contacts[0].force / np.linalg.norm(step.contacts[0].force)
    assert np.allclose(arrow.vector / np.linalg.norm(arrow.vector), way)
    head = arrow.start + arrow.vector  # ends on the body, which is where the ball is
    assert abs(np.linalg.norm(head - [-30.0, 0.0, 40.0]) - 10) < 1.0
    with pytest.raises(InputError, match="overlaps sphere 1 by"):
        live.pose(
            scenario_from_text(text.replace("-30.0, 0.0, 40.0", "-15.0, 0.0, 40.0"), "ball.toml"), scenario.pressures[0]
        )


def test_where_it_touches_in_words() -> None:
    assert where(None, None) == "–"
    assert where(0.5, 0.5001) == "0.50"
    assert where(0.25, 0.75) == "0.25–0.75"


def test_a_file_with_obstacles_opened_changed_saved_and_opened_again_is_the_same() -> None:
    session = Session()
    try:
        session.open("# mine\n" + BALL, "ball.toml")
        rows = session.rows("obstacle")
        session.put_rows(
            "obstacle", [*rows, {"kind": "plane", "point_mm": [0.0, 0.0, -5.0], "normal": [0.0, 0.0, 1.0]}]
        )
        text = session.text()
        assert text.startswith("# mine\n")
        session.choose("dynamic")  # a look at a study that takes none
        assert not session.takes("obstacle")
        assert session.scenario is not None
        assert not session.scenario.obstacles
        assert session.text() == text
        session.choose("forward")
        session.open(text, "ball.toml")
        assert session.text() == text
        assert len(session.rows("obstacle")) == 2
        before = session.state()
        session.put_rows("obstacle", session.rows("obstacle")[:1])
        assert changes(before, session.state()) == ["obstacle 2 taken away"]
        one = session.state()
        session.put_rows("obstacle", [{**session.rows("obstacle")[0], "radius_mm": 12.0}])
        assert changes(one, session.state()) == ["obstacle 1: radius 10 → 12 mm"]
        session.restore(before)
        assert session.text() == text
        session.put_rows("obstacle", [])
        assert "obstacle" not in tomllib.loads(session.text())
    finally:
        session.close()


def test_a_list_of_tables_keeps_its_comments() -> None:
    document = Document(BALL + 'name = "ball"  # the liver\n')
    document.replace_rows("obstacle", [{**document.rows("obstacle")[0], "radius_mm": 11.0}])
    assert "# the liver" in document.text()
    assert "radius_mm = 11.0" in document.text()
    assert "obstacle" not in document.text("dynamic")


def test_the_panel_adds_names_moves_turns_and_takes_away() -> None:
    async def person(user: User, session: Session) -> None:
        assert control(user, "obstacle.note").text == "Nothing that the robot could touch."
        user.find(marker="obstacle.add").click()
        await drawn()
        put(user, "obstacle.1.name", "liver")
        put(user, "obstacle.1.centre_mm.0", -40.0)
        put(user, "obstacle.1.part", "tip axis")
        (row,) = session.rows("obstacle")
        assert row["name"] == "liver"
        assert row["centre_mm"][0] == -40.0
        assert row["part"] == "tip axis"
        assert session.problem is None
        put(user, "obstacle.1.radius_mm", -1.0)
        assert "expected a number above 0" in control(user, "obstacle.1.radius_mm").props["error-message"]
        assert session.problem is not None
        assert session.is_stale
        put(user, "obstacle.1.radius_mm", 5.0)
        assert session.problem is None
        put(user, "obstacle.1.kind", "capsule")
        await drawn()
        (row,) = session.rows("obstacle")
        assert row["kind"] == "capsule"
        assert row["name"] == "liver"
        assert row["radius_mm"] == 5.0
        assert session.problem is None
        assert middle(row)[0] == -40.0
        session.choose("dynamic")
        assert "takes no obstacles" in control(user, "obstacle.note").text
        session.choose("forward")
        user.find(marker="obstacle.1.remove").click()
        await drawn()
        assert session.rows("obstacle") == []

    use(obstacles_panel, person)
