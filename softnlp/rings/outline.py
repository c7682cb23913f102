"""The plane section that threads hold: outlines of body, rings and free holes, and the part of it that is meshed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import atan2, cos, hypot, pi, sin

import numpy as np

from softnlp.base.errors import InputError
from softnlp.model.plane import Arc as Arc
from softnlp.model.plane import Array as Array
from softnlp.model.plane import Circle as Circle
from softnlp.model.plane import Line as Line
from softnlp.model.plane import Outline
from softnlp.model.plane import Polygon as Polygon
from softnlp.model.robot import Robot


class RingError(InputError):
    """The section cannot be meshed or its equilibrium not be found; the text says where it ends and what to change."""


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
