"""Closed outlines in the plane of a section: circles and polygons, with their curves, areas, gaps and walls."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, ceil, cos, hypot, pi, sin
from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[np.float64]]

STEP = pi / 180
"""Angle of an arc that becomes one side of a polygon [rad]."""
_SMOOTH = pi / 18  # corners that turn by less stay corners beside a wall
_CORNER = pi / 2  # of a rounded corner, one step at most
_LEAST = 1e-12  # of a length that divides [m]
_CROSSED = 1e-6  # by what outlines overlap at least whose sides cross [m]
_SAMPLES = 8  # places along a side at which it is looked for an overlap


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
    def turning(self) -> float:
        """Twice the area, negative where the corners go clockwise [m^2]."""
        return float(self._twice.sum())

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


def arc_corners(radius: float, start: float, end: float, step: float = STEP) -> list[tuple[float, float]]:
    """Return corners along an arc about (0, 0), so far out that the area of its sector stays; angles [rad]."""
    parts = max(1, ceil(abs(end - start) / step - 1e-9))
    turn = (end - start) / parts
    out = radius * (abs(turn) / sin(abs(turn))) ** 0.5
    return [(out * cos(start + k * turn), out * sin(start + k * turn)) for k in range(parts + 1)]


def turned(corners: list[tuple[float, float]], angle: float) -> Polygon:
    """Return a polygon of corners that are turned about (0, 0)."""
    c, s = cos(angle), sin(angle)
    return Polygon(tuple((c * x - s * y, s * x + c * y) for x, y in corners))


def is_simple(polygon: Polygon) -> bool:
    """Whether no side of a polygon meets another one but at their common corner, and none is a point."""
    a = np.array(polygon.corners)
    n, b = len(a), np.roll(a, -1, axis=0)
    if n < 3 or np.hypot(*(b - a).T).min() < _LEAST or polygon.area < _LEAST**2:
        return False
    i, j = np.triu_indices(n, 2)
    i, j = i[(j - i) < n - 1], j[(j - i) < n - 1]  # neighbours share a corner
    return not np.any(_meet(a[i], b[i], a[j], b[j]))


def not_an_outline(polygon: Polygon) -> str:
    """Return what is wrong with a polygon's corners, "" where nothing is."""
    a = np.array(polygon.corners)
    for k in np.flatnonzero(np.hypot(*(np.roll(a, -1, axis=0) - a).T) < _LEAST)[:1]:
        return f"expected each corner once, got corner {k + 1} again as the next one"
    return "" if is_simple(polygon) else "expected an outline that does not cross itself"


def widened(outline: Outline, wall: float, step: float = STEP) -> Outline:
    """Return an outline with a wall around it, whose outer corners are round. wall : [m]; negative is inside a circle.

    The answer for a polygon may cross itself where the wall is thicker than a recess is wide: see `is_simple`.
    """
    if isinstance(outline, Circle):
        return Circle(outline.x, outline.y, outline.radius + wall)
    if wall == 0:
        return outline
    a = np.array(outline.corners)
    if outline.turning < 0:
        a = a[::-1]
    along = np.roll(a, -1, axis=0) - a
    along /= np.hypot(*along.T)[:, None]
    out = np.column_stack([along[:, 1], -along[:, 0]])  # of the side behind each corner
    corners = list[tuple[float, float]]()
    for k, corner in enumerate(a):
        before, behind = out[k - 1], out[k]
        angle = atan2(before[0] * behind[1] - before[1] * behind[0], float(before @ behind))
        if angle < _SMOOTH:  # also of a recess
            corners.append(tuple(corner + wall * (before + behind) / (1 + float(before @ behind))))
            continue
        first = atan2(before[1], before[0])
        parts = max(1, ceil(angle / min(step, _CORNER) - 1e-9))
        turns = first + angle * np.arange(parts + 1) / parts
        corners += [(float(corner[0] + wall * cos(t)), float(corner[1] + wall * sin(t))) for t in turns]
    return Polygon(tuple((float(x), float(y)) for x, y in corners))


def gap(a: Outline, b: Outline) -> float:
    """Return the distance between two areas; negative where they overlap [m]."""
    if isinstance(a, Circle) and isinstance(b, Circle):
        return hypot(a.x - b.x, a.y - b.y) - a.radius - b.radius
    if isinstance(a, Polygon) and isinstance(b, Polygon):
        inside = min(float(one.signed(_along(other)).min()) for one, other in ((a, b), (b, a)))
        return min(inside, -_CROSSED) if _crosses(a, b) else inside
    polygon, circle = (a, b) if isinstance(a, Polygon) else (b, a)
    assert isinstance(circle, Circle)
    return float(polygon.signed(np.array([circle.centre]))[0]) - circle.radius


def room(inner: Outline, outer: Outline) -> float:
    """Return how far an area is inside another one; negative where it leaves it [m]."""
    if isinstance(inner, Circle) and isinstance(outer, Circle):
        return outer.radius - hypot(inner.x - outer.x, inner.y - outer.y) - inner.radius
    if isinstance(inner, Circle):
        return -float(outer.signed(np.array([inner.centre]))[0]) - inner.radius
    out = float(outer.signed(np.array(inner.corners)).max())
    if isinstance(outer, Circle) or out > 0:
        return -out
    nearest = float(np.abs(inner.signed(np.array(outer.corners))).min())  # a recess of the outer one
    return -_CROSSED if _crosses(inner, outer) else min(-out, nearest)


def reach(outline: Outline) -> float:
    """Return how far an outline is from (0, 0) at most [m]."""
    if isinstance(outline, Circle):
        return hypot(outline.x, outline.y) + outline.radius
    return float(np.hypot(*np.array(outline.corners).T).max())


def corners_of(outline: Outline, sides: int = 96) -> Array:
    """Return (n, 2) corners, counter-clockwise, a circle's on it [m]."""
    if isinstance(outline, Circle):
        angle = 2 * pi * np.arange(sides) / sides
        return np.array(outline.centre) + outline.radius * np.column_stack([np.cos(angle), np.sin(angle)])
    corners = np.array(outline.corners)
    return corners if outline.turning > 0 else corners[::-1]


def _along(polygon: Polygon) -> Array:
    """Return places along the sides of a polygon, and its middle."""
    a = np.array(polygon.corners)
    share = np.arange(_SAMPLES)[:, None, None] / _SAMPLES
    return np.vstack([(a + share * (np.roll(a, -1, axis=0) - a)).reshape(-1, 2), [polygon.centre]])


def _crosses(a: Polygon, b: Polygon) -> bool:
    """Whether sides of two polygons cross, where to touch is not to cross."""
    starts = [np.array(of.corners) for of in (a, b)]
    ends = [np.roll(of, -1, axis=0) for of in starts]
    i, j = (k.ravel() for k in np.indices((len(starts[0]), len(starts[1]))))
    return bool(np.any(_meet(starts[0][i], ends[0][i], starts[1][j], ends[1][j], touching=False)))


def _meet(a: Array, b: Array, c: Array, d: Array, *, touching: bool = True) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Whether the lines from a to b and from c to d meet, (n, 2) each."""

    def side(p: Array, q: Array, r: Array) -> Array:
        return np.sign((q[:, 0] - p[:, 0]) * (r[:, 1] - p[:, 1]) - (q[:, 1] - p[:, 1]) * (r[:, 0] - p[:, 0]))

    boxes = np.all((np.maximum(a, b) >= np.minimum(c, d)) & (np.maximum(c, d) >= np.minimum(a, b)), axis=1)
    both = side(a, b, c) * side(a, b, d), side(c, d, a) * side(c, d, b)
    return np.asarray(boxes & ((both[0] <= 0) & (both[1] <= 0) if touching else (both[0] < 0) & (both[1] < 0)))
