"""Closed solids by manifold3d: lofts of circles, prisms, helical sweeps; all in millimetres and in double precision."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.arrays import Array
from softnlp.figures.mesh.rings import circle

if TYPE_CHECKING:
    from manifold3d import CrossSection, Manifold

FINE, MIDDLE, COARSE, TURN = 192, 96, 48, 24
"""Sides of circles: of the body's surface, of cores and rods, of holes that form no silicone; of a turn of thread."""

Faces = NDArray[np.int64]


def library() -> Any:
    """Return manifold3d; `softnlp.figures.mesh.require` says what is missing where it is not installed."""
    return import_module("manifold3d")


def solid(vertices: Array, faces: Faces) -> Manifold:
    """Return the solid of a closed surface. vertices : (n, 3) [mm]. faces : (m, 3), seen from outside."""
    m = library()
    made: Manifold = m.Manifold(m.Mesh64(np.ascontiguousarray(vertices), np.ascontiguousarray(faces, dtype=np.uint64)))
    return made


def swept(rings: Array) -> Manifold:
    """Return the solid of rings of equally many corners, one after the other; rings : (k, n, 3) [mm], each convex."""
    k, n, _ = rings.shape
    ring, corner = np.meshgrid(np.arange(k - 1), np.arange(n), indexing="ij")
    a, b = ring * n + corner, ring * n + (corner + 1) % n
    fan = np.stack([np.zeros(n - 2, int), np.arange(1, n - 1), np.arange(2, n)], axis=1)
    sides = [np.stack([a, b, b + n], -1).reshape(-1, 3), np.stack([a, b + n, a + n], -1).reshape(-1, 3)]
    faces = np.concatenate([fan[:, ::-1], fan + (k - 1) * n, *sides])
    points = rings.reshape(-1, 3)
    x, y, z = (points[faces[:, j]] for j in range(3))
    inside_out = np.einsum("ij,ij->", x, np.cross(y, z)) < 0
    return solid(points, faces[:, ::-1] if inside_out else faces)


def loft(z: Sequence[float] | Array, radius: Sequence[float] | Array, x: Any = 0.0, sides: int = MIDDLE) -> Manifold:
    """Return circles at heights z with centres (x, 0), their corners on the circle; a step is two at one height."""
    height, r = np.asarray(z, float), np.asarray(radius, float)
    unit = circle(sides)
    rings = np.zeros((len(height), sides, 3))
    rings[..., :2] = r[:, None, None] * unit
    rings[..., 0] += np.broadcast_to(np.asarray(x, float), height.shape)[:, None]
    rings[..., 2] = height[:, None]
    return swept(rings)


def cylinder(radius: float, low: float, high: float, x: float = 0.0, y: float = 0.0, sides: int = COARSE) -> Manifold:
    """Return an upright cylinder."""
    return loft([low, high], [radius, radius], sides=sides).translate((x, y, 0.0))


def along_x(at: Sequence[float], radius: Sequence[float], z: float, sides: int = COARSE) -> Manifold:
    """Return circles around a line along x at a height, as a gate in a parting plane has them."""
    return loft(at, radius, sides=sides).rotate((0.0, 90.0, 0.0)).translate((0.0, 0.0, z))


def along_y(at: Sequence[float], radius: Sequence[float], x: float, z: float, sides: int = COARSE) -> Manifold:
    """Return circles around a line along y through (x, z), as screws through a parting plane have them."""
    return loft(at, radius, sides=sides).rotate((-90.0, 0.0, 0.0)).translate((x, 0.0, z))


def box(x: tuple[float, float], y: tuple[float, float], z: tuple[float, float]) -> Manifold:
    """Return a box by its ends along x, y and z."""
    m = library()
    size = (x[1] - x[0], y[1] - y[0], z[1] - z[0])
    made: Manifold = m.Manifold.cube(size).translate((x[0], y[0], z[0]))
    return made


def prism(section: CrossSection, low: float, high: float) -> Manifold:
    """Return a section from one height to another."""
    made: Manifold = section.extrude(high - low).translate((0.0, 0.0, low))
    return made


def hull(outlines: Iterable[Array]) -> CrossSection:
    """Return the convex hull of points."""
    made: CrossSection = library().CrossSection.hull_points(np.concatenate(list(outlines)))
    return made


def helix(
    profile: Array,
    ends: tuple[float, float],
    pitch: float,
    radius: Callable[[Array], Array],
    centre: Callable[[Array], Array],
    per_turn: int = TURN,
) -> Manifold:
    """Return a profile swept along a helix.

    profile : (m, 2) convex, from the helix outwards and along z [mm]. ends : heights where it begins and ends.
    radius, centre : of the helix at heights, centres along x.
    """
    turns = (ends[1] - ends[0]) / pitch
    count = max(2, int(np.ceil(turns * per_turn)) + 1)
    angle = 2 * np.pi * np.arange(count) / per_turn
    z = ends[0] + pitch * angle / (2 * np.pi)
    r = radius(z)[:, None] + profile[:, 0]
    rings = np.stack([r * np.cos(angle)[:, None], r * np.sin(angle)[:, None], z[:, None] + profile[:, 1]], axis=-1)
    rings[..., 0] += centre(z)[:, None]
    return swept(rings)


def union(solids: Iterable[Manifold]) -> Manifold:
    """Return several solids as one."""
    m = library()
    made: Manifold = m.Manifold.batch_boolean(list(solids), m.OpType.Add)
    return made


def without(whole: Manifold, taken: Iterable[Manifold]) -> Manifold:
    """Return a solid without others."""
    m = library()
    made: Manifold = m.Manifold.batch_boolean([whole, *taken], m.OpType.Subtract)
    return made


def turned(part: Manifold, degrees: float) -> Manifold:
    """Return a solid turned about z."""
    return part if degrees == 0 else part.rotate((0.0, 0.0, degrees))


def mesh_of(part: Manifold) -> tuple[Array, Faces]:
    """Return (n, 3) vertices [mm] and (m, 3) faces of a solid."""
    mesh = part.to_mesh64()
    vertices: Array = np.asarray(mesh.vert_properties, float)[:, :3]
    return vertices, np.asarray(mesh.tri_verts, np.int64)


def bounds(part: Manifold) -> Array:
    """Return (2, 3) least and largest coordinates [mm]."""
    return np.asarray(part.bounding_box(), float).reshape(2, 3)
