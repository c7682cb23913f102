"""Dexterity: which way the tip can point at which place, on a grid of cubes (voxels)."""

from __future__ import annotations

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np

from softnlp.base.arrays import Array, Index
from softnlp.base.errors import InputError
from softnlp.base.units import DEGREE

RESOLUTION = 10 * DEGREE
VOXELS_ALONG = 20  # of a cloud's largest extent


@dataclass(frozen=True, eq=False)
class Dexterity:
    """What the tip does in each of V voxels that it reaches.

    origin : (3,) lowest corner of the grid [m]. size : edge of a voxel [m]. voxel : (V, 3) position in the grid.
    poses : (V,) how many end there. lowest_tilt, highest_tilt : (V,) of the tip axis against +z [rad].
    coverage : (V,) part of all directions that the tip axis takes there. directions : into how many equal parts the
    sphere of directions is cut. resolution : the edge of a square as large as one of them [rad].
    overall : the part of all directions that the tip takes anywhere.
    """

    origin: Array
    size: float
    voxel: Index
    poses: Index
    lowest_tilt: Array
    highest_tilt: Array
    coverage: Array
    directions: int
    resolution: float
    overall: float

    @property
    def tilt_range(self) -> Array:
        """Highest minus lowest tilt of each voxel (V,) [rad]."""
        return self.highest_tilt - self.lowest_tilt

    @property
    def centres(self) -> Array:
        """Centre of each voxel (V, 3) [m]."""
        return self.origin + (self.voxel + 0.5) * self.size

    @property
    def volume(self) -> float:
        """Volume of all voxels that are reached [m^3]."""
        return len(self.voxel) * self.size**3


def dexterity(positions: Array, axes: Array, voxel: float | None = None, resolution: float = RESOLUTION) -> Dexterity:
    """Return what tilts and directions of the tip are reached at which places.

    Parameters
    ----------
    positions : (M, 3) tip positions [m]; solved poses only.
    axes : (M, 3) tip axes, unit vectors.
    voxel : edge of a voxel [m]; a twentieth of the largest extent by default.
    resolution : edge of a cell of the sphere of directions [rad]. A direction counts as taken when any pose's axis is
        nearer to it than to any other of about 4 pi / resolution^2 evenly spread ones.

    A few poses cannot point in many directions: coverage and range only mean something where voxels hold many poses,
    so compare `Dexterity.poses` with `directions`. Turning about the tip's own axis is not counted.

    Raises
    ------
    InputError
        For a voxel or a resolution that is not a positive number, or no poses.
    """
    if not len(positions):
        raise InputError("expected at least one solved pose, got none")
    extent = float(np.ptp(positions, axis=0).max())
    size = (extent / VOXELS_ALONG if extent > 0 else 1e-3) if voxel is None else voxel
    for name, value in (("voxel", size), ("resolution", resolution)):
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"expected a number above 0, got {value:g}", key=name)
    # whole multiples of the size, so that the same place is in the same voxel for any cloud
    index = np.floor(positions / size).astype(np.int64)
    lowest = index.min(axis=0)
    across = index.max(axis=0) - lowest + 1
    if float(np.prod(across.astype(float))) > 2**62:
        raise InputError(f"expected a voxel that a cloud of {extent:g} m needs fewer of, got {size:g} m", key="voxel")
    key = np.ravel_multi_index(tuple((index - lowest).T), tuple(across))
    voxels, owner, poses = np.unique(key, return_inverse=True, return_counts=True)
    tilt = np.arctan2(np.hypot(axes[:, 0], axes[:, 1]), axes[:, 2])
    low, high = np.full(len(voxels), np.inf), np.full(len(voxels), -np.inf)
    np.minimum.at(low, owner, tilt)
    np.maximum.at(high, owner, tilt)
    directions = spread_directions(max(1, round(4 * pi / resolution**2)))
    cell = nearest_direction(axes, directions)
    taken = np.unique(owner * len(directions) + cell)
    here = np.bincount(taken // len(directions), minlength=len(voxels))
    return Dexterity(
        origin=lowest * size,
        size=size,
        voxel=np.column_stack(np.unravel_index(voxels, tuple(across))).astype(np.int64),
        poses=poses.astype(np.int64),
        lowest_tilt=low,
        highest_tilt=high,
        coverage=here / len(directions),
        directions=len(directions),
        resolution=sqrt(4 * pi / len(directions)),
        overall=len(np.unique(cell)) / len(directions),
    )


def spread_directions(count: int) -> Array:
    """Return unit vectors (count, 3) that cut the sphere into cells of nearly equal size (a Fibonacci lattice)."""
    k = np.arange(count) + 0.5
    z = 1 - 2 * k / count
    azimuth = pi * (1 + sqrt(5)) * k
    across = np.sqrt(1 - z**2)
    return np.column_stack([across * np.cos(azimuth), across * np.sin(azimuth), z])


def nearest_direction(axes: Array, directions: Array) -> Index:
    """Return which direction each axis (M, 3) is nearest to (M,)."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(directions).query(axes)[1], dtype=np.int64)


def seen_along(found: Dexterity, values: Array, axis: int) -> tuple[Array, Array, Array]:
    """Return the largest value of the voxels behind each other along an axis, as a map.

    values : (V,) one a voxel. axis : 0, 1 or 2, the line of sight. Returns the edges of the cells along the two other
    axes, in their order [m], and the map (cells along the first, cells along the second), NaN where nothing is reached.
    """
    first, second = (k for k in range(3) if k != axis)
    shape = found.voxel[:, [first, second]].max(axis=0) + 1
    largest = np.full(tuple(shape), -np.inf)
    np.maximum.at(largest, (found.voxel[:, first], found.voxel[:, second]), values)
    edges = [found.origin[k] + found.size * np.arange(n + 1) for k, n in zip((first, second), shape, strict=True)]
    return edges[0], edges[1], np.where(np.isneginf(largest), np.nan, largest)
