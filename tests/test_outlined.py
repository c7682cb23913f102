"""Chambers and bodies of any outline: areas, closed forms, symmetries, rules of manufacture, and their tables."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import cos, hypot, pi, sin

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import brentq, minimize

from softnlp import BAR, ENERGY, Coefficients, forward, material, robot
from softnlp.base.errors import InputError, RobotError
from softnlp.figures import section_figure
from softnlp.figures.mesh import body_solid, cores, mould_body, natural_body
from softnlp.model.conventions import UNIAXIAL
from softnlp.model.cubature import moment_rule, points_over
from softnlp.model.model import Model
from softnlp.model.outline_tables import outline_tables, robot_of_outlines
from softnlp.model.outlined import Annulus, Chamber, Sector, Semicircle, outlined_robot
from softnlp.model.plane import Circle, Polygon, gap, is_simple, room, turned, widened
from softnlp.model.potential import NOTHING, Strains
from softnlp.model.quantities import quantities
from softnlp.model.robot import Robot, check, violations
from softnlp.model.round_layout import as_round, turned_round
from softnlp.rings.outlined import outlined_response, pressed_areas
from softnlp.scenario.read import robot_of_scenario, scenario_from_text
from softnlp.statics.branch import branch_function
from softnlp.statics.unloaded_branch import followed

RUBBER = material("Ecoflex 00-50")
C_M = 1.284
mm = 1e-3
SQUARE = Polygon(((-2 * mm, 3 * mm), (2 * mm, 3 * mm), (2 * mm, 6 * mm), (-2 * mm, 6 * mm)))
MIXED = (
    Chamber(0, Semicircle(4 * mm, 2 * mm, 0.3), 0.5 * mm),
    Chamber(1, Circle(-5 * mm, -3 * mm, 1.5 * mm), 0.6 * mm),
    Chamber(1, turned(list(SQUARE.corners), 0.9), 0.4 * mm),
    Chamber(2, Sector(4 * mm, 7 * mm, -2.0, -1.2), 0.3 * mm),
)


def made(*chambers, **more):
    return outlined_robot("mine", chambers, 60 * mm, **{"outer_diameter": 20 * mm, **more})


def section(of, conventions=UNIAXIAL, silicone=RUBBER):
    model = Model(of, silicone, Coefficients(modulus_factor=C_M), conventions)
    return model, model.section


def unloaded(of, pressure, conventions=UNIAXIAL):
    """Return v_3 and b of the section without a load, on the branch from zero pressure."""
    model, _ = section(of, conventions)
    nominal = {name: q.nominal for name, q in quantities(model).items()} | {"pressure": pressure}
    column = np.concatenate([np.ravel(value) for value in nominal.values()])
    strains, fraction = followed(branch_function(model), column)
    assert fraction == 1.0
    return strains[0], strains[1:] / float(of.outer_radius)


# --- the plane --------------------------------------------------------------------------------------------------------


def test_walls_add_what_steiner_says():
    half = Chamber(0, Semicircle(7 * mm, 0.0, 0.0), 0.5 * mm)
    A, L, w = pi * 49 * mm**2 / 2, (pi + 2) * 7 * mm, 0.5 * mm
    assert half.bore().area == pytest.approx(A, rel=1e-12)
    assert half.threaded().area == pytest.approx(A + L * w + pi * w**2, rel=1e-5)
    sector = Chamber(0, Sector(5 * mm, 8 * mm, -0.7, 0.7), w)
    A, L = 0.7 * (64 - 25) * mm**2, 1.4 * 13 * mm + 6 * mm
    assert sector.bore().area == pytest.approx(A, rel=1e-12)
    assert sector.threaded().area == pytest.approx(A + L * w + pi * w**2, rel=1e-5)
    ring = Chamber(0, Annulus(5 * mm, 8 * mm), w)
    assert ring.threaded().area == pytest.approx(pi * (8.5**2 - 4.5**2) * mm**2, rel=1e-12)


def test_outlines_know_how_far_they_are_from_each_other():
    box = Polygon(((0.0, 0.0), (4.0, 0.0), (4.0, 2.0), (0.0, 2.0)))
    far = Polygon(((7.0, 0.0), (9.0, 1.0), (7.0, 2.0)))
    assert gap(box, far) == pytest.approx(3.0)
    assert gap(box, Circle(2.0, 5.0, 1.0)) == pytest.approx(2.0)
    assert gap(box, Circle(2.0, 1.0, 0.5)) < 0
    assert gap(box, Polygon(((1.0, -1.0), (2.0, -1.0), (2.0, 3.0), (1.0, 3.0)))) < 0  # a cross, without corners inside
    assert room(Circle(1.0, 1.0, 0.5), box) == pytest.approx(0.5)
    assert room(Polygon(((1.0, 0.5), (3.0, 0.5), (2.0, 1.5))), box) == pytest.approx(0.5)
    assert room(far, box) < 0
    assert not is_simple(Polygon(((0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0))))
    assert is_simple(widened(box, 0.3))


@given(st.floats(-3, 3), st.floats(0.1, 0.9), st.integers(0, 3))
@settings(max_examples=4)
def test_sums_over_a_section_are_exact_for_polynomials(turn, size, kind):
    body = Circle(0.0, 0.0, 10 * mm)
    forms = (
        Semicircle(6 * mm * size, 1 * mm, turn),
        Sector(3 * mm, 3 * mm + 5 * mm * size, turn, turn + 1.5),
        Annulus(4 * mm, 4 * mm + 4 * mm * size),
        turned(list(SQUARE.corners), turn),
    )
    area = Chamber(0, forms[kind], 0.5 * mm).threaded()
    points = np.array(points_over((body,), (area.outer,)))
    assert points[:, 2].min() > 0
    assert len(points) <= 78

    def f(x, y):
        return (0.3 + 90 * x - 40 * y) ** 11

    whole, hole = (weights @ f(*at.T) for at, weights in (moment_rule(body, 13), moment_rule(area.outer, 13)))
    assert points[:, 2] @ f(points[:, 0], points[:, 1]) == pytest.approx(whole - hole, rel=1e-8)


# --- the potential ----------------------------------------------------------------------------------------------------


def circles_of(plain, turn=0.0):
    """Return the chambers of a round layout by themselves, turned about the axis."""
    c, s = cos(turn), sin(turn)
    return [
        Chamber(n, Circle(float(c * x - s * y), float(s * x + c * y), plain.bore_radius), plain.chamber_wall)
        for n, (x, y) in zip(plain.set_of_chamber, plain.chamber_centres(), strict=True)
    ]


def test_circles_of_a_round_layout_are_that_robot():
    plain = robot("D25L60")
    sizes = {"outer_diameter": plain.outer_diameter, "lumen_diameter": plain.lumen_diameter}
    same = outlined_robot("same", circles_of(plain), plain.length, **sizes)
    how = {"conventions": ENERGY, "coefficients": Coefficients(modulus_factor=C_M)}
    pressure = [[0.8 * BAR, 0.0, 0.2 * BAR]]
    a, b = (forward(one, RUBBER, pressure, **how).steps[0].pose for one in (plain, same))
    assert np.abs(a.tip_position - b.tip_position).max() < 1e-12
    assert np.abs(a.chamber_length - b.chamber_length).max() < 1e-12
    assert as_round(same) is not None
    assert as_round(outlined_robot("turned", circles_of(plain, 0.4), plain.length, **sizes)) is None
    layout = turned_round(outlined_robot("turned", circles_of(plain, 0.4)[::-1], plain.length, **sizes))
    assert layout is not None
    assert float(layout.chamber_angle) == pytest.approx(float(plain.chamber_angle), rel=1e-12)


@pytest.mark.parametrize("reinforcement", ["chamber", "body"])
def test_forces_are_the_gradient_of_the_potential_of_any_section(reinforcement):
    chambers = MIXED if reinforcement == "chamber" else MIXED[:1]
    conventions = UNIAXIAL if reinforcement == "chamber" else ENERGY
    model, own = section(made(*chambers, reinforcement=reinforcement), conventions)
    U = own.potential(model.numbers, np.array([0.3, 0.1, 0.2][: model.sets]) * BAR)
    at = ca.SX.sym("at", 3)
    energy = ca.Function("U", [at], [U.value(Strains(at[0], at[1], at[2]))])
    tangent = U.tangent(Strains(at[0], at[1], at[2]), NOTHING)
    both = ca.Function("tangent", [at], [ca.vertcat(*tangent.g), ca.vertcat(*tangent.H)])
    lean = ca.Function("lean", [at], [ca.vertcat(*U.gradient(Strains(at[0], at[1], at[2]), NOTHING))])
    x, steps = np.array([1.2, 14.0, -9.0]), np.array([1e-5, 1e-3, 1e-3])
    g, H = (np.asarray(part).ravel() for part in both(x))
    assert np.allclose(np.asarray(lean(x)).ravel(), g, rtol=1e-10, atol=1e-14)
    for k, step in enumerate(steps):
        e = step * np.eye(3)[k]
        assert float(energy(x + e) - energy(x - e)) / (2 * step) == pytest.approx(g[k], rel=1e-6, abs=1e-9)
        row = (np.asarray(both(x + e)[0]) - np.asarray(both(x - e)[0])).ravel() / (2 * step)
        wanted = np.array([[H[0], H[1], H[2]], [H[1], H[3], H[4]], [H[2], H[4], H[5]]])[k]
        assert np.allclose(row, wanted, rtol=1e-6, atol=1e-9 * np.abs(H).max())


@given(st.floats(-pi, pi))
@settings(max_examples=3)
def test_chambers_that_are_turned_turn_the_forces(turn):
    def moved(chamber):
        form = chamber.form
        if isinstance(form, Semicircle):
            form = form._replace(turn=form.turn + turn)
        elif isinstance(form, Sector):
            form = form._replace(start=form.start + turn, end=form.end + turn)
        elif isinstance(form, Circle):
            form = Circle(*turned([form.centre], turn).corners[0], form.radius)
        else:
            form = turned(list(form.corners), turn)
        return replace(chamber, form=form)

    c, s = cos(turn), sin(turn)
    found = []
    for chambers, b in ((MIXED, (14.0, -9.0)), (map(moved, MIXED), (c * 14 + s * 9, s * 14 - c * 9))):
        model, own = section(made(*chambers))
        U = own.potential(model.numbers, np.array([0.3, 0.1, 0.2]) * BAR)
        g = U.tangent(Strains(1.2, *b), NOTHING).g
        found.append([float(ca.evalf(one)) if isinstance(one, ca.SX) else float(one) for one in g])
    (v, h_1, h_2), (w, k_1, k_2) = found
    assert w == pytest.approx(v, rel=1e-8)
    assert (k_1, k_2) == pytest.approx((c * h_1 - s * h_2, s * h_1 + c * h_2), rel=1e-7, abs=1e-9)


def test_a_half_cylinder_bends_as_an_independent_minimum_says():
    R, x0, w, r_r, P = 7 * mm, 1 * mm, 0.5 * mm, 10 * mm, 0.25 * BAR
    (v, b) = unloaded(made(Chamber(0, Semicircle(R, x0, 0.0), w)), [P])
    A_b = pi * R**2 / 2
    A_t = A_b + (pi + 2) * R * w + pi * w**2
    C10, C01, C20 = (C_M * RUBBER.constants[name] for name in ("C10", "C01", "C20"))

    def W(T, stretch):
        I1, I2 = T + stretch**2, stretch**2 * T + stretch**-2
        return C10 * (I1 - 3) + C01 * (I2 - 3) + C20 * (I1 - 3) ** 2

    def liner(stretch):  # per area, of the round liner of the same areas
        def at(R2):
            hoop2 = (A_t / pi - (A_t / pi - R2) / stretch) / R2
            return W(hoop2 + 1 / (stretch**2 * hoop2), stretch)

        return quad(at, A_b / pi, A_t / pi)[0] / ((A_t - A_b) / pi)

    x, weight = np.polynomial.legendre.leggauss(60)

    def over(f, low, high):
        at = (low + high) / 2 + (high - low) / 2 * x
        return (high - low) / 2 * weight @ np.array([f(one) for one in at])

    def thread(y):
        return 2 * np.sqrt((R + w) ** 2 - (y - x0) ** 2) if y >= x0 else 2 * (R + np.sqrt(w**2 - (x0 - y) ** 2))

    ends = (x0 - w, x0, x0 + R + w)
    x_c = sum(over(lambda y: y * thread(y), a, c) for a, c in pairwise(ends)) / A_t

    def half(radius, f, v, k):
        """Return the integral over a half disc about x0, smooth in the angle where a root ends."""

        def at(a):
            return 2 * radius**2 * np.cos(a) ** 2 * f(v + k * (x0 + radius * np.sin(a)))

        return over(at, 0, pi / 2)

    def U(at):
        v, k = at[0], at[1] * at[0] ** -0.5 / mm

        def fibre(stretch):
            return W(2 / stretch, stretch)

        body = over(lambda a: 2 * r_r**2 * np.cos(a) ** 2 * fibre(v + k * r_r * np.sin(a)), -pi / 2, pi / 2)
        hole = over(lambda y: thread(y) * fibre(v + k * y), ends[0], x0) + half(R + w, fibre, v, k)
        lined = over(lambda y: thread(y) * liner(v + k * y), ends[0], x0) + half(R + w, liner, v, k)
        return (body - hole + lined - half(R, liner, v, k) - P * A_t * (v + k * x_c)) * 1e3

    found = minimize(U, [1.1, 0.01], method="Nelder-Mead", options={"xatol": 1e-9, "fatol": 1e-15})
    assert v == pytest.approx(found.x[0], abs=3e-5)
    assert b[0] == pytest.approx(found.x[1] / mm, rel=3e-4)
    assert abs(b[1]) < 1e-6 * abs(b[0])


def test_an_annular_extender_stretches_as_its_closed_form_says():
    inner, outer, w, r_r, r_i, P = 5 * mm, 8 * mm, 0.5 * mm, 10 * mm, 3 * mm, 0.4 * BAR
    v, b = unloaded(made(Chamber(0, Annulus(inner, outer), w), lumen_diameter=2 * r_i), [P])
    C10, C01, C20 = (C_M * RUBBER.constants[name] for name in ("C10", "C01", "C20"))

    def W(hoop, stretch):
        across = 1 / (hoop * stretch)
        I1 = hoop**2 + stretch**2 + across**2
        return C10 * (I1 - 3) + C01 * (hoop**-2 + stretch**-2 + across**-2 - 3) + C20 * (I1 - 3) ** 2

    def energy(stretch):
        body = pi * ((r_r**2 - (outer + w) ** 2) + ((inner - w) ** 2 - r_i**2)) * W(stretch**-0.5, stretch)
        for held, low, high in ((outer + w, outer, outer + w), (inner - w, inner - w, inner)):
            body += quad(
                lambda R, h=held: 2 * pi * R * W(np.sqrt(h**2 - (h**2 - R**2) / stretch) / R, stretch), low, high
            )[0]
        return body

    def force(stretch):
        return (energy(stretch + 1e-5) - energy(stretch - 1e-5)) / 2e-5 - P * pi * ((outer + w) ** 2 - (inner - w) ** 2)

    assert v == pytest.approx(brentq(force, 1.0, 2.0), abs=1e-7)
    assert np.abs(b).max() < 1e-9


def test_a_tube_wound_as_a_whole_stretches_as_its_closed_form_says():
    r_b, r_r, P = 6 * mm, 10 * mm, 0.3 * BAR
    tube = made(Chamber(0, Circle(0.0, 0.0, r_b), 0.0), reinforcement="body")
    v, b = unloaded(tube, [P], ENERGY)
    C10, C01, C20 = (C_M * RUBBER.constants[name] for name in ("C10", "C01", "C20"))

    def force(stretch):  # P pi r_r^2 against the gradient of the tube's energy, its outside held
        def W(R, stretch):
            hoop2 = (r_r**2 - (r_r**2 - R**2) / stretch) / R**2
            across2 = 1 / (hoop2 * stretch**2)
            I1 = hoop2 + across2 + stretch**2
            I2 = 1 / hoop2 + 1 / across2 + stretch**-2
            return 2 * pi * R * (C10 * (I1 - 3) + C01 * (I2 - 3) + C20 * (I1 - 3) ** 2)

        up, down = (quad(W, r_b, r_r, args=(stretch + e,))[0] for e in (1e-5, -1e-5))
        return (up - down) / 2e-5 - P * pi * r_r**2

    assert v == pytest.approx(brentq(force, 1.01, 2.0), abs=2e-3)
    assert np.abs(b).max() * r_r < 1e-9
    one = made(Chamber(0, Semicircle(6 * mm, 1 * mm, 0.5), 0.0), reinforcement="body")
    (A,), ((x, y),) = pressed_areas(one)
    assert (A, x, y) == (pytest.approx(pi * r_r**2, rel=1e-12), 0.0, 0.0)  # wherever the chamber is


def test_two_halves_of_a_wound_body_share_it():
    halves = [Chamber(k, Semicircle(7 * mm, 1 * mm, 0.4 + k * pi), 0.5 * mm) for k in (0, 1)]
    areas, centres = pressed_areas(made(*halves, reinforcement="body"))
    assert areas == pytest.approx([pi * 100 * mm**2 / 2] * 2, rel=1e-5)
    assert np.allclose(centres[0], -centres[1], atol=1e-12)
    assert np.arctan2(*centres[0][::-1]) == pytest.approx(0.4, abs=1e-6)
    assert 1 * mm < hypot(*centres[0]) < 4 * mm


def test_the_response_of_a_section_turns_with_it():
    one, other = (made(Chamber(0, Semicircle(7 * mm, 1 * mm, turn), 0.5 * mm)) for turn in (0.0, 1.1))
    at = [0.9, 1.2, 1.6]
    for a, b in zip(outlined_response(one).values(at), outlined_response(other).values(at), strict=True):
        assert np.allclose(a, b, atol=2e-6)
    square, arms = outlined_response(one).values(at)
    assert np.all(square > 1)  # rings stiffen
    assert np.all((arms - 1) * (np.array(at) - 1) < 0)


def test_silicone_without_room_is_refused():
    one = made(Chamber(0, Annulus(5 * mm, 8 * mm), 0.5 * mm))
    with pytest.raises(RobotError, match="no room when it is stretched"):
        outlined_response(one)
    with pytest.raises(RobotError, match="no room when it is stretched"):
        check(one)
    inside = Chamber(1, Circle(2.5 * mm, 0.0, 1 * mm), 0.5 * mm)
    with pytest.raises(RobotError, match="has no thread"):
        check(made(*one.chamber_list, inside, reinforcement="body"))


# --- rules, tables, drawings ------------------------------------------------------------------------------------------

HEAD = """
study = "forward"
material = { name = "Ecoflex 00-50", model = "mooney-rivlin" }
pressure = { sequence_bar = [[0.1]] }
corrections = { conventions = "energy" }
robot = { outer_diameter_mm = 20.0, length_mm = 60.0 }
"""
HALF = "[[chamber]]\nset = 1\nsemicircle = { radius_mm = 7.0, x_mm = 1.0, wall_mm = 0.5 }\n"
FORM = "semicircle = { radius_mm = 7.0, x_mm = 1.0"


def refused(text):
    with pytest.raises(InputError) as caught:
        scenario_from_text(text, "mine.toml")
    assert "\n" not in str(caught.value)
    return str(caught.value)


BROKEN = {
    "outside": (
        "x_mm = 1.0",
        "x_mm = 3.0",
        "chambers_inside_wall: chamber 1 with its wall reaches 0.5 mm out of the body",
    ),
    "thin": ("x_mm = 1.0", "x_mm = 2.3", "between chamber 1 and the surface is 0.7 mm, less than the minimum 0.8"),
    "lumen": ("length_mm = 60.0", "length_mm = 60.0, lumen_diameter_mm = 4.0", "into the lumen"),
    "sets": ("set = 1", "set = 2", "expected sets from 1 on without a gap, got none with set = 1"),
    "far set": ("set = 1", f"set = {10**30}", "expected sets from 1 on without a gap, got none with set = 1"),
    "no wall": ("wall_mm = 0.5", "wall_mm = 0.0", "expected silicone between bore and thread"),
    "twice": (HALF, HALF + HALF, "chambers 1 and 2 with their walls overlap by"),
    "no form": (HALF, "[[chamber]]\nset = 1\n", "one of circle, sector, semicircle, annulus, polygon, got none"),
    "two forms": ("set = 1", "set = 1\nannulus = { inner_mm = 1, outer_mm = 2 }", "got semicircle and annulus"),
    "unknown": ("radius_mm = 7.0", "radius_m = 7.0", "unknown key"),
    "paper": ('"energy"', '"reproduction"', 'need [corrections] conventions = "energy"'),
    "no diameter": ("outer_diameter_mm = 20.0, ", "", "outer_diameter_mm: missing"),
    "design": ('study = "forward"', 'study = "design"', "takes the round layout of [robot] so far"),
    "no outline": (HALF, HALF + '[body]\noutline = "square"\n', "expected 'circle' or {x_mm = [...], y_mm = [...]}"),
    "both": (HALF, HALF + "[body]\noutline = { x_mm = [0, 1, 1], y_mm = [0, 0, 1] }\n", "not used with an outline"),
    "wire": (HALF, HALF + '[body]\nreinforcement = "wire"\n', "expected 'chamber' or 'body'"),
    "crossed": (FORM, "polygon = { x_mm = [0, 4, 4, 0], y_mm = [0, 4, 0, 4]", "an outline that does not cross itself"),
    "closed": (
        FORM,
        "polygon = { x_mm = [0, 4, 4, 0, 0], y_mm = [-2, -2, 2, 2, -2]",
        "chamber 1: expected each corner once, got corner 5 again as the next one",
    ),
    "flat": (FORM, "polygon = { x_mm = [1, 3, 5], y_mm = [0, 0, 0]", "an outline that does not cross itself"),
    "line": (FORM, "polygon = { x_mm = [0, 4], y_mm = [0, 4]", "a list of at least 3"),
    "unequal": (FORM, "polygon = { x_mm = [0, 4, 4], y_mm = [0, 4, 0, 4]", "as many numbers in y_mm as in x_mm"),
    "no room": (
        FORM,
        "annulus = { inner_mm = 5, outer_mm = 8",
        "[chamber]: thread leaves the silicone inside an annulus",
    ),
    "radii": (
        FORM,
        "sector = { inner_mm = 5, outer_mm = 4, from_deg = 0, to_deg = 9",
        "an inner radius below the outer",
    ),
}


@pytest.mark.parametrize("case", BROKEN)
def test_a_section_that_cannot_be_made_is_one_line(case):
    before, after, words = BROKEN[case]
    assert before in HEAD + HALF
    assert words in refused((HEAD + HALF).replace(before, after))


def test_a_chamber_that_does_not_fit_is_all_that_is_wrong():
    assert "more" not in refused((HEAD + HALF).replace("set = 1", "set = 0"))


def test_thin_walls_are_let_pass_with_leave():
    text = (
        (HEAD + HALF).replace("x_mm = 1.0", "x_mm = 2.3").replace("robot = {", 'robot = { allow = ["wall_thickness"],')
    )
    assert any("wall_thickness" in note for note in scenario_from_text(text, "mine.toml").warnings)


def test_keys_of_a_round_layout_beside_chambers_are_said():
    text = (HEAD + HALF).replace("robot = {", "robot = { chamber_diameter_mm = 4.5,")
    assert any("chamber_diameter_mm: not used" in note for note in scenario_from_text(text, "mine.toml").warnings)


def test_circles_of_a_round_layout_go_with_the_papers_section(tmp_path):
    plain = robot("D25L60")
    circles = "".join(
        f"[[chamber]]\nset = {n + 1}\ncircle = {{ x_mm = {1e3 * float(x)!r}, y_mm = {1e3 * float(y)!r}, bore_mm = 4.5, "
        "wall_mm = 0.5 }\n"
        for n, (x, y) in zip(plain.set_of_chamber, plain.chamber_centres(), strict=True)
    )
    head = HEAD.replace("[[0.1]]", "[[0.1, 0, 0]]").replace('"energy"', '"reproduction"')
    head = head.replace("outer_diameter_mm = 20.0, length_mm = 60.0", 'name = "D25L60"')
    found = scenario_from_text(head + circles, "mine.toml").robot
    assert type(found) is Robot
    for key in ("outer_diameter", "chamber_circle_diameter", "chamber_diameter", "chamber_angle", "length"):
        assert getattr(found, key) == pytest.approx(getattr(plain, key), rel=1e-12)
    path = tmp_path / "mine.toml"
    path.write_text(head + circles)
    assert robot_of_scenario(path)[1] == ()


def test_a_round_layout_may_be_wound_as_a_whole():
    text = HEAD.replace("[[0.1]]", "[[0.1, 0, 0]]") + '[body]\nreinforcement = "body"\n'
    text = text.replace("outer_diameter_mm = 20.0, length_mm = 60.0", 'name = "D25L60"')
    found = scenario_from_text(text, "mine.toml").robot
    assert found.reinforcement == "body"
    assert found.chambers == 6


def test_tables_bring_the_same_robot_back():
    outline = Polygon(((-9 * mm, -9 * mm), (9 * mm, -9 * mm), (9 * mm, 9 * mm), (-9 * mm, 9 * mm)))
    for one in (
        made(*MIXED, lumen_diameter=2 * mm),
        outlined_robot("box", MIXED[:1], 50 * mm, surface=outline),
        made(Chamber(0, Annulus(4 * mm, 7 * mm), 0.5 * mm), lumen_diameter=6 * mm),
    ):
        back = robot_of_outlines(outline_tables(one))
        assert outline_tables(back) == outline_tables(one)
        assert back.length == pytest.approx(one.length)


@pytest.mark.parametrize("reinforcement", ["chamber", "body"])
def test_solids_hold_the_silicone_of_the_section(reinforcement):
    one = made(
        MIXED[0], Chamber(1, Circle(-5 * mm, 0.0, 2 * mm), 0.5 * mm), lumen_diameter=2 * mm, reinforcement=reinforcement
    )
    A_0 = Model(one, RUBBER, conventions=ENERGY).section.areas({})[0]
    assert mould_body(one, facets=400).volume == pytest.approx(A_0 * one.length * 1e9, rel=2e-4)
    inside = cores(one, facets=400)
    assert [solid.name for solid in inside] == ["lumen", "chamber 1", "chamber 2"]
    assert inside[1].volume == pytest.approx(8 * pi * 60, rel=2e-4)
    stretched = natural_body(one)
    thin = replace(stretched.radii, outer=one.outer_radius * 1.3**-0.5)
    if reinforcement == "chamber":  # what is shorter around is longer along
        position = stretched.position * 1.3
        longer = body_solid(one, replace(stretched, position=position, radii=thin), facets=400).volume
        assert longer == pytest.approx(A_0 * one.length * 1e9, rel=0.1)  # (S2) is not volume-exact


def test_a_section_is_drawn_with_what_breaks_its_rules():
    one = made(*MIXED, Chamber(0, Semicircle(4 * mm, 6 * mm, 0.3), 0.5 * mm), lumen_diameter=1 * mm)
    figure = section_figure(one, violations(one), 1.2)
    labels = [artist.get_label() for artist in (*figure.axes[0].patches, *figure.axes[0].lines)]
    assert labels.count("bore") == 5
    assert "broken rule" in labels
    assert len(figure.axes) == 2
    with pytest.raises(InputError, match="expected a stretch above"):
        section_figure(one, (), 0.1)
