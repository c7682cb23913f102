"""First guesses for many poses from a few that are solved: a polynomial through what loads add to the unloaded arc."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def predicted(features: Array, known: NDArray[np.intp], values: Array) -> Array:
    """Return values at every pose from those of the known ones, by least squares.

    features : (poses, columns) of what differs between poses. known : numbers of the solved poses. values : (rows,
    known). The polynomial is quadratic where there are twice as many known poses as it has terms, else linear, else the
    mean; without any known pose the prediction is 0.
    """
    n = len(features)
    if known.size == 0:
        return np.zeros((len(values), n))
    low, span = features.min(axis=0), np.ptp(features, axis=0)
    x = (features[:, span > 0] - low[span > 0]) / span[span > 0]
    d = x.shape[1]
    terms = [np.ones((n, 1))]
    if known.size >= 2 * (d + 1):
        terms.append(x)
    if known.size >= (d + 1) * (d + 2):
        i, j = np.triu_indices(d)
        terms.append(x[:, i] * x[:, j])
    basis = np.hstack(terms)
    found = np.linalg.lstsq(basis[known], values.T, rcond=None)[0]
    at_all: Array = (basis @ found).T
    return at_all
