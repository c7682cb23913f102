"""Solids as STL or GLB.

Both hold millimetres. STL has no unit; a GLB's is the metre with y up, so its root carries that scale and turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from softnlp.base.errors import InputError
from softnlp.base.palette import colour
from softnlp.base.units import MILLIMETRE
from softnlp.figures.mesh.solid import Solid, missing_extra
from softnlp.model.robot import Robot
from softnlp.results import write_whole

FORMATS = (".stl", ".glb")
_SILICONE = (0.93, 0.91, 0.88, 0.45)
_LUMEN = (0.6, 0.6, 0.6, 0.3)


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
    trimesh = _trimesh()
    return bytes(trimesh.util.concatenate([_mesh(solid) for solid in solids]).export(file_type="stl"))


def _glb(solids: Sequence[Solid], robot: Robot) -> bytes:
    trimesh = _trimesh()
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
        return _SILICONE if solid.name == "body" else _LUMEN
    word = colour(robot.set_of_chamber[solid.chamber])
    r, g, b = (int(word[k : k + 2], 16) / 255 for k in (1, 3, 5))
    return r, g, b, 1.0


def _mesh(solid: Solid) -> Any:
    return _trimesh().Trimesh(solid.vertices, solid.faces, process=False)


def _trimesh() -> Any:
    try:
        import trimesh
    except ImportError:
        raise missing_extra() from None
    return trimesh
