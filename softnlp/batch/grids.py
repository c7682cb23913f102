"""Grids of many poses: few sizes, and groups of equal ones that the kernels run side by side."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softnlp.native.kernels import WIDTH

Array = NDArray[np.float64]

_LEVELS = np.unique(np.round(6 * 2 ** (np.arange(60) / 6)).astype(np.int64))  # grid sizes, 12 % apart
MOST_INTERVALS = 400


def grid_level(wanted: Array) -> NDArray[np.int64]:
    """Return the next grid size of a list, so that many poses share one."""
    capped = np.minimum(np.where(np.isfinite(wanted), wanted, _LEVELS[0]), MOST_INTERVALS)
    return _LEVELS[np.searchsorted(_LEVELS, capped)]


def whole_groups(intervals: NDArray[np.int64]) -> tuple[NDArray[np.intp], NDArray[np.int64]]:
    """Return which pose stands in each slot of groups of equal grids, and the grid of each group."""
    slots, counts = [np.zeros(0, np.intp)], [np.zeros(0, np.int64)]
    for K in np.unique(intervals):
        poses = np.flatnonzero(intervals == K)
        groups = -(-poses.size // WIDTH)
        slots.append(np.concatenate([poses, np.full(groups * WIDTH - poses.size, poses[-1])]))
        counts.append(np.full(groups, K))
    return np.concatenate(slots), np.concatenate(counts)
