"""What drives a robot over time: pressures at the regulators, in the chambers behind a line, a force at the tip."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Series:
    """Rows over time, linear between and constant before the first and after the last; two rows of one time are a jump.

    times : (rows,) rising, not strictly [s]. values : (rows, columns).
    """

    times: Array
    values: Array

    def at(self, t: float, *, after: bool = True) -> Array:
        """Return the values at a time; after : behind a jump at that time, else before it."""
        times = self.times
        k = int(np.searchsorted(times, t, side="right" if after else "left"))
        if k == 0:
            found: Array = self.values[0]
            return found
        if k == times.size:
            found = self.values[-1]
            return found
        a, b = times[k - 1], times[k]
        part = (t - a) / (b - a)
        found = self.values[k - 1] * (1 - part) + self.values[k] * part
        return found

    @cached_property
    def jumps(self) -> Array:
        """The times at which a value jumps [s]."""
        same = (np.diff(self.times) <= 0) & np.any(np.diff(self.values, axis=0) != 0, axis=1)
        return np.unique(self.times[1:][same])

    def delayed(self, by: float) -> Series:
        """Return the same later."""
        return Series(self.times + by, self.values)


@dataclass(frozen=True, eq=False)
class Chambers:
    """Pressures in the chambers: P' = (P_regulator - P) / lag, exactly, from a pressure at t = 0.

    regulator : as the chambers see it, after the dead time. lag : [s]; without one they are the same. first : (sets,)
    in the chambers at t = 0 [Pa].
    """

    regulator: Series
    lag: float
    first: Array

    @property
    def jumps(self) -> Array:
        """The times at which the pressure in a chamber jumps [s]."""
        return self.regulator.jumps if not self.lag else np.zeros(0)

    @property
    def kinks(self) -> Array:
        """The times of rows [s]."""
        return np.unique(self.regulator.times)

    @cached_property
    def _at_rows(self) -> tuple[Array, Array]:
        """Times from 0 on between which the regulator is linear, and the pressures in the chambers then."""
        times = np.append(0.0, self.kinks[self.kinks > 0])
        found = [np.asarray(self.first, float)]
        for a, b in pairwise(times):
            found.append(self._after(found[-1], a, b, b))
        return times, np.array(found)

    def _after(self, P: Array, a: float, b: float, t: float) -> Array:
        """Return what P at a becomes until t <= b, the regulator being linear from a to b."""
        low, high = self.regulator.at(a), self.regulator.at(b, after=False)
        slope = (high - low) / (b - a) if b > a else np.zeros_like(low)
        steady = low - self.lag * slope
        found: Array = steady + slope * (t - a) + (P - steady) * np.exp(-(t - a) / self.lag)
        return found

    def at(self, t: float, *, after: bool = True) -> Array:
        """Return (sets,) the pressures at t >= 0; after : behind a jump at that time, else before it [Pa]."""
        if not self.lag:
            if t <= 0 and not after:
                return self.first
            return self.regulator.at(t, after=after)
        times, found = self._at_rows
        k = max(int(np.searchsorted(times, t, side="right")) - 1, 0)
        end = times[k + 1] if k + 1 < times.size else np.inf
        if not np.isfinite(end):
            steady = self.regulator.values[-1] if times[k] >= self.regulator.times[-1] else self.regulator.at(times[k])
            last: Array = steady + (found[k] - steady) * np.exp(-(t - times[k]) / self.lag)
            return last
        return self._after(found[k], times[k], end, t)
