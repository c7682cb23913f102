"""All loads of a rod together: what they do along it, and what holds at its tip."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from softnlp.base.quantity import Quantity
from softnlp.model.dead_tip import DeadTip
from softnlp.model.load import AtPoint, AtTip, Load
from softnlp.model.model import Model
from softnlp.model.rod import STATE_SIZE, tip_balance
from softnlp.model.section import RodSection, unit_scale
from softnlp.model.tip import TipContact, gap, length_error
from softnlp.model.weight import Weight
from softnlp.nlp.case import Equation


def _scaled(declared: Sequence[Quantity], numbers: Mapping[str, Any], L_0: Any, F_0: Any) -> dict[str, Any]:
    """Return numbers of a load over their units, by the last part of their names."""
    return {q.name.rpartition(".")[2]: numbers[q.name] / unit_scale(q.unit, L_0, F_0) for q in declared}


@dataclass(frozen=True, eq=False)
class LineLoads:
    """The loads that act along the rod, the weight first, with symbols for their scaled numbers.

    loads : each with its quantities and a symbol for each of these.
    """

    loads: Sequence[tuple[Load, Sequence[Quantity], Sequence[ca.SX]]]

    @property
    def symbols(self) -> list[ca.SX]:
        """Of all loads, the gravity first."""
        return [symbol for _, _, symbols in self.loads for symbol in symbols]

    def numbers(self, given: Mapping[str, Any], L_0: Any, F_0: Any) -> list[Any]:
        """Return what the symbols stand for, of quantities by key, SI."""
        return [value for _, declared, _ in self.loads for value in _scaled(declared, given, L_0, F_0).values()]

    def wrench(self, state: Any, section: RodSection) -> tuple[Any, Any]:
        """Return force and moment per length at a point."""
        force, moment = ca.SX.zeros(3), ca.SX.zeros(3)
        for load, declared, symbols in self.loads:
            own = load.named(dict(zip((q.name.rpartition(".")[2] for q in declared), symbols, strict=True)))
            f, m = load.along(AtPoint(state, section, own)) or (0, 0)
            force, moment = force + f, moment + m
        return force, moment


def line_loads(model: Model, loads: Sequence[Load]) -> tuple[LineLoads, tuple[Load, ...]]:
    """Return the weight and those of the loads that act along the rod, and all loads, these first."""
    section = RodSection(*(ca.SX.sym(name) for name in RodSection._fields))
    state = ca.SX.sym("x", STATE_SIZE)
    acting, others = [], []
    for load in (Weight(), *loads):
        declared = list(load.quantities(model))
        symbols = [ca.SX.sym(q.name, q.size) for q in declared]
        own = load.named(dict(zip((q.name.rpartition(".")[2] for q in declared), symbols, strict=True)))
        if load.along(AtPoint(state, section, own)) is None:
            others.append(load)
        else:
            acting.append((load, declared, symbols))
    return LineLoads(acting), (*(load for load, _, _ in acting[1:]), *others)


def tip_rows(
    model: Model, loads: Sequence[Load], x: Any, section: RodSection, centres: list[Any], chamber: Any
) -> tuple[list[Any], Any, list[Any]]:
    """Return the symbols y, a, units, the residuals of the tip, and what is judged of a contact.

    x, section, centres, chamber : symbols for the state at the tip and the constants of the rod, scaled.
    """
    units = ca.SX.sym("units", 2)
    dead: tuple[Any, Any] = (None, None)
    unknowns, numbers, rows, judged = list[Any](), list[Any](), list[Any](), list[Any]()
    forces, moments = ca.SX.zeros(3), ca.SX.zeros(3)
    for load in (DeadTip(), *loads):
        declared = list(load.quantities(model))
        symbols = {q.name: ca.SX.sym(q.name, q.size) for q in declared}
        y = ca.SX.sym("y", len(load.unknowns))
        given = load.named(_scaled(declared, symbols, units[0], units[1]))
        at = AtTip(x[:STATE_SIZE], section, x[STATE_SIZE:], centres, chamber, dead[0], dead[1], y, given)
        wrench = load.tip(at) or (0, 0)
        dead = wrench if isinstance(load, DeadTip) else dead
        forces, moments = forces + wrench[0], moments + wrench[1]
        rows += load.rows(at)
        unknowns.append(y)
        numbers += symbols.values()
        if isinstance(load, TipContact):
            judged = [load.reaction(at), length_error(at), gap(at)]
    residual = ca.vertcat(tip_balance(x, forces, moments), *rows)
    return [ca.vertcat(*unknowns), ca.vertcat(*numbers), units], residual, judged


def unknown_units(loads: Sequence[Load], L_0: ca.MX, F_0: ca.MX) -> ca.MX:
    """Return the SI values of one of each unknown that the loads add."""
    return ca.MX(ca.vertcat(*(unit_scale(unit, L_0, F_0) for load in loads for unit in load.unknowns.values())))


def tip_equations(start: int, loads: Sequence[Load], L_0: ca.MX, F_0: ca.MX) -> list[Equation]:
    """Name the residual rows at the tip, of which the first is `start`."""
    named = [
        Equation("tip force", start + np.arange(3), "N", F_0),
        Equation("tip moment", start + np.arange(3, 6), "N m", F_0 * L_0),
    ]
    own = [entry for load in loads for entry in load.equations.items()]
    for k, (name, unit) in enumerate(own):
        named.append(Equation(name, np.array([start + 6 + k]), unit, ca.MX(unit_scale(unit, L_0, F_0))))
    return named
