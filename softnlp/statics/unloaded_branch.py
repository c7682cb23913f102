"""The branch from zero pressure of a section that bends and stretches together: followed with the pressures.

Strains without a load are (v_3, r b_1, r b_2); their forces are gradients of an energy, whose second derivatives say
whether the section is stable. The branch ends where these are no longer positive definite, or where the law ends.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.model.quantities import Model, quantities
from softnlp.model.stretch_curve import BODY

Array = NDArray[np.float64]

COUPLED = 3
"""Number of arguments of `unloaded_function`, by which it is known."""
REST = (1.0, 0.0, 0.0)
"""Strains without pressure."""

_LONGEST = 0.15  # change of a strain in one step
_SHORTEST = 1e-9  # fraction of the pressure
_PASSES, _SETTLED = 8, 1e-13


def unloaded_function(model: Model) -> ca.Function:
    """Return (quantities, strains, fraction of the pressure) -> forces (3,), slopes (3, 3), by the fraction (3,)."""
    symbols = {name: ca.SX.sym(name, q.size) for name, q in quantities(model).items()}
    strains, fraction = ca.SX.sym("strains", 3), ca.SX.sym("fraction")
    forces, (a, b, c, d, e, f) = model.section.unloaded(symbols, fraction * symbols["pressure"], strains)
    g = ca.vertcat(*forces)
    H = ca.vertcat(ca.horzcat(a, b, c), ca.horzcat(b, d, e), ca.horzcat(c, e, f))
    driven = ca.densify(ca.jacobian(g, fraction))
    return ca.Function("unloaded", [ca.vertcat(*symbols.values()), strains, fraction], [g, H, driven], {"cse": True})


def step_function(function: ca.Function) -> ca.Function:
    """Return [quantities, strains, fraction] -> [Newton's change (3,), slope of strains by the fraction, least minor].

    function : of `unloaded_function`.
    """
    size = function.size1_in(0)
    given = ca.SX.sym("given", size + 4)
    g, H, driven = function(given[:size], given[size : size + 3], given[size + 3])
    a, b, c, d, e, f = H[0, 0], H[0, 1], H[0, 2], H[1, 1], H[1, 2], H[2, 2]
    C = ca.vertcat(
        ca.horzcat(d * f - e * e, c * e - b * f, b * e - c * d),
        ca.horzcat(c * e - b * f, a * f - c * c, b * c - a * e),
        ca.horzcat(b * e - c * d, b * c - a * e, a * d - b * b),
    )
    det = a * C[0, 0] + b * C[0, 1] + c * C[0, 2]
    minor = ca.fmin(a, ca.fmin(a * d - b * b, det))
    rows = ca.vertcat(-(C @ g) / det, -(C @ driven) / det, minor)
    return ca.Function("branch", [given], [ca.densify(rows)], {"cse": True})


def followed(function: ca.Function, column: Array) -> tuple[Array, float] | None:
    """Return the strains at the whole pressure, or at the last fraction of it at which the section is stable.

    function : of `unloaded_function`. None where it is not stable without pressure.
    """
    at, strains = 0.0, np.array(REST)
    state = _settled(function, column, strains, 0.0)
    if state is None:
        return None
    strains, slope = state
    step = 1.0
    while at < 1.0:
        step = min(step, _LONGEST / max(float(np.abs(slope).max()), 1e-12), 1.0 - at)
        there = 1.0 if step >= 1.0 - at else at + step
        state = _settled(function, column, strains + (there - at) * slope, there)
        if state is None:
            step /= 2
            if step < _SHORTEST:
                return strains, at
            continue
        (strains, slope), at, step = state, there, 2 * step
    return strains, 1.0


def _settled(function: ca.Function, column: Array, strains: Array, fraction: float) -> tuple[Array, Array] | None:
    """Return the strains next to these that are in balance and stable, with their slope by the fraction; else None."""
    both = np.zeros((3, 2))
    for _ in range(_PASSES):
        g, H, driven = (np.asarray(part) for part in function(column, strains, fraction))
        if not (np.all(np.isfinite(H)) and np.all(np.isfinite(g))):
            return None
        try:
            both[:] = np.linalg.solve(H, np.hstack([g, driven]))
        except np.linalg.LinAlgError:
            return None
        if np.abs(both[:, 0]).max() > _LONGEST:
            return None
        strains = strains - both[:, 0]
        if np.abs(both[:, 0]).max() <= _SETTLED:
            stable = np.linalg.eigvalsh(H)[0] > 0 and strains[0] <= BODY.high
            return (strains, np.array(-both[:, 1])) if stable else None
    return None
