"""What inverse kinematics is asked: targets of the tip and bounds of the pressures, as plain data in SI units."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Target:
    """Where the tip is to be: position (3,) [m], direction (3,) of its axis, unit; one or both, world frame."""

    position: Array | None
    direction: Array | None


@dataclass(frozen=True, eq=False)
class InverseTask:
    """A path of targets and the bounds of each set's pressure.

    lower, upper : (sets,) [Pa]. length_per_radian : how much of a distance [m] a radian of misfit counts for where
    position and direction cannot both be met. allow : with "self_intersection" in it, shapes that no body can take
    without passing through itself are answers too.
    """

    targets: tuple[Target, ...]
    lower: Array
    upper: Array
    length_per_radian: float
    allow: tuple[str, ...] = ()

    def step_count(self, pressures: int) -> int:
        """Return how many steps the run has: one a target."""
        return len(self.targets)
