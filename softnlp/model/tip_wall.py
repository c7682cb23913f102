"""A wall without friction that holds the tip alone: closure `free`, without the chambers' lengths."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from softnlp.base.quantity import Quantity, quantity
from softnlp.model import rod
from softnlp.model.load import AtTip, Load, Wrench
from softnlp.model.model import Model


@dataclass(frozen=True)
class TipWall(Load):
    """A plane that holds the end of the tip's cap and pushes along its normal, Eq. (15)."""

    @property
    def unknowns(self) -> Mapping[str, str]:
        """Its push."""
        return {"wall force": "N"}

    @property
    def equations(self) -> Mapping[str, str]:
        """The gap."""
        return {"contact gap": "m"}

    def quantities(self, model: Model) -> list[Quantity]:
        """Return "wall.point", "wall.normal", unit, which points where it pushes, and "wall.cap", L_t."""
        return [
            quantity("wall.point", "m", np.zeros(3), scale=model.length),
            quantity("wall.normal", "1", np.array([1.0, 0.0, 0.0])),
            quantity("wall.cap", "m", 0.0, scale=model.length, lower=0.0),
        ]

    def tip(self, at: AtTip) -> Wrench:
        """Return the push, which acts at the end of the cap."""
        push = at.unknowns[0] * at.given.normal
        return push, at.given.cap * ca.cross(rod.unpack(at.state)[1][:, 2], push)

    def rows(self, at: AtTip) -> list[Any]:
        """Return how far that end is in front of the wall."""
        p, R, _, _ = rod.unpack(at.state)
        return [ca.dot(at.given.normal, p + at.given.cap * R[:, 2] - at.given.point)]

    def at_rest(self, values: Mapping[str, Any], tip: Any) -> dict[str, Any]:
        """Put the wall where it touches the unloaded shape."""
        return {"wall.point": tip[:3] + values["wall.cap"] * tip[9:12]}
