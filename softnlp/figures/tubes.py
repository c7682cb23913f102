"""Tubes along a body for 3-D panels: its surface and its chambers, round or of any outline. Lengths in mm."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.arrays import Array
from softnlp.base.units import MILLIMETRE
from softnlp.figures.mesh.outlines import along_outline, drawn_section
from softnlp.figures.mesh.rings import circle, placed
from softnlp.model.outlined import OutlinedRobot
from softnlp.model.plane import Circle
from softnlp.model.robot import Robot
from softnlp.results import Body

OUTLINE_FACETS = 24
"""Of a chamber that is not of a round layout."""


def tube(body: Body, radius: float | Array, offset: tuple[Any, Any], facets: int, stations: int) -> tuple[Array, Array]:
    """Return (n, 4, 3) quads [mm] and (n, 3) outward normals of a tube along a body.

    radius : one or (M,) [m]. offset : of the tube's axis from the body's, in the body frame, numbers or (M,) [m].
    """
    M = len(body.position)
    chosen = np.unique(np.linspace(0, M - 1, min(stations, M)).round().astype(int))
    wide, x, y = (np.broadcast_to(value, M)[chosen] for value in (radius, *offset))
    return _tube(body, wide[:, None, None] * circle(facets) + np.stack([x, y], axis=1)[:, None], chosen)


def skin(body: Body, robot: Robot, facets: int, stations: int) -> tuple[Array, Array]:
    """Return the quads and normals of a segment's surface; robot : the segment's."""
    if not isinstance(robot, OutlinedRobot) or isinstance(robot.surface, Circle):
        return tube(body, body.radii.outer, (0, 0), facets, stations)
    return outline_tube(body, drawn_section(robot, body.radii, facets).surface, facets, stations)


def outline_tube(body: Body, outline: Array, facets: int, stations: int) -> tuple[Array, Array]:
    """Return the quads and normals of a tube of any outline (n, 2) along a body [m]."""
    M = len(body.position)
    chosen = np.unique(np.linspace(0, M - 1, min(stations, M)).round().astype(int))
    return _tube(body, along_outline(outline, facets)[None], chosen)


def _tube(body: Body, local: Array, chosen: NDArray[np.int_]) -> tuple[Array, Array]:
    """Return the same of rings (stations or 1, facets, 2) in the sections of chosen stations."""
    p, R = body.position[chosen], body.rotation[chosen]
    local = np.broadcast_to(local, (len(chosen), *local.shape[1:]))
    rings = placed(p[:, None], R[:, None], np.concatenate([local, local[:, :1]], axis=1)) / MILLIMETRE
    quads = np.stack([rings[:-1, :-1], rings[1:, :-1], rings[1:, 1:], rings[:-1, 1:]], axis=2)
    along = np.roll(local[0], -1, axis=0) - local[0]
    outward = np.column_stack([along[:, 1], -along[:, 0], 0 * along[:, 0]]) / np.hypot(*along.T)[:, None]
    normals = np.einsum("sij,fj->sfi", R[:-1], outward)
    return quads.reshape(-1, 4, 3), normals.reshape(-1, 3)


def chamber_tubes(piece: Body, own: Robot, facets: int, stations: int) -> list[tuple[Array, Array]]:
    """Return quads and normals of each chamber of a segment, at its thread."""
    if isinstance(own, OutlinedRobot):
        drawn = drawn_section(own, piece.radii, OUTLINE_FACETS)
        return [outline_tube(piece, ring.outer, OUTLINE_FACETS, stations) for ring in drawn.threads or drawn.bores]
    r_cp = piece.radii.chamber_circle
    offsets = [(r_cp * float(np.cos(theta)), r_cp * float(np.sin(theta))) for theta in own.chamber_angles()]
    return [tube(piece, piece.radii.chamber, offset, facets, stations) for offset in offsets]
