"""Checks of samples whatever they are of: frozen ones, zeros, jumps, gaps of the clock, and the part that was lost."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from softnlp.laboratory.imported import ANY
from softnlp.studies.check import Check

Array = NDArray[np.float64]

_JUMP = 60.0  # median absolute changes
_FEWEST = 20


def sample_checks(columns: Mapping[str, Array], time: Array | None, lost: int = 0) -> list[Check]:
    """Return the checks of the columns of a stream; lost : rows that were left out of it as missing."""
    values = np.column_stack([column for name, column in columns.items() if name != "t_s"])
    rows = len(values)
    found = []
    if lost:
        share = lost / (lost + rows)
        found.append(
            Check("lost share", share, (0, 0.1), (0, 0.95), "the tracker often lost the sensor; shield or move it")
        )
    if rows < _FEWEST:
        return found
    moving = np.any(np.ptp(values, axis=0) > 0)
    same = np.all(np.diff(values, axis=0) == 0, axis=1)
    noisy = moving and np.mean(same) < 0.2
    if noisy:
        run = longest = 0
        for one in same:
            run = run + 1 if one else 0
            longest = max(longest, run)
        likely = "the stream stood still while its clock went on; leave these rows out"
        found.append(Check("longest run of frozen samples", float(longest), (0, 5), ANY, likely))
        zero = float(np.mean(np.all(values == 0, axis=1)))
        found.append(Check("share of rows of zeros", zero, (0, 0), ANY, "zeros stand for missing samples"))
    if time is not None and len(time) == rows:
        steps = np.diff(time)
        back = float(np.sum(steps < 0))
        found.append(
            Check("steps back in time", back, (0, 0), ANY, "two recordings in one file, or a clock that was set")
        )
        if np.median(steps) > 0:
            gap = float(np.max(steps) / np.median(steps))
            found.append(
                Check("longest gap over the usual step", gap, (0, 20), ANY, "the logger paused; look at the time")
            )
    return found


def spikes(position: Array) -> int:
    """Return how many samples (rows, 3) leave both neighbours by far more than these differ."""
    if len(position) < _FEWEST:
        return 0
    before = np.linalg.norm(position[1:-1] - position[:-2], axis=1)
    after = np.linalg.norm(position[2:] - position[1:-1], axis=1)
    across = np.linalg.norm(position[2:] - position[:-2], axis=1)
    usual = np.median(np.linalg.norm(np.diff(position, axis=0), axis=1)) + 1e-12
    return int(np.sum((np.minimum(before, after) > _JUMP * usual) & (across < 0.3 * np.minimum(before, after))))
