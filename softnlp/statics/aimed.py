"""What is left between the tip and its target."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Aimed:
    """A target of inverse kinematics and how near the tip comes to it at the step's pressure, world frame.

    Attributes
    ----------
    position, direction
        (3,) of the target, [m] and [1], or None where it has none.
    distance, angle
        What is left of them, [m] and [rad], or None.
    tip_position, tip_direction
        (3,) where the tip is then, [m] and [1], also where that is the nearest reachable point only; None without any
        pose.
    optimal
        Whether the pressures satisfy the first-order conditions of what was chosen: the least pressures where the
        target is met with sets to spare, else the nearest tip. None where nothing was left to choose.
    """

    position: Array | None
    direction: Array | None
    distance: float | None = None
    angle: float | None = None
    tip_position: Array | None = None
    tip_direction: Array | None = None
    optimal: bool | None = None
