"""The row of a run: what it said at the end stays."""

from __future__ import annotations

import asyncio

import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")

from app_stage import done
from nicegui.testing.user_simulation import user_simulation

from softnlp.app.parts import RunRow


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
