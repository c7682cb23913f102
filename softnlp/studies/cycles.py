"""Load cycles of a test: where a quantity rises and where it falls."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

CYCLES = ("first loading", "unloading", "all")  # what may be asked for, beside the number of a loading
_FALL, _RESTART = 0.2, 0.1  # of the range of the stretch: the least fall; how near to its end another test starts


class Leg(NamedTuple):
    """Rows first to before `end` over which a quantity rises, or falls."""

    first: int
    end: int
    rising: bool


def legs(values: Array, turn_of: float = 0.1) -> list[Leg]:
    """Return the loadings and unloadings of a test, by the turns that are larger than a part of its range."""
    span = float(np.ptp(values)) * turn_of
    found: list[Leg] = []
    first = turn = 0
    rising: bool | None = None
    for k, value in enumerate(values):
        if rising is None:
            if abs(value - values[first]) > span:
                rising, turn = bool(value > values[first]), k
        elif (value >= values[turn]) == rising or value == values[turn]:
            turn = k if value != values[turn] else turn
        elif abs(value - values[turn]) > span:
            found.append(Leg(first, turn + 1, rising))
            first, rising, turn = turn, not rising, k
    found.append(Leg(first, len(values), True if rising is None else rising))
    return found


def unloadings(stretch: Array) -> int:
    """Return how often the stretch falls point by point; a jump back to the start is another test."""
    start = float(np.min(stretch)) + _RESTART * float(np.ptp(stretch))
    falls = [leg for leg in legs(stretch, _FALL) if not leg.rising]
    return sum(leg.end - leg.first > 2 or bool(stretch[leg.end - 1] > start) for leg in falls)
