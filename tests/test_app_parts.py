"""What the page said last stays: of a run that ended, and of sliders that went back."""

from __future__ import annotations

import asyncio

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")

from app_stage import NotedView, done
from nicegui.testing.user_simulation import user_simulation

from softnlp.app import live_view
from softnlp.app.parts import RunRow
from softnlp.app.session import Session, Stage
from softnlp.base.units import BAR


def test_a_look_that_comes_late_leaves_what_was_said_at_the_end() -> None:
    async def visit() -> None:
        rows: list[RunRow] = []

        async def begin() -> None:
            if await rows[0].do(lambda progress: "solved") is not None:
                rows[0].say("Solved.")

        def page() -> None:
            rows.append(RunRow("row", "Run", begin))

        async with user_simulation(page) as user:
            await user.open("/")
            user.find(marker="row.run").click()
            for _ in range(100):
                (label,) = user.find(marker="row.message").elements
                if label.text == "Solved.":  # type: ignore[attr-defined]
                    break
                await asyncio.sleep(0.05)
            with user:
                rows[0]._look()  # the timer's, which was waiting for its turn
            assert label.text == "Solved."  # type: ignore[attr-defined]

    done(visit())


def test_a_slow_pose_leaves_what_was_said_of_the_sliders(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_view, "_PATIENCE_S", 0.0)  # every pose is slow
    said: list[str] = []

    async def visit() -> None:
        sessions: list[Session] = []

        def page() -> None:
            session, view = Session(WEAK), NotedView()
            view.show = lambda frame: None  # type: ignore[attr-defined]
            sessions.append(session)
            live_view.LiveView(Stage(session, view), lambda run: None, lambda words, _: said.append(words)).request()  # type: ignore[arg-type]

        async def until(poses: int, words: str) -> None:
            for _ in range(1200):
                if said.count("Solving …") == poses and said[-1].endswith(words):
                    return
                await asyncio.sleep(0.05)
            raise AssertionError(said)

        async with user_simulation(page) as user:
            await user.open("/")
            await until(1, "")
            with user:
                sessions[0].set_pressure(np.array([9.0, 0.0, 0.0]) * BAR)
            await until(3, "The sliders stay at 0.2, 0, 0 bar.")  # the second pose failed, the third is where they stay
            sessions[0].close()

    done(visit())


WEAK = """
study = "forward"
[robot]
name = "D25L60"
[material]
name = "weak"
model = "weak"
formula = "a * (stretch - 1) * exp(-4 * (stretch - 1))"
[material.constants]
a = 0.05
[pressure]
sequence_bar = [[0.2, 0.0, 0.0]]
"""
