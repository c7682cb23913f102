"""Every scenario in scenarios/ runs as it is shipped, and shows what its first comment promises."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from softnlp.cli import main

SCENARIOS = sorted((Path(__file__).parents[1] / "scenarios").glob("*.toml"))


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
