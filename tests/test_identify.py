"""Identification from measurements: constants recovered, derivatives, two ways that agree, files, what is refused."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))  # benchmarks/ is not installed

from at_once import identify_at_once

from benchmarks.identify_data import TABLES
from benchmarks.identify_data import main as write_shipped_files
from softnlp import (
    BAR,
    Coefficients,
    InputError,
    Loads,
    Measurements,
    Numerics,
    Status,
    forward,
    identify,
    material,
    robot,
)
from softnlp.cli import main
from softnlp.figures import identified_figure
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.materials import Material
from softnlp.model.quantities import Model
from softnlp.model.robot import Robot
from softnlp.scenario.identify import run_robots
from softnlp.scenario.read import load_scenario, scenario_from_text
from softnlp.statics import loadcase
from softnlp.statics.blocked_grid import BlockedGrid
from softnlp.statics.kept import blocked_solver, pose_solver
from softnlp.statics.solver import PoseSolver
from softnlp.studies import predicted
from softnlp.studies.blocked_force import blocked_force
from softnlp.studies.fit_statistics import uncertainty
from softnlp.studies.identified import Identified
from softnlp.studies.identify_fit import Fit
from softnlp.studies.measurements import RobotTask, checked_measurements
from softnlp.studies.predicted import ArcPoses, BlockedForces, FreePoses, LoadedPoses, Prediction

ROOT = Path(__file__).parents[1]
SCENARIOS = ROOT / "scenarios" / "identify"
SILICONE = material("Ecoflex 00-50")
TRUE = Coefficients(elongation=0.6, bending=2.0, area=0.95, inertia=1.1, bore_fraction=0.2, chamber_reaction=1.1)
POSES = BAR * np.array(
    [[0.4, 0, 0], [0.8, 0, 0], [1.2, 0, 0], [0.6, 0.6, 0], [1.1, 0.7, 0], [0.5, 0.5, 0.5], [1, 1, 1]]
)
LOADED = Loads(tip_force=(0.0, 0.01, 0.0), gravity=(0.0, 0.0, 9.81))


def forward_poses(r: Robot, P: Any, coefficients: Coefficients, **options: Any) -> Measurements:
    """Return the poses that forward solves give, as if they had been measured."""
    poses = [step.pose for step in forward(r, SILICONE, P, coefficients=coefficients, **options).steps]
    assert all(pose is not None for pose in poses)
    return Measurements(
        r,
        P,
        tip_position=[pose.tip_position for pose in poses if pose],
        bending_angle=[pose.bending_angle for pose in poses if pose],
        elongation=[pose.backbone_length - r.length for pose in poses if pose],
    )


def closed_form(r: Robot) -> PoseSolver:
    return pose_solver(Model(r, SILICONE, TRUE), Numerics())


def seen(r: Robot, P: Any, bending: float = 2.0) -> Measurements:
    """Return the unloaded poses of the true constants in closed form, which a test below holds against the rod."""
    poses = closed_form(r).with_values({"stiffening.bending": bending})
    values = ArcPoses(poses, np.asarray(P), ()).evaluate({"stiffening.bending": bending}).values
    return Measurements(r, P, tip_position=values[:, :3], bending_angle=values[:, 3], elongation=values[:, 4])


def started(free: Sequence[str]) -> Coefficients:
    """Return the true coefficients with the free ones at their defaults."""
    fields = {"k_e": "elongation", "k_b": "bending", "k_a": "area", "k_i": "inertia", "phi": "bore_fraction"}
    fields["k_c"] = "chamber_reaction"
    return replace(TRUE, **{fields[n]: getattr(Coefficients(), fields[n]) for n in free if n in fields})


def true_values(found: Identified, silicone: Material = SILICONE) -> list[float]:
    values = {"k_e": 0.6, "k_b": 2.0, "k_a": 0.95, "k_i": 1.1, "phi": 0.2, "k_c": 1.1, **silicone.constants}
    return [values[name] for name in found.free.names]


@pytest.mark.parametrize("free", [("k_e", "k_b", "phi", "k_i"), ("k_a", "k_b"), ("C10", "C01", "C20", "k_b")])
def test_constants_come_back_from_poses_of_two_robots(free: tuple[str, ...]) -> None:
    start = replace(
        SILICONE, constants={**SILICONE.constants, **{n: 1.2 * SILICONE.constants[n] for n in free if n[0] == "C"}}
    )
    data = [seen(robot(name), POSES) for name in ("D25L60", "D15L40")]
    found = identify(data, start, free, coefficients=started(free))
    assert found.status is Status.SOLVED
    assert found.constants == pytest.approx(true_values(found), rel=1e-6)
    assert not found.at_bound
    assert all(m.mape < 1e-4 for m in found.errors().values())
    assert any(m.mape > 1 for m in found.errors(after=False).values())


def test_constants_come_back_from_loaded_poses() -> None:
    numerics = Numerics(intervals=40)
    data = forward_poses(robot("D15L60"), POSES[1:6:2], TRUE, loads=LOADED, numerics=numerics)
    found = identify(
        data,
        SILICONE,
        ["k_e", "k_b", "phi"],
        coefficients=started(["k_e", "k_b", "phi"]),
        loads=LOADED,
        numerics=numerics,
    )
    assert found.constants == pytest.approx(true_values(found), rel=1e-6)


def test_constants_come_back_from_forces_and_angles() -> None:
    P = BAR * np.array([[0, 0, 0], [0.5, 0, 0], [1.0, 0, 0]])
    r = robot("D25L60")
    contact = ContactSettings(tip_cap=0.005)
    forces = [s.contact.force for s in blocked_force(r, SILICONE, P, contact, coefficients=TRUE).steps if s.contact]
    data = replace(seen(r, P), blocked_force=forces, tip_position=None, elongation=None)
    found = identify(data, SILICONE, ["k_b", "k_c"], coefficients=started(["k_b", "k_c"]), contact=contact)
    assert found.constants == pytest.approx(true_values(found), rel=1e-6)


def test_the_closed_form_is_the_solution_of_the_rod() -> None:
    r = robot("D20L60")
    data = forward_poses(r, POSES, TRUE)
    values = ArcPoses(closed_form(r), POSES, ()).evaluate({}).values
    assert values[:, :3] == pytest.approx(np.array(data.tip_position), abs=1e-8 * r.length)
    assert values[:, 3] == pytest.approx(np.array(data.bending_angle), abs=2e-8)
    assert values[:, 4] == pytest.approx(np.array(data.elongation), abs=1e-8 * r.length)


NAMES = ("stiffening.elongation", "stiffening.bending", "corrections.bore_fraction", "material.C01")
AT = {"stiffening.elongation": 0.5, "stiffening.bending": 1.5, "corrections.bore_fraction": 0.3, "material.C01": 15e3}


@pytest.mark.parametrize("loaded", [False, True])
def test_derivatives_of_poses_are_those_of_differences(loaded: bool) -> None:
    numerics = Numerics(intervals=10)
    solver = pose_solver(Model(robot("D15L60"), SILICONE, TRUE), numerics)
    P = POSES[[1, 3, 5]]
    poses: FreePoses = LoadedPoses(solver, P, LOADED, NAMES) if loaded else ArcPoses(solver, P, NAMES)
    slopes = poses.evaluate(AT).slopes
    for k, name in enumerate(NAMES):
        h = 1e-4 * AT[name]
        high, low = (poses.evaluate({**AT, name: AT[name] + sign * h}).values for sign in (1, -1))
        slope = (high - low) / (2 * h)
        assert slopes[:, :, k] == pytest.approx(slope, abs=2e-6 * np.max(np.abs(slope)))


def test_derivatives_of_forces_are_those_of_differences() -> None:
    solver = blocked_solver(Model(robot("D25L60"), SILICONE, TRUE), Numerics(intervals=10), ContactSettings())
    P = BAR * np.array([[0.9, 0, 0]])
    names, at = (*NAMES[1:], "contact.chamber_reaction"), {**AT, "contact.chamber_reaction": 1.2}
    poses, forces = ArcPoses(solver.poses, P, names), BlockedForces(solver, P, Loads(), names)

    def force(values: dict[str, float]) -> tuple[float, Any]:
        free = poses.evaluate(values)
        found = forces.evaluate(values, free.values[:, 5:], free.slopes[:, 5:])
        assert not found.failures
        return float(found.values[0, 0]), found.slopes[0, 0]

    slopes = force(at)[1]
    for k, name in enumerate(names):
        h = 1e-4 * at[name]
        slope = (force({**at, name: at[name] + h})[0] - force({**at, name: at[name] - h})[0]) / (2 * h)
        assert slopes[k] == pytest.approx(slope, rel=1e-5)


FAR = {"stiffening.bending": 0.2}, {"stiffening.bending": 6.0}


def test_poses_that_jump_with_the_constants_are_followed_anew() -> None:
    """Newton from the pose at other constants is trusted nearby alone; where it jumps, all starts anew."""
    solver = pose_solver(Model(robot("D15L60"), SILICONE, TRUE), Numerics(intervals=10))
    P = POSES[[2, 1]]
    poses, fresh = (LoadedPoses(solver, P, LOADED, ("stiffening.bending",)) for _ in range(2))
    first = poses.evaluate(FAR[0])
    then, anew = poses.evaluate(FAR[1]), fresh.evaluate(FAR[1])
    assert not then.failures
    assert np.abs(then.values[0, :3] - first.values[0, :3]).max() > 0.3 * 0.06
    assert then.values == pytest.approx(anew.values, rel=1e-9, abs=1e-12)
    assert then.slopes == pytest.approx(anew.slopes, rel=1e-9, abs=1e-12)


def test_a_loaded_pose_that_is_lost_is_named_and_the_others_stand() -> None:
    soft = Model(robot("D25L60"), material("Ecoflex 00-20", "yeoh"), Coefficients(elongation=0.0))
    P = BAR * np.array([[0.1, 0, 0], [9.0, 9.0, 9.0], [0.2, 0, 0]])
    found = LoadedPoses(pose_solver(soft, Numerics(intervals=4)), P, LOADED, ("stiffening.bending",)).evaluate({})
    (failure,) = found.failures
    assert failure.row == 1
    assert failure.status in (Status.NO_EQUILIBRIUM, Status.UNSTABLE_MATERIAL)
    assert np.isnan(found.values[1]).all()
    assert np.isnan(found.slopes[1]).all()
    assert np.isfinite(found.values[[0, 2]]).all()


def test_a_straight_loaded_pose_gives_its_bending_angle_no_slope() -> None:
    """The angle has a kink there; it is 0 to both sides of every constant, and the elongation is not."""
    solver = pose_solver(Model(robot("D25L60"), SILICONE, TRUE), Numerics(intervals=4))
    hung = Loads(tip_force=(0.0, 0.0, 0.05))
    found = LoadedPoses(solver, POSES[-1:], hung, ("stiffening.elongation", "stiffening.bending")).evaluate({})
    assert found.values[0, 3] < 1e-8
    assert found.slopes[0, 3].tolist() == [0.0, 0.0]
    assert found.slopes[0, 4, 0] < 0


def test_roots_nearby_take_few_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Newton's steps are bounded in number; from constants nearby a few are as good as following the branch."""
    solver = pose_solver(Model(robot("D25L60"), SILICONE, TRUE), Numerics())
    poses = ArcPoses(solver, POSES, ("stiffening.elongation",))
    poses.evaluate({"stiffening.elongation": 0.6})
    expected = ArcPoses(solver, POSES, ("stiffening.elongation",)).evaluate({"stiffening.elongation": 0.62}).values
    monkeypatch.setattr(loadcase, "_NEWTON_STEPS", 3)
    near = poses.evaluate({"stiffening.elongation": 0.62}).values
    assert near == pytest.approx(expected, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("why", ["far", "beyond a fold"])
def test_forces_that_go_elsewhere_are_followed_anew(why: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Far from the known shape, or where the determinant that counts folds has changed its sign on the way."""
    solver = blocked_solver(Model(robot("D25L60"), SILICONE, TRUE), Numerics(intervals=6), ContactSettings())
    P, names = BAR * np.array([[1.2, 0, 0]]), ("stiffening.bending",)
    poses = ArcPoses(solver.poses, P, names)
    forces, fresh = (BlockedForces(solver, P, Loads(), names) for _ in range(2))

    def force(of: BlockedForces, bending: float) -> Prediction:
        free = poses.evaluate({"stiffening.bending": bending})
        return of.evaluate({"stiffening.bending": bending}, free.values[:, 5:], free.slopes[:, 5:])

    force(forces, 0.2)
    wanted = 6.0 if why == "far" else 0.25
    expected = force(fresh, wanted)
    followed: list[BlockedForces] = []
    follow, determinants = BlockedForces._follow, BlockedGrid.determinants

    def spied(self: BlockedForces, *arguments: Any) -> Any:
        followed.append(self)
        return follow(self, *arguments)

    def turned(self: BlockedGrid, solution: Any, plane: Any) -> Any:
        first, *others = determinants(self, solution, plane)
        moved = not followed and not np.allclose(solution.p, known.solution.p)
        return (-first if moved else first, *others)

    known = forces._known[0]
    monkeypatch.setattr(BlockedForces, "_follow", spied)
    if why == "beyond a fold":
        monkeypatch.setattr(BlockedGrid, "determinants", turned)
    else:  # a blocked shape moves little with the constants
        monkeypatch.setattr(predicted, "_LARGEST_JUMP", 1e-3)
    found = force(forces, wanted)
    assert followed == [forces]
    assert not found.failures
    assert found.values == pytest.approx(expected.values, rel=1e-6)
    assert found.slopes == pytest.approx(expected.slopes, rel=1e-5)


def test_a_force_beyond_a_fold_is_lost_and_the_one_before_it_stands() -> None:
    rigid = ContactSettings(closure="rigid")
    solver = blocked_solver(Model(robot("D20L60"), SILICONE), Numerics(intervals=6), rigid)
    P = BAR * np.array([[1.5, 0, 0], [0.6, 0, 0]])
    poses = ArcPoses(solver.poses, P, ("stiffening.bending",)).evaluate({})
    forces = BlockedForces(solver, P, Loads(), ("stiffening.bending",))
    found = forces.evaluate({}, poses.values[:, 5:], poses.slopes[:, 5:])
    (failure,) = found.failures
    assert (failure.row, failure.status) == (0, Status.FOLD)
    assert np.isnan(found.values[0]).all()
    assert np.isnan(found.slopes[0]).all()
    alone = blocked_force(robot("D20L60"), SILICONE, P[1:], rigid, numerics=Numerics(intervals=6)).steps[0].contact
    assert alone is not None
    assert found.values[1, 0] == pytest.approx(alone.force, rel=1e-6)


def test_a_search_that_is_stopped_says_that_it_is_not_at_a_minimum(monkeypatch: pytest.MonkeyPatch) -> None:
    data = seen(robot("D25L60"), POSES)
    free = ("k_e", "k_b")
    monkeypatch.setattr(sys.modules["softnlp.studies.identify_fit"], "_MOST_EVALUATIONS", 1)
    found = identify(data, SILICONE, free, coefficients=started(free))
    assert found.status is Status.NOT_OPTIMAL
    assert found.message.startswith("feasible, not optimal: the KKT error is ")
    monkeypatch.undo()
    assert identify(data, SILICONE, free, coefficients=started(free)).status is Status.SOLVED


@pytest.mark.slow
def test_one_nlp_of_all_poses_gives_the_same_constants() -> None:
    """On the same grid of a loaded robot both solve the same equations; the data have errors of some percent."""
    P = BAR * np.array([[1.0, 0, 0]])
    r, numerics = robot("D25L60"), Numerics(intervals=4)
    pose = forward_poses(r, P, TRUE, loads=LOADED, numerics=numerics)
    (step,) = blocked_force(r, SILICONE, P, coefficients=TRUE, loads=LOADED, numerics=numerics).steps
    assert step.contact is not None
    wrong = replace(
        pose,
        bending_angle=1.02 * np.array(pose.bending_angle),
        elongation=0.97 * np.array(pose.elongation),
        blocked_force=[1.03 * step.contact.force],
        tip_position=None,
    )
    options: dict[str, Any] = {"coefficients": started(["k_b", "k_c"]), "loads": LOADED}
    reduced = identify(wrong, SILICONE, ["k_b", "k_c"], numerics=numerics, **options)
    at_once = identify_at_once(wrong, SILICONE, ["k_b", "k_c"], intervals=4, **options)
    assert at_once.status is Status.SOLVED
    assert at_once.residual < 1e-8
    assert list(at_once.constants.values()) == pytest.approx(reduced.constants, rel=1e-6)
    left = [np.nansum(((v - d.values) / d.sigma) ** 2) / 2 for v, d in zip(reduced.after, reduced.data, strict=True)]
    assert at_once.cost == pytest.approx(sum(left), rel=1e-6)
    assert at_once.cost > 0.1


@pytest.mark.parametrize("grows", [False, True], ids=["equal noise", "noise that grows with the number"])
def test_two_sigma_intervals_hold_the_constants(grows: bool) -> None:
    """Of the linearised problem with the default sigmas; benchmarks/identify.py draws with the whole one."""
    r, names = robot("D25L60"), NAMES[:3]
    found = ArcPoses(closed_form(r), POSES, names).evaluate({})
    exact, J = found.values[:, 3:5], found.slopes[:, 3:5]
    data = checked_measurements(Measurements(r, POSES, bending_angle=exact[:, 0], elongation=exact[:, 1]))
    sigma = data.sigma[:, 3:5]
    size = np.abs(exact) if grows else np.sqrt(np.mean(exact**2, axis=0))
    random = np.random.default_rng(7)
    weighted = (J / sigma[:, :, None]).reshape(-1, len(names))
    inside = []
    for _ in range(400):
        y = (0.01 * size * random.standard_normal(exact.shape) / sigma).ravel()
        change = np.linalg.lstsq(weighted, y, rcond=None)[0]
        errors = uncertainty(names, weighted, weighted @ change - y).standard_errors
        inside.append(np.abs(change) <= 2 * errors)
    assert np.min(np.mean(inside, axis=0)) >= 0.9


def test_constants_that_the_data_cannot_tell_apart_are_named() -> None:
    """k_i and k_b both stiffen the bending; one pressure shows their sum alone."""
    data = seen(robot("D25L60"), POSES[1:2])
    found = identify(replace(data, elongation=None), SILICONE, ["k_b", "k_i"], coefficients=started(["k_b"]))
    assert any("k_b" in w and "k_i" in w for w in found.warnings)
    assert np.isinf(found.uncertainty.standard_errors).all()


def test_a_constant_at_its_bound_is_named_and_the_others_are_at_their_best() -> None:
    data = seen(robot("D25L60"), POSES, bending=0.0)
    off = replace(data, bending_angle=np.array(data.bending_angle) * 1.1, tip_position=None)
    found = identify(off, SILICONE, ["k_b", "k_e"], coefficients=started(["k_b", "k_e"]))
    assert found.at_bound == ("k_b",)
    assert found.constants[0] == 0.0
    assert any("k_b ended at its bound 0" in w for w in found.warnings)
    alone = identify(off, SILICONE, ["k_e"], coefficients=replace(TRUE, bending=0.0, elongation=0.41))
    assert found.constants[1] == pytest.approx(alone.constants[0], rel=1e-6)
    assert found.uncertainty.standard_errors[1] == pytest.approx(alone.uncertainty.standard_errors[0], rel=1e-4)


@pytest.mark.parametrize("lost", [False, True], ids=["pushed away from it", "no pose at it"])
def test_a_constant_next_to_its_bound_is_not_taken_for_one_at_it(lost: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """The rough search ends so near to 0 that 0 is tried; the sum of squares, or the model there, says otherwise."""
    data = seen(robot("D25L60"), POSES, bending=0.005)
    if lost:
        named = Fit._lost

        def none_at_zero(self: Fit, found: Sequence[Prediction]) -> tuple[Status, str] | None:
            at_zero = self._last is not None and self._last[0][0] == 0.0
            return (Status.DIVERGED, "lost") if at_zero else named(self, found)

        monkeypatch.setattr(Fit, "_lost", none_at_zero)
    found = identify(data, SILICONE, ["k_b", "k_e"], coefficients=started(["k_b", "k_e"]))
    assert found.status is Status.SOLVED
    assert found.at_bound == ()
    assert found.constants == pytest.approx([0.005, 0.6], rel=1e-6)


def test_poses_that_are_lost_at_the_end_leave_no_constants(monkeypatch: pytest.MonkeyPatch) -> None:
    """The second search may leave the first one's answer for where a measured pressure has no equilibrium."""
    soft = material("Ecoflex 00-20", "yeoh")
    data = Measurements(robot("D25L60"), [[0.1 * BAR, 0, 0], [1.2 * BAR] * 3], bending_angle=[0.1, 0.0])
    ends = iter([[1.0], [0.0]])
    monkeypatch.setattr(Fit, "_minimise", lambda self, start: np.array(next(ends)))
    found = identify(data, soft, ["k_e"])
    assert found.status in (Status.NO_EQUILIBRIUM, Status.UNSTABLE_MATERIAL)
    assert "D25L60, measurement 2: " in found.message
    assert np.isnan(found.constants).all()
    assert np.isnan(found.after[0]).all()
    assert not np.isnan(found.before[0][:, 3]).any()


def test_a_weighted_force_is_not_definite() -> None:
    data = Measurements(robot("D25L60"), [[BAR, 0, 0]], blocked_force=[0.5])
    with pytest.raises(InputError, match="expected a closure that has a definite force"):
        identify(data, SILICONE, ["k_b"], contact=ContactSettings(closure="weighted"))


def test_one_nlp_leaves_out_what_was_not_measured() -> None:
    """A row without a number has no pose in it, and one without a force no blocked shape."""
    P, numerics = BAR * np.array([[0.3, 0, 0], [0.8, 0, 0]]), Numerics(intervals=2)
    options: dict[str, Any] = {"coefficients": started(["k_b"]), "loads": LOADED}
    data = Measurements(robot("D25L60"), P, bending_angle=[np.nan, 0.8], elongation=[np.nan, 0.003])
    at_once = identify_at_once(data, SILICONE, ["k_b"], intervals=2, **options)
    assert at_once.status is Status.SOLVED
    reduced = identify(data, SILICONE, ["k_b"], numerics=numerics, **options)
    assert at_once.constants["k_b"] == pytest.approx(reduced.constants[0], rel=1e-6)
    left = ((reduced.after[0] - reduced.data[0].values) / reduced.data[0].sigma)[1, 3:5]
    assert at_once.cost == pytest.approx(left @ left / 2, rel=1e-6)


@pytest.mark.parametrize(
    ("measured", "free", "options", "said"),
    [
        ({"bending_angle": [0.5, 0.5]}, ["k_e"], {"coefficients": Coefficients(elongation=0.0)}, "2: no pose to start"),
        ({"blocked_force": [0.1, np.nan]}, ["k_b"], {"contact": ContactSettings(offset=-0.2)}, "1: no blocked shape"),
        ({"bending_angle": [0.5, np.nan]}, ["k_c"], {}, "no measurement depends on 'k_c'"),
    ],
    ids=["no pose", "no contact", "no dependence"],
)
def test_one_nlp_refuses_what_it_cannot_start_from(
    measured: dict[str, Any], free: list[str], options: dict[str, Any], said: str
) -> None:
    data = Measurements(robot("D25L60"), [[0.1 * BAR, 0, 0], [9 * BAR] * 3], **measured)
    with pytest.raises(InputError, match=said):
        identify_at_once(data, material("Ecoflex 00-20", "yeoh"), free, intervals=4, **options)


def test_where_the_model_has_no_pose_nothing_is_identified() -> None:
    soft = material("Ecoflex 00-20", "yeoh")
    data = Measurements(robot("D25L60"), [[0.1 * BAR, 0, 0], [9 * BAR] * 3], bending_angle=[0.1, 0.0])
    found = identify(data, soft, ["k_b"], coefficients=Coefficients(elongation=0.0))
    assert found.status in (Status.NO_EQUILIBRIUM, Status.UNSTABLE_MATERIAL)
    assert "D25L60, measurement 2" in found.message
    assert np.isnan(found.constants).all()


def test_weights_and_sigmas_choose_what_counts() -> None:
    r = robot("D25L60")
    P = [[BAR, 0, 0]] * 2
    rows = Measurements(r, P, bending_angle=[1.0, 1.2])
    first = identify(replace(rows, weight=[1.0, 0.0]), SILICONE, ["k_b"])
    assert first.after[0][0, 3] == pytest.approx(1.0, rel=1e-8)
    sharp = identify(replace(rows, sigma={"bending_angle": [0.01, 0.03]}), SILICONE, ["k_b"])
    assert sharp.after[0][0, 3] == pytest.approx((9 * 1.0 + 1.2) / 10, rel=1e-6)
    even = identify(rows, SILICONE, ["k_b"])  # by default each in proportion to its size
    small, large = 1 / (1 + 0.01 * 1.22), 1 / (1.44 + 0.01 * 1.22)
    assert even.after[0][0, 3] == pytest.approx((small * 1.0 + large * 1.2) / (small + large), rel=1e-6)


def test_uncertainty_is_that_of_a_straight_line() -> None:
    x = np.linspace(0, 1, 30)
    J = np.column_stack([np.ones(30), x])
    r = 0.1 * np.random.default_rng(2).standard_normal(30)
    r -= J @ np.linalg.lstsq(J, r, rcond=None)[0]
    found = uncertainty(["a", "b"], J, r)
    classic = np.sqrt(np.diag(np.linalg.inv(J.T @ J)) * (r @ r) / 28)
    assert np.all((found.standard_errors >= classic * (1 - 1e-12)) & (found.standard_errors < 1.5 * classic))
    held = uncertainty(["a", "b"], J, r, [False, True])
    assert np.isnan(held.standard_errors[1])
    assert held.condition == 1.0


@pytest.mark.parametrize(
    ("free", "measured", "said"),
    [
        (["k_x"], {"bending_angle": [1.0]}, "did you mean"),
        (["k_b", "k_b"], {"bending_angle": [1.0]}, "twice"),
        ([], {"bending_angle": [1.0]}, "at least one of"),
        (["k_b", "k_e"], {"bending_angle": [1.0]}, "cannot determine 2"),
        (["k_c"], {"bending_angle": [1.0]}, "no measurement depends on 'k_c'"),
        (["k_b"], {"elongation": [0.01]}, "no measurement depends on 'k_b'"),
        (["k_b"], {}, "at least one number"),
        (["k_b"], {"bending_angle": [np.inf]}, "finite"),
        (["k_b"], {"bending_angle": [1.0, 2.0]}, "expected the shape"),
        (["k_b"], {"bending_angle": [1.0], "sigma": {"bending_angle": 0.0}}, "above 0"),
        (["k_b"], {"bending_angle": [1.0], "sigma": {"angle": 1.0}}, "did you mean 'bending_angle'"),
        (["k_b"], {"bending_angle": [1.0], "weight": [-1.0]}, "weights"),
    ],
)
def test_what_cannot_be_identified_is_refused(free: list[str], measured: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        identify(Measurements(robot("D25L60"), [[BAR, 0, 0]], **measured), SILICONE, free)


# --- scenarios --------------------------------------------------------------------------------------------------------


@pytest.mark.thorough
@pytest.mark.parametrize("name", [pytest.param("measured_angles", marks=pytest.mark.slow), "measured_forces"])
def test_a_shipped_identification_runs(name: str, tmp_path: Path) -> None:
    assert main(["run", str(SCENARIOS / f"{name}.toml"), "--out", str(tmp_path)]) == 0
    files = {path.name for path in tmp_path.iterdir()}
    assert files == {"identified.json", "table.csv", "identified.toml", "figure.png", "versions.json", "scenario.toml"}
    document = json.loads((tmp_path / "identified.json").read_text())
    assert document["status"] == "solved"
    for key, after in document["errors"]["after"].items():
        assert after["rmse"] < document["errors"]["before"][key]["rmse"]
    study = "blocked-force" if name == "measured_forces" else "forward"
    text = f'study = "{study}"\n[robot]\nname = "D25L60"\n[material]\nname = "Ecoflex 00-50"\nmodel = "yeoh"\n'
    text += "[pressure]\nsequence_bar = [[1, 0, 0]]\n" + (tmp_path / "identified.toml").read_text()
    pasted = scenario_from_text(text, "x.toml").coefficients
    fields = {"k_e": "elongation", "k_b": "bending", "phi": "bore_fraction", "k_c": "chamber_reaction"}
    for constant in document["constants"]:
        assert getattr(pasted, fields[constant["name"]]) == pytest.approx(constant["value"], rel=1e-12, abs=1e-15)


def test_every_shipped_file_is_as_its_script_writes_it(tmp_path: Path) -> None:
    write_shipped_files(tmp_path)
    for make in TABLES:
        name = f"{make.__name__}.csv"
        assert (tmp_path / name).read_text() == (ROOT / "scenarios" / "files" / name).read_text()
    both = load_scenario(SCENARIOS / "measured_forces_and_angles.toml").task
    assert isinstance(both, RobotTask)
    assert sum(len(m.pressure) for m in both.measurements) == 44


HEAD = 'study = "identify"\n[material]\nname = "Ecoflex 00-50"\nmodel = "mooney-rivlin"\n'
ONE = '[robot]\nname = "D25L60"\n'


def scenario(folder: Path, csv: str, table: str = 'free = ["k_b"]', more: str = ONE) -> Path:
    (folder / "m.csv").write_text(csv)
    path = folder / "m.toml"
    path.write_text(f'{HEAD}{more}[measurements]\nfile = "m.csv"\n{table}\n')
    return path


def test_a_comparison_file_is_read_with_its_blank_cells_and_its_extra_columns(tmp_path: Path) -> None:
    csv = (
        "t_s,p1_bar,p2_bar,p3_bar,x_mm,y_mm,z_mm,bending_angle_deg,camera,sigma_bending_angle_deg,weight\n"
        "0,1,0,0,-30,0,,,left,,\n1,1,1,0,,,,90,right,2,3\n"
    )
    task = load_scenario(scenario(tmp_path, csv)).task
    assert isinstance(task, RobotTask)
    (m,) = task.measurements
    assert np.array(m.tip_position) == pytest.approx(np.array([[-0.03, 0, np.nan], [np.nan] * 3]), nan_ok=True)
    assert np.array(m.bending_angle) == pytest.approx([np.nan, np.pi / 2], nan_ok=True)
    assert list(m.weight) == [1, 3]
    assert np.rad2deg(m.sigma["bending_angle"][1]) == pytest.approx(2)
    assert main(["identify", str(tmp_path / "m.toml"), "--out", str(tmp_path / "o")]) == 0
    header, first, _ = (tmp_path / "o" / "table.csv").read_text().splitlines()
    assert header.startswith("t_s,p1_bar,p2_bar,p3_bar,x_mm,y_mm,z_mm,bending_angle_deg,camera,")
    assert header.endswith("y_mm_before,y_mm_after,bending_angle_deg_before,bending_angle_deg_after")
    assert first.split(",")[8] == "left"


def test_robots_of_a_table_and_of_the_library_share_constants(tmp_path: Path) -> None:
    csv = "robot,p1_bar,p2_bar,p3_bar,bending_angle_deg\nmine,1,0,0,80\nD15L60,1,0,0,100\n,1,0,0,70\n"
    more = ONE + '[robots.mine]\nname = "D25L60"\nlength_mm = 70\n'
    task = load_scenario(
        scenario(tmp_path, csv, 'free = ["k_b", "C10_MPa"]\nbounds = { C10_MPa = [0, 0.1] }', more)
    ).task
    assert isinstance(task, RobotTask)
    assert [m.label for m in task.measurements] == ["mine", "D15L60", "D25L60"]
    assert float(task.measurements[0].robot.length) == pytest.approx(0.07)
    assert task.free == ("k_b", "C10")
    assert task.bounds == {"C10": (0, pytest.approx(1e5))}


GOOD = "p1_bar,p2_bar,p3_bar,bending_angle_deg\n1,0,0,80\n"


@pytest.mark.parametrize(
    ("csv", "table", "more", "said"),
    [
        (GOOD, 'free = ["k_b"]', "", "a column robot, or a table [robot]"),
        (GOOD.replace("80", "x"), 'free = ["k_b"]', ONE, "line 2: bending_angle_deg: expected a number, got 'x'"),
        (GOOD.replace("1,0,0", "1,,0"), 'free = ["k_b"]', ONE, "line 2: p2_bar: expected a pressure"),
        (GOOD.replace("1,0,0", "1000,0,0"), 'free = ["k_b"]', ONE, "1 bar = 100 kPa"),
        (GOOD.replace("80", ""), 'free = ["k_b"]', ONE, "at least one number"),
        (
            GOOD.replace("p2_bar", "p2_kPa"),
            'free = ["k_b"]',
            ONE,
            "missing column 'p2_bar'; is it 'p2_kPa'?",
        ),
        (
            GOOD.replace("bending_angle_deg", "bending_angle_rad"),
            'free = ["k_b"]',
            ONE,
            "column 'bending_angle_rad' is not read; did you mean 'bending_angle_deg'?",
        ),
        (GOOD, 'free = ["kb"]', ONE, "did you mean 'k_b'"),
        (
            "p4_bar," + GOOD.replace("\n1", "\n2,1"),
            'free = ["k_b"]',
            ONE,
            "p4_bar: expected 0 or nothing: D25L60 has 3 sets",
        ),
        (GOOD, "", ONE, "[measurements] free: missing"),
        (GOOD, 'free = ["k_b"]\nbounds = { k_e = [0, 1] }', ONE, "bounds.k_e"),
        (GOOD, 'free = ["k_b"]\nbounds = { k_b = [1, 0] }', ONE, "lower and an upper"),
        (GOOD, 'free = ["k_b"]', '[robots.mine]\nnam = "D25L60"\n', "did you mean 'name'"),
        (
            GOOD,
            'free = ["k_b"]',
            '[robots.allow]\nnam = "D25L60"\n',
            "[robots] allow.nam: unknown key; did you mean 'name'",
        ),
        ("robot," + GOOD.replace("\n1", "\nD25L6,1"), 'free = ["k_b"]', "", "did you mean 'D25L60'"),
        (GOOD, 'free = ["k_b"]', ONE + '[contact]\nclosure = "weighted"\n', "closure free, compliant or rigid"),
        (GOOD, 'free = ["k_b"]', ONE + "[contact]\ntarget_force_N = 1\n", "target_force_N"),
        (GOOD, 'free = ["k_b"]', ONE + "[sigma]\nelongation_m = 1\n", "write elongation_mm = 1000"),
        (GOOD, 'free = ["k_b", "k_e"]', ONE, "[measurements] free: 1 numbers measured cannot determine 2 constants"),
        (GOOD, 'free = ["k_c"]', ONE, "[measurements] free: no measurement depends on 'k_c'"),
        (GOOD.replace("80", "0"), 'free = ["k_b"]', ONE, "bending_angle: expected a number that is not 0"),
    ],
)
def test_a_broken_scenario_is_one_line(
    csv: str, table: str, more: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["identify", str(scenario(tmp_path, csv, table, more)), "--json"]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert len(shown.err.splitlines()) == 1
    assert said in shown.err


def test_columns_that_differ_by_case_unit_or_a_letter_are_told(tmp_path: Path) -> None:
    csv = "p1_bar,p2_bar,p3_bar,tip_z_mm,Tip_X_mm,tip_y_mn,elongation_m,Weight,t_s,note,y_offset_mm\n"
    task = load_scenario(scenario(tmp_path, csv + "1,0,0,55,1,2,3,4,5,6,7\n", 'free = ["k_b"]', ONE)).task
    assert isinstance(task, RobotTask)
    pairs = [note.partition("column ")[2] for note in task.notes]
    assert pairs == [
        "'Tip_X_mm' is not read; did you mean 'x_mm'?",
        "'tip_y_mn' is not read; did you mean 'y_mm'?",
        "'elongation_m' is not read; did you mean 'elongation_mm'?",
        "'Weight' is not read; did you mean 'weight'?",
    ]
    assert task.measurements[0].tip_position[0][2] == pytest.approx(0.055)  # as results spell it


def test_json_alone_goes_to_standard_output(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["identify", str(scenario(tmp_path, GOOD.replace("80", "60"))), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["study"] == "identify"
    assert document["constants"][0]["standard_error"] is None
    assert document["measurements"][0]["after"]["bending_angle_deg"] == pytest.approx(60, abs=1e-5)
    assert not (tmp_path / "results").exists()


def test_no_pose_ends_with_3(tmp_path: Path) -> None:
    csv = GOOD.replace("1,0,0", "9,9,9")
    path = scenario(tmp_path, csv, more=ONE + "[stiffening]\nelongation = 0\n")
    assert main(["identify", str(path), "--out", str(tmp_path / "o")]) == 3
    document = json.loads((tmp_path / "o" / "identified.json").read_text())
    assert document["status"] in ("no_equilibrium", "unstable_material")
    assert document["constants"][0]["value"] is None
    assert not (tmp_path / "o" / "identified.toml").exists()


def test_open_constants_and_grown_errors_are_said_everywhere(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """By default each number counts by its size: the weighted misfit falls, and the error in degrees grows."""
    csv = (ROOT / "scenarios" / "files" / "measured_angles.csv").read_text()
    path = scenario(tmp_path, csv, 'free = ["k_e", "k_b"]', "")
    assert main(["identify", str(path), "--out", str(tmp_path / "o")]) == 0
    shown = capsys.readouterr().out
    document = json.loads((tmp_path / "o" / "identified.json").read_text())
    k_e, k_b = document["constants"]
    assert k_e["standard_error"] > k_e["value"] > 0
    assert (k_e["determined"], k_e["at_bound"], document["status"]) == (False, False, "solved")
    assert k_b["determined"] is (k_b["standard_error"] <= k_b["value"])
    before, after = (document["errors"][when]["bending_angle_deg"]["rmse"] for when in ("before", "after"))
    assert after > 1.05 * before
    assert document["weighted_rms"]["after"] < document["weighted_rms"]["before"]
    for words in ("k_e is not determined", f"bending angle rose by {100 * (after / before - 1):.3g} %"):
        assert any(words in warning for warning in document["warnings"])
        assert words in shown
    assert any(line.startswith("k_e") and line.endswith("not determined") for line in shown.splitlines())
    assert ", not determined" in (tmp_path / "o" / "identified.toml").read_text()
    found = run_robots(load_scenario(path))
    figure = identified_figure(found, "x")
    assert figure.axes[0].get_title() == f"rmse {before:.3g} deg before (grey), {after:.3g} deg after"
    (observable,) = (line.split() for line in shown.splitlines() if line.startswith("bending_angle_deg"))
    assert observable[1] == "deg"
    assert any("k_e = 0.2028 (not determined)" in text.get_text() for text in figure.texts)


def test_an_end_that_is_worse_than_the_start_is_no_minimum(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Fit, "_minimise", lambda self, start: start + 5.0)
    found = identify(seen(robot("D25L60"), POSES), SILICONE, ["k_b"], coefficients=TRUE)
    assert found.status is Status.DIVERGED
    assert "ended at k_b = 12, further from the measurements than its start" in found.message
    assert np.isnan(found.constants).all()


def test_the_start_is_never_left_for_a_worse_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    """A point at the bound that the sum of squares is pushed against is taken only where it is not larger there."""
    search = Fit._search

    def worse(self: Fit, start: Any, moving: Any, tolerance: float) -> Any:
        found = search(self, start, moving, tolerance)
        self._cost *= 1.0 if np.all(moving) else 2.0
        return found

    data = seen(robot("D25L60"), POSES, bending=0.0)
    off = replace(data, bending_angle=np.array(data.bending_angle) * 1.1, tip_position=None)
    monkeypatch.setattr(Fit, "_search", worse)
    found = identify(off, SILICONE, ["k_b", "k_e"], coefficients=started(["k_b", "k_e"]))
    assert 0 <= found.constants[0] < 1e-4


def test_another_study_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["identify", str(ROOT / "scenarios" / "D25L60_one_set.toml")]) == 2
    assert "expected 'identify'" in capsys.readouterr().err


def test_a_pose_beyond_the_fitted_stretch_is_named() -> None:
    P = BAR * np.array([[0.5, 0, 0], [1.5, 1.5, 1.5]])
    free = identify(Measurements(robot("D25L60"), P, bending_angle=[0.6, np.nan]), SILICONE, ["k_b"])
    assert not any("stretched" in w for w in free.warnings)
    soft = replace(SILICONE, constants={k: 0.75 * v for k, v in SILICONE.constants.items()})
    far = identify(
        Measurements(robot("D25L60"), P, bending_angle=[0.6, np.nan]),
        soft,
        ["k_b"],
        coefficients=Coefficients(elongation=0),
    )
    assert any("D25L60, measurement 2: the free robot is stretched to" in w for w in far.warnings)


@pytest.mark.parametrize(("angles", "told"), [((-28, -66), True), ((0.49, 1.15), True), ((28, 66), False)])
def test_data_that_the_model_does_not_follow_are_said(angles: tuple[float, float], told: bool, tmp_path: Path) -> None:
    """Angles with their sign turned or in radians end at a bound, with an error larger than what was measured."""
    csv = f"p1_bar,p2_bar,p3_bar,bending_angle_deg\n0.5,0,0,{angles[0]}\n1,0,0,{angles[1]}\n"
    found = run_robots(load_scenario(scenario(tmp_path, csv, 'free = ["k_b"]')))
    assert found.status is Status.SOLVED
    assert any("the model does not follow these data; check their unit and sign" in w for w in found.warnings) is told
