"""What an obstacle does to the robot in one step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ObstacleContact:
    """One obstacle and what it does to the robot in one step, world frame.

    Attributes
    ----------
    obstacle
        Its name.
    force
        (3,) on the robot, of all points where it touches [N].
    start, end
        The first and the last of these points, fractions of the length, None where it does not touch [1].
    gap
        Least distance to the body, negative where they overlap between nodes [m].
    arc
        (n,) where it touches, fractions of the length [1].
    forces
        (n, 3) on the robot there [N].
    """

    obstacle: str
    force: Array
    start: float | None
    end: float | None
    gap: float
    arc: Array
    forces: Array
