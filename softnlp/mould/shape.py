"""The body that is to be cast: its radii and holes along z in millimetres, and which way up it is cast.

Cores and the lumen rod are drawn upwards, so a body whose holes narrow towards the tip is cast tip down.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import atan2, cos, hypot, pi, sin
from typing import Any

import numpy as np

from softnlp.base.arrays import Array
from softnlp.base.errors import InputError
from softnlp.base.units import MILLIMETRE
from softnlp.model.body import Segment
from softnlp.model.outlined import require_round_layout
from softnlp.model.robot import Robot
from softnlp.model.segments import SegmentedRobot, sections_of, segments_of

_SAME = 1e-6  # lengths and angles closer than this are equal [mm, rad]


@dataclass(frozen=True, eq=False)
class Hole:
    """A reinforced chamber, or the line of a later segment.

    angle : of its centre from +x [rad]. circle, core, bore : (k,) distance of its centre from the axis, radius of the
    thread and of the finished bore at the heights of the shape [mm]. chamber : counted from 1 through the segment.
    """

    angle: float
    circle: Array
    core: Array
    bore: Array
    chamber: int

    @property
    def alike(self) -> tuple[float, ...]:
        """What holes share that one core fits."""
        return tuple(np.round(np.concatenate([self.circle, self.core, self.bore]), 6))

    @property
    def degrees(self) -> float:
        """Its angle [deg]."""
        return float(np.degrees(self.angle))


@dataclass(frozen=True, eq=False)
class Shape:
    """A segment as it is cast, standing on z = 0.

    z : (k,) heights between which it is linear. outer, lumen : (k,) radii [mm]. flipped : whether it is cast tip down,
    turned about x.
    """

    z: Array
    outer: Array
    lumen: Array
    holes: tuple[Hole, ...]
    flipped: bool = False

    @property
    def length(self) -> float:
        """[mm]."""
        return float(self.z[-1])

    def volume(self, kind: str = "bore") -> float:
        """Return the exact volume [mm^3] with holes of the bore or of the core."""
        total = _cone(self.z, self.outer) - _cone(self.z, self.lumen)
        return total - sum(_cone(self.z, hole.bore if kind == "bore" else hole.core) for hole in self.holes)

    def liner(self, hole: Hole) -> float:
        """Return the exact volume between thread and bore of a chamber [mm^3]."""
        return _cone(self.z, hole.core) - _cone(self.z, hole.bore)

    def gaps(self) -> list[float]:
        """Return the angles [rad] in the middle between neighbouring holes, the widest gap first."""
        angles = sorted(hole.angle % (2 * pi) for hole in self.holes)
        wide = [(b - a, (a + b) / 2) for a, b in zip(angles, [*angles[1:], angles[0] + 2 * pi], strict=True)]
        return [middle for _, middle in sorted(wide, key=lambda pair: (-round(pair[0], 6), pair[1]))]


def _cone(z: Array, r: Array) -> float:
    """Return the volume between circles: pi h (a^2 + a b + b^2) / 3 each [mm^3]."""
    a, b = r[:-1], r[1:]
    return float(pi / 3 * np.sum(np.diff(z) * (a * a + a * b + b * b)))


def shapes_of(robot: Robot, shrinkage_percent: float = 0.0) -> list[Shape]:
    """Return each segment of a robot as it is cast, larger by what the silicone shrinks.

    Raises
    ------
    InputError
        Where a core could not be drawn: a chamber that is bent, or holes that narrow both ways.
    """
    scale = 1 / (MILLIMETRE * (1 - shrinkage_percent / 100))
    for own, _ in segments_of(robot):
        require_round_layout(own, "softnlp mould")
    if not isinstance(robot, SegmentedRobot):
        return [_shape([(0.0, robot)], robot, (), scale)]
    return [_segment(robot.segments, k, scale) for k in range(len(robot.segments))]


def _segment(segments: tuple[Segment, ...], k: int, scale: float) -> Shape:
    """Return one of several segments; later ones' bonded lines pass through it."""
    own, turn, lines = segments[k], 0.0, list[tuple[Robot, float]]()
    for later in segments[k + 1 :] if own.lines == "bonded" else ():
        turn += later.turn
        lines.append((later.robot, turn))
    try:
        return _shape(list(sections_of(own)), own.robot, lines, scale)
    except InputError as error:
        where = f"segment {k + 1}: " if len(segments) > 1 else ""
        raise InputError(f"{where}{error.message}", table=error.table, key=error.key) from None


def _shape(sections: list[tuple[float, Robot]], robot: Robot, lines: Any, scale: float) -> Shape:
    s = np.array([at for at, _ in sections])
    if len(s) == 1:
        s, sections = np.array([0.0, 1.0]), [*sections, *sections]

    def table(name: str) -> Array:
        return scale * np.array([float(getattr(one, name)) for _, one in sections])

    angles = np.array([[float(theta) for theta in one.chamber_angles()] for _, one in sections])
    if np.ptp(angles, axis=0).max() > _SAME:
        raise InputError("chamber_angle_deg varies along s: twisted cores cannot be drawn", table="mould")
    circle = table("chamber_circle_radius")
    straight = np.interp(s, [0, 1], circle[[0, -1]])
    if np.abs(circle - straight).max() > _SAME:
        at = float(s[np.argmax(np.abs(circle - straight))])
        raise InputError(
            f"chamber_circle_diameter_mm bends at s = {at:g}: a core there could not be drawn", table="mould"
        )
    holes = [
        Hole(float(theta), circle, table("chamber_radius"), table("bore_radius"), n + 1)
        for n, theta in enumerate(angles[0])
    ]
    for line, turn in lines:
        for x, y in line.chamber_centres():
            rho, theta = hypot(float(x), float(y)) * scale, atan2(float(y), float(x)) + turn
            same = [np.full(len(s), scale * float(r)) for r in (line.chamber_radius, line.bore_radius)]
            holes.append(Hole(theta, np.full(len(s), rho), same[0], same[1], len(holes) + 1))
    made = Shape(scale * float(robot.length) * s, table("outer_radius"), table("lumen_radius"), tuple(holes))
    return _upright(made)


def one_way(r: Array) -> bool:
    """Whether radii grow only, or shrink only."""
    return bool(np.all(np.diff(r) >= -_SAME) or np.all(np.diff(r) <= _SAME))


def waist(hole: Hole) -> float:
    """Return by how much a core narrows upwards from a wider place below [mm]: what sides have to move in by."""
    return float(np.max(np.maximum.accumulate(hole.core) - hole.core))


def _upright(made: Shape) -> Shape:
    """Return a shape with no hole that narrows upwards."""
    cores = [hole.core for hole in made.holes if one_way(hole.core)]
    every = [made.lumen, *(hole.bore for hole in made.holes), *cores]
    ways = {bool(step > 0) for r in every for step in np.diff(r) if abs(step) > _SAME}
    if len(ways) > 1:
        raise InputError(
            "lumen and chambers narrow towards the base here and towards the tip there: cores could not be drawn",
            table="mould",
        )
    if ways != {False}:
        return made
    holes = tuple(
        replace(h, angle=-h.angle, circle=h.circle[::-1], core=h.core[::-1], bore=h.bore[::-1]) for h in made.holes
    )
    return Shape(made.z[-1] - made.z[::-1], made.outer[::-1], made.lumen[::-1], holes, flipped=True)


def distance(a: Hole, b: Hole, end: int, fall: float = 0.0) -> float:
    """Return the distance of two centres at an end, 0 or -1 [mm]; fall : nearer to the axis by it."""
    turn = a.angle - b.angle
    rho, other = float(a.circle[end]) - fall, float(b.circle[end]) - fall
    return hypot(rho - other * cos(turn), other * sin(turn))
