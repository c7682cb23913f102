"""Gravity in words: how a robot is held. World frame, +z from the base to the tip of the straight robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import acos, degrees, dist, hypot
from types import MappingProxyType

from softnlp.base.errors import InputError
from softnlp.base.reading import choices, did_you_mean, shown
from softnlp.base.units import STANDARD_GRAVITY

Direction = tuple[float, float, float]

DIRECTIONS: Mapping[str, Direction] = MappingProxyType(
    {
        "off": (0.0, 0.0, 0.0),
        "standing": (0.0, 0.0, -1.0),
        "hanging": (0.0, 0.0, 1.0),
        "-z": (0.0, 0.0, -1.0),
        "+z": (0.0, 0.0, 1.0),
        "-x": (-1.0, 0.0, 0.0),
        "+x": (1.0, 0.0, 0.0),
        "-y": (0.0, -1.0, 0.0),
        "+y": (0.0, 1.0, 0.0),
    }
)
_SIDEWAYS = ("-x", "+x", "-y", "+y")
_STRAIGHT = 1e-6  # of a unit vector: closer to an axis is along it


def unknown_direction(word: str) -> str:
    """Word that a direction is none of `DIRECTIONS`, with the nearest one, or how to say which way is down."""
    hint = did_you_mean(word.lower(), DIRECTIONS)
    hint = hint or "; say how the robot is held: 'standing' (gravity towards the base, -z) or 'hanging' (+z)"
    return f"expected one of {choices(DIRECTIONS)}, or a vector, got {shown(word)}{hint}"


def gravity_named(word: str) -> Direction:
    """Return the acceleration of one of `DIRECTIONS` (3,) [m/s^2]. Raises `InputError` for another word."""
    if word not in DIRECTIONS:
        raise InputError(unknown_direction(word), key="gravity")
    x, y, z = (STANDARD_GRAVITY * component for component in DIRECTIONS[word])
    return x, y, z


def is_hanging(gravity: Sequence[float]) -> bool:
    """Whether a robot is to be drawn with its base on top: gravity (3,) pulls along the robot more than sideways."""
    x, y, z = (float(component) for component in gravity)
    return z > hypot(x, y)


def gravity_lines(gravity: Sequence[float]) -> list[str]:
    """Return what tables and figures say of gravity (3,) [m/s^2]: one line, or none where it is off."""
    return [gravity_words(gravity)] if any(gravity) else []


def gravity_words(gravity: Sequence[float]) -> str:
    """Return in words how gravity (3,) [m/s^2] pulls; a size is given where it is not the standard one."""
    size = hypot(*(float(component) for component in gravity))
    if size == 0:
        return "no gravity"
    x, y, z = (float(component) / size + 0.0 for component in gravity)
    across = hypot(x, y)
    side = next((name for name in _SIDEWAYS if dist((x, y, z), DIRECTIONS[name]) < _STRAIGHT), None)
    if across < _STRAIGHT:
        words = "standing, gravity towards the base (-z)" if z < 0 else "hanging, gravity away from the base (+z)"
    elif side is not None:
        words = f"lying, gravity sideways ({side})"
    else:
        held = "standing" if -z > across else "hanging" if z > across else "lying"
        tilt = degrees(acos(abs(z))) if held != "lying" else degrees(acos(across))
        words = f"{held}, tilted by {tilt:.3g} deg, gravity along ({x:.3g}, {y:.3g}, {z:.3g})"
    return words if abs(size / STANDARD_GRAVITY - 1) < _STRAIGHT else f"{words}, {size:.4g} m/s^2"
