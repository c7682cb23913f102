"""What a step of a run in time holds beside its pose."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Moving:
    """What a step of a run in time holds beside its pose.

    Attributes
    ----------
    tip_velocity
        (3,) world frame [m/s].
    regulator
        (sets,) pressures at the regulators; those of the step are in the chambers [Pa].
    energy
        (entries,) by the names of `softnlp.dynamics.energy.Energy`, until now [J].
    time_steps
        How many steps of time were taken since the step before.
    """

    tip_velocity: Array
    regulator: Array
    energy: Mapping[str, float]
    time_steps: int
