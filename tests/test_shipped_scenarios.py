"""Every scenario in scenarios/ runs as it is shipped, and shows what its first comment promises."""

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

SCENARIOS = {path.stem: path for path in sorted((Path(__file__).parents[1] / "scenarios").glob("*.toml"))}


@cache
def steps_of(name: str) -> list[dict[str, Any]]:
    """Run a shipped scenario as a person would, in an empty folder; return the steps of what it leaves there."""
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        assert main(["run", str(SCENARIOS[name])]) == 0
        results = Path("results") / name
        assert (results / "figure.png").stat().st_size > 10_000
        steps: list[dict[str, Any]] = json.loads((results / "results.json").read_text())["steps"]
        return steps


@pytest.mark.parametrize("name", SCENARIOS)
def test_it_runs(name: str) -> None:
    for step in steps_of(name):
        assert step["status"] == "solved"
        twisted = name == "D25L60_loaded_tip"  # a dead moment has no potential
        assert step["stable"] is (None if twisted else True)
        assert step["residual"] <= 1e-8
        assert step["discretisation_error"] <= 1e-6
        assert len(step["warnings"]) == twisted


def test_the_published_angle_is_reproduced() -> None:
    assert steps_of("laparoscope-6_published")[-1]["bending_angle_deg"] == pytest.approx(111.6, abs=0.1)


def test_three_sets_stay_straight() -> None:
    step = steps_of("D25L60_three_sets")[-1]
    assert step["bending_angle_deg"] == pytest.approx(0, abs=1e-9)
    assert step["tip_position_mm"] == pytest.approx([0, 0, 60 * step["stretch"]])


def test_two_sets_bend_away_from_both() -> None:
    x, y, _ = steps_of("D25L60_two_sets")[-1]["tip_position_mm"]
    assert np.rad2deg(np.arctan2(-y, -x)) == pytest.approx(60)


def test_its_weight_bends_a_standing_robot_and_straightens_a_hanging_one() -> None:
    standing, hanging = (steps_of(f"D15L60_{name}")[-1] for name in ("standing", "hanging"))
    assert standing["bending_angle_deg"] > hanging["bending_angle_deg"] + 10


def test_a_material_is_the_same_inline_and_in_a_file() -> None:
    inline, of_file = (steps_of(name)[-1] for name in ("own_formula", "own_materials_file"))
    assert inline["tip_position_mm"] == pytest.approx(of_file["tip_position_mm"], rel=1e-12)


def test_collocation_gives_the_same_pose() -> None:
    one, other = (steps_of(name)[-1] for name in ("D25L60_one_set", "D25L60_collocation"))
    assert one["tip_position_mm"] == pytest.approx(other["tip_position_mm"], abs=1e-6 * 60)


def test_a_turned_segment_bends_where_its_set_points() -> None:
    """Set 5 is 120 degrees from set 4, and the second segment turned by 60: it bends away from 180 degrees."""
    before, after = steps_of("two_segments")[1:3]
    first, second = (np.array(step["tip_position_mm"])[:2] for step in (before, after))
    assert (second - first)[0] > 5
    assert abs((second - first)[1]) < 1e-6
    assert len(after["segments"]) == 2
    angles = [step["segments"][0]["bending_angle_deg"] for step in (before, after)]
    assert angles[0] == pytest.approx(angles[1], rel=0.2)


def test_the_tip_goes_around_once() -> None:
    steps = steps_of("D25L60_circling")
    x, y, z = np.array([step["tip_position_mm"] for step in steps]).T
    turned = np.unwrap(np.arctan2(y, x))
    assert abs(turned[-1] - turned[0]) == pytest.approx(2 * np.pi, abs=1e-3)
    assert [step["t_s"] for step in steps] == list(range(27))
    assert np.ptp(z) < 0.01
