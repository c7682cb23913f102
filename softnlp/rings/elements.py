"""Taylor-Hood triangles: quadratic places, linear pressures, and the quadrature of their six-node geometry."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csc_array

from softnlp.rings.mesher import Indices, Mesh
from softnlp.rings.outline import Array

# Seven points of degree 5: J. Radon, Zur mechanischen Kubatur, Monatshefte fuer Mathematik 52 (1948) 286.
_ROOT = 15**0.5
_NEAR, _FAR = (6 - _ROOT) / 21, (6 + _ROOT) / 21
_POINTS = np.array(
    [(1 / 3, 1 / 3)]
    + [p for s in (_NEAR, _FAR) for p in ((s, s), (1 - 2 * s, s), (s, 1 - 2 * s))]
)  # fmt: skip
_WEIGHTS = np.array([9 / 80] + 3 * [(155 - _ROOT) / 2400] + 3 * [(155 + _ROOT) / 2400])


@dataclass(frozen=True)
class Elements:
    """Shape functions at m triangles times 7 points.

    Attributes
    ----------
    weight
        (m, 7) area that a point stands for [m^2].
    gradient
        (m, 7, 6, 2) of the shape functions of places, in the section as cast [1/m].
    shape, linear
        (7, 6) and (7, 3) values of the shape functions of places and of pressures.
    numbers
        (m, 15) unknowns of each triangle: x and y of its nodes, then 2 n + corner for the pressures.
    unknowns
        How many there are.
    """

    weight: Array
    gradient: Array
    shape: Array
    linear: Array
    numbers: Indices
    unknowns: int

    def matrix(self, blocks: Array) -> csc_array:
        """Return the sum of (m, 15, 15) blocks."""
        rows = np.broadcast_to(self.numbers[:, :, None], blocks.shape).ravel()
        columns = np.broadcast_to(self.numbers[:, None, :], blocks.shape).ravel()
        return csc_array((blocks.ravel(), (rows, columns)), shape=(self.unknowns, self.unknowns))

    def vector(self, blocks: Array) -> Array:
        """Return the sum of (m, 15) blocks."""
        return np.asarray(np.bincount(self.numbers.ravel(), blocks.ravel(), self.unknowns), float)


def elements(mesh: Mesh) -> Elements:
    """Return the elements of a mesh."""
    r, s = _POINTS.T
    t = 1 - r - s
    linear = np.column_stack([t, r, s])
    shape = np.column_stack([t * (2 * t - 1), r * (2 * r - 1), s * (2 * s - 1), 4 * t * r, 4 * r * s, 4 * s * t])
    zero = np.zeros_like(r)
    by_r = np.column_stack([1 - 4 * t, 4 * r - 1, zero, 4 * (t - r), 4 * s, -4 * s])
    by_s = np.column_stack([1 - 4 * t, zero, 4 * s - 1, -4 * r, 4 * r, 4 * (t - s)])
    local = np.stack([by_r, by_s], axis=2)  # (7, 6, 2)
    jacobian = np.einsum("mni,qnj->mqij", mesh.nodes[mesh.triangles], local)
    gradient = np.einsum("qnj,mqji->mqni", local, np.linalg.inv(jacobian))
    n = len(mesh.nodes)
    places = (2 * mesh.triangles[:, :, None] + np.array([0, 1])).reshape(len(mesh.triangles), 12)
    return Elements(
        _WEIGHTS * np.linalg.det(jacobian),
        gradient,
        shape,
        linear,
        np.hstack([places, 2 * n + mesh.triangles[:, :3]]).astype(np.int64),
        2 * n + mesh.corners,
    )
