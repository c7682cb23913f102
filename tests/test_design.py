"""Designs: the optimum against dense enumeration, its multipliers against differences, and what is refused and why."""

from __future__ import annotations

import json
import re
import threading
import tomllib
from concurrent.futures import ThreadPoolExecutor
from contextlib import chdir
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from softnlp import (
    BAR,
    DEGREE,
    MILLIMETRE,
    DesignTask,
    InputError,
    Loads,
    Numerics,
    PressureSteps,
    Range,
    at_least,
    at_most,
    design,
    load_scenario,
    material,
    robot,
)
from softnlp.cli import main
from softnlp.figures.design import design_figure
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.conventions import AS_PRINTED
from softnlp.model.quantities import Model
from softnlp.results.design import held_back
from softnlp.scenario.design import (
    ActuationTable,
    LimitsTable,
    MaterialChoices,
    ObjectiveTable,
    RequirementsTable,
    RobotChoices,
    run_design,
)
from softnlp.scenario.read import scenario_from_text
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.solver import PoseSolver
from softnlp.statics.wall import standing_wall
from softnlp.studies import design as design_module
from softnlp.studies.design import Design
from softnlp.studies.design_candidate import Candidate
from softnlp.studies.design_evaluate import Evaluator, broken_rules, unmet
from softnlp.studies.design_optimise import Optimiser
from softnlp.studies.design_task import OUTPUTS, Setting

FOLDER = Path(__file__).parents[1] / "scenarios" / "design"
D25, SOFT = robot("D25L60"), material("Ecoflex 00-50")
STRETCHED = {"stretch": at_most(1.2), "outer_wall": at_least(1.2 * MILLIMETRE)}


def angle_task(names: tuple[str, ...], **changes: Any) -> DesignTask:
    """Return the task of bending most at 1 bar with one or two dimensions free."""
    ranges = {
        "chamber_diameter": Range(4.0 * MILLIMETRE, 5.0 * MILLIMETRE),
        "lumen_diameter": Range(7.0 * MILLIMETRE, 11.0 * MILLIMETRE),
    }
    task = DesignTask(
        {name: ranges[name] for name in names}, 1.0 * BAR, requirements=STRETCHED, maximise="bending_angle"
    )
    return replace(task, **changes)


def evaluator_of(task: DesignTask, model: Model) -> Evaluator:
    return Evaluator(Setting(model.robot, model.material), task, model)


@pytest.mark.parametrize(
    "names", [("chamber_diameter",), pytest.param(("chamber_diameter", "lumen_diameter"), marks=pytest.mark.slow)]
)
def test_the_optimum_agrees_with_dense_enumeration(names: tuple[str, ...]) -> None:
    """Every design of a fine grid is judged in closed form; the best of them is next to the optimum, and below it."""
    task = angle_task(names)
    best = design(D25, SOFT, task).best
    assert best is not None
    evaluator = evaluator_of(task, Model(D25, SOFT))
    points = 16 if len(names) == 2 else 61
    axes = [np.linspace(task.ranges[name].lower, task.ranges[name].upper, points) for name in names]
    met = []
    for values in np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(names)):
        made = replace(D25, **dict(zip(names, map(float, values), strict=True)))
        if broken_rules(made, task):
            continue
        found = evaluator.free(Model(made, SOFT), 1.0 * BAR)
        if not unmet(found, task):
            met.append((found.outputs["bending_angle"], values))
    angle, place = max(met, key=lambda pair: pair[0])
    assert len(met) > points // 2
    assert best.objective >= angle
    assert best.objective == pytest.approx(angle, rel=1e-2 if len(names) == 1 else 5e-2)
    for name, value, axis in zip(names, place, axes, strict=True):
        assert abs(best.choices[name] - value) <= 1.5 * (axis[1] - axis[0])
    assert best.agreeing == best.starts


@pytest.mark.slow
def test_a_multiplier_is_what_loosening_its_limit_gains() -> None:
    best = design(D25, SOFT, angle_task(("chamber_diameter", "lumen_diameter"))).best
    assert best is not None
    rates = {active.name: active.rate for active in best.active if np.isfinite(active.limit)}
    assert rates
    assert min(rates.values()) > 0
    for name, rate in rates.items():
        if name in STRETCHED:
            limit, h = STRETCHED[name], 1e-3 * max(abs(best.outputs[name]), 1e-3)
            gained = []
            for loosened in (h, -h):
                moved = replace(limit, lower=limit.lower - loosened, upper=limit.upper + loosened)
                again = design(D25, SOFT, angle_task(tuple(best.choices), requirements={**STRETCHED, name: moved})).best
                assert again is not None
                gained.append(again.objective)
            assert rate == pytest.approx((gained[0] - gained[1]) / (2 * h), rel=1e-2)
    assert set(STRETCHED) & set(rates)


@cache
def forced() -> tuple[DesignTask, Optimiser]:
    """Return the task of pushing most under a bound of the stretch, and what is compiled for it."""
    choices = {
        "chamber_diameter": Range(3.0 * MILLIMETRE, 5.5 * MILLIMETRE),
        "lumen_diameter": Range(6.0 * MILLIMETRE, 11.0 * MILLIMETRE),
    }
    task = DesignTask(choices, Range(0.0, 1.0 * BAR), requirements={"stretch": at_most(1.1)}, maximise="blocked_force",
                      starts=2)  # fmt: skip
    return task, Optimiser(evaluator_of(task, Model(D25, SOFT)))


def test_the_derivatives_of_the_program_are_those_of_differences() -> None:
    _, optimiser = forced()
    begun = optimiser.evaluator.full(Model(D25, SOFT), 0.6 * BAR)
    posed = optimiser.problem(begun, 15)
    start = posed.start(begun)
    x, p, guard = start.x, start.p, posed.problem.constraints[-1]
    assert (guard.name, guard.in_hessian) == ("fold of the blocked shape", False)
    assert float(posed.problem.residual(x, p)[-1]) > 10 * guard.lower  # the wall's reaction has not brought it near one
    solver = start.engine._solver
    jac, hess, grad = (solver.get_function(name) for name in ("nlp_jac_g", "nlp_hess_l", "nlp_grad_f"))
    g, J = (np.asarray(part) for part in jac(x, p))
    lam = np.random.default_rng(3).normal(size=g.size)
    lam[-1] = 0.0  # the guard's curvature is left out
    n = posed.problem.free_size
    # Along the choices, and along the stretch and a few states.
    for k in [*range(n + 2), n + 20, x.size - 1]:
        e = np.zeros(x.size)
        e[k] = 1e-6
        up, down = (jac(x + s * e, p) for s in (1, -1))
        slope = (np.asarray(up[0]) - np.asarray(down[0])).ravel() / 2e-6
        np.testing.assert_allclose(J[:, k], slope, atol=2e-6 * (1 + np.abs(slope).max()))
        curved = (np.asarray(up[1]) - np.asarray(down[1])).T @ lam / 2e-6
        upper = np.asarray(hess(x, p, 0.0, lam))
        whole = upper + np.triu(upper, 1).T
        np.testing.assert_allclose(whole[:, k], curved, atol=1e-5 * (1 + np.abs(curved).max()))
    assert np.abs(np.asarray(grad(x, p)[1])).max() > 0


def test_the_largest_force_is_on_the_branch_and_cannot_be_beaten_nearby() -> None:
    """The force of designs around the optimum, each followed from zero pressure, is smaller or breaks a limit."""
    task, optimiser = forced()
    found = optimiser.best(Model(D25, SOFT), task.pressure)  # type: ignore[arg-type]
    assert not found.reasons
    assert found.found is not None
    assert found.agreeing == found.starts == 2
    best = found.found.outputs["blocked_force"]
    assert found.found.step is not None
    assert found.found.step.residual <= 1e-8
    rng = np.random.default_rng(5)
    feasible = 0
    for _ in range(8):
        changed = {
            name: float(np.clip(found.found.outputs[name] * rng.uniform(0.94, 1.03), r.lower, r.upper))
            for name, r in task.ranges.items()
        }
        made = Model(replace(D25, **changed), SOFT)
        if not broken_rules(made.robot, task):
            near = optimiser.evaluator.full(made, found.found.pressure)
            if not unmet(near, task):
                feasible += 1
                assert near.outputs["blocked_force"] < best * (1 + 1e-5)
    assert feasible > 1
    names = {active.name for active in found.active}
    assert "stretch" in names


@pytest.mark.thorough
def test_a_solver_takes_another_model_without_compiling() -> None:
    other = Model(robot("D25L60", chamber_diameter=4e-3, length=0.05), material("Dragon Skin 10"))
    P = np.array([0.8 * BAR, 0.0, 0.0])
    first = BlockedSolver(Model(D25, SOFT), Numerics(intervals=10), ContactSettings())
    wall = standing_wall(first.poses, first.contact, P[None, :], Loads())
    before = first.solve(P, Loads(), wall)[0]
    changed, fresh = (
        solver.solve(P, Loads(), wall)[0].contact
        for solver in (first.with_model(other), BlockedSolver(other, Numerics(intervals=10), ContactSettings()))
    )
    assert changed is not None
    assert fresh is not None
    assert changed.force == fresh.force
    np.testing.assert_array_equal(changed.free.tip_position, fresh.free.tip_position)
    assert changed.free.radii == fresh.free.radii
    again = first.solve(P, Loads(), wall)[0]
    assert again.contact is not None
    assert before.contact is not None
    assert again.contact.force == before.contact.force != changed.force
    for unlike in (
        Model(robot("D25L60", chambers_per_set=1), SOFT),
        Model(D25, material("Ecoflex 00-50", "yeoh")),
        Model(D25, SOFT, conventions=AS_PRINTED),
    ):
        with pytest.raises(ValueError, match="a solver of its own"):
            first.with_model(unlike)


def test_the_closed_form_is_the_solved_free_shape() -> None:
    task = angle_task(("chamber_diameter",))
    evaluator = evaluator_of(task, Model(D25, SOFT))
    arc, solved = (look(Model(D25, SOFT), 1.0 * BAR) for look in (evaluator.free, evaluator.full))
    assert arc.outputs.keys() == solved.outputs.keys() == {name for name in OUTPUTS if name != "blocked_force"}
    for name, value in arc.outputs.items():
        assert value == pytest.approx(solved.outputs[name], rel=1e-6, abs=1e-9)
    assert arc.outputs["tip_deflection"] == pytest.approx(-arc.outputs["tip_x"])


def test_a_pressure_in_steps_is_the_lowest_that_meets_everything() -> None:
    wanted = {"bending_angle": at_least(60 * DEGREE)}
    task = DesignTask({"material": [SOFT, material("Dragon Skin 10")]}, PressureSteps(0.1 * BAR, 1.5 * BAR),
                      requirements=wanted, minimise="pressure")  # fmt: skip
    done = design(D25, SOFT, task)
    best = done.best
    assert best is not None
    assert best.material is SOFT
    assert best.outputs["pressure"] == pytest.approx(round(best.outputs["pressure"] / 1e4) * 1e4)
    solver = PoseSolver(Model(D25, SOFT), Numerics())
    below, at = (
        solver.solve(P * np.array([1.0, 0.0, 0.0]), Loads())[0].pose.bending_angle / DEGREE  # type: ignore[union-attr]
        for P in (best.outputs["pressure"] - 0.1 * BAR, best.outputs["pressure"])
    )
    assert below < 60 <= at
    (other,) = (c for c in done.candidates if c is not best)
    assert other.status == "infeasible"
    assert "bending_angle_deg" in other.reasons[0]
    assert other.outputs["pressure"] == 1.5 * BAR


def test_the_free_pressure_of_steps_is_met_by_the_optimised_one() -> None:
    """The least pressure that bends enough, by steps and by optimisation, differ by less than a step."""
    wanted = {"bending_angle": at_least(60 * DEGREE)}
    found = [
        design(D25, SOFT, DesignTask({}, pressure, requirements=wanted, minimise="pressure"))
        if isinstance(pressure, Range)
        else design(D25, SOFT, DesignTask({"material": [SOFT]}, pressure, requirements=wanted, minimise="pressure"))
        for pressure in (PressureSteps(0.02 * BAR, 1.5 * BAR), Range(0.0, 1.5 * BAR))
    ]
    stepped, free = (d.best for d in found)
    assert stepped is not None
    assert free is not None
    assert free.outputs["bending_angle"] == pytest.approx(60 * DEGREE, rel=1e-5)
    assert 0 <= stepped.objective - free.objective < 0.02 * BAR


def test_what_cannot_be_made_says_so_and_is_not_solved() -> None:
    task = DesignTask({"chambers_per_set": [2, 3], "chamber_diameter": [4.5e-3, 7.5e-3]}, 1.0 * BAR,
                      requirements={"stretch": at_most(1.01)}, maximise="bending_angle")  # fmt: skip
    done = design(D25, SOFT, task)
    assert done.best is None
    assert [c.status for c in done.candidates] == ["infeasible"] * 4
    reasons = ["; ".join(c.reasons) for c in done.candidates]
    assert "stretch" in reasons[0]
    assert "wall_thickness" in reasons[1]
    assert "chamber_overlap" in reasons[2]
    assert not done.candidates[1].outputs


def test_a_design_that_nothing_meets_names_what_is_missed() -> None:
    done = design(D25, SOFT, angle_task(("chamber_diameter",), requirements={"bending_angle": at_least(400 * DEGREE)}))
    (candidate,) = done.candidates
    assert candidate.status == "infeasible"
    assert "bending_angle_deg" in candidate.reasons[0]
    assert "400 deg wanted" in candidate.reasons[0]
    assert candidate.outputs["chamber_diameter"] == pytest.approx(5.0e-3, rel=1e-3)  # as far as it can go


def test_loads_are_part_of_the_program() -> None:
    """With a weight the free shape is no arc: its states are unknowns of the program."""
    task = angle_task(("chamber_diameter",), starts=1)
    heavy = Loads(gravity=(0.0, 0.0, -9.80665), tip_force=(0.0, 0.0, -0.1))
    loaded, unloaded = (design(D25, SOFT, task, loads=loads).best for loads in (heavy, Loads()))
    assert loaded is not None
    assert unloaded is not None
    solver = PoseSolver(Model(loaded.robot, SOFT), Numerics())
    pose = solver.solve(np.array([1.0 * BAR, 0.0, 0.0]), heavy)[0].pose
    assert pose is not None
    assert loaded.objective == pytest.approx(pose.bending_angle, rel=1e-9)
    assert loaded.objective > 1.01 * unloaded.objective
    assert loaded.choices["chamber_diameter"] == pytest.approx(unloaded.choices["chamber_diameter"], rel=1e-3)


@pytest.mark.thorough
def test_processes_find_what_one_finds() -> None:
    silicones = [SOFT, material("Dragon Skin 10"), material("Ecoflex 00-30")]
    task = DesignTask({"material": silicones}, 1.0 * BAR, requirements={"stretch": at_most(1.2)},
                      maximise="bending_angle")  # fmt: skip
    one, two = (design(D25, SOFT, task, workers=workers) for workers in (1, 2))
    assert [c.number for c in two.candidates] == [1, 2, 3]
    assert [c.objective for c in one.candidates] == [c.objective for c in two.candidates]
    assert [c.material.name for c in one.candidates] == [c.material.name for c in two.candidates]


def test_candidates_come_one_by_one_and_none_is_begun_after_a_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    """Who presses Ctrl-C waits for the candidates that are being evaluated alone."""
    begun: list[int] = []
    seen, one = threading.Event(), design(D25, SOFT, numbers_task(1)).candidates[0]

    def candidate(self: Any, number: int, combination: Any) -> Candidate:
        begun.append(number)
        if number > 1:
            seen.wait()
        return replace(one, number=number)

    def pool(workers: int, begin: Any, *given: Any) -> ThreadPoolExecutor:
        begin(*given)
        return ThreadPoolExecutor(1)

    def stop(count: int, done: Candidate) -> None:
        assert (count, done.number) == (1, 1)
        threading.Timer(0.2, seen.set).start()
        raise KeyboardInterrupt

    monkeypatch.setattr(design_module.CandidateEvaluator, "candidate", candidate)
    monkeypatch.setattr(design_module, "worker_pool", pool)
    with pytest.raises(KeyboardInterrupt):
        design(D25, SOFT, numbers_task(6), workers=2, progress=stop)
    assert begun in ([1], [1, 2])  # the second may be on its way when the first one is told


def numbers_task(count: int) -> DesignTask:
    return DesignTask({"chamber_diameter": list(np.linspace(4e-3, 4.5e-3, count))}, 1.0 * BAR, maximise="stretch")


def test_a_search_finds_the_best_of_few(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("optuna")
    choices = {"chamber_diameter": [3e-3, 3.5e-3, 4e-3, 4.5e-3], "material": [SOFT, material("Dragon Skin 10")]}
    task = DesignTask(choices, 1.0 * BAR, requirements={"stretch": at_most(1.1)}, maximise="bending_angle", trials=60)
    every = design(D25, SOFT, task).best
    monkeypatch.setattr(design_module, "MOST_ENUMERATED", 5)
    done = design(D25, SOFT, task)
    assert every is not None
    assert done.best is not None
    assert done.best.objective == every.objective
    assert len({json.dumps([c.robot.chamber_diameter, c.material.name]) for c in done.candidates}) == len(
        done.candidates
    )


def test_a_search_without_optuna_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(design_module, "MOST_ENUMERATED", 1)
    monkeypatch.setitem(__import__("sys").modules, "optuna", None)
    task = DesignTask({"material": [SOFT, material("Dragon Skin 10")]}, 1.0 * BAR, maximise="bending_angle")
    with pytest.raises(InputError, match=r"pip install 'softnlp\[design\]'"):
        design(D25, SOFT, task)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"choices": {"chamber_diametre": [1e-3]}}, "did you mean 'chamber_diameter'"),
        ({"choices": {"chambers_per_set": Range(1, 3)}}, "expected a list"),
        ({"choices": {"chambers_per_set": [1.5]}}, "whole number"),
        ({"choices": {"material": ["Ecoflex 00-50"]}}, "Material"),
        ({"choices": {"chamber_diameter": Range(2e-3, 1e-3)}}, "from < to"),
        ({"choices": {}}, "something to choose"),
        ({"minimise": "stretch"}, "one of maximise, minimise"),
        ({"maximise": "bending"}, "did you mean 'bending_angle'"),
        ({"maximise": "chamber_gap"}, "not optimised"),
        ({"requirements": {"force": at_least(1.0)}}, "did you mean 'blocked_force'"),
        ({"requirements": {"stretch": replace(at_least(2.0), upper=1.0)}}, "a largest one above it"),
        ({"pressure": -1.0}, "a pressure above 0"),
        ({"pressure": PressureSteps(2.0, 1.0)}, "step <= highest"),
        ({"pressure": PressureSteps(1e-4, 3e5)}, "at most 10000 steps of pressure, got 3e"),
        ({"sets": (0, 3)}, "sets of 0 to 2"),
        ({"starts": 0}, "at least 1"),
        ({"choices": {"chamber_diameter": Range("a", 2)}}, "expected 0 <= from < to, got 'a' to 2"),
        ({"choices": {"chamber_diameter": Range(1e-3, float("nan"))}}, "from < to"),
        ({"choices": ["length"]}, "choices: expected a table"),
        ({"requirements": {"stretch": 1.5}}, "requirements.stretch"),
        ({"requirements": {"stretch": at_least("2")}}, "requirements.stretch"),
        ({"maximise": 5}, "unknown output"),
        ({"pressure": Range(None, 1e5)}, "pressure: expected 0 <= from < to, got None to 100000.0"),
        ({"pressure": PressureSteps("a", 1e5)}, "step <= highest"),
        ({"pressure": "1"}, "a pressure above 0, a range or steps, got '1'"),
        ({"sets": ("0",)}, "sets of 0 to 2, got ['0']"),
        ({"sets": (0.5,)}, "sets of 0 to 2"),
        ({"sets": 0}, "sets of 0 to 2, got 0"),
        ({"starts": "2"}, "at least 1, got 2"),
        ({"allow": ("chambers_inside_wall",)}, "expected rules"),
    ],
)
def test_a_task_that_cannot_be_meant_is_refused(changes: dict[str, Any], named: str) -> None:
    task = angle_task(("chamber_diameter",), **changes)
    with pytest.raises(InputError, match=re.escape(named)) as caught:
        design(D25, SOFT, task)
    assert str(caught.value).isprintable()


# --- scenarios and the command line -----------------------------------------------------------------------------------


@cache
def paper() -> Design:
    return run_design(load_scenario(FOLDER / "laparoscope_paper.toml"))


@pytest.mark.thorough
def test_the_papers_case_chooses_what_the_paper_chose() -> None:
    done = paper()
    assert done.best is not None
    assert (done.best.material.name, done.best.robot.chambers) == ("Dragon Skin 10", 9)
    assert len(done.candidates) == 15
    for candidate in done.feasible:
        assert candidate.outputs["bending_angle"] >= 100 * DEGREE


def test_the_papers_case_has_the_published_angles() -> None:
    """Published simulations of the laparoscope with 6 chambers (model section 6)."""
    published = {
        "Ecoflex 00-10": (0.6, 111.6),
        "Ecoflex 00-20": (0.8, 111.7),
        "Ecoflex 00-30": (1.2, 113.4),
        "Ecoflex 00-50": (1.8, 108.5),
        "Dragon Skin 10": (3.0, 62.5),
    }
    for candidate in paper().candidates:
        if candidate.robot.chambers == 6:
            pressure, angle = published[candidate.material.name]
            assert candidate.outputs["pressure"] / BAR == pytest.approx(pressure)
            assert candidate.outputs["bending_angle"] / DEGREE == pytest.approx(angle, abs=0.15)
            assert candidate.is_feasible == (angle >= 100)


@pytest.mark.slow
def test_a_free_pressure_pushes_harder_than_the_lowest(tmp_path: Path) -> None:
    """The shipped scenario with its winner alone, which the paper's question would have left at 0.14 N."""
    text = (FOLDER / "laparoscope_free_pressure.toml").read_text()
    asked = tmp_path / "free.toml"
    asked.write_text(
        text.replace('"Dragon Skin 10", "Ecoflex 00-50", "Ecoflex 00-30", "Ecoflex 00-20", "Ecoflex 00-10"]',
                     '"Ecoflex 00-50"]').replace("[1, 2, 3]", "[3]") + "starts = 1\n"
    )  # fmt: skip
    best = run_design(load_scenario(asked)).best
    assert best is not None
    (lowest,) = (c for c in paper().candidates if c.material.name == "Ecoflex 00-50" and c.robot.chambers == 9)
    assert best.objective > 2 * lowest.objective
    assert best.objective > paper().best.objective  # type: ignore[union-attr]
    assert best.outputs["stretch"] <= 1.5
    # The program would go on behind the fold of the blocked shape; along the branch the force rises up to there.
    assert [active.name for active in best.active] == ["fold of the blocked shape"]
    solver = BlockedSolver(Model(best.robot, best.material), Numerics(accuracy=1e-4), ContactSettings())
    P = best.outputs["pressure"] * np.array([1.0, 0.0, 0.0])
    wall = standing_wall(solver.poses, solver.contact, P[None, :], Loads())
    below = solver.solve(0.95 * P, Loads(), wall)[0].contact
    beyond = solver.solve(1.05 * P, Loads(), wall)[0].contact
    assert below is not None
    assert 0 < below.force < best.objective
    assert beyond is None or beyond.force < best.objective


def test_the_command_leaves_results_and_a_scenario_of_the_best(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with chdir(tmp_path):
        asked = Path("D25L60_dimensions.toml")
        asked.write_text((FOLDER / asked).read_text() + "starts = 1\n")
        assert main(["design", str(asked)]) == 0
        folder = Path("results") / "D25L60_dimensions"
        names = {"best.toml", "design.json", "figure.png", "scenario.toml", "table.csv", "versions.json"}
        assert {path.name for path in folder.iterdir()} == names
        printed = capsys.readouterr().out
        assert "held back by" in printed
        document = json.loads((folder / "design.json").read_text())
        best = document["best"]
        assert best["status"] == "feasible"
        assert best["outputs"]["blocked_force_N"] >= 1.0
        assert best["choices"]["robot.chamber_diameter_mm"] == pytest.approx(best["outputs"]["chamber_diameter_mm"])
        assert document["candidates"][0]["choices"] == best["choices"]
        assert all(active["gain_per_unit"] is None or active["gain_per_unit"] > 0 for active in best["active"])
        assert (folder / "figure.png").stat().st_size > 10_000
        assert tomllib.loads((folder / "best.toml").read_text())["study"] == "blocked-force"
        assert main(["run", str(folder / "best.toml"), "--json"]) == 0
        step = json.loads(capsys.readouterr().out)["steps"][-1]
        assert step["blocked_force_N"] == pytest.approx(best["outputs"]["blocked_force_N"], rel=1e-6)
        assert step["free_bending_angle_deg"] == pytest.approx(best["outputs"]["bending_angle_deg"], rel=1e-6)


SMALL = """study = "design"
robot = { name = "D25L60" }
material = { name = "Ecoflex 00-50", model = "yeoh" }
choices.material.name = ["Ecoflex 00-50", "Ecoflex 00-30"]
actuation = { sets = [1], pressure_bar = 0.5 }
objective = { maximise = "bending_angle_deg" }
"""


def test_run_runs_a_design_and_json_is_alone_on_the_output(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "small.toml"
    path.write_text(SMALL)
    with chdir(tmp_path):
        assert main(["run", str(path), "--json"]) == 0
        document = json.loads(capsys.readouterr().out)
        assert not Path("results").exists()
    assert document["study"] == "design"
    assert document["best"]["choices"] == {"material.name": "Ecoflex 00-30", "material.model": "yeoh"}
    assert [c["number"] for c in document["candidates"]] == [1, 2]


def test_nothing_feasible_is_status_3_with_the_reasons(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "small.toml"
    path.write_text(SMALL + "requirements.bending_angle_deg = { at_least = 300 }\n")
    assert main(["design", str(path), "--out", str(tmp_path / "out")]) == 3
    assert "no candidate is feasible" in capsys.readouterr().out
    document = json.loads((tmp_path / "out" / "design.json").read_text())
    assert document["best"] is None
    assert all("bending_angle_deg" in c["reasons"][0] for c in document["candidates"])
    assert not (tmp_path / "out" / "best.toml").exists()
    assert (tmp_path / "out" / "figure.png").stat().st_size > 10_000


BROKEN = {
    "unknown silicone": ('"Ecoflex 00-30"]', '"Ecoflex 0030"]', ["[choices]", "material.name", "'Ecoflex 00-30'"]),
    "unknown model": ('material.name = ["Ecoflex 00-50", "Ecoflex 00-30"]', 'material.model = ["yeo"]', ["yeoh"]),
    "unknown choice": ("choices.material.name", "choices.robot.lenght_mm", ["robot", "'length_mm'"]),
    "a range of counts": ("choices.material.name", "choices.robot.chamber_sets = { from = 1, to = 2 }\n#", ["a list"]),
    "a range back to front": (
        "choices.material.name",
        "choices.robot.length_mm = { from = 3, to = 2 }\n#",
        ["[choices] robot.length_mm", "from below to"],
    ),
    "half a range": ("choices.material.name", "choices.robot.length_mm = { to = 2 }\n#", ["the keys from and to"]),
    "an unknown robot": ("choices.material.name", 'choices.robot.name = ["D24L60"]\n#', ["'D25L60'"]),
    "nothing to choose": ("choices.material.name", "# ", ["[choices]", "something to choose"]),
    "a pressure in Pa": ("pressure_bar = 0.5", "pressure_bar = 50000", ["[actuation] pressure_bar", "at most 100 bar"]),
    "steps without an end": ("pressure_bar = 0.5", "pressure_bar = { step = 0.2 }", ["[actuation] pressure_bar"]),
    "no such set": ("sets = [1]", "sets = [4]", ["[actuation] sets"]),
    "an unknown objective": ('"bending_angle_deg"', '"bending_angle"', ["[objective] maximise", "'bending_angle_deg'"]),
    "two objectives": ("maximise =", 'minimise = "stretch", maximise =', ["[objective]", "one of"]),
    "an unknown requirement": ("objective =", "requirements.force_N.at_least = 1\nobjective =", ["'blocked_force_N'"]),
    "an empty requirement": ("objective =", "requirements.stretch = {}\nobjective =", ["[requirements] stretch"]),
    "a key of another study": ("objective =", 'contact.mode = "blocked"\nobjective =', ["[contact] mode"]),
    "a pressure table": ("objective =", "pressure.sequence_bar = [[0, 0, 0]]\nobjective =", ["[pressure]", "not used"]),
    "weighted with a range": (
        "objective = { maximise",
        'choices.robot.length_mm = { from = 30, to = 60 }\ncontact.closure = "weighted"\n'
        "requirements.blocked_force_N = { at_least = 1 }\nobjective = { maximise",
        ["[contact] closure"],
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_scenario_is_one_line(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    old, new, words = BROKEN[name]
    assert old in SMALL
    path = tmp_path / "broken.toml"
    path.write_text(SMALL.replace(old, new))
    with chdir(tmp_path):
        assert main(["design", str(path)]) == 2
        assert not Path("results").exists()
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert captured.err.startswith(f"softnlp: {path}: ")
    for word in words:
        assert word in captured.err


def test_what_holds_the_best_back_stands_beneath_the_bars_of_its_figure() -> None:
    found = design(D25, SOFT, angle_task(("chamber_diameter",), starts=1))
    figure = design_figure(found)
    figure.canvas.draw()
    assert found.best is not None
    lines = [text for text in figure.texts if text.get_text() in {"held back by", *held_back(found, found.best)}]
    assert len(lines) == 1 + len(found.best.active) > 1
    below = min(axes.get_tightbbox().y0 for axes in figure.axes[:1])
    boxes = [text.get_window_extent() for text in lines]
    assert max(box.y1 for box in boxes) < below
    assert min(box.y0 for box in boxes) > 0
    assert all(upper.y0 > lower.y1 for upper, lower in pairwise(boxes))


def test_every_key_of_a_design_is_documented() -> None:
    text = (FOLDER.parents[1] / "docs" / "design.md").read_text()
    tables = (RobotChoices, MaterialChoices, ActuationTable, RequirementsTable, ObjectiveTable, LimitsTable)
    for key in (key for table in tables for key in table.model_fields):
        assert f"`{key}`" in text or f"`robot.{key}`" in text or f"`material.{key}`" in text, key
    for table in ("choices", "actuation", "requirements", "objective", "contact"):
        assert f"`[{table}]`" in text


def test_the_python_of_the_document_runs() -> None:
    text = (FOLDER.parents[1] / "docs" / "design.md").read_text()
    (code,) = re.findall(r"```python\n(.*?)```", text, re.S)
    names: dict[str, Any] = {}
    exec(compile(code, "design.md", "exec"), names)
    best = names["found"].best
    assert best.is_feasible
    (printed,) = re.findall(r"bends ([\d.]+) deg at ([\d.]+) mm", text)
    assert best.outputs["bending_angle"] / DEGREE == pytest.approx(float(printed[0]), abs=0.06)
    assert best.choices["chamber_diameter"] / MILLIMETRE == pytest.approx(float(printed[1]), abs=0.006)


def test_the_toml_of_the_document_is_accepted() -> None:
    text = (FOLDER.parents[1] / "docs" / "design.md").read_text()
    for block in re.findall(r"```toml\n(.*?)```", text, re.S):
        assert scenario_from_text(block, "x.toml").task is not None
