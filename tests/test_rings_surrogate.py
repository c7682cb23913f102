"""Responses between finite-element solutions: their stated error, their derivatives, and what they refuse."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from softnlp import robot
from softnlp.rings import RingError, of_robot, proportions, ranges, ring_surrogate
from softnlp.rings.elements import elements
from softnlp.rings.mesher import mesh
from softnlp.rings.response import response_on
from softnlp.rings.surrogate import _grid, deformed

MADE = robot("laparoscope-3")
BORES = (1.4e-3, 1.8e-3)
RANGE = (0.9, 1.4)


@pytest.fixture(scope="module")
def surrogate():
    return ring_surrogate(MADE, ranges(MADE, {"chamber_diameter": BORES}), RANGE, level=1)


def test_the_error_is_what_finite_elements_on_another_mesh_say(surrogate) -> None:
    assert set(surrogate.vary) == {"ring"}
    assert surrogate.error < 1e-3
    for bore in (1.45e-3, 1.7e-3):
        section = of_robot(replace(MADE, chamber_diameter=bore))
        fine = response_on(section, mesh(section, 3.0), RANGE, count=5)
        found = surrogate.at(replace(MADE, chamber_diameter=bore))
        for stretch in (0.9, 1.1, 1.4):
            assert found.shear(stretch) == pytest.approx(fine.shear(stretch), abs=max(surrogate.error, 5e-4))
            assert found.arms[0](stretch) == pytest.approx(fine.arms[0](stretch), abs=max(surrogate.error, 5e-4))


def test_derivatives_by_a_dimension_are_those_of_finite_elements(surrogate) -> None:
    """Of meshes that are deformed, differences have no noise; the size of the robot has no part."""
    D = ca.SX.sym("D")
    response = surrogate.at(replace(MADE, chamber_diameter=D))
    outputs = ca.vertcat(
        response.shear(1.3), response.circle_ratio(1.3), surrogate.margin(replace(MADE, chamber_diameter=D))
    )
    slope = ca.Function("slope", [D], [ca.jacobian(outputs, D)])(1.6e-3).full()[:, 0]
    middle = of_robot(replace(MADE, chamber_diameter=1.6e-3))
    base, h = mesh(middle), 2e-5
    at = []
    for bore in (1.6e-3 - h, 1.6e-3 + h):
        section = of_robot(replace(MADE, chamber_diameter=bore))
        at.append(response_on(section, deformed(base, middle, section), (0.9, 1.3), count=4))
    shear, circle = ((f(at[1]) - f(at[0])) / (2 * h) for f in (lambda r: r.shear(1.3), lambda r: r.circle_ratio(1.3)))
    assert slope[:2] == pytest.approx([shear, circle], rel=0.02)
    twice = replace(
        MADE,
        **{
            name: 2 * getattr(MADE, name)
            for name in (
                "outer_diameter",
                "lumen_diameter",
                "chamber_circle_diameter",
                "chamber_diameter",
                "chamber_wall",
            )
        },
    )
    assert surrogate.at(twice).shear(1.2) == pytest.approx(surrogate.at(MADE).shear(1.2), rel=1e-12)


def test_the_margin_is_of_the_ranges(surrogate) -> None:
    margins = [float(surrogate.margin(replace(MADE, chamber_diameter=d))) for d in (1.3e-3, 1.4e-3, 1.5e-3, 1.6e-3)]
    assert margins == pytest.approx([-0.5, 0.0, 0.5, 1.0])


def test_a_mesh_is_led_to_other_proportions() -> None:
    made = robot("laparoscope-9")
    other = replace(made, chamber_diameter=1.6e-3, lumen_diameter=4.5e-3, chamber_angle=made.chamber_angle * 0.99)
    before, after = of_robot(made), of_robot(other)
    base = mesh(before)
    led = deformed(base, before, after)
    assert led.triangles is base.triangles
    assert elements(led).weight.sum() * 6 == pytest.approx(np.pi * (5.7e-3**2 - 2.25e-3**2 - 9 * 1.2e-3**2), rel=1e-3)


@pytest.mark.parametrize("level", [1, 2])
def test_the_grid_determines_its_polynomials(level: int) -> None:
    places, terms = _grid(3, level)
    assert len(places) == len(terms) == (7 if level == 1 else 25)
    of = np.polynomial.chebyshev.chebvander(places, 4)
    matrix = [[np.prod([row[k, order] for k, order in enumerate(term)]) for term in terms] for row in of]
    assert np.linalg.cond(matrix) < 30


def test_what_cannot_be_made_is_named() -> None:
    with pytest.raises(RingError, match="expected level 1 or 2"):
        ring_surrogate(MADE, {"bore": (0.1, 0.2)})
    with pytest.raises(RingError, match=r"within the ranges, at ring 0\.5,.*narrow the ranges"):
        ring_surrogate(MADE, {"ring": (0.2, 0.5)}, level=1)


def test_proportions_are_those_of_the_robot() -> None:
    assert proportions(MADE)["ring"] == pytest.approx(2 * 1.15 / 8.05)
    found = ranges(MADE, {"outer_diameter": (11e-3, 12e-3), "chamber_wall": (0.4e-3, 0.5e-3)})
    assert set(found) == {"ring", "lumen", "circle"}
    assert found["circle"] == pytest.approx((8.05 / 12, 8.05 / 11))


@pytest.mark.thorough
def test_level_two_follows_two_proportions() -> None:
    box = ranges(MADE, {"chamber_diameter": BORES, "chamber_circle_diameter": (7.9e-3, 8.2e-3)})
    one, two = (ring_surrogate(MADE, box, RANGE, level) for level in (1, 2))
    assert two.error < one.error < 2e-3
