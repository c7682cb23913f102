"""A load case: the rod's boundary value problem of one state of loading, as unknowns and residuals.

States are posed in the units of the robot: lengths in L_0, forces in EI/L_0^2, moments in EI/L_0, with EI the bending
stiffness of the unpressurised section. So one compiled problem is well scaled for every robot of its kind.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.quantity import Quantity
from softnlp.model import rod
from softnlp.model.dead_tip import DeadTip
from softnlp.model.load import Load
from softnlp.model.quantities import Model, force_unit, quantities, section_function
from softnlp.model.section import RodSection, rod_section, unit_scale
from softnlp.nlp.case import Equation
from softnlp.nlp.transcription import Transcribed, Transcription
from softnlp.statics.wrenches import line_loads, tip_equations, tip_rows, unknown_units

Array = NDArray[np.float64]

_SECTION_SIZE = len(RodSection._fields)
_GRAVITY = slice(_SECTION_SIZE, _SECTION_SIZE + 3)
_NEWTON_STEPS = 30


@dataclass(frozen=True, eq=False)
class RodFunctions:
    """The rod of a model as functions, in scaled units; c are its constants at one stretch and pressure.

    The state x has the chamber lengths behind p, R, N, M where a load needs them; y are the unknowns that the loads
    add, a the numbers that they take at the tip (SI): those of the dead loads, then those of `loads`.

    loads : beside the dead ones; those that act along the rod come first.
    section : (quantities, stretch) -> c, scaled stretch imbalance, units (L_0, EI / L_0^2). taken : which, in
    order: the model's, then those of loads that act along the rod. field : (x, c) -> dx/ds on s in 0..1. lengths :
    (x, c) -> rates of the chamber lengths, the bending angle and the backbone length. strains : (p, R, N, M; c) ->
    v, u.
    tip : (x, c, y, a, units) -> the tip residuals, 6 and as many more as y has entries.
    contact : (x, c, y, a, units) -> T_i (N), e_L, e_h where there is a `TipContact`. arc : (quantities, stretch, s) ->
    state without gravity or tip load, exact there and the first guess elsewhere. by_machine : whether machine
    code may take the place of the virtual machine where that pays: the same numbers but for round-off, from when on
    depends on what was solved before. quick : see `in_kernels`.
    """

    model: Model
    loads: tuple[Load, ...]
    taken: tuple[str, ...]
    section: ca.Function
    field: ca.Function
    lengths: ca.Function
    strains: ca.Function
    tip: ca.Function
    contact: ca.Function
    arc: ca.Function
    by_machine: bool = True
    quick: RodFunctions | None = None

    @property
    def in_kernels(self) -> RodFunctions:
        """What machine code is made of: the same, or what gives the same numbers in less time."""
        return self.quick or self

    @property
    def state_size(self) -> int:
        """The number of entries of x."""
        return int(self.field.size1_in(0))

    def resultants(self, x: Any, c: Any) -> tuple[Any, Any]:
        """Return n and m as they are shown, of a scaled state p, R, N, M and the constants of the load case."""
        if self.model.section.splits_pressure:
            return rod.wall_resultants(x, unpack_section(c))
        _, _, N, M = rod.unpack(x)
        return N, M

    @property
    def tip_unknowns(self) -> int:
        """The number of entries of y."""
        return int(self.tip.size1_in(2))

    def declared(self, model: Model | None = None) -> dict[str, Quantity]:
        """Return every quantity of a load case by name: those of the model, then those of the loads.

        model : whose numbers are nominal, of the same kind; None is the one that these functions were compiled of.
        """
        numbers = model or self.model
        return {**quantities(numbers), **{q.name: q for load in self.loads for q in load.quantities(numbers)}}

    @cached_property
    def _tip_names(self) -> list[str]:
        return [q.name for load in (DeadTip(), *self.loads) for q in load.quantities(self.model)]

    @cached_property
    def _tip_rows(self) -> list[int]:
        rows, start = dict[str, range](), 0
        for name, q in self.declared().items():
            rows[name] = range(start, start + q.size)
            start += q.size
        return [row for name in self._tip_names for row in rows[name]]

    def tip_numbers(self, p: Any) -> Any:
        """Return a of a column of every quantity that is declared, an array or an expression."""
        return p[self._tip_rows]

    def tip_column(self, given: Mapping[str, Quantity]) -> ca.MX:
        """Return a of quantities by key."""
        return ca.vertcat(*(given[name].symbol for name in self._tip_names))


def rod_functions(
    model: Model, loads: Sequence[Load] = (), *, by_machine: bool = True, like: RodFunctions | None = None
) -> RodFunctions:
    """Compile the rod of a model for symbols in place of its numbers.

    loads : beside the dead ones. by_machine : see `RodFunctions`. like : the same kind of rod under other loads, whose
    section is taken where the loads along the rod are the same.
    """
    chambers = model.chambers
    line, loads = line_loads(model, loads)
    with_lengths = chambers if any(load.needs_lengths for load in loads) else 0
    section = RodSection(*(ca.SX.sym(name) for name in RodSection._fields))
    centres = [(ca.SX.sym("d_x"), ca.SX.sym("d_y")) for _ in range(chambers)]
    chamber, x = ca.SX.sym("chamber"), ca.SX.sym("x", rod.STATE_SIZE + with_lengths)
    flat = [coordinate for centre in centres for coordinate in centre]
    probed = model.section.at(model.numbers, np.zeros(model.sets), 1.0)
    own = [ca.SX.sym("own") for _ in probed.own]
    c = ca.vertcat(*section, *line.symbols[:1], *flat, chamber, *own, *line.symbols[1:])

    def rates(strains: Any) -> tuple[ca.Function, ca.Function, ca.Function]:
        """Return the field, the rates of lengths, and the strains."""
        v, u = strains(section, own, *rod.in_body(x))
        along = ca.vertcat(*model.section.lengthening(own, centres, v, u), ca.norm_2(u[:2]), ca.norm_2(v))
        every = ca.vertcat(rod.field(x, v, u, *line.wrench(x, section)), along[:with_lengths])
        return (
            ca.Function("field", [x, c], [section.length * every], {"cse": True}),
            ca.Function("lengths", [x, c], [section.length * along], {"cse": True}),
            ca.Function("strains", [x[: rod.STATE_SIZE], c], [v, u]),
        )

    field, lengths, strains = rates(model.section.strains)

    def build(numbers: Mapping[str, Any], stretch: Any) -> list[Any]:
        L_0, F_0 = numbers["robot.length"], force_unit(model, numbers)
        state = model.section.at(numbers, numbers["pressure"], stretch)
        scaled = rod_section(state, stretch, L_0, F_0)
        more = [value / unit_scale(unit, L_0, F_0) for value, unit in state.own]
        d = [coordinate / L_0 for centre in state.centres for coordinate in centre]
        g, *others = line.numbers(numbers, L_0, F_0)
        return [
            ca.vertcat(*scaled, g, *d, state.chamber_stiffness / F_0, *more, *others),
            state.imbalance / F_0,
            ca.vertcat(L_0, F_0),
        ]

    declared = {**quantities(model), **{q.name: q for _, own, _ in line.loads[1:] for q in own}}
    same = like is not None and like.model.kind == model.kind and like.taken == tuple(declared)
    packed = like.section if like is not None and same else section_function(declared, build)
    column = ca.SX.sym("quantities", packed.size1_in(0))
    stretch, s = ca.SX.sym("stretch"), ca.SX.sym("s")
    at_rest = packed(column, stretch)[0]
    unloaded = ca.vertcat(ca.SX.zeros(3), ca.vec(ca.SX.eye(3)), ca.SX.zeros(6))
    bent = strains(unloaded, at_rest)[1]
    arc = rod.arc_state(s * unpack_section(at_rest).length, bent[0], bent[1])
    if with_lengths:  # their rates are constant on an arc
        full = ca.vertcat(arc, ca.SX.zeros(chambers))
        arc = ca.vertcat(arc, s * lengths(full, at_rest)[:chambers])

    given, tip, contact = tip_rows(model, loads, x, section, centres, chamber)
    made = RodFunctions(
        model=model,
        loads=loads,
        taken=tuple(declared),
        section=packed,
        field=field,
        lengths=lengths,
        strains=strains,
        tip=ca.Function("tip", [x, c, *given], [tip], {"cse": True}),
        contact=ca.Function("contact", [x, c, *given], contact),
        arc=ca.Function("arc", [column, stretch, s], [arc]),
        by_machine=by_machine,
    )
    if model.section.coupled:
        field, lengths, strains = rates(model.section.quick_strains)
        return replace(made, quick=replace(made, field=field, lengths=lengths, strains=strains))
    return made


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


def unpack_section(c: Any) -> RodSection:
    """Return the rod's section from the constants of a load case."""
    return RodSection(*(c[k] for k in range(_SECTION_SIZE)))


def centres_of(c: Any, chambers: int) -> list[tuple[Any, Any]]:
    """Return d_i of the chambers from the constants of a load case."""
    return [(c[_GRAVITY.stop + 2 * i], c[_GRAVITY.stop + 2 * i + 1]) for i in range(chambers)]


def whole_weight(c: Any) -> Any:
    """Return the weight of the whole rod (3,) from the constants of a load case, or (3, poses) of those of many."""
    section = unpack_section(c)
    return section.length * section.line_density * c[_GRAVITY]


@dataclass(frozen=True, eq=False)
class LoadCase:
    """One robot in one state of loading, as equations in scaled units.

    symbols : its unknowns, the stretch, the column of all states, and what the loads add, if anything.
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
    def once_differentiable(self) -> bool:
        """Whether strains are found by iterations, whose derivative is the last one's."""
        return self.functions.model.section.coupled

    @property
    def whole_length(self) -> ca.MX:
        """L_0 [m]."""
        return self.length_unit

    @property
    def labels(self) -> list[str]:
        """What the unknowns are called, one name each of `symbols`."""
        return [symbol.name() for symbol in self.symbols]

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
    declared = [given[key].symbol for key in functions.declared()]
    column = ca.vertcat(*declared)
    stretch = ca.MX.sym("stretch")
    constants, balance, units = functions.section(column[: functions.section.size1_in(0)], stretch)
    L_0, F_0 = units[0], units[1]

    transcribed = method.transcribe(functions.field, constants)
    first, last = transcribed.nodes[:, 0], transcribed.nodes[:, -1]
    integrals = transcribed.integrate(functions.lengths)
    y = ca.MX.sym("tip_forces", functions.tip_unknowns)
    base = ca.vertcat(balance, rod.base_balance(first), first[rod.STATE_SIZE :])
    tip = functions.tip(last, constants, y, functions.tip_column(given), units)

    N = functions.model.chambers
    outputs = {
        "stretch": stretch,
        "tip_position": last[:3] * L_0,
        "tip_rotation": ca.reshape(last[3:12], 3, 3),
        "chamber_lengths": integrals[:N] * L_0,
        "bending_angle": integrals[N],
        "backbone_length": integrals[N + 1] * L_0,
    }
    if functions.tip_unknowns:
        outputs["tip_forces"] = y * unknown_units(functions.loads, L_0, F_0)
    return LoadCase(
        name=name,
        method=method,
        transcribed=transcribed,
        functions=functions,
        given=given,
        symbols=(stretch, transcribed.unknowns, y) if functions.tip_unknowns else (stretch, transcribed.unknowns),
        constants=constants,
        column=column,
        residuals=ca.vertcat(base, transcribed.residuals, tip),
        ends=(base, tip),
        fine_residuals=ca.vertcat(base, transcribed.fine_residuals, tip),
        equations=_equations(transcribed, functions.loads, L_0, F_0),
        outputs=outputs,
        length_unit=L_0,
        force_unit=F_0,
    )


def _equations(transcribed: Transcribed, loads: Sequence[Load], L_0: ca.MX, F_0: ca.MX) -> tuple[Equation, ...]:
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
    return (*named, *tip_equations(start + rows.size, loads, L_0, F_0))


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
