"""Pictures of solids without a window: triangles drawn into an array with a depth for each pixel, and one light."""

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

_LIGHT = np.array([-0.45, 0.6, 0.66])  # from the left and above, along the rows of a view
_TWICE = 2  # drawn so many times larger and averaged


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


def picture(
    things: Sequence[Drawn], width: int = 560, height: int = 560, view: Array | None = None
) -> NDArray[np.uint8]:
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
    found: NDArray[np.uint8] = (255 * np.clip(small, 0, 1)).astype(np.uint8)
    return found


def _draw(corners: Array, thing: Drawn, seen: Array, image: Array, depth: Array, size: tuple[int, int]) -> None:
    """Draw triangles; corners : (m, 3, 3) in pixels, with the distance towards the viewer."""
    world = thing.vertices[thing.faces]
    normal = np.cross(world[:, 1] - world[:, 0], world[:, 2] - world[:, 0])
    length = np.linalg.norm(normal, axis=1)
    front = (normal @ seen[2] > 0) & (length > 0)
    corners, unit = corners[front], normal[front] / length[front, None]
    light = 0.35 + 0.65 * np.clip(unit @ (_LIGHT @ seen), 0, 1) + 0.12 * np.clip(unit @ seen[2], 0, 1)
    shade = np.clip(np.array(thing.colour) * light[:, None], 0, 1)
    # Pixels whose middle is inside, row by row: first the rows of each triangle, then the pixels of each row.
    y = corners[..., 1]
    low = np.clip(np.ceil(y.min(axis=1) - 0.5), 0, size[1]).astype(int)
    high = np.clip(np.floor(y.max(axis=1) - 0.5), -1, size[1] - 1).astype(int)
    counts = np.maximum(high - low + 1, 0)
    which = np.repeat(np.arange(len(counts)), counts)
    row = low[which] + _within(counts)
    left, right = _span(corners[which], row + 0.5)
    first = np.clip(np.ceil(left - 0.5), 0, size[0]).astype(int)
    last = np.clip(np.floor(right - 0.5), -1, size[0] - 1).astype(int)
    counts = np.maximum(last - first + 1, 0)
    x = np.repeat(first, counts) + _within(counts)
    which, row = np.repeat(which, counts), np.repeat(row, counts)
    z = _planes(corners)[which]
    height = z[:, 0] * (x + 0.5) + z[:, 1] * (row + 0.5) + z[:, 2]
    at = row * size[0] + x
    order = np.argsort(height)  # the nearest is written last
    at, height, which = at[order], height[order], which[order]
    near = height > depth[at]
    depth[at[near]] = height[near]
    image[at[near]] = shade[which[near]]


def _within(counts: Faces) -> Faces:
    """Return 0, 1, ... up to each count, one after the other."""
    return np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)


def _span(corners: Array, y: Array) -> tuple[Array, Array]:
    """Return between which x each triangle is at a height; corners : (m, 3, 3). y : (m,)."""
    left, right = np.full(len(y), np.inf), np.full(len(y), -np.inf)
    for k in range(3):
        a, b = corners[:, k], corners[:, (k + 1) % 3]
        crosses = (a[:, 1] - y) * (b[:, 1] - y) <= 0
        rise = b[:, 1] - a[:, 1]
        t = np.divide(y - a[:, 1], rise, out=np.zeros_like(y), where=rise != 0)
        x = a[:, 0] + t * (b[:, 0] - a[:, 0])
        left = np.where(crosses, np.minimum(left, x), left)
        right = np.where(crosses, np.maximum(right, x), right)
    return np.where(np.isfinite(left), left, 0.0), np.where(np.isfinite(right), right, -1.0)


def _planes(corners: Array) -> Array:
    """Return a, b, c of the plane z = a x + b y + c of each triangle; flat for one that is seen from its side."""
    p, q = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    n = np.cross(p, q)
    whole = np.where(np.abs(n[:, 2]) > 1e-9, n[:, 2], np.inf)
    a, b = -n[:, 0] / whole, -n[:, 1] / whole
    return np.column_stack([a, b, corners[:, 0, 2] - a * corners[:, 0, 0] - b * corners[:, 0, 1]])


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
