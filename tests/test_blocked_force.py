"""Blocked tip force: closures against the witness, contact, work, inversion, folds, other walls."""

from __future__ import annotations

import re
from functools import cache

import numpy as np
import pytest
from witness_blocked import Loads as WitnessLoads
from witness_blocked import Wall as WitnessWall
from witness_blocked import Weights, follow
from witness_section import AS_PRINTED as WITNESS_AS_PRINTED
from witness_section import BODIES, published, section
from witness_section import CALIBRATED as WITNESS_CALIBRATED
from witness_section import REPRODUCTION as WITNESS_REPRODUCTION

from softnlp import (
    AS_PRINTED,
    BAR,
    COEFFICIENT_SETS,
    InputError,
    Loads,
    Numerics,
    blocked_force,
    constrained_pose,
    force_against_offset,
    material,
    pressure_for_force,
    robot,
    weight_sensitivity,
)
from softnlp.base.status import Status
from softnlp.model.contact_settings import ClosureWeights, ContactSettings
from softnlp.model.quantities import Model
from softnlp.model.tip import TipContact
from softnlp.nlp.problem import compile_problem
from softnlp.nlp.transcription import MultipleShooting
from softnlp.statics.condensed import CondensedSolver
from softnlp.statics.loadcase import load_case, rod_functions
from softnlp.statics.step import Run, Step
from softnlp.studies.forward import forward

ECOFLEX = material("Ecoflex 00-50")
WITNESS_ECOFLEX = published("Ecoflex 00-50")
D25L60 = robot("D25L60")
NAMES = ("D25L60", "D25L40", "D20L60", "D20L40", "D15L60", "D15L40", "D10L60", "D10L40")
EXPECTED = (1.21725, 1.38355, 0.79424, 0.86719, 0.33538, 0.36157, 0.10107, 0.10467)  # of the witness, 1.5 bar [N]
SIX_STEPS = np.linspace(0, 1.5 * BAR, 6)[:, None] * np.array([1.0, 0.0, 0.0])
DOWN = (0.0, 0.0, -9.80665)


@cache
def sequence(name: str, closure: str) -> Run:
    return blocked_force(robot(name), ECOFLEX, SIX_STEPS, ContactSettings(closure=closure))  # type: ignore[arg-type]


def one(bar: float, contact: ContactSettings = ContactSettings(), name: str = "D25L60", **more: object) -> Step:
    return blocked_force(robot(name), ECOFLEX, [bar * BAR, 0, 0], contact, **more).steps[0]  # type: ignore[arg-type]


def force(step: Step) -> float:
    assert step.contact is not None, step.message
    return step.contact.force


@pytest.mark.slow
@pytest.mark.parametrize("closure", ["free", "compliant"])
@pytest.mark.parametrize("name", NAMES)
def test_every_robot_is_solved_up_to_full_pressure(name: str, closure: str) -> None:
    steps = sequence(name, closure).steps
    assert [s.status for s in steps] == [Status.SOLVED] * 6
    forces = [force(s) for s in steps]
    assert forces[0] == 0
    assert np.all(np.diff(forces) > 0)
    assert max(s.residual for s in steps if s.residual is not None) < 1e-8
    if closure == "compliant":
        assert forces[-1] == pytest.approx(EXPECTED[NAMES.index(name)], abs=6e-6)


def test_the_published_force_without_the_chamber_constraint() -> None:
    assert 0.72 <= force(sequence("D25L60", "free").steps[-1]) <= 0.80


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "bar", "cap"),
    [
        ("D25L60", 0.9, 0.0),
        ("D25L40", 1.1, 4e-3),
        ("D20L60", 0.6, 0.0),
        ("D20L40", 1.2, 3e-3),
        ("D15L60", 0.8, 0.0),
        ("D15L40", 1.0, 5e-3),
        ("D10L60", 0.5, 2e-3),
        ("D10L40", 1.3, 0.0),
    ],
)
def test_closures_agree_with_the_witness(name: str, bar: float, cap: float) -> None:
    for closure in ("free", "compliant", "rigid"):
        ours = one(bar, ContactSettings(closure=closure, tip_cap=cap), name)  # type: ignore[arg-type]
        exact = follow(
            BODIES[name],
            WITNESS_ECOFLEX,
            [bar * BAR, 0, 0],
            [1.0],
            WitnessWall(closure, L_t=cap),
            first_step=0.5,
            tolerance=1e-6,
        )[0]
        assert ours.contact is not None
        assert ours.contact.force == pytest.approx(exact.force, rel=1e-5)
        np.testing.assert_allclose(ours.contact.chamber_reaction, exact.reaction, rtol=1e-5, atol=1e-8)


@pytest.mark.parametrize(("name", "bar", "cap"), [("D25L60", 1.1, 0.0), ("D20L40", 0.9, 3e-3)])
@pytest.mark.parametrize("reading", ["calibrated", "as_printed"])
def test_other_coefficients_and_readings_agree_with_the_witness(
    reading: str, name: str, bar: float, cap: float
) -> None:
    choices, k_c = (WITNESS_CALIBRATED, 0.943) if reading == "calibrated" else (WITNESS_AS_PRINTED, 1.45)
    given = {"coefficients": COEFFICIENT_SETS["calibrated"]} if reading == "calibrated" else {"conventions": AS_PRINTED}
    ours = one(bar, ContactSettings(tip_cap=cap), name, **given).contact
    wall = WitnessWall("compliant", L_t=cap, k_c=k_c)
    exact, plain = (
        follow(BODIES[name], WITNESS_ECOFLEX, [bar * BAR, 0, 0], [1.0], w, choices=c, first_step=0.5, tolerance=1e-6)[0]
        for w, c in ((wall, choices), (WitnessWall(L_t=cap), WITNESS_REPRODUCTION))
    )
    assert ours is not None
    assert ours.force == pytest.approx(exact.force, rel=1e-5)
    assert abs(exact.force - plain.force) > 1e-3 * plain.force
    np.testing.assert_allclose(ours.chamber_reaction, exact.reaction, rtol=1e-5, atol=1e-8)


@pytest.mark.parametrize(
    "weights",
    [
        (1.0, 1.0, 5.0, 1e3),
        pytest.param((1.0, 1.0, 1.0, None), marks=pytest.mark.slow),
        pytest.param((2.0, 100.0, 30.0, None), marks=pytest.mark.slow),
    ],
)
def test_weighted_agrees_with_the_witness(weights: tuple[float, float, float, float | None]) -> None:
    ours = one(0.9, ContactSettings(closure="weighted", weights=ClosureWeights(*weights))).contact
    wall = WitnessWall("weighted", weights=Weights(*weights))
    exact = follow(BODIES["D25L60"], WITNESS_ECOFLEX, [0.9 * BAR, 0, 0], [1.0], wall, first_step=0.5, tolerance=1e-6)[0]
    assert ours is not None
    assert ours.force == pytest.approx(exact.force, rel=1e-5)
    left = {line.equation: line.value for line in ours.weighted}
    assert left["e_m"] == pytest.approx(np.abs(exact.e_m).max(), rel=1e-4)
    assert left["e_L"] == pytest.approx(abs(exact.e_L), rel=1e-4)
    assert (left["e_h"] == 0) == (weights[3] is None)


@pytest.mark.slow
def test_weighted_goes_on_where_the_square_equations_are_singular_and_folds_where_the_minimum_ends() -> None:
    weights = (10.0, 10.0, 20.0, None)
    contact = ContactSettings(closure="weighted", weights=ClosureWeights(*weights))
    ours = one(1.5, contact, "D10L60")
    wall = WitnessWall("weighted", weights=Weights(*weights))
    exact = follow(BODIES["D10L60"], WITNESS_ECOFLEX, [1.5 * BAR, 0, 0], [1.0], wall, first_step=0.2, tolerance=1e-6)[0]
    assert force(ours) == pytest.approx(exact.force, rel=1e-5)
    lost = one(1.5, contact, "D20L60")
    assert lost.status is Status.FOLD
    assert float(lost.message.split(" is at ")[1].split(",")[0]) == pytest.approx(1.345, abs=0.005)


@pytest.mark.thorough
def test_loads_act_as_in_the_witness() -> None:
    F, M, cap = (0.02, 0.0, -0.05), (0.0, 1e-3, 0.0), 4e-3
    ours = one(0.9, ContactSettings(tip_cap=cap), loads=Loads(tip_force=F, tip_moment=M, gravity=DOWN))
    exact = follow(
        BODIES["D25L60"],
        WITNESS_ECOFLEX,
        [0.9 * BAR, 0, 0],
        [1.0],
        WitnessWall(L_t=cap),
        loads=WitnessLoads(F, M, DOWN),
        first_step=0.5,
        tolerance=1e-7,
    )[0]
    assert force(ours) == pytest.approx(exact.force, rel=1e-5)


def test_the_wall_at_the_free_tip_carries_nothing() -> None:
    tip = forward(D25L60, ECOFLEX, [1.2 * BAR, 0, 0]).steps[0].pose
    assert tip is not None
    for beyond in (-1e-8, 0.0, 1e-8):
        step = one(1.2, ContactSettings(offset=float(tip.tip_position[0]) + beyond))
        assert step.status.has_solution
        assert force(step) < 1e-6


def test_a_wall_out_of_reach_leaves_the_free_shape_alone() -> None:
    step = one(0.6, ContactSettings(offset=-30e-3))
    free = forward(D25L60, ECOFLEX, [0.6 * BAR, 0, 0]).steps[0].pose
    assert step.status is Status.NO_CONTACT
    assert force(step) == 0
    assert step.pose is not None
    assert free is not None
    assert step.contact is not None
    assert step.contact.gap > 0
    np.testing.assert_allclose(step.pose.tip_position, free.tip_position, atol=1e-6 * 60e-3)


def energy(step: Step) -> float:
    """V of the rod by quadrature of its strains: elastic energy less the work of the pressure's moment [J].

    With n = K v + F_P R e3 and m = R (K u) in Eq. (5), the equilibria without tip load are those of V, with density
    1/2 (v - e3) K (v - e3) + 1/2 u K u - u . M_P, at a fixed position of the contact point.
    """
    assert step.pose is not None
    shape = step.pose.shape
    sec = section(BODIES["D25L60"], WITNESS_ECOFLEX, step.pressure)
    v, u = shape.shear_extension - [0, 0, 1], shape.curvature
    density = 0.5 * (v**2 @ [sec.GA, sec.GA, sec.EA]) + 0.5 * (u**2 @ [*sec.EI, sec.GJ]) - u @ sec.M_P
    h = 1 / (len(density) - 1)
    simpson = np.ones(len(density))
    simpson[1:-1:2], simpson[2:-1:2] = 4, 2
    return float(density @ simpson) * h / 3 * sec.L


@pytest.mark.parametrize("cap", [0.0, 5e-3])
def test_the_characteristic_curve_is_the_derivative_of_the_energy(cap: float) -> None:
    # At constant pressure dead loads and pressure do no other work: dV/dh along the wall's normal is the wall's force.
    contact = ContactSettings(closure="free", tip_cap=cap)
    h = -10e-3 + np.array([-2, -1, 0, 1, 2]) * 1e-3
    run = force_against_offset(D25L60, ECOFLEX, [1.2 * BAR, 0, 0], h, contact, numerics=Numerics(intervals=40))
    V = np.array([energy(s) for s in run.steps])
    slope = (8 * (V[3] - V[1]) - (V[4] - V[0])) / (12 * 1e-3)
    assert slope == pytest.approx(force(run.steps[2]), rel=1e-5)


def test_the_characteristic_curve_falls_to_the_free_tip() -> None:
    h = np.array([0.0, -0.02, -0.04, -0.05])
    run = force_against_offset(D25L60, ECOFLEX, [1.2 * BAR, 0, 0], h)
    forces = [force(s) for s in run.steps]
    assert np.all(np.diff(forces) < 0)
    assert run.steps[-1].status is Status.NO_CONTACT
    assert forces[1] == pytest.approx(force(one(1.2, ContactSettings(offset=-0.02))), rel=1e-5)


@pytest.mark.slow
def test_a_leaning_wall_is_moved_along_the_normal_in_which_it_pushes() -> None:
    lean = (float(np.cos(0.2)), 0.0, float(np.sin(0.2)))
    wall = ContactSettings(wall_point=(-0.02, 0.0, 0.01), wall_normal=lean)
    run = force_against_offset(D25L60, ECOFLEX, [1.2 * BAR, 0, 0], [0.0, -4e-3, 4e-3, -20e-3], wall)
    forces = [force(s) for s in run.steps]
    assert forces[2] > forces[0] > forces[1] > 0  # a positive offset is a wall moved towards the robot
    assert run.steps[3].status is Status.NO_CONTACT
    for k, h in enumerate((0.0, -4e-3, 4e-3)):
        point = (-0.02 + h * lean[0], 0.0, 0.01 + h * lean[2])
        alone = one(1.2, ContactSettings(wall_point=point, wall_normal=lean))
        assert forces[k] == pytest.approx(force(alone), rel=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("closure", ["free", "compliant", "rigid", "weighted"])
def test_a_force_gives_back_its_pressure(closure: str) -> None:
    contact = ContactSettings(closure=closure)  # type: ignore[arg-type]
    P, step = pressure_for_force(D25L60, ECOFLEX, [0], force(one(0.777, contact)), contact)
    assert step.status is Status.SOLVED
    np.testing.assert_allclose(P, [0.777 * BAR, 0, 0], rtol=1e-6)


def test_a_force_out_of_reach_says_so() -> None:
    P, step = pressure_for_force(D25L60, ECOFLEX, [0], 5.0)
    assert step.status is Status.OUT_OF_REACH
    assert "1.217 N" in step.message
    assert np.all(np.isnan(P))


@pytest.mark.parametrize(("name", "bar"), [("D25L60", 1.47), ("D20L60", 1.30), ("D15L60", 1.40)])
def test_rigid_chambers_fold(name: str, bar: float) -> None:
    step = one(1.5, ContactSettings(closure="rigid"), name)
    assert step.status is Status.FOLD
    assert step.pose is None
    last = float(step.message.split(" is at ")[1].split(",")[0])
    assert last == pytest.approx(bar, abs=0.01)


@pytest.mark.thorough
def test_a_wall_turned_with_the_pressures_changes_nothing() -> None:
    angle = 2 * np.pi / 3
    normal = (float(np.cos(angle)), float(np.sin(angle)), 0.0)
    contact = ContactSettings(wall_point=(0.0, 0.0, 0.01), wall_normal=normal)
    turned = blocked_force(D25L60, ECOFLEX, [0, BAR, 0], contact).steps[0]
    straight = one(1.0)
    assert force(turned) == pytest.approx(force(straight), rel=1e-9)
    assert turned.pose is not None
    assert straight.pose is not None
    R = np.array([[normal[0], -normal[1], 0], [normal[1], normal[0], 0], [0, 0, 1]])
    np.testing.assert_allclose(turned.pose.tip_position, R @ straight.pose.tip_position, atol=1e-10)


def test_a_wall_by_its_normal_is_the_wall_at_its_offset() -> None:
    placed = one(1.0, ContactSettings(wall_point=(-0.01, 0.0, 0.0), wall_normal=(2.0, 0.0, 0.0)))
    assert force(placed) == pytest.approx(force(one(1.0, ContactSettings(offset=-0.01))), rel=1e-9)
    assert placed.contact is not None
    np.testing.assert_array_equal(placed.contact.normal, [1, 0, 0])


@pytest.mark.parametrize(
    ("point", "normal", "cap", "told"),
    [
        ((0, 0, 0.05), (0, 0, -1), 0, "(0, 0, 60) mm starts 10 mm behind"),  # leans over the robot
        ((-0.01, 0, 0), (-2, 0, 0), 0, "starts 10 mm behind the wall, which pushes along (-1, 0, 0); turn"),
        ((0.02, 0, 0.06), (3, 0, 4), 0, "turn the normal to (-0.6, 0, -0.8), or move the point to (12.8, 0, 50.4) mm"),
        ((0, 0, 0.07), (0, 0, 1), 0, "starts 10 mm behind"),
        ((0, 0, 0.062), (0, 0, -1), 5e-3, "(0, 0, 65) mm starts 3 mm behind"),
        ((1e-5, 0, 0.06), (1, 0, 0), 0, "starts 0.01 mm behind"),
    ],
)
def test_a_wall_that_the_tip_starts_behind_is_refused(
    point: tuple[float, float, float], normal: tuple[float, float, float], cap: float, told: str
) -> None:
    wall = ContactSettings(wall_point=point, wall_normal=normal, tip_cap=cap)
    for ask in (
        lambda: one(1.0, wall),
        lambda: pressure_for_force(D25L60, ECOFLEX, [0], 0.1, wall),
        lambda: force_against_offset(D25L60, ECOFLEX, [BAR, 0, 0], [0.0, 1e-3], wall),
    ):
        with pytest.raises(InputError, match=f"^wall_normal: .*{re.escape(told)}"):
            ask()


@pytest.mark.thorough
def test_a_wall_that_is_moved_may_start_in_front() -> None:
    wall = ContactSettings(wall_point=(5e-3, 0.0, 0.0), wall_normal=(1.0, 0.0, 0.0))
    steps = force_against_offset(D25L60, ECOFLEX, [0.5 * BAR, 0, 0], [-5e-3, 0.0], wall).steps
    assert [force(s) for s in steps] == pytest.approx([force(one(0.5)), force(one(0.5, ContactSettings(offset=5e-3)))])


def test_a_normal_is_kept_where_the_robot_goes_the_other_way() -> None:
    contact = ContactSettings(wall_point=(0.0, 0.0, 0.0), wall_normal=(1.0, 0.0, 0.0))  # touches the tip at rest
    step = blocked_force(D25L60, ECOFLEX, [0, BAR, 0], contact).steps[0]
    assert step.status is Status.NO_CONTACT  # set 2 bends towards +x
    assert step.contact is not None
    np.testing.assert_array_equal(step.contact.normal, [1, 0, 0])


def test_a_preload_is_the_dead_force_that_moves_the_tip_as_far() -> None:
    """A wall moved in at zero pressure by d pushes with the force that, as a dead load, moves the tip by d."""
    normal = np.array([0.6, 0.0, 0.8])
    contact = ContactSettings(wall_point=(0.0, 0.0, 0.06), wall_normal=(0.6, 0.0, 0.8), closure="free")
    for step in force_against_offset(D25L60, ECOFLEX, [0, 0, 0], [5e-3, 10e-3], contact).steps:
        push = force(step) * normal
        (dead,) = forward(D25L60, ECOFLEX, [0, 0, 0], loads=Loads(tip_force=push)).steps
        assert step.pose is not None
        assert dead.pose is not None
        np.testing.assert_allclose(dead.pose.tip_position, step.pose.tip_position, atol=1e-7)


def test_a_tip_just_behind_is_pushed_in_front() -> None:
    wall = ContactSettings(wall_point=(1e-6, 0.0, 0.0), wall_normal=(1.0, 0.0, 0.0))
    rest, pressed = blocked_force(D25L60, ECOFLEX, [[0, 0, 0], [BAR, 0, 0]], wall).steps
    assert rest.contact is not None
    assert rest.contact.gap == pytest.approx(-1e-6)
    assert 0 < force(rest) < 1e-4
    assert force(pressed) == pytest.approx(force(one(1.0)), rel=1e-4)


def test_a_load_presses_the_tip_into_the_wall_before_any_pressure() -> None:
    loads = Loads(tip_force=(-0.3, 0.0, 0.0))
    contact = ContactSettings(wall_point=(-5e-3, 0.0, 0.0), wall_normal=(1.0, 0.0, 0.0), closure="free")
    (step,) = blocked_force(D25L60, ECOFLEX, [0, 0, 0], contact, loads=loads).steps
    left = Loads(tip_force=(force(step) - 0.3, 0.0, 0.0))
    (dead,) = forward(D25L60, ECOFLEX, [0, 0, 0], loads=left).steps
    assert dead.pose is not None
    assert dead.pose.tip_position[0] == pytest.approx(-5e-3, abs=1e-7)


def test_in_space_forces_balance() -> None:
    step = blocked_force(D25L60, ECOFLEX, [BAR, 0.5 * BAR, 0], ContactSettings(closure="free")).steps[0]
    assert step.pose is not None
    assert step.contact is not None
    shape = step.pose.shape
    assert abs(step.pose.tip_position[0]) < 1e-9
    # the wall is free of friction: what the base holds beside the pressure is along its normal
    np.testing.assert_allclose(shape.force[0][:2], step.contact.force * step.contact.normal[:2], atol=1e-6)


def test_planar_shapes_stay_planar_and_warn_where_they_may_slip() -> None:
    steps = sequence("D15L60", "compliant").steps
    assert all(s.pose is not None and np.all(s.pose.shape.position[:, 1] == 0) for s in steps)
    told = [any("slip sideways" in w for w in s.warnings) for s in steps]
    assert told[-1]
    assert not told[1]


@pytest.mark.thorough
def test_a_preloading_wall_and_loads_at_rest_are_reached() -> None:
    pushed = one(0.5, ContactSettings(offset=5e-3))
    assert force(pushed) > force(one(0.5))
    loaded = one(0.5, loads=Loads(tip_force=(-0.05, 0.0, 0.0)))
    assert force(loaded) > force(one(0.5))


def test_the_condensed_equations_are_the_whole_ones() -> None:
    functions = rod_functions(Model(D25L60, ECOFLEX), (TipContact("rigid"),))
    method = MultipleShooting(4)
    declared = functions.declared()
    problem = compile_problem(list(declared.values()), [load_case("blocked", functions, declared, method)])
    p = problem.pack({"pressure": [1e5, 2e4, 0], "contact.pressed": [1, 1, 1, 1, 0, 0], "contact.tip_cap": 3e-3})
    rng = np.random.default_rng(3)
    states = np.asarray(functions.arc(p[: functions.section.size1_in(0)], 1.2, np.linspace(0, 1, 5)[None, :]))
    x = np.concatenate([[1.2], (states + 0.05 * rng.normal(size=states.shape)).T.ravel(), [0.3, 0.1]])
    g = rng.normal(size=x.size)
    dx = CondensedSolver(functions, method).solve(x, p, g)
    np.testing.assert_allclose(np.asarray(problem.jacobian(x, p)) @ dx, -g, atol=1e-9)


def test_collocation_gives_the_same_force() -> None:
    step = one(0.6, numerics=Numerics(transcription="collocation"))
    assert force(step) == pytest.approx(force(one(0.6)), rel=1e-5)


@pytest.mark.slow
def test_constrained_chambers_resist_a_tip_load() -> None:
    loads = Loads(tip_force=(0.1, 0.0, -0.05))
    free, compliant, rigid, weighted = (
        constrained_pose(D25L60, ECOFLEX, [BAR, 0, 0], loads, closure)
        for closure in ("free", "compliant", "rigid", "weighted")
    )
    bare = forward(D25L60, ECOFLEX, [BAR, 0, 0], loads=loads).steps[0].pose
    errors = []
    for step in (free, weighted, compliant, rigid):
        assert step.contact is not None, step.message
        errors.append(abs(step.contact.length_error))
    assert errors[0] > max(errors[1:3])
    assert errors[3] < 1e-12
    assert free.pose is not None
    assert bare is not None
    np.testing.assert_allclose(free.pose.tip_position, bare.tip_position, atol=1e-7)


@pytest.mark.thorough
def test_weights_matter_as_they_are_said_to() -> None:
    contact = ContactSettings(closure="weighted", weights=ClosureWeights(1.0, 1.0, 5.0, None))
    step, found = weight_sensitivity(D25L60, ECOFLEX, [0.9 * BAR, 0, 0], contact)
    by_name = {s.weight: s.elasticity for s in found}
    assert step.status is Status.SOLVED
    # all weights scaled alike change nothing
    assert sum(by_name.values()) == pytest.approx(0, abs=2e-3)
    assert by_name["length"] > 0 > by_name["moment"]
    # and the tangent of the force itself, by a step five times smaller
    weights = [ClosureWeights(1.0, 1.0, 5.0 * f, None) for f in (1.02, 1 / 1.02)]
    up, down = (force(one(0.9, ContactSettings(closure="weighted", weights=w))) for w in weights)
    assert by_name["length"] == pytest.approx(np.log(up / down) / (2 * np.log(1.02)), rel=0.02)


@pytest.mark.slow
def test_weight_sensitivity_of_a_run_is_that_of_its_steps() -> None:
    contact = ContactSettings(closure="weighted", weights=ClosureWeights(force=1.0, moment=1.0, length=5.0))
    run = blocked_force(D25L60, ECOFLEX, [[0.45 * BAR, 0, 0], [0.9 * BAR, 0, 0]], contact, weight_sensitivity=True)
    alone = weight_sensitivity(D25L60, ECOFLEX, [0.9 * BAR, 0, 0], contact)[1]
    assert run.steps[1].contact is not None
    followed = run.steps[1].contact.sensitivity
    assert [s.weight for s in followed] == ["force", "moment", "length"]
    np.testing.assert_allclose([s.elasticity for s in followed], [s.elasticity for s in alone], rtol=1e-4)
    with pytest.raises(InputError, match="weights"):
        blocked_force(D25L60, ECOFLEX, [0, 0, 0], ContactSettings(closure="weighted"), weight_sensitivity=True)


@pytest.mark.slow
def test_a_fold_is_not_stepped_over_onto_the_part_of_the_curve_beyond_it() -> None:
    # the branch folds at 1.292 bar; close by the curve rises again, with other forces and the same sign
    for bars in ([1.5], [1.36, 1.5], [0.9, 1.2, 1.32, 1.5]):
        P = [[bar * BAR, 0, 0] for bar in bars]
        run = blocked_force(robot("D10L40"), ECOFLEX, P, ContactSettings(closure="rigid", offset=-0.02))
        for step, bar in zip(run.steps, bars, strict=True):
            assert step.status is Status.FOLD if bar > 1.3 else step.status.has_solution


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "bar", "closure", "other"), [("D10L60", 1.3, "compliant", 2), ("D15L60", 1.3, "free", 2)]
)
def test_another_equilibrium_is_reported_and_not_returned(name: str, bar: float, closure: str, other: int) -> None:
    contact = ContactSettings(closure=closure)  # type: ignore[arg-type]
    plain, checked = (one(bar, contact, name, branches=n) for n in (0, 40))
    told = [w for w in checked.warnings if "another equilibrium" in w]
    assert len(told) == other
    assert not any("another equilibrium" in w for w in plain.warnings)
    for warning in told:
        found = float(warning.split("force of ")[1].split(" N")[0])
        assert found > 1.5 * force(plain)
    # the result stays the one that was followed: the witness's, which follows as well
    assert force(checked) == force(plain)
    assert checked.pose is not None
    assert plain.pose is not None
    np.testing.assert_array_equal(checked.pose.tip_position, plain.pose.tip_position)
    wall = WitnessWall(closure)
    exact = follow(BODIES[name], WITNESS_ECOFLEX, [bar * BAR, 0, 0], [1.0], wall, first_step=0.34, tolerance=1e-6)[0]
    assert force(checked) == pytest.approx(exact.force, rel=1e-5)


@pytest.mark.thorough
def test_other_starts_find_nothing_where_there_is_nothing_else() -> None:
    checked = one(0.5, branches=20)
    assert not checked.warnings
    assert force(checked) == force(one(0.5))


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"closure": "stiff"}, "closure"),
        ({"tip_cap": -1e-3}, "tip_cap"),
        ({"offset": float("nan")}, "offset"),
        ({"wall_point": (0.0, 0.0, 0.0)}, "wall_normal"),
        ({"wall_point": (0.0, 0.0, 0.0), "wall_normal": (0.0, 0.0, 0.0)}, "wall_normal"),
    ],
)
def test_bad_settings_are_refused(change: dict[str, object], word: str) -> None:
    with pytest.raises(InputError, match=word):
        one(0.5, ContactSettings(**change))  # type: ignore[arg-type]
