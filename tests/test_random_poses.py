"""Random poses through the command, each integrated backward from its tip by the independent witness."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from designs import Design, body_of, random_design, rubber_of
from witness import integrate, scaled
from witness_section import section

from softnlp.base.units import BAR, DEGREE
from softnlp.cli import main

BACKWARD = 1e-6  # of the length and of unity: the accuracy that a scenario asks for by default
LENGTHS = ("outer_diameter", "lumen_diameter", "chamber_circle_diameter", "chamber_diameter", "chamber_wall", "length")


def scenario_text(design: Design) -> str:
    """Write a random design as a person would; every number keeps its bits."""
    robot, loads = design.robot, design.loads
    lines = ['study = "forward"', "[robot]"]
    lines += [f"{name}_mm = {1e3 * getattr(robot, name)!r}" for name in LENGTHS]
    lines += [f"chamber_sets = {robot.chamber_sets}", f"chambers_per_set = {robot.chambers_per_set}"]
    lines += [f"chamber_angle_deg = {robot.chamber_angle / DEGREE!r}"]
    lines += ["[material]", f'name = "{design.material.name}"', f'model = "{design.material.law.name}"']
    lines += ["[pressure]", f"sequence_bar = [{[float(P) / BAR for P in design.pressure]}]"]
    lines += ["[tip_load]", f"force_N = {[float(F) for F in loads.tip_force]}"]
    lines += [f"moment_Nmm = {[1e3 * float(M) for M in loads.tip_moment]}"]
    if np.any(loads.gravity):
        lines += ["[gravity]", f"direction = {[float(g) for g in loads.gravity]}"]
    return "\n".join(lines)


def base_defect(design: Design, step: dict[str, Any]) -> tuple[float, float]:
    """Return how far the equations, integrated from the tip that was reported, miss p = 0 and R = I at the base.

    And how much errors of the tip grow on the way back: a stiff load on a rod that bends makes hundreds of one.
    """
    P = np.array(step["pressure_bar"]) * BAR
    made = section(body_of(design.robot), rubber_of(design.material), P)
    loads = design.loads
    problem = scaled(made, loads.tip_force, loads.tip_moment, loads.gravity, float(design.material.density))
    R = np.array(step["tip_rotation"])

    def base(R: np.ndarray) -> np.ndarray:
        tip = np.zeros((20 + design.robot.chambers, 1))
        tip[0:3, 0] = np.array(step["tip_position_mm"]) * 1e-3 / made.L
        tip[3:12, 0] = R.ravel()
        tip[12:15, 0] = problem.F_e + problem.sec.F_P * R[:, 2]
        tip[15:18, 0] = problem.M_e + R @ problem.sec.M_P
        return np.asarray(integrate(problem, np.empty((6, 0)), rtol=1e-10, backward_from=tip)[:12, 0])

    reached = base(R)
    defect = float(np.abs(reached - [0, 0, 0, *np.eye(3).ravel()]).max())
    if defect <= 10 * BACKWARD:
        return defect, 1.0
    nudges = [BACKWARD * np.eye(9)[k].reshape(3, 3) for k in range(9)]
    return defect, max(float(np.abs(base(R + nudge) - reached).max()) / BACKWARD for nudge in nudges)


def run_poses(seeds: range, folder: Path, capsys: pytest.CaptureFixture[str]) -> Counter[str]:
    """Run random poses; fail where one that is called solved does not hold. Returns how they ended."""
    ended: Counter[str] = Counter()
    file = folder / "scenario.toml"
    for seed in seeds:
        design = random_design(np.random.default_rng(seed))
        file.write_text(scenario_text(design))
        status = main(["run", str(file), "--json"])
        step = json.loads(capsys.readouterr().out)["steps"][0]
        ended[step["status"]] += 1
        assert status == (0 if step["status"] == "solved" else 3), f"seed {seed}: {design}"
        if step["status"] == "solved":
            defect, growth = base_defect(design, step)
            assert defect <= BACKWARD * max(10.0, growth), f"seed {seed}: {defect:.2g}, {growth:.3g}: {design}"
            assert growth < 1e4, f"seed {seed}: nothing can be said"
        else:
            assert step["tip_position_mm"] is None
    return ended


@pytest.mark.thorough
def test_random_poses_hold_backward(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_poses(range(4), tmp_path, capsys)["solved"] >= 3


@pytest.mark.slow
def test_three_hundred_random_poses_hold_backward(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_poses(range(100, 400), tmp_path, capsys)["solved"] >= 290
