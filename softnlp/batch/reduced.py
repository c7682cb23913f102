"""The rod under known dead loads with the base moment as its only unknown: single shooting over many poses at once.

Without contact the force of wall and fluid is known in closed form, N(s) = F_e + f_e (L - s), which turns Eq. (2) for
it into an identity. A Runge-Kutta step is linear in the rates, so it keeps the identity to round-off: nodes found
with three unknowns solve the multiple-shooting equations of all eighteen states. They are judged by those.

States are in the units of `softnlp.statics.loadcase`. A step is a function (state, data, s, h) -> state a step h
further, where data stacks the constants c of the load case and the scaled tip force and moment.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from softnlp.model import rod
from softnlp.nlp.transcription import RK4, rk_step
from softnlp.statics.loadcase import RodFunctions, unpack_section

POSITION, ROTATION, MOMENT = slice(0, 3), slice(3, 12), slice(12, 15)
STATE = 15
_TURNING = slice(3, 15)  # rotation and moment; nothing depends on the position


@dataclass(frozen=True, eq=False)
class ReducedRod:
    """The steps of a rod under dead loads; N chambers.

    value : state [p, R, M] (15). directions : [p, R, M, d/dM(0) of each (15 x 3), certainty] (61); certainty is the
    least leading minor so far of the symmetric part of d(rotation)/dM(0): while it is positive there is no conjugate
    point. check : [p, R, M, gap, chamber lengths (N), bending angle, backbone length, curvature]; gap is the largest so
    far of the full equations between two nodes, curvature that of the axis at nodes.
    onward : [state, data, s, h] -> the state a step h further.
    ends : [state, data] -> [the state p, R, N, M at the tip (18), its six residuals].
    """

    value: ca.Function
    directions: ca.Function
    check: ca.Function
    onward: ca.Function
    ends: ca.Function


def reduced_rod(functions: RodFunctions) -> ReducedRod:
    """Build the steps from the field of a load case with dead loads."""
    nc = functions.field.size1_in(1)
    data, s, h = ca.SX.sym("data", nc + 6), ca.SX.sym("s"), ca.SX.sym("h")
    c, force, moment = data[:nc], data[nc : nc + 3], data[nc + 3 :]
    section = unpack_section(c)
    L = c[len(rod.RodSection._fields)]
    weight = L * ca.vertcat(section.load_x, section.load_y, section.load_z)

    def full(state: Any, at: Any) -> Any:
        """Return [p, R, N, M] with the force in closed form."""
        return ca.vertcat(state[:12], force + weight * (1 - at), state[MOMENT])

    def rates(state: Any, at: Any) -> Any:
        every = functions.field(full(state, at), c)
        return ca.vertcat(every[:12], every[15:18])

    def advance(state: Any) -> Any:
        k: list[Any] = []
        for row in RK4.a:
            moved = state + h * sum((a * k_j for a, k_j in zip(row, k, strict=True) if a), ca.SX.zeros(STATE))
            k.append(rates(moved, s + h * sum(row)))
        return state + h * sum((b * k_j for b, k_j in zip(RK4.b, k, strict=True)), ca.SX.zeros(STATE))

    state = ca.SX.sym("state", STATE)
    reached = advance(state)
    return ReducedRod(
        value=ca.Function("value", [state, data, s, h], [reached], {"cse": True}),
        directions=_directions(state, reached, [data, s, h]),
        check=_check(functions, full, state, reached, [data, s, h]),
        onward=ca.Function("onward", [ca.vertcat(state, data, s, h)], [reached], {"cse": True}),
        ends=ca.Function(
            "ends",
            [ca.vertcat(state, data)],
            [ca.vertcat(full(state, 1), rod.tip_balance(full(state, 1), force, moment))],
            {"cse": True},
        ),
    )


def _directions(state: Any, reached: Any, given: list[Any]) -> ca.Function:
    """Return the step with the derivatives by M(0) beside the state."""
    V, worst = ca.SX.sym("V", STATE, 3), ca.SX.sym("certainty")
    moved = ca.jtimes(reached, state, V)
    R = ca.reshape(reached[ROTATION], 3, 3)
    turns = []
    for j in range(3):
        W = ca.reshape(moved[ROTATION, j], 3, 3) @ R.T
        turns.append(ca.vertcat(W[2, 1] - W[1, 2], W[0, 2] - W[2, 0], W[1, 0] - W[0, 1]))
    U = ca.horzcat(*turns)
    certainty = ca.fmin(worst, smallest_minor(U + U.T))
    before = ca.vertcat(state, ca.vec(V), worst)
    after = ca.vertcat(reached, ca.vec(moved), certainty)
    return ca.Function("directions", [before, *given], [after], {"cse": True})


def smallest_minor(S: Any) -> Any:
    """Return the least leading minor of a symmetric 3x3 matrix: positive where it is positive definite."""
    second = S[0, 0] * S[1, 1] - S[0, 1] * S[1, 0]
    third = (
        S[0, 0] * (S[1, 1] * S[2, 2] - S[1, 2] * S[2, 1])
        - S[0, 1] * (S[1, 0] * S[2, 2] - S[1, 2] * S[2, 0])
        + S[0, 2] * (S[1, 0] * S[2, 1] - S[1, 1] * S[2, 0])
    )
    return ca.fmin(S[0, 0], ca.fmin(second, third))


def _check(functions: RodFunctions, full: Any, state: Any, reached: Any, given: list[Any]) -> ca.Function:
    """Return the step with the full equations' gap and the integrals along the rod beside the state."""
    data, s, h = given
    c = data[: functions.field.size1_in(1)]
    x = full(state, s)
    gap = ca.norm_inf(rk_step(functions.field, RK4)(x, c, h) - full(reached, s + h))
    gained = rk_integral(functions, x, c, h)
    worst, integrals, sharpest = ca.SX.sym("gap"), ca.SX.sym("integrals", gained.numel()), ca.SX.sym("curvature")
    before = ca.vertcat(state, worst, integrals, sharpest)
    sharper = larger_curvature(sharpest, [x, full(reached, s + h)], c)
    after = ca.vertcat(reached, ca.fmax(worst, gap), integrals + gained, sharper)
    return ca.Function("check", [before, *given], [after], {"cse": True})


def larger_curvature(known: Any, states: list[Any], c: Any) -> Any:
    """Return the largest of a curvature and those of the axis at states, per its deformed length."""
    for x in states:
        v, u = rod.strains(x, unpack_section(c))
        known = ca.fmax(known, ca.sqrt(u[0] ** 2 + u[1] ** 2) / v[2])
    return known


def rk_integral(functions: RodFunctions, x: Any, c: Any, h: Any) -> Any:
    """Return what the chamber lengths, the bending angle and the backbone gain in a step, by the step's own stages."""
    k: list[Any] = []
    rates: list[Any] = []
    for row in RK4.a:
        stage = x + h * sum((a * k_j for a, k_j in zip(row, k, strict=True) if a), ca.SX.zeros(x.numel()))
        k.append(functions.field(stage, c))
        rates.append(functions.lengths(stage, c))
    return h * sum((b * r for b, r in zip(RK4.b, rates, strict=True)), ca.SX.zeros(rates[0].numel()))
