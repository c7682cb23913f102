"""Smooth functions of a stretch as polynomials: what a section knows of its silicone, whatever the law.

A law, its rings and its liners enter the potential of a section only as functions of one stretch. Each is put into a
polynomial once for a pose, by values at fixed places, which may be symbols; the rod then evaluates polynomials, which
costs the same for every law. The place is y, linear in (mu - 1) / (mu + 1) with mu the stretch over 1: the functions
have their poles at mu = 0 and at infinity, which are at equal distances there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

BODY_SIZE, LINER_SIZE = 17, 25
"""Numbers of curves of a body's fibre and of a liner: the order of the polynomial and one."""


@lru_cache
def _to_powers(size: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the nodes in -1..1, and the matrix from values there to coefficients of powers of y."""
    nodes = np.cos(np.pi * (np.arange(size) + 0.5) / size)
    powers = np.zeros((size, size))
    for k in range(size):
        row = np.polynomial.chebyshev.cheb2poly(np.eye(size)[k])
        powers[: len(row), k] = row
    return nodes, powers @ np.linalg.inv(np.polynomial.chebyshev.chebvander(nodes, size - 1))


class Values(NamedTuple):
    """A curve's value and its first and second derivatives by the stretch."""

    value: Any
    slope: Any
    second: Any


def coefficients(values: Sequence[Any]) -> Any:
    """Return the coefficients of the curve through as many values at the stretches of a scale, numbers or symbols."""
    return ca.DM(_to_powers(len(values))[1]) @ ca.vertcat(*values)


class Place(NamedTuple):
    """A stretch as curves take it. y : of the nearest end of the range outside. beyond : what it exceeds that by.

    slope, second : derivatives of y by the stretch.
    """

    y: Any
    slope: Any
    second: Any
    beyond: Any


@dataclass(frozen=True, eq=False)
class Scale:
    """Where curves are defined, by the relative stretch mu = (lambda - pole) / (1 - pole).

    size : numbers of a curve. low, high : range of stretch; beyond it a function goes on as its second-order series.
    pole : where it has no value any more; 0 for the body's fibre.
    """

    size: int
    low: Any
    high: Any
    pole: Any = 0.0

    @property
    def _ends(self) -> tuple[Any, Any]:
        """The middle of (mu - 1) / (mu + 1), and half its length."""
        low, high = ((end - 1) / (end + 1 - 2 * self.pole) for end in (self.low, self.high))
        return (low + high) / 2, (high - low) / 2

    def stretches(self) -> list[Any]:
        """Return the (size,) stretches at which the values of a curve are given; 1 is not among them."""
        middle, half = self._ends
        z = [middle + half * float(node) for node in _to_powers(self.size)[0]]
        return [self.pole + (1 - self.pole) * (1 + one) / (1 - one) for one in z]

    def place(self, stretch: Any) -> Place:
        """Return where a stretch is."""
        middle, half = self._ends
        inside = ca.fmin(ca.fmax(stretch, self.low), self.high)
        s = 1 / (inside + 1 - 2 * self.pole)
        slope = 2 * (1 - self.pole) / half * s**2
        return Place(((inside - 1) * s - middle) / half, slope, -2 * slope * s, stretch - inside)


BODY = Scale(BODY_SIZE, 0.55, 2.1)
"""Of what depends on the stretch of a fibre of the body."""
STRETCHES = BODY.stretches()
"""(BODY_SIZE,) stretches at which the values of its curves are given."""


def liner_scale(pole: Any) -> Scale:
    """Return the scale of a liner, whose bore vanishes at the pole, 1 - r_ci^2 / r_co^2."""
    return Scale(LINER_SIZE, ca.fmax(0.8, pole + 0.4 * (1 - pole)), 2.0, pole)


def evaluated(curve: Any, at: Place) -> Values:
    """Return a curve of these coefficients at a stretch."""
    p = q = r = 0.0  # Horner's scheme with the first derivative and half of the second
    for k in range(curve.numel() - 1, -1, -1):
        r = r * at.y + q
        q = q * at.y + p
        p = p * at.y + curve[k]
    return _onward(p, q, 2 * r, at)


def derived(curve: Any) -> Any:
    """Return the coefficients of a curve's derivative by y, one less."""
    return ca.vertcat(*(k * curve[k] for k in range(1, curve.numel())))


def resting(derivative: Any, scale: Scale) -> Any:
    """Return the coefficients of `derived` with a slope of exactly 0 at stretch 1, which round-off keeps from it."""
    y, value = scale.place(1.0).y, 0.0
    for k in range(derivative.numel() - 1, -1, -1):
        value = value * y + derivative[k]
    return ca.vertcat(derivative[0] - value, derivative[1:])


def slope_of(derivative: Any, at: Place) -> Any:
    """Return the first derivative by the stretch of the curve that `derived` is of, within its range."""
    q = 0.0
    for k in range(derivative.numel() - 1, -1, -1):
        q = q * at.y + derivative[k]
    return q * at.slope


def slopes_of(derivative: Any, at: Place) -> tuple[Any, Any]:
    """Return the first and second derivatives by the stretch of the curve that `derived` is of."""
    last = derivative.numel() - 1
    q, r = derivative[last], 0.0
    for k in range(last - 1, -1, -1):
        r = r * at.y + q
        q = q * at.y + derivative[k]
    found = _onward(0.0, q, r, at)
    return found.slope, found.second


def _onward(p: Any, q: Any, r: Any, at: Place) -> Values:
    """Return derivatives by y as those by the stretch, with the series beyond the range."""
    slope, second = q * at.slope, r * at.slope**2 + q * at.second
    x = at.beyond
    return Values(p + slope * x + second * x**2 / 2, slope + second * x, second)
