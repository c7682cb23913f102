"""Whether a point is optimal, judged from the point and its multipliers, never by a solver's word."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

OPTIMAL = 1e-6
"""Largest KKT error (see `kkt_error`) of a point that is called optimal."""

_LEAST_SLOPE = 1e-5  # a flatter objective is judged against this, which is what an engine's own tolerance resolves
_NOISE = 1.0  # root mean square of residuals in standard deviations: a smaller misfit is noise


@dataclass(frozen=True, eq=False)
class Bounds:
    """Lower and upper bounds of the unknowns x and of the rows g, scaled as they are."""

    lower_x: Array
    upper_x: Array
    lower_g: Array
    upper_g: Array


def slopes(nlp: Mapping[str, ca.MX]) -> ca.Function:
    """Return the function (x, p, lam_g) -> the gradient of f, J^T lam_g and g of an NLP."""
    x, p, f, g = (nlp[key] for key in "xpfg")
    lam = ca.MX.sym("lam", g.numel())
    return ca.Function("slopes", [x, p, lam], [ca.gradient(f, x), ca.jtimes(g, x, lam, True), g])


def kkt_error(
    slopes: ca.Function, bounds: Bounds, p: Array, start: Array, x: Array, lam_x: Array, lam_g: Array
) -> float:
    """Return the largest error of the first-order conditions at x, evaluated again.

    These are stationarity, grad f + J^T lam_g + lam_x = 0, and complementarity: a multiplier times the distance (1 at
    most) from the bound that its sign names, the upper one where it is positive, so that a multiplier of the wrong
    sign counts in full. Both are over the largest entry of grad f, there or at the start of the search.

    Parameters
    ----------
    slopes : of the function `slopes`. p : (np,) fixed values.
    start, x, lam_x : (n,) where the search began, where it ended, and the multipliers of the bounds of x.
    lam_g : (m,) the multipliers of the rows.

    Returns
    -------
    A number [1]; inf where something is not a number.
    """
    gradient, pull, g = (np.asarray(v, dtype=float).ravel() for v in slopes(x, p, lam_g))
    before = np.asarray(slopes(start, p, np.zeros(lam_g.size))[0], dtype=float).ravel()
    # an unknown without room may have any multiplier
    lam_x = np.where(bounds.lower_x == bounds.upper_x, -(gradient + pull), lam_x)
    lam, values = np.concatenate([lam_x, lam_g]), np.concatenate([x, g])
    lower, upper = (
        np.concatenate(pair) for pair in ((bounds.lower_x, bounds.lower_g), (bounds.upper_x, bounds.upper_g))
    )
    room = np.where(lam > 0, upper - values, np.where(lam < 0, values - lower, 0.0))
    errors = np.concatenate([gradient + pull + lam_x, lam * np.minimum(np.abs(room), 1.0)])
    slope = max(float(np.max(np.abs(part), initial=_LEAST_SLOPE)) for part in (gradient, before))
    worst = float(np.max(np.abs(errors), initial=0.0)) / slope
    return worst if np.all(np.isfinite(errors)) and np.isfinite(worst) else float("inf")


def misfit_slope(J: Array, r: Array, low: NDArray[np.bool_], high: NDArray[np.bool_]) -> float:
    """Return the KKT error of least squares within bounds: the largest cosine between the residuals and a column of J.

    Parameters
    ----------
    J : (m, n) derivatives of the residuals. r : (m,) the residuals, in standard deviations.
    low, high : (n,) which unknowns are at a bound; there only a slope into the bounds is an error.

    Returns
    -------
    A number [1].
    """
    sizes = np.linalg.norm(J, axis=0) * max(float(np.linalg.norm(r)), _NOISE * np.sqrt(r.size))
    cosine = (J.T @ r) / np.where(sizes > 0, sizes, 1.0)
    cosine = np.where(low, np.minimum(cosine, 0.0), np.where(high, np.maximum(cosine, 0.0), cosine))
    return float(np.max(np.abs(cosine), initial=0.0))


def not_optimal(kkt: float, word: str) -> str:
    """Word that a point is feasible but not optimal. word : how the search ended, in the solver's words."""
    return f"feasible, not optimal: the KKT error is {kkt:.1e}, above {OPTIMAL:g}, where the search ended ({word})"
