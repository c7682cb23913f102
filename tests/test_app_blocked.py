"""The blocked-force tab: its table never contradicts itself, its curve and its target are the study's own."""

from __future__ import annotations

import asyncio
import itertools
import tomllib
from typing import Any

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")

from app_stage import done, enter, field, opened, ran, until

from softnlp import blocked_force
from softnlp.app.asking import scenario_with
from softnlp.app.session import Session
from softnlp.app.tabs.blocked import (
    CLOSURES,
    blocked_tab,
    of_a_curve,
    of_a_target,
    pushing,
    rising,
    with_closure,
    with_mode,
    with_wall,
)
from softnlp.base.errors import InputError
from softnlp.base.units import BAR
from softnlp.model.contact_settings import CLOSURES as KNOWN


def test_every_closure_says_what_it_is_good_for() -> None:
    assert set(CLOSURES) == set(KNOWN)


@pytest.mark.parametrize("first", ["closure", "mode", "wall"])
def test_no_order_of_choices_makes_a_table_that_is_refused(first: str) -> None:
    """Every pair of choices after another, from tables that hold what only one of them allows."""
    session = Session()
    session.choose("blocked-force")
    changes: list[Any] = [
        *(lambda t, c=c: with_closure(t, c) for c in CLOSURES),
        *(lambda t, m=m: with_mode(t, m) for m in ("blocked", "constrained")),
        *(lambda t, w=w: with_wall(t, w) for w in (True, False)),
    ]
    starts: dict[str, dict[str, Any]] = {
        "closure": {"closure": "weighted", "weight_force_per_N": 2.0},
        "mode": {"tip_cap_mm": 2.0, "closure": "free"},
        "wall": {"offset_mm": -1.0},
    }
    for one, two in itertools.product(changes, changes):
        table = two(one(starts[first]))
        if table.get("mode") == "constrained" and ("wall_point_mm" in table or table.get("closure") == "free"):
            continue  # the page offers neither there
        session.change_all("contact", table)
        assert session.problem is None, (table, session.problem)


def test_pressures_of_a_curve_and_of_a_search() -> None:
    rows = np.array(rising(np.array([1.2e5, 0.0, 0.6e5]), 4))
    assert rows == pytest.approx(np.linspace(0, 1, 4)[:, None] * [1.2, 0.0, 0.6])
    assert pushing(np.array([0.0, 3e4, 3e4]), 1.5) == [[0.0, 1.5, 1.5]]
    assert pushing(np.zeros(3), 1.5) == [[1.5, 0.0, 0.0]]


def test_a_curve_asks_for_no_target_and_a_target_for_no_curve() -> None:
    table = {"offset_ramp": {"from_mm": 0, "to_mm": 1, "steps": 3}, "weight_sensitivity": True, "tip_cap_mm": 1.0}
    assert of_a_curve(table) == {"tip_cap_mm": 1.0}
    assert of_a_target(table, 0.4) == {"tip_cap_mm": 1.0, "target_force_N": 0.4}


def test_what_cannot_be_run_is_refused_without_naming_a_file_of_ours() -> None:
    session = Session()
    with pytest.raises(InputError, match="target_force_N"):
        scenario_with(session, "blocked-force", {"contact": {"target_force_N": -1.0}})
    assert session.document.table("contact") == {}


async def _curve_and_target() -> None:
    async with opened(blocked_tab, "blocked-force") as (user, stage):
        enter(user, "blocked.steps", 4)
        assert "4 of 4" in await ran(user, "blocked", "solved")
        asked = scenario_with(stage.session, "blocked-force")
        expected = blocked_force(asked.robot, asked.material, np.array(rising(stage.session.pressure, 4)) * BAR)
        (trace,) = field(user, "blocked.chart").figure["data"]
        force = [step.contact.force for step in expected.steps if step.contact]
        assert trace["y"] == pytest.approx(force, rel=1e-9)
        assert trace["x"] == pytest.approx([0, 0.8 / 3, 1.6 / 3, 0.8])
        # kept and compared
        user.find(marker="blocked.keep").click()
        enter(user, "contact.closure", "free")
        assert stage.session.document.get("contact", "closure") == "free"
        await ran(user, "blocked", "solved")
        free, compliant = (t["y"][-1] for t in reversed(field(user, "blocked.chart").figure["data"]))
        assert free < compliant
        # the pressure of a force is that of the curve
        enter(user, "blocked.target", free)
        await ran(user, "blocked.find", "0.8, 0, 0 bar")
        # nothing of it was written into the scenario
        assert tomllib.loads(stage.session.text())["contact"] == {"closure": "free"}
        # without a wall its keys are put aside, and they come back with it
        enter(user, "contact.offset_mm", -2.5)
        enter(user, "contact.mode", "constrained")
        assert tomllib.loads(stage.session.text())["contact"] == {"mode": "constrained"}
        assert stage.session.problem is None
        enter(user, "contact.mode", "blocked")
        assert tomllib.loads(stage.session.text())["contact"] == {"closure": "free", "offset_mm": -2.5}
        # wild input: one message each, and the page goes on
        enter(user, "blocked.target", -1.0)
        await ran(user, "blocked.find", "target_force_N")
        enter(user, "blocked.steps", None)
        await ran(user, "blocked", "expected a whole number")


def test_curve_target_and_wild_input() -> None:
    done(_curve_and_target())


async def _stopped() -> None:
    async with opened(blocked_tab, "blocked-force") as (user, _):
        enter(user, "blocked.steps", 1000)
        user.find(marker="blocked.run").click()
        await asyncio.sleep(0.8)
        user.find(marker="blocked.stop").click()
        words = await until(user, "blocked.message", "topped by the user")
        assert "of 1000 steps" in words
        assert 0 < len(field(user, "blocked.chart").figure["data"][0]["x"]) < 1000


def test_a_stopped_curve_keeps_its_steps() -> None:
    done(_stopped())
