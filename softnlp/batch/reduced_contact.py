"""The rod against a wall with its base force and moment as unknowns: single shooting over many poses at once.

As in `softnlp.batch.reduced` the force is known up to a constant, N(s) = N_0 - f_e s; with a wall and
chamber reactions N_0 is unknown beside M(0) and the forces y of the tip conditions. A state is [p, R, M, chamber
lengths]; data stacks the constants c of the load case and N_0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from softnlp.batch.reduced import MOMENT, STATE, larger_curvature, rk_integral
from softnlp.model import rod
from softnlp.nlp.transcription import RK4, rk_step
from softnlp.statics.loadcase import RodFunctions, unpack_section

UNKNOWN = 6
"""Directions of a shooting: N_0, then M(0)."""


@dataclass(frozen=True, eq=False)
class ReducedContact:
    """Steps and maps for tip conditions with a wall; N chambers, ny forces of the conditions.

    value : state (15 + N). directions : [state, its derivatives by N_0 and M(0) ((15 + N) x 6)]. check : [state, gap,
    bending angle, backbone length, curvature]; gap and curvature are as in `softnlp.batch.reduced`, as is onward.
    tip : [state, derivatives, data, tip force, tip moment, y, a, units] -> [residual (6 + ny), its derivatives by N_0,
    M(0) and y, column by column]; a is what the conditions take (`softnlp.statics.loadcase.RodFunctions`).
    arc : [quantities, stretch] -> the unloaded state.
    """

    value: ca.Function
    directions: ca.Function
    check: ca.Function
    onward: ca.Function
    tip: ca.Function
    arc: ca.Function


def reduced_contact(functions: RodFunctions) -> ReducedContact:
    """Build the steps and maps from the rod functions of tip conditions with a wall."""
    nc, N, ny = functions.field.size1_in(1), functions.model.robot.chambers, functions.tip_unknowns
    size = STATE + N
    data, s, h = ca.SX.sym("data", nc + 3), ca.SX.sym("s"), ca.SX.sym("h")
    c, N_0 = data[:nc], data[nc:]
    section = unpack_section(c)
    weight = c[len(rod.RodSection._fields)] * ca.vertcat(section.load_x, section.load_y, section.load_z)

    def full(state: Any, force: Any, at: Any) -> Any:
        """Return [p, R, N, M, lengths] with the force in closed form."""
        return ca.vertcat(state[:12], force - weight * at, state[MOMENT], state[STATE:])

    def advance(state: Any, force: Any) -> Any:
        k: list[Any] = []
        for row in RK4.a:
            moved = state + h * sum((a * k_j for a, k_j in zip(row, k, strict=True) if a), ca.SX.zeros(size))
            every = functions.field(full(moved, force, s + h * sum(row)), c)
            k.append(ca.vertcat(every[:12], every[15:]))
        return state + h * sum((b * k_j for b, k_j in zip(RK4.b, k, strict=True)), ca.SX.zeros(size))

    state, V = ca.SX.sym("state", size), ca.SX.sym("V", size, UNKNOWN)
    along_force = ca.horzcat(ca.SX.eye(3), ca.SX.zeros(3, 3))
    reached = advance(state, N_0)
    moved = ca.jtimes(reached, ca.vertcat(state, N_0), ca.vertcat(V, along_force))

    x, worst, integrals = full(state, N_0, s), ca.SX.sym("gap"), ca.SX.sym("integrals", 2)
    sharpest = ca.SX.sym("curvature")
    sharper = larger_curvature(sharpest, [x, full(reached, N_0, s + h)], c)
    gap = ca.norm_inf(rk_step(functions.field, RK4)(x, c, h) - full(reached, N_0, s + h))
    gained = rk_integral(functions, x, c, h)[N:]

    a, y, units = ca.SX.sym("a", functions.tip.size1_in(5)), ca.SX.sym("y", ny), ca.SX.sym("units", 2)
    force, moment = ca.SX.sym("force", 3), ca.SX.sym("moment", 3)
    at_tip = full(state, N_0, 1)
    residual = functions.tip(at_tip, c, force, moment, y, a, units)
    slopes = ca.jtimes(residual, ca.vertcat(state, N_0), ca.vertcat(V, along_force))
    every = ca.vertcat(residual, ca.vec(slopes), ca.vec(ca.densify(ca.jacobian(residual, y))))

    column, stretch = ca.SX.sym("column", functions.section.size1_in(0)), ca.SX.sym("stretch")
    arc = functions.arc(column, stretch, 1.0)
    options = {"cse": True}
    return ReducedContact(
        value=ca.Function("contact_value", [state, data, s, h], [reached], options),
        directions=ca.Function(
            "contact_directions",
            [ca.vertcat(state, ca.vec(V)), data, s, h],
            [ca.vertcat(reached, ca.vec(moved))],
            options,
        ),
        check=ca.Function(
            "contact_check",
            [ca.vertcat(state, worst, integrals, sharpest), data, s, h],
            [ca.vertcat(reached, ca.fmax(worst, gap), integrals + gained, sharper)],
            options,
        ),
        onward=ca.Function("contact_onward", [ca.vertcat(state, data, s, h)], [reached], options),
        tip=ca.Function(
            "contact_tip",
            [ca.vertcat(state, ca.vec(V), data, force, moment, y, a, units)],
            [ca.densify(every)],
            options,
        ),
        arc=ca.Function("arc", [ca.vertcat(column, stretch)], [ca.densify(arc)], options),
    )
