"""Candidates that cannot be made, solved or optimised: what is said of them, and what still is found."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
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
    function_law,
    material,
    robot,
)
from softnlp.base.status import Status
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.materials import Material
from softnlp.model.quantities import Model
from softnlp.nlp.search import in_steps
from softnlp.nlp.solver import Engine
from softnlp.studies import design_optimise, design_problem
from softnlp.studies.design import searched
from softnlp.studies.design_candidate import Candidate, CandidateEvaluator
from softnlp.studies.design_evaluate import Evaluation, Evaluator, chamber_gaps, unmet
from softnlp.studies.design_optimise import Optimiser
from softnlp.studies.design_problem import Optimum
from softnlp.studies.design_task import Setting

D25, SOFT = robot("D25L60"), material("Ecoflex 00-50")
OGDEN = material("Ecoflex 00-50", "ogden")  # its modulus loses its sign
MODEL = Model(D25, SOFT)
WIDTH = Range(4.0 * MILLIMETRE, 5.0 * MILLIMETRE)
STRETCHED = {"stretch": at_most(1.2), "outer_wall": at_least(1.2 * MILLIMETRE)}
TOO_MUCH = 100 * BAR  # beyond the end of its branch


def bending(pressure: Any, **changes: Any) -> DesignTask:
    """Return the task of bending most with the chambers' diameter free."""
    task = DesignTask({"chamber_diameter": WIDTH}, pressure, requirements=STRETCHED, maximise="bending_angle", starts=2)
    return replace(task, **changes)


def the_only(task: DesignTask, rubber: Material = SOFT, **more: Any) -> Candidate:
    (candidate,) = design(D25, rubber, task, **more).candidates
    return candidate


def numbers(pressure: Any, **changes: Any) -> DesignTask:
    return bending(pressure, choices={"length": [D25.length]}, **changes)


# --- numbers at a pressure -------------------------------------------------------------------------------------------


def test_a_pressure_without_equilibrium_is_the_candidates_reason() -> None:
    found = the_only(numbers(TOO_MUCH), OGDEN)
    assert found.status == "infeasible"
    assert not found.outputs
    assert np.isnan(found.objective)
    last = re.search(r"the last pressure with an equilibrium is ([\d.]+)", found.reasons[0])
    assert last
    assert found.reasons[0].startswith(Status.UNSTABLE_MATERIAL.value)
    evaluator = Evaluator(Setting(D25, OGDEN), numbers(BAR), Model(D25, OGDEN))
    assert evaluator.free(Model(D25, OGDEN), float(last.group(1)) * BAR).status is Status.SOLVED


def test_steps_end_where_the_branch_ends_and_say_where() -> None:
    wanted = {"bending_angle": at_least(4000 * DEGREE)}
    found = the_only(numbers(PressureSteps(5 * BAR, TOO_MUCH), requirements=wanted), OGDEN)
    assert found.status == "infeasible"
    where = re.search(r"no step of the pressure meets everything; nearest is bending_angle_deg.*; from ([\d.]+) bar "
                      rf"{Status.UNSTABLE_MATERIAL.value}", found.reasons[0])  # fmt: skip
    assert where
    ended = float(where.group(1)) * BAR
    assert found.choices["pressure"] == pytest.approx(ended - 5 * BAR)  # nearest of those that bend ever more
    last = re.search(r"the last pressure with an equilibrium is ([\d.]+)", found.reasons[0])
    assert last
    assert ended - 5 * BAR <= float(last.group(1)) * BAR < ended


def test_no_step_at_all_is_said() -> None:
    found = the_only(numbers(PressureSteps(TOO_MUCH, TOO_MUCH)), OGDEN)
    assert found.status == "infeasible"
    assert found.reasons[0].startswith("no step of the pressure has a solution; from 100 bar unstable_material")
    assert "pressure" not in found.choices


def test_the_nearest_step_is_not_the_last_one() -> None:
    """A stretch that has to lie between two steps is missed least by one of them."""
    stretch = Evaluator(Setting(D25, SOFT), numbers(BAR), MODEL).free(MODEL, BAR).outputs["stretch"]
    wanted = {"stretch": replace(at_least(stretch + 1e-3), upper=stretch + 2e-3)}
    found = the_only(numbers(PressureSteps(0.5 * BAR, 1.5 * BAR), requirements=wanted))
    assert found.status == "infeasible"
    assert found.choices["pressure"] == pytest.approx(BAR)
    assert found.outputs["stretch"] == pytest.approx(stretch, rel=1e-9)


def test_a_step_whose_blocked_shape_is_lost_or_pushes_too_little_is_passed_by(monkeypatch: pytest.MonkeyPatch) -> None:
    """The free shape of each of three steps is as asked: one is lost at the wall, one pushes too little."""
    forces = {0.5: 0.2, 1.0: None, 1.5: 0.9}

    def full(self: Evaluator, model: Model, pressure: float) -> Evaluation:
        force = forces[round(pressure / BAR, 6)]
        free = self.free(model, pressure)
        if force is None:
            return replace(free, status=Status.FOLD, message="turned", outputs={})
        return replace(free, outputs={**free.outputs, "blocked_force": force})

    monkeypatch.setattr(Evaluator, "full", full)
    steps = PressureSteps(0.5 * BAR, 1.5 * BAR)
    wanted = {"blocked_force": at_least(0.8), "stretch": at_most(2.0)}
    found = the_only(numbers(steps, requirements=wanted))
    assert found.status == "feasible"
    assert found.choices["pressure"] == 1.5 * BAR
    missed = the_only(numbers(steps, requirements=wanted | {"blocked_force": at_least(1.0)}))
    assert missed.status == "infeasible"
    assert missed.choices["pressure"] == 1.5 * BAR
    assert missed.reasons == (
        "no step of the pressure meets everything; nearest is blocked_force_N: 0.9 N, at least 1 N wanted; at 1 bar "
        f"{Status.FOLD.value}: turned",
    )


def test_a_blocked_shape_that_cannot_be_begun_has_the_reason_of_the_free_one() -> None:
    found = the_only(numbers(TOO_MUCH, maximise="blocked_force"), OGDEN)
    assert found.status == "infeasible"
    assert not found.outputs
    assert found.reasons[0].startswith(f"{Status.UNSTABLE_MATERIAL.value}: ")
    assert found.step is not None
    assert found.step.contact is None


@pytest.mark.thorough
def test_a_free_shape_that_buckles_is_not_feasible() -> None:
    """A straight robot well beyond its Euler load pi^2 EI / (4 L^2)."""
    squeezed = Loads(tip_force=(0.0, 0.0, -3.0))
    task = numbers(0.1 * BAR, sets=(0, 1, 2), requirements={})
    found = the_only(task, loads=squeezed)
    assert found.step is not None
    assert found.step.pose is not None
    assert not found.step.pose.stable
    assert found.status == "infeasible"
    assert found.reasons == ("the free shape is not stable: it buckles under its load",)
    assert the_only(task).status == "feasible"
    undefined = the_only(task, loads=replace(squeezed, tip_moment=(0.0, 0.0, 1e-6)))
    assert undefined.status == "feasible"
    assert any("stability is undefined" in warning for warning in undefined.warnings)


@pytest.mark.parametrize(
    ("sets", "per_set", "angle"), [(1, 2, 1.1), (1, 1, 0.0), (3, 1, 0.0), (3, 2, 0.7), (1, 3, 1.0)]
)
def test_gaps_are_those_between_the_chambers_as_they_stand(sets: int, per_set: int, angle: float) -> None:
    """Every neighbour's distance from where it stands on the circle; a set of two is two chambers on one side."""
    made = replace(D25, chamber_sets=sets, chambers_per_set=per_set, chamber_angle=angle)
    stretch = 1.3
    at = np.concatenate([2 * np.pi * k / sets + angle * np.arange(per_set) for k in range(sets)])
    centres = made.chamber_circle_radius / np.sqrt(stretch) * np.exp(1j * at)
    apart = np.abs(centres[:, None] - centres)[np.triu_indices(at.size, 1)] - 2 * made.chamber_radius
    gaps = [float(gap) for gap in chamber_gaps(made, stretch)]
    assert bool(gaps) == (at.size > 1)
    if gaps:
        assert min(gaps) == pytest.approx(apart.min(), rel=1e-12)


# --- the program -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("pressure", [TOO_MUCH, Range(100 * TOO_MUCH, 200 * TOO_MUCH)])
def test_without_an_equilibrium_anywhere_there_is_no_start(pressure: Any) -> None:
    found = the_only(bending(pressure), OGDEN)
    assert found.status == "infeasible"
    assert found.reasons == ("no start has an equilibrium",)
    assert not found.outputs


def test_a_requirement_missed_at_every_pressure_is_found_without_a_program(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Optimiser, "best", lambda *_: pytest.fail("optimised"))
    wanted = {"bending_angle": at_least(400 * DEGREE)}
    task = DesignTask({}, Range(0.0, 1.0 * BAR), requirements=wanted, minimise="pressure")
    found = the_only(task)
    assert found.status == "infeasible"
    assert found.reasons[0].startswith("no pressure meets everything; nearest is bending_angle_deg: ")
    assert found.choices["pressure"] == BAR  # where it bends most
    nowhere = CandidateEvaluator(Setting(D25, OGDEN), replace(task, pressure=Range(99 * TOO_MUCH, 100 * TOO_MUCH)))
    monkeypatch.undo()
    assert nowhere.candidate(1, {}).reasons == ("no start has an equilibrium",)


def test_dimensions_are_optimised_at_the_lowest_step_that_meets_everything() -> None:
    wanted = {"bending_angle": at_least(60 * DEGREE)}
    by_steps = bending(PressureSteps(0.5 * BAR, 1.0 * BAR), requirements=wanted, starts=1)
    found = the_only(by_steps)
    lost = the_only(replace(by_steps, pressure=PressureSteps(0.5 * BAR, 0.5 * BAR)))
    assert (lost.status, found.status) == ("infeasible", "feasible")
    assert lost.choices["pressure"] == 0.5 * BAR
    assert found.choices["pressure"] == BAR
    assert found.outputs["bending_angle"] >= 60 * DEGREE > lost.outputs["bending_angle"]


def test_sets_that_interleave_are_not_optimised() -> None:
    apart = replace(D25, chamber_angle=150 * DEGREE)
    setting = Setting(apart, SOFT)
    found = CandidateEvaluator(setting, bending(BAR)).candidate(1, {})
    assert found.status == "infeasible"
    assert found.reasons == ("sets that interleave cannot be optimised; choose a smaller chamber_angle",)


@pytest.mark.parametrize("rule", ["wall_thickness", "chamber_overlap"])
def test_a_rule_that_is_allowed_to_be_broken_does_not_hold_the_program_back(rule: str) -> None:
    """Between chambers that bend ever more the thinner wall, or the smaller gap, is the limit unless it is lowered."""
    wide = {
        "wall_thickness": bending(0.5 * BAR, requirements={}, starts=1, minimum_wall=1.3 * MILLIMETRE),
        "chamber_overlap": bending(0.5 * BAR, requirements={}, starts=1,
                                   choices={"chamber_angle": Range(20 * DEGREE, 50 * DEGREE)}),
    }[rule]  # fmt: skip
    kept, lowered = (the_only(replace(wide, allow=allow)) for allow in ((), (rule,)))
    assert kept.status == lowered.status == "feasible"
    rows = {rule} if rule == "chamber_overlap" else {"outer_wall", "inner_wall"}
    assert rows & {active.name for active in kept.active}
    assert not rows & {active.name for active in lowered.active}
    assert lowered.objective > kept.objective * 1.001


RING = Range(12 * MILLIMETRE, 22 * MILLIMETRE)  # Eq. (1) does not depend on it


def ring(**changes: Any) -> Candidate:
    """Return the robot that bends most with the circle of its chambers free."""
    return the_only(bending(0.5 * BAR, **{"choices": {"chamber_circle_diameter": RING}, "requirements": {}} | changes))


@pytest.mark.thorough
def test_a_search_leaves_a_wall_on_both_sides() -> None:
    """The farther out the chambers the more it bends, and the nearer to the lumen the less."""
    far, near = ring(starts=1), ring(starts=1, maximise=None, minimise="bending_angle")
    for found, side in ((far, "outer_wall"), (near, "inner_wall")):
        assert found.outputs[side] == pytest.approx(0.8 * MILLIMETRE, abs=1e-9)
        assert [active.name for active in found.active] == [side]
        assert found.optimal
    assert ring(starts=1, minimum_wall=0.3 * MILLIMETRE).outputs["outer_wall"] == pytest.approx(0.3 * MILLIMETRE)
    least = {"outer_wall": at_least(0.5 * MILLIMETRE)}  # what is asked stands in place of the rule
    assert ring(starts=1, requirements=least).outputs["outer_wall"] == pytest.approx(0.5 * MILLIMETRE)
    bare = ring(starts=1, allow=("wall_thickness",))
    assert bare.outputs["outer_wall"] == pytest.approx(0.0, abs=1e-9)
    assert bare.objective > far.objective


def test_a_wall_that_is_given_or_listed_is_judged_too() -> None:
    """Beside a circle of 19.4 mm the threads of D25L60 leave 0.05 mm; its bores leave the layer of 0.5 mm more."""
    listed = ring(choices={"chamber_circle_diameter": [19.4 * MILLIMETRE]})
    assert listed.reasons == (
        "wall_thickness: the outer wall beside the threads is 0.05 mm, 0.75 mm below minimum_wall_mm = 0.8 mm",
    )
    off = replace(D25, chamber_circle_diameter=19.4 * MILLIMETRE)
    (given,) = design(off, SOFT, numbers(0.5 * BAR, requirements={})).candidates
    assert given.reasons == (
        "wall_thickness: the outer wall beside the bores is 0.55 mm, 0.25 mm below minimum_wall_mm = 0.8 mm",
    )
    inner = replace(D25, chamber_circle_diameter=14.6 * MILLIMETRE)
    assert "inner wall" in design(inner, SOFT, numbers(0.5 * BAR, requirements={})).candidates[0].reasons[0]
    published = bending(0.5 * BAR, choices={"robot": [robot("D10L60")]}, requirements={})
    assert the_only(published).status == "feasible"  # 0.5 mm beside the threads, 1 mm beside the bores


@pytest.mark.parametrize("iterations", [3, 4])
def test_a_search_that_is_stopped_is_feasible_and_not_optimal(iterations: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(design_problem, "_ITERATIONS", iterations)
    found = ring(starts=1)
    assert found.status == "feasible"
    assert found.optimal is False
    assert found.warnings[0].startswith("feasible, not optimal: the KKT error is ")
    assert not found.active  # what holds it back is not known
    assert found.outputs["outer_wall"] >= 0.8 * MILLIMETRE


def optimiser() -> Optimiser:
    return Optimiser(Evaluator(Setting(D25, SOFT), bending(BAR), MODEL))


def test_the_slow_way_ends_at_the_same_optimum() -> None:
    """Also where the first step is held by how far a choice may move, and not by a limit of the task."""
    far = bending(BAR, choices={"chamber_diameter": Range(2.0 * MILLIMETRE, 5.0 * MILLIMETRE)})
    made = Optimiser(Evaluator(Setting(D25, SOFT), far, MODEL))
    for begin in (2.2, 4.4):
        start = made.evaluator.free(Model(replace(D25, chamber_diameter=begin * MILLIMETRE), SOFT), BAR)
        posed = made.problem(start, 15)
        (at_once,) = made.optima([start], 15)
        slow = posed.optimum(in_steps(posed.start(start), design_problem.HOLDS))
        assert at_once.solution.optimal
        assert slow.solution.optimal
        assert slow.objective == pytest.approx(at_once.objective, rel=1e-7)
        assert (slow.dimensions["chamber_diameter"] > 1.2 * begin * MILLIMETRE) == (begin < 3)


class Fails:
    """Stands in for IPOPT: raises, or stops at once next to where it began."""

    def __init__(self, word: str, *, raises: bool) -> None:
        self.word, self.raises = word, raises

    def __call__(self, x0: Any, p: Any, **limits: Any) -> dict[str, Any]:
        if self.raises:
            raise RuntimeError(f"of CasADi:\n{self.word}")
        zeros = np.zeros_like(limits["lbg"])
        return {"x": np.asarray(x0) + 1e-3 * np.eye(len(x0))[1], "f": -1.0, "lam_g": zeros, "lam_x": 0.0 * x0}

    def stats(self) -> dict[str, Any]:
        return {"iter_count": 3, "return_status": self.word}


@pytest.mark.parametrize(
    ("word", "raises", "reason"),
    [
        ("a number that is not finite", True, "the optimisation failed: a number that is not finite"),
        ("Maximum_Iterations_Exceeded", False, "the optimisation did not converge: Maximum_Iterations_Exceeded"),
    ],
)
def test_a_solver_that_gives_up_is_a_failed_candidate(
    word: str, raises: bool, reason: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every start meets what is asked, but no start was led anywhere: that is no answer."""
    monkeypatch.setattr(Engine, "_solver", Fails(word, raises=raises))
    found = the_only(bending(BAR), numerics=Numerics(engine="newton"))
    assert found.status == "failed"
    assert found.reasons == (reason,)
    assert not found.outputs
    assert found.starts == 2


def moved(scale: float | None) -> Any:
    """Return an `Evaluator.full` whose angle is off by a factor, or that loses the branch."""

    def full(self: Evaluator, model: Model, pressure: float) -> Evaluation:
        free = self.free(model, pressure)
        if scale is None:
            return replace(free, status=Status.FOLD, message="turned", outputs={})
        return replace(free, outputs={**free.outputs, "bending_angle": scale * free.outputs["bending_angle"]})

    return full


def test_an_optimum_that_is_not_on_the_branch_is_refused_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two starts lead to one optimum; it is solved again once."""
    calls: list[float] = []
    lost = moved(None)

    def full(self: Evaluator, model: Model, pressure: float) -> Evaluation:
        calls.append(model.robot.chamber_diameter)
        return lost(self, model, pressure)  # type: ignore[no-any-return]

    monkeypatch.setattr(Evaluator, "full", full)
    found = the_only(bending(BAR))
    assert len(calls) == 1
    assert found.reasons == ("the optimum found is not on the branch from zero pressure: turned",)
    assert found.status != "feasible"
    assert not found.outputs


def test_an_optimum_that_a_solve_does_not_confirm_is_refused_with_both_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Evaluator, "full", moved(0.9))
    found = the_only(bending(BAR))
    assert found.status == "infeasible"
    told = re.search(r"bending_angle_deg is ([\d.]+) there and ([\d.]+) on the branch", found.reasons[0])
    assert told
    assert float(told.group(2)) == pytest.approx(0.9 * float(told.group(1)), rel=1e-4)
    assert float(told.group(2)) == pytest.approx(found.objective / DEGREE, rel=1e-4)


@pytest.mark.parametrize("fails", [False, True])
def test_a_small_difference_is_looked_at_on_finer_grids(fails: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """A solve off by a part between a tenth of what may differ and that is believed, on the finest grid solved."""
    off = 1 + 0.5 * design_optimise.AGREES
    monkeypatch.setattr(Evaluator, "full", moved(off))
    made = optimiser()
    start = made.evaluator.free(MODEL, BAR)
    intervals = made._intervals(start)
    tried: list[int] = []
    optima = Optimiser.optima

    def watched(self: Optimiser, begun: Sequence[Evaluation], size: int) -> list[Optimum]:
        tried.append(size)
        found = optima(self, begun, size)
        lost = fails and size > intervals
        return [replace(o, solution=replace(o.solution, residual=np.inf)) if lost else o for o in found]

    monkeypatch.setattr(Optimiser, "optima", watched)
    found = made.best(MODEL, BAR)
    assert found.reasons == ()
    assert found.agreeing == found.starts == 2
    finer = [size for size in tried if size > intervals]
    assert finer[0] == 2 * intervals
    assert found.intervals == (intervals if fails else finer[-1])
    assert len(finer) == 1 if fails else 2 * finer[-1] > design_optimise._FINEST


def test_the_first_guess_of_a_shape_that_only_touches_is_the_arc() -> None:
    """At zero pressure the straight robot touches the wall: its blocked states are those of the straight rod."""
    task = bending(Range(0.0, BAR), maximise="blocked_force")
    made = Optimiser(Evaluator(Setting(D25, SOFT), task, MODEL))
    begun = made.evaluator.full(MODEL, 0.0)
    assert begun.blocked is None
    assert begun.outputs["blocked_force"] == 0.0
    posed = made.problem(begun, 15)
    blocked = posed.cases[-1]
    size, s = blocked.functions.state_size, blocked.transcribed.points
    guess = posed.start(begun).x[-sum(symbol.numel() for symbol in blocked.symbols) :]
    states = guess[1 : 1 + size * s.size].reshape(s.size, size)
    assert guess[0] == 1.0
    np.testing.assert_allclose(states[:, :3], np.outer(s, [0, 0, 1]), atol=1e-14)
    np.testing.assert_array_equal(guess[1 + size * s.size :], 0.0)


# --- the search ------------------------------------------------------------------------------------------------------


class Told:
    """Stands in for optuna, asks for what it is given in turn, and keeps what it is told."""

    def __init__(self, places: list[int]) -> None:
        self.places, self.values = iter(places), list[float]()

    def ask(self) -> Told:
        return self

    def suggest_categorical(self, name: str, options: list[int]) -> int:
        place = next(self.places)
        assert place in options
        return place

    def tell(self, trial: Told, value: float) -> None:
        self.values.append(value)


@pytest.mark.parametrize("sign", [1, -1])
def test_what_is_not_feasible_is_worse_for_a_search_than_all_before(sign: int, monkeypatch: pytest.MonkeyPatch) -> None:
    optuna = pytest.importorskip("optuna")
    told = Told([2, 0, 1, 0])
    monkeypatch.setattr(optuna, "create_study", lambda **_: told)
    widths = [3.0 * MILLIMETRE, 4.0 * MILLIMETRE, 7.5 * MILLIMETRE]  # the last does not fit into the wall
    asked = {"maximise": "bending_angle"} if sign > 0 else {"maximise": None, "minimise": "bending_angle"}
    task = bending(BAR, choices={"chamber_diameter": widths}, requirements={}, trials=4, **asked)
    found: Iterator[Candidate] = searched(CandidateEvaluator(Setting(D25, SOFT), task))
    statuses = [c.status for c in found]
    assert statuses == ["infeasible", "feasible", "feasible"]  # the fourth was met before
    assert told.values[3] == told.values[1]
    assert all(sign * told.values[0] < sign * value for value in told.values[1:]) == (sign > 0)
    assert sign * told.values[0] == -1.0


# --- tasks that cannot be meant --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"requirements": {"chamber_gap": at_most(1e-3)}}, "requirements.chamber_gap: expected a least value only"),
        ({"choices": {"material": SOFT}}, "choices.material: expected a list of values"),
        ({"choices": {"length": "60"}}, "choices.length: expected a list or a range"),
        ({"choices": {"length": []}}, "choices.length: expected a list or a range"),
        ({"allow": ("wall_thickness", "sharp")}, "allow: expected rules of"),
    ],
)
def test_a_task_that_cannot_be_meant_names_its_key(changes: dict[str, Any], named: str) -> None:
    with pytest.raises(InputError, match=named):
        design(D25, SOFT, bending(BAR, **changes))


def test_a_missing_solution_is_unmet_by_its_status() -> None:
    found = Evaluation(MODEL, BAR, Status.DIVERGED, "lost", {})
    assert unmet(found, bending(BAR)) == [f"{Status.DIVERGED.value}: lost"]


def test_a_shape_through_itself_is_not_feasible_unless_it_is_allowed() -> None:
    long = replace(robot("D10L60"), length=0.15)
    task = DesignTask({"length": [long.length]}, 1.4 * BAR, maximise="bending_angle")
    ((refused,), (accepted,)) = (
        design(long, SOFT, replace(task, allow=allow)).candidates for allow in ((), ("self_intersection",))
    )
    assert refused.status == "infeasible"
    assert any("self_intersection of the free shape: the body passes" in reason for reason in refused.reasons)
    assert accepted.is_feasible
    assert any("passes through itself" in words for words in accepted.warnings)


def test_the_largest_bend_of_an_arc_is_short_of_a_whole_turn() -> None:
    long = replace(robot("D10L60"), length=0.15)
    task = DesignTask({"length": [long.length]}, Range(0.1 * BAR, 1.5 * BAR), maximise="bending_angle", starts=1)
    (candidate,) = design(long, SOFT, task).candidates
    assert candidate.is_feasible
    assert candidate.objective == pytest.approx(0.999 * 2 * np.pi, rel=1e-6)
    assert [limit.name for limit in candidate.active] == ["self_intersection"]


def test_laws_of_one_name_are_told_apart() -> None:
    """What is compiled for the stress of one is of no use for the other."""

    def rubber(power: int) -> Material:
        law = function_law("mine", lambda stretch, c: c * (stretch - stretch**-power), ["c"])
        return Material("mine", law, {"c": 0.03})

    task = bending(0.3 * BAR, choices={"material": [rubber(2), rubber(3)]})
    soft, stiff = design(D25, SOFT, task).candidates
    assert soft.is_feasible
    assert stiff.is_feasible
    assert soft.objective > 1.2 * stiff.objective


def test_a_candidate_that_starts_behind_the_wall_says_so() -> None:
    wall = ContactSettings(wall_point=(0.0, 0.0, 0.065), wall_normal=(0.0, 0.0, -1.0))
    task = DesignTask({"length": [0.06, 0.07]}, 0.5 * BAR, maximise="blocked_force")
    short, long = design(D25, SOFT, task, contact=wall).candidates
    assert short.is_feasible
    assert not long.is_feasible
    assert any("starts 5 mm behind the wall" in reason for reason in long.reasons)
