"""The inverse tab: targets stay paired, what is found puts the tip there, what cannot be reached is said."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")

from app_stage import NotedView, done, enter, field, opened, ran

from softnlp.app.asking import Progress, run_steps, scenario_with
from softnlp.app.session import Session
from softnlp.app.tabs.inverse import (
    KINDS,
    POSITION,
    count_of,
    inverse_tab,
    kind_of,
    offer_target,
    rows_of,
    with_added,
    with_kind,
    with_picked,
    without,
)
from softnlp.base.units import MILLIMETRE


def test_targets_stay_paired_whatever_is_chosen() -> None:
    session = Session()
    session.choose("inverse")
    changes: list[Any] = [*(lambda t, k=k: with_kind(t, k) for k in KINDS), with_added, lambda t: without(t, 0)]
    changes.append(lambda t: with_picked(t, (1.234, -5.678, 61.0)))
    start = {**with_kind({}, "both"), "length_per_radian_mm": 40.0}
    for order in itertools.product(changes, repeat=2):
        table = start
        for change in order:
            table = change(table)
        session.change_all("target", table)
        assert session.problem is None, (table, session.problem)
        assert {len(rows_of(table, key)) for key in KINDS[kind_of(table)]} == {count_of(table)}


def test_the_only_target_stays_and_a_new_one_is_like_the_last() -> None:
    table = with_added({POSITION: [[1.0, 2.0, 60.0]]})
    assert rows_of(table, POSITION) == [[1.0, 2.0, 60.0]] * 2
    table = with_picked(table, (3.0, 4.0, 5.0))
    assert rows_of(table, POSITION) == [[1.0, 2.0, 60.0], [3.0, 4.0, 5.0]]
    assert rows_of(without(table, 0), POSITION) == [[3.0, 4.0, 5.0]]
    assert without(without(table, 0), 0) == without(table, 0)


@pytest.mark.parametrize("robot", ["D10L40", "laparoscope-9"])
def test_the_first_target_is_one_that_the_robot_reaches(robot: str) -> None:
    session = Session()
    session.change_all("robot", {"name": robot})
    session.choose("inverse")
    offer_target(session)
    assert "target" in session.document.offered  # and is no change of the file
    (step,) = run_steps(scenario_with(session, "inverse"), Progress()).steps
    assert step.status.has_solution
    assert step.aimed is not None
    assert step.aimed.distance < 1e-3 * MILLIMETRE
    session.change("target", "tip_position_mm", [[1.0, 2.0, 60.0]])
    offer_target(session)  # a person's own stays
    assert session.document.get("target", POSITION) == [[1.0, 2.0, 60.0]]
    session.close()


async def _visit() -> None:
    async with opened(inverse_tab, "inverse") as (user, stage):
        view, session = stage.view, stage.session
        assert isinstance(view, NotedView)
        assert not session.is_used("inverse")
        assert "target" in session.document.offered
        await ran(user, "inverse", "Reached at")  # what it begins with
        for place, value in enumerate((-12.0, 5.0, 62.0)):
            enter(user, f"target.tip_position_mm.0.{place}", value)
        assert view.targets_shown.tolist() == [[-12.0, 5.0, 62.0]]
        words = await ran(user, "inverse", "Reached at")
        assert "mm left" in words
        scenario = session.scenario
        assert scenario is not None
        run, _ = session.live.pose(scenario, session.pressure)
        assert run.steps[0].pose is not None
        assert run.steps[0].pose.tip_position / MILLIMETRE == pytest.approx([-12.0, 5.0, 62.0], abs=1e-3)
        # a click in the view, once it is wanted
        view.handlers[0]((0.0, 0.0, 70.123456))
        assert session.document.get("target", POSITION) == [[-12.0, 5.0, 62.0]]
        user.find(marker="target.add").click()
        enter(user, "target.pick", True)
        view.handlers[0]((0.0, 0.0, 170.123456))
        assert session.document.get("target", POSITION) == [[-12.0, 5.0, 62.0], [0.0, 0.0, 170.1]]
        # the second is out of reach; the nearest place is on the axis, as it must be
        await ran(user, "inverse", "a click on a row")
        table = field(user, "inverse.table")
        assert [row["failed"] for row in table.rows] == [False, True]
        for listener in table._event_listeners.values():
            if listener.type == "rowClick":
                listener.handler(type("Click", (), {"args": [None, {"row": 1}, 1]}))
        assert "No pressure within the bounds" in field(user, "inverse.message").text
        assert session.pressure == pytest.approx(np.full(3, 1.5e5), rel=1e-6)
        # bounds and wild input
        enter(user, "bounds.highest", -1.0)
        await ran(user, "inverse", "[bounds] pressure_bar")
        enter(user, "bounds.highest", 1.5)
        enter(user, "target.kind", "direction")
        enter(user, "target.tip_direction.1.2", 0.0)
        assert "length 0" in field(user, "target.problem").text
        await ran(user, "inverse", "length 0")
        user.find(marker="target.remove.1").click()
        await ran(user, "inverse", "Reached at")
        # the marks go with the study
        enter(user, "target.kind", "position")
        assert view.targets_shown is not None
        session.choose("forward")
        assert view.targets_shown is None


def test_targets_on_the_page() -> None:
    done(_visit())
