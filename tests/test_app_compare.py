"""The tabs Compare and Sensitivity: the numbers and figures of the commands, and nothing of the scenario changes."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")

from app_stage import done, enter, field, opened, ran
from nicegui import ElementFilter

from softnlp.app.session import Stage
from softnlp.app.tabs.compare import compare_tab
from softnlp.app.tabs.sensitivity import sensitivity_tab
from softnlp.scenario.compare import Asked, compare_task, run_compare
from softnlp.scenario.read import load_scenario
from softnlp.studies.report import named_tolerances, sensitivity_report

SCENARIOS = Path(__file__).parents[1] / "scenarios"


def _both(stage: Stage) -> None:
    compare_tab(stage)
    sensitivity_tab(stage)


async def _picture(user: Any, marker: str) -> str:
    for _ in range(400):
        with user:
            found = list(ElementFilter(marker=marker))
        if found:
            return str(found[0].props["src"])
        await asyncio.sleep(0.05)
    raise AssertionError(f"there is no picture {marker}")


async def _visit() -> None:
    text = (SCENARIOS / "compare" / "angles.toml").read_text()
    async with opened(_both, "forward", text) as (user, stage):
        session = stage.session
        await ran(user, "compare", "drop a file of measurements")
        user.find(marker="compare.example").click()
        enter(user, "compare.coefficients", ["reproduction", "calibrated"])
        words = await ran(user, "compare", "2 models")
        asked = Asked(coefficients=("reproduction", "calibrated"))
        task = compare_task(
            load_scenario(SCENARIOS / "compare" / "angles.toml"), SCENARIOS / "files" / "measured_angles.csv", asked
        )
        found = run_compare(task)
        assert found.best is not None
        assert f"Least error: {found.labels[found.best]}" in words
        rows = field(user, "compare.table").rows
        assert [float(row["c3"]) for row in rows] == pytest.approx(
            [found.statistics(v, "bending_angle").rmse * 57.29577951308232 for v in range(2)], rel=1e-4
        )
        assert (await _picture(user, "compare.bending_angle")).startswith("data:image/png;base64,iVBOR")
        # what the pose is sensitive to
        enter(user, "tolerance.length_mm", "0.5")
        enter(user, "tolerance.add", "C10_MPa")
        enter(user, "sensitivity.samples", 0)
        await ran(user, "sensitivity", "D25L60 at")
        s = session.scenario
        assert s is not None
        given = ["length_mm=0.5", "pressure_bar=1%", "C10_MPa=1%"]
        tolerances = named_tolerances(given, s.robot, s.material, s.coefficients, session.pressure)
        alone = sensitivity_report(s.robot, s.material, session.pressure, tolerances, samples=0, **s.settings)
        first = field(user, "sensitivity.table.0").rows[0]
        assert alone.solved
        assert float(first["c1"]) == pytest.approx(alone.sensitivities.matrix[0, 0] * 1e8, rel=1e-3)
        assert (await _picture(user, "sensitivity.sensitivity")).startswith("data:image/png")
        enter(user, "tolerance.length_mm", "much")
        await ran(user, "sensitivity", "length_mm: expected a number")
        assert session.text() == text  # nothing of it is in the file
        assert json.loads(session.kept())["used"] == ["forward"]


@pytest.mark.thorough
def test_measurements_and_sensitivities_on_the_page() -> None:
    done(_visit())
