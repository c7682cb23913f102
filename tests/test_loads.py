"""Loads of one's own: each against a dead load, a weight or a closed form that does the same."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np
import pytest

from softnlp import (
    BAR,
    MILLIMETRE,
    Body,
    Collocation,
    Constraint,
    IllPosedError,
    InputError,
    Load,
    MultipleShooting,
    Quantity,
    Segment,
    Status,
    case,
    material,
    problem,
    quantity,
    robot,
    solve,
)
from softnlp.model.load import AtPoint, AtTip, Wrench
from softnlp.model.quantities import Model
from softnlp.model.rod import unpack

D25, SOFT = robot("D25L60"), material("Ecoflex 00-50")
PRESSURE = np.array([0.5, 0.1, 0.0]) * BAR
SHOOTING, COLLOCATION = MultipleShooting(20), Collocation(5)


class Follower(Load):
    """A force that turns with the tip."""

    def quantities(self, model: Model) -> Sequence[Quantity]:
        return [quantity("follower.push", "N", np.zeros(3), scale=0.1)]

    def tip(self, at: AtTip) -> Wrench:
        return unpack(at.state)[1] @ at.given.push, 0


class Current(Load):
    """A force and a moment per length of the stretched rod, constant in the world."""

    def quantities(self, model: Model) -> Sequence[Quantity]:
        return [quantity("current.force", "N/m", np.zeros(3)), quantity("current.moment", "N", np.zeros(3))]

    def along(self, at: AtPoint) -> Wrench:
        return at.given.force, at.given.moment


class Cable(Load):
    """A cable of given length from the tip to an anchor, whose tension is unknown."""

    unknowns: Mapping[str, str] = {"tension": "N"}
    equations: Mapping[str, str] = {"cable": "m"}

    def quantities(self, model: Model) -> Sequence[Quantity]:
        return [quantity("cable.anchor", "m", [0.05, 0.0, 0.03]), quantity("cable.length", "m", 0.05)]

    def tip(self, at: AtTip) -> Wrench:
        towards = at.given.anchor - at.state[:3]
        return at.unknowns[0] * towards / ca.norm_2(towards), 0

    def rows(self, at: AtTip) -> Sequence[Any]:
        return [ca.norm_2(at.given.anchor - at.state[:3]) - at.given.length]

    def at_rest(self, values: Mapping[str, Any], tip: Any) -> dict[str, Any]:
        return {"cable.length": np.linalg.norm(values["cable.anchor"] - tip[:3])}


FOLLOWER, CURRENT, CABLE = Follower(), Current(), Cable()
BODY = Body([Segment(D25, SOFT)])


def solved(
    loads: Sequence[Load], values: dict[str, Any], body: Body = BODY, method: Any = SHOOTING, **more: Any
) -> Any:
    pose = case("pose", body, loads=loads, method=method)
    found = solve(problem([pose]), {"pressure": np.tile(PRESSURE, len(body.segments)), **values}, **more)
    assert found.status is Status.SOLVED, found.message
    return found


@pytest.mark.parametrize("engine", ["newton", "ipopt", "auto"])
@pytest.mark.parametrize("method", [SHOOTING, COLLOCATION], ids=["shooting", "collocation"])
def test_a_follower_force_is_the_dead_one_that_it_has_become(method: Any, engine: Any) -> None:
    push = np.array([0.02, 0.01, -0.05])
    found = solved([FOLLOWER], {"follower.push": push}, method=method, engine=engine)
    dead = solved([], {"tip_force": found["tip_rotation"] @ push}, method=method, engine=engine)
    np.testing.assert_allclose(found["tip_position"], dead["tip_position"], atol=1e-11)
    still = solved([], {"tip_force": push}, method=method, engine=engine)
    assert np.linalg.norm(found["tip_position"] - still["tip_position"]) > 1e-4


@pytest.mark.parametrize("method", [SHOOTING, COLLOCATION], ids=["shooting", "collocation"])
def test_a_force_per_length_as_large_as_the_weight_is_the_weight(method: Any) -> None:
    gravity = np.array([3.0, -2.0, 9.0])
    heavy = solved([], {"gravity": gravity}, method=method)
    model = BODY.models[0]
    line = model.section.at(model.numbers, PRESSURE, float(heavy["stretch"][0])).line_density
    found = solved([CURRENT], {"current.force": float(line) * gravity}, method=method)
    np.testing.assert_allclose(found["tip_position"], heavy["tip_position"], atol=1e-11)


def test_a_moment_per_length_is_held_at_the_base() -> None:
    """Of a straight rod: the base carries all of it, and the middle half."""
    m = np.array([2e-3, -1e-3, 3e-3])
    found = solved([CURRENT], {"current.moment": m, "pressure": np.zeros(3)})
    states = found.states("pose")
    L_0, F_0 = np.asarray(found.problem.compiled.units(found.solution.x, found.solution.p)).ravel()
    unit = L_0 * F_0
    np.testing.assert_allclose(states[15:18, 0] * unit, m * D25.length, rtol=1e-9)
    np.testing.assert_allclose(states[15:18, 10] * unit, m * D25.length / 2, rtol=1e-9)
    np.testing.assert_allclose(states[12:15], 0.0, atol=1e-12)


@pytest.mark.parametrize("engine", ["newton", "ipopt", "auto"])
def test_a_cable_is_the_dead_load_of_its_tension(engine: Any) -> None:
    anchor = np.array([0.05, 0.0, 0.03])
    found = solved([CABLE], {"cable.length": 0.048}, engine=engine)
    assert np.linalg.norm(found["tip_position"] - anchor) == pytest.approx(0.048, abs=1e-10)
    assert "cable" in [line.equation for line in found.residuals]
    tension = found["tip_forces"][0]
    dead = solved([], {"tip_force": tension * (anchor - found["tip_position"]) / 0.048}, engine=engine)
    np.testing.assert_allclose(dead["tip_position"], found["tip_position"], atol=1e-10)


def test_loads_act_together_on_every_kind_of_body() -> None:
    values = {
        "follower.push": (0.02, 0.01, -0.05),
        "current.force": (0.4, 0.1, 0.0),
        "cable.length": 0.049,
        "tip_moment": (1e-4, 2e-4, 0.0),
        "gravity": (0.0, 0.0, 9.81),
    }
    loads = [FOLLOWER, CABLE, CURRENT]  # the one that acts along the rod is not the first
    one = solved(loads, values, method=MultipleShooting(10))
    half = robot("D25L60", length=30 * MILLIMETRE)
    two = solved(loads, values, Body([Segment(half, SOFT)] * 2), MultipleShooting(5))
    same = Segment(D25, SOFT, along={"robot.outer_diameter": (25e-3, 25e-3)})
    varying = solved(loads, values, Body([same]), MultipleShooting(10))
    for other in (two, varying):
        np.testing.assert_allclose(other["tip_position"], one["tip_position"], atol=1e-10)
        np.testing.assert_allclose(other["tip_forces"], one["tip_forces"], rtol=1e-8)
    assert np.linalg.norm(one["tip_position"] - [0.05, 0.0, 0.03]) == pytest.approx(0.049, abs=1e-10)


def test_a_wall_holds_what_another_load_pushes() -> None:
    """A dead force on a blocked tip, as a load of one's own and as the package's."""
    wall = {"contact.wall_point": (0.0, 0.0, 0.0), "contact.wall_normal": (1.0, 0.0, 0.0)}
    free = case("free", BODY, method=None)
    lengths = {"contact.free_lengths": free.outputs["chamber_lengths"]}
    P = {"pressure": [0.8 * BAR, 0.0, 0.0], "contact.pressed": [1.0, 1.0, 0.0, 0.0, 0.0, 0.0]}

    class Dead(Follower):
        def tip(self, at: AtTip) -> Wrench:
            return at.given.push, 0

    pushed = case("blocked", BODY, wall="compliant", loads=[Dead()], given=lengths)
    found = solve(problem([free, pushed]), {**P, **wall, "follower.push": (-0.1, 0.0, 0.0)}, engine="newton")
    plain = case("blocked", BODY, wall="compliant", given=lengths)
    same = solve(problem([free, plain]), {**P, **wall, "tip_force": (-0.1, 0.0, 0.0)}, engine="newton")
    assert found.status is same.status is Status.SOLVED
    np.testing.assert_allclose(found["blocked_tip_forces"], same["blocked_tip_forces"], rtol=1e-9)
    assert abs(found["blocked_tip_position"][0]) < 1e-12


def test_what_a_load_takes_is_a_quantity_like_any_other() -> None:
    here = case("here", BODY, loads=[FOLLOWER], method=SHOOTING)
    there = case("there", BODY, loads=[Follower()], own=["pressure"], method=SHOOTING)
    aside = Constraint("aside", here.outputs["tip_position"] - np.array([0.0, 0.0, 0.062]), unit="m", scale=D25.length)
    posed = problem([here, there], free=["follower.push"], constraints=[aside])
    found = solve(posed, {"pressure": PRESSURE, "there.pressure": PRESSURE})
    assert found.status is Status.SOLVED, found.message
    np.testing.assert_allclose(found["here_tip_position"], [0.0, 0.0, 0.062], atol=1e-10)
    np.testing.assert_allclose(found["there_tip_position"], found["here_tip_position"], atol=1e-9)  # one push for both


def test_what_cannot_be_a_load_is_refused() -> None:
    class Clash(Follower):
        def quantities(self, model: Model) -> Sequence[Quantity]:
            return [quantity("gravity", "m/s^2", np.zeros(3))]

    class Furlongs(Follower):
        def quantities(self, model: Model) -> Sequence[Quantity]:
            return [quantity("follower.push", "furlong", np.zeros(3))]

    with pytest.raises(IllPosedError, match="a load has a quantity 'gravity', which is one of the body's"):
        case("pose", BODY, loads=[Clash()])
    with pytest.raises(InputError, match=r"unit: expected one of 1, rad, m, .*, got 'furlong'"):
        case("pose", BODY, loads=[Furlongs()])
    with pytest.raises(IllPosedError, match="an arc in closed form takes no loads"):
        case("pose", BODY, loads=[FOLLOWER], method=None)
    tapered = Body([Segment(D25, SOFT, along={"robot.outer_diameter": (25e-3, 24e-3)})])
    with pytest.raises(IllPosedError, match="take a body of one segment"):
        case("pose", tapered, wall="free")
