"""What holds at the tip of the rod: dead loads alone, or a wall and chamber reactions, Eqs. (9), (14) to (18).

Pure functions of numbers or symbols in any consistent system of units. Every condition is 6 balances and as many more
equations as it has unknown forces of its own.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca

from softnlp.base.errors import InputError
from softnlp.model import rod
from softnlp.model.contact_settings import Closure
from softnlp.model.rod import RodSection


class AtTip(NamedTuple):
    """What the conditions may use; N chambers.

    state : p, R, N, M at s = L, see `softnlp.model.rod`. section : the rod's. lengths : (N,) of the chambers.
    centres : N pairs d_i. chamber_stiffness : E_t pi r_co^2. force, moment : dead loads. unknowns : forces of the
    conditions. given : `Given`.
    """

    state: Any
    section: RodSection
    lengths: Any
    centres: list[tuple[Any, Any]]
    chamber_stiffness: Any
    force: Any
    moment: Any
    unknowns: Any
    given: Any


class Given(NamedTuple):
    """The numbers of a wall and its closure; `contact_quantities` of `softnlp.model.quantities` declares them so.

    wall_point, wall_normal : (3,), the normal is unit and points where the wall pushes. tip_cap : L_t.
    chamber_reaction : k_c. free_lengths : (N,) L_i^free. pressed : (N,) 1 where a chamber is pressurised, else 0.
    force_error, moment_error, gap_error : what is left of e_n (3,), e_m (3,), e_h; 0 unless `weighted` chose it.
    """

    wall_point: Any
    wall_normal: Any
    tip_cap: Any
    chamber_reaction: Any
    free_lengths: Any
    pressed: Any
    force_error: Any
    moment_error: Any
    gap_error: Any


@dataclass(frozen=True, eq=False)
class TipConditions:
    """Conditions that close the rod's problem.

    unknowns : names of the forces that they add. equations : names of as many length equations that they add.
    residual : the 6 balances, then those. reaction : (N,) T_i of the chambers.
    has_contact : whether they need `Given` and the chamber lengths.
    """

    unknowns: tuple[str, ...]
    equations: tuple[str, ...]
    residual: Callable[[AtTip], Any]
    reaction: Callable[[AtTip], Any]
    has_contact: bool


def _no_reaction(at: AtTip) -> Any:
    return ca.DM.zeros(len(at.centres))


DEAD_LOADS = TipConditions((), (), lambda at: rod.tip_balance(at.state, at.force, at.moment), _no_reaction, False)


def length_error(at: AtTip) -> Any:
    """Return e_L, the sum over the pressurised chambers of L_i^free - L_i, Eq. (14)."""
    return ca.dot(at.given.pressed, at.given.free_lengths - at.lengths)


def contact_point(at: AtTip) -> Any:
    """Return the end of the tip's cap, p + L_t R e3."""
    p, R, _, _ = rod.unpack(at.state)
    return p + at.given.tip_cap * R[:, 2]


def gap(at: AtTip) -> Any:
    """Return e_h, the distance of the contact point in front of the wall, Eq. (15)."""
    return ca.dot(at.given.wall_normal, contact_point(at) - at.given.wall_point)


def _compliant(at: AtTip) -> Any:
    """Return T_i = k_c E_t pi r_co^2 (L_i^free - L_i) / L_i^free in pressurised chambers."""
    free = at.given.free_lengths
    return at.given.pressed * at.given.chamber_reaction * at.chamber_stiffness * (free - at.lengths) / free


def _rigid(at: AtTip) -> Any:
    """Return the common reaction T in pressurised chambers."""
    return at.given.pressed * at.unknowns[-1]


def _held(at: AtTip) -> Any:
    """Return e_L, which determines T; T itself where no chamber is pressurised."""
    idle = ca.if_else(ca.sum1(at.given.pressed) > 0, 0.0, 1.0)
    return length_error(at) + idle * at.unknowns[-1]


BUILT_IN: Mapping[str, Closure] = {
    "free": Closure("free", _no_reaction),
    "weighted": Closure("weighted", _no_reaction),  # with errors that are chosen elsewhere
    "compliant": Closure("compliant", _compliant),
    "rigid": Closure("rigid", _rigid, _held),
}
"""The closures that a scenario may name."""


def _balance(at: AtTip, T: Any, F_b: Any) -> Any:
    """Return the 6 tip balances with reactions T (N,) of the chambers and the wall's force F_b."""
    R = rod.unpack(at.state)[1]
    e3 = R[:, 2]
    push = F_b * at.given.wall_normal
    M_x = sum(T[i] * d_y for i, (_, d_y) in enumerate(at.centres))
    M_y = -sum(T[i] * d_x for i, (d_x, _) in enumerate(at.centres))
    M_T = ca.vertcat(M_x, M_y, 0)
    force = at.force + push + ca.sum1(T) * e3 + at.given.force_error
    moment = at.moment + at.given.tip_cap * ca.cross(e3, push) + R @ M_T + at.given.moment_error
    return rod.tip_balance(at.state, force, moment)


def tip_conditions(closure: str | Closure, *, wall: bool = True) -> TipConditions:
    """Return the conditions of a closure, one of `BUILT_IN` or your own, with a wall, or for a given load without.

    Raises
    ------
    InputError
        When the conditions are used, where the closure's functions return another number of entries than they should.
    """
    chosen = BUILT_IN[closure] if isinstance(closure, str) else closure
    equation = chosen.equation
    own = equation is not None

    def reaction(at: AtTip) -> Any:
        return _sized(chosen, "reaction", chosen.reaction(at), len(at.centres))

    def residual(at: AtTip) -> Any:
        F_b = at.unknowns[0] if wall else 0.0
        rows = [_balance(at, reaction(at), F_b)]
        if wall:
            rows.append(gap(at) - at.given.gap_error)
        if equation is not None:
            rows.append(_sized(chosen, "equation", equation(at), 1))
        return ca.vertcat(*rows)

    return TipConditions(
        unknowns=("wall force",) * wall + ("chamber reaction",) * own,
        equations=("contact gap",) * wall + ("chamber length",) * own,
        residual=residual,
        reaction=reaction,
        has_contact=True,
    )


def _sized(closure: Closure, part: str, value: Any, size: int) -> Any:
    """Return what a function of a closure gave as a column, or raise `InputError` where it has another size."""
    column = ca.vec(ca.vertcat(*value) if isinstance(value, list | tuple) else value)
    if column.numel() != size:
        raise InputError(
            f"{part} of closure {closure.name!r}: expected {size} entries, got {column.numel()}", key="closure"
        )
    return column
