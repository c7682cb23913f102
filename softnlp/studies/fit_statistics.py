"""How well data determine the constants that were fitted to them: standard errors, correlations, what stays open."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

Further = Callable[[Sequence[str]], str]
"""Which measurements would tell some constants apart."""

CLOSE = 0.99  # two constants whose estimates are correlated more than this are hardly told apart
POORLY_CONDITIONED = 1e4  # of the Jacobian with columns of length one
_LEAST_UNUSED = 0.1
_FEWEST, _MOST_ALIKE = 8, 0.98  # residuals that tell a correlation; the largest that is told
SINGULAR = 1e10  # beyond it a combination of constants is open altogether


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """What is known of fitted constants, in their order.

    Attributes
    ----------
    standard_errors
        (n,) in the units of the constants [SI]; inf where the data leave the constant open, nan where it was held or
        there
        are as many constants as data.
    correlation
        (n, n) of the estimates [1], nan where it is not defined.
    condition
        Of the Jacobian with its columns scaled to length one [1].
    warnings
        What the data cannot tell apart, by name.
    """

    standard_errors: Array
    correlation: Array
    condition: float
    warnings: tuple[str, ...]


def determined(value: float, error: float) -> bool | None:
    """Whether a constant's standard error is within its value; None where there is no error, as of one at a bound."""
    return None if np.isnan(error) else bool(error <= abs(value))


def constant_note(known: bool | None, at_bound: bool) -> str:
    """Return what a table says of a constant: at its bound or not determined, else ""."""
    return "at its bound" if at_bound else "not determined" if known is False else ""


def open_constants(names: Sequence[str], values: Array, errors: Array, at_bound: Sequence[bool]) -> list[str]:
    """Say of each constant (n,) whether it ended at a bound, or with a standard error beyond its value."""
    notes = []
    for name, value, error, held in zip(names, values, errors, at_bound, strict=True):
        if held:
            notes.append(f"{name} ended at its bound {value:.4g}; it was held there for the other standard errors")
        elif determined(value, error) is False:
            notes.append(
                f"{name} is not determined, for its standard error {error:.3g} exceeds its value {value:.3g}: fix it, "
                "or add measurements that depend on it"
            )
    return notes


def repeats(*columns: Array) -> NDArray[np.intp]:
    """Return a number for each row of some columns (m,) or (m, k), the same for equal rows; nan equals nan."""
    table = np.nan_to_num(np.column_stack(columns), nan=-1.7e308)
    return np.asarray(np.unique(table, axis=0, return_inverse=True)[1]).ravel()


def uncertainty(
    names: Sequence[str],
    J: Array,
    residuals: Array,
    held: Sequence[bool] | None = None,
    groups: NDArray[np.intp] | None = None,
    serial: bool = False,
    further: Further = lambda names: "measurements of another kind",
) -> Uncertainty:
    """Return the uncertainty of constants at a least-squares solution.

    J : (m, n) derivative of the weighted residuals (m,) by the constants. held : constants that are not estimated, such
    as those at a bound. The covariance is s^2 (J^T J)^-1, which takes the weighted errors as independent and of one
    size; a standard error is that of the HC3 estimate (MacKinnon and White 1985) where this is larger, so that it holds
    also where errors grow with the value. groups : (m,) numbers of `repeats`; a value that is there again tells nothing
    more. serial : whether neighbours may err alike, as of one curve; errors then grow by the correlation of neighbours
    (as of an autoregressive process of first order, Bartlett 1946).
    further : says which measurements a warning advises.
    """
    if groups is not None:
        J, residuals = (_once(groups, values) for values in (J, residuals))
    alike = _serial_correlation(residuals) if serial else 0.0
    m, n = J.shape
    free = np.flatnonzero(~np.asarray(held, bool)) if held is not None else np.arange(n)
    errors, correlation = np.full(n, np.nan), np.full((n, n), np.nan)
    if free.size == 0:
        return Uncertainty(errors, correlation, 1.0, ())
    lengths = np.linalg.norm(J[:, free], axis=0)
    U, s, Vt = np.linalg.svd(J[:, free] / np.where(lengths > 0, lengths, 1.0), full_matrices=False)
    condition = float(s[0] / s[-1]) if s[-1] > 0 and m >= free.size else np.inf
    freed = [names[int(k)] for k in free]
    if not condition < SINGULAR:
        weak = _weak_directions(Vt, s)
        opened = np.flatnonzero(np.max(np.abs(weak), axis=0) > 1e-3)
        errors[free[opened]] = np.inf
        return Uncertainty(errors, correlation, condition, (_undetermined(freed, weak[-1], further),))
    covariance = (Vt.T / s**2) @ Vt
    sizes = np.sqrt(np.diag(covariance))
    correlation[np.ix_(free, free)] = covariance / np.outer(sizes, sizes)
    warnings = list(_close_pairs(freed, correlation[np.ix_(free, free)], further))
    if condition > POORLY_CONDITIONED and not warnings:
        warnings.append(_undetermined(freed, Vt[-1], further, f"hardly determine (condition number {condition:.2g})"))
    if m > free.size:
        spread = np.sqrt(float(residuals @ residuals) / (m - free.size))
        unused = np.maximum(1 - np.sum(U**2, axis=1), _LEAST_UNUSED)  # of a value, by the fit: 1 - leverage
        each = np.sqrt(np.sum(((Vt.T / s) @ (U.T * residuals / unused)) ** 2, axis=1))
        errors[free] = np.maximum(spread * sizes, each) / lengths * np.sqrt((1 + alike) / (1 - alike))
    else:
        warnings.append(f"{m} values determine {free.size} constants without any to spare: no standard errors")
    return Uncertainty(errors, correlation, condition, tuple(warnings))


def _once(groups: NDArray[np.intp], values: Array) -> Array:
    """Return each value that is there n times once, times sqrt(n), in the order in which they come first."""
    _, first, times = np.unique(groups, return_index=True, return_counts=True)
    order = np.argsort(first)
    scale = np.sqrt(times[order])
    return np.asarray(values[first[order]] * (scale if values.ndim == 1 else scale[:, None]))


def _serial_correlation(residuals: Array) -> float:
    """Return the correlation of neighbouring residuals, 0 where it is within what chance makes of independent ones."""
    size = float(residuals @ residuals)
    if len(residuals) < _FEWEST or not size > 0:
        return 0.0
    found = float(residuals[1:] @ residuals[:-1]) / size
    return min(found, _MOST_ALIKE) if found > 2 / np.sqrt(len(residuals)) else 0.0


def _weak_directions(Vt: Array, s: Array) -> Array:
    """Return the directions of the constants that the data leave open, as rows; the weakest last."""
    weak = Vt[s < s[0] / SINGULAR]
    return weak if len(weak) else Vt[-1:]


def _close_pairs(names: Sequence[str], correlation: Array, further: Further) -> list[str]:
    """Say in one line which pairs of constants the data hardly tell apart."""
    pairs = [
        (names[j], names[i], f"{names[j]} and {names[i]} (correlation {correlation[i, j]:.4f})")
        for i in range(len(names))
        for j in range(i)
        if abs(correlation[i, j]) > CLOSE
    ]
    if not pairs:
        return []
    more = further([name for pair in pairs for name in pair[:2]])
    return [
        f"the data hardly tell apart {', '.join(words for *_, words in pairs)}: fix one of each pair, or add {more}"
    ]


def _undetermined(names: Sequence[str], direction: Array, further: Further, how: str = "do not determine") -> str:
    """Say which constants have most part in a direction that the data leave open."""
    order = np.argsort(-np.abs(direction))[:2]
    chosen = [names[int(k)] for k in order if abs(direction[k]) > 1e-3]
    if len(chosen) < 2:
        return f"the data {how} {chosen[0]}: fix it, or add measurements that depend on it"
    return f"the data {how} {chosen[0]} and {chosen[1]} apart: fix one of them, or add {further(chosen)}"
