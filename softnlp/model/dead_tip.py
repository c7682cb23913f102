"""Dead loads at the tip: a force and a moment that keep their direction in the world."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from softnlp.base.quantity import Quantity, quantity
from softnlp.model.load import AtTip, Load, Wrench
from softnlp.model.model import Model


@dataclass(frozen=True)
class DeadTip(Load):
    """F_e and M_e of Eq. (9)."""

    def quantities(self, model: Model) -> list[Quantity]:
        """Return "tip_force" and "tip_moment"."""
        return [
            quantity("tip_force", "N", np.zeros(3)),
            quantity("tip_moment", "N m", np.zeros(3), scale=1e-2),
        ]

    def tip(self, at: AtTip) -> Wrench:
        """Return both."""
        return at.given.tip_force, at.given.tip_moment
