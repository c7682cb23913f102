"""Watertight solids of a body for export: the section as one polygon with holes, swept along the axis.

The polygon is made and triangulated once, so the sweep is closed and its normals point outwards by construction; where
a shape passes through itself the solid does too, and `Solid.warnings` says so.

Files hold millimetres. STL has no unit; a GLB's is the metre with y up, so its root carries that scale and turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from importlib import import_module
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.arrays import Array
from softnlp.base.errors import InputError
from softnlp.base.palette import colour
from softnlp.base.units import MILLIMETRE
from softnlp.figures.mesh.rings import circle, natural_body, placed, resampled
from softnlp.model.robot import Robot
from softnlp.model.section import SectionRadii
from softnlp.model.segments import segments_of
from softnlp.results import Body, write_whole
from softnlp.statics.body import advances, fit_of, turns

if TYPE_CHECKING:
    from manifold3d import CrossSection

Indices = NDArray[np.int64]

FACETS = 96
FACET_LIMITS = (8, 2000)
HOLES = ("bore", "reinforced")
FORMATS = (".stl", ".glb")
SILICONE = (0.93, 0.91, 0.88, 0.45)
_LUMEN = (0.6, 0.6, 0.6, 0.3)


@dataclass(frozen=True, eq=False)
class Solid:
    """A closed surface.

    name : of what it is. vertices : (n, 3) [mm]. faces : (m, 3), counter-clockwise seen from outside. warnings : what a
    maker should know. chamber : of a core, from 0, else None.
    """

    name: str
    vertices: Array
    faces: Indices
    warnings: tuple[str, ...] = ()
    chamber: int | None = None

    @property
    def volume(self) -> float:
        """Volume by the divergence theorem [mm^3]."""
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def require(facets: int) -> None:
    """Check what every solid needs, before time is spent on a shape.

    Raises
    ------
    InputError
        Without the extra `mesh`, or for a number of facets out of range.
    """
    low, high = FACET_LIMITS
    if not low <= facets <= high:
        raise InputError(f"expected a number of facets from {low} to {high}, got {facets}", key="facets")
    _library("manifold3d")


def body_solid(robot: Robot, body: Body, facets: int = FACETS) -> Solid:
    """Return the silicone of a shape, with lumen and bores open at both ends.

    Every circle has `facets` sides, its corners on the circle, and the axis turns by at most one facet's angle from
    one station to the next, so the volume's relative error falls as facets^-2.

    Raises
    ------
    InputError
        Without the extra `mesh`, for a number of facets out of range, where no wall is left beside the bores, or for a
        shape that is compressed to nothing somewhere.
    """
    made = _swept("body", body, _silicone(robot, body, body.radii.bore, facets), facets)
    return replace(made, warnings=fit_of(body.position, body.rotation, body.radii.outer).warnings)


def mould_body(robot: Robot, facets: int = FACETS, holes: str = "bore") -> Solid:
    """Return the silicone as it is cast: straight, of length L_0, with lumen and chambers as through holes.

    holes : "bore", the finished body with holes of r_ci0; or "reinforced", of r_co, the silicone that is cast around
    chambers made and wound before.

    Raises
    ------
    InputError
        As `body_solid`.
    """
    body = natural_body(robot)
    return _swept("body", body, _silicone(robot, body, _hole_radius(robot, holes), facets), facets)


def cores(robot: Robot, body: Body | None = None, facets: int = FACETS, holes: str = "bore") -> tuple[Solid, ...]:
    """Return what fills the lumen and the chambers, each a solid of its own: lumen first, then chamber by chamber.

    body : a shape; by default the natural one, whose cores are the rods of a mould. holes : as of `mould_body`.

    Raises
    ------
    InputError
        As `body_solid`.
    """
    require(facets)
    shape = natural_body(robot) if body is None else body
    radius = _hole_radius(robot, holes) if body is None else body.radii.bore
    discs: list[tuple[int | None, Array]] = [(None, shape.radii.lumen * circle(facets))]
    discs += [(n, outline) for n, outline in enumerate(_holes(robot, shape, radius, facets))]
    names = ["lumen" if n is None else f"chamber {n + 1}" for n, _ in discs]
    return tuple(
        _swept(name, shape, _section([outline]), facets, chamber=n)
        for name, (n, outline) in zip(names, discs, strict=True)
    )


def _hole_radius(robot: Robot, holes: str) -> float:
    if holes not in HOLES:
        raise InputError(f"expected {' or '.join(map(repr, HOLES))}, got {holes!r}", key="holes")
    return float(robot.bore_radius if holes == "bore" else robot.chamber_radius)


def _holes(robot: Robot, body: Body, radius: float, facets: int) -> list[Array]:
    """Return the outline of each chamber in the section [m]."""
    theta = np.array(robot.chamber_angles(), dtype=float)
    centres = body.radii.chamber_circle * np.column_stack([np.cos(theta), np.sin(theta)])
    return [centre + radius * circle(facets) for centre in centres]


def _silicone(robot: Robot, body: Body, hole: float, facets: int) -> CrossSection:
    """Return the section between outer circle, lumen and holes [mm]; holes that overlap become one."""
    require(facets)
    r_r, r_i, r_cp = body.radii.outer, body.radii.lumen, body.radii.chamber_circle
    if r_cp + hole >= r_r * np.cos(np.pi / facets):
        few = r_cp + hole < r_r
        reason = "expected more facets: a bore reaches between them" if few else "the bores reach the surface here"
        raise InputError(f"{reason}, r_cp + r = {(r_cp + hole) / MILLIMETRE:.4g} mm of {r_r / MILLIMETRE:.4g} mm")
    if r_cp - hole <= r_i:
        raise InputError(
            f"the bores reach the lumen here, r_cp - r = {(r_cp - hole) / MILLIMETRE:.4g} mm of "
            f"{r_i / MILLIMETRE:.4g} mm"
        )
    unit = circle(facets)
    return _section([r_r * unit]) - _section([r_i * unit, *_holes(robot, body, hole, facets)])


def _section(outlines: list[Array]) -> CrossSection:
    """Return the union of outlines [m] as a section [mm]."""
    return _library("manifold3d").CrossSection([outline / MILLIMETRE for outline in outlines])


def _swept(name: str, body: Body, section: CrossSection, facets: int, chamber: int | None = None) -> Solid:
    """Sweep a section [mm] along a body."""
    if np.min(advances(body.position, body.rotation)) <= 0:
        raise InputError("a part of this shape has negative length (v_z <= 0), so it is no solid")
    loops = [np.asarray(loop, dtype=float) for loop in section.to_polygons()]
    axis = resampled(body, _stations(body, facets))
    return _solid(name, axis, loops, np.concatenate(loops)[None] * MILLIMETRE, chamber)


def _stations(body: Body, facets: int) -> int:
    """Return how many stations there are for the axis to turn by at most one facet's angle between two."""
    turned = float(np.sqrt((turns(body.rotation) ** 2).sum(axis=1)).sum())
    return 1 + max(1, int(np.ceil(turned * facets / (2 * np.pi))))


def segment_solids(robot: Robot, body: Body, facets: int = FACETS, fixed: int | None = None) -> tuple[Solid, ...]:
    """Return the silicone of each segment of a shape, base first, a solid each; connectors are none.

    fixed : stations along each segment, by default as many as its bend asks for.

    Raises
    ------
    InputError
        As `body_solid`.
    """
    made = []
    for k, (piece, (own, _)) in enumerate(zip(body.pieces, segments_of(robot), strict=True)):
        radii = {field.name: np.ravel(getattr(piece.radii, field.name)) for field in fields(piece.radii)}
        for j in range(radii["outer"].size):  # for its errors
            there = SectionRadii(**{name: float(values[j]) for name, values in radii.items()})
            _silicone(own, replace(piece, radii=there), there.bore, facets)
        if np.min(advances(piece.position, piece.rotation)) <= 0:
            raise InputError("a part of this shape has negative length (v_z <= 0), so it is no solid")
        stations = fixed or max(_stations(piece, facets), len(piece.position))
        axis = resampled(piece, stations)
        chord = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(piece.position, axis=0), axis=1)))
        at = np.linspace(0, chord[-1], stations)
        along = {name: np.interp(at, chord, np.broadcast_to(v, chord.shape)) for name, v in radii.items()}
        unit, theta = circle(facets), np.array(own.chamber_angles(), dtype=float)
        towards = np.column_stack([np.cos(theta), np.sin(theta)])
        rings = [along["outer"][:, None, None] * unit, along["lumen"][:, None, None] * unit[::-1]]
        for way in towards:
            rings.append(along["chamber_circle"][:, None, None] * way + along["bore"][:, None, None] * unit[::-1])
        loops = [ring[0] / MILLIMETRE for ring in rings]
        made.append(_solid(f"segment {k + 1}", axis, loops, np.concatenate(rings, axis=1)))
    fits = [fit_of(piece.position, piece.rotation, float(np.max(piece.radii.outer))) for piece in body.pieces]
    fits.append(fit_of(body.position, body.rotation, body.radii.outer, np.zeros(len(body.position))))
    warnings = tuple(dict.fromkeys(warning for fit in fits for warning in fit.warnings))
    return (replace(made[0], warnings=warnings), *made[1:])


def _solid(name: str, axis: Body, loops: list[Array], local: Array, chamber: int | None = None) -> Solid:
    """Return the solid of a section along an axis. loops : at the base [mm]. local : (stations or 1, n, 2) [m]."""
    cap = np.asarray(_library("manifold3d").triangulate(loops), dtype=np.int64)
    points = placed(axis.position[:, None], axis.rotation[:, None], local) / MILLIMETRE
    n, stations = local.shape[1], len(axis.position)
    starts = [0, *np.cumsum([len(loop) for loop in loops])[:-1]]
    following = np.concatenate([np.roll(np.arange(len(c)), -1) + k for c, k in zip(loops, starts, strict=True)])
    here = np.arange(n) + n * np.arange(stations - 1)[:, None]
    there = following + n * np.arange(stations - 1)[:, None]
    sides = [np.stack([here, there, there + n], axis=-1), np.stack([here, there + n, here + n], axis=-1)]
    faces = np.concatenate([cap[:, ::-1], *(s.reshape(-1, 3) for s in sides), cap + n * (stations - 1)])
    return Solid(name, points.reshape(-1, 3), faces, chamber=chamber)


# --- files -----------------------------------------------------------------------------------------------------------


def format_of(path: str | PathLike[str]) -> str:
    """Return ".stl" or ".glb", the format that a file name asks for.

    Raises
    ------
    InputError
        For another.
    """
    kind = Path(path).suffix.lower()
    if kind not in FORMATS:
        raise InputError(f"expected a file name that ends in {' or '.join(FORMATS)}", source=str(path))
    return kind


def write_solids(solids: Sequence[Solid], robot: Robot, path: str | PathLike[str]) -> Path:
    """Write solids to a file, whole; return its path.

    An STL is one list of triangles; a GLB keeps each solid apart, with its name and colour (a chamber has its set's).

    Raises
    ------
    InputError
        Without the extra `mesh`, for a name that ends otherwise, or when the file cannot be written.
    """
    content = _stl(solids) if format_of(path) == ".stl" else _glb(solids, robot)
    return write_whole(path, content)


def _stl(solids: Sequence[Solid]) -> bytes:
    trimesh = _library("trimesh")
    return bytes(trimesh.util.concatenate([_mesh(solid) for solid in solids]).export(file_type="stl"))


def _glb(solids: Sequence[Solid], robot: Robot) -> bytes:
    trimesh = _library("trimesh")
    to_metres = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
    to_metres[:3] *= MILLIMETRE
    scene = trimesh.Scene()
    for solid in solids:
        mesh = _mesh(solid)
        rgba = _colour(solid, robot)
        mesh.visual = trimesh.visual.TextureVisuals(
            material=trimesh.visual.material.PBRMaterial(
                name=solid.name,
                baseColorFactor=rgba,
                metallicFactor=0.0,
                roughnessFactor=0.7,
                alphaMode="OPAQUE" if rgba[3] == 1 else "BLEND",
            )
        )
        scene.add_geometry(mesh, node_name=solid.name, geom_name=solid.name, transform=to_metres)
    return bytes(scene.export(file_type="glb"))


def _colour(solid: Solid, robot: Robot) -> tuple[float, float, float, float]:
    if solid.chamber is None:
        return _LUMEN if solid.name == "lumen" else SILICONE
    word = colour(robot.set_of_chamber[solid.chamber])
    r, g, b = (int(word[k : k + 2], 16) / 255 for k in (1, 3, 5))
    return r, g, b, 1.0


def _mesh(solid: Solid) -> Any:
    return _library("trimesh").Trimesh(solid.vertices, solid.faces, process=False)


def _library(name: str) -> Any:
    """Return a library of the extra `mesh`, or raise `InputError` where it is not installed."""
    try:
        return import_module(name)
    except ImportError:
        missing = "solids need trimesh and manifold3d, which are not installed: pip install 'softnlp[mesh]'"
        raise InputError(missing) from None
