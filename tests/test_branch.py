"""The stretch reached from zero pressure, and where that branch ends, against the witness and by itself."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from designs import body_of, choices_of, random_material, random_robot, rubber_of, silicone
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq
from witness_section import NoRoot, Unstable, balance_pressure, section

from softnlp.base.status import Status
from softnlp.model.conventions import AS_PRINTED, REPRODUCTION, Coefficients, Conventions
from softnlp.model.quantities import Model, quantities
from softnlp.model.robot import ROBOTS, Robot
from softnlp.statics.branch import BranchPoint, _crossing, branch_function, stretch_on_branch


def branch_of(model: Model) -> Callable[[np.ndarray], BranchPoint]:
    """Return pressures [Pa] -> where the branch stands."""
    function, declared = branch_function(model), quantities(model)

    def at(pressure: np.ndarray) -> BranchPoint:
        column = np.concatenate([pressure if name == "pressure" else q.nominal for name, q in declared.items()])
        return stretch_on_branch(function, column, pressure)

    return at


def last_pressure(point: BranchPoint) -> np.ndarray:
    """Read the last pressures [Pa] with an equilibrium from a message."""
    found = re.search(r"last pressure with an equilibrium is ([\d., e+-]+) bar", point.message)
    assert found, point.message
    return 1e5 * np.array([float(word) for word in found.group(1).split(",")])


@pytest.mark.thorough
@given(
    seed=st.integers(0, 100_000),
    k_e=st.sampled_from([0.0, 0.41]),
    conventions=st.sampled_from([REPRODUCTION, AS_PRINTED]),
    stretch=st.floats(1.001, 2.3),
    factor=st.sampled_from([1.0, 3.0]),
)
@settings(max_examples=40, deadline=None)
def test_the_branch_is_the_witness_s(
    seed: int, k_e: float, conventions: Conventions, stretch: float, factor: float
) -> None:
    rng = np.random.default_rng(seed)
    robot, material = random_robot(rng), random_material(rng)
    coefficients = Coefficients(elongation=k_e)
    body, rubber, choices = body_of(robot), rubber_of(material), choices_of(coefficients, conventions)
    share = rng.dirichlet(np.ones(robot.chamber_sets))
    # the pressure of a stretch, or several times that, which is beyond the end of some branches
    pressure = factor * share * balance_pressure(body, rubber, stretch, choices) / robot.chambers_per_set
    at = branch_of(Model(robot, material, coefficients, conventions))
    point = at(pressure)
    try:
        expected = section(body, rubber, pressure, choices).stretch
    except (NoRoot, Unstable):
        # The witness looks for a limit first, the package takes what comes first along the branch.
        if point.status is Status.SOLVED:
            assert point.stretch > 5.9  # where the witness stops looking
            return
        assert point.status in (Status.NO_EQUILIBRIUM, Status.UNSTABLE_MATERIAL)
        last = last_pressure(point)
        assert np.all(last <= pressure)
        assert at(last).status is Status.SOLVED
        assert at(1.001 * last).status is point.status
        # and up to there it is one branch that rises
        stretches = [at(t * last).stretch for t in np.linspace(0, 1, 8)]
        assert stretches[0] == 1.0
        assert np.all(np.diff(stretches) > 0)
    else:
        assert point.status is Status.SOLVED
        assert point.fraction == 1.0
        assert point.stretch == pytest.approx(expected, rel=1e-10)


def test_zero_pressure_is_the_undeformed_robot() -> None:
    at = branch_of(Model(ROBOTS["D25L60"], silicone("Ecoflex 00-50")))
    assert at(np.zeros(3)) == BranchPoint(Status.SOLVED, 1.0, 1.0, "no pressure")
    small = at(np.array([1.0, 0.0, 0.0]))
    assert 1 < small.stretch < 1 + 1e-5


def test_a_limit_pressure_ends_the_branch_and_no_other_root_is_returned() -> None:
    slim = replace(ROBOTS["D20L60"], chamber_diameter=3e-3)  # whose GJ outlasts the limit
    model = Model(slim, silicone("Ecoflex 00-30", "yeoh"), Coefficients(elongation=0.0))
    at = branch_of(model)
    below, beyond = at(np.full(3, 1.5e5)), at(np.full(3, 4e5))
    assert below.status is Status.SOLVED
    assert beyond.status is Status.NO_EQUILIBRIUM
    assert "turns back" in beyond.message
    # it ends where the resistance over the chambers' area has its greatest value
    body, rubber, choices = body_of(model.robot), rubber_of(model.material), choices_of(model.coefficients)
    stretches = np.linspace(1, 4, 30001)
    totals = np.array([balance_pressure(body, rubber, s, choices) for s in stretches])
    assert beyond.fraction * 3 * 2 * 4e5 == pytest.approx(totals.max(), rel=1e-8)
    assert beyond.stretch == pytest.approx(stretches[totals.argmax()], abs=1e-3)
    np.testing.assert_allclose(last_pressure(beyond), totals.max() / 6, rtol=1e-5)


def inertia(robot: Robot, stretch: float, axis: int | None) -> float:
    """Return I_x, I_y (axis 0, 1) or J_z (None) of Eqs. (S3), (S4) without fibres, by hand [m^4]."""
    outer, lumen, circle = (d / 2 * stretch**-0.5 for d in
                            (robot.outer_diameter, robot.lumen_diameter, robot.chamber_circle_diameter))  # fmt: skip
    thread = robot.chamber_diameter / 2 + robot.chamber_wall
    bore = np.sqrt(thread**2 - (thread**2 - robot.chamber_diameter**2 / 4) / stretch)
    angles = np.array(robot.chamber_angles())
    arm = {0: np.sin(angles), 1: np.cos(angles), None: np.full(robot.chambers, np.sqrt(0.5))}[axis]
    one = np.pi * ((outer**4 - lumen**4) / 4 - np.sum(bore**4 / 4 + (bore * circle * arm) ** 2))
    return float(one * (2 if axis is None else 1))


# Their chambers, which the thread keeps wide, leave too little silicone at a stretch within the fitted range.
EIGHT = Robot("eight", 22.52e-3, 9.61e-3, 16.06e-3, 4.85e-3, 0.64e-3, 60e-3, 4, 2, np.pi / 4)
PAIR = Robot("pair", 20e-3, 1.08e-3, 10.54e-3, 7.5e-3, 0.82e-3, 60e-3, 2, 1, 0.0)
SLIM = replace(ROBOTS["D25L60"], chamber_diameter=2e-3)


@pytest.mark.parametrize(
    ("robot", "name", "law", "k_e", "lost"),
    [
        # stiffening keeps the stretch below 1 + 1 / k_e, and Yeoh's modulus for Dragon Skin 10 is positive up to 4.6
        (SLIM, "Dragon Skin 10", "yeoh", 0.2, "E_t"),
        (ROBOTS["D25L60"], "Ecoflex 00-50", "ogden", 0.41, "E_t"),
        (EIGHT, "Ecoflex 00-50", "mooney-rivlin", 0.41, "GJ"),
        (EIGHT, "Ecoflex 00-50", "linear", 0.41, "GJ"),
        (EIGHT, "Dragon Skin 10", "neo-hookean", 0.427, "GJ"),
        (PAIR, "Ecoflex 00-50", "neo-hookean", 0.41, "EI_y without the pressure's part"),
    ],
)
def test_a_stiffness_that_loses_its_sign_ends_the_branch(
    robot: Robot, name: str, law: str, k_e: float, lost: str
) -> None:
    at = branch_of(model := Model(robot, silicone(name, law), Coefficients(elongation=k_e)))
    beyond = at(np.full(robot.chamber_sets, 100e5))
    assert beyond.status is Status.UNSTABLE_MATERIAL
    assert f"a section whose {lost} loses its sign" in beyond.message
    by_hand = {
        "E_t": rubber_of(model.material).modulus,
        "GJ": lambda s: inertia(robot, s, None),
        "EI_y without the pressure's part": lambda s: inertia(robot, s, 1),
    }[lost]
    assert beyond.stretch == pytest.approx(brentq(by_hand, 1.2, 6), rel=1e-12)
    last = last_pressure(beyond)
    assert at(last).status is Status.SOLVED
    assert at(1.001 * last).status is Status.UNSTABLE_MATERIAL


def test_a_section_without_a_stiffness_at_rest_has_no_pose_at_any_pressure() -> None:
    crowded = Robot("crowded", 22.52e-3, 9.61e-3, 16.06e-3, 4.85e-3, 0.64e-3, 60e-3, 12, 2, np.pi / 12)
    at = branch_of(Model(crowded, silicone("Ecoflex 00-50")))
    for pressure in (np.zeros(12), np.full(12, 1e4)):
        point = at(pressure)
        assert (point.status, point.fraction) == (Status.UNSTABLE_MATERIAL, 0.0)
        assert "the section has no EA even without any pressure" in point.message


@pytest.mark.parametrize("law", ["neo-hookean", "yeoh", "ogden"])
def test_the_printed_sign_has_no_root_at_1_5_bar_in_all_sets(law: str) -> None:
    robot, material = ROBOTS["D25L60"], silicone("Ecoflex 00-50", law)
    pressure = np.full(3, 1.5e5)
    ours = branch_of(Model(robot, material))(pressure)
    assert ours.status is Status.SOLVED
    assert 1.6 < ours.stretch < 1.65  # measured: 35 to 42 mm of elongation of 60 mm
    printed = branch_of(Model(robot, material, conventions=AS_PRINTED))(pressure)
    assert printed.status in (Status.NO_EQUILIBRIUM, Status.UNSTABLE_MATERIAL)
    assert printed.fraction < 0.95


def test_small_pressures_stretch_as_the_linearised_balance() -> None:
    # sigma_e = E (lambda - 1) and F_P = sum P A_c to first order
    model = Model(ROBOTS["D15L60"], silicone("Ecoflex 00-10", "neo-hookean"))
    P = np.array([3.0, 1.0, 0.0])
    E = 3 * float(model.material.constants["mu0"])
    A_0, A_c = (np.pi * x for x in (7.5e-3**2 - 2.7e-3**2 - 6 * 1.25e-3**2, 1.25e-3**2))
    expected = 2 * P.sum() * A_c / (E * A_0)
    assert branch_of(model)(P).stretch - 1 == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("pole", [1.0, 0.75])
def test_a_crossing_before_a_pole_is_found(pole: float) -> None:
    """A fraction of the pressure may be infinite at the far end, or beyond a stretch on the way to it."""

    def excess(s: float) -> float:
        return 1 / (pole - s) - 3.0 if s < pole else float("inf")

    assert _crossing(excess, 0.0, 1.0) == pytest.approx(pole - 1 / 3, abs=1e-14)


@pytest.mark.parametrize("height", [1.0, 1e3, 1e17, 1e250])
@pytest.mark.parametrize("begin", [0.0, 8.0])
def test_a_jump_across_zero_is_closed_in_on(begin: float, height: float) -> None:
    """Next to a pole the far end is higher than any secant can make use of: to round-off all the same."""
    jump = begin + 1 / 3
    found = _crossing(lambda s: -1.0 if s < jump else height, begin, begin + 1)
    assert found == pytest.approx(jump, abs=4e-15)
