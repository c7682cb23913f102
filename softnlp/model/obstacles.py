"""Obstacles beside the robot: solids with an exact signed distance, and what of the robot touches them.

The distance is that of a point to the surface, positive outside of the solid. The robot is the tube of its outer radius
around its axis, so that the gap at a point of the axis is the distance less that radius. Lengths are of the order of
one, as they are over the robot's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import isfinite
from typing import Any, ClassVar, Literal, get_args

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError

Array = NDArray[np.float64]
Part = Literal["body", "tip axis", "tip rim"]
"""What touches: every point of the body, the end of the axis alone, or the rim of radius D_r/2 at the tip."""

_NOTHING = 1e-24  # under a root, so that its slope is a number at zero
_ROUNDED = 1e-9  # the same on an axis or at a centre, where the slope turns round: of lengths in L_0, 3e-5 squared


def _norm(a: Any) -> Any:
    return ca.sqrt(ca.sumsqr(a) + _ROUNDED)


def _finite(values: Sequence[float], size: int, key: str) -> tuple[float, ...]:
    """Return as many finite numbers, or raise `InputError`."""
    try:
        found = tuple(float(value) for value in values)
    except (TypeError, ValueError) as error:
        raise InputError(f"expected {size} numbers", key=key) from error
    if len(found) != size or not all(map(isfinite, found)):
        raise InputError(f"expected {size} finite numbers, got {list(values)}", key=key)
    return found


def _positive(value: float, key: str) -> None:
    if not (isfinite(value) and value > 0):
        raise InputError(f"expected a length above 0, got {value!r}", key=key)


def _direction(values: Sequence[float], key: str) -> tuple[float, ...]:
    """Return three numbers as a unit vector."""
    found = np.array(_finite(values, 3, key))
    size = float(np.linalg.norm(found))
    if size == 0:
        raise InputError("expected a direction, got zeros", key=key)
    return tuple(float(value) for value in found / size)


@dataclass(frozen=True, kw_only=True)
class Obstacle:
    """What all obstacles have.

    Attributes
    ----------
    part
        What of the robot touches it.
    name
        By which results call it; its kind and number where there is none.
    """

    kind: ClassVar[str] = ""
    units: ClassVar[tuple[str, ...]] = ()
    part: Part = "body"
    name: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        if self.part not in get_args(Part):
            raise InputError(f"expected one of {', '.join(get_args(Part))}, got {self.part!r}", key="part")
        if self.part == "tip rim" and not isinstance(self, Plane):
            raise InputError(f"the rim of the tip touches a plane only, not a {self.kind}", key="part")

    @property
    def numbers(self) -> tuple[float, ...]:
        """What it is made of, in the order of `units` [m or 1]."""
        raise NotImplementedError

    def distance(self, point: Any, numbers: Any) -> Any:
        """Return the signed distance of a point.

        Parameters
        ----------
        point
            (3,) symbols or numbers, world frame [m].
        numbers
            As `Obstacle.numbers`, symbols perhaps.

        Returns
        -------
        Any
            A number, positive outside [m].
        """
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class Plane(Obstacle):
    """A half-space.

    Attributes
    ----------
    point
        (3,) of its surface, world frame [m].
    normal
        (3,) out of the solid, towards the robot; normalised [1].
    """

    kind = "plane"
    units = ("m",) * 3 + ("1",) * 3
    point: Sequence[float]
    normal: Sequence[float]

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "point", _finite(self.point, 3, "point"))
        object.__setattr__(self, "normal", _direction(self.normal, "normal"))

    @property
    def numbers(self) -> tuple[float, ...]:
        """Point and normal."""
        return (*self.point, *self.normal)

    def distance(self, point: Any, numbers: Any) -> Any:
        """Return (p - p_0) . n."""
        return ca.dot(point - numbers[:3], numbers[3:6])


@dataclass(frozen=True, kw_only=True)
class Sphere(Obstacle):
    """A ball.

    Attributes
    ----------
    centre
        (3,) world frame [m].
    radius
        A number [m].
    """

    kind = "sphere"
    units = ("m",) * 4
    centre: Sequence[float]
    radius: float

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "centre", _finite(self.centre, 3, "centre"))
        _positive(self.radius, "radius")

    @property
    def numbers(self) -> tuple[float, ...]:
        """Centre and radius."""
        return (*self.centre, self.radius)

    def distance(self, point: Any, numbers: Any) -> Any:
        """Return |p - c| - r."""
        return _norm(point - numbers[:3]) - numbers[3]


@dataclass(frozen=True, kw_only=True)
class _Round(Obstacle):
    """What turns about a line from one point to another.

    Attributes
    ----------
    start, end
        (3,) on its axis, world frame [m].
    radius
        A number [m].
    """

    units = ("m",) * 7
    start: Sequence[float]
    end: Sequence[float]
    radius: float

    def __post_init__(self) -> None:
        super().__post_init__()
        for key in ("start", "end"):
            object.__setattr__(self, key, _finite(getattr(self, key), 3, key))
        if self.start == self.end:
            raise InputError("expected two different points", key="end")
        _positive(self.radius, "radius")

    @property
    def numbers(self) -> tuple[float, ...]:
        """Both points and the radius."""
        return (*self.start, *self.end, self.radius)

    @staticmethod
    def _along(point: Any, numbers: Any) -> tuple[Any, Any, Any]:
        """Return how far a point is from the axis, from the middle along it, and half the length."""
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


@dataclass(frozen=True, kw_only=True)
class Cylinder(_Round):
    """A solid cylinder with flat ends."""

    kind = "cylinder"

    def distance(self, point: Any, numbers: Any) -> Any:
        """Return the distance to mantle, end face or edge."""
        radial, z, half = self._along(point, numbers)
        return _corner(radial - numbers[6], ca.fabs(z) - half)


@dataclass(frozen=True, kw_only=True)
class Capsule(_Round):
    """A solid cylinder with round ends of its radius about both points."""

    kind = "capsule"

    def distance(self, point: Any, numbers: Any) -> Any:
        """Return the distance to the line between the points, less the radius."""
        a, b = numbers[:3], numbers[3:6]
        t = ca.fmin(ca.fmax(ca.dot(point - a, b - a) / ca.sumsqr(b - a), 0), 1)
        return _norm(point - a - t * (b - a)) - numbers[6]


@dataclass(frozen=True, kw_only=True)
class Tube(_Round):
    """A bore through a wall that is thick on all sides; the robot is inside.

    Both end faces of the wall, and the rim of the bore, are part of it.
    """

    kind = "tube"

    def distance(self, point: Any, numbers: Any) -> Any:
        """Return the distance to the bore, the end faces or the rim."""
        radial, z, half = self._along(point, numbers)
        return _corner(numbers[6] - radial, ca.fabs(z) - half)


@dataclass(frozen=True, kw_only=True)
class Trocar(Obstacle):
    """A port: a `Tube` by its middle, its axis and its length.

    Attributes
    ----------
    point
        (3,) the middle of the port, world frame [m].
    axis
        (3,) its direction; normalised [1].
    radius, length
        Numbers [m].
    """

    kind = "trocar"
    units = Tube.units
    point: Sequence[float]
    axis: Sequence[float]
    radius: float
    length: float

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "point", _finite(self.point, 3, "point"))
        object.__setattr__(self, "axis", _direction(self.axis, "axis"))
        _positive(self.radius, "radius")
        _positive(self.length, "length")

    @property
    def numbers(self) -> tuple[float, ...]:
        """The points at both ends and the radius."""
        half = self.length / 2 * np.array(self.axis)
        return (*(np.array(self.point) - half).tolist(), *(np.array(self.point) + half).tolist(), self.radius)

    def distance(self, point: Any, numbers: Any) -> Any:
        """Return that of the tube."""
        return Tube.distance(self, point, numbers)  # type: ignore[arg-type]

    _along = staticmethod(_Round._along)


KINDS: dict[str, type[Obstacle]] = {c.kind: c for c in (Plane, Sphere, Cylinder, Capsule, Trocar, Tube)}
"""The classes by the words of a scenario."""
