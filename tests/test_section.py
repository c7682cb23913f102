"""The deformed section against the witness, and what must hold of it by itself."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from designs import LAW_NAMES, SILICONES, body_of, choices_of, random_material, random_robot, rubber_of, silicone
from hypothesis import given, settings
from hypothesis import strategies as st
from witness_section import NoRoot, Unstable, balance_pressure, section

from softnlp.base.status import Status
from softnlp.model.conventions import AS_PRINTED, COEFFICIENT_SETS, REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.quantities import Model, quantities
from softnlp.model.robot import ROBOTS, Robot
from softnlp.model.round_chambers import RoundState, deform, reference_area
from softnlp.statics.branch import branch_function, stretch_on_branch

OWN_PRESSURE = Conventions("own pressure", True, 0.0, False)
THICK_FIBRE = Conventions("thick fibre", True, 0.1e-3, True)
CONVENTIONS = (REPRODUCTION, AS_PRINTED, OWN_PRESSURE, THICK_FIBRE)


def drawn(seed: int) -> tuple[Robot, Material, Coefficients]:
    """Return a random robot, silicone and coefficients, with every correction switched on."""
    rng = np.random.default_rng(seed)
    coefficients = Coefficients(
        elongation=rng.uniform(0, 0.8),
        bending=rng.uniform(0, 3),
        area=rng.uniform(0.8, 1.2),
        inertia=rng.uniform(0.8, 1.2),
        bore_fraction=rng.uniform(0, 1),
    )
    return random_robot(rng), random_material(rng), coefficients


def numbers(made: RoundState) -> dict[str, float]:
    """Return a section's scalars by name."""
    M_x, M_y = made.pressure_moment
    EI_x, EI_y = made.bending_stiffness
    named = {
        "A": made.area,
        "E_t": made.tangent_modulus,
        "EA": made.axial_stiffness,
        "GA": made.shear_stiffness,
        "EI_x": EI_x,
        "EI_y": EI_y,
        "GJ": made.torsional_stiffness,
        "F_P": made.pressure_force,
        "M_x": M_x,
        "M_y": M_y,
        "r_ci": made.bore_radius,
        "r_co": made.chamber_radius,
    }
    return {name: float(value) for name, value in named.items()}


@pytest.mark.parametrize("conventions", CONVENTIONS, ids=lambda c: c.name)
@pytest.mark.parametrize("seed", range(12))
def test_every_number_of_the_section_is_the_witness_s(seed: int, conventions: Conventions) -> None:
    robot, material, coefficients = drawn(seed)
    rng = np.random.default_rng(seed + 1000)
    body, rubber, choices = body_of(robot), rubber_of(material), choices_of(coefficients, conventions)
    stretch = rng.uniform(1.0, 1.9)
    share = rng.dirichlet(np.ones(robot.chamber_sets))
    while True:
        pressure = share * balance_pressure(body, rubber, stretch, choices) / robot.chambers_per_set
        try:
            w = section(body, rubber, pressure, choices)
            break
        except (NoRoot, Unstable):  # this law ends before; draw nearer to rest
            stretch = 1 + 0.8 * (stretch - 1)
    made = deform(robot, material, pressure, w.stretch, coefficients, conventions)
    EI_scale = sum(w.EI) / 2
    expected = {
        "A": w.A, "E_t": w.E_t, "EA": w.EA, "GA": w.GA, "EI_x": w.EI[0], "EI_y": w.EI[1], "GJ": w.GJ, "F_P": w.F_P,
        "M_x": w.M_P[0], "M_y": w.M_P[1], "r_ci": w.r_ci, "r_co": w.r_co,
    }  # fmt: skip
    zero = {"M_x": 1e-13 * EI_scale, "M_y": 1e-13 * EI_scale}
    for name, value in numbers(made).items():
        assert value == pytest.approx(expected[name], rel=1e-11, abs=zero.get(name, 0.0)), name
    np.testing.assert_allclose(np.array(made.centres, dtype=float), w.d, rtol=0, atol=1e-14)
    # and the witness's stretch is where the balance is
    slope = float(material.tangent_modulus(1.0)) * float(made.reference_area)
    assert abs(float(made.imbalance)) < 1e-12 * slope


@pytest.mark.parametrize("law", LAW_NAMES)
@pytest.mark.parametrize("name", SILICONES)
def test_the_branch_and_the_section_agree_with_the_witness_for_every_law(name: str, law: str) -> None:
    robot, material = ROBOTS["D20L60"], silicone(name, law)
    model = Model(robot, material)
    body, rubber = body_of(robot), rubber_of(material)
    total = balance_pressure(body, rubber, 1.5)
    pressure = np.array([0.6, 0.3, 0.1]) * total / 2
    column = np.concatenate([pressure if key == "pressure" else q.nominal for key, q in quantities(model).items()])
    point = stretch_on_branch(branch_function(model), column, pressure)
    w = section(body, rubber, pressure)
    assert point.status is Status.SOLVED
    assert point.stretch == pytest.approx(w.stretch, rel=1e-13)
    made = deform(robot, material, pressure, point.stretch, Coefficients())
    assert float(made.axial_stiffness) == pytest.approx(w.EA, rel=1e-11)
    assert float(made.bending_stiffness[0]) == pytest.approx(w.EI[0], rel=1e-11)


@given(seed=st.integers(0, 10_000), stretch=st.floats(1.0, 2.5))
@settings(max_examples=60, deadline=None)
def test_a_stretched_section_keeps_what_the_paper_keeps(seed: int, stretch: float) -> None:
    robot, material, coefficients = drawn(seed)
    pressure = np.zeros(robot.chamber_sets)
    rest, made = (deform(robot, material, pressure, s, coefficients) for s in (1.0, stretch))
    # silicone is incompressible, and so is the ring between bore and thread; the thread keeps its radius
    assert float(made.area) * stretch == pytest.approx(float(rest.area), rel=1e-12)
    ring = robot.chamber_radius**2 - robot.bore_radius**2
    assert made.chamber_radius == robot.chamber_radius
    assert robot.chamber_radius**2 - float(made.bore_radius) ** 2 == pytest.approx(ring / stretch, rel=1e-9)
    for name in ("outer_radius", "lumen_radius", "chamber_circle_radius"):
        assert float(getattr(made, name)) == pytest.approx(getattr(robot, name) / np.sqrt(stretch), rel=1e-13)


@given(seed=st.integers(0, 10_000), k=st.integers(1, 3))
@settings(max_examples=40, deadline=None)
def test_turning_the_pressures_turns_the_pressure_moment_only(seed: int, k: int) -> None:
    robot, material, coefficients = drawn(seed)
    pressure = np.random.default_rng(seed).uniform(0, 1e5, robot.chamber_sets)
    one = numbers(deform(robot, material, pressure, 1.3, coefficients))
    two = numbers(deform(robot, material, np.roll(pressure, k), 1.3, coefficients))
    turn = 2 * np.pi * k / robot.chamber_sets
    M = complex(one.pop("M_x"), one.pop("M_y")) * np.exp(1j * turn)
    scale = one["F_P"] * robot.chamber_circle_radius
    assert complex(two.pop("M_x"), two.pop("M_y")) == pytest.approx(M, abs=1e-12 * scale)
    assert two == pytest.approx(one, rel=1e-12)


def test_the_coefficients_are_linear_where_the_paper_has_them() -> None:
    robot, material = ROBOTS["D25L60"], silicone("Ecoflex 00-50")
    pressure, zero = np.array([1.5e5, 0.5e5, 0.0]), Coefficients(elongation=0, bending=0)

    def at(**changes: float) -> RoundState:
        return deform(robot, material, pressure, 1.4, replace(zero, **changes))

    bare = at()
    assert at(area=1.1).area == pytest.approx(1.1 * bare.area, rel=1e-14)
    assert at(area=1.1).bending_stiffness == pytest.approx(bare.bending_stiffness, rel=1e-14)
    assert at(inertia=1.1).bending_stiffness[0] == pytest.approx(1.1 * bare.bending_stiffness[0], rel=1e-14)
    assert at(inertia=1.1).torsional_stiffness == pytest.approx(bare.torsional_stiffness, rel=1e-14)  # k_i is for I
    assert at(elongation=0.4).axial_stiffness - bare.axial_stiffness == pytest.approx(0.4 * bare.pressure_force)
    # all of it on the thread's circle
    full = at(bore_fraction=1.0)
    assert float(full.pressure_area) == pytest.approx(np.pi * robot.chamber_radius**2, rel=1e-14)
    assert full.bore_radius == bare.bore_radius
    # Eq. (12): the mean pressure over all chambers times the inertia of all chambers
    r, r_cp = float(bare.bore_radius), float(bare.chamber_circle_radius)
    inertia = 6 * np.pi * r**4 / 4 + np.pi * r**2 * r_cp**2 * 3  # sum of sin^2 over a round layout is N / 2
    stiffened = at(bending=1.23)
    extra = np.subtract(stiffened.bending_stiffness, bare.bending_stiffness)
    np.testing.assert_allclose(extra, 1.23 * pressure.mean() * inertia, rtol=1e-12)


def test_the_printed_conventions_are_the_printed_equations() -> None:
    robot, material, coefficients = ROBOTS["D15L60"], silicone("Ecoflex 00-30"), COEFFICIENT_SETS["reproduction"]
    pressure = np.array([4e4, 2e4, 0.0])
    ours = deform(robot, material, pressure, 1.2, coefficients)
    printed = deform(robot, material, pressure, 1.2, coefficients, AS_PRINTED)
    fibre = 6 * np.pi * ((robot.chamber_radius + 1e-4) ** 2 - robot.chamber_radius**2)
    assert reference_area(robot, coefficients, REPRODUCTION) - reference_area(
        robot, coefficients, AS_PRINTED
    ) == pytest.approx(fibre, rel=1e-12)
    # the printed sign of the stiffening force adds to the pressure
    F_P, k_e = float(ours.pressure_force), coefficients.elongation
    assert float(ours.imbalance) == pytest.approx(
        float(ours.reference_area * ours.engineering_stress) - F_P + k_e * F_P * 0.2, rel=1e-12
    )
    assert float(printed.imbalance) == pytest.approx(
        float(printed.reference_area * printed.engineering_stress) - F_P - k_e * F_P * 0.2, rel=1e-12
    )
    # chambers' own pressures make the section stiffer about one axis than about the other
    assert printed.bending_stiffness[0] != pytest.approx(printed.bending_stiffness[1], rel=1e-3)
    assert float(ours.bending_stiffness[0]) == pytest.approx(float(ours.bending_stiffness[1]), rel=1e-12)


def test_symbols_and_numbers_give_the_same_section() -> None:
    robot, material, coefficients = drawn(5)
    pressure = ca.MX.sym("pressure", robot.chamber_sets)
    stretch, length = ca.MX.sym("stretch"), ca.MX.sym("D_r")
    symbolic = deform(replace(robot, outer_diameter=length), material, pressure, stretch, coefficients)
    f = ca.Function("f", [pressure, stretch, length], [symbolic.axial_stiffness, *symbolic.bending_stiffness])
    values = np.linspace(1e4, 5e4, robot.chamber_sets)
    made = deform(robot, material, values, 1.37, coefficients)
    found = [float(v) for v in f(values, 1.37, robot.outer_diameter)]
    expected = [float(made.axial_stiffness), *(float(v) for v in made.bending_stiffness)]
    assert found == pytest.approx(expected, rel=1e-14)
