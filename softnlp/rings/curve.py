"""Smooth functions of the stretch: polynomials in its logarithm, for numbers and symbols, with a way on outside."""

from __future__ import annotations

from dataclasses import dataclass
from math import log
from typing import Any

import casadi as ca
import numpy as np

from softnlp.rings.outline import Array


@dataclass(frozen=True)
class Curve:
    """A polynomial in t, the logarithm of the stretch taken from low..high to -1..1.

    Beyond low or high it goes on as its second-order Taylor series there: value, slope and curvature are continuous.

    Attributes
    ----------
    coefficients
        Of t^0, t^1, ...; numbers or symbols.
    low, high
        Range of stretch.
    """

    coefficients: tuple[Any, ...]
    low: float
    high: float

    def __call__(self, stretch: Any) -> Any:
        """Return the value at a stretch: a number, an array, or a symbol."""
        if isinstance(stretch, (int, float, np.ndarray)):
            t = self.place(np.log(stretch))
            inside = np.clip(t, -1, 1)
        else:
            t = self.place(ca.log(stretch))
            inside = ca.fmin(ca.fmax(t, -1), 1)
        value, slope, half = 0.0, 0.0, 0.0  # Horner's scheme with the first derivative and half of the second
        for coefficient in reversed(self.coefficients):
            half = half * inside + slope
            slope = slope * inside + value
            value = value * inside + coefficient
        beyond = t - inside
        return value + slope * beyond + half * beyond**2

    def place(self, logarithm: Any) -> Any:
        """Return t of a logarithm of a stretch."""
        low, high = log(self.low), log(self.high)
        return (2 * logarithm - low - high) / (high - low)


def fitted(stretches: Array, values: Array, low: float, high: float, order: int) -> Curve:
    """Return the polynomial of this order nearest to values in the sense of least squares."""
    series = np.polynomial.chebyshev.chebfit(Curve((), low, high).place(np.log(stretches)), values, order)
    powers = np.zeros(order + 1)  # the conversion leaves out zeros of high order
    short = np.polynomial.chebyshev.cheb2poly(series)
    powers[: len(short)] = short
    return Curve(tuple(float(c) for c in powers), low, high)


def nodes(low: float, high: float, count: int) -> Array:
    """Return stretches between low and high, denser at the ends as Chebyshev's; none too near to 1."""
    place = np.cos(np.pi * np.arange(count) / (count - 1))
    logarithm = (log(low) + log(high)) / 2 - place * (log(high) - log(low)) / 2
    near = np.abs(logarithm) < 0.02
    logarithm[near] = np.where(logarithm[near] < 0, -0.02, 0.02)
    stretches = np.exp(logarithm)
    stretches[[0, -1]] = low, high
    return np.asarray(stretches)
