"""The shipped scenarios of the blocked force run as they are and say what they promise."""

from __future__ import annotations

import json
import tempfile
from contextlib import chdir
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from softnlp.cli import main

FOLDER = Path(__file__).parents[1] / "scenarios" / "blocked"
BLOCKED = {path.stem: path for path in sorted(FOLDER.glob("*.toml"))}


@cache
def blocked_steps(name: str) -> list[dict[str, Any]]:
    """Run a shipped scenario in an empty folder; return the steps of what it leaves there."""
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        assert main(["run", str(BLOCKED[name])]) == 0
        results = Path("results") / name
        assert (results / "figure.png").stat().st_size > 10_000
        steps: list[dict[str, Any]] = json.loads((results / "results.json").read_text())["steps"]
        return steps


@pytest.mark.slow
@pytest.mark.parametrize("name", BLOCKED)
def test_a_blocked_force_runs(name: str) -> None:
    for step in blocked_steps(name):
        assert step["status"] in {"solved", "no_contact"}
        assert step["residual"] <= 1e-8
        assert step["discretisation_error"] <= 1e-6
        assert all("slip sideways" in warning for warning in step["warnings"])


def test_every_measured_robot_has_a_blocked_force() -> None:
    from benchmarks.blocked_measured import MEASURED

    shipped = {path.stem: path.read_text() for path in BLOCKED.values()}
    assert {*MEASURED, "laparoscope-6"} <= shipped.keys()
    for name, force in MEASURED.items():
        assert f"Measured: {force:.2f} N" in shipped[name]


def documented_forces() -> dict[str, list[float]]:
    """Return the rows of the documented comparison: measured, then each model; NaN where it says fold."""
    text = (FOLDER.parents[1] / "docs" / "blocked-force.md").read_text()
    lines = text.split("## Against measurement")[1].split("## What can be asked")[0].splitlines()
    table = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]
    rows = {row[0]: row[1:] for row in table[2:]}
    return {name: [float("nan") if c in ("fold", "") else float(c) for c in row] for name, row in rows.items()}


@pytest.mark.slow
def test_the_documented_comparison_is_that_of_the_benchmark() -> None:
    from benchmarks.blocked_measured import LENGTH_WEIGHTS, MEASURED, MODELS, forces, with_length_weight

    documented = documented_forces()
    for name, force in MEASURED.items():
        assert documented[name][0] == force
        assert len(documented[name]) == 1 + len(MODELS)
    for name in ("D25L40", "D10L60"):
        found = [forces(name, model)[-1] for model in MODELS]
        np.testing.assert_allclose(documented[name][1:], found, atol=6e-4)
    for k, _ in enumerate(MODELS, start=1):
        errors = [abs(documented[name][k] / force - 1) for name, force in MEASURED.items()]
        assert documented["mean error at 1.5 bar [%]"][k] == pytest.approx(100 * np.nanmean(errors), abs=0.6)
    text = " ".join((FOLDER.parents[1] / "docs" / "blocked-force.md").read_text().split())
    force, left = with_length_weight(LENGTH_WEIGHTS[-1])
    assert f"{force:.2f} N with {LENGTH_WEIGHTS[-1]:.0f} /m" in text
    assert f"{1e3 * left:.0f} N mm" in text


@pytest.mark.thorough
def test_a_tip_cap_lowers_the_force() -> None:
    bare, capped = (blocked_steps(name)[-1]["blocked_force_N"] for name in ("D25L60", "D25L60_tip_cap"))
    assert bare == pytest.approx(1.22, rel=0.02)
    assert 0.5 * bare < capped < bare


def test_a_wall_further_away_is_met_later() -> None:
    steps = blocked_steps("D25L60_wall")
    assert [step["status"] for step in steps] == ["no_contact"] * 3 + ["solved"] * 3
    for step in steps:
        assert (step["blocked_force_N"] > 0) == (step["gap_mm"] < 0)
        assert step["wall_normal"] == pytest.approx([np.cos(np.radians(10)), 0, np.sin(np.radians(10))], abs=1e-8)


@pytest.mark.thorough
def test_the_characteristic_curve_falls_to_nothing() -> None:
    steps = blocked_steps("D25L60_curve")
    forces = [step["blocked_force_N"] for step in steps]
    assert forces[0] == pytest.approx(1.22, rel=0.02)
    assert forces[-1] == 0
    assert steps[-1]["status"] == "no_contact"
    assert forces == sorted(forces, reverse=True)


def test_the_pressure_found_gives_the_force() -> None:
    (step,) = blocked_steps("D25L60_force")
    assert step["blocked_force_N"] == pytest.approx(0.3, rel=1e-6)
    assert step["pressure_bar"][1:] == [0, 0]
    assert 0.3 < step["pressure_bar"][0] < 0.6


@pytest.mark.thorough
def test_weighted_says_what_it_left() -> None:
    step = blocked_steps("D25L60_weighted")[-1]
    assert step["closure"] == "weighted"
    left = {line["equation"]: (abs(line["value"]), line["unit"]) for line in step["weighted_residual"]}
    assert left.keys() == {"e_n", "e_m", "e_L", "e_h"}
    assert left["e_L"][1] == "m"
    answers = [step[f"force_elasticity_to_weight_{name}"] for name in ("force", "moment", "length")]
    assert sum(answers) == pytest.approx(0, abs=2e-3)  # all weights scaled alike change nothing
    assert answers[2] > 0.1
    assert step["force_elasticity_to_weight_position"] is None
    assert 1e3 * left["e_L"][0] == pytest.approx(abs(step["length_error_mm"]))


@pytest.mark.thorough
def test_constrained_chambers_resist_the_load() -> None:
    step = blocked_steps("D25L60_constrained")[-1]
    free, held = step["free_tip_position_mm"], step["tip_position_mm"]
    assert held[0] > free[0]  # pulled along +x
    assert step["wall_normal"] is None
    assert any(abs(T) > 0.01 for T in step["chamber_reaction_N"])
