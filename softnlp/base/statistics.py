"""Statistics of errors, and rows grouped by which chamber sets have pressure: numbers alone, no physics."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

NOTHING = 1e-6  # of the largest size compared with: less is next to nothing, such as the angle of a straight shape
USED = 100.0  # a set at less has no pressure, in naming groups [Pa]
MOST_GROUPS = 8


@dataclass(frozen=True)
class Statistics:
    """How far a model is from data; in the data's unit, nan where there is nothing to tell.

    Attributes
    ----------
    count
        Of errors.
    rmse
        Root mean square [m, rad or N].
    mape
        Mean size of what each error is compared with [%].
    mean
        Of the errors' sizes [m, rad or N].
    median
        Of the errors' sizes [m, rad or N].
    largest
        Of the errors' sizes [m, rad or N].
    bias
        Mean of the errors with their sign [m, rad or N].
    left_out
        How many errors the mape leaves out, for what they are compared with is next to nothing.
    """

    count: int
    rmse: float
    mape: float
    mean: float
    median: float
    largest: float
    bias: float
    left_out: int


def statistics(errors: Array, compared_with: Array | None = None) -> Statistics:
    """Return the statistics of errors (M,), each compared with a number (M,) for the mape."""
    nan = float("nan")
    if not len(errors):
        return Statistics(0, nan, nan, nan, nan, nan, nan, 0)
    sizes = np.abs(errors)
    mape, left_out = nan, 0
    if compared_with is not None:
        whole = np.abs(compared_with)
        kept = whole > NOTHING * np.max(whole)
        left_out = int(np.sum(~kept))
        mape = float(100 * np.mean(sizes[kept] / whole[kept])) if np.any(kept) else nan
    return Statistics(
        count=len(sizes),
        rmse=float(np.sqrt(np.mean(sizes**2))),
        mape=mape,
        mean=float(np.mean(sizes)),
        median=float(np.median(sizes)),
        largest=float(np.max(sizes)),
        bias=float(np.mean(errors)),
        left_out=left_out,
    )


def groups(pressure: Array) -> list[tuple[str, Mask]]:
    """Return rows (M, sets) [Pa] grouped by which sets have pressure, each with its name; by their number if many."""
    used = pressure > USED
    kinds, owner = np.unique(used, axis=0, return_inverse=True)
    owner = owner.ravel()
    if len(kinds) > MOST_GROUPS:
        count = used.sum(axis=1)
        return [(_sets_named(int(n)), count == n) for n in np.unique(count)]
    order = sorted(range(len(kinds)), key=lambda k: (int(kinds[k].sum()), (~kinds[k]).tolist()))
    return [(_named(np.flatnonzero(kinds[k]) + 1), owner == k) for k in order]


def _sets_named(count: int) -> str:
    return "none" if count == 0 else f"{count} set{'s' if count > 1 else ''}"


def _named(sets: NDArray[np.intp]) -> str:
    return "none" if not len(sets) else f"set{'s' if len(sets) > 1 else ''} {'+'.join(map(str, sets))}"
