"""Obstacles beside the robot: solids with an exact signed distance, and what of the robot touches them.

The distance is that of a point to the surface, positive outside of the solid. The robot is the tube of its outer radius
around its axis, so that the gap at a point of the axis is the distance less that radius. Lengths are of the order of
one, as they are over the robot's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import isfinite
from typing import ClassVar, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError

Array = NDArray[np.float64]
Part = Literal["body", "tip axis", "tip rim"]
"""What touches: every point of the body, the end of the axis alone, or the rim of radius D_r/2 at the tip."""


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
        """What it is made of, (entries,) in the order of `units` [m, 1]."""
        raise NotImplementedError


@dataclass(frozen=True, kw_only=True)
class Plane(Obstacle):
    """A half-space.

    Attributes
    ----------
    part
        What of the robot touches it.
    name
        By which results call it; its kind and number where there is none.
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
        """Point and normal, (6,) [m, 1]."""
        return (*self.point, *self.normal)


@dataclass(frozen=True, kw_only=True)
class Sphere(Obstacle):
    """A ball.

    Attributes
    ----------
    part
        What of the robot touches it.
    name
        By which results call it; its kind and number where there is none.
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
        """Centre and radius, (4,) [m]."""
        return (*self.centre, self.radius)


@dataclass(frozen=True, kw_only=True)
class _Round(Obstacle):
    """What turns about a line from one point to another.

    Attributes
    ----------
    part
        What of the robot touches it.
    name
        By which results call it; its kind and number where there is none.
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
        """Both points and the radius, (7,) [m]."""
        return (*self.start, *self.end, self.radius)


@dataclass(frozen=True, kw_only=True)
class Cylinder(_Round):
    """A solid cylinder with flat ends.

    Attributes
    ----------
    part
        What of the robot touches it.
    name
        By which results call it; its kind and number where there is none.
    start, end
        (3,) on its axis, world frame [m].
    radius
        A number [m].
    """

    kind = "cylinder"


@dataclass(frozen=True, kw_only=True)
class Capsule(_Round):
    """A solid cylinder with round ends of its radius about both points.

    Attributes
    ----------
    part
        What of the robot touches it.
    name
        By which results call it; its kind and number where there is none.
    start, end
        (3,) on its axis, world frame [m].
    radius
        A number [m].
    """

    kind = "capsule"


@dataclass(frozen=True, kw_only=True)
class Tube(_Round):
    """A bore through a wall that is thick on all sides; the robot is inside.

    Both end faces of the wall, and the rim of the bore, are part of it.

    Attributes
    ----------
    part
        What of the robot touches it.
    name
        By which results call it; its kind and number where there is none.
    start, end
        (3,) on its axis, world frame [m].
    radius
        A number [m].
    """

    kind = "tube"


@dataclass(frozen=True, kw_only=True)
class Trocar(Obstacle):
    """A port: a `Tube` by its middle, its axis and its length.

    Attributes
    ----------
    part
        What of the robot touches it.
    name
        By which results call it; its kind and number where there is none.
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
        """The points at both ends and the radius, (7,) [m]."""
        half = self.length / 2 * np.array(self.axis)
        return (*(np.array(self.point) - half).tolist(), *(np.array(self.point) + half).tolist(), self.radius)


KINDS: dict[str, type[Obstacle]] = {c.kind: c for c in (Plane, Sphere, Cylinder, Capsule, Trocar, Tube)}
"""The classes by the words of a scenario."""
