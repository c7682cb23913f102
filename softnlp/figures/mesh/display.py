"""Triangles of a robot for live display: their topology is the robot's, only the vertices follow the shape.

Each vertex is c r_cp + a r in the section of its station, with unit vectors c (to a chamber) and a (around a circle)
of the robot and radii r_cp and r of the shape, so one line moves them all.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.arrays import Array
from softnlp.base.units import MILLIMETRE
from softnlp.figures.mesh.rings import circle, placed, resampled
from softnlp.model.robot import Robot
from softnlp.results import Body

Single = NDArray[np.float32]
Indices = NDArray[np.int32]

STATIONS = 41
OUTER_FACETS, LUMEN_FACETS, BORE_FACETS = 48, 28, 20
RADII = ("outer", "lumen", "bore")
"""The radii that `DisplayMesh.radius` counts."""


@dataclass(frozen=True, eq=False)
class Part:
    """One surface among the triangles.

    kind : "outer", "lumen", "end" or "chamber". chamber : from 0, else None. first, last : its vertices are
    first:last of all. faces : (m, 3) counted from `first`, counter-clockwise seen from outside the silicone (of a
    chamber: from outside the chamber).
    """

    kind: str
    chamber: int | None
    first: int
    last: int
    faces: Indices

    def of(self, values: Single) -> Single:
        """Return the rows of this part."""
        return values[self.first : self.last]


@dataclass(frozen=True, eq=False)
class DisplayMesh:
    """Triangles of a robot; V vertices, the same for every shape.

    The outer surface and the lumen are open tubes, "end" are the two faces between them, and each chamber is a closed
    tube of the bore's radius whose discs lie in those faces.

    stations : along the axis. station : (V,). centre, around : (V, 2) unit vectors c and a of the module's text, or 0.
    radius : (V,) index in `RADII`. normal : (V, 3) in the body frame. parts : in the order of their vertices.
    """

    stations: int
    station: Indices
    centre: Single
    around: Single
    radius: Indices
    normal: Single
    parts: tuple[Part, ...]

    def vertices(self, body: Body) -> Single:
        """Return (V, 3) vertices of a shape [mm]."""
        at = self._at_stations(body)
        r = np.array([getattr(at.radii, name) for name in RADII])[self.radius]
        local = at.radii.chamber_circle * self.centre + r[:, None] * self.around
        points = placed(at.position[self.station], at.rotation[self.station], local)
        return (points / MILLIMETRE).astype(np.float32)

    def normals(self, body: Body) -> Single:
        """Return (V, 3) unit normals of a shape; those of a tube are its section's."""
        rotation = self._at_stations(body).rotation[self.station]
        normals: Single = np.einsum("vij,vj->vi", rotation, self.normal).astype(np.float32)
        return normals

    def _at_stations(self, body: Body) -> Body:
        return resampled(body, self.stations)


def display_mesh(robot: Robot, stations: int = STATIONS) -> DisplayMesh:
    """Return the triangles of a robot."""
    made = _Surfaces(stations)
    made.tube("outer", circle(OUTER_FACETS))
    made.tube("lumen", circle(LUMEN_FACETS), inwards=True)
    made.ends()
    for n, theta in enumerate(robot.chamber_angles()):
        made.chamber(n, np.array([np.cos(theta), np.sin(theta)]))
    return made.mesh()


def tube_faces(rings: int, facets: int, *, inwards: bool = False) -> Indices:
    """Return (m, 3) triangles of a tube of rings, seen from outside (or inside); vertices count ring by ring."""
    ring, facet = np.meshgrid(np.arange(rings - 1), np.arange(facets), indexing="ij")
    a, b = ring * facets + facet, ring * facets + (facet + 1) % facets
    quads = np.stack([a, b, b + facets, a + facets], axis=-1).reshape(-1, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]]).astype(np.int32)
    return faces[:, ::-1] if inwards else faces


_Rows = tuple[NDArray[Any], ...]
"""Columns of some vertices: station, centre, around, radius, normal."""


class _Surfaces:
    """Collects the vertices and faces of a robot, part by part."""

    def __init__(self, stations: int) -> None:
        self.stations = stations
        self.rows: list[_Rows] = []
        self.parts: list[Part] = []
        self.count = 0

    def tube(self, kind: str, around: Array, *, inwards: bool = False) -> None:
        rows = self._sides(around, RADII.index(kind), np.zeros(2), inwards)
        self._add(kind, None, [rows], tube_faces(self.stations, len(around), inwards=inwards))

    def ends(self) -> None:
        """Two annuli: the outer circle and the nearest points of as many on the lumen's."""
        around = circle(OUTER_FACETS)
        rings: list[_Rows] = []
        faces: list[Indices] = []
        for station, up in ((0, -1.0), (self.stations - 1, 1.0)):
            faces.append(tube_faces(2, OUTER_FACETS, inwards=up < 0) + len(rings) * OUTER_FACETS)
            rings += [self._flat(around, station, RADII.index(name), up) for name in ("outer", "lumen")]
        self._add("end", None, rings, np.concatenate(faces))

    def chamber(self, n: int, towards: Array) -> None:
        around, bore = circle(BORE_FACETS), RADII.index("bore")
        rows, faces = [self._sides(around, bore, towards, False)], [tube_faces(self.stations, BORE_FACETS)]
        first = self.stations * BORE_FACETS
        middle = np.zeros((1, 2))
        for station, up in ((0, -1.0), (self.stations - 1, 1.0)):
            rows.append(self._flat(np.concatenate([around, middle]), station, bore, up, towards))
            edge = np.arange(BORE_FACETS)
            fan = np.stack([edge, (edge + 1) % BORE_FACETS, np.full(BORE_FACETS, BORE_FACETS)], axis=1)
            faces.append(first + (fan if up > 0 else fan[:, ::-1]))
            first += BORE_FACETS + 1
        self._add("chamber", n, rows, np.concatenate(faces))

    def mesh(self) -> DisplayMesh:
        station, centre, around, radius, normal = (np.concatenate(c) for c in zip(*self.rows, strict=True))
        return DisplayMesh(
            self.stations,
            station.astype(np.int32),
            centre.astype(np.float32),
            around.astype(np.float32),
            radius.astype(np.int32),
            normal.astype(np.float32),
            tuple(self.parts),
        )

    def _sides(self, around: Array, radius: int, centre: Array, inwards: bool) -> _Rows:
        turn = np.tile(around, (self.stations, 1))
        station = np.repeat(np.arange(self.stations), len(around))
        normal = np.column_stack([-turn if inwards else turn, np.zeros(len(turn))])
        return station, np.tile(centre, (len(turn), 1)), turn, np.full(len(turn), radius), normal

    def _flat(self, around: Array, station: int, radius: int, up: float, centre: Array | None = None) -> _Rows:
        count = len(around)
        offset = np.zeros(2) if centre is None else centre
        normal = np.tile([0.0, 0.0, up], (count, 1))
        return np.full(count, station), np.tile(offset, (count, 1)), around, np.full(count, radius), normal

    def _add(self, kind: str, chamber: int | None, rows: list[_Rows], faces: NDArray[np.integer]) -> None:
        first = self.count
        self.rows += rows
        self.count += sum(len(row[0]) for row in rows)
        self.parts.append(Part(kind, chamber, first, self.count, np.ascontiguousarray(faces, dtype=np.int32)))
