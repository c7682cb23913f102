"""Every study runs from its scenario in Python, and a call that cannot be meant names the function to use."""

from __future__ import annotations

import gc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from sweeps import QUICK, plan, scenario

import softnlp
from softnlp import InputError, load_scenario, run_design, run_scenario, run_sweep
from softnlp.scenario.check import SCHEMAS
from softnlp.scenario.read import Scenario, scenario_from_text
from softnlp.scenario.run import STUDIES
from softnlp.scenario.workspace import plan_of
from softnlp.sweep.read import Workspace, load_workspace, read_column

SCENARIOS = Path(__file__).parents[1] / "scenarios"
SWEEP = scenario("[workspace]\nlevels = 2\nto_bar = 0.5\n" + QUICK)
MODEL = 'robot = { name = "D25L60" }\nmaterial = { name = "Ecoflex 00-50", model = "mooney-rivlin" }\n'
SOLVER = "solver = { intervals = 10, accuracy = 1e-3 }\n"
PRESSURE = "pressure = { sequence_bar = [[0.3, 0.0, 0.0]] }\n"
TARGET = "target = { tip_position_mm = [[10.0, 0.0, 72.0]] }\nbounds = { pressure_bar = [0.0, 1.5] }\n"
DESIGN = """
choices = { material.name = ["Ecoflex 00-50", "Dragon Skin 10"] }
actuation = { sets = [1], pressure_bar = 0.3 }
objective = { maximise = "bending_angle_deg" }
"""


def of(study: str) -> Scenario:
    """Return a quick scenario of a study."""
    if study == "workspace":
        return SWEEP
    if study == "identify":
        return load_scenario(SCENARIOS / "identify/tensile.toml")
    tables = {
        "forward": MODEL + SOLVER + PRESSURE,
        "blocked-force": MODEL + SOLVER + PRESSURE,
        "inverse": MODEL
        + SOLVER
        + "target = { tip_position_mm = [[10.0, 0.0, 72.0]] }\nbounds = { pressure_bar = [0.0, 1.5] }\n",
        "design": MODEL + SOLVER + DESIGN,
        "trajectory": MODEL + SOLVER + "trajectory = { tip_position_mm = [[10.0, 0.0, 72.0], [9.0, 0.0, 72.0]] }\n",
        "dynamic": MODEL + PRESSURE + "dynamic = { duration_s = 0.01, output_step_s = 0.01, damping_s = 0.01 }\n",
    }
    return scenario_from_text(f'study = "{study}"\n{tables[study]}', "quick.toml")


KINDS = {
    "forward": "Run",
    "blocked-force": "Run",
    "inverse": "Run",
    "identify": "TensileFit",
    "design": "Design",
    "dynamic": "Run",
    "trajectory": "Run",
    "workspace": "Workspace",
}


@pytest.mark.parametrize("study", sorted(SCHEMAS))
def test_every_study_runs_and_gives_its_result(study: str) -> None:
    assert set(STUDIES) < set(SCHEMAS)
    done: list[int] = []
    result = run_scenario(of(study), lambda count, what: done.append(count))
    assert type(result).__name__ == KINDS[study]
    assert done or study == "identify"  # a tensile test is fitted at once
    if isinstance(result, softnlp.Run):
        assert {step.status for step in result.steps} == {"solved"}


def test_a_workspace_without_a_folder_is_kept_as_long_as_its_result(tmp_path: Path) -> None:
    found = run_scenario(SWEEP)
    assert isinstance(found, Workspace)
    height = read_column(found, "tip_position_z_mm").values
    assert (height > 50).all()
    folder = found.file.parent
    del found
    gc.collect()
    assert not folder.exists()
    kept = run_scenario(SWEEP, folder=tmp_path / "kept")
    assert isinstance(kept, Workspace)
    assert (read_column(load_workspace(tmp_path / "kept"), "tip_position_z_mm").values == height).all()
    assert kept.title == "sweep"
    assert kept.attributes["scenario"] == SWEEP.text


WRONG: dict[str, tuple[Callable[[Any], Any], str]] = {
    "a run as a sweep": (lambda out: run_sweep(of("forward"), out), "'workspace', got 'forward'; softnlp.run_scenario"),
    "a run as a plan": (lambda out: plan_of(of("forward")), "'workspace', got 'forward'; softnlp.run_scenario runs it"),
    "a path as a sweep": (lambda out: run_sweep("a.toml", out), "got a value of type str; softnlp.load_scenario"),
    "a path as a run": (lambda out: run_scenario(Path("a.toml")), "type PosixPath; softnlp.load_scenario reads one"),
    "a plan as a design": (lambda out: run_design(plan()), "got a value of type Plan; softnlp.run_sweep solves a plan"),
    "a plan as a run": (lambda out: run_scenario(plan()), "type Plan; softnlp.run_sweep solves a plan"),
    "a sweep as a design": (lambda out: run_design(SWEEP), "of study 'design', got 'workspace'; softnlp.run_scenario"),
    "a folder for a run": (lambda out: run_scenario(of("forward"), folder=out), "folder: only study 'workspace'"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_call_names_the_function_to_use(case: str, tmp_path: Path) -> None:
    call, words = WRONG[case]
    with pytest.raises(InputError) as caught:
        call(tmp_path / "out")
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_the_old_places_still_have_them() -> None:
    from softnlp.runner_design import run_design as old_design
    from softnlp.workspace.run import run_sweep as old_sweep

    assert (softnlp.run_design, softnlp.run_sweep) == (old_design, old_sweep)
