"""The wall of a blocked force and its closures, as a load at the tip, Eqs. (14) to (18).

Pure functions of numbers or symbols in any consistent system of units.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from softnlp.base.errors import InputError
from softnlp.base.quantity import Quantity, quantity
from softnlp.model import rod
from softnlp.model.contact_settings import NO_CLOSURE, Closure
from softnlp.model.load import AtTip as AtTip
from softnlp.model.load import Load, Wrench
from softnlp.model.model import Model


class Given(NamedTuple):
    """The numbers of a wall and its closure; `TipContact.quantities` declares them so.

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


def _no_reaction(at: AtTip) -> Any:
    return ca.DM.zeros(len(at.centres))


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
    NO_CLOSURE: Closure(NO_CLOSURE, _no_reaction),
    "weighted": Closure("weighted", _no_reaction),  # with errors that are chosen elsewhere
    "compliant": Closure("compliant", _compliant),
    "rigid": Closure("rigid", _rigid, _held),
}
"""The closures that a scenario may name."""


@dataclass(frozen=True)
class TipContact(Load):
    """A closure, one of `BUILT_IN` or your own, with a wall that holds the tip, or for the other loads without.

    closure : by name, or as such. wall : whether there is one, whose push is unknown.

    Its functions raise `InputError` where those of the closure return another number of entries than they should.
    """

    closure: str | Closure
    wall: bool = True
    needs_lengths = True

    @property
    def _chosen(self) -> Closure:
        return BUILT_IN[self.closure] if isinstance(self.closure, str) else self.closure

    @property
    def unknowns(self) -> Mapping[str, str]:
        """The wall's push, and the unknown force of the closure."""
        own = self._chosen.equation is not None
        return dict.fromkeys(("wall force",) * self.wall + ("chamber reaction",) * own, "N")

    @property
    def equations(self) -> Mapping[str, str]:
        """The gap, and the equation of the closure."""
        own = self._chosen.equation is not None
        return dict.fromkeys(("contact gap",) * self.wall + ("chamber length",) * own, "m")

    def quantities(self, model: Model) -> list[Quantity]:
        """Return "contact." and each field of `Given`."""
        N, L_0 = model.chambers, model.length
        return [
            quantity("contact.wall_point", "m", np.zeros(3), scale=L_0),
            quantity("contact.wall_normal", "1", np.array([1.0, 0.0, 0.0])),
            quantity("contact.tip_cap", "m", 0.0, scale=L_0, lower=0.0),
            quantity("contact.chamber_reaction", "1", float(model.coefficients.chamber_reaction), lower=0.0),
            quantity("contact.free_lengths", "m", np.full(N, L_0), scale=L_0, lower=0.0),
            quantity("contact.pressed", "1", np.zeros(N)),
            quantity("contact.force_error", "N", np.zeros(3)),
            quantity("contact.moment_error", "N m", np.zeros(3), scale=1e-2),
            quantity("contact.gap_error", "m", 0.0, scale=L_0),
        ]

    def named(self, numbers: Mapping[str, Any]) -> Given:
        """Return them as they are told of in `Given`."""
        return Given(**numbers)

    def reaction(self, at: AtTip) -> Any:
        """Return T_i (N,) of the chambers."""
        return _sized(self._chosen, "reaction", self._chosen.reaction(at), len(at.centres))

    def tip(self, at: AtTip) -> Wrench:
        """Return the push of the wall, the reactions, and what a closure leaves of the balances."""
        e3, R = rod.unpack(at.state)[1][:, 2], rod.unpack(at.state)[1]
        T = self.reaction(at)
        push = (at.unknowns[0] if self.wall else 0.0) * at.given.wall_normal
        M_x = sum(T[i] * d_y for i, (_, d_y) in enumerate(at.centres))
        M_y = -sum(T[i] * d_x for i, (d_x, _) in enumerate(at.centres))
        force = push + ca.sum1(T) * e3 + at.given.force_error
        moment = at.given.tip_cap * ca.cross(e3, push) + R @ ca.vertcat(M_x, M_y, 0) + at.given.moment_error
        return force, moment

    def rows(self, at: AtTip) -> list[Any]:
        """Return e_h and what the closure asks for."""
        found = [gap(at) - at.given.gap_error] if self.wall else []
        if self._chosen.equation is not None:
            found.append(_sized(self._chosen, "equation", self._chosen.equation(at), 1))
        return found

    def at_rest(self, values: Mapping[str, Any], tip: Any) -> dict[str, Any]:
        """Put the wall where it touches the unloaded shape."""
        return {"contact.wall_point": tip[:3] + values["contact.tip_cap"] * tip[9:12]}


def _sized(closure: Closure, part: str, value: Any, size: int) -> Any:
    """Return what a function of a closure gave as a column, or raise `InputError` where it has another size."""
    column = ca.vec(ca.vertcat(*value) if isinstance(value, list | tuple) else value)
    if column.numel() != size:
        raise InputError(
            f"{part} of closure {closure.name!r}: expected {size} entries, got {column.numel()}", key="closure"
        )
    return column
