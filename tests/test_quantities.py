"""Every number of the model as a named quantity, and the model with symbols in place of its numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from math import inf, pi
from typing import Any

import casadi as ca
import numpy as np
import pytest
from designs import body_of, random_design, rubber_of, silicone
from witness_section import REPRODUCTION as PLAIN
from witness_section import section as witness_section

from softnlp.model.conventions import AS_PRINTED, Coefficients
from softnlp.model.laws import function_law
from softnlp.model.materials import Material
from softnlp.model.quantities import (
    Model,
    Quantity,
    contact_quantities,
    force_unit,
    quantities,
    quantity,
    section_function,
    with_symbols,
)
from softnlp.model.robot import ROBOTS
from softnlp.model.round_chambers import deform
from softnlp.model.tip import Given

COEFFICIENTS = Coefficients(0.3, 1.1, 0.97, 1.02, 0.2, 1.4)
MODEL = Model(ROBOTS["D15L60"], replace(silicone("Ecoflex 00-30", "ogden"), density=1040.0), COEFFICIENTS)

# name : unit, scale, lower bound, SI value. Lengths, pressures, densities and coefficients are never negative.
EXPECTED = {
    "pressure": ("Pa", 1e5, 0.0, [0.0, 0.0, 0.0]),
    "tip_force": ("N", 1.0, -inf, [0.0, 0.0, 0.0]),
    "tip_moment": ("N m", 0.01, -inf, [0.0, 0.0, 0.0]),
    "gravity": ("m/s^2", 10.0, -inf, [0.0, 0.0, 0.0]),
    "robot.outer_diameter": ("m", 15e-3, 0.0, [15e-3]),
    "robot.lumen_diameter": ("m", 5.4e-3, 0.0, [5.4e-3]),
    "robot.chamber_circle_diameter": ("m", 10.2e-3, 0.0, [10.2e-3]),
    "robot.chamber_diameter": ("m", 2.5e-3, 0.0, [2.5e-3]),
    "robot.chamber_wall": ("m", 0.5e-3, 0.0, [0.5e-3]),
    "robot.length": ("m", 60e-3, 0.0, [60e-3]),
    "robot.chamber_angle": ("rad", 56 * pi / 180, 0.0, [56 * pi / 180]),
    "material.mu1": ("Pa", 0.1186e6, -inf, [0.1186e6]),
    "material.b1": ("1", 0.3701, -inf, [0.3701]),
    "material.mu2": ("Pa", 94.57, -inf, [94.57]),
    "material.b2": ("1", 7.951, -inf, [7.951]),
    "material.density": ("kg/m^3", 1e3, 0.0, [1040.0]),
    "stiffening.elongation": ("1", 1.0, 0.0, [0.3]),
    "stiffening.bending": ("1", 1.0, 0.0, [1.1]),
    "corrections.area": ("1", 1.0, 0.0, [0.97]),
    "corrections.inertia": ("1", 1.0, 0.0, [1.02]),
    "corrections.bore_fraction": ("1", 1.0, 0.0, [0.2]),
}
WALL = {
    "wall_point": ("m", 60e-3, -inf, [0.0, 0.0, 0.0]),
    "wall_normal": ("1", 1.0, -inf, [1.0, 0.0, 0.0]),
    "tip_cap": ("m", 60e-3, 0.0, [0.0]),
    "chamber_reaction": ("1", 1.0, 0.0, [1.4]),
    "free_lengths": ("m", 60e-3, 0.0, [60e-3] * 6),
    "pressed": ("1", 1.0, -inf, [0.0] * 6),
    "force_error": ("N", 1.0, -inf, [0.0, 0.0, 0.0]),
    "moment_error": ("N m", 0.01, -inf, [0.0, 0.0, 0.0]),
    "gap_error": ("m", 60e-3, -inf, [0.0]),
}


@pytest.mark.parametrize(
    ("declare", "expected"),
    [(quantities, EXPECTED), (contact_quantities, {f"contact.{name}": entry for name, entry in WALL.items()})],
    ids=["model", "contact"],
)
def test_every_quantity_has_its_unit_scale_bounds_and_value(
    declare: Callable[[Model], Mapping[str, Quantity]], expected: Mapping[str, tuple[str, float, float, list[float]]]
) -> None:
    found = declare(MODEL)
    assert list(found) == list(expected)
    for name, (unit, scale, lower, nominal) in expected.items():
        q = found[name]
        assert (q.name, q.unit, q.lower, q.upper) == (name, unit, lower, inf), name
        assert q.scale == pytest.approx(scale, rel=1e-12), name
        np.testing.assert_allclose(q.nominal, nominal, rtol=1e-12, err_msg=name)
        assert q.symbol.shape == (len(nominal), 1)
        assert q.symbol.name() == name
        assert q.size == len(nominal)


def test_the_contact_s_quantities_are_the_fields_that_the_tip_takes() -> None:
    assert tuple(WALL) == Given._fields


def test_a_scale_is_never_0() -> None:
    # an angle of 0 where a set is one chamber, and a constant that is 0
    single = replace(ROBOTS["laparoscope-3"], chamber_angle=0.0)
    law = function_law("soft", lambda stretch, a, b: a * (stretch - 1) + b * (stretch - 1) ** 3, ["a", "b"])
    declared = quantities(Model(single, Material("own", law, {"a": 0.05, "b": 0.0})))
    assert declared["robot.chamber_angle"].scale == 1e-4
    assert declared["material.b"].scale == 1.0
    assert (declared["material.a"].unit, declared["material.a"].scale) == ("1", 0.05)
    negative = quantities(Model(single, silicone("Ecoflex 00-50", "ogden")))
    assert negative["material.mu2"].scale == pytest.approx(0.01479e6)


def test_a_number_a_sequence_and_an_array_are_columns() -> None:
    for nominal in (2, [2.0, 3.0], np.array([[1, 2], [3, 4]])):
        made = quantity("q", "1", nominal, scale=3.0, lower=-1.0, upper=5.0)
        assert made.nominal.dtype == float
        np.testing.assert_array_equal(made.nominal, np.ravel(nominal))
        assert made.symbol.shape == (np.size(nominal), 1)
        assert (made.scale, made.lower, made.upper) == (3.0, -1.0, 5.0)
    plain = quantity("q", "1", 2)
    assert (plain.scale, plain.lower, plain.upper) == (1.0, -inf, inf)


def test_the_model_with_its_own_values_is_the_model() -> None:
    model = replace(MODEL, conventions=AS_PRINTED)
    values = {name: 1.25 * q.nominal[0] for name, q in quantities(model).items() if q.size == 1}
    made = with_symbols(model, values)
    assert made.conventions is AS_PRINTED
    for name in ("outer_diameter", "lumen_diameter", "chamber_circle_diameter", "chamber_diameter", "chamber_wall"):
        assert getattr(made.robot, name) == 1.25 * getattr(model.robot, name)
    assert made.robot.length == 1.25 * model.robot.length
    assert made.robot.chamber_angle == 1.25 * model.robot.chamber_angle
    assert (made.robot.name, made.robot.chamber_sets, made.robot.chambers_per_set) == ("D15L60", 3, 2)
    assert made.material.density == 1.25 * 1040.0
    assert dict(made.material.constants) == {k: 1.25 * v for k, v in model.material.constants.items()}
    for f in fields(Coefficients):
        share = 1.0 if f.name in ("chamber_reaction", "modulus_factor") else 1.25  # of contact, energy section
        assert getattr(made.coefficients, f.name) == share * getattr(COEFFICIENTS, f.name)


def test_a_section_of_symbols_is_the_section_of_its_numbers() -> None:
    seen = []

    def build(numbers: Mapping[str, Any], stretch: object) -> list:
        seen.append(numbers)
        made = MODEL.section.at(numbers, numbers["pressure"], stretch)
        return [made.axial_stiffness, ca.vertcat(*made.bending_stiffness), numbers["gravity"]]

    function = section_function(quantities(MODEL), build)
    assert isinstance(seen[0]["pressure"], ca.SX)
    assert function.size_in(0) == (sum(q.size for q in quantities(MODEL).values()), 1)
    values = {name: q.nominal.copy() for name, q in quantities(MODEL).items()}
    values["pressure"][:], values["gravity"][:] = [6e4, 3e4, 1e4], [1.0, 2.0, 3.0]
    axial, bending, gravity = function(np.concatenate(list(values.values())), 1.2)
    made = deform(MODEL.robot, MODEL.material, values["pressure"], 1.2, COEFFICIENTS)
    assert float(axial) == pytest.approx(float(made.axial_stiffness), rel=1e-13)
    np.testing.assert_allclose(np.asarray(bending).ravel(), [float(x) for x in made.bending_stiffness], rtol=1e-13)
    np.testing.assert_array_equal(np.asarray(gravity).ravel(), [1.0, 2.0, 3.0])


@pytest.mark.parametrize("seed", range(6))
def test_the_unit_of_force_is_that_of_the_section_at_rest(seed: int) -> None:
    design = random_design(np.random.default_rng(seed))
    rest = witness_section(body_of(design.robot), rubber_of(design.material), [0.0] * design.robot.chamber_sets, PLAIN)
    unit = float(force_unit(Model(design.robot, design.material)))
    assert unit == pytest.approx((rest.EI[0] + rest.EI[1]) / 2 / design.robot.length**2, rel=1e-12)


def test_the_unit_of_force_takes_the_model_s_own_corrections_and_readings() -> None:
    plain = force_unit(Model(MODEL.robot, MODEL.material))
    assert float(force_unit(MODEL)) == pytest.approx(1.02 * float(plain), rel=1e-12)  # k_i is a factor of I
    assert float(force_unit(Model(MODEL.robot, MODEL.material, conventions=AS_PRINTED))) < 0.999 * float(plain)
    # in a section with two chambers the stiffnesses differ, and the unit is their mean
    two = replace(MODEL.robot, chamber_sets=2, chambers_per_set=1, chamber_angle=0.0)
    made = deform(two, MODEL.material, [0.0, 0.0], 1.0, Coefficients())
    EI_x, EI_y = (float(x) for x in made.bending_stiffness)
    assert abs(EI_x - EI_y) > 1e-2 * EI_x
    assert float(force_unit(Model(two, MODEL.material))) == pytest.approx((EI_x + EI_y) / 2 / 0.06**2, rel=1e-12)


def test_models_of_a_kind_differ_by_numbers_alone() -> None:
    other = Model(ROBOTS["D10L40"], silicone("Ecoflex 00-50", "ogden"))
    assert other.kind == MODEL.kind
    MODEL.check_kind(other)
    yeoh = silicone("Ecoflex 00-30", "yeoh")
    law = yeoh.law

    def rubber(**changes: object) -> Model:
        return replace(MODEL, material=replace(yeoh, law=replace(law, **changes)))

    unlike = [
        replace(MODEL, robot=replace(MODEL.robot, chamber_sets=4)),
        replace(MODEL, robot=replace(MODEL.robot, chambers_per_set=1)),
        replace(MODEL, material=yeoh),
        replace(MODEL, conventions=AS_PRINTED),
    ]
    for model in unlike:
        with pytest.raises(
            ValueError, match=r"^a model with other chambers, law or conventions needs a solver of its own$"
        ):
            MODEL.check_kind(model)
    kinds = [
        model.kind
        for model in (
            *unlike,
            rubber(),
            rubber(name="a"),
            rubber(formula=lambda stretch, **c: law.formula(stretch, **c)),
            rubber(modulus=lambda stretch, **c: stretch),
        )
    ]
    assert kinds[2] == kinds[4]
    assert len(set(kinds)) == len(kinds) - 1
