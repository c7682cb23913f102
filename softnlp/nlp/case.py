"""A case: unknowns, as many equations, and outputs; all that a problem knows of a robot."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import casadi as ca
import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Equation:
    """A named group of residual rows and the unit of one of them: SI value = scaled value * `si_scale`."""

    name: str
    rows: NDArray[np.intp]
    unit: str
    si_scale: ca.MX


class Case(Protocol):
    """Equations of one state of loading, in scaled units.

    symbols : its unknowns. residuals : as many equations. slope : their Jacobian by the unknowns. fine_residuals : the
    same at half the step. equations : names of the rows. outputs : by name, SI. constants : what the equations take of
    the quantities, for warm starts.
    column : the values that the case takes of a problem, in its own order, SI.
    length_unit, force_unit : of the scaled unknowns [m, N]. once_differentiable : whether the second derivatives of
    its residuals are not theirs, so that nothing may be made of them.
    """

    @property
    def name(self) -> str: ...  # noqa: D102
    @property
    def symbols(self) -> tuple[ca.MX, ...]: ...  # noqa: D102
    @property
    def residuals(self) -> ca.MX: ...  # noqa: D102
    @property
    def slope(self) -> ca.MX: ...  # noqa: D102
    @property
    def fine_residuals(self) -> ca.MX: ...  # noqa: D102
    @property
    def equations(self) -> tuple[Equation, ...]: ...  # noqa: D102
    @property
    def outputs(self) -> Mapping[str, ca.MX]: ...  # noqa: D102
    @property
    def constants(self) -> ca.MX: ...  # noqa: D102
    @property
    def column(self) -> ca.MX: ...  # noqa: D102
    @property
    def length_unit(self) -> ca.MX: ...  # noqa: D102
    @property
    def force_unit(self) -> ca.MX: ...  # noqa: D102
    @property
    def once_differentiable(self) -> bool: ...  # noqa: D102
