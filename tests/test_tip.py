"""The conditions at the tip against the sums over chambers that they stand for, Eqs. (9), (14) to (18)."""

from __future__ import annotations

from typing import Any, NamedTuple

import casadi as ca
import numpy as np
import pytest
import witness
from designs import random_design
from scipy.spatial.transform import Rotation

from softnlp.base.errors import InputError
from softnlp.model.dead_tip import DeadTip
from softnlp.model.rod import tip_balance
from softnlp.model.section import RodSection
from softnlp.model.tip import AtTip, Closure, Given, TipContact, contact_point, gap, length_error

CLOSURES = ("free", "weighted", "compliant", "rigid")
E3 = np.array([0.0, 0.0, 1.0])


class Drawn(NamedTuple):
    """A state at the tip of a random robot, loads, a wall and chambers, in one system of units."""

    PA: np.ndarray
    d: np.ndarray
    R: np.ndarray
    p: np.ndarray
    n: np.ndarray
    m: np.ndarray
    lengths: np.ndarray
    free: np.ndarray
    pressed: np.ndarray
    normal: np.ndarray
    point: np.ndarray
    force: np.ndarray
    moment: np.ndarray
    left_n: np.ndarray
    left_m: np.ndarray
    left_h: float
    cap: float
    k_c: float
    stiffness: float


def drawn(seed: int) -> tuple[Drawn, RodSection]:
    rng = np.random.default_rng(seed)
    sec = witness.scaled(random_design(rng).section).sec
    N = len(sec.PA)
    free = rng.uniform(0.9, 1.4, N)
    normal = rng.normal(size=3)
    case = Drawn(
        sec.PA,
        np.column_stack([sec.d, np.zeros(N)]),
        Rotation.random(random_state=rng).as_matrix(),
        *rng.normal(size=(3, 3)),
        free * rng.uniform(0.8, 1.1, N),
        free,
        (sec.PA > 0).astype(float),
        normal / np.linalg.norm(normal),
        *rng.normal(size=(5, 3)),
        *rng.uniform(0.1, 1.0, 4),
    )
    return case, RodSection(sec.GA, sec.EA, *sec.EI, sec.GJ, sec.F_P, *sec.M_P[:2], 0.0, sec.L)


def at_tip(case: Drawn, section: RodSection, unknowns: Any) -> AtTip:
    given = Given(
        *(ca.DM(v) for v in (case.point, case.normal, case.cap, case.k_c, case.free, case.pressed)),
        *(ca.DM(v) for v in (case.left_n, case.left_m, case.left_h)),
    )
    N = case.n - section.pressure_force * case.R @ E3
    M = case.m - case.R @ [section.pressure_moment_x, section.pressure_moment_y, 0.0]
    state = np.concatenate([case.p, case.R.T.ravel(), N, M])
    centres = [(float(x), float(y)) for x, y, _ in case.d]
    stiffness, force, moment = case.stiffness, ca.DM(case.force), ca.DM(case.moment)
    return AtTip(ca.DM(state), section, ca.DM(case.lengths), centres, stiffness, force, moment, ca.DM(unknowns), given)


def column(value: Any) -> np.ndarray:
    return np.asarray(ca.DM(value)).ravel()


def residual(contact: TipContact, at: AtTip) -> np.ndarray:
    """Return the balances at the tip under dead loads and contact, and what the contact asks for beside them."""
    force, moment = contact.tip(at)
    return column(ca.vertcat(tip_balance(at.state, at.force + force, at.moment + moment), *contact.rows(at)))


def balances(case: Drawn, T: np.ndarray, F_b: float) -> np.ndarray:
    """Eqs. (9), (16), (17) chamber by chamber: what the wall's n and m at the rod's end lack."""
    e3 = case.R @ E3
    push = F_b * case.normal
    pull = case.PA + T
    force = case.force + push + pull.sum() * e3
    moment = case.moment + np.cross(case.cap * e3, push)
    moment = moment + sum(case.R @ np.cross(d, a * E3) for d, a in zip(case.d, pull, strict=True))
    return np.concatenate([case.n - force - case.left_n, case.m - moment - case.left_m])


def reactions(case: Drawn, closure: str, T: float) -> np.ndarray:
    """T_i by its definition; chambers without pressure have none."""
    if closure == "compliant":
        each = case.k_c * case.stiffness * (case.free - case.lengths) / case.free
    else:
        each = np.full_like(case.free, T if closure == "rigid" else 0.0)
    return np.where(case.PA > 0, each, 0.0)


@pytest.mark.parametrize("wall", [True, False], ids=["wall", "no wall"])
@pytest.mark.parametrize("closure", CLOSURES)
def test_the_conditions_are_the_sums_over_chambers(closure: str, wall: bool) -> None:
    conditions = TipContact(closure, wall=wall)
    for seed in range(12):
        case, section = drawn(seed)
        F_b, T = 0.7, 0.4
        unknowns = [F_b] * wall + [T] * (closure == "rigid")
        at = at_tip(case, section, unknowns)
        expected = list(balances(case, reactions(case, closure, T), F_b * wall))
        tip = case.p + case.cap * case.R @ E3
        if wall:
            expected.append(case.normal @ (tip - case.point) - case.left_h)
        if closure == "rigid":  # some chamber is pressurised in every one of these
            expected.append(sum((case.free - case.lengths)[case.PA > 0]))
        np.testing.assert_allclose(residual(conditions, at), expected, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(column(conditions.reaction(at)), reactions(case, closure, T), rtol=1e-13)


@pytest.mark.parametrize("wall", [True, False], ids=["wall", "no wall"])
@pytest.mark.parametrize("closure", CLOSURES)
def test_there_are_as_many_equations_as_forces_to_find(closure: str, wall: bool) -> None:
    conditions = TipContact(closure, wall=wall)
    assert tuple(conditions.unknowns) == ("wall force",) * wall + ("chamber reaction",) * (closure == "rigid")
    assert tuple(conditions.equations) == ("contact gap",) * wall + ("chamber length",) * (closure == "rigid")
    assert {*conditions.unknowns.values()} <= {"N"}
    assert {*conditions.equations.values()} <= {"m"}
    assert conditions.needs_lengths is True
    case, section = drawn(1)
    rows = residual(conditions, at_tip(case, section, [0.3] * len(conditions.unknowns)))
    assert rows.size == 6 + len(conditions.unknowns)


@pytest.mark.parametrize("T", [0.0, 0.25, -3.0])
def test_rigid_chambers_without_pressure_have_no_reaction(T: float) -> None:
    # e_L is an empty sum then, and T = 0 takes its place, which keeps the system square and regular
    case, section = drawn(3)
    at = at_tip(case._replace(PA=0 * case.PA, pressed=0 * case.pressed), section, [0.5, T])
    conditions = TipContact("rigid")
    assert residual(conditions, at)[-1] == T
    np.testing.assert_array_equal(column(conditions.reaction(at)), 0.0)


def test_one_pressed_chamber_is_enough_for_the_length_equation() -> None:
    case, section = drawn(4)
    alone = np.zeros_like(case.pressed)
    alone[0] = 1.0
    at = at_tip(case._replace(pressed=alone), section, [0.5, 9.0])
    assert residual(TipContact("rigid"), at)[-1] == pytest.approx(case.free[0] - case.lengths[0], rel=1e-13)
    assert column(length_error(at))[0] == pytest.approx(case.free[0] - case.lengths[0], rel=1e-13)


def test_the_gap_is_the_signed_distance_of_the_cap_from_the_wall() -> None:
    for seed in range(6):
        case, section = drawn(seed)
        at = at_tip(case, section, [0.0])
        end = column(contact_point(at))
        np.testing.assert_allclose(end - case.p, case.cap * case.R[:, 2], atol=1e-14)
        # moved by any amount along the normal, the distance grows by it; along the wall, it does not change
        before = float(column(gap(at))[0])
        along = np.cross(case.normal, [0.3, -0.5, 0.8])
        moved = at_tip(case._replace(p=case.p + 0.37 * case.normal + along), section, [0.0])
        assert float(column(gap(moved))[0]) - before == pytest.approx(0.37, rel=1e-11)
        touching = at_tip(case._replace(point=end), section, [0.0])
        assert float(column(gap(touching))[0]) == pytest.approx(0.0, abs=1e-14)


def test_what_a_closure_leaves_is_what_the_balances_lack() -> None:
    case, section = drawn(5)
    still = case._replace(left_n=np.zeros(3), left_m=np.zeros(3), left_h=0.0)
    conditions = TipContact("weighted")
    rows = residual(conditions, at_tip(still, section, [0.2]))
    exact = still._replace(left_n=rows[:3], left_m=rows[3:6], left_h=rows[6])
    np.testing.assert_allclose(residual(conditions, at_tip(exact, section, [0.2])), 0.0, atol=1e-12)


def test_dead_loads_are_force_and_moment_alone() -> None:
    case, section = drawn(6)
    dead = DeadTip()
    assert (dict(dead.unknowns), dict(dead.equations), dead.needs_lengths, list(dead.rows(None))) == ({}, {}, False, [])
    given = dead.named({"tip_force": case.force, "tip_moment": case.moment})
    bare = at_tip(case, section, [])._replace(given=given, lengths=None, chamber_stiffness=None, unknowns=None)
    still = case._replace(left_n=np.zeros(3), left_m=np.zeros(3))
    rows = column(tip_balance(bare.state, *(ca.DM(v) for v in dead.tip(bare))))
    np.testing.assert_allclose(rows, balances(still, 0 * case.PA, 0.0), rtol=1e-12)
    assert dead.along(None) is None


def test_the_free_closure_with_a_force_is_the_dead_load_of_that_force() -> None:
    case, section = drawn(7)
    still = case._replace(left_n=np.zeros(3), left_m=np.zeros(3), cap=0.0)
    pushed = residual(TipContact("free"), at_tip(still, section, [0.9]))[:6]
    dead = at_tip(still._replace(force=case.force + 0.9 * case.normal), section, [])
    conditions = TipContact("free", wall=False)
    np.testing.assert_allclose(pushed, residual(conditions, dead), atol=1e-13)


@pytest.mark.parametrize("made", [list, tuple, lambda entries: ca.vertcat(*entries)], ids=["list", "tuple", "column"])
def test_a_closure_of_ones_own_is_taken_as_a_built_in_one(made: Any) -> None:
    case, section = drawn(2)
    at = at_tip(case, section, [0.7, 0.4])
    own = Closure(
        "alike",
        lambda at: made([pressed * at.unknowns[-1] for pressed in case.pressed]),
        lambda at: made([length_error(at)]),
    )
    conditions, same = TipContact(own), TipContact("rigid")
    np.testing.assert_array_equal(residual(conditions, at), residual(same, at))
    np.testing.assert_array_equal(column(conditions.reaction(at)), column(same.reaction(at)))


def test_a_closure_that_returns_too_many_entries_is_refused() -> None:
    case, section = drawn(2)
    at = at_tip(case, section, [0.7, 0.4])
    N = len(case.PA)
    reaction = Closure("long", lambda at: [0.0] * (N + 1))
    equation = Closure("two", lambda at: ca.DM.zeros(N), lambda at: [0.0, 0.0])
    for closure, text in (
        (reaction, f"reaction of closure 'long': expected {N} entries, got {N + 1}"),
        (equation, "equation of closure 'two': expected 1 entries, got 2"),
    ):
        with pytest.raises(InputError, match=f"^closure: {text}$") as refused:
            residual(TipContact(closure), at)
        assert refused.value.key == "closure"
