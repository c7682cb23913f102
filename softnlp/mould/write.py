"""Files of parts: STL and 3MF in millimetres as they are printed, and one GLB of the assembly, exploded."""

from __future__ import annotations

from importlib import import_module
from io import BytesIO
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

import numpy as np

from softnlp.base.arrays import Array
from softnlp.base.units import MILLIMETRE
from softnlp.mould.assembly import Moulds
from softnlp.mould.parts import Part
from softnlp.mould.solids import Faces, mesh_of

if TYPE_CHECKING:
    from manifold3d import Manifold

COLOURS = {
    "shell": (0.27, 0.51, 0.71, 0.55),
    "plate": (0.93, 0.60, 0.20, 1.0),
    "core": (0.80, 0.25, 0.25, 1.0),
    "key": (0.45, 0.65, 0.30, 1.0),
    "rod": (0.55, 0.57, 0.60, 1.0),
    "cap": (0.55, 0.40, 0.70, 1.0),
    "connector": (0.20, 0.60, 0.60, 1.0),
    "thread": (0.15, 0.15, 0.15, 1.0),
}
"""Red, green, blue and opacity of each kind of part."""

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_TYPES = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/></Types>'
)
_RELATIONS = (
    '<?xml version="1.0" encoding="UTF-8"?>\n'
    '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
    '<Relationship Target="/3D/3dmodel.model" Id="rel0" '
    'Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/></Relationships>'
)


def printable(part: Part) -> tuple[Array, Faces]:
    """Return vertices and faces of a part as it is printed, in the single precision of an STL.

    Vertices that single precision cannot tell apart are one, and faces that vanish with them are left out.
    """
    vertices, faces = mesh_of(part.printed)
    single = (np.round(vertices / _GRID) * _GRID).astype("<f4")
    distinct, where = np.unique(single, axis=0, return_inverse=True)
    joined = where.reshape(-1)[faces]
    a, b, c = joined.T
    return distinct.astype(float), joined[(a != b) & (b != c) & (c != a)]


_GRID = 1e-4  # finer than any printer, coarser than single precision at 200 mm [mm]


def stl(part: Part) -> bytes:
    """Return a part as a binary STL [mm]."""
    vertices, faces = printable(part)
    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    records = np.zeros(len(faces), _RECORD)
    records["normal"] = normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-30)[:, None]
    records["corners"] = corners
    return b"softnlp, millimetres".ljust(80) + np.uint32(len(faces)).tobytes() + records.tobytes()


def three_mf(part: Part) -> bytes:
    """Return a part as a 3MF file, whose unit is the millimetre."""
    vertices, faces = printable(part)
    points = "".join(f'<vertex x="{x:.6g}" y="{y:.6g}" z="{z:.6g}"/>' for x, y, z in vertices.tolist())
    sides = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}"/>' for a, b, c in faces.tolist())
    model = (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<model unit="millimeter" xml:lang="en-US" '
        'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02">'
        f'<resources><object id="1" type="model" name={quoteattr(part.name)}><mesh><vertices>{points}</vertices>'
        f'<triangles>{sides}</triangles></mesh></object></resources><build><item objectid="1"/></build></model>'
    )
    packed = BytesIO()
    with ZipFile(packed, "w", ZIP_DEFLATED) as archive:
        for name, text in (
            ("[Content_Types].xml", _TYPES),
            ("_rels/.rels", _RELATIONS),
            ("3D/3dmodel.model", model),
        ):  # a fixed date: the same mould is the same file
            entry = ZipInfo(name, (2020, 1, 1, 0, 0, 0))
            entry.compress_type = ZIP_DEFLATED
            archive.writestr(entry, text)
    return packed.getvalue()


def glb(moulds: Moulds) -> bytes:
    """Return all assemblies as one GLB, exploded: first step, second step and caps beside each other."""
    trimesh: Any = import_module("trimesh")  # of the extra mesh, which was asked for by now
    scene = trimesh.Scene()
    to_metres = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
    to_metres[:3] *= MILLIMETRE

    def add(name: str, solid: Manifold, kind: str, places: list[Array]) -> None:
        vertices, faces = mesh_of(solid)
        mesh = trimesh.Trimesh(vertices, faces, process=False)
        mesh.visual = trimesh.visual.TextureVisuals(material=_material(trimesh, kind))
        for n, place in enumerate(places):
            node = name if len(places) == 1 else f"{name} {n + 1}"
            scene.add_geometry(mesh, node_name=node, geom_name=name, transform=to_metres @ place)

    across = 0.0
    for segment in moulds.segments:
        wide = 3.5 * segment.sizes.flange
        for number in (1, 2):
            for part in segment.step(number):
                name = f"{segment.prefix}step {number} {part.name}"
                add(name, part.solid, part.kind, places_of(part, (across, 0.0, 0.0)))
            if number == 1:
                for n, core in enumerate(segment.cores):
                    shift = np.add(core.parts[-1].apart, (across, 0.0, 0.0))
                    name = f"{segment.prefix}thread {n + 1}"
                    add(name, core.thread, "thread", [_place(turn, (shift[0], 0.0, shift[2])) for turn in core.turns])
            across += wide
        for end, cup in segment.caps.items():
            add(f"{segment.prefix}cap {end}", cup.solid, "cap", [_place(0.0, (across, 0.0, 0.0))])
            across += wide / 2
    for part in moulds.connectors:
        add(part.name, part.solid, part.kind, [_place(0.0, (across, 0.0, 0.0))])
        across += 60.0
    return bytes(scene.export(file_type="glb"))


def places_of(part: Part, offset: tuple[float, float, float], exploded: float = 1.0) -> list[Array]:
    """Return where each instance of a part is drawn, as 4 x 4 transforms [mm]."""
    found = []
    for turn in part.turns:
        own = _place(turn, (0.0, 0.0, 0.0))
        apart = own[:3, :3] @ (exploded * np.asarray(part.apart))
        found.append(_place(turn, tuple(apart + np.asarray(offset))))
    return found


def _place(turn: float, offset: tuple[float, ...]) -> Array:
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    place = np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1.0, 0], [0, 0, 0, 1]])
    place[:3, 3] = offset
    return place


def _material(trimesh: Any, kind: str) -> Any:
    rgba = COLOURS[kind]
    return trimesh.visual.material.PBRMaterial(
        name=kind,
        baseColorFactor=rgba,
        metallicFactor=0.0,
        roughnessFactor=0.7,
        alphaMode="OPAQUE" if rgba[3] == 1 else "BLEND",
    )
