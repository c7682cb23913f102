"""A load case: the rod's boundary value problem of one state of loading, as unknowns and residuals.

States are posed in the units of the robot: lengths in L_0, forces in EI/L_0^2, moments in EI/L_0, with EI the bending
stiffness of the unpressurised section. So one compiled problem is well scaled for every robot of its kind.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.quantity import Quantity
from softnlp.model import rod
from softnlp.model.quantities import Model, contact_quantities, force_unit, quantities, section_function
from softnlp.model.section import deform, stretch_balance
from softnlp.model.tip import DEAD_LOADS, AtTip, Given, TipConditions, gap, length_error
from softnlp.nlp.case import Equation
from softnlp.nlp.transcription import Transcribed, Transcription

Array = NDArray[np.float64]

_SECTION_SIZE = len(rod.RodSection._fields)
_NEWTON_STEPS = 30


def _pack(model: Model, pressures: Any, gravity: Any, stretch: Any) -> list[Any]:
    """Return the rod's constants, the scaled stretch imbalance, and the units, for `section_function`."""
    L_0, F_0 = model.robot.length, force_unit(model)
    section = deform(model.robot, model.material, pressures, stretch, model.coefficients, model.conventions)
    scaled = rod.rod_section(section, model.material.density, gravity, L_0, F_0)
    centres = [coordinate / L_0 for centre in section.centres for coordinate in centre]
    balance = stretch_balance(section, model.coefficients, model.conventions) / F_0
    chamber = section.tangent_modulus * ca.pi * section.chamber_radius**2 / F_0
    return [ca.vertcat(*scaled, stretch, *centres, chamber), balance, ca.vertcat(L_0, F_0)]


@dataclass(frozen=True, eq=False)
class RodFunctions:
    """The rod of a model as functions, in scaled units; c are its constants at one stretch and pressure.

    The state x has the chamber lengths behind p, R, N, M where the tip conditions need them; y are the forces that the
    conditions add, a the quantities that they take (SI).

    section : (quantities, stretch) -> c, scaled stretch imbalance, units (L_0, EI / L_0^2). field : (x, c) -> dx/ds on
    s in 0..1. lengths : (x, c) -> rates of the chamber lengths, the bending angle and the backbone length.
    tip : (x, c, force, moment, y, a, units) -> the tip residuals, 6 and as many more as y has entries.
    contact : (x, c, y, a, units) -> T_i (N), e_L, e_h. arc : (quantities, stretch, s) -> state without gravity or tip
    load, exact there and the first guess elsewhere. by_machine : whether machine code may take the place of the virtual
    machine where that pays: the same numbers but for round-off, from when on depends on what was solved before.
    """

    model: Model
    conditions: TipConditions
    section: ca.Function
    field: ca.Function
    lengths: ca.Function
    tip: ca.Function
    contact: ca.Function
    arc: ca.Function
    by_machine: bool = True

    @property
    def state_size(self) -> int:
        """The number of entries of x."""
        return int(self.field.size1_in(0))

    @property
    def tip_unknowns(self) -> int:
        """The number of entries of y."""
        return len(self.conditions.unknowns)

    def declared(self, model: Model | None = None) -> dict[str, Quantity]:
        """Return every quantity of a load case by name: those of the model, then those that the tip conditions take.

        model : whose numbers are nominal, of the same kind; None is the one that these functions were compiled of.
        """
        numbers = model or self.model
        taken = contact_quantities(numbers) if self.conditions.has_contact else {}
        return {**quantities(numbers), **taken}


def rod_functions(model: Model, conditions: TipConditions = DEAD_LOADS, *, by_machine: bool = True) -> RodFunctions:
    """Compile the rod of a model for symbols in place of its numbers. by_machine : see `RodFunctions`."""
    chambers = model.robot.chambers
    with_lengths = chambers if conditions.has_contact else 0
    c = ca.SX.sym("c", _SECTION_SIZE + 2 + 2 * chambers)
    x = ca.SX.sym("x", rod.STATE_SIZE + with_lengths)
    section = unpack_section(c)
    L = c[_SECTION_SIZE]
    v, u = rod.strains(x, section)
    centres = [(c[_SECTION_SIZE + 1 + 2 * i], c[_SECTION_SIZE + 2 + 2 * i]) for i in range(chambers)]
    rates = [ca.norm_2(v + ca.cross(u, ca.vertcat(d_x, d_y, 0))) for d_x, d_y in centres]
    along = ca.vertcat(*rates, ca.norm_2(u[:2]), ca.norm_2(v))
    lengths = ca.Function("lengths", [x, c], [L * along], {"cse": True})
    field = ca.vertcat(rod.field(x, section), *rates[:with_lengths])

    packed = section_function(model, _pack)
    column = ca.SX.sym("quantities", packed.size1_in(0))
    stretch, s = ca.SX.sym("stretch"), ca.SX.sym("s")
    at_rest = packed(column, stretch)[0]
    arc = rod.arc_state(s * at_rest[_SECTION_SIZE], unpack_section(at_rest))
    if with_lengths:  # their rates are constant on an arc
        full = ca.vertcat(arc, ca.SX.zeros(chambers))
        arc = ca.vertcat(arc, s * lengths(full, at_rest)[:chambers])

    units, y = ca.SX.sym("units", 2), ca.SX.sym("y", len(conditions.unknowns))
    force, moment = ca.SX.sym("force", 3), ca.SX.sym("moment", 3)
    a, given = _given(model, conditions, units)
    at = AtTip(x[: rod.STATE_SIZE], section, x[rod.STATE_SIZE :], centres, c[-1], force, moment, y, given)
    judged = [conditions.reaction(at), length_error(at), gap(at)] if conditions.has_contact else []
    return RodFunctions(
        model=model,
        conditions=conditions,
        section=packed,
        field=ca.Function("field", [x, c], [L * field], {"cse": True}),
        lengths=lengths,
        tip=ca.Function("tip", [x, c, force, moment, y, a, units], [conditions.residual(at)], {"cse": True}),
        contact=ca.Function("contact", [x, c, y, a, units], judged),
        arc=ca.Function("arc", [column, stretch, s], [arc]),
        by_machine=by_machine,
    )


@lru_cache(maxsize=8)
def stretch_imbalance(functions: RodFunctions) -> ca.Function:
    """Return (quantities, stretch) -> the scaled stretch imbalance and its slope."""
    column, stretch = ca.SX.sym("p", functions.section.size1_in(0)), ca.SX.sym("stretch")
    _, balance, _ = functions.section(column, stretch)
    return ca.Function("imbalance", [column, stretch], [balance, ca.jacobian(balance, stretch)])


def stretch_near(imbalance: ca.Function, columns: Array, start: Array) -> Array:
    """Return the roots of the stretch balance next to known stretches (k,), by Newton's method.

    imbalance : of `stretch_imbalance`. columns : (all quantities, k), SI.
    """
    found, given = start, ca.DM(columns)
    with np.errstate(all="ignore"):
        for _ in range(_NEWTON_STEPS):
            balance, slope = (np.array(part.nonzeros()) for part in imbalance(given, found[None, :]))
            change = -balance / slope
            found = found + change
            if not np.abs(change).max() > 1e-13:
                break
    return found


def _given(model: Model, conditions: TipConditions, units: Any) -> tuple[Any, Given | None]:
    """Return the column a of what tip conditions take, SI, and its parts scaled."""
    if not conditions.has_contact:
        return ca.SX(0, 1), None
    L_0, F_0 = units[0], units[1]
    scale = {"m": L_0, "N": F_0, "N m": F_0 * L_0, "1": 1.0}
    symbols, scaled = [], {}
    for q in contact_quantities(model).values():
        symbol = ca.SX.sym(q.name, q.size)
        symbols.append(symbol)
        scaled[q.name.removeprefix("contact.")] = symbol / scale[q.unit]
    return ca.vertcat(*symbols), Given(**scaled)


def unpack_section(c: Any) -> rod.RodSection:
    """Return the rod's section from the constants of a load case."""
    return rod.RodSection(*(c[k] for k in range(_SECTION_SIZE)))


@dataclass(frozen=True, eq=False)
class LoadCase:
    """One robot in one state of loading, as equations in scaled units.

    symbols : its unknowns, the stretch, the column of all states, and the forces that the tip conditions add, if any.
    residuals : as many equations. ends : those of them before and behind the intervals.
    fine_residuals : the same at half the step. outputs : by name, SI and world frame: "stretch", "tip_position" (3),
    "tip_rotation" (3x3), "chamber_lengths" (N), "bending_angle", "backbone_length", and "tip_forces", those added.
    constants : what the field takes beside the state. given : the quantities by key. column : those of
    `functions.declared()`, in order, as they are given here. method : None for an arc in closed form.
    length_unit, force_unit : of the scaled states [m, N].
    """

    name: str
    method: Transcription | None
    transcribed: Transcribed
    functions: RodFunctions
    given: Mapping[str, Quantity]
    symbols: tuple[ca.MX, ...]
    constants: ca.MX
    column: ca.MX
    residuals: ca.MX
    ends: tuple[ca.MX, ca.MX]
    fine_residuals: ca.MX
    equations: tuple[Equation, ...]
    outputs: Mapping[str, ca.MX]
    length_unit: ca.MX
    force_unit: ca.MX

    @property
    def slope(self) -> ca.MX:
        """The Jacobian of the residuals by the unknowns."""
        first, last = (ca.horzcat(*(ca.jacobian(rows, symbol) for symbol in self.symbols)) for rows in self.ends)
        by_states, by_stretch = self.transcribed.slopes(ca.jacobian(self.constants, self.symbols[0]))
        others = [ca.MX(by_states.shape[0], symbol.numel()) for symbol in self.symbols[2:]]
        return ca.vertcat(first, ca.horzcat(by_stretch, by_states, *others), last)

    def arc(self, column: Array, stretch: float) -> Array:
        """Return x of the circular arc without loads. column : every quantity of the model in its order, SI."""
        s = self.transcribed.points
        if s.size == 0:
            return np.array([stretch])
        states = np.asarray(self.functions.arc(column, stretch, s[None, :]))
        return np.concatenate([[stretch], states.T.ravel(), np.zeros(self.functions.tip_unknowns)])


def load_case(name: str, functions: RodFunctions, given: Mapping[str, Quantity], method: Transcription) -> LoadCase:
    """Transcribe the rod of a model in the state of loading that the quantities `given` describe.

    functions : of `rod_functions`, which every grid and case of the model shares. given : every name of
    `functions.declared()`; a case of its own pressure takes a quantity of its own under "pressure".
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
    y = ca.MX.sym("tip_forces", functions.tip_unknowns)
    taken = [q.symbol for name, q in given.items() if name in contact_quantities(model)]
    a = ca.vertcat(*taken) if functions.conditions.has_contact else ca.MX(0, 1)
    base = ca.vertcat(balance, rod.base_balance(first), first[rod.STATE_SIZE :])
    tip = functions.tip(last, constants, force, moment, y, a, units)

    N = model.robot.chambers
    outputs = {
        "stretch": stretch,
        "tip_position": last[:3] * L_0,
        "tip_rotation": ca.reshape(last[3:12], 3, 3),
        "chamber_lengths": integrals[:N] * L_0,
        "bending_angle": integrals[N],
        "backbone_length": integrals[N + 1] * L_0,
    }
    if functions.tip_unknowns:
        outputs["tip_forces"] = y * F_0
    return LoadCase(
        name=name,
        method=method,
        transcribed=transcribed,
        functions=functions,
        given=given,
        symbols=(stretch, transcribed.unknowns, y) if functions.tip_unknowns else (stretch, transcribed.unknowns),
        constants=constants,
        column=ca.vertcat(column, a),
        residuals=ca.vertcat(base, transcribed.residuals, tip),
        ends=(base, tip),
        fine_residuals=ca.vertcat(base, transcribed.fine_residuals, tip),
        equations=_equations(transcribed, functions.conditions, L_0, F_0),
        outputs=outputs,
        length_unit=L_0,
        force_unit=F_0,
    )


def _equations(transcribed: Transcribed, conditions: TipConditions, L_0: ca.MX, F_0: ca.MX) -> tuple[Equation, ...]:
    """Name the residual rows of a load case: stretch, base, stages and continuity, tip."""
    nx = transcribed.state_size
    units = {
        "position": ("m", L_0),
        "rotation": ("1", ca.MX(1)),
        "force": ("N", F_0),
        "moment": ("N m", F_0 * L_0),
        "chamber length": ("m", L_0),
    }
    blocks = dict(rod.STATE_BLOCKS)
    named = [
        Equation("stretch balance", np.array([0]), "N", F_0),
        Equation("base position", np.arange(1, 4), "m", L_0),
        Equation("base orientation", np.arange(4, 13), "1", ca.MX(1)),
    ]
    start = 13
    if nx > rod.STATE_SIZE:
        blocks["chamber length"] = slice(rod.STATE_SIZE, nx)
        start += nx - rod.STATE_SIZE
        named.append(Equation("base chamber length", np.arange(13, start), "m", L_0))
    rows = start + np.arange(len(transcribed.kinds) * nx).reshape(-1, nx)
    kinds = np.array(transcribed.kinds)
    for kind, label in (("gap", "continuity"), ("stage", "collocation")):
        for block, where in blocks.items():
            chosen = rows[kinds == kind][:, where].ravel()
            if chosen.size:
                named.append(Equation(f"{label} of {block}", chosen, *units[block]))
    end = start + rows.size
    named.append(Equation("tip force", np.arange(end, end + 3), "N", F_0))
    named.append(Equation("tip moment", np.arange(end + 3, end + 6), "N m", F_0 * L_0))
    for k, name in enumerate(conditions.equations):
        named.append(Equation(name, np.array([end + 6 + k]), "m", L_0))
    return tuple(named)


def blocked_case(
    name: str, functions: RodFunctions, given: Mapping[str, Quantity], free: LoadCase, method: Transcription
) -> LoadCase:
    """Transcribe the rod against a wall, with the free chamber lengths that a free shape's states have.

    given : every other name of `functions.declared()`.
    """
    declared = functions.declared()
    lengths = replace(declared["contact.free_lengths"], symbol=free.outputs["chamber_lengths"])
    every = {**given, "contact.free_lengths": lengths}
    return load_case(name, functions, {key: every[key] for key in declared}, method)
