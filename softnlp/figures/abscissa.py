"""What the panels of a run are drawn against."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softnlp.base.columns import OUTPUTS
from softnlp.base.units import BAR
from softnlp.figures.style import listed
from softnlp.results import RunView

Array = NDArray[np.float64]

STEP = "step"


@dataclass(frozen=True, eq=False)
class Abscissa:
    """What the panels are drawn against. values : (steps,). with_pressures : whether a panel of pressures is needed.

    unit : of the values in SI.
    """

    values: Array
    label: str
    with_pressures: bool
    unit: float = 1.0


def abscissa(view: RunView) -> Abscissa:
    """Choose the pressure where one number tells it, else time, else the step.

    One number tells the pressure where the sets that are used all have the same, and others none.
    """
    P = view.pressure
    used = [k for k in range(P.shape[1]) if np.any(P[:, k] > 0)]
    if used and np.ptp(P[:, used[0]]) > 0 and all(np.allclose(P[:, k], P[:, used[0]]) for k in used):
        names = listed([str(k + 1) for k in used])
        label = f"pressure of set{'s' if len(used) > 1 else ''} {names} [bar]"
        return Abscissa(P[:, used[0]] / BAR, label, False, BAR)
    if view.time is not None:
        return Abscissa(view.time, OUTPUTS["t"].axis, True)
    return Abscissa(np.arange(1, len(P) + 1, dtype=float), STEP, True)
