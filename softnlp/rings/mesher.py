"""Triangles over a plane section: nodes on its outlines, nodes between them in balance, Delaunay's triangulation.

The way of P.-O. Persson and G. Strang, A Simple Mesh Generator in MATLAB, SIAM Review 46 (2004) 329, with the nodes of
the outlines held: bars that are shorter than the local size push their ends apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import cos, pi, sin
from typing import Any

import numpy as np
from scipy.spatial import Delaunay

from softnlp.rings.outline import Arc, Array, Line, PlaneSection, RingError

Indices = np.ndarray[Any, np.dtype[np.int64]]
SMALLEST_ANGLE = 12.0  # of a triangle [deg]
_MOVES = 60
_GROWTH = 0.4  # of edges with the distance from an outline


@dataclass(frozen=True)
class Mesh:
    """Triangles of six nodes: corners, then the middles of edges 01, 12, 20; edges on arcs are curved.

    Attributes
    ----------
    nodes
        (n, 2) places in the section as cast [m]; corners come first.
    triangles
        (m, 6) numbers of nodes.
    corners
        How many nodes are corners.
    sides
        By loop (mirror lines are -1 and -2), the numbers of the nodes on it.
    """

    nodes: Array
    triangles: Indices
    corners: int
    sides: dict[int, Indices]


def mesh(section: PlaneSection, layers: float = 2.0) -> Mesh:
    """Return a mesh of a section, the same each time.

    layers : edges across a gap between two outlines; the largest edges are half the body's radius over it.

    Raises
    ------
    RingError
        Where outlines cross or touch, or leave a sliver.
    """
    largest = 0.5 / layers * (section.outer.area / pi) ** 0.5
    near = section.images()

    def edge(points: Array) -> Array:
        """Return the size of edges: by the gap between the two nearest outlines, growing from what follows these."""
        apart = np.abs([loop.signed(points) for loop in near])
        grown = (np.array([loop.grain(points) for loop in near]) + _GROWTH * apart).min(axis=0)
        distance = np.sort(apart, axis=0)
        gap = distance[0] + distance[1] if len(near) > 1 else np.full(len(points), np.inf)
        gap = np.minimum(gap, layers * grown)
        return np.asarray(np.minimum(largest, np.maximum(gap, 1e-3 * largest) / layers))

    fixed, edges = _outlines(section, edge)
    inner = _balanced(section, edge, fixed, _seeds(section, edge, fixed))
    points = np.vstack([fixed, inner])
    triangles = _open_corners(_inside(section, points), {frozenset(pair) for pair in edges}, points)
    _check(points, triangles, edges)
    return _quadratic(points, triangles, edges)


def _outlines(section: PlaneSection, edge: Any) -> tuple[Array, dict[tuple[int, int], tuple[int, Arc | Line]]]:
    """Return the nodes on the outlines, and their edges with the number and the curve of the outline."""
    places: list[Array] = []
    known: dict[tuple[int, int], int] = {}
    grain = 1e-7 * section.outer.area**0.5
    edges: dict[tuple[int, int], tuple[int, Arc | Line]] = {}
    for loop, curves in section.curves():
        for curve in curves:
            share = np.linspace(0, 1, 241)
            density = curve.length / edge(curve.points(share))
            count = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2 / 240)])
            parts = max(int(np.ceil(count[-1] - 1e-6)), curve.least)
            at = np.interp(np.linspace(0, count[-1], parts + 1), count, share)
            numbers = []
            for point in curve.points(at):
                key = (round(point[0] / grain), round(point[1] / grain))
                if key not in known:
                    known[key] = len(places)
                    places.append(point)
                numbers.append(known[key])
            for pair in pairwise(numbers):
                edges[pair] = (loop, curve)
    return np.array(places), edges


def _seeds(section: PlaneSection, edge: Any, fixed: Array) -> Array:
    """Return places in the silicone, as dense as the size of edges asks for: of a quasi-random sequence."""
    low, high = fixed.min(axis=0), fixed.max(axis=0)
    finest = float(edge(fixed).min())
    count = int(np.prod(high - low) / (finest**2 * 0.5)) + 1
    k = np.arange(1, min(count, 400_000) + 1)[:, None]
    # The sequence of three dimensions with the largest root of x^4 = x + 1: two for the place, one for taking it.
    root = 1.2207440846057596
    sequence = (0.5 + k * root ** -np.arange(1.0, 4.0)) % 1.0
    points = low + sequence[:, :2] * (high - low)
    size = edge(points)
    wanted = 2 / 3**0.5 * (finest / size) ** 2 * np.prod(high - low) / (finest**2 * len(k))
    taken = (sequence[:, 2] < wanted) & (_within(section, points) < -0.35 * size)
    return np.asarray(points[taken])


def _within(section: PlaneSection, points: Array) -> Array:
    """Return the distance to the border of what is meshed, negative inside."""
    inside: Array = section.signed(points)
    if section.mirrors:
        high = pi / section.mirrors
        inside = np.max([inside, -points[:, 1], points[:, 1] * cos(high) - points[:, 0] * sin(high)], axis=0)
    return inside


def _balanced(section: PlaneSection, edge: Any, fixed: Array, inner: Array) -> Array:
    """Return the inner nodes after the bars between all have pushed them apart."""
    n = len(fixed)
    for move in range(_MOVES):
        points = np.vstack([fixed, inner])
        bars = _bars(_inside(section, points))
        along = points[bars[:, 1]] - points[bars[:, 0]]
        length = np.hypot(along[:, 0], along[:, 1])
        size = edge((points[bars[:, 0]] + points[bars[:, 1]]) / 2)
        wanted = 1.15 * size * ((length**2).sum() / (size**2).sum()) ** 0.5
        push = (np.maximum(wanted - length, 0) / length)[:, None] * along
        force = np.zeros_like(points)
        np.add.at(force, bars[:, 0], -push)
        np.add.at(force, bars[:, 1], push)
        inner = inner + 0.2 * force[n:]
        if len(inner):
            size = edge(inner)
            keep = _within(section, inner) < -0.3 * size
            if move % 10 == 9 and move < _MOVES - 15:  # crowded nodes go, one of each pair
                close = bars[(length < 0.55 * wanted) & (bars.min(axis=1) >= n)]
                keep[close.max(axis=1) - n] = False
            inner = inner[keep]
    return inner


def _inside(section: PlaneSection, points: Array) -> Indices:
    """Return Delaunay's triangles whose middle is in the silicone, counter-clockwise."""
    triangles = Delaunay(points).simplices.astype(np.int64)
    triangles = triangles[_within(section, points[triangles].mean(axis=1)) < 0]
    twice = _twice_area(points, triangles)
    triangles[twice < 0] = triangles[twice < 0][:, [0, 2, 1]]
    corners = points[triangles]
    longest = ((corners - np.roll(corners, 1, axis=1)) ** 2).sum(axis=2).max(axis=1)
    return np.asarray(triangles[np.abs(twice) > 1e-6 * longest])


def _twice_area(points: Array, triangles: Indices) -> Array:
    a, b = (points[triangles[:, k]] - points[triangles[:, 0]] for k in (1, 2))
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _bars(triangles: Indices) -> Indices:
    pairs = np.sort(np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    return np.unique(pairs, axis=0)


def _open_corners(triangles: Indices, border: set[frozenset[int]], points: Array) -> Indices:
    """Return the triangles with those that have two edges on the border split: both held, they would lock."""
    rows = [tuple(int(k) for k in row) for row in triangles]
    owners: dict[frozenset[int], list[int]] = {}
    for index, row in enumerate(rows):
        for turn in range(3):
            owners.setdefault(frozenset((row[turn], row[turn - 1])), []).append(index)
    changed: set[int] = set()  # their edges are others now
    for index, row in enumerate(rows):
        for a, b, c in (row, (*row[1:], row[0]), (row[2], *row[:2])):
            sides = frozenset((a, b)), frozenset((b, c))
            pair = owners[frozenset((c, a))] if index not in changed else []
            if border.issuperset(sides) and len(pair) == 2 and not changed.intersection(pair):
                other = next(k for k in pair if k != index)
                d = next(k for k in rows[other] if k not in (a, c))
                if (_twice_area(points, np.array([(a, b, d), (b, c, d)])) > 0).all():
                    rows[index], rows[other] = (a, b, d), (b, c, d)
                    changed.update(pair)
    return np.array(rows, np.int64)


def _check(points: Array, triangles: Indices, edges: dict[tuple[int, int], Any]) -> None:
    """Raise `RingError` where the triangles do not fill the outlines, or one is a sliver."""
    pairs = np.sort(np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    unique, count = np.unique(pairs, axis=0, return_counts=True)
    border = {tuple(sorted(pair)) for pair in edges}
    if {(int(a), int(b)) for a, b in unique[count == 1]} != border:
        raise RingError("the outlines of the section cross, touch or leave too little silicone between them to mesh")
    a, b, c = (points[triangles[:, k]] for k in range(3))
    sides = np.array([((p - q) ** 2).sum(axis=1) for p, q in ((b, c), (c, a), (a, b))])
    cosines = (sides.sum(axis=0) - 2 * sides) / (2 * np.sqrt(sides.prod(axis=0) / sides))
    worst = float(np.degrees(np.arccos(np.clip(cosines.max(), -1, 1))))
    if worst < SMALLEST_ANGLE:
        raise RingError(f"the mesh of the section has an angle of {worst:.1f} degrees; move outlines that nearly touch")


def _quadratic(points: Array, triangles: Indices, edges: dict[tuple[int, int], tuple[int, Arc | Line]]) -> Mesh:
    """Return the mesh with a node in the middle of each edge, on the arc where the edge is part of one."""
    bars = _bars(triangles)
    middles = points[bars].mean(axis=1)
    number = {(int(a), int(b)): k for k, (a, b) in enumerate(bars)}
    sides: dict[int, set[int]] = {}
    for (a, b), (loop, curve) in edges.items():
        middle = number[min(a, b), max(a, b)]
        if isinstance(curve, Arc):
            centre = np.array([curve.x, curve.y])
            out = middles[middle] - centre
            middles[middle] = centre + curve.radius * out / np.hypot(*out)
        sides.setdefault(loop, set()).update((a, b, len(points) + middle))
    pairs = [np.sort(triangles[:, pair], axis=1) for pair in ([0, 1], [1, 2], [2, 0])]
    mids = np.column_stack([[number[int(a), int(b)] for a, b in pair] for pair in pairs]) + len(points)
    return Mesh(
        np.vstack([points, middles]),
        np.column_stack([triangles, mids]).astype(np.int64),
        len(points),
        {loop: np.array(sorted(nodes), np.int64) for loop, nodes in sides.items()},
    )
