"""Standard deviations of steps: against differences of whole runs, Monte Carlo, and where there are none."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from softnlp import (
    InputError,
    Loads,
    Material,
    blocked_force,
    formula_law,
    forward,
    load_scenario,
    material,
    robot,
    run_scenario,
    save,
    to_dataset,
    to_json,
)
from softnlp.app.panels.results import step_lines
from softnlp.app.tabs.sequence import deviations
from softnlp.base.columns import OUTPUTS
from softnlp.cli import main
from softnlp.figures import run_figure
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.quantities import Model
from softnlp.results import load_run, view_of_run
from softnlp.statics.step import Run, Step
from softnlp.studies.tolerances import monte_carlo
from softnlp.studies.uncertainty import FACTOR, Deviations, scalable, scaling_constants

D25, SILICONE = robot("D25L60"), material("Ecoflex 00-50")
HEAD = 'study = "{}"\n[robot]\nname = "D25L60"\n[material]\nname = "Ecoflex 00-50"\nmodel = "{}"\n'
SHARE = 0.15


def scenario_file(folder: Path, uncertainty: str, rest: str = "", study: str = "forward", law: str = "yeoh") -> Path:
    path = folder / "s.toml"
    path.write_text(f"{HEAD.format(study, law)}{rest or PRESSURE}\n[uncertainty]\n{uncertainty}\n")
    return path


PRESSURE = "[pressure]\nsequence_bar = [[0.9, 0.3, 0.0]]\n"
LOADED = PRESSURE + '[tip_load]\nforce_N = [0.02, 0.01, -0.03]\n[gravity]\ndirection = "-z"\n'
WALL = '[pressure]\nsequence_bar = [[0.9, 0.0, 0.0]]\n[contact]\nclosure = "{}"\n'


def run_of(path: Path) -> Run:
    found = run_scenario(load_scenario(path))
    assert isinstance(found, Run)
    return found


def numbers(step: Step) -> dict[str, np.ndarray]:
    pose = step.pose
    assert pose is not None
    found = {
        "tip_position": pose.tip_position,
        "bending_angle": np.array(pose.bending_angle),
        "tilt": np.array(pose.tilt),
        "backbone_length": np.array(pose.backbone_length),
        "stretch": np.array(pose.stretch),
        "chamber_length": pose.chamber_length,
    }
    return found if step.contact is None else {**found, "blocked_force": np.array(step.contact.force)}


def central(solve: Any, size: float) -> dict[str, np.ndarray]:
    """Return what one deviation does, by central differences of a tenth of it."""
    up, down = numbers(solve(size / 10)), numbers(solve(-size / 10))
    return {name: 5 * (up[name] - down[name]) for name in up}


def assert_total(step: Step, parts: list[dict[str, np.ndarray]], relative: float) -> None:
    assert step.deviation is not None
    for name in parts[0]:
        total = np.sqrt(sum(part[name] ** 2 for part in parts))
        scale = np.max(total)
        np.testing.assert_allclose(step.deviation.values[name], total, rtol=0, atol=relative * scale, err_msg=name)


def scaled(silicone: Material, factor: float) -> Material:
    names = scaling_constants(silicone)
    return replace(silicone, constants={k: v * (factor if k in names else 1) for k, v in silicone.constants.items()})


# --- against differences of whole runs --------------------------------------------------------------------------------


def test_a_loaded_pose_has_the_deviations_of_its_differences(tmp_path: Path) -> None:
    text = 'material = 0.15\nchamber_diameter_mm = 0.05\nlength_mm = "1%"\npressure_bar = "2%"\nforce_N = 0.005'
    path = scenario_file(tmp_path, text, LOADED)
    asked, (step,) = load_scenario(path), run_of(path).steps
    P = asked.pressures[0]

    def solve(body: Any = D25, silicone: Any = asked.material, P: Any = P, force: Any = (0.02, 0.01, -0.03)) -> Step:
        loads = Loads(tip_force=force, gravity=asked.loads.gravity)
        return forward(body, silicone, P, loads=loads).steps[0]

    def pressed(k: int, h: float) -> Step:
        return solve(P=P + h * np.eye(3)[k])

    def pushed(k: int, h: float) -> Step:
        force = np.array([0.02, 0.01, -0.03]) + h * np.eye(3)[k]
        return solve(force=tuple(force))

    parts = [
        central(lambda h: solve(silicone=scaled(asked.material, 1 + h)), 0.15),
        central(lambda h: solve(replace(D25, chamber_diameter=D25.chamber_diameter + h)), 0.05e-3),
        central(lambda h: solve(replace(D25, length=D25.length + h)), 0.01 * D25.length),
        *(central(lambda h, k=k: pressed(k, h), 0.02 * P[k]) for k in (0, 1)),
        *(central(lambda h, k=k: pushed(k, h), 0.005) for k in range(3)),
    ]
    assert_total(step, parts, 2e-3)


@pytest.mark.parametrize("law", ["linear", "ogden"])
def test_the_stress_scales_by_every_law(tmp_path: Path, law: str) -> None:
    path = scenario_file(tmp_path, "material = 0.05", law=law)
    silicone = load_scenario(path).material
    (step,) = run_of(path).steps
    parts = [central(lambda h: forward(D25, scaled(silicone, 1 + h), [9e4, 3e4, 0]).steps[0], 0.05)]
    assert_total(step, parts, 2e-3)


def test_a_law_without_a_factor_gets_one(tmp_path: Path) -> None:
    fixed = Material("own", formula_law("own", "0.03 * (stretch - stretch**-b)", ["b"]), {"b": 2.0})
    assert scaling_constants(fixed) == ()
    assert scaling_constants(SILICONE) == ("C10", "C01", "C20")
    assert scaling_constants(material("Ecoflex 00-50", "ogden")) == ("mu1", "mu2")
    assert scalable(SILICONE) is SILICONE
    assert scalable(fixed).constants[FACTOR] == 1.0
    twin = Material("own", formula_law("twin", "a * (stretch - stretch**-2)", ["a"]), {"a": 0.03})
    found = []
    for own in (fixed, twin):
        constants = ", ".join(f"{k} = {v}" for k, v in own.constants.items())
        formula = "0.03 * (stretch - stretch**-b)" if own is fixed else "a * (stretch - stretch**-2)"
        path = tmp_path / "own.toml"
        path.write_text(
            f'study = "forward"\n[robot]\nname = "D25L60"\n[material]\nname = "own"\nmodel = "{own.law.name}"\n'
            f'formula = "{formula}"\nconstants = {{ {constants} }}\n{PRESSURE}[uncertainty]\nmaterial = 0.1\n'
        )
        found.append(run_of(path).steps[0].deviation)
    for name, value in found[1].values.items():
        np.testing.assert_allclose(found[0].values[name], value, rtol=1e-6, atol=1e-15)


def test_sets_scatter_as_their_constants_do(tmp_path: Path) -> None:
    path = scenario_file(tmp_path, 'material = "sets"', law="mooney-rivlin")
    (step,) = run_of(path).steps
    first, second = (material("Ecoflex 00-50", set=name) for name in ("shi-2025", "srmd"))

    def between(h: float) -> Step:
        own = {k: v + h * (second.constants[k] - v) for k, v in first.constants.items()}
        return forward(D25, replace(first, constants=own), [9e4, 3e4, 0]).steps[0]

    parts = [{k: v / np.sqrt(2) for k, v in central(lambda h: between(h / 10), 1.0).items()}]
    parts = [{k: 10 * v for k, v in parts[0].items()}]  # a tenth of the way is near enough to its slope
    assert_total(step, parts, 3e-3)


def test_one_uniform_segment_scatters_as_the_robot_that_it_is(tmp_path: Path) -> None:
    path = scenario_file(tmp_path, 'material = "sets"')
    whole = to_json(run_scenario(load_scenario(path)))["steps"]
    text = (
        path.read_text().replace("[robot]", "[[segment]]\n[segment.robot]").replace("[material]", "[segment.material]")
    )
    path.write_text(text)
    one = to_json(run_scenario(load_scenario(path)))["steps"]
    assert [step["std"] for step in one] == [step["std"] for step in whole]
    assert one[-1]["std"]["bending_angle_deg"] > 1


def test_a_blocked_force_scatters_with_silicone_wall_and_closure(tmp_path: Path) -> None:
    text = "material = 0.1\noffset_mm = 0.3\nchamber_reaction = 0.2\nchamber_wall_mm = 0.03\npressure_bar = '1%'"
    path = scenario_file(tmp_path, text, WALL.format("compliant"), "blocked-force")
    asked, (step,) = load_scenario(path), run_of(path).steps

    def solve(
        body: Any = D25, silicone: Any = asked.material, P: Any = (9e4, 0.0, 0.0), h: float = 0.0, c: float = 0.0
    ):
        contact, own = ContactSettings(offset=h), asked.coefficients
        own = replace(own, chamber_reaction=own.chamber_reaction + c)
        return blocked_force(body, silicone, P, contact, coefficients=own).steps[0]

    parts = [
        central(lambda h: solve(silicone=scaled(asked.material, 1 + h)), 0.1),
        central(lambda h: solve(h=h), 0.3e-3),
        central(lambda h: solve(c=h), 0.2),
        central(lambda h: solve(replace(D25, chamber_wall=D25.chamber_wall + h)), 0.03e-3),
        central(lambda h: solve(P=(9e4 + h, 0.0, 0.0)), 0.01 * 9e4),
    ]
    own = step.deviation
    assert own is not None
    for name in ("blocked_force", "bending_angle", "stretch", "backbone_length"):
        total = np.sqrt(sum(part[name] ** 2 for part in parts))
        np.testing.assert_allclose(own.values[name], total, rtol=3e-3, err_msg=name)


def test_a_target_has_the_deviations_of_its_pressures(tmp_path: Path) -> None:
    target = "[target]\ntip_position_mm = [[-10.0, 5.0, 62.0]]\n"
    path = scenario_file(tmp_path, "material = 0.1", target, "inverse")
    (step,) = run_of(path).steps
    silicone = load_scenario(path).material
    parts = [central(lambda h: forward(D25, scaled(silicone, 1 + h), step.pressure).steps[0], 0.1)]
    assert_total(step, parts, 2e-3)


# --- against Monte Carlo ----------------------------------------------------------------------------------------------


def drawn(path: Path, samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return first order, sampled deviations and their standard errors of the last step's outputs."""
    asked, run = load_scenario(path), run_of(path)
    assert asked.uncertainty is not None
    contact = asked.contact if asked.study == "blocked-force" else None
    adds = Deviations(asked.model, asked.numerics, asked.loads, contact, asked.uncertainty)
    step = run.steps[-1]
    found, why = adds.found(step)
    assert found is not None, why
    sampled = monte_carlo(found, adds.uncertainty.at(step), samples, seed=11)
    assert sampled.solved == samples
    own, values = step.deviation, []
    assert own is not None
    rows = [k for k, name in enumerate(found.outputs) if not name.startswith("tip_rotation")]
    for name in dict.fromkeys(found.outputs[k].rpartition(".")[0] or found.outputs[k] for k in rows):
        values += np.ravel(own.values[name.replace("chamber_lengths", "chamber_length")]).tolist()
    return np.array(values), sampled.deviation[rows], sampled.standard_error[rows]


CASES = [
    ("forward", LOADED, 'material = 0.02\nlength_mm = 0.1\nchamber_wall_mm = 0.01\npressure_bar = "0.5%"'),
    ("blocked-force", WALL.format("compliant"), "material = 0.02\nchamber_wall_mm = 0.01\noffset_mm = 0.05"),
    ("blocked-force", WALL.format("rigid"), "material = 0.02\nchamber_diameter_mm = 0.01\ntip_cap_mm = 0.0"),
]


@pytest.mark.parametrize(("study", "rest", "text"), CASES[:2], ids=["forward", "blocked"])
def test_a_few_draws_scatter_as_much(tmp_path: Path, study: str, rest: str, text: str) -> None:
    first, sampled, _ = drawn(scenario_file(tmp_path, text, rest, study), 24)
    noticed = first > 1e-3 * np.max(first)
    assert np.all((sampled / first)[noticed] > 0.6)
    assert np.all((sampled / first)[noticed] < 1.5)


@pytest.mark.slow
@pytest.mark.parametrize(("study", "rest", "text"), CASES, ids=["forward", "compliant", "rigid"])
def test_many_draws_scatter_as_the_derivatives_say(tmp_path: Path, study: str, rest: str, text: str) -> None:
    first, sampled, error = drawn(scenario_file(tmp_path, text, rest, study), 2000)
    noticed = first > 1e-3 * np.max(first)
    assert np.all(np.abs(sampled - first)[noticed] < 4 * error[noticed] + 0.005 * first[noticed])


# --- where there are none ---------------------------------------------------------------------------------------------


def test_kinks_have_no_deviation_and_the_rest_has(tmp_path: Path) -> None:
    path = scenario_file(tmp_path, "material = 0.1\nlength_mm = 0.2", "[pressure]\nsequence_bar = [[0.0, 0.0, 0.0]]\n")
    told = to_json(run_of(path))["steps"][0]
    assert told["std"]["bending_angle_deg"] is None
    assert told["std"]["tilt_deg"] is None
    assert told["std"]["tip_position_mm"][2] == pytest.approx(0.2, rel=1e-6)
    assert told["std"]["elongation_mm"] == pytest.approx(0.0, abs=1e-12)
    assert "the robot is straight" in told["std_message"]
    assert "the tip points along z" in told["std_message"]


def test_a_pose_that_is_not_stable_has_a_reason(tmp_path: Path) -> None:
    path = tmp_path / "s.toml"
    path.write_text(
        'study = "forward"\n[robot]\nname = "D10L60"\n[material]\nname = "Ecoflex 00-10"\nmodel = "mooney-rivlin"\n'
        '[gravity]\ndirection = "-z"\n[pressure]\nsequence_bar = [[0.0, 0.0, 0.0]]\n[uncertainty]\nmaterial = 0.1\n'
    )
    run = run_of(path)
    told = to_json(run)["steps"][0]
    assert told["stable"] is False
    assert set(told["std"].values()) == {None}
    assert told["std_message"] == "the pose is not stable"
    assert told["warnings"][-1] == "no standard deviations: the pose is not stable"
    solved = forward(D25, SILICONE, [5e4, 0, 0]).steps[0]
    fallen = replace(solved, pose=replace(solved.pose, stable=False))  # type: ignore[type-var]
    asked = load_scenario(path)
    assert asked.uncertainty is not None
    adds = Deviations(Model(D25, SILICONE), asked.numerics, Loads(), None, asked.uncertainty)
    deviation = adds.added(fallen).deviation
    assert deviation is not None
    assert (dict(deviation.values), deviation.message) == ({}, "the pose is not stable")
    elsewhere = replace(solved, pose=replace(solved.pose, tip_position=solved.pose.tip_position + 1e-3))  # type: ignore
    assert adds.found(elsewhere) == (None, "solved again the step ends in another pose")


def test_a_step_without_a_solution_has_the_reason_that_it_has_none(tmp_path: Path) -> None:
    rest = "[pressure]\nsequence_bar = [[3.0, 3.0, 3.0]]\n[stiffening]\nelongation = 0.0\n"
    told = to_json(run_of(scenario_file(tmp_path, "material = 0.1", rest)))["steps"][0]
    assert told["status"] == "unstable_material"
    assert told["std_message"] == told["message"]
    assert set(told["std"].values()) == {None}


def test_a_tip_that_only_touches_and_one_that_does_not(tmp_path: Path) -> None:
    rest = '[pressure]\nsequence_bar = [[0.0, 0.0, 0.0]]\n[contact]\nclosure = "compliant"\n'
    touching = to_json(run_of(scenario_file(tmp_path, "material = 0.1", rest, "blocked-force")))["steps"][0]
    assert "only touches" in touching["std_message"]
    assert touching["std"]["blocked_force_N"] is None
    rest = "[pressure]\nsequence_bar = [[0.2, 0.0, 0.0]]\n[contact]\noffset_mm = -30.0\n"
    away = to_json(run_of(scenario_file(tmp_path, "material = 0.1", rest, "blocked-force")))["steps"][0]
    assert away["status"] == "no_contact"
    assert away["std"]["blocked_force_N"] == 0.0
    assert away["std"]["bending_angle_deg"] > 0.5


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("", "[uncertainty]: expected at least one standard deviation, such as material = 0.15"),
        ("lenght_mm = 0.1", "[uncertainty] lenght_mm: unknown name; did you mean 'length_mm'?"),
        ("length_mm = true", "[uncertainty] length_mm: expected a number, or text such as '3%', got true"),
        ("length_mm = -1", "[uncertainty] length_mm: "),
        ('length_mm = "a few"', "[uncertainty] length_mm: expected a number that is not negative, or a percentage"),
        ('material = "set"', "[uncertainty] material: expected a number that is not negative, or a percentage such as"),
        ('force_N = "3%"', "[uncertainty] force_N: expected a number, and no percentage of what may be 0"),
        ("chamber_reaction = 0.1", "[uncertainty] chamber_reaction: unknown name"),
        ("C01_MPa = 0.1", "[uncertainty] C01_MPa: unknown name; did you mean"),
        ("material = 11", "[uncertainty] material: expected at most 10 (1000%), got 11"),
        ("length_mm = 1e300", "[uncertainty] length_mm: expected at most 1e+06, got 1e+300"),
        ('chamber_wall_mm = "2000%"', "[uncertainty] chamber_wall_mm: expected at most 10 (1000%), got '2000%'"),
    ],
)
def test_what_is_no_uncertainty_is_one_line(tmp_path: Path, text: str, line: str) -> None:
    path = scenario_file(tmp_path, text)
    with pytest.raises(InputError) as caught:
        load_scenario(path)
    assert str(caught.value).startswith(f"{path}: {line}")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("study", "law", "rest", "line"),
    [
        ("forward", "ogden", PRESSURE, "material: expected a silicone with several sets: Ecoflex 00-50 has one set"),
        ("blocked-force", "yeoh", WALL.format("weighted"), "not used with closure = 'weighted'"),
        ("blocked-force", "yeoh", PRESSURE + '[contact]\nmode = "constrained"\n', "not used with mode = 'constrained'"),
        ("workspace", "yeoh", "[workspace]\nlevels = 3\nto_bar = 1.0\n", "this table is not used by study 'workspace'"),
    ],
)
def test_where_no_uncertainty_is_taken(tmp_path: Path, study: str, law: str, rest: str, line: str) -> None:
    path = scenario_file(tmp_path, 'material = "sets"', rest, study, law)
    with pytest.raises(InputError, match="uncertainty") as caught:
        load_scenario(path)
    assert line in str(caught.value)


# --- where they are shown ---------------------------------------------------------------------------------------------


def test_every_way_out_has_the_same_deviations(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    rest = "[pressure]\nramp = { sets = [1], to_bar = 0.9, steps = 3 }\n"
    path = scenario_file(tmp_path, "material = 0.1\npressure_bar = 0.01", rest)
    monkeypatch.setattr("softnlp.cli.run.draw", lambda figures, folder: [])
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 0
    shown = capsys.readouterr().out
    document = json.loads((tmp_path / "out" / "results.json").read_text())
    assert document["uncertainty"] == {"material": 0.1, "pressure_bar": 0.01}
    angle = document["steps"][2]["std"]["bending_angle_deg"]
    assert f"± {angle:.2f}" in shown
    run = run_of(path)
    data = to_dataset(run)
    assert data["std_bending_angle_deg"].values[2] == pytest.approx(angle, rel=1e-9)
    assert np.isnan(data["std_bending_angle_deg"].values[0])
    assert data["std_tip_position_mm"].dims == ("step", "axis")
    header, *rows = (tmp_path / "out" / "table.csv").read_text().splitlines()
    cells = dict(zip(header.split(","), rows[2].split(","), strict=False))
    assert float(cells["std_bending_angle_deg"]) == pytest.approx(angle, rel=1e-9)
    assert float(cells["std_tip_position_z_mm"]) == pytest.approx(document["steps"][2]["std"]["tip_position_mm"][2])
    save(run, tmp_path / "kept")
    view = load_run(tmp_path / "kept")
    for name, values in view_of_run(run).std.items():
        np.testing.assert_allclose(view.std[name], values)
    figure = run_figure(view)
    bands = [c for axes in figure.axes for c in axes.collections if c.get_label() == "one standard deviation"]
    assert len(bands) >= 2
    (band,) = (c.get_paths()[0] for c in bands if c.axes is figure.axes[1] and c.get_paths())
    assert band.vertices[:, 1].max() == pytest.approx(document["steps"][2]["bending_angle_deg"] + angle, rel=1e-9)
    lines = {line.key: line.text for line in step_lines(replace(run, steps=run.steps[2:])).numbers}
    assert lines["bending_angle_deg"].endswith(f"± {angle:.3f}")
    assert lines["tip_position_mm.0"].count("±") == 1
    assert deviations(run.steps, OUTPUTS["bending_angle"])[0][2] == pytest.approx(angle)
    assert len(deviations(run.steps, OUTPUTS["tip_position"])) == 3


def test_a_run_without_uncertainty_says_nothing_of_it() -> None:
    run = forward(D25, SILICONE, [5e4, 0, 0])
    assert "std" not in to_json(run)["steps"][0]
    assert not any(str(name).startswith("std_") for name in to_dataset(run).variables)
    assert view_of_run(run).std == {}
    assert deviations(run.steps, OUTPUTS["bending_angle"]) == []
