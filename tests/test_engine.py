"""Who solves: Newton's method, IPOPT, or both; they agree, and IPOPT has the last word."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sweeps import QUICK, plan

from softnlp import (
    BAR,
    MILLIMETRE,
    Coefficients,
    ContactSettings,
    DesignTask,
    InputError,
    Loads,
    Measurements,
    Numerics,
    Range,
    Status,
    Step,
    at_most,
    blocked_force,
    constrained_pose,
    design,
    fit_tensile,
    forward,
    identify,
    inverse,
    load_scenario,
    material,
    pressure_for_force,
    robot,
    run_sweep,
    to_json,
)
from softnlp.batch.poses import Lane
from softnlp.cli import main
from softnlp.model.ipopt_options import IPOPT_OPTIONS
from softnlp.nlp import bounded
from softnlp.nlp.solver import Engine
from softnlp.scenario.read import scenario_from_text
from softnlp.studies import identify_nlp, tensile
from softnlp.sweep import audit as auditing
from softnlp.sweep.read import load_workspace

SCENARIOS = Path(__file__).parents[1] / "scenarios"
D25, ECOFLEX = robot("D25L60"), material("Ecoflex 00-50")
PRESSURES = np.array([[0.2, 0.05, 0.0], [0.4, 0.1, 0.0]]) * BAR
LOADED = Loads(tip_force=(0.03, 0.02, -0.01), gravity="hanging")
ENGINES = ("newton", "auto", "ipopt")
STUDIES: dict[str, Any] = {
    "forward": lambda n: forward(D25, ECOFLEX, PRESSURES, numerics=n).steps,
    "loaded": lambda n: forward(D25, ECOFLEX, PRESSURES, loads=LOADED, numerics=n).steps,
    "collocation": lambda n: (
        forward(D25, ECOFLEX, PRESSURES, loads=LOADED, numerics=replace(n, transcription="collocation")).steps
    ),
    **{
        closure: lambda n, closure=closure: (
            blocked_force(
                D25, ECOFLEX, PRESSURES[:, :] * [1, 0, 0], contact=ContactSettings(closure=closure), numerics=n
            ).steps
        )
        for closure in ("free", "compliant", "rigid", "weighted")
    },
    "constrained": lambda n: (constrained_pose(D25, ECOFLEX, PRESSURES[0], loads=LOADED, numerics=n),),
}


@pytest.mark.parametrize("study", STUDIES)
def test_the_engines_agree(study: str) -> None:
    runs: dict[Any, tuple[Step, ...]] = {engine: STUDIES[study](Numerics(engine=engine)) for engine in ENGINES}
    for engine, steps in runs.items():
        for step, reference in zip(steps, runs["newton"], strict=True):
            assert step.status is Status.SOLVED
            assert step.engine == engine
            assert step.pose is not None
            assert reference.pose is not None
            off = np.abs(step.pose.tip_position - reference.pose.tip_position).max()
            assert off <= 1e-9 * D25.length
            if step.contact is not None and reference.contact is not None:
                assert step.contact.force == pytest.approx(reference.contact.force, rel=1e-9, abs=1e-12)
            assert (step.ipopt is None) == (engine == "newton")
            if step.ipopt is not None:
                assert step.ipopt.status == "Solve_Succeeded"
                assert step.ipopt.multipliers < 1e-6  # nothing is minimised
    for step in runs["auto"]:
        assert step.ipopt is not None
        assert step.ipopt.iterations <= 1  # it starts at the solution


@pytest.mark.parametrize("engine", ENGINES)
def test_a_pressure_for_a_force_is_the_same(engine: Any) -> None:
    pressure, step = pressure_for_force(D25, ECOFLEX, [0], 0.2, numerics=Numerics(engine=engine))
    assert step.status is Status.SOLVED
    assert step.engine == engine
    assert step.contact is not None
    assert step.contact.force == pytest.approx(0.2, rel=1e-9)
    assert pressure[0] == pytest.approx(EXPECTED.setdefault("pressure", pressure[0]), rel=1e-9)


EXPECTED: dict[str, float] = {}


INVERSE: dict[str, dict[str, Any]] = {
    "position": {"positions": [(0.012, -0.004, 0.072)], "loads": LOADED},
    "position at a bound": {"positions": [(0.0, 0.018, 0.068)], "bounds": (0.0, BAR)},
    "direction": {"directions": [(0.3, 0.1, 0.9)]},
    "out of reach": {"positions": [(0.06, 0.03, 0.09)], "bounds": (0.0, 0.5 * BAR)},
    "both": {"positions": [(0.012, -0.004, 0.072)], "directions": [(0.3, 0.1, 0.9)]},
}


@pytest.mark.parametrize("target", INVERSE)
def test_ipopt_closes_the_program_of_a_target_and_searches_with_it(target: str) -> None:
    steps = [inverse(D25, ECOFLEX, **INVERSE[target], numerics=Numerics(engine=e)).steps[0] for e in ENGINES]
    for engine, step in zip(ENGINES, steps, strict=True):
        assert step.status is steps[0].status
        assert step.engine == engine
        assert step.pose is not None
        assert steps[0].pose is not None
        np.testing.assert_allclose(step.pose.tip_position, steps[0].pose.tip_position, atol=1e-7 * D25.length)
        np.testing.assert_allclose(step.pressure, steps[0].pressure, atol=1e-6 * BAR)
        assert (step.ipopt is None) == (engine == "newton")
    assert steps[1].ipopt is not None
    assert steps[1].ipopt.status == "Solve_Succeeded"
    assert steps[1].ipopt.iterations <= 5


def test_an_answer_that_ipopt_can_better_is_disputed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A search that stops too early leaves a point that is no minimum of the program."""
    monkeypatch.setattr(bounded, "_STEPS", 1)
    far = {"positions": [(0.06, 0.03, 0.09)], "bounds": (0.0, 1.5 * BAR)}
    found = [inverse(D25, ECOFLEX, **far, numerics=Numerics(engine=e)).steps[0] for e in ENGINES[:2]]  # type: ignore[arg-type]
    assert found[0].aimed is not None
    assert found[0].aimed.optimal is False
    assert found[1].status is Status.DISPUTED
    assert found[1].pose is None
    assert "mm by IPOPT (Solve_Succeeded)" in found[1].message


@pytest.mark.parametrize("moved", [True, False])
def test_what_ipopt_does_not_confirm_is_disputed(moved: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """IPOPT that ends elsewhere, or at no solution, leaves no numbers, and the message says both tips."""
    real = Engine.closed

    def elsewhere(self: Engine, solution: Any) -> Any:
        found = real(self, solution)
        return replace(found, x=found.x + 1e-3) if moved else replace(found, residual=1.0)

    monkeypatch.setattr(Engine, "closed", elsewhere)
    for run in (
        forward(D25, ECOFLEX, PRESSURES[:1], loads=LOADED),
        blocked_force(D25, ECOFLEX, PRESSURES[:1] * [1, 0, 0]),
    ):
        (step,) = run.steps
        assert step.status is Status.DISPUTED
        assert (step.pose, step.contact) == (None, None)
        assert "by Newton's method and at (" in step.message
        assert "mm by IPOPT (Solve_Succeeded)" in step.message
        assert run.failed == run.steps
        assert to_json(run)["steps"][0]["tip_position_mm"] is None


def test_options_reach_ipopt() -> None:
    few = forward(D25, ECOFLEX, PRESSURES[-1:], loads=LOADED, numerics=Numerics(engine="ipopt", ipopt={"max_iter": 0}))
    assert few.steps[0].status is Status.DIVERGED
    same = Numerics(ipopt={"print_level": 0, "max_iter": 5})
    assert same == Numerics(ipopt={"max_iter": 5, "print_level": 0})
    assert hash(same) == hash(Numerics(ipopt=same.ipopt))
    assert same.without_ipopt() == Numerics(engine="newton")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"engine": "newton", "ipopt": {"tol": 1e-9}}, "ipopt: not used with the engine 'newton'"),
        ({"ipopt": {"output_file": "x"}}, "output_file: this option of IPOPT cannot be set here: a scenario names no"),
        ({"ipopt": {"hsllib": "x.so"}}, "hsllib: this option of IPOPT cannot be set here: a scenario names no file"),
        ({"ipopt": {"max_itr": 3}}, "max_itr: this option of IPOPT cannot be set here: not known; did you mean"),
        ({"ipopt": {"max_iter": 3.5}}, "max_iter: expected a whole number from 0 to 100000, got 3.5"),
        ({"ipopt": {"tol": True}}, "tol: expected a number from 1e-14 to 1, got true"),
        ({"ipopt": {"linear_solver": "ma57"}}, 'linear_solver: expected "mumps", got'),
    ],
)
def test_options_that_cannot_be_are_refused(given: Any, words: str) -> None:
    with pytest.raises(InputError) as caught:
        Numerics(**given)
    assert words in str(caught.value)


def test_no_option_names_a_file_or_a_library() -> None:
    for name, option in IPOPT_OPTIONS.items():
        assert option.words or option.most > option.least, name
        assert not any(part in name for part in ("file", "lib", "dir")), name


HEAD = 'study = "{study}"\n[robot]\nname = "D25L60"\n[material]\nname = "Ecoflex 00-50"\nmodel = "mooney-rivlin"\n'
STEPS = "[pressure]\nsequence_bar = [[0.2, 0.0, 0.0]]\n"


def written(folder: Path, solver: str, study: str = "forward", rest: str = STEPS) -> Path:
    path = folder / "scenario.toml"
    path.write_text(HEAD.format(study=study) + rest + solver)
    return path


@pytest.mark.parametrize(
    ("solver", "words"),
    [
        ('[solver]\nengine = "ipopt2"', "[solver] engine: expected 'auto', 'ipopt' or 'newton', got 'ipopt2'"),
        ('[solver]\nengine = "newton"\nipopt = { tol = 1e-9 }', "[solver] ipopt: not used with the engine 'newton'"),
        ('[solver.ipopt]\noutput_file = "x"', "[solver] ipopt.output_file: unknown key"),
        ('[solver.ipopt]\nlinear_solver = "ma57"', '[solver] ipopt.linear_solver: expected "mumps"'),
    ],
)
def test_a_scenario_is_refused_on_one_line(
    solver: str, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["run", str(written(tmp_path, solver))]) == 2
    told = capsys.readouterr().err
    assert words in told
    assert told.count("\n") == 1


def test_a_scenario_chooses_the_engine_and_the_document_says_who_solved(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = written(tmp_path, '[solver]\nengine = "ipopt"\n[solver.ipopt]\nmax_iter = 50\nprint_level = 0\n')
    assert load_scenario(path).numerics == Numerics(engine="ipopt", ipopt={"max_iter": 50, "print_level": 0})
    assert main(["run", str(path), "--json"]) == 0
    (step,) = json.loads(capsys.readouterr().out)["steps"]
    assert (step["engine"], step["ipopt_status"]) == ("ipopt", "Solve_Succeeded")
    assert step["ipopt_iterations"] >= 0
    assert step["ipopt_multipliers"] == pytest.approx(0.0, abs=1e-6)
    assert main(["run", str(written(tmp_path, '[solver]\nengine = "newton"')), "--json"]) == 0
    (step,) = json.loads(capsys.readouterr().out)["steps"]
    assert step["engine"] == "newton"
    assert step["ipopt_status"] is step["ipopt_iterations"] is step["ipopt_multipliers"] is None


# --- sweeps ----------------------------------------------------------------------------------------------------------

GRID = "[workspace]\nlevels = 2\nto_bar = 0.5\n"


def test_a_sweep_is_audited_and_ipopt_sweeps_alike(tmp_path: Path) -> None:
    found = {}
    for engine in ENGINES:
        asked = load_scenario(written(tmp_path, f'[solver]\nengine = "{engine}"\n', "workspace", GRID))
        summary = run_sweep(asked, tmp_path / engine)
        assert summary.failed == 0
        assert summary.audit.audited == (1 if engine == "auto" else 0)
        assert summary.audit.largest <= 1e-6 * D25.length
        assert summary.audit.disputed == ()
        found[engine] = load_workspace(tmp_path / engine)
    for engine in ENGINES[1:]:
        np.testing.assert_allclose(found[engine].tip_position, found["newton"].tip_position, atol=1e-6 * D25.length)


def test_as_many_poses_are_audited_as_promised_however_they_are_cut_into_chunks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(auditing, "EVERY", 9)
    summary = run_sweep(plan("[workspace]\nlevels = 3\nto_bar = 1.2\n" + QUICK, chunk=4), tmp_path / "out")
    assert (summary.done, summary.failed) == (27, 0)
    assert summary.audit.audited == 3


def test_poses_that_ipopt_does_not_confirm_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    solve = auditing.Alone.solve

    def elsewhere(self: Any, *given: Any) -> Any:
        step, solved = solve(self, *given)
        assert step.pose is not None
        return replace(step, pose=replace(step.pose, tip_position=step.pose.tip_position + 1e-6)), solved

    monkeypatch.setattr(auditing.Alone, "solve", elsewhere)
    path = written(tmp_path, "", "workspace", GRID)
    assert main(["sweep", str(path), "--out", str(tmp_path / "out"), "--workers", "1"]) == 3
    told = capsys.readouterr().out
    assert "warning: IPOPT does not confirm the audited poses" in told
    assert "1 poses audited by IPOPT, whose tips are at most 0.0017 mm away" in told
    assert Lane.BATCH == 0


def test_a_sweep_that_is_stopped_in_its_audit_goes_on_from_its_journal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = load_scenario(written(tmp_path, "", "workspace", GRID))
    within: list[bool] = []
    really = auditing.audit
    monkeypatch.setattr("softnlp.sweep.run.audit", lambda *given: within.append(True) or really(*given))
    stopped = run_sweep(asked, tmp_path / "out", stop=lambda: bool(within))
    assert stopped.stopped
    assert stopped.done == stopped.poses == 8
    assert stopped.written == ()
    ended = run_sweep(asked, tmp_path / "out", resume=True)
    assert not ended.stopped
    assert ended.already == 8
    assert ended.audit.audited == 1
    assert load_workspace(tmp_path / "out").pressure.shape[0] == 8


def test_the_log_is_shown_on_standard_error(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, "")
    assert main(["run", str(path), "--json", "--ipopt-log"]) == 0
    told = capsys.readouterr()
    assert "This is Ipopt" in told.err or "Number of Iterations" in told.err
    assert json.loads(told.out)["steps"][0]["status"] == "solved"
    assert main(["run", str(written(tmp_path, '[solver]\nengine = "newton"')), "--ipopt-log"]) == 2
    assert "--ipopt-log: IPOPT takes no part" in capsys.readouterr().err


# --- searches of constants and of designs -----------------------------------------------------------------------------


PRESSED = ContactSettings(closure="compliant")


@cache
def measured() -> Measurements:
    """Return angles of two pressures that no constants meet, and a force."""
    P = BAR * np.array([[0.6, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])  # the last one is straight
    stiff = Coefficients(bending=4.0)
    run = forward(D25, ECOFLEX, P, coefficients=stiff)
    pressed = blocked_force(D25, ECOFLEX, P[:1], contact=PRESSED, coefficients=stiff)
    angles = [step.pose.bending_angle for step in run.steps if step.pose is not None]
    assert pressed.steps[0].contact is not None
    force = [1.03 * pressed.steps[0].contact.force, np.nan, np.nan]
    return Measurements(D25, P, bending_angle=[1.02 * angles[0], 0.99 * angles[1], 0.0], blocked_force=force)


@pytest.mark.parametrize("loads", [Loads(), Loads(gravity="hanging")], ids=["arcs", "loaded"])
def test_identified_constants_are_those_of_the_whole_program(loads: Loads) -> None:
    found = {
        e: identify(
            measured(), ECOFLEX, ["k_b", "k_c"], loads=loads, contact=PRESSED, numerics=Numerics(intervals=3, engine=e)
        )  # type: ignore[arg-type]
        for e in ENGINES
    }
    for engine, result in found.items():
        assert (result.status, result.engine) == (Status.SOLVED, engine)
        off = np.abs(result.constants - found["newton"].constants)
        assert np.all(off <= 1e-3 * found["newton"].uncertainty.standard_errors)
        assert (result.ipopt is None) == (engine == "newton")
    assert found["auto"].ipopt is not None
    assert found["auto"].ipopt.status == "Solve_Succeeded"
    assert found["auto"].ipopt.iterations <= 6


def test_constants_that_ipopt_can_better_are_disputed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(identify_nlp, "_OF_ERROR", 0.0)
    real = Engine.closed

    def elsewhere(self: Engine, *given: Any, **more: Any) -> Any:
        found = real(self, *given, **more)
        return replace(found, x=found.x + (1e-3 if self.problem.free else 0.0))

    monkeypatch.setattr(Engine, "closed", elsewhere)
    result = identify(measured(), ECOFLEX, ["k_b", "k_c"], contact=PRESSED, numerics=Numerics(intervals=3))
    assert result.status is Status.DISPUTED
    assert np.all(np.isnan(result.constants))
    assert "k_b = " in result.message
    assert "IPOPT k_b = " in result.message


def test_more_rods_than_ipopt_takes_are_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(identify_nlp, "MOST_RODS", 0)
    result = identify(measured(), ECOFLEX, ["k_b", "k_c"], contact=PRESSED, numerics=Numerics(intervals=3))
    assert (result.status, result.engine, result.ipopt) == (Status.SOLVED, "auto", None)
    assert "IPOPT did not close the constants: 1 rods would be" in result.warnings[-1]


@pytest.mark.parametrize("law", ["mooney-rivlin", "ogden"])
def test_a_law_s_constants_are_closed(law: str, monkeypatch: pytest.MonkeyPatch) -> None:
    stretch = np.linspace(1.05, 2.5, 12)
    stress = np.asarray(ECOFLEX.engineering_stress(stretch)) * (1 + 0.02 * np.sin(7 * stretch))
    found = [fit_tensile(stretch, stress, law, numerics=Numerics(engine=e)).fits[law] for e in ENGINES]  # type: ignore[arg-type]
    assert [fit.status for fit in found] == ["solved"] * 3
    assert [fit.engine for fit in found] == list(ENGINES)
    assert found[0].ipopt is None
    assert all(fit.ipopt is not None and fit.ipopt.status == "Solve_Succeeded" for fit in found[1:])
    near, real = tensile.nearest_constants, tensile.confirmed_constants
    monkeypatch.setattr(tensile, "nearest_constants", lambda *given: 1.01 * near(*given))
    fit = fit_tensile(stretch, stress, law).fits[law]
    assert fit.status == "disputed"
    assert fit.material is None
    assert "the sum of squares falls to 0." in fit.problem
    assert fit_tensile(stretch, stress, law, numerics=Numerics(engine="newton")).fits[law].status == "solved"
    assert real is tensile.confirmed_constants


def test_a_design_s_candidates_are_closed() -> None:
    sizes = {"chamber_diameter": Range(4.0 * MILLIMETRE, 5.0 * MILLIMETRE)}
    task = DesignTask(sizes, 0.8 * BAR, requirements={"stretch": at_most(1.2)}, maximise="blocked_force")
    best = {e: design(D25, ECOFLEX, task, numerics=Numerics(engine=e)).best for e in ENGINES}  # type: ignore[arg-type]
    for engine, candidate in best.items():
        assert candidate is not None
        assert candidate.step is not None
        assert candidate.step.engine == engine
        assert (candidate.step.ipopt is None) == (engine == "newton")
        assert best["newton"] is not None
        assert candidate.objective == pytest.approx(best["newton"].objective, rel=1e-6)


@pytest.mark.parametrize("name", ["identify/tensile", "design/D25L60_dimensions"])
def test_these_studies_take_the_engine_from_a_scenario(name: str) -> None:
    path = SCENARIOS / f"{name}.toml"
    text = path.read_text().split("[solver]")[0] + '\n[solver]\nengine = "ipopt"\n'
    assert scenario_from_text(text, path).numerics.engine == "ipopt"
