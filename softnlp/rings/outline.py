"""The plane section that threads hold: outlines of body, rings and free holes, and the part of it that is meshed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import atan2, cos, hypot, pi, sin
from typing import Any

import numpy as np

from softnlp.base.errors import InputError
from softnlp.model.robot import Robot

Array = np.ndarray[Any, np.dtype[np.float64]]


class RingError(InputError):
    """The section cannot be meshed or its equilibrium not be found; the text says where it ends and what to change."""


@dataclass(frozen=True)
class Arc:
    """Part of a circle from one angle to another; angles [rad] may run backwards."""

    x: float
    y: float
    radius: float
    start: float = 0.0
    end: float = 2 * pi

    def points(self, share: Array) -> Array:
        """Return (n, 2) points at these shares of the length."""
        angle = self.start + share * (self.end - self.start)
        return np.array([self.x, self.y]) + self.radius * np.column_stack([np.cos(angle), np.sin(angle)])

    @property
    def length(self) -> float:
        """Of the curve [m]."""
        return self.radius * abs(self.end - self.start)

    @property
    def least(self) -> int:
        """Edges below which the curve is not well followed: one for 30 degrees."""
        return max(1, round(abs(self.end - self.start) / (pi / 6)))


@dataclass(frozen=True)
class Line:
    """A straight line between two points [m]."""

    x0: float
    y0: float
    x1: float
    y1: float

    def points(self, share: Array) -> Array:
        """Return (n, 2) points at these shares of the length."""
        start, end = np.array([self.x0, self.y0]), np.array([self.x1, self.y1])
        return start + np.outer(share, end - start)

    @property
    def length(self) -> float:
        """Of the line [m]."""
        return hypot(self.x1 - self.x0, self.y1 - self.y0)

    @property
    def least(self) -> int:
        """One edge."""
        return 1


@dataclass(frozen=True)
class Circle:
    """A round outline [m]."""

    x: float
    y: float
    radius: float

    def signed(self, points: Array) -> Array:
        """Return the distances of (n, 2) points, negative inside."""
        return np.asarray(np.hypot(points[:, 0] - self.x, points[:, 1] - self.y) - self.radius)

    def grain(self, points: Array) -> Array:
        """Return the longest edge that follows the outline where it is nearest to (n, 2) points [m]."""
        return np.full(len(points), pi / 6 * self.radius)

    @property
    def area(self) -> float:
        """Enclosed [m^2]."""
        return pi * self.radius**2

    @property
    def centre(self) -> tuple[float, float]:
        """Of the circle [m]."""
        return self.x, self.y

    def curves(self) -> list[Arc | Line]:
        """Return the whole circle."""
        return [Arc(self.x, self.y, self.radius)]


@dataclass(frozen=True)
class Polygon:
    """An outline of straight lines, once around; (n, 2) corners [m]. Curves become many corners."""

    corners: tuple[tuple[float, float], ...]

    def signed(self, points: Array) -> Array:
        """Return the distances of (n, 2) points, negative inside."""
        a = np.array(self.corners)
        b = np.roll(a, -1, axis=0)
        along = b - a
        distance = self._distances(points).min(axis=1)
        above = a[:, 1] > points[:, 1:2]
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = a[:, 0] + (points[:, 1:2] - a[:, 1]) * along[:, 0] / along[:, 1]
        crosses = (above != (b[:, 1] > points[:, 1:2])) & (points[:, :1] < crossing)
        return np.asarray(np.where(crosses.sum(axis=1) % 2, -distance, distance))

    def grain(self, points: Array) -> Array:
        """Return the length of the side that is nearest to (n, 2) points [m]."""
        a = np.array(self.corners)
        return np.asarray(np.hypot(*(np.roll(a, -1, axis=0) - a).T)[self._distances(points).argmin(axis=1)])

    def _distances(self, points: Array) -> Array:
        """Return (n, sides) distances of points to each side."""
        a = np.array(self.corners)
        along, to = np.roll(a, -1, axis=0) - a, points[:, None, :] - a
        share = np.clip((to * along).sum(axis=2) / (along**2).sum(axis=1), 0, 1)
        return np.asarray(np.hypot(*np.moveaxis(to - share[..., None] * along, 2, 0)))

    @property
    def _twice(self) -> Array:
        a = np.array(self.corners)
        b = np.roll(a, -1, axis=0)
        return np.asarray(a[:, 0] * b[:, 1] - b[:, 0] * a[:, 1])

    @property
    def area(self) -> float:
        """Enclosed [m^2]."""
        return abs(float(self._twice.sum())) / 2

    @property
    def centre(self) -> tuple[float, float]:
        """Centroid of the enclosed area [m]."""
        a = np.array(self.corners)
        x, y = ((a + np.roll(a, -1, axis=0)) * self._twice[:, None]).sum(axis=0) / (3 * self._twice.sum())
        return float(x), float(y)

    def curves(self) -> list[Arc | Line]:
        """Return its lines."""
        return [Line(*a, *b) for a, b in zip(self.corners, (*self.corners[1:], self.corners[0]), strict=True)]


Outline = Circle | Polygon


@dataclass(frozen=True)
class PlaneSection:
    """A silicone section as cast, seen along its axis.

    Attributes
    ----------
    outer
        Outline of the body.
    rings
        Outlines that a thread holds: each keeps its form, and moves and turns in the plane as a rigid body.
    holes
        Outlines without a thread and without a pressure, such as a lumen.
    outer_ring
        Whether the thread is wound round the whole body: the outer outline is a ring too.
    mirrors
        Of a section of circles, how many mirror lines through (0, 0) it has, one of them the x axis: the sector from
        angle 0 to pi / mirrors is solved. 0: the whole section is.
    """

    outer: Outline
    rings: tuple[Outline, ...] = ()
    holes: tuple[Outline, ...] = ()
    outer_ring: bool = False
    mirrors: int = 0

    @property
    def loops(self) -> tuple[Outline, ...]:
        """Outer outline, rings, holes."""
        return self.outer, *self.rings, *self.holes

    @property
    def area(self) -> float:
        """Of the silicone outside the rings, all sectors together [m^2]."""
        return self.outer.area - sum(loop.area for loop in (*self.rings, *self.holes))

    def signed(self, points: Array) -> Array:
        """Return the distances of (n, 2) points to the body's surface, negative in the silicone."""
        inside = [-loop.signed(points) for loop in self.loops[1:]]
        return np.asarray(np.max([self.outer.signed(points), *inside], axis=0))

    def curves(self) -> Iterator[tuple[int, list[Arc | Line]]]:
        """Yield (number of the loop, its curves) of what is meshed; mirror lines are -1 (angle 0) and -2.

        Raises
        ------
        RingError
            For a sector of other than circles, or whose lumen does not hold its corner.
        """
        if not self.mirrors:
            yield from ((k, loop.curves()) for k, loop in enumerate(self.loops))
            return
        high = pi / self.mirrors
        cut: tuple[list[tuple[float, float]], ...] = ([], [])  # of both lines, what circles take: from, to
        for k, loop in enumerate(self.loops):
            if not isinstance(loop, Circle):
                raise RingError("a sector needs circles: set mirrors = 0")
            distance, angle = hypot(loop.x, loop.y), atan2(loop.y, loop.x)
            middle = distance < 1e-9 * loop.radius
            near = 1e-9 * self.outer.radius if isinstance(self.outer, Circle) else 0.0
            turns = (angle, angle - high)
            on = [middle or (cos(turn) > 0 and abs(sin(turn)) * distance < near) for turn in turns]
            if middle:
                yield k, [Arc(0.0, 0.0, loop.radius, 0.0, high)]
            elif -1e-9 < angle < high + 1e-9:
                if not any(on):
                    yield k, [Arc(loop.x, loop.y, loop.radius)]
                elif on[0]:
                    yield k, [Arc(loop.x, loop.y, loop.radius, 0.0, pi)]
                else:
                    yield k, [Arc(loop.x, loop.y, loop.radius, high + pi, high + 2 * pi)]
            else:
                continue
            for side in (0, 1):
                if on[side]:
                    cut[side].append((distance - loop.radius, distance + loop.radius))
        for side, angle in ((0, 0.0), (1, high)):
            taken = sorted(cut[side])  # the outer circle first: it starts furthest behind the middle
            if len(taken) < 2 or taken[1][0] >= 0:
                raise RingError("a sector needs a lumen in its corner: set mirrors = 0")
            free = [(a[1], b[0]) for a, b in zip(taken[1:], [*taken[2:], (taken[0][1], 0.0)], strict=True)]
            x, y = cos(angle), sin(angle)
            yield -1 - side, [Line(a * x, a * y, b * x, b * y) for a, b in free]

    def images(self) -> list[Outline]:
        """Return the loops and, of a sector, the mirror images next to it: between them gaps are measured."""
        near = list(self.loops)
        if self.mirrors:
            high = pi / self.mirrors
            for loop in self.rings:
                x, y = loop.centre
                distance, angle = hypot(x, y), atan2(y, x)
                assert isinstance(loop, Circle)
                for turned in (-angle, 2 * high - angle)[: 1 if self.mirrors == 1 else 2]:
                    if abs(sin(turned - angle)) * distance > 1e-9:
                        near.append(Circle(distance * cos(turned), distance * sin(turned), loop.radius))
        return near


def of_robot(robot: Robot, mirrors: int | None = None) -> PlaneSection:
    """Return the section of a robot of numbers: rings of r_co around its chambers, a free lumen and surface.

    mirrors : as of `PlaneSection`; those of the layout, one for each set, where it is not given.

    Raises
    ------
    RingError
        Where rings overlap, or leave the silicone.
    """
    r_r, r_i, r_co = float(robot.outer_radius), float(robot.lumen_radius), float(robot.chamber_radius)
    centres = [(float(x), float(y)) for x, y in robot.chamber_centres()]
    mirrors = robot.chamber_sets if mirrors is None else mirrors
    if mirrors:  # set 1 is centred on the x axis, and the sector's other line lies between two sets
        centres = [(x, abs(y) if abs(y) > 1e-9 else 0.0) for x, y in centres if y > -1e-9]
        centres = [(x, y) for x, y in centres if atan2(y, x) < pi / mirrors + 1e-9]
    section = PlaneSection(
        Circle(0.0, 0.0, r_r),
        tuple(Circle(x, y, r_co) for x, y in centres),
        (Circle(0.0, 0.0, r_i),),
        mirrors=mirrors,
    )
    check_gaps(section)
    return section


def check_gaps(section: PlaneSection) -> None:
    """Raise `RingError` where outlines of circles touch or cross; polygons are seen by the mesher."""
    inside = [loop for loop in section.images()[1:] if isinstance(loop, Circle)]
    outer = section.outer
    for k, a in enumerate(inside):
        gaps = [hypot(a.x - b.x, a.y - b.y) - a.radius - b.radius for b in inside[:k]]
        if isinstance(outer, Circle):
            gaps.append(outer.radius - hypot(a.x - outer.x, a.y - outer.y) - a.radius)
        if gaps and min(gaps) <= 1e-3 * a.radius:
            raise RingError(
                f"no silicone is left beside the ring at ({a.x * 1e3:.3g}, {a.y * 1e3:.3g}) mm: its narrowest gap is "
                f"{min(gaps) * 1e3:.3g} mm; take smaller chambers or move them apart"
            )
