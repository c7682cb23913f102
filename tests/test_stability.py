"""Stability: columns that buckle at their known loads, and the witness's count of conjugate points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from cases import pose
from designs import GRAVITY, body_of, random_loads, random_material, random_pressures, random_robot, rubber_of, silicone
from slow import some_slow
from witness import NoConvergence, shoot
from witness_section import Section, section

from softnlp.base.status import Status
from softnlp.model.materials import Material
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.robot import ROBOTS, Robot
from softnlp.model.rod import Loads
from softnlp.nlp.transcription import MultipleShooting
from softnlp.statics.solver import PoseSolver
from softnlp.statics.stability import conjugate_points, transition_function
from softnlp.statics.step import Step
from softnlp.studies.forward import forward

SOFT, FIRM = silicone("Ecoflex 00-10"), silicone("Ecoflex 00-50")
GREENHILL = 7.8373  # rho A g L^3 / EI of a column that buckles under its weight
TALL = ROBOTS["D10L60"]


def at_rest(robot: Robot, material: Material) -> Section:
    return section(body_of(robot), rubber_of(material), np.zeros(robot.chamber_sets))


def solve(robot: Robot, material: Material, loads: Loads, pressure: object = (0, 0, 0), **changes: object) -> Step:
    step = forward(robot, material, pressure, loads=loads, **changes).steps[0]  # type: ignore[arg-type]
    assert step.status is Status.SOLVED, step.message
    return step


def critical(stable_at: Callable[[float], bool], low: float, high: float, steps: int = 9) -> float:
    """Return the load factor where stability is lost, by bisection."""
    assert stable_at(low)
    assert not stable_at(high)
    for _ in range(steps):
        middle = (low + high) / 2
        low, high = (middle, high) if stable_at(middle) else (low, middle)
    return (low + high) / 2


def stands(step: Step) -> bool:
    """Whether the pose is the straight one and stable; a robot that leans has lost it."""
    assert step.pose is not None
    return bool(step.pose.stable) and step.pose.bending_angle < 1e-3


@pytest.mark.parametrize("transcription", ["multiple-shooting", "collocation"])
def test_a_tall_soft_column_falls_standing_and_not_hanging(transcription: str) -> None:
    numerics = Numerics(transcription=transcription)
    standing = solve(TALL, SOFT, Loads(gravity=(0, 0, -GRAVITY)), numerics=numerics)
    hanging = solve(TALL, SOFT, Loads(gravity=(0, 0, GRAVITY)), numerics=numerics)
    sec = at_rest(TALL, SOFT)
    assert 1070 * sec.A * GRAVITY * sec.L**3 / sec.EI[0] > GREENHILL
    assert hanging.pose is not None
    assert hanging.pose.stable
    assert hanging.warnings == ()
    assert standing.pose is not None
    # the straight pose is an equilibrium, which must not pass for a stable one
    assert not stands(standing)
    if standing.pose.bending_angle < 1e-3:
        assert not standing.pose.stable
        assert any("not stable" in warning for warning in standing.warnings)
    firm = solve(TALL, FIRM, Loads(gravity=(0, 0, -GRAVITY)), numerics=numerics)
    assert stands(firm)


@pytest.mark.parametrize("pressure", [(0, 0, 0), (4e4, 0, 0)])
@pytest.mark.parametrize("moment", [(0, 0, 1e-3), (1e-9, 0, 0)], ids=["twists", "a little"])
def test_under_a_dead_tip_moment_stability_is_undefined(pressure: object, moment: object) -> None:
    """Also where the column is past its buckling load: undefined is not false."""
    for gravity in ((0, 0, 0), (0, 0, -GRAVITY)):
        step = solve(TALL, SOFT, Loads(tip_moment=moment, gravity=gravity), pressure)
        assert step.pose is not None
        assert step.pose.stable is None
        assert [warning for warning in step.warnings if "stab" in warning] == [
            "stability is undefined: a dead tip moment in space has no potential, so there is no energy to be least"
        ]


@pytest.mark.thorough
def test_a_column_buckles_under_its_weight_at_greenhill_s_density() -> None:
    robot = replace(TALL, length=0.15)
    sec = at_rest(robot, FIRM)

    def stable_at(number: float) -> bool:
        density = number * sec.EI[0] / (sec.A * GRAVITY * sec.L**3)
        return stands(solve(robot, replace(FIRM, density=density), Loads(gravity=(0, 0, -GRAVITY))))

    assert critical(stable_at, 6.5, 9.0, 6) == pytest.approx(GREENHILL, rel=0.01)


@pytest.mark.parametrize("pressure", [0.0, 6e4])
def test_a_column_buckles_under_a_tip_load_at_euler_s(pressure: float) -> None:
    # n = -F e3 tilted by theta: v_x = F theta / GA, so x' = theta (1 - F / EA + F / GA) and EI theta'' = -F x'
    robot, P = ROBOTS["D15L60"], np.full(3, pressure)
    sec = section(body_of(robot), rubber_of(FIRM), P)
    euler = np.pi**2 / 4 * sec.EI[0] / sec.L**2
    a = 1 / sec.GA - 1 / sec.EA
    expected = (np.sqrt(1 + 4 * a * euler) - 1) / (2 * a) / euler  # F (1 + a F) = F_euler
    assert abs(expected - 1) > 1e-3  # the correction is more than the tolerance below

    solver = PoseSolver(Model(robot, FIRM), Numerics())  # one for all loads

    def stable_at(factor: float) -> bool:
        return stands(solver.solve(P, Loads(tip_force=(0, 0, -factor * euler)))[0])

    assert critical(stable_at, 0.9, 1.1, 10) == pytest.approx(expected, abs=4e-4)


@pytest.mark.parametrize("intervals", [20, 60])
def test_the_index_counts_every_mode_of_a_straight_column(intervals: int) -> None:
    # a round clamped-free column loses one mode in each plane at 1, 9, 25, ... times Euler's load
    model = Model(replace(TALL, length=1.0), FIRM)
    sec = at_rest(model.robot, FIRM)
    euler = np.pi**2 / 4 * sec.EI[0] / sec.L**2
    posed = pose(model, method=MultipleShooting(intervals))
    transition = transition_function(posed.functions.field)
    for factor, expected in [
        (-5, 0),
        (0, 0),
        (0.99, 0),
        (1.01, 2),
        (8.8, 2),
        (9.2, 4),
        (24, 4),
        (26, 6),
        (48, 6),
        (50, 8),
    ]:
        solution = posed.solve({"tip_force": (0, 0, -factor * euler)})
        assert solution.holds(1e-10)
        nodes = solution.x[1:].reshape(-1, 18).T
        assert np.abs(nodes[:2]).max() < 1e-12  # straight
        constants = np.asarray(posed.problem.case_constants(solution.x, solution.p)).ravel()
        assert conjugate_points(transition.map(intervals), nodes, constants) == expected, factor


@pytest.mark.parametrize("seed", some_slow(8, quick=3))
def test_stability_is_the_witness_s_count_of_conjugate_points(seed: int) -> None:
    # loads that push the rod onto its base, straight or nearly so, at up to twice what it bears
    rng = np.random.default_rng([seed, 4])
    robot, material = random_robot(rng), random_material(rng)
    pressure, sec = random_pressures(rng, robot, material, most_stretch=1.3, most_bending=40)
    pressure = np.full(robot.chamber_sets, pressure.mean()) if seed % 2 else pressure
    sec = section(body_of(robot), rubber_of(material), pressure)
    loads = random_loads(rng, sec, force=0.1, moment=0.0)
    push = np.array([0, 0, -rng.uniform(0.5, 2.0) * np.pi**2 / 4 * sum(sec.EI) / 2 / sec.L**2])
    side = 0.0 if seed % 2 else 1.0
    loads = Loads(tip_force=push + side * np.asarray(loads.tip_force))
    step = solve(robot, material, loads, pressure)
    assert step.pose is not None
    shape = step.pose.shape
    EI = sum(sec.EI) / 2
    start = np.concatenate([shape.force[0] / (EI / sec.L**2), shape.moment[0] / (EI / sec.L)])
    try:
        w = shoot(sec, loads.tip_force, start=start)
    except NoConvergence:
        pytest.skip("the witness does not converge from here")
    assert np.linalg.norm(w.tip_position - step.pose.tip_position) < 1e-5 * robot.length
    assert step.pose.stable == (w.conjugate_points == 0)
