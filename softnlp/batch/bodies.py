"""Which of many solved poses are shapes that no body can take without passing through itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softnlp.batch.reduced import POSITION
from softnlp.batch.shooting import Shooting
from softnlp.body import TURN, overlapping

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_FINE = 4  # intervals to a radian, which show where an axis is to a thousandth of its length
_AXIS = slice(9, 12)  # third column of the rotation in a state


def self_intersecting(
    shooting: Shooting, onward: str, start: Array, data: Array, tightness: Array, bending: Array, radius: Array, K: Array
) -> Mask:
    """Return which of n poses pass through themselves, as `softnlp.body.Fit` says it.

    onward : the map of a step. start, data : as it takes them, (fields, n). tightness : curvature times radius. bending :
    [rad]. radius : outer, scaled. K : intervals of each pose. Axes that turn little are not looked at, so most poses
    cost nothing.
    """
    found: Mask = tightness >= 1
    curled = np.flatnonzero(~found & (bending > TURN))
    if not curled.size:
        return found
    intervals = int(min(K[curled].max(), np.ceil(_FINE * bending[curled].max())))
    state, given = start[:, curled], data[:, curled]
    nodes = [state]
    for k in range(intervals):
        at = np.repeat([[k / intervals], [1 / intervals]], curled.size, axis=1)
        state = shooting.apply(onward, np.vstack([state, given, at]))
        nodes.append(state)
    every = np.array(nodes).transpose(2, 0, 1)
    found[curled] = overlapping(every[:, :, POSITION], every[:, :, _AXIS], radius[curled])
    return found
