"""The rod's field and balances against the witness's explicit sums, and their exact solutions."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import casadi as ca
import numpy as np
import pytest
import witness
from designs import random_design, unit_vector
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation
from witness_section import Section as WitnessSection

from softnlp.model import rod
from softnlp.model.conventions import Coefficients
from softnlp.model.round_chambers import RoundChambers, deform
from softnlp.model.section import RodSection, rod_section

NO_WEIGHT = np.zeros(3)


def plain(sec: WitnessSection) -> RodSection:
    """Return the witness's section as the rod takes it."""
    return RodSection(sec.GA, sec.EA, *sec.EI, sec.GJ, sec.F_P, *sec.M_P[:2], 0.0, sec.L)


def field_function() -> ca.Function:
    """Return (x, section, f_e) -> dx/ds."""
    x, c = ca.SX.sym("x", rod.STATE_SIZE), ca.SX.sym("c", len(RodSection._fields))
    f_e = ca.SX.sym("f_e", 3)
    section = RodSection(*ca.vertsplit(c))
    v, u = RoundChambers.strains(None, section, (), *rod.in_body(x))  # type: ignore[arg-type]
    return ca.Function("field", [x, c, f_e], [rod.field(x, v, u, f_e, ca.DM.zeros(3)), v, u])


def curvature(section: RodSection) -> tuple[float, float]:
    """Return u_x, u_y without loads."""
    return section.pressure_moment_x / section.bending_x, section.pressure_moment_y / section.bending_y


FIELD = field_function()


class Drawn(NamedTuple):
    """A state of a random rod in the units of its EI and L, n and m in the witness's, N and M in ours."""

    section: WitnessSection
    f_e: np.ndarray
    state: np.ndarray
    witness_state: np.ndarray


def drawn(seed: int) -> Drawn:
    rng = np.random.default_rng(seed)
    problem = witness.scaled(random_design(rng).section)
    p, n, m, f_e = (scale * rng.normal(size=3) for scale in (1.0, 3.0, 2.0, 1.0))
    R = Rotation.random(random_state=rng).as_matrix()
    n = n + problem.sec.F_P * R[:, 2]
    ours = np.concatenate([p, R.T.ravel(), n - problem.sec.F_P * R[:, 2], m - R @ problem.sec.M_P])
    theirs = np.zeros(20 + len(problem.sec.PA))
    theirs[:18] = np.concatenate([p, R.ravel(), n, m])
    return Drawn(problem.sec, f_e, ours, theirs)


@given(st.integers(0, 100_000))
@settings(max_examples=60, deadline=None)
def test_the_field_is_the_witness_s_sum_over_chambers(seed: int) -> None:
    case = drawn(seed)
    expected = witness._field(case.section, case.f_e, case.witness_state[:, None], False)[:18, 0]
    found = np.asarray(FIELD(case.state, np.array(plain(case.section)), case.f_e)[0]).ravel()
    scale = np.abs(expected).max()
    dR = expected[3:12].reshape(3, 3)
    expected[12:15] -= case.section.F_P * dR[:, 2]
    expected[15:18] -= dR @ case.section.M_P
    np.testing.assert_allclose(found[:3], expected[:3], atol=1e-13 * scale)
    np.testing.assert_allclose(found[3:12].reshape(3, 3).T, expected[3:12].reshape(3, 3), atol=1e-13 * scale)
    np.testing.assert_allclose(found[12:], expected[12:18], atol=1e-12 * scale)


@given(st.integers(0, 100_000))
@settings(max_examples=30, deadline=None)
def test_the_field_does_not_depend_on_the_frame(seed: int) -> None:
    case = drawn(seed)
    Q = Rotation.random(random_state=np.random.default_rng(seed + 1)).as_matrix()

    def turned(x: np.ndarray) -> np.ndarray:
        R = x[3:12].reshape(3, 3).T
        return np.concatenate([Q @ x[:3], (Q @ R).T.ravel(), Q @ x[12:15], Q @ x[15:18]])

    first = np.asarray(FIELD(case.state, np.array(plain(case.section)), case.f_e)[0]).ravel()
    second = np.asarray(FIELD(turned(case.state), np.array(plain(case.section)), Q @ case.f_e)[0]).ravel()
    np.testing.assert_allclose(second, turned(first), atol=1e-11 * np.abs(first).max())


@given(st.integers(0, 100_000))
@settings(max_examples=30, deadline=None)
def test_along_the_field_force_and_moment_balance_and_the_rotation_stays_one(seed: int) -> None:
    case = drawn(seed)
    sec, R = case.section, case.state[3:12].reshape(3, 3).T
    dx = np.asarray(FIELD(case.state, np.array(plain(sec)), case.f_e)[0]).ravel()
    dp, dR, dN, dM = dx[:3], dx[3:12].reshape(3, 3).T, dx[12:15], dx[15:18]
    scale = np.abs(dx).max()
    # R^T R' is skew, so R stays orthonormal
    W = R.T @ dR
    np.testing.assert_allclose(W + W.T, 0, atol=1e-12 * scale)
    # wall and fluid together: they change by the weight and by p' x the force alone
    np.testing.assert_allclose(dN, -case.f_e, atol=1e-11 * scale)
    np.testing.assert_allclose(dM, -np.cross(dp, case.state[12:15]), atol=1e-10 * scale)


@given(st.integers(0, 100_000), st.floats(0, 1))
@settings(max_examples=30, deadline=None)
def test_the_arc_obeys_the_field_and_the_balances_at_both_ends(seed: int, s: float) -> None:
    sec = drawn(seed).section
    section = plain(sec)
    at = ca.SX.sym("s")
    arc = ca.Function("arc", [at], [rod.arc_state(at, *curvature(section))])
    slope = (np.asarray(arc(s + 1e-4)) - np.asarray(arc(s - 1e-4))).ravel() / 2e-4
    expected = np.asarray(FIELD(arc(s), np.array(section), NO_WEIGHT)[0]).ravel()
    size = 1 + np.abs(expected).max()
    np.testing.assert_allclose(slope, expected, atol=3e-7 * size * (1 + np.hypot(*sec.M_P[:2])) ** 2)
    np.testing.assert_allclose(np.asarray(rod.base_balance(arc(0.0))).ravel(), 0, atol=1e-15)
    tip = rod.tip_balance(arc(1.0), ca.DM.zeros(3), ca.DM.zeros(3))
    np.testing.assert_allclose(np.asarray(tip).ravel(), 0, atol=1e-12 * size)
    exact = witness.arc(sec)
    np.testing.assert_allclose(np.asarray(arc(1.0))[:3].ravel(), exact["tip_position"], atol=1e-13)
    np.testing.assert_allclose(np.asarray(arc(1.0))[3:12].reshape(3, 3).T, exact["tip_rotation"], atol=1e-12)


@given(st.integers(0, 1000), st.floats(-9, -1))
@example(1, -4.03)  # where series take the place of sine and cosine, and where they end
@example(2, -4.03)
@example(3, -3.97)
@settings(max_examples=60, deadline=None)
def test_the_arc_stays_smooth_where_the_curvature_vanishes(seed: int, exponent: float) -> None:
    direction = unit_vector(np.random.default_rng(seed))[:2]
    u_x, u_y = 10**exponent * direction / np.linalg.norm(direction)
    straight = RodSection(1.0, 1.0, 2.0, 0.5, 1.0, 0.3, 2.0 * u_x, 0.5 * u_y, 0.0, 1.0)
    found = np.asarray(rod.arc_state(ca.DM(1.0), *curvature(straight))).ravel()
    k = np.hypot(u_x, u_y)  # u = (u_x, u_y, 0); to fourth order in k
    p = [u_y * (0.5 - k**2 / 24), -u_x * (0.5 - k**2 / 24), 1 - k**2 / 6 + k**4 / 120]
    cancelled = 4e-16 / k if k >= 1e-4 else 0.0  # of 1 - cos k, where no series takes its place
    np.testing.assert_allclose(found[:3], p, rtol=0, atol=1e-15 + k**5 + cancelled)
    R = Rotation.from_rotvec([u_x, u_y, 0]).as_matrix()
    np.testing.assert_allclose(found[3:12].reshape(3, 3).T, R, rtol=0, atol=1e-15)
    gradient = ca.Function("g", [s := ca.SX.sym("s")], [ca.jacobian(rod.arc_state(s, *curvature(straight)), s)])
    assert np.all(np.isfinite(np.asarray(gradient(0.0))))


def test_the_base_is_clamped_at_the_origin_upright() -> None:
    case = drawn(11)
    p, R, N, M = (np.asarray(ca.DM(part)) for part in rod.unpack(ca.DM(case.state)))
    n, m = rod.wall_resultants(ca.DM(case.state), plain(case.section))
    np.testing.assert_array_equal(np.concatenate([N.ravel(), M.ravel()]), case.state[12:])
    theirs = case.witness_state
    np.testing.assert_array_equal(np.concatenate([p.ravel(), R.ravel()]), theirs[:12])
    np.testing.assert_allclose(np.asarray(ca.vertcat(n, m)).ravel(), theirs[12:18], rtol=1e-12)
    rows = np.asarray(rod.base_balance(ca.DM(case.state))).ravel()
    assert rows.size == 12
    np.testing.assert_array_equal(rows[:3], theirs[:3])
    np.testing.assert_allclose(rows[3:].reshape(3, 3).T, theirs[3:12].reshape(3, 3) - np.eye(3), atol=1e-16)


def test_the_tip_balance_is_the_witness_s() -> None:
    for seed in range(20):
        case = drawn(seed)
        F, M = np.array([0.3, -0.2, 0.5]), np.array([0.1, 0.7, -0.4])
        problem = replace(witness.scaled(random_design(np.random.default_rng(seed)).section), F_e=F, M_e=M)
        expected = witness.tip_imbalance(problem, case.witness_state[:, None])[:, 0]
        found = np.asarray(rod.tip_balance(ca.DM(case.state), ca.DM(F), ca.DM(M))).ravel()
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


def test_the_strains_are_those_of_the_constitutive_law() -> None:
    case = drawn(3)
    sec, R = case.section, case.state[3:12].reshape(3, 3).T
    _, v, u = (np.asarray(a).ravel() for a in FIELD(case.state, np.array(plain(sec)), case.f_e))
    n, m = R.T @ case.witness_state[12:15], R.T @ case.witness_state[15:18]
    np.testing.assert_allclose([sec.GA * v[0], sec.GA * v[1], sec.EA * (v[2] - 1) + sec.F_P], n, rtol=1e-12)
    np.testing.assert_allclose(u * [*sec.EI, sec.GJ], m, rtol=1e-12)


def test_hat_is_the_cross_product() -> None:
    a, b = np.array([1.0, -2.0, 0.5]), np.array([0.3, 0.7, -1.1])
    np.testing.assert_allclose(np.asarray(rod.hat(ca.DM(a)) @ b).ravel(), np.cross(a, b), atol=1e-15)


def test_every_entry_of_the_section_has_the_units_of_what_it_is() -> None:
    design = random_design(np.random.default_rng(8))
    w, L, F = design.section, 0.037, 0.21
    made = deform(design.robot, design.material, design.pressure, w.stretch, Coefficients())
    own = rod_section(made, w.stretch, L, F)
    density = design.material.density
    expected = {
        "shear": w.GA / F, "axial": w.EA / F, "bending_x": w.EI[0] / (F * L**2), "bending_y": w.EI[1] / (F * L**2),
        "torsion": w.GJ / (F * L**2), "pressure_force": w.F_P / F, "pressure_moment_x": w.M_P[0] / (F * L),
        "pressure_moment_y": w.M_P[1] / (F * L), "line_density": density * w.A * L / F, "length": w.stretch,
    }  # fmt: skip
    assert own._fields == tuple(expected)
    for name, value in expected.items():
        assert float(getattr(own, name)) == pytest.approx(value, rel=1e-9, abs=1e-9), name


@pytest.mark.parametrize("seed", range(6))
def test_units_only_change_the_numbers(seed: int) -> None:
    # the same rod integrated in metres and newtons, and in its own units
    design = random_design(np.random.default_rng(seed))
    w, robot = design.section, design.robot
    made = deform(robot, design.material, design.pressure, w.stretch, Coefficients())
    length, force, gravity = 0.037, 0.21, np.array([1.0, -2.0, 9.0])
    si = rod_section(made, w.L, 1.0, 1.0)
    own = rod_section(made, w.L / length, length, force)
    np.testing.assert_allclose([float(x) for x in si[:8]], list(plain(w))[:8], rtol=1e-9, atol=1e-12)

    def tip(section: RodSection, L: float, n: np.ndarray, m: np.ndarray) -> np.ndarray:
        c = np.array([float(x) for x in section])
        start = np.concatenate([np.zeros(3), np.eye(3).ravel(), n, m])
        weight = float(section.line_density) * gravity
        out = solve_ivp(lambda _, x: np.asarray(FIELD(x, c, weight)[0]).ravel(), (0, L), start, rtol=1e-9, atol=1e-12)
        return out.y[:, -1]

    n, m = np.array([0.02, -0.01, 0.05]), np.array([1e-4, 2e-4, -1e-4])
    one = tip(si, w.L, n, m)
    two = tip(own, w.L / length, n / force, m / (force * length))
    np.testing.assert_allclose(two[:3] * length, one[:3], atol=1e-7 * w.L)
    np.testing.assert_allclose(two[3:12], one[3:12], atol=1e-6)
    np.testing.assert_allclose(two[12:15] * force, one[12:15], atol=1e-6 * np.abs(one[12:15]).max())
