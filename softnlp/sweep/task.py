"""What a workspace scenario asks for, as data in SI units."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softnlp.model.rod import Vector

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Axis:
    """One number that differs between poses besides the pressures.

    key : as the scenario names it. quantity : of `softnlp.model.quantities`. place : which entry of that quantity it
    is, or the vector that it multiplies; None for a quantity that is a number.
    values : (levels,) SI, of a grid or beside given pressures; (2,), both ends, of samples.
    """

    key: str
    quantity: str
    place: int | Vector | None
    values: Array


@dataclass(frozen=True, eq=False)
class WorkspaceTask:
    """A grid (`levels` a set), `samples`, or neither: the scenario's own pressures in their order.

    sets : chamber sets that are swept, counted from 0; the others have no pressure. lowest, highest : [Pa].
    seed : of the scrambling of the samples. vary : what else differs, the first of them slowest.
    """

    levels: int | None = None
    samples: int | None = None
    sets: tuple[int, ...] = ()
    lowest: float = 0.0
    highest: float = 0.0
    seed: int = 0
    vary: tuple[Axis, ...] = ()

    def step_count(self, pressures: int) -> int:
        """Return the number of poses, for so many pressures of the scenario."""
        if self.samples is not None:
            return self.samples
        count = pressures if self.levels is None else self.levels ** len(self.sets)
        for axis in self.vary:
            count *= axis.values.size
        return count
