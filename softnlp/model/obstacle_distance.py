"""The exact signed distance of a point from an obstacle, for numbers and symbols.

Lengths are of the order of one, as they are over the robot's: axes and centres, where the distance has a kink, are
rounded off by 3e-5 of that.
"""

from __future__ import annotations

from functools import singledispatch
from typing import Any

import casadi as ca

from softnlp.model.obstacles import Capsule, Cylinder, Obstacle, Plane, Sphere, Trocar, Tube

_NOTHING = 1e-24  # under a root, so that its slope is a number at zero
_ROUNDED = 1e-9  # the same on an axis or at a centre, where the slope turns round


@singledispatch
def signed_distance(obstacle: Obstacle, point: Any, numbers: Any) -> Any:
    """Return the distance of a point (3,) from a solid's surface, positive outside. numbers : as the obstacle's."""
    raise NotImplementedError(obstacle.kind)


@signed_distance.register
def _(obstacle: Plane, point: Any, numbers: Any) -> Any:
    return ca.dot(point - numbers[:3], numbers[3:6])


@signed_distance.register
def _(obstacle: Sphere, point: Any, numbers: Any) -> Any:
    return _norm(point - numbers[:3]) - numbers[3]


@signed_distance.register
def _(obstacle: Cylinder, point: Any, numbers: Any) -> Any:
    radial, z, half = _along(point, numbers)
    return _corner(radial - numbers[6], ca.fabs(z) - half)


@signed_distance.register
def _(obstacle: Capsule, point: Any, numbers: Any) -> Any:
    a, b = numbers[:3], numbers[3:6]
    t = ca.fmin(ca.fmax(ca.dot(point - a, b - a) / ca.sumsqr(b - a), 0), 1)
    return _norm(point - a - t * (b - a)) - numbers[6]


@signed_distance.register(Tube)
@signed_distance.register(Trocar)
def _(obstacle: Obstacle, point: Any, numbers: Any) -> Any:
    radial, z, half = _along(point, numbers)
    return _corner(numbers[6] - radial, ca.fabs(z) - half)


def _norm(a: Any) -> Any:
    return ca.sqrt(ca.sumsqr(a) + _ROUNDED)


def _along(point: Any, numbers: Any) -> tuple[Any, Any, Any]:
    """Return how far a point is from an axis, from its middle along it, and half its length."""
    a, b = numbers[:3], numbers[3:6]
    length = _norm(b - a)
    e = (b - a) / length
    from_middle = point - (a + b) / 2
    z = ca.dot(from_middle, e)
    return _norm(from_middle - z * e), z, length / 2


def _corner(outward: Any, beyond: Any) -> Any:
    """Return the distance to the edge of a solid that two distances to its faces bound."""
    outside = ca.sqrt(ca.fmax(outward, 0) ** 2 + ca.fmax(beyond, 0) ** 2 + _NOTHING)
    return ca.fmin(ca.fmax(outward, beyond), 0) + outside
