"""Which of many solved poses are shapes that no body can take without passing through itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softnlp.native.shooting import Shooting
from softnlp.statics.body import TURN, overlapping
from softnlp.statics.reduced import POSITION

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_FINE = 4  # intervals to a radian, which show where an axis is to a thousandth of its length
_AXIS = slice(9, 12)  # third column of the rotation in a state


def self_intersecting(
    shooting: Shooting,
    onward: str,
    start: Array,
    data: Array,
    *,
    curvature: Array,
    bending: Array,
    radius: Array,
    intervals: NDArray[np.int64],
) -> Mask:
    """Return which of n poses pass through themselves, as `softnlp.statics.body.Fit` says it.

    onward : the map of a step. start, data : as it takes them, (fields, n). curvature, radius : the largest and the
    outer one, scaled. bending : [rad]. intervals : of each pose. Axes that turn little are not followed, so most poses
    cost nothing.
    """
    found: Mask = curvature * radius >= 1
    curled = np.flatnonzero(~found & (bending > TURN))
    if not curled.size:
        return found
    K = int(min(intervals[curled].max(), np.ceil(_FINE * bending[curled].max())))
    state, given = start[:, curled], data[:, curled]
    nodes = [state]
    for k in range(K):
        at = np.repeat([[k / K], [1 / K]], curled.size, axis=1)
        state = shooting.apply(onward, np.vstack([state, given, at]))
        nodes.append(state)
    every = np.array(nodes).transpose(2, 0, 1)
    found[curled] = overlapping(every[:, :, POSITION], every[:, :, _AXIS], radius[curled])
    return found
