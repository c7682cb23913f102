"""The weight of the rod."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from softnlp.base.quantity import Quantity, quantity
from softnlp.model.load import AtPoint, Load, Wrench
from softnlp.model.model import Model


@dataclass(frozen=True)
class Weight(Load):
    """f_e = rho A g."""

    def quantities(self, model: Model) -> list[Quantity]:
        """Return "gravity"."""
        return [quantity("gravity", "m/s^2", np.zeros(3), scale=10.0)]

    def along(self, at: AtPoint) -> Wrench:
        """Return it per length."""
        return at.section.line_density * at.given.gravity, 0
