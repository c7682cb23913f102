"""Sums over discs of what depends on the stretch of a fibre, lambda = v + k . X, with its derivatives by v and k.

Seen along k the fibres of a disc differ in one coordinate only, so that its chords are all that is summed over: Gauss's
rule with the weight sqrt(1 - x^2), of n points, is exact for polynomials of order 2n - 1 over the whole disc.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import cos, pi, sin
from typing import Any

import casadi as ca

from softnlp.model.cubature import Points

_LEAST = 1e-20  # of (k r)^2: a straight section bends in no direction


@dataclass(frozen=True, eq=False)
class Disc:
    """A disc of the section as cast, or with a negative sign a hole in it.

    centre : (2,) [m]. radius : [m]. points : of the rule. sign : 1 or -1.
    """

    centre: tuple[Any, Any]
    radius: Any
    points: int
    sign: int = 1

    @property
    def area(self) -> Any:
        """With its sign [m^2]."""
        return self.sign * ca.pi * self.radius**2


@dataclass(frozen=True)
class Layout:
    """What of a section is built into its equations.

    liners : of each chamber (N,) which liner it has, from 0; -1 where the body is wound and its silicone is all one.
    points : of the silicone outside threads and bores, in the unit of `Potential.outer`; () is a disc without discs.
    spread : of each liner the points of its silicone with weights whose sum is 1; () takes it at the chamber's centre.
    held : whether thread around the body keeps the place of each chamber, so that pressures work without arms.
    """

    liners: tuple[int, ...]
    points: Points = ()
    spread: tuple[Points, ...] = ((),)
    held: bool = False

    @property
    def kinds(self) -> int:
        """How many liners there are."""
        return max(self.liners, default=-1) + 1


@dataclass(frozen=True, eq=False)
class Sums:
    """What a sum over fibres gives: by v and k = (k_1, k_2).

    v, k : first derivatives, a number and (2,). vv, vk, kk : second ones, a number, (2,) and (11, 12, 22).
    """

    v: Any
    k: tuple[Any, Any]
    vv: Any
    vk: tuple[Any, Any]
    kk: tuple[Any, Any, Any]

    def __add__(self, other: Sums) -> Sums:
        """Return both together."""
        return Sums(
            self.v + other.v,
            (self.k[0] + other.k[0], self.k[1] + other.k[1]),
            self.vv + other.vv,
            (self.vk[0] + other.vk[0], self.vk[1] + other.vk[1]),
            (self.kk[0] + other.kk[0], self.kk[1] + other.kk[1], self.kk[2] + other.kk[2]),
        )


def chords(points: int) -> list[tuple[float, float]]:
    """Return places in -1..1 of the rule, and weights whose sum is 1."""
    angles = [pi * j / (points + 1) for j in range(1, points + 1)]
    return [(cos(angle), 2 / (points + 1) * sin(angle) ** 2) for angle in angles]


def over_disc(disc: Disc, slopes: Callable[[Any], tuple[Any, Any]], v: Any, k: tuple[Any, Any]) -> Sums:
    """Return the integral over a disc. slopes(stretch) : first and second derivative of the energy of a fibre [Pa]."""
    r, (x, y) = disc.radius, disc.centre
    size = ca.sqrt(k[0] ** 2 + k[1] ** 2 + _LEAST / r**2)
    e_1, e_2 = k[0] / size, k[1] / size
    middle, reach = v + k[0] * x + k[1] * y, r * size
    A = B = A2 = B2 = C = D = 0.0
    for place, weight in chords(disc.points):
        first, second = slopes(middle + place * reach)
        A += weight * first
        B += weight * place * first
        A2 += weight * second
        B2 += weight * place * second
        C += weight * place**2 * second
        D += weight * (1 - place**2) / 3 * second
    a, d_1, d_2 = disc.area, r * e_1, r * e_2
    across, more = r**2 * D, (C - D)
    return Sums(
        a * A,
        (a * (x * A + d_1 * B), a * (y * A + d_2 * B)),
        a * A2,
        (a * (x * A2 + d_1 * B2), a * (y * A2 + d_2 * B2)),
        (
            a * (x * x * A2 + 2 * x * d_1 * B2 + d_1 * d_1 * more + across),
            a * (x * y * A2 + (x * d_2 + y * d_1) * B2 + d_1 * d_2 * more),
            a * (y * y * A2 + 2 * y * d_2 * B2 + d_2 * d_2 * more + across),
        ),
    )


def first_over_disc(disc: Disc, slope: Callable[[Any], Any], v: Any, k: tuple[Any, Any]) -> tuple[Any, tuple[Any, Any]]:
    """Return the first derivatives alone, by v and k. slope(stretch) : of the energy of a fibre [Pa]."""
    r, (x, y) = disc.radius, disc.centre
    size = ca.sqrt(k[0] ** 2 + k[1] ** 2 + _LEAST / r**2)
    middle, reach = v + k[0] * x + k[1] * y, r * size
    A = B = 0.0
    for place, weight in chords(disc.points):
        first = slope(middle + place * reach)
        A += weight * first
        B += weight * place * first
    a, out = disc.area, r / size * B
    return a * A, (a * (x * A + k[0] * out), a * (y * A + k[1] * out))


def at_point(centre: tuple[Any, Any], first: Any, second: Any) -> Sums:
    """Return what one fibre gives, of its energy's derivatives [N]."""
    x, y = centre
    by_both = (x * x * second, x * y * second, y * y * second)
    return Sums(first, (x * first, y * first), second, (x * second, y * second), by_both)


def placed(points: Points, unit: Any, weight: Any) -> list[tuple[tuple[Any, Any], Any]]:
    """Return the places of points and their weights, in units of both."""
    return [((x * unit, y * unit), w * weight) for x, y, w in points]


def value_over(discs: Sequence[Disc], energy: Callable[[Any], Any], v: Any, k: tuple[Any, Any]) -> Any:
    """Return the integral of an energy over discs. energy(stretch) : of a fibre [Pa]."""
    total = 0.0
    for disc in discs:
        size = ca.sqrt(k[0] ** 2 + k[1] ** 2 + _LEAST / disc.radius**2)
        middle = v + k[0] * disc.centre[0] + k[1] * disc.centre[1]
        mean = sum(w * energy(middle + place * disc.radius * size) for place, w in chords(disc.points))
        total += disc.area * mean
    return total
