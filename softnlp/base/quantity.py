"""A physical quantity as a named symbol."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import IllPosedError

Array = NDArray[np.float64]
_INF = float("inf")


@dataclass(frozen=True, eq=False)
class Quantity:
    """A named physical quantity.

    Attributes
    ----------
    name
        One name of a problem.
    unit
        SI.
    symbol
        MX column of `size` entries.
    nominal
        (size,) value when fixed and first guess when free [SI].
    scale
        Typical size, which makes the unknown of order one [SI].
    lower, upper
        Bounds when free, numbers or (size,) [SI].
    """

    name: str
    unit: str
    symbol: ca.MX
    nominal: Array
    scale: float = 1.0
    lower: Any = -_INF
    upper: Any = _INF

    @property
    def size(self) -> int:
        """The number of entries."""
        return int(self.nominal.size)


def quantity(
    name: str, unit: str, nominal: Any, *, scale: float = 1.0, lower: Any = -_INF, upper: Any = _INF
) -> Quantity:
    """Declare a quantity.

    Parameters
    ----------
    name
        One name of a problem.
    unit
        SI.
    nominal
        Number or (size,) values when fixed, first guess when free [SI].
    scale
        Typical size [SI].
    lower, upper
        Bounds when free, numbers or (size,) [SI].

    Returns
    -------
    Quantity
        With a symbol of its own.
    """
    value = np.atleast_1d(np.asarray(nominal, dtype=float)).ravel()
    return Quantity(name, unit, ca.MX.sym(name, value.size), value, scale, lower, upper)


def expression(given: Any, what: str) -> ca.MX:
    """Return an expression, or raise `IllPosedError` that says of what it is none of CasADi's MX."""
    if not isinstance(given, ca.MX):
        kind = f"one of {type(given).__name__}" if isinstance(given, ca.SX | ca.DM) else repr(given)
        raise IllPosedError(f"{what}: expected an expression of CasADi's MX, got {kind}")
    return given
