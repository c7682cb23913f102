"""A condition of a problem beside the equations of its cases."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import IllPosedError
from softnlp.base.quantity import expression

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Constraint:
    """A condition lower <= expression <= upper, entry by entry; equality where they agree.

    Attributes
    ----------
    name
        Of the equation in certificates and messages.
    expression
        Of quantities' symbols and outputs of cases, in `unit`.
    lower, upper
        A number, or (entries,) one an entry, in `unit` [SI].
    unit
        SI.
    scale
        A number above 0 or a symbol, in `unit` [SI]. It only says what counts as large: it changes no bound.
    in_hessian
        Whether its second derivatives are in the Hessian of the Lagrangian. Without them IPOPT takes more steps, which
        cost less where the expression is a long computation.
    """

    name: str
    expression: ca.MX
    lower: Any = 0.0
    upper: Any = 0.0
    unit: str = "1"
    scale: Any = 1.0
    in_hessian: bool = True

    @property
    def is_equality(self) -> bool:
        """Whether every entry is an equation."""
        return bool(np.all(np.equal(self.lower, self.upper)))

    def scaled(self) -> tuple[ca.MX, Array, Array]:
        """Return the rows and their bounds, all over the scale; a bound under a symbol is taken into the row.

        Returns
        -------
        tuple
            A column, and its (entries,) lower and upper bounds [1].

        Raises
        ------
        IllPosedError
            For bounds or a scale that cannot be meant.
        """
        if not isinstance(self.name, str) or not self.name.strip():
            raise IllPosedError(f"expected a name for each constraint, got {self.name!r}")
        rows = ca.vec(expression(self.expression, f"constraint '{self.name}'"))
        if not rows.numel():
            raise IllPosedError(f"constraint '{self.name}': expected an expression of at least one entry")
        lower, upper = (self._bound(b, rows.numel()) for b in (self.lower, self.upper))
        if not np.all(lower <= upper):
            raise IllPosedError(f"constraint '{self.name}': expected lower <= upper")
        if np.any(lower == np.inf) or np.any(upper == -np.inf):
            raise IllPosedError(f"constraint '{self.name}': no number lies between its bounds")
        numbers = isinstance(self.scale, ca.MX | ca.DM) or np.asarray(self.scale).dtype.kind in "fiu"
        if not numbers:
            raise IllPosedError(f"constraint '{self.name}': expected a scale above 0, got {self.scale!r}")
        scale = ca.MX(self.scale)
        if not scale.is_scalar():
            raise IllPosedError(f"constraint '{self.name}': expected one scale for all entries, got {scale.numel()}")
        if scale.is_constant():
            size = float(scale)
            if not 0 < size < np.inf:
                raise IllPosedError(f"constraint '{self.name}': expected a scale above 0, got {size:g}")
            return rows / size, lower / size, upper / size
        if np.any(np.isfinite(lower) & np.isfinite(upper) & (lower < upper)):
            raise IllPosedError(f"constraint '{self.name}': two different bounds need a scale that is a number")
        bound = np.where(np.isfinite(lower), lower, np.where(np.isfinite(upper), upper, 0.0))
        return (rows - bound) / scale, lower - bound, upper - bound

    def _bound(self, given: Any, entries: int) -> Array:
        """Return a bound of each entry."""
        try:
            bound = np.asarray(given)
        except ValueError:  # of lists of several lengths
            bound = np.array("")
        if bound.dtype.kind not in "fiu":
            raise IllPosedError(f"constraint '{self.name}': expected bounds that are numbers, got {given!r}")
        if bound.size not in (1, entries):
            raise IllPosedError(f"constraint '{self.name}': expected one bound, or {entries}")
        return np.broadcast_to(bound.astype(float).ravel(), (entries,))
