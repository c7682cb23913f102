"""Pictures of solids without a window: triangles drawn into an array with a depth for each pixel, one light, soft edges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from softnlp.base.arrays import Array
from softnlp.mould.solids import Faces, mesh_of

if TYPE_CHECKING:
    from manifold3d import Manifold

_LIGHT = np.array([0.35, -0.5, 0.8]) / np.linalg.norm([0.35, -0.5, 0.8])
_TWICE = 2  # drawn so many times larger and averaged
_GRAIN = 1 << 16  # triangles are sorted into pixels in portions of so many candidates


@dataclass(frozen=True, eq=False)
class Drawn:
    """What is drawn: a closed surface [mm] with a colour."""

    vertices: Array
    faces: Faces
    colour: tuple[float, float, float]

    @classmethod
    def of(cls, solid: Manifold, colour: Sequence[float]) -> Drawn:
        """Return a solid as it is drawn."""
        vertices, faces = mesh_of(solid)
        return cls(vertices, faces, (colour[0], colour[1], colour[2]))


def camera(turn: float = 35.0, lift: float = 22.0) -> Array:
    """Return (3, 3) rows right, up and towards the viewer, of a view from an angle about z and above [deg]."""
    a, b = np.radians(turn - 90.0), np.radians(lift)
    towards = np.array([np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.stack([right, np.cross(towards, right), towards])


def picture(things: Sequence[Drawn], width: int = 560, height: int = 560, view: Array | None = None) -> NDArray[np.uint8]:
    """Return (height, width, 3) the picture of things, as large as fits, without perspective."""
    seen = camera() if view is None else view
    projected = [thing.vertices @ seen.T for thing in things]
    low = np.min([points.min(axis=0) for points in projected], axis=0)
    high = np.max([points.max(axis=0) for points in projected], axis=0)
    W, H = _TWICE * width, _TWICE * height
    scale = 0.94 * min(W / (high[0] - low[0]), H / (high[1] - low[1]))
    image = np.ones((H * W, 3))
    depth = np.full(H * W, -np.inf)
    middle = (low + high) / 2
    for thing, points in zip(things, projected, strict=True):
        xy = (points[:, :2] - middle[:2]) * scale * (1, -1) + (W / 2, H / 2)
        _draw(np.column_stack([xy, points[:, 2]])[thing.faces], thing, seen, image, depth, (W, H))
    image = _edges(image.reshape(H, W, 3), depth.reshape(H, W))
    small = image.reshape(height, _TWICE, width, _TWICE, 3).mean(axis=(1, 3))
    return (255 * np.clip(small, 0, 1)).astype(np.uint8)


def _draw(corners: Array, thing: Drawn, seen: Array, image: Array, depth: Array, size: tuple[int, int]) -> None:
    """Draw triangles; corners : (m, 3, 3) in pixels, with the distance towards the viewer."""
    world = thing.vertices[thing.faces]
    normal = np.cross(world[:, 1] - world[:, 0], world[:, 2] - world[:, 0])
    length = np.linalg.norm(normal, axis=1)
    front = (normal @ seen[2] > 0) & (length > 0)
    corners, unit = corners[front], normal[front] / length[front, None]
    light = 0.35 + 0.65 * np.clip(unit @ _LIGHT, 0, 1) + 0.12 * np.clip(unit @ seen[2], 0, 1)
    shade = np.clip(np.array(thing.colour) * light[:, None], 0, 1)
    low = np.clip(np.floor(corners[..., :2].min(axis=1)), 0, np.array(size) - 1).astype(int)
    high = np.clip(np.ceil(corners[..., :2].max(axis=1)), 0, np.array(size) - 1).astype(int)
    span = high - low + 1
    counts = span.prod(axis=1)
    ends = np.cumsum(counts)
    first = 0
    while first < len(counts):
        base = ends[first - 1] if first else 0
        last = max(first + 1, int(np.searchsorted(ends, base + _GRAIN, side="right")))
        _portion(corners[first:last], shade[first:last], low[first:last], span[first:last], image, depth, size[0])
        first = last


def _portion(
    corners: Array, shade: Array, low: Faces, span: Faces, image: Array, depth: Array, width: int
) -> None:
    counts = span.prod(axis=1)
    which = np.repeat(np.arange(len(counts)), counts)
    place = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
    x = low[which, 0] + place % span[which, 0]
    y = low[which, 1] + place // span[which, 0]
    a, b, c = (corners[which, k] for k in range(3))
    px, py = x + 0.5, y + 0.5
    whole = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1])
    with np.errstate(divide="ignore", invalid="ignore"):
        u = ((px - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (py - a[:, 1])) / whole
        v = ((b[:, 0] - a[:, 0]) * (py - a[:, 1]) - (px - a[:, 0]) * (b[:, 1] - a[:, 1])) / whole
    inside = (u >= 0) & (v >= 0) & (u + v <= 1)
    which, u, v = which[inside], u[inside], v[inside]
    at = y[inside] * width + x[inside]
    z = corners[which, 0, 2] * (1 - u - v) + corners[which, 1, 2] * u + corners[which, 2, 2] * v
    order = np.argsort(z, kind="stable")  # the nearest is written last
    at, z, which = at[order], z[order], which[order]
    seen = z > depth[at]
    at, z, which = at[seen], z[seen], which[seen]
    depth[at] = z
    image[at] = shade[which]


def _edges(image: Array, depth: Array) -> Array:
    """Darken where the depth steps, so that parts stand apart."""
    finite = np.where(np.isfinite(depth), depth, depth[np.isfinite(depth)].min() - 5.0)
    step = np.zeros_like(finite)
    step[1:] = np.maximum(step[1:], np.abs(np.diff(finite, axis=0)))
    step[:, 1:] = np.maximum(step[:, 1:], np.abs(np.diff(finite, axis=1)))
    found: Array = image * (1 - 0.6 * (step > 0.8))[..., None]
    return found


def png(image: NDArray[np.uint8]) -> bytes:
    """Return a picture as a PNG."""
    from matplotlib.image import imsave

    packed = BytesIO()
    imsave(packed, image, format="png")
    return packed.getvalue()
