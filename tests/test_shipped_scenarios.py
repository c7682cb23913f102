"""Every scenario in scenarios/ runs as it is shipped, and shows what its first comment promises."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from softnlp.cli import main

FOLDER = Path(__file__).parents[1] / "scenarios"
SCENARIOS = sorted(FOLDER.glob("*.toml"))
BLOCKED = sorted((FOLDER / "blocked").glob("*.toml"))


def last_step(name: str, capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    """Return the last step of a shipped scenario."""
    path = next(path for path in SCENARIOS if path.stem == name)
    assert main(["run", str(path), "--json"]) == 0
    step: dict[str, Any] = json.loads(capsys.readouterr().out)["steps"][-1]
    return step


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_it_runs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["run", str(path)]) == 0
    steps = json.loads((tmp_path / "results" / path.stem / "results.json").read_text())["steps"]
    assert {step["status"] for step in steps} == {"solved"}
    assert all(step["stable"] and step["residual"] <= 1e-8 and step["discretisation_error"] <= 1e-6 for step in steps)
    assert not any(step["warnings"] for step in steps)
    assert (tmp_path / "results" / path.stem / "figure.png").stat().st_size > 10_000


def blocked_steps(name: str, capsys: pytest.CaptureFixture[str]) -> list[dict[str, Any]]:
    """Return the steps of a shipped blocked force."""
    assert main(["run", str(FOLDER / "blocked" / f"{name}.toml"), "--json"]) == 0
    steps: list[dict[str, Any]] = json.loads(capsys.readouterr().out)["steps"]
    return steps


@pytest.mark.parametrize("path", BLOCKED, ids=lambda path: path.stem)
def test_a_blocked_force_runs(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["run", str(path)]) == 0
    steps = json.loads((tmp_path / "results" / path.stem / "results.json").read_text())["steps"]
    assert {step["status"] for step in steps} <= {"solved", "no_contact"}
    assert all(step["residual"] <= 1e-8 and step["discretisation_error"] <= 1e-6 for step in steps)
    assert all("slip sideways" in warning for step in steps for warning in step["warnings"])
    assert (tmp_path / "results" / path.stem / "figure.png").stat().st_size > 10_000


def test_every_measured_robot_has_a_blocked_force() -> None:
    from benchmarks.blocked_measured import MEASURED

    shipped = {path.stem: path.read_text() for path in BLOCKED}
    assert {*MEASURED, "laparoscope-6"} <= shipped.keys()
    for name, force in MEASURED.items():
        assert f"Measured: {force:.2f} N" in shipped[name]


def test_a_tip_cap_lowers_the_force(capsys: pytest.CaptureFixture[str]) -> None:
    bare, capped = (blocked_steps(name, capsys)[-1]["blocked_force_N"] for name in ("D25L60", "D25L60_tip_cap"))
    assert bare == pytest.approx(1.22, rel=0.02)
    assert 0.5 * bare < capped < bare


def test_a_wall_further_away_is_met_later(capsys: pytest.CaptureFixture[str]) -> None:
    steps = blocked_steps("D25L60_wall", capsys)
    assert [step["status"] for step in steps] == ["no_contact"] * 3 + ["solved"] * 3
    for step in steps:
        assert (step["blocked_force_N"] > 0) == (step["gap_mm"] < 0)
        assert step["wall_normal"] == pytest.approx([np.cos(np.radians(10)), 0, np.sin(np.radians(10))], abs=1e-8)


def test_the_characteristic_curve_falls_to_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    steps = blocked_steps("D25L60_curve", capsys)
    forces = [step["blocked_force_N"] for step in steps]
    assert forces[0] == pytest.approx(1.22, rel=0.02)
    assert forces[-1] == 0
    assert steps[-1]["status"] == "no_contact"
    assert forces == sorted(forces, reverse=True)


def test_the_pressure_found_gives_the_force(capsys: pytest.CaptureFixture[str]) -> None:
    (step,) = blocked_steps("D25L60_force", capsys)
    assert step["blocked_force_N"] == pytest.approx(0.3, rel=1e-6)
    assert step["pressure_bar"][1:] == [0, 0]
    assert 0.3 < step["pressure_bar"][0] < 0.6


def test_weighted_says_what_it_left(capsys: pytest.CaptureFixture[str]) -> None:
    step = blocked_steps("D25L60_weighted", capsys)[-1]
    assert step["closure"] == "weighted"
    left = {line["equation"]: (abs(line["value"]), line["unit"]) for line in step["weighted_residual"]}
    assert left.keys() == {"e_n", "e_m", "e_L", "e_h"}
    assert left["e_L"][1] == "m"
    assert 1e3 * left["e_L"][0] == pytest.approx(abs(step["length_error_mm"]))


def test_constrained_chambers_resist_the_load(capsys: pytest.CaptureFixture[str]) -> None:
    step = blocked_steps("D25L60_constrained", capsys)[-1]
    free, held = step["free_tip_position_mm"], step["tip_position_mm"]
    assert held[0] > free[0]  # pulled along +x
    assert step["wall_normal"] is None
    assert any(abs(T) > 0.01 for T in step["chamber_reaction_N"])


def test_the_published_angle_is_reproduced(capsys: pytest.CaptureFixture[str]) -> None:
    assert last_step("laparoscope-6_published", capsys)["bending_angle_deg"] == pytest.approx(111.6, abs=0.1)


def test_three_sets_stay_straight(capsys: pytest.CaptureFixture[str]) -> None:
    step = last_step("D25L60_three_sets", capsys)
    assert step["bending_angle_deg"] == pytest.approx(0, abs=1e-9)
    assert step["tip_position_mm"] == pytest.approx([0, 0, 60 * step["stretch"]])


def test_two_sets_bend_away_from_both(capsys: pytest.CaptureFixture[str]) -> None:
    x, y, _ = last_step("D25L60_two_sets", capsys)["tip_position_mm"]
    assert np.rad2deg(np.arctan2(-y, -x)) == pytest.approx(60)


def test_its_weight_bends_a_standing_robot_and_straightens_a_hanging_one(capsys: pytest.CaptureFixture[str]) -> None:
    standing, hanging = (last_step(f"D15L60_{name}", capsys) for name in ("standing", "hanging"))
    assert standing["bending_angle_deg"] > hanging["bending_angle_deg"] + 10


def test_a_material_is_the_same_inline_and_in_a_file(capsys: pytest.CaptureFixture[str]) -> None:
    inline, of_file = (last_step(name, capsys) for name in ("own_formula", "own_materials_file"))
    assert inline["tip_position_mm"] == pytest.approx(of_file["tip_position_mm"], rel=1e-12)


def test_collocation_gives_the_same_pose(capsys: pytest.CaptureFixture[str]) -> None:
    one, other = (last_step(name, capsys) for name in ("D25L60_one_set", "D25L60_collocation"))
    assert one["tip_position_mm"] == pytest.approx(other["tip_position_mm"], abs=1e-6 * 60)


def test_the_tip_goes_around_once(capsys: pytest.CaptureFixture[str]) -> None:
    path = next(path for path in SCENARIOS if path.stem == "D25L60_circling")
    main(["run", str(path), "--json"])
    steps = json.loads(capsys.readouterr().out)["steps"]
    x, y, z = np.array([step["tip_position_mm"] for step in steps]).T
    turned = np.unwrap(np.arctan2(y, x))
    assert abs(turned[-1] - turned[0]) == pytest.approx(2 * np.pi, abs=1e-3)
    assert [step["t_s"] for step in steps] == list(range(27))
    assert np.ptp(z) < 0.01
