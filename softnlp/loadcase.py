"""A load case: the rod's boundary value problem of one state of loading, as unknowns and residuals.

States are posed in the units of the robot: lengths in L_0, forces in EI/L_0^2, moments in EI/L_0, with EI the bending
stiffness of the unpressurised section. So one compiled problem is well scaled for every robot of its kind.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp import rod
from softnlp.quantities import Model, Quantity, force_unit, quantities, section_function
from softnlp.section import deform, stretch_balance
from softnlp.transcription import Transcribed, Transcription


@dataclass(frozen=True, eq=False)
class Equation:
    """A named group of residual rows and the unit of one of them: SI value = scaled value * `si_scale`."""

    name: str
    rows: NDArray[np.intp]
    unit: str
    si_scale: ca.MX


_SECTION_SIZE = len(rod.RodSection._fields)


def _pack(model: Model, pressures: Any, gravity: Any, stretch: Any) -> list[Any]:
    """Return the rod's constants, the scaled stretch imbalance, and the units, for `section_function`."""
    L_0, F_0 = model.robot.length, force_unit(model)
    section = deform(model.robot, model.material, pressures, stretch, model.coefficients, model.conventions)
    scaled = rod.rod_section(section, model.material.density, gravity, L_0, F_0)
    centres = [coordinate / L_0 for centre in section.centres for coordinate in centre]
    balance = stretch_balance(section, model.coefficients, model.conventions) / F_0
    return [ca.vertcat(*scaled, stretch, *centres), balance, ca.vertcat(L_0, F_0)]


@dataclass(frozen=True, eq=False)
class RodFunctions:
    """The rod of a model as functions, in scaled units; c are its constants at one stretch and pressure.

    section : (quantities, stretch) -> c, scaled stretch imbalance, units (L_0, EI / L_0^2). field : (x, c) -> dx/ds on
    s in 0..1. lengths : (x, c) -> rates of the chamber lengths, the bending angle and the backbone length.
    tip : (x, c, force, moment) -> the 6 tip residuals. arc : (quantities, stretch, s) -> state without gravity or tip
    load, exact there and the first guess elsewhere.
    """

    model: Model
    section: ca.Function
    field: ca.Function
    lengths: ca.Function
    tip: ca.Function
    arc: ca.Function


def rod_functions(model: Model) -> RodFunctions:
    """Compile the rod of a model for symbols in place of its numbers."""
    chambers = model.robot.chambers
    x, c = ca.SX.sym("x", rod.STATE_SIZE), ca.SX.sym("c", _SECTION_SIZE + 1 + 2 * chambers)
    force, moment = ca.SX.sym("force", 3), ca.SX.sym("moment", 3)
    section = unpack_section(c)
    L = c[_SECTION_SIZE]
    v, u = rod.strains(x, section)
    rates = []
    for i in range(chambers):
        d_i = ca.vertcat(c[_SECTION_SIZE + 1 + 2 * i], c[_SECTION_SIZE + 2 + 2 * i], 0)
        rates.append(ca.norm_2(v + ca.cross(u, d_i)))
    rates += [ca.norm_2(u[:2]), ca.norm_2(v)]

    packed = section_function(model, _pack)
    column = ca.SX.sym("quantities", packed.size1_in(0))
    stretch, s = ca.SX.sym("stretch"), ca.SX.sym("s")
    at_rest = packed(column, stretch)[0]
    arc = rod.arc_state(s * at_rest[_SECTION_SIZE], unpack_section(at_rest))
    return RodFunctions(
        model=model,
        section=packed,
        field=ca.Function("field", [x, c], [L * rod.field(x, section)], {"cse": True}),
        lengths=ca.Function("lengths", [x, c], [L * ca.vertcat(*rates)], {"cse": True}),
        tip=ca.Function("tip", [x, c, force, moment], [rod.tip_balance(x, section, force, moment)]),
        arc=ca.Function("arc", [column, stretch, s], [arc]),
    )


def unpack_section(c: Any) -> rod.RodSection:
    """Return the rod's section from the constants of a load case."""
    return rod.RodSection(*(c[k] for k in range(_SECTION_SIZE)))


@dataclass(frozen=True, eq=False)
class LoadCase:
    """One robot in one state of loading, as equations in scaled units.

    symbols : its unknowns, the stretch and the column of all states. residuals : as many equations.
    fine_residuals : the same at half the step. outputs : by name, SI and world frame: "stretch", "tip_position" (3),
    "tip_rotation" (3x3), "chamber_lengths" (N), "bending_angle", "backbone_length".
    constants : what the field takes beside the state. length_unit, force_unit : of the scaled states [m, N].
    """

    name: str
    transcribed: Transcribed
    functions: RodFunctions
    symbols: tuple[ca.MX, ...]
    constants: ca.MX
    residuals: ca.MX
    fine_residuals: ca.MX
    equations: tuple[Equation, ...]
    outputs: Mapping[str, ca.MX]
    length_unit: ca.MX
    force_unit: ca.MX


def load_case(name: str, functions: RodFunctions, given: Mapping[str, Quantity], method: Transcription) -> LoadCase:
    """Transcribe the rod of a model in the state of loading that the quantities `given` describe.

    functions : of `rod_functions(model)`, which every grid and case of the model shares. given : every name of
    `quantities(model)`; a case of its own pressure takes a quantity of its own under "pressure".
    """
    model = functions.model
    column = ca.vertcat(*(given[key].symbol for key in quantities(model)))
    stretch = ca.MX.sym("stretch")
    constants, balance, units = functions.section(column, stretch)
    L_0, F_0 = units[0], units[1]

    transcribed = method.transcribe(functions.field, constants)
    first, last = transcribed.nodes[:, 0], transcribed.nodes[:, -1]
    integrals = transcribed.integrate(functions.lengths)
    force, moment = given["tip_force"].symbol / F_0, given["tip_moment"].symbol / (F_0 * L_0)
    ends = ca.vertcat(rod.base_balance(first), functions.tip(last, constants, force, moment))

    def residuals(interior: ca.MX) -> ca.MX:
        return ca.vertcat(balance, ends[:12], interior, ends[12:])

    N = model.robot.chambers
    return LoadCase(
        name=name,
        transcribed=transcribed,
        functions=functions,
        symbols=(stretch, transcribed.unknowns),
        constants=constants,
        residuals=residuals(transcribed.residuals),
        fine_residuals=residuals(transcribed.fine_residuals),
        equations=_equations(transcribed, L_0, F_0),
        outputs={
            "stretch": stretch,
            "tip_position": last[:3] * L_0,
            "tip_rotation": ca.reshape(last[3:12], 3, 3),
            "chamber_lengths": integrals[:N] * L_0,
            "bending_angle": integrals[N],
            "backbone_length": integrals[N + 1] * L_0,
        },
        length_unit=L_0,
        force_unit=F_0,
    )


def _equations(transcribed: Transcribed, L_0: ca.MX, F_0: ca.MX) -> tuple[Equation, ...]:
    """Name the residual rows of a load case: stretch, base (12), stages and continuity, tip (6)."""
    units = {"position": ("m", L_0), "rotation": ("1", ca.MX(1)), "force": ("N", F_0), "moment": ("N m", F_0 * L_0)}
    named = [
        Equation("stretch balance", np.array([0]), "N", F_0),
        Equation("base position", np.arange(1, 4), "m", L_0),
        Equation("base orientation", np.arange(4, 13), "1", ca.MX(1)),
    ]
    rows = 13 + np.arange(len(transcribed.kinds) * rod.STATE_SIZE).reshape(-1, rod.STATE_SIZE)
    kinds = np.array(transcribed.kinds)
    for kind, label in (("gap", "continuity"), ("stage", "collocation")):
        for block, where in rod.STATE_BLOCKS.items():
            chosen = rows[kinds == kind][:, where].ravel()
            if chosen.size:
                named.append(Equation(f"{label} of {block}", chosen, *units[block]))
    end = 13 + rows.size
    named.append(Equation("tip force", np.arange(end, end + 3), "N", F_0))
    named.append(Equation("tip moment", np.arange(end + 3, end + 6), "N m", F_0 * L_0))
    return tuple(named)
