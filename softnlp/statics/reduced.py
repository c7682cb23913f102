"""The rod under known dead loads with the base moment as its only unknown: single shooting over many poses at once.

Without contact the force of wall and fluid is known in closed form, N(s) = F_e + f_e (L - s), which turns Eq. (2) for
it into an identity. A Runge-Kutta step is linear in the rates, so it keeps the identity to round-off: nodes found
with three unknowns solve the multiple-shooting equations of all eighteen states. They are judged by those.

States are in the units of `softnlp.statics.loadcase`; data stacks the constants c of the load case and the scaled tip
force and moment.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.model import rod
from softnlp.native.kernels import Step
from softnlp.nlp.transcription import RK4
from softnlp.statics.loadcase import RodFunctions, whole_weight

Array = NDArray[np.float64]

POSITION, ROTATION, MOMENT = slice(0, 3), slice(3, 12), slice(12, 15)
STATE = 15
_LEAST = 1e-300  # which changes no curvature, and divided by 0 is infinite
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

    value: Step
    directions: Step
    check: Step
    onward: ca.Function
    ends: ca.Function


def reduced_rod(functions: RodFunctions) -> ReducedRod:
    """Build the steps from the field of a load case with dead loads."""
    functions = functions.in_kernels
    nc = functions.field.size1_in(1)
    data, s, h = ca.SX.sym("data", nc + 6), ca.SX.sym("s"), ca.SX.sym("h")
    c, force, moment = data[:nc], data[nc : nc + 3], data[nc + 3 :]
    weight = whole_weight(c)

    def full(state: Any, at: Any) -> Any:
        """Return [p, R, N, M] with the force in closed form."""
        return ca.vertcat(state[:12], force + weight * (1 - at), state[MOMENT])

    state = ca.SX.sym("state", STATE)
    every = functions.field(full(state, s), c)
    rates = ca.vertcat(every[:12], every[15:])
    value = Step(function("rates", [state, data, s], rates))
    return ReducedRod(
        value=value,
        directions=_directions(state, rates, [data, s, h]),
        check=checked(functions, full, state, rates, [data, s, h], 0),
        onward=function("onward", [ca.vertcat(state, data, s, h)], advanced(value, state, data, s, h)),
        ends=function(
            "ends",
            [ca.vertcat(state, data)],
            ca.vertcat(full(state, 1), rod.tip_balance(full(state, 1), force, moment)),
        ),
    )


def base_state(base: Array) -> Array:
    """Return the state at the base for M(0), with its derivatives by M(0)."""
    state = np.zeros((4 * STATE + 1, base.shape[1]))
    state[[3, 7, 11]] = 1.0
    state[MOMENT] = base
    for j in range(3):
        state[STATE * (j + 1) + MOMENT.start + j] = 1.0
    state[4 * STATE] = np.inf
    return state


def function(name: str, given: list[Any], result: Any) -> ca.Function:
    """Return a function of scalar operations."""
    return ca.Function(name, given, [ca.densify(result)], {"cse": True})


def advanced(step: Step, state: Any, data: Any, s: Any, h: Any) -> Any:
    """Return the state a step h further as one expression, of a step that integrates the state itself."""
    k: list[Any] = []
    for row in RK4.a:
        moved = state + h * sum((a * k_j for a, k_j in zip(row, k, strict=True) if a), ca.SX.zeros(step.state))
        k.append(step.rates(moved, data, s + h * sum(row)))
    return state + h * sum((b * k_j for b, k_j in zip(RK4.b, k, strict=True)), ca.SX.zeros(step.state))


def _directions(state: Any, rates: Any, given: list[Any]) -> Step:
    """Return the step with the derivatives by M(0) beside the state."""
    data, s, h = given
    V, worst = ca.SX.sym("V", STATE, 3), ca.SX.sym("certainty")
    x = ca.vertcat(state, ca.vec(V))
    R = ca.reshape(state[ROTATION], 3, 3)
    U = turned(R, V)
    before = ca.vertcat(ca.SX.sym("before", 4 * STATE), worst)
    return Step(
        rates=function("rates", [x, data, s], ca.vertcat(rates, ca.vec(ca.jtimes(rates, state, V)))),
        begin=function("begin", [before, data, s], before[: 4 * STATE]),
        end=function("end", [before, x, data, s, h], ca.vertcat(x, ca.fmin(worst, smallest_minor(U + U.T)))),
    )


def checked(functions: RodFunctions, full: Any, state: Any, rates: Any, given: list[Any], kept: int) -> Step:
    """Return the step with the gap of the full equations, integrals along the rod and the curvature beside the state.

    full : (state, s) -> the state of the load case. kept : how many chamber lengths the state has already.
    """
    data, s, h = given
    n, c = state.numel(), data[: functions.field.size1_in(1)]
    y = ca.SX.sym("y", functions.field.size1_in(0))
    gained = functions.lengths(y, c)[kept:]
    worst, integrals, sharpest = ca.SX.sym("gap"), ca.SX.sym("integrals", gained.numel()), ca.SX.sym("curvature")
    before = ca.vertcat(state, worst, integrals, sharpest)
    old = ca.SX.sym("old", before.numel())
    x = ca.vertcat(state, y, integrals)
    gap, curvature, there = old[n], old[before.numel() - 1], full(state, s + h)
    sharper = larger_curvature(functions, curvature, [full(old[:n], s), there], c)
    return Step(
        rates=function("rates", [x, data, s], ca.vertcat(rates, functions.field(y, c), gained)),
        begin=function("begin", [before, data, s], ca.vertcat(state, full(state, s), integrals)),
        end=function(
            "end",
            [old, x, data, s, h],
            ca.vertcat(state, ca.fmax(gap, ca.norm_inf(y - there)), integrals, sharper),
        ),
    )


def turned(R: Any, V: Any) -> Any:
    """Return twice the turns (3, 3) of R that derivatives of a state (15, 3) are, world frame, one per column."""
    turns = []
    for j in range(3):
        W = ca.reshape(V[ROTATION, j], 3, 3) @ R.T
        turns.append(ca.vertcat(W[2, 1] - W[1, 2], W[0, 2] - W[2, 0], W[1, 0] - W[0, 1]))
    return ca.horzcat(*turns)


def smallest_minor(S: Any) -> Any:
    """Return the least leading minor of a symmetric 3x3 matrix: positive where it is positive definite."""
    second = S[0, 0] * S[1, 1] - S[0, 1] * S[1, 0]
    third = (
        S[0, 0] * (S[1, 1] * S[2, 2] - S[1, 2] * S[2, 1])
        - S[0, 1] * (S[1, 0] * S[2, 2] - S[1, 2] * S[2, 0])
        + S[0, 2] * (S[1, 0] * S[2, 1] - S[1, 1] * S[2, 0])
    )
    return ca.fmin(S[0, 0], ca.fmin(second, third))


def larger_curvature(functions: RodFunctions, known: Any, states: list[Any], c: Any) -> Any:
    """Return the largest of a curvature and those of the axis at states, per its deformed length; inf if v_z <= 0."""
    for x in states:
        v, u = functions.strains(x[: rod.STATE_SIZE], c)
        known = ca.fmax(known, (ca.sqrt(u[0] ** 2 + u[1] ** 2) + _LEAST) / ca.fmax(v[2], 0))
    return known
