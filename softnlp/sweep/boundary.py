"""What a cloud of tip positions covers: convex hull, concave boundary (alpha shape), and how far it reaches.

The concave boundary is made of the Delaunay simplices whose circumscribed sphere is not larger than a radius
(Edelsbrunner and Mücke, ACM Trans. Graph. 13, 1994): hollows and gaps wider than that radius stay outside. Without a
radius it is 2.5 times the smallest that takes in 95 % of the points: at the smallest itself a cloud of random points is
riddled with holes, and the last few points, at tips and corners, would ask for spheres that fill every hollow. Clouds
that fill no volume are named, not refused.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from softnlp.base.arrays import Array, Index
from softnlp.base.errors import InputError

FLATNESS = 1e-6  # of the largest extent: a cloud that is thinner is flat
MOST_POINTS = 20_000  # of a Delaunay triangulation; more are thinned to one a cell
TAKEN_IN, WIDENING = 0.95, 2.5  # of the points by the smallest radius, and the radius over that one
_SLIVER = 1e-12  # volume of a flat simplex, of its longest edge's power
_CIRCLE = 1e-6  # corners that are so near to a common circle lie on it


class Extent(StrEnum):
    """What a cloud of points spans."""

    SOLID = "solid"
    SURFACE = "surface"
    FLAT = "flat"
    CURVE = "curve"
    LINE = "line"
    POINT = "point"
    EMPTY = "empty"

    @property
    def meaning(self) -> str:
        """One phrase for a table or a figure."""
        return _MEANINGS[self]


_MEANINGS = {
    Extent.SOLID: "fills a volume",
    Extent.SURFACE: "a curved surface: it encloses no volume of its own",
    Extent.FLAT: "lies in a plane: area only",
    Extent.CURVE: "a curve: neither area nor volume",
    Extent.LINE: "lies on a straight line: length only",
    Extent.POINT: "a single place",
    Extent.EMPTY: "no point at all",
}


@dataclass(frozen=True, eq=False)
class Boundary:
    """A body around points, by its facets: triangles of a solid, edges of a flat cloud.

    extent : what the points span. volume : [m^3], 0 for a flat cloud or less. area : of the surface, or that which a
    flat cloud covers [m^2], else 0. length : around a flat cloud, or of a line [m], else 0.
    vertices : (V, 3) [m]. facets : (F, 3) or (F, 2) rows of `vertices`.
    radius : of the alpha shape [m], None for a convex hull and where there is none.
    points : how many points it was made of, those left out by thinning not counted. outside : how many of them an alpha
    shape leaves out.
    """

    extent: Extent
    volume: float
    area: float
    length: float
    vertices: Array
    facets: Index
    radius: float | None
    points: int
    outside: int = 0


@dataclass(frozen=True)
class Reach:
    """How far points lie from the base at the origin and from its axis z [m]; NaN without points."""

    nearest_to_axis: float
    farthest_from_axis: float
    nearest_to_base: float
    farthest_from_base: float
    lowest: float
    highest: float


def reach(points: Array) -> Reach:
    """Return how far points (M, 3) [m] lie from the base and from the base axis."""
    if not len(points):
        return Reach(*[float("nan")] * 6)
    radial, distance = np.hypot(points[:, 0], points[:, 1]), np.linalg.norm(points, axis=1)
    ranges = [f(v) for v in (radial, distance, points[:, 2]) for f in (np.min, np.max)]
    return Reach(*map(float, ranges))


def convex_hull(points: Array, parameters: int = 3) -> Boundary:
    """Return the convex hull of points (M, 3) [m].

    parameters : how many independent numbers (pressures, for instance) the points are a function of; with fewer than 3
    they lie on a surface or a curve, which is then the extent that is named; the hull is measured all the same.
    """
    from scipy.spatial import ConvexHull

    cloud = _flattened(points)
    extent = _named(cloud.extent, parameters)
    if cloud.extent not in (Extent.SOLID, Extent.FLAT):
        return _without_body(cloud, extent)
    hull = ConvexHull(cloud.local)
    used, facets = np.unique(hull.simplices, return_inverse=True)
    facets = facets.reshape(hull.simplices.shape).astype(np.int64)
    # in a plane scipy calls the area volume and the outline area
    content, skin = float(hull.volume), float(hull.area)
    measures = (content, skin, 0.0) if cloud.extent is Extent.SOLID else (0.0, content, skin)
    return Boundary(extent, *measures, cloud.points[used], facets, None, len(points))


def alpha_shape(
    points: Array, radius: float | None = None, *, parameters: int = 3, most: int | None = MOST_POINTS
) -> Boundary:
    """Return the concave boundary of points (M, 3) [m].

    Parameters
    ----------
    points : the cloud; of more than `most`, one a cell of a grid is taken (`thinned`).
    radius : largest radius of a circumscribed sphere [m]; by default 2.5 times the smallest that takes in 95 % of
        the points. Those that it leaves out are counted; one that leaves out all of them is an `InputError`.
    parameters : as in `convex_hull`; a surface or a curve in space has no concave boundary, and gets none.
    """
    cloud = _flattened(points)
    extent = _named(cloud.extent, parameters)
    dimension = cloud.local.shape[1]
    if dimension < 2 or extent is Extent.CURVE or (extent is Extent.SURFACE and dimension == 3):
        return _without_body(cloud, extent)
    chosen = np.arange(len(points)) if most is None else thinned(cloud.local, most)
    local, scale = cloud.local[chosen], cloud.scale
    made = _delaunay(local / scale)
    limit = WIDENING * _usual_radius(made, len(local)) if radius is None else radius / scale
    kept = made.radii <= limit
    if not kept.any():
        least = float(made.radii.min()) * scale
        raise InputError(f"expected a radius of at least {least:.3g} m, which takes in part of the cloud", key="radius")
    facets = _outside_facets(made, kept)
    used, numbered = np.unique(facets, return_inverse=True)
    inside = float(np.abs(_contents(local, made.simplices[kept])).sum())
    skin = _facet_sizes(local, facets)
    measures = (inside, skin, 0.0) if dimension == 3 else (0.0, inside, skin)
    return Boundary(
        extent,
        *measures,
        cloud.points[chosen][used],
        numbered.reshape(facets.shape).astype(np.int64),
        limit * scale,
        len(local),
        _outside(made.simplices[kept], local),
    )


def thinned(points: Array, most: int) -> Index:
    """Return which points (M, d) to keep, at most `most`: one in each cell of a cubic grid, the first of them.

    All of them where there are no more than that. The outline stays within a cell of where it was.
    """
    if len(points) <= most:
        return np.arange(len(points), dtype=np.int64)
    low, span = points.min(axis=0), float(np.ptp(points, axis=0).max())
    if span == 0:
        return np.zeros(1, np.int64)

    def first_of_cells(across: int) -> Index:
        cell = np.minimum(((points - low) * (across / span)).astype(np.int64), across - 1)
        key = np.zeros(len(points), np.int64)
        for column in cell.T:
            key = key * across + column
        return np.sort(np.unique(key, return_index=True)[1])

    few, many, best = 1, 4096, np.zeros(1, np.int64)
    while many - few > max(1, few // 12):  # the most cells across that keep no more than asked for
        middle = int((few * many) ** 0.5) if many > 2 * few + 1 else (few + many) // 2
        found = first_of_cells(max(middle, few + 1))
        if len(found) <= most:
            few, best = max(middle, few + 1), found
        else:
            many = max(middle, few + 1)
    return best


@dataclass(frozen=True, eq=False)
class _Cloud:
    """Points in the fewest coordinates that hold them: local (M, d), d = 0 to 3. scale : largest extent."""

    points: Array
    local: Array
    scale: float
    extent: Extent


def _flattened(points: Array) -> _Cloud:
    """Turn a cloud into the plane or the line that it lies in."""
    P = np.asarray(points, dtype=float).reshape(-1, 3)
    if not len(P):
        return _Cloud(P, np.zeros((0, 0)), 0.0, Extent.EMPTY)
    centred = P - P.mean(axis=0)
    axes = np.linalg.eigh(centred.T @ centred)[1][:, ::-1]
    local = centred @ axes
    spans = np.ptp(local, axis=0)
    scale = float(spans.max())
    size = float(np.abs(P).max())
    if scale <= FLATNESS * size:
        return _Cloud(P, local[:, :0], scale, Extent.POINT)
    wide = spans > FLATNESS * scale
    extent = {3: Extent.SOLID, 2: Extent.FLAT, 1: Extent.LINE}[int(wide.sum())]
    return _Cloud(P, local[:, wide], scale, extent)


def _named(extent: Extent, parameters: int) -> Extent:
    """Return what a cloud is that is a function of so many numbers."""
    if extent in (Extent.SOLID, Extent.FLAT) and parameters <= 1:
        return Extent.CURVE
    if extent is Extent.SOLID and parameters == 2:
        return Extent.SURFACE
    return extent


def _without_body(cloud: _Cloud, extent: Extent) -> Boundary:
    length = cloud.scale if cloud.extent is Extent.LINE else 0.0
    nothing = np.zeros((0, 2), np.int64)
    return Boundary(extent, 0.0, 0.0, length, cloud.points[:0], nothing, None, len(cloud.points))


@dataclass(frozen=True, eq=False)
class _Triangulation:
    """Delaunay simplices (S, d + 1), whose is across each corner (S, d + 1), -1 for none, circumscribed radii (S,)."""

    simplices: Index
    across: Index
    radii: Array


def _delaunay(points: Array) -> _Triangulation:
    """Triangulate points (M, d).

    Corners of a grid lie on common spheres, and some simplices between them are flat: their radius is then that of the
    circle through their corners, and infinite where there is none.
    """
    from scipy.spatial import Delaunay

    found = Delaunay(points)
    simplices = found.simplices.astype(np.int64)
    corners = points[simplices]
    edges = corners[:, 1:] - corners[:, :1]
    squares = np.einsum("sij,sij->si", edges, edges)
    flat = np.abs(np.linalg.det(edges)) <= _SLIVER * squares.max(axis=1) ** (points.shape[1] / 2)
    # the centre is at equal distance from all corners: 2 edges . centre = edges . edges
    centres = np.empty((len(simplices), points.shape[1]))
    centres[~flat] = np.linalg.solve(2 * edges[~flat], squares[~flat][..., None])[..., 0]
    centres[flat] = np.einsum("sij,sj->si", np.linalg.pinv(2 * edges[flat], rcond=_CIRCLE), squares[flat])
    radii = np.linalg.norm(centres, axis=1)
    missed = np.abs(2 * np.einsum("sij,sj->si", edges[flat], centres[flat]) - squares[flat]).max(axis=1, initial=0.0)
    radii[flat] = np.where(missed <= _CIRCLE * squares[flat].max(axis=1, initial=0.0), radii[flat], np.inf)
    return _Triangulation(simplices, found.neighbors.astype(np.int64), radii)


def _usual_radius(made: _Triangulation, points: int) -> float:
    """Return the radius at which all but a few points are a corner of a simplex that is kept."""
    finite = np.isfinite(made.radii)
    least = np.full(points, np.inf)
    for column in made.simplices[finite].T:
        np.minimum.at(least, column, made.radii[finite])
    # a point that is in no simplex, a duplicate for instance, has none
    return float(np.quantile(least[np.isfinite(least)], TAKEN_IN))


def _outside(simplices: Index, points: Array) -> int:
    """Return how many places have a point but no simplex; a point given twice is one place."""
    inside = np.unique(simplices)
    return len(np.unique(points, axis=0)) - len(inside)


def _outside_facets(made: _Triangulation, kept: NDArray[np.bool_]) -> Index:
    """Return the facets with a kept simplex on one side alone (F, d)."""
    owner, opposite = np.nonzero(kept[:, None] & ((made.across < 0) | ~kept[made.across]))
    corners = made.simplices[owner]
    others = np.arange(corners.shape[1])[None, :] != opposite[:, None]
    return np.asarray(corners[others].reshape(len(owner), -1))


def _contents(points: Array, simplices: Index) -> Array:
    """Return the signed volume of tetrahedra, or area of triangles in a plane."""
    edges = points[simplices[:, 1:]] - points[simplices[:, :1]]
    return np.asarray(np.linalg.det(edges) / (6.0 if edges.shape[1] == 3 else 2.0))


def _facet_sizes(points: Array, facets: Index) -> float:
    """Return the area of all triangles, or the length of all edges."""
    edges = points[facets[:, 1:]] - points[facets[:, :1]]
    if facets.shape[1] == 2:
        return float(np.linalg.norm(edges[:, 0], axis=1).sum())
    return float(np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).sum() / 2)
