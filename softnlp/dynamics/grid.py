"""Gauss collocation along a body: integrals from the base and to the tip as matrices over all Gauss points.

The state at a Gauss point is that at its interval's base end and a quadrature of the rates at the interval's Gauss
points; integrals towards the tip take the rest of the same quadrature. Both together keep the balance of energy of the
rod: the method is its own adjoint.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from softnlp.model.body import Body

Array = NDArray[np.float64]
Integers = NDArray[np.intp]

POINTS = 4
"""Gauss points to an interval, so that the method is of order 8 along the rod."""
INTERVALS = 3
"""Intervals to a segment where no number is asked for."""


def gauss(points: int) -> tuple[Array, Array, Array]:
    """Return places c, weights b and matrix A of Gauss collocation on 0..1: (d,), (d,), (d, d)."""
    c, b = (part / 2 for part in np.polynomial.legendre.leggauss(points))
    c = c + 0.5
    return c, b, _integrals(c, c)


def _integrals(c: Array, at: Array) -> Array:
    """Return (m, d) integrals from 0 to each place of the polynomials that are 1 at one of c and 0 at the others."""
    x, w = np.polynomial.legendre.leggauss(c.size)
    found = np.empty((at.size, c.size))
    for i, end in enumerate(at):
        found[i] = (w / 2 * end) @ _values(c, (x + 1) / 2 * end)
    return found


def _values(c: Array, at: Array) -> Array:
    """Return (m, d) these polynomials at places."""
    found = np.ones((at.size, c.size))
    for j in range(c.size):
        for k in range(c.size):
            if k != j:
                found[:, j] *= (at - c[k]) / (c[j] - c[k])
    return found


@dataclass(frozen=True, eq=False)
class Grid:
    """n Gauss points on the segments of a body, S the arc length as cast, without connectors.

    place : (n,) S of each [m]. weight : (n,) of the integral over the body [m]. segment : (n,) of each, from 0.
    fraction : (n,) of its segment's length. from_base : (n, n) integrals from the base to each point. ends : (K + 1,)
    of the intervals [m]. of_interval : (K,) the segment of each. points : Gauss points to an interval.
    joints : the connectors' places (m,), in intervals from the base, and connectors : (m,) their lengths [m].
    """

    place: Array
    weight: Array
    segment: Integers
    fraction: Array
    from_base: Array
    ends: Array
    of_interval: Integers
    points: int
    joints: Integers
    connectors: Array

    @property
    def size(self) -> int:
        """N."""
        return self.place.size

    @cached_property
    def to_tip(self) -> Array:
        """(n, n) integrals from each point to the tip [m]."""
        return self.weight - self.from_base

    @cached_property
    def at_joints(self) -> Array:
        """(m, n) integrals from the base to each connector [m]."""
        first = self.joints * self.points
        return self.weight * (np.arange(self.size) < first[:, None])

    @cached_property
    def beyond(self) -> Array:
        """(n + 1, m) 1 where a connector lies between the base and a point, the tip last."""
        before = self.joints * self.points
        return (before <= np.append(np.arange(self.size), self.size)[:, None]).astype(float)

    def at(self, interval: Integers, fraction: Array) -> tuple[Array, Array]:
        """Return (m, n) integrals from the base to places in intervals, and the polynomials' values there."""
        integrals, values = np.zeros((2, interval.size, self.size))
        c, d = gauss(self.points)[0], self.points
        lengths = np.diff(self.ends)
        for row, (k, t) in enumerate(zip(interval, fraction, strict=True)):
            own, one = slice(k * d, k * d + d), np.array([t])
            integrals[row, : k * d] = self.weight[: k * d]
            integrals[row, own] = lengths[k] * _integrals(c, one)[0]
            values[row, own] = _values(c, one)[0]
        return integrals, values


def grid_of(body: Body, intervals: int | None = None, points: int = POINTS) -> Grid:
    """Return the grid of a body.

    intervals : to a segment; knots of a section that varies are ends of intervals too.
    """
    ends, of_interval, joints, connectors = [0.0], list[int](), list[int](), list[float]()
    for k, segment in enumerate(body.segments):
        length, begin = float(segment.robot.length), ends[-1]
        cuts = np.union1d(np.linspace(0.0, 1.0, (intervals or INTERVALS) + 1), body.knots(k))
        cuts = cuts[np.append(True, np.diff(cuts) > 1e-9)]
        ends += [begin + length * float(cut) for cut in cuts[1:]]
        of_interval += [k] * (len(cuts) - 1)
        if segment.connector > 0:
            joints.append(len(of_interval))
            connectors.append(segment.connector)
    c, b, A = gauss(points)
    S, h = np.array(ends), np.diff(ends)
    K, n = h.size, h.size * points
    from_base = np.zeros((n, n))
    weight = (h[:, None] * b).ravel()
    for k in range(K):
        own = slice(k * points, (k + 1) * points)
        from_base[own, : k * points] = weight[: k * points]
        from_base[own, own] = h[k] * A
    place = (S[:-1, None] + h[:, None] * c).ravel()
    segment_of = np.repeat(np.array(of_interval, np.intp), points)
    lengths = np.array([float(s.robot.length) for s in body.segments])
    begins = np.cumsum(lengths) - lengths
    return Grid(
        place=place,
        weight=weight,
        segment=segment_of,
        fraction=(place - begins[segment_of]) / lengths[segment_of],
        from_base=from_base,
        ends=S,
        of_interval=np.array(of_interval, np.intp),
        points=points,
        joints=np.array(joints, np.intp),
        connectors=np.array(connectors),
    )
