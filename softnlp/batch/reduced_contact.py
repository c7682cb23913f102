"""The rod against a wall with its base force and moment as unknowns: single shooting over many poses at once.

As in `softnlp.statics.reduced` the force is known up to a constant, N(s) = N_0 - f_e s; with a wall and
chamber reactions N_0 is unknown beside M(0) and the forces y of the contact. A state is [p, R, M, chamber
lengths]; data stacks the constants c of the load case and N_0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from softnlp.native.kernels import Step
from softnlp.statics.loadcase import RodFunctions, whole_weight
from softnlp.statics.reduced import MOMENT, STATE, advanced, checked, function

UNKNOWN = 6
"""Directions of a shooting: N_0, then M(0)."""


@dataclass(frozen=True, eq=False)
class ReducedContact:
    """Steps and maps for a contact at the tip; N chambers, ny forces of it.

    value : state (15 + N). directions : [state, its derivatives by N_0 and M(0) ((15 + N) x 6)]. check : [state, gap,
    bending angle, backbone length, curvature]; gap and curvature are as in `softnlp.statics.reduced`, as is onward.
    tip : [state, derivatives, data, y, a, units] -> [residual (6 + ny), its derivatives by N_0,
    M(0) and y, column by column]; a is what the loads take (`softnlp.statics.loadcase.RodFunctions`).
    arc : [quantities, stretch] -> the unloaded state.
    """

    value: Step
    directions: Step
    check: Step
    onward: ca.Function
    tip: ca.Function
    arc: ca.Function


def reduced_contact(functions: RodFunctions) -> ReducedContact:
    """Build the steps and maps from the rod functions with a contact at the tip."""
    functions = functions.in_kernels
    nc, N, ny = functions.field.size1_in(1), functions.model.chambers, functions.tip_unknowns
    size = STATE + N
    data, s, h = ca.SX.sym("data", nc + 3), ca.SX.sym("s"), ca.SX.sym("h")
    c, N_0 = data[:nc], data[nc:]
    weight = whole_weight(c)

    def full(state: Any, force: Any, at: Any) -> Any:
        """Return [p, R, N, M, lengths] with the force in closed form."""
        return ca.vertcat(state[:12], force - weight * at, state[MOMENT], state[STATE:])

    state, V = ca.SX.sym("state", size), ca.SX.sym("V", size, UNKNOWN)
    along_force = ca.horzcat(ca.SX.eye(3), ca.SX.zeros(3, 3))
    every = functions.field(full(state, N_0, s), c)
    rates = ca.vertcat(every[:12], every[15:])
    moved = ca.jtimes(rates, ca.vertcat(state, N_0), ca.vertcat(V, along_force))
    value = Step(function("rates", [state, data, s], rates))

    a, y, units = ca.SX.sym("a", functions.tip.size1_in(3)), ca.SX.sym("y", ny), ca.SX.sym("units", 2)
    at_tip = full(state, N_0, 1)
    residual = functions.tip(at_tip, c, y, a, units)
    slopes = ca.jtimes(residual, ca.vertcat(state, N_0), ca.vertcat(V, along_force))
    judged = ca.vertcat(residual, ca.vec(slopes), ca.vec(ca.densify(ca.jacobian(residual, y))))

    column, stretch = ca.SX.sym("column", functions.section.size1_in(0)), ca.SX.sym("stretch")
    arc = functions.arc(column, stretch, 1.0)
    return ReducedContact(
        value=value,
        directions=Step(function("rates", [ca.vertcat(state, ca.vec(V)), data, s], ca.vertcat(rates, ca.vec(moved)))),
        check=checked(functions, lambda state, at: full(state, N_0, at), state, rates, [data, s, h], N),
        onward=function("onward", [ca.vertcat(state, data, s, h)], advanced(value, state, data, s, h)),
        tip=function("tip", [ca.vertcat(state, ca.vec(V), data, y, a, units)], judged),
        arc=function("arc", [ca.vertcat(column, stretch)], arc),
    )
