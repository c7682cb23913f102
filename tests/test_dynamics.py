"""Motion over time: balances of energy, orders, poses that it settles on, and what it does when let go."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from softnlp import (
    BAR,
    Body,
    Loads,
    MultipleShooting,
    Numerics,
    Segment,
    case,
    forward,
    material,
    problem,
    robot,
    segmented_robot,
    solve,
)
from softnlp.base.errors import InputError
from softnlp.base.status import Status
from softnlp.dynamics.drive import Chambers, Series
from softnlp.dynamics.rod import matrices, rotated, turned_by
from softnlp.dynamics.simulation import Dynamics, Output, Simulation
from softnlp.studies.dynamic import dynamic
from softnlp.studies.modes import modes
from tests.moving_bodies import TWO, Stiffening

Array = NDArray[np.float64]
D25, RUBBER = robot("D25L60"), material("Ecoflex 00-50")
EXACT = Numerics(accuracy=1e-9, engine="newton")
FREE = Loads()
NOTHING = Series(np.zeros(1), np.zeros((1, 3)))


def simulated(asked: Dynamics, loads: Loads = FREE, pressures: Series = NOTHING, **more: Any) -> Simulation:
    return Simulation(Body([Segment(D25, RUBBER)]), loads, asked, pressures, NOTHING, **more)


def tip(output: Output) -> Array:
    found: Array = output.instant.at.position[-1]
    return found


def held(*bars: float) -> Series:
    return Series(np.zeros(1), np.array([bars]) * BAR)


# --- energy -----------------------------------------------------------------------------------------------------------

LOADED = Loads((0.03, -0.02, 0.02), gravity=(3.0, 0.0, 9.0))


JUMP = Series(np.zeros(2), np.array([[0.0] * 3, [0.5, 0.2, 0.0]]) * BAR)


@pytest.mark.parametrize(
    ("loads", "pressures"),
    [(Loads((0.03, 0.0, 0.03), gravity="hanging"), held(0.5, 0.0, 0.0)), (LOADED, held(0.5, 0.2, 0.0)), (FREE, JUMP)],
    ids=["in a plane", "in space", "jump"],
)
def test_without_damping_the_trapezoid_keeps_the_energy(loads: Loads, pressures: Series) -> None:
    """A release and a jump of pressure at steps of 1 ms, with all modes in it: to what Newton's method leaves."""
    asked = Dynamics(0.1, 1e-3, output_step=0.005, release=True)
    energies = [output.energy for output in simulated(asked, loads, pressures).run()]
    assert max(energy.kinetic for energy in energies) > 0.1 * energies[-1].exchanged
    assert max(abs(energy.imbalance) for energy in energies) < 1e-9 * energies[-1].exchanged
    assert energies[-1].numerical == energies[-1].dissipated == 0.0


@pytest.mark.parametrize("made", ["one", "two"])
def test_what_the_resultants_carry_is_the_adjoint_of_the_turn(made: str) -> None:
    """The work of moments on the turn between two shapes, far apart, is that of what they ask of the curvature."""
    draw = np.random.default_rng(3)
    body = Body([Segment(D25, RUBBER)]) if made == "one" else Body(TWO.segments)
    none = Series(np.zeros(1), np.zeros((1, body.sets)))
    rod = Simulation(body, FREE, Dynamics(0.1), none, NOTHING).rod
    strains = draw.normal(size=(2, rod.size, 6)) * [0.1, 0.1, 0.1, 8.0, 8.0, 8.0] + [0, 0, 1, 0, 0, 0]
    was, at = (rod.shape(one, rod.at_rest.compliance) for one in strains)
    work = draw.normal(size=(len(at.collocated), 3))
    turned = turned_by(was.collocated, at.collocated)  # in the frames of before
    before = was.collocated / np.linalg.norm(was.collocated, axis=1)[:, None]
    on_the_turn = (work * rotated(matrices(before), turned)).sum()
    moments = rod.turned_back(was, at, work)
    assert (rod.w @ (moments * (at.strains - was.strains)[:, 3:]).sum(axis=1)) == pytest.approx(on_the_turn, rel=1e-11)


def test_bdf2_says_what_it_loses() -> None:
    asked = Dynamics(0.06, 1e-3, rule="bdf2", output_step=0.01, release=True)
    energies = [output.energy for output in simulated(asked, Loads((0.03, 0.0, 0.0))).run()]
    lost = [energy.numerical for energy in energies]
    assert lost[-1] > 1e-3 * energies[-1].exchanged
    assert np.all(np.diff(lost) > 0)
    assert abs(energies[-1].imbalance) < 1e-5 * energies[-1].exchanged


@pytest.mark.parametrize("rule", ["trapezoid", "bdf2"])
def test_with_damping_the_energy_never_grows(rule: Any) -> None:
    asked = Dynamics(0.05, 2e-3, rule=rule, damping=1e-3, output_step=2e-3, release=True)
    loads = Loads((0.03, -0.02, 0.05), (1e-4, 2e-4, 3e-4))
    energies = [output.energy for output in simulated(asked, loads, held(0.5, 0.2, 0.0)).run()]
    left = np.array([energy.kinetic + energy.elastic + energy.gravity for energy in energies])
    assert np.all(np.diff(left) < 1e-9 * energies[-1].exchanged)
    assert energies[-1].dissipated > 0.1 * energies[-1].exchanged
    assert abs(energies[-1].imbalance) < (1e-9 if rule == "trapezoid" else 1e-4) * energies[-1].exchanged


def test_the_work_of_pressure_and_load_is_in_the_balance() -> None:
    """Pressures and a force that change smoothly: the sum closes, and the work itself is of order 2 in the step."""
    times = np.linspace(0, 0.05, 26)
    pressures = Series(times, np.outer(np.sin(10 * times), [0.4, 0.1, 0.0]) * BAR)
    force = Series(times, np.outer(times, [0.5, 0.2, 0.0]))
    work = []
    for h in (2e-3, 1e-3, 5e-4):
        body = Body([Segment(D25, RUBBER)])
        asked = Dynamics(0.05, h, damping=2e-3, output_step=0.05)
        energy = [o.energy for o in Simulation(body, Loads(), asked, pressures, force).run()][-1]
        assert energy.pressure_work > 0
        assert energy.load_work != 0
        assert abs(energy.imbalance) < 1e-8 * energy.exchanged
        work.append(energy.pressure_work)
    assert abs(work[2] - work[1]) < 0.35 * abs(work[1] - work[0]) < 1e-3 * work[2]


# --- orders -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rule", ["trapezoid", "bdf2"])
def test_the_order_in_time_is_two(rule: Any) -> None:
    times = np.linspace(0, 0.04, 161)  # the rows of all steps, of pressures that begin smoothly
    pressures = Series(times, np.outer(np.sin(np.pi * times / 0.08) ** 4, [0.6, 0.2, 0.0]) * BAR)

    def at_end(h: float) -> Array:
        asked = Dynamics(0.04, h, rule=rule, damping=0.02, output_step=0.04, start="rest")
        return tip(list(simulated(asked, pressures=pressures).run())[-1])

    best = at_end(2.5e-4)
    errors = [np.linalg.norm(at_end(h) - best) for h in (4e-3, 2e-3, 1e-3)]
    assert 3.3 < errors[0] / errors[1] < 5.5
    assert 3.3 < errors[1] / errors[2] < 5.0


@pytest.mark.parametrize("points", [1, 2, 3])
def test_the_order_along_the_rod_is_twice_the_points(points: int) -> None:
    asked = Dynamics(0.01, 5e-3, damping=5e-3, output_step=0.01, release=True)
    loads = Loads((0.03, 0.0, 0.05), gravity=(0.0, 3.0, 9.0))

    def at_end(intervals: int, points: int) -> Array:
        return tip(list(simulated(asked, loads, held(0.6, 0.0, 0.0), intervals=intervals, points=points).run())[-1])

    best = at_end(6, 4)
    coarse, fine = (float(np.linalg.norm(at_end(k, points) - best)) for k in (3, 6))
    assert 2 * points - 0.5 < np.log2(coarse / fine) < 2 * points + 0.9


# --- rest -------------------------------------------------------------------------------------------------------------


def test_a_pose_at_rest_stays() -> None:
    asked = Dynamics(0.1, 0.01, output_step=0.05)
    outputs = list(simulated(asked, LOADED, held(0.5, 0.2, 0.0)).run())
    assert np.allclose(tip(outputs[-1]), tip(outputs[0]), rtol=0, atol=1e-10)
    pose = forward(D25, RUBBER, [np.array([0.5, 0.2, 0.0]) * BAR], loads=LOADED, numerics=EXACT).steps[0].pose
    assert pose is not None
    assert np.allclose(tip(outputs[0]), pose.tip_position, rtol=0, atol=1e-9)


def test_it_settles_on_the_pose_of_statics() -> None:
    asked = Dynamics(3.0, None, rule="bdf2", damping=0.02, output_step=1.5, start="rest")
    loads = Loads((0.05, 0.02, 0.0), gravity="hanging")
    run = dynamic(D25, RUBBER, [0.6 * BAR, 0.2 * BAR, 0.0], asked, loads=loads)
    pose = forward(D25, RUBBER, [[0.6 * BAR, 0.2 * BAR, 0.0]], loads=loads, numerics=EXACT).steps[0].pose
    last = run.steps[-1].pose
    assert pose is not None
    assert last is not None
    assert np.linalg.norm(last.tip_position - pose.tip_position) < 1e-6 * D25.length
    for name in ("tip_rotation", "tip_displacement", "bending_angle", "tilt", "backbone_length", "chamber_length"):
        assert np.allclose(getattr(last, name), getattr(pose, name), rtol=1e-5, atol=2e-6 * D25.length), name
    assert np.allclose(last.shape.moment, pose.shape.moment, atol=1e-5 * np.abs(pose.shape.moment).max())
    assert np.allclose(last.shape.force, pose.shape.force, atol=1e-4 * np.abs(pose.shape.force).max())
    assert np.allclose(last.shape.curvature, pose.shape.curvature, atol=1e-4 * np.abs(pose.shape.curvature).max())


def test_a_section_whose_strains_are_not_linear() -> None:
    """It begins at the pose of statics, and keeps the energy of a release."""
    body = Body([Segment(D25, RUBBER, Stiffening)])
    values = {"pressure": [0.5 * BAR, 0.2 * BAR, 0.0], "tip_force": LOADED.tip_force, "gravity": LOADED.gravity}
    pose = solve(problem([case("pose", body, method=MultipleShooting(60))]), values)
    asked = Dynamics(0.05, 1e-3, output_step=0.01, release=True)
    outputs = list(Simulation(body, LOADED, asked, held(0.5, 0.2, 0.0), NOTHING).run())
    off = max(abs(output.energy.imbalance) for output in outputs) / outputs[-1].energy.exchanged
    assert np.allclose(tip(outputs[0]), pose["tip_position"], rtol=0, atol=1e-6 * D25.length)
    assert off < 1e-8


CONE = segmented_robot([Segment(D25, RUBBER, along={"robot.outer_diameter": (0.025, 0.0245)})])


@pytest.mark.parametrize(
    "made", [pytest.param(TWO, id="segments", marks=pytest.mark.thorough), pytest.param(CONE, id="cone")]
)
def test_segments_and_sections_that_vary_begin_as_in_statics(made: Any) -> None:
    """Connectors, turned axes, bonded lines; a section that varies. And the energy of a release is kept."""
    loads = Loads((0.02, 0.01, 0.02), gravity=(1.0, 2.0, 9.0))
    P = np.array([0.4, 0.1, 0.0, 0.2, 0.0, 0.3])[: made.chamber_sets] * BAR
    asked = Dynamics(0.02, 1e-3, output_step=0.02, release=True)
    run = dynamic(made, made.material, P, asked, loads=loads)
    step = forward(made, made.material, [P], loads=loads, numerics=EXACT).steps[0]
    assert run.steps[0].pose is not None
    assert step.pose is not None
    first, pose = run.steps[0].pose, step.pose
    assert np.allclose(first.tip_position, pose.tip_position, rtol=0, atol=1e-7 * made.length)
    assert np.allclose(first.tip_rotation, pose.tip_rotation, rtol=0, atol=1e-6)
    assert np.allclose(first.chamber_length, pose.chamber_length, rtol=2e-6)
    for mine, other in zip(first.parts, pose.parts, strict=True):
        assert np.allclose(mine.tip_position, other.tip_position, rtol=0, atol=1e-7 * made.length)
        assert mine.bending_angle == pytest.approx(other.bending_angle, rel=1e-5)
        assert mine.stretch == pytest.approx(other.stretch, rel=1e-6)
    assert np.allclose(first.shape.position[-1], first.tip_position, rtol=0, atol=1e-12)
    assert abs(run.energy["imbalance"]) < 1e-9 * run.energy["exchanged"]


def test_two_halves_are_one_rod() -> None:
    half = Segment(replace(D25, length=0.03), RUBBER)
    joined = Body([half, half])
    asked = Dynamics(0.02, 2e-3, output_step=0.02, release=True)
    loads = Loads((0.03, 0.0, 0.02))
    two = Simulation(joined, loads, asked, Series(np.zeros(1), np.zeros((1, 6))), NOTHING, intervals=2)
    one = simulated(asked, loads, intervals=4)
    a, b = (tip(list(simulation.run())[-1]) for simulation in (two, one))
    assert np.allclose(a, b, rtol=0, atol=1e-11)


# --- release ----------------------------------------------------------------------------------------------------------


def test_let_go_it_swings_at_its_natural_frequency() -> None:
    """Time from one crossing of the axis to the one two periods later, at steps of 1 ms."""
    asked = Dynamics(0.3, 1e-3, output_step=1e-3, release=True)
    outputs = list(simulated(asked, Loads((0.002, 0.0, 0.0))).run())
    x, t = np.array([tip(output)[0] for output in outputs]), np.array([output.instant.time for output in outputs])
    # The first mode alone, as far as a tip can tell: a mean over a tenth of the period takes out what is quick.
    window = np.hanning(47)[1:-1]
    x, t = np.convolve(x, window / window.sum(), "valid"), t[22:-22]
    k = np.flatnonzero((x[:-1] > 0) & (x[1:] <= 0))
    crossings = t[k] + (t[k + 1] - t[k]) * x[k] / (x[k] - x[k + 1])
    period = np.mean(np.diff(crossings))
    found = modes(D25, RUBBER, [0.0, 0.0, 0.0]).found
    assert found is not None
    assert 1 / period == pytest.approx(found.modes[0].frequency, rel=2e-3)


# --- what drives it ---------------------------------------------------------------------------------------------------


def test_a_lag_is_exact() -> None:
    rows = Series(np.array([0.0, 0.1, 0.1, 0.3]), np.array([[0.0], [0.0], [1.0], [3.0]]))
    chambers = Chambers(rows.delayed(0.05), 0.04, np.zeros(1))
    for t in (0.0, 0.1, 0.15):
        assert chambers.at(t)[0] == pytest.approx(0.0, abs=1e-15)
    late, slope = 0.1, 10.0
    exact = 1 + slope * (late - 0.04) - (1 - 0.04 * slope) * np.exp(-late / 0.04)
    assert chambers.at(0.25)[0] == pytest.approx(exact, rel=1e-12)
    assert chambers.at(9.0)[0] == pytest.approx(3.0, rel=1e-12)
    fine = np.linspace(0.16, 0.3, 1401)
    values = np.array([chambers.at(t)[0] for t in fine])
    regulator = np.array([rows.delayed(0.05).at(t)[0] for t in fine])
    rate = np.gradient(values, fine)[1:-1]
    assert np.allclose(rate, ((regulator - values) / 0.04)[1:-1], rtol=1e-5)


def test_a_jump_is_between_two_steps() -> None:
    """A jump of the pressure gives the same motion wherever it falls, without damping and with long steps before."""
    late = Series(np.array([0.0, 0.0137, 0.0137]), np.array([[0.0] * 3, [0.0] * 3, [0.3, 0.0, 0.0]]) * BAR)
    now = Series(np.array([0.0, 0.0]), np.array([[0.0] * 3, [0.3, 0.0, 0.0]]) * BAR)
    later = list(simulated(Dynamics(0.0337, 1e-3, output_step=0.0337), pressures=late).run())[-1]
    at_once = list(simulated(Dynamics(0.02, 1e-3, output_step=0.02), pressures=now).run())[-1]
    assert np.allclose(tip(later), tip(at_once), rtol=0, atol=1e-9)
    assert later.energy.pressure_work == pytest.approx(at_once.energy.pressure_work, rel=1e-9)
    assert abs(at_once.energy.imbalance) < 1e-9 * at_once.energy.exchanged


def test_chosen_steps_keep_the_error_asked_for() -> None:
    pressures = Series(np.array([0.0, 0.03]), np.array([[0.0] * 3, [0.4, 0.0, 0.0]]) * BAR)
    errors, steps = [], []
    best = tip(list(simulated(Dynamics(0.1, 2.5e-4, damping=5e-3, output_step=0.1), pressures=pressures).run())[-1])
    for accuracy in (1e-4, 1e-6):
        asked = Dynamics(0.1, None, damping=5e-3, output_step=0.1, accuracy=accuracy)
        last = list(simulated(asked, pressures=pressures).run())[-1]
        errors.append(float(np.linalg.norm(tip(last) - best)) / D25.length)
        steps.append(last.steps)
    assert errors[0] < 5e-3
    assert errors[1] < 2e-4
    assert errors[1] < errors[0]
    assert steps[0] < steps[1] < 400


def test_the_error_of_chosen_steps_does_not_hang_on_how_long_the_run_is() -> None:
    """No error is known of the first steps behind a jump, so these are short against the swing and do not grow."""
    jump = Series(np.array([0.0, 0.01, 0.01]), np.array([[0.0] * 3, [0.0] * 3, [0.5, 0.0, 0.0]]) * BAR)
    kept = np.array([0.0, 0.2])

    def seen(duration: float, step: float | None = None) -> Array:
        asked = Dynamics(duration, step, damping=0.004, output_step=duration)
        run = simulated(asked, pressures=jump, kept=np.append(kept, duration)).run()
        next(run)
        return tip(next(run))

    best = seen(0.3, 1e-3)
    assert np.linalg.norm(seen(300.0) - best) < 1e-3 * D25.length


@pytest.mark.parametrize("wrong", [{"step": 1e-7}, {"step": 1e-3, "damping": 1e9}])
def test_a_step_in_which_rounding_is_all_there_is_counts_as_none(wrong: dict[str, float]) -> None:
    asked = Dynamics(**{"duration": 10 * wrong["step"], "output_step": 10 * wrong["step"], **wrong})
    run = dynamic(D25, RUBBER, [[0.0] * 3, [0.3 * BAR, 0.0, 0.0]], asked, times=[0.0, 0.1])
    assert run.steps[-1].status is Status.DIVERGED
    assert "rounding leaves a residual of" in run.steps[-1].message


@pytest.mark.parametrize(
    ("key", "value"),
    [
        *(("duration", value) for value in (0.0, -1.0, float("nan"), 1e9, "long")),
        *(("step", value) for value in (0.0, -1.0, float("inf"), True)),
        *(("output_step", 0.0), ("accuracy", 0.0), ("damping", -1.0), ("lag", -1.0), ("dead_time", -1.0)),
        *(("tip_mass", -1.0), ("rule", "euler"), ("start", "bent")),
    ],
)
def test_what_no_run_can_have_is_refused_with_its_name(key: str, value: Any) -> None:
    with pytest.raises(InputError, match=f"^{key}: expected "):
        Dynamics(**{"duration": 1.0, key: value})
    if key in ("damping", "lag", "tip_mass"):
        with pytest.raises(InputError, match=f"^{key}: expected "):
            modes(D25, RUBBER, [0.0] * 3, **{key: value})


def test_a_motion_that_cannot_go_on_says_when() -> None:
    """Without stiffening the pressure of a ramp has no equilibrium from some time on."""
    from softnlp import Coefficients

    times, rows = [0.0, 1.0], [[0.0] * 3, [8 * BAR] * 3]
    asked = Dynamics(1.0, 0.02, damping=0.02, output_step=0.1)
    run = dynamic(D25, material("Ecoflex 00-50", "yeoh"), rows, asked, times=times, coefficients=Coefficients(0.0, 0.0))
    last = run.steps[-1]
    assert last.status in (Status.NO_EQUILIBRIUM, Status.UNSTABLE_MATERIAL)
    assert "at t = " in last.message
    assert last.pose is None
    assert 1 < len(run.steps) < 11
    assert all(step.status is Status.SOLVED for step in run.steps[:-1])


@pytest.mark.slow
def test_random_runs_reach_their_end_and_none_does_so_falsely() -> None:
    """Steps of pressure up to the branch's end, releases, loads over time; each residual is evaluated again."""
    from benchmarks.dynamics import random

    found = random(60, seed=7)
    assert found["false"] == 0
    assert found["reached_the_end"] >= 0.96 * found["runs"]
    assert all(one["message"] for one in found["others"])


@pytest.mark.slow
def test_the_energy_section_moves_too() -> None:
    """It begins at its pose of statics, keeps the energy of a release, and swings as its potential says."""
    from softnlp import ENERGY, Coefficients

    kind: dict[str, Any] = {"conventions": ENERGY, "coefficients": Coefficients(modulus_factor=1.5)}
    P, loads = [0.6 * BAR, 0.2 * BAR, 0.0], Loads((0.03, 0.01, 0.0), gravity="hanging")
    pose = forward(D25, RUBBER, [P], loads=loads, numerics=EXACT, **kind).steps[0].pose
    run = dynamic(D25, RUBBER, P, Dynamics(0.03, 1e-3, output_step=0.03, release=True), loads=loads, **kind)
    assert pose is not None
    assert run.steps[0].pose is not None
    assert np.allclose(run.steps[0].pose.tip_position, pose.tip_position, rtol=0, atol=1e-7 * D25.length)
    assert np.allclose(run.steps[0].pose.shape.moment, pose.shape.moment, atol=1e-4 * np.abs(pose.shape.moment).max())
    assert abs(run.energy["imbalance"]) < 1e-7 * run.energy["exchanged"]
    found = modes(D25, RUBBER, P, loads=loads, **kind).found
    assert found is not None
    assert found.stable
    assert found.modes[0].kind == "bending"
