"""The rings of thread against closed forms, their own refinement, the whole section, and the published table."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from softnlp import material, robot
from softnlp.model.energies import from_uniaxial, invariant_energy, mooney_rivlin, ogden
from softnlp.rings import (
    Circle,
    Curve,
    PlaneSection,
    Polygon,
    RingError,
    energy_of,
    of_robot,
    ring_response,
    robot_response,
)
from softnlp.rings.equilibrium import Equilibrium
from softnlp.rings.mesher import mesh
from softnlp.rings.response import follow, response_on

RANGE = (0.93, 1.75)
ECOFLEX = energy_of(material("Ecoflex 00-50"))
# Of an independent finite-element model: stretch, then force over uniaxial force and the circle's ratio.
STRETCHES = np.array([1.0, 1.1, 1.3, 1.5, 1.7])
FORCE = {
    "D25L60": (1.10, 1.12, 1.16, 1.20, 1.23),
    "D20L60": (1.11, 1.13, 1.17, 1.21, 1.24),
    "D15L60": (1.11, 1.13, 1.18, 1.22, 1.25),
    "D10L60": (1.13, 1.16, 1.21, 1.25, 1.29),
}
CIRCLE = {"D25L60": (1.0, 0.971, 0.926, 0.891, 0.864), "D10L60": (1.0, 0.977, 0.941, 0.914, 0.894)}


def force_ratio(response, stretch, law=ECOFLEX):
    """Return the derivative of the body's energy over that of its energy in uniaxial stress, by differences."""
    ratio, h = response.energy_ratio(law), 1e-3
    low, high = stretch - h, stretch + h
    rise = ratio(high) * law.uniaxial(high) - ratio(low) * law.uniaxial(low)
    return rise / (law.uniaxial(high) - law.uniaxial(low))


@pytest.mark.parametrize("name", FORCE)
def test_the_published_table_comes_out(name: str) -> None:
    response = robot_response(robot(name), RANGE)
    at = np.maximum(STRETCHES, 1.002)  # at 1 both forces are 0
    assert force_ratio(response, at) == pytest.approx(FORCE[name], rel=0.01)
    if name in CIRCLE:
        assert response.circle_ratio(STRETCHES) == pytest.approx(CIRCLE[name], rel=0.004)


def tube(a: float, b: float, held: float, stretch: float) -> float:
    """Mean of T of a tube from a to b whose radius `held` stays: r^2 = held^2 + (R^2 - held^2) / lambda."""
    x, w = np.polynomial.legendre.leggauss(40)
    R = (a + b) / 2 + (b - a) / 2 * x
    r = np.sqrt(held**2 + (R**2 - held**2) / stretch)
    T = (r / R) ** 2 + (R / (stretch * r)) ** 2
    return float((w * R * T).sum() / (w * R).sum())


@pytest.mark.parametrize("mirrors", [0, 3])
@pytest.mark.parametrize("outer_ring", [False, True])
def test_a_tube_with_a_ring_inside_or_outside(mirrors: int, outer_ring: bool) -> None:
    """The closed form: thread round a bore, or round the whole body with a free bore."""
    bore, body = Circle(0.0, 0.0, 3e-3), Circle(0.0, 0.0, 8e-3)
    inside = {"holes": (bore,), "outer_ring": True} if outer_ring else {"rings": (bore,)}
    section = PlaneSection(body, **inside, mirrors=mirrors)
    stretch = 1.3
    equilibrium = Equilibrium(section, mesh(section, 3.0), mooney_rivlin(2e3, 8e3))
    balance = follow(equilibrium, equilibrium.rest(), stretch)
    T = tube(3e-3, 8e-3, 8e-3 if outer_ring else 3e-3, stretch)
    assert balance.square == pytest.approx(T, rel=1e-4)
    density = 2e3 * (T + stretch**2 - 3) + 8e3 * (stretch**2 * T + stretch**-2 - 3)
    assert balance.energy / equilibrium.elements.weight.sum() == pytest.approx(density, rel=1e-3)


def test_thread_round_the_body_has_no_centres() -> None:
    section = PlaneSection(Circle(0, 0, 8e-3), (), (Circle(0, 0, 3e-3),), outer_ring=True, mirrors=3)
    found = ring_response(section, (0.95, 1.3))
    p, q = found.plane_stretches(1.3)
    assert p**2 + q**2 == pytest.approx(tube(3e-3, 8e-3, 8e-3, 1.3), rel=1e-3)
    with pytest.raises(RingError, match="no ring inside its body"):
        found.circle_ratio(1.3)


@pytest.fixture(scope="module")
def sector() -> Equilibrium:
    section = of_robot(robot("laparoscope-6"))
    return Equilibrium(section, mesh(section), ECOFLEX)


def test_free_holes_leave_uniaxial_stress() -> None:
    section = of_robot(robot("laparoscope-6"))
    free = replace(section, rings=(), holes=(*section.rings, *section.holes))
    equilibrium = Equilibrium(free, mesh(free), ECOFLEX)
    balance = follow(equilibrium, equilibrium.rest(), 1.5)
    area = equilibrium.elements.weight.sum()
    assert balance.energy == pytest.approx(area * float(ECOFLEX.uniaxial(np.array([1.5]))[0]), rel=1e-9)
    assert balance.force == pytest.approx(area * material("Ecoflex 00-50").engineering_stress(1.5), rel=1e-9)
    with pytest.raises(RingError, match="no ring"):
        ring_response(free)
    with pytest.raises(RingError, match=r"around 1, got 1\.1 to 2"):
        ring_response(section, (1.1, 2.0))


def test_refinement_changes_little(sector: Equilibrium) -> None:
    section = of_robot(robot("laparoscope-6"))
    fine = Equilibrium(section, mesh(section, 4.0), ECOFLEX)
    coarse, finer = (follow(e, e.rest(), 1.3) for e in (sector, fine))
    assert len(fine.mesh.triangles) > 2.5 * len(sector.mesh.triangles)
    ratio = [b.force / e.elements.weight.sum() for b, e in ((coarse, sector), (finer, fine))]
    assert ratio[0] == pytest.approx(ratio[1], rel=1e-3)
    assert coarse.rings[0, :2] == pytest.approx(finer.rings[0, :2], abs=1e-6)


def test_force_and_moment_are_derivatives_of_the_energy(sector: Equilibrium) -> None:
    """The force of a sector by its stretch; force and moment of a bent whole section by both."""
    at, h = follow(sector, sector.rest(), 1.2), 1e-4
    rise = [sector.solve(at, 1.2 + d).energy for d in (-h, h)]
    assert (rise[1] - rise[0]) / (2 * h) == pytest.approx(at.force, rel=1e-6)

    section = PlaneSection(Circle(0, 0, 5e-3), (Circle(2e-3, 1e-3, 1.5e-3),), (Circle(-2e-3, 0, 1e-3),))
    whole = Equilibrium(section, mesh(section), ECOFLEX)
    at = whole.solve(follow(whole, whole.rest(), 1.2), 1.2, (20.0, -30.0))
    for k, h in ((0, 0.1), (1, 0.1)):
        bent = [whole.solve(at, 1.2, at.curvature + d * h * np.eye(2)[k]).energy for d in (-1, 1)]
        assert (bent[1] - bent[0]) / (2 * h) == pytest.approx(at.moment[k], rel=1e-5)
    rise = [whole.solve(at, 1.2 + d, at.curvature).energy for d in (-1e-4, 1e-4)]
    assert (rise[1] - rise[0]) / 2e-4 == pytest.approx(at.force, rel=1e-6)


def test_the_sector_stands_for_the_whole_section() -> None:
    """Rings that turn and, of three chambers a set, one on a mirror line; the whole in the order of the robot."""
    made = replace(robot("laparoscope-9"), chamber_sets=2)
    sections = of_robot(made), of_robot(made, mirrors=0)
    part, whole = (response_on(s, mesh(s, 1.5), (0.9, 1.25), count=4) for s in sections)
    assert len(whole.arms) == made.chambers == len(part.chambers)
    assert whole.shear(1.25) == pytest.approx(part.shear(1.25), rel=2e-3)
    cast = [(float(x), float(y)) for x, y in made.chamber_centres()]
    assert np.array(whole.centres(cast, 1.25)) == pytest.approx(np.array(part.centres(cast, 1.25)), abs=2e-6)
    assert whole.circle_ratio(1.25) == pytest.approx(part.circle_ratio(1.25), rel=2e-4)


def test_half_a_section_bends_as_the_whole() -> None:
    """Both keep the ring on the x axis in its place, so that their curvatures are about the same line."""
    energies = []
    for mirrors in (0, 1):
        section = of_robot(robot("laparoscope-3"), mirrors)
        equilibrium = Equilibrium(section, mesh(section, 1.5), ECOFLEX)
        at = equilibrium.solve(follow(equilibrium, equilibrium.rest(), 1.1), 1.1, (30.0, 0.0))
        straight = equilibrium.solve(at, 1.1).energy
        assert at.moment[0] > 0
        energies.append((1 + mirrors) * np.array([at.energy - straight, straight]))
    assert energies[0] == pytest.approx(energies[1], rel=2e-3)
    half = response_on(section, equilibrium.mesh, (0.95, 1.1), count=4)
    assert [half.arms[ring](1.1) for ring, _ in half.chambers] == pytest.approx([half.arms[0](1.1)] * 3, abs=2e-3)


def test_fibres_of_a_bent_section(response) -> None:
    """Saint-Venant's solution for a body without rings, and between rings that carry a section's tension."""
    section = PlaneSection(Circle(0, 0, 5e-3), (), (Circle(0, 0, 2e-3),), mirrors=1)
    plain = Equilibrium(section, mesh(section), ECOFLEX)
    half = Curve((0.5,), 0.9, 1.1)
    free = replace(response, arms=(half,))
    shift, _ = shifts(plain, 1.0, 0.1, np.zeros((0, 2)))
    X = plain.mesh.nodes
    exact = (free.fibre_stretch(1.0, (0.0, -0.1), X.T) + free.fibre_stretch(1.0, (0.0, 0.1), X.T) - 2) / (2 * 0.1**2)
    assert shift - shift[0] == pytest.approx(exact - exact[0], abs=1e-3 * 25e-6)

    made = robot("D25L60")
    section = of_robot(made, 1)
    ringed = Equilibrium(section, mesh(section, 1.5), ECOFLEX)
    at = follow(ringed, ringed.rest(), 1.2)
    pull = np.outer(np.full(3, at.force / 3), [1.0, 0.0])
    _, shift = shifts(ringed, 1.2, 8.0, pull)
    of = robot_response(made, RANGE)
    centres = np.array([ring.centre for ring in section.rings])
    told = [of.fibre_stretch(1.2, (0.0, -k), centres.T) - 1.2 for k in (8.0, -8.0)]
    told = (told[0] + told[1]) / (2 * 8.0**2)
    assert shift[1] - shift[0] == pytest.approx(told[1] - told[0], rel=0.15)


def shifts(equilibrium, stretch, curvature, pull):
    """Return what a curvature along x moves nodes and rings in x by, over the curvature."""
    at = follow(equilibrium, equilibrium.rest(), stretch)
    bent = [equilibrium.solve(at, stretch, (k, 0.0), pull * k) for k in (curvature, -curvature)]
    return [
        (of[0][:, 0] - of[1][:, 0]) / (2 * curvature) for of in zip(*((b.places, b.rings) for b in bent), strict=True)
    ]


def test_a_force_on_a_ring_does_the_work_that_the_energy_gains() -> None:
    section = PlaneSection(Circle(0, 0, 5e-3), (Circle(-2.5e-3, 0, 1.2e-3), Circle(2e-3, 0.5e-3, 1.5e-3)))
    equilibrium = Equilibrium(section, mesh(section, 1.5), ECOFLEX)
    at = equilibrium.solve(equilibrium.rest(), 1.05)
    force, h = np.array([[0.0, 0.0], [8.0, -4.0]]), 0.05
    low, high = (equilibrium.solve(at, 1.05, forces=force * (1 + side)) for side in (-h, h))
    moved = high.rings[1, :2] - low.rings[1, :2]
    assert moved @ force[1] > 0
    assert high.energy - low.energy == pytest.approx(force[1] @ moved, rel=1e-3)
    assert (high.rings[0] == low.rings[0]).all()


@pytest.mark.parametrize("model", ["mooney-rivlin", "yeoh", "ogden", "linear"])
def test_one_exponent_gives_the_energy_of_each_law(model: str) -> None:
    """Finite elements with the law itself, beside the exponent, which knows of none; Ogden's is far from quadratic."""
    made, law = robot("laparoscope-6"), energy_of(material("Ecoflex 00-50", model))
    section = of_robot(made)
    own = Equilibrium(section, mesh(section), law)
    balance = follow(own, own.rest(), 1.4)
    response = robot_response(made, (0.9, 1.5))
    mean = balance.energy / own.elements.weight.sum() / float(law.uniaxial(np.array([1.4]))[0])
    assert response.energy_ratio(law)(1.4) == pytest.approx(mean, rel=0.02 if model == "ogden" else 5e-4)
    a = np.hypot(*balance.rings[0, :2]) / np.hypot(*section.rings[0].centre)
    assert response.circle_ratio(1.4) == pytest.approx(a, rel=2e-3)


def test_the_laws_agree_where_they_are_one() -> None:
    T, stretch = np.array([1.4, 2.5, 1.69]), np.array([1.6, 0.9, 1.3])
    one = mooney_rivlin(3e3, 5e3)
    others = [
        invariant_energy(lambda I1, I2: 3e3 * (I1 - 3) + 5e3 * (I2 - 3)),
        ogden((6e3, 2.0), (-10e3, -2.0)),
    ]
    for other in others:
        for a, b in zip(one.derivatives(T, stretch), other.derivatives(T, stretch), strict=True):
            assert b == pytest.approx(a, rel=2e-3, abs=20.0)
    plain = from_uniaxial(lambda s: 6e3 * (s - s**-2), 18e3)
    for a, b in zip(mooney_rivlin(3e3, 0).derivatives(T, stretch), plain.derivatives(T, stretch), strict=True):
        assert b == pytest.approx(a, rel=1e-4, abs=1.0)


@pytest.fixture(scope="module")
def response():
    return robot_response(robot("laparoscope-3"), (0.9, 1.6))


def test_curves_take_symbols_and_are_smooth_at_their_ends(response) -> None:
    s = ca.SX.sym("s")
    outputs = [*response.plane_stretches(s), response.circle_ratio(s), response.margin(s)]
    outputs += [x for centre in response.centres([(1.0, 0.0)] * 3, s) for x in centre]
    law = response.energy_ratio(ECOFLEX)
    f = ca.Function("f", [s], [ca.vertcat(*outputs, law(s))])
    for at in (0.85, 1.0, 1.3, 1.7):
        numbers = [*response.plane_stretches(at), response.circle_ratio(at), response.margin(at)]
        numbers += [x for centre in response.centres([(1.0, 0.0)] * 3, at) for x in centre]
        assert f(at).full()[:, 0] == pytest.approx([*numbers, law(at)], rel=1e-12)
    assert response.margin(0.85) < 0 < response.margin(1.0)
    e = ca.Function("e", [s], [law(s), ca.gradient(law(s), s), ca.hessian(law(s), s)[0]])
    for end in (response.low, response.high):
        for inside, outside in zip(e(end * (1 - 1e-9)), e(end * (1 + 1e-9)), strict=True):
            assert float(outside) == pytest.approx(float(inside), rel=1e-5)


def test_curves_hold_between_the_stretches_that_were_solved(response) -> None:
    section = of_robot(robot("laparoscope-3"))
    equilibrium = Equilibrium(section, mesh(section), mooney_rivlin(1.0, 0.0))
    assert response.error < 1e-6
    for stretch in (0.95, 1.17, 1.44):
        balance = follow(equilibrium, equilibrium.rest(), stretch)
        p, q = response.plane_stretches(stretch)
        assert p**2 + q**2 == pytest.approx(balance.square, rel=1e-6)
        assert response.circle_ratio(stretch) == pytest.approx(
            np.hypot(*balance.rings[0, :2]) / np.hypot(*section.rings[0].centre), rel=1e-6
        )


def test_a_range_that_is_not_reached_says_so() -> None:
    """Rings so near to each other that the silicone between them folds over the mesh."""
    tight = replace(robot("laparoscope-9"), chamber_diameter=1.85e-3)
    found = robot_response(tight, (0.9, 3.0))
    assert found.high < 2.9
    assert f"beyond stretch {found.high:.3g}" in found.stops
    assert found.low == 0.9


def test_rings_that_touch_are_refused() -> None:
    with pytest.raises(RingError, match=r"no silicone is left beside the ring .* move them apart"):
        robot_response(replace(robot("laparoscope-9"), chamber_diameter=2.0e-3))


def test_responses_are_kept_by_shape(response) -> None:
    assert robot_response(replace(robot("laparoscope-3"), length=0.1), (0.9, 1.6)) is response


def test_outlines_of_other_shapes() -> None:
    """A polygon of many corners is its circle; a square body and a semicircle are meshed to their area."""
    angle = np.linspace(0, 2 * np.pi, 25)[:-1]
    round_ring = Circle(2e-3, 0.0, 1.5e-3)
    scale = (np.pi / (12 * np.sin(np.pi / 12))) ** 0.5
    cornered = Polygon(
        tuple(
            (2e-3 + 1.5e-3 * scale * c, 1.5e-3 * scale * s) for c, s in zip(np.cos(angle), np.sin(angle), strict=True)
        )
    )
    body, bore = Circle(0.0, 0.0, 6e-3), Circle(-2e-3, 0.0, 1e-3)
    sections = [PlaneSection(body, (ring,), (bore,)) for ring in (round_ring, cornered)]
    one, other = (response_on(section, mesh(section), (0.9, 1.2), count=4) for section in sections)
    assert other.shear(1.2) == pytest.approx(one.shear(1.2), rel=5e-3)
    assert other.centres([cornered.centre], 1.2)[0] == pytest.approx(one.centres([round_ring.centre], 1.2)[0], abs=5e-6)

    square = Polygon(((-5e-3, -5e-3), (5e-3, -5e-3), (5e-3, 5e-3), (-5e-3, 5e-3)))
    half = np.linspace(-np.pi / 2, np.pi / 2, 13)
    semicircle = Polygon(tuple((0.5e-3 + 3e-3 * c, 3e-3 * s) for c, s in zip(np.cos(half), np.sin(half), strict=True)))
    section = PlaneSection(square, (semicircle,))
    made = mesh(section)
    equilibrium = Equilibrium(section, made, ECOFLEX)
    assert equilibrium.elements.weight.sum() == pytest.approx(section.area, rel=1e-12)
    assert follow(equilibrium, equilibrium.rest(), 1.2).force > 1.02 * section.area * material(
        "Ecoflex 00-50"
    ).engineering_stress(1.2)
