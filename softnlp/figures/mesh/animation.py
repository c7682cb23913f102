"""A run as an animated GLB: one solid a segment whose vertices move from step to step, by glTF's morph targets.

Triangles are those of the first step; each other step is a target, and what is between two of them is linear in time.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.arrays import Array
from softnlp.base.errors import InputError
from softnlp.base.units import MILLIMETRE
from softnlp.figures.mesh.solid import SILICONE, Solid, require, segment_solids
from softnlp.model.robot import Robot
from softnlp.results import Body, write_whole

FACETS, STATIONS = 32, 25
MOST = 60  # frames of a file
_FLOAT, _UINT, _VERTICES, _INDICES = 5126, 5125, 34962, 34963
_ROOT = np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1 / MILLIMETRE]]) * MILLIMETRE


def frames_of(solved: Sequence[int], most: int = MOST) -> list[int]:
    """Return so many of the solved steps at most, evenly spread, the first and the last among them."""
    chosen = np.unique(np.linspace(0, len(solved) - 1, min(most, len(solved))).round().astype(int))
    return [solved[int(k)] for k in chosen]


def write_animation(
    robot: Robot, bodies: Sequence[Body], times: Array, path: str | PathLike[str], facets: int = FACETS
) -> Path:
    """Write the bodies of a run at their times [s] as an animated GLB, whole; return its path.

    Raises
    ------
    InputError
        Without the extra `mesh`, for less than two bodies, a shape that is no solid, or a file that cannot be written.
    """
    require(facets)
    if len(bodies) < 2:
        raise InputError("expected at least two solved steps to move between")
    first = segment_solids(robot, bodies[0], facets, STATIONS)
    moved = [[solid.vertices for solid in segment_solids(robot, body, facets, STATIONS)] for body in bodies[1:]]
    return write_whole(path, _glb(first, moved, np.asarray(times, float)))


class _Buffer:
    """The binary part of a GLB and what says how it is read."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, values: NDArray[Any], kind: str, target: int | None = None, *, limits: bool = True) -> int:
        """Add an array, and return the number of its accessor."""
        whole = np.issubdtype(values.dtype, np.integer)
        stored = np.ascontiguousarray(values, np.uint32 if whole else np.float32)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": stored.nbytes}
        self.views.append(view if target is None else {**view, "target": target})
        self.data += stored.tobytes()
        rows = stored.reshape(len(stored), -1)
        accessor: dict[str, Any] = {"bufferView": len(self.views) - 1, "count": len(stored), "type": kind}
        accessor["componentType"] = _UINT if whole else _FLOAT
        if limits:
            accessor |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.accessors.append(accessor)
        return len(self.accessors) - 1


def _glb(first: Sequence[Solid], moved: Sequence[Sequence[Array]], times: Array) -> bytes:
    """Return the file. moved : the vertices of each solid in each later frame."""
    buffer, targets = _Buffer(), len(moved)
    input_ = buffer.add(times - times[0], "SCALAR")
    # frame k is target k - 1 alone
    weights = buffer.add(np.eye(targets + 1, targets, -1).ravel(), "SCALAR", limits=False)
    meshes, nodes = [], []
    for k, solid in enumerate(first):
        faces = buffer.add(solid.faces.ravel(), "SCALAR", _INDICES)
        base = buffer.add(solid.vertices, "VEC3", _VERTICES)
        shifts = [buffer.add(frame[k] - solid.vertices, "VEC3", _VERTICES) for frame in moved]
        primitive = {"attributes": {"POSITION": base}, "indices": faces, "material": 0}
        primitive["targets"] = [{"POSITION": shift} for shift in shifts]
        meshes.append({"name": solid.name, "primitives": [primitive], "weights": [0.0] * targets})
        nodes.append({"name": solid.name, "mesh": k})
    count = len(nodes)
    channels = [{"sampler": 0, "target": {"node": k, "path": "weights"}} for k in range(count)]
    nodes.append({"name": "robot", "children": list(range(count)), "matrix": _ROOT.T.ravel().tolist()})
    material = {"baseColorFactor": [*SILICONE[:3], 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.7}
    document = {
        "asset": {"version": "2.0", "generator": "softnlp"},
        "scene": 0,
        "scenes": [{"nodes": [count]}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [{"name": "silicone", "pbrMetallicRoughness": material, "doubleSided": True}],
        "animations": [
            {
                "name": "run",
                "samplers": [{"input": input_, "output": weights, "interpolation": "LINEAR"}],
                "channels": channels,
            }
        ],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    binary = bytes(buffer.data) + b"\0" * (-len(buffer.data) % 4)
    parts = [(text, b"JSON"), (binary, b"BIN\0")]
    body = b"".join(np.uint32(len(part)).tobytes() + kind + part for part, kind in parts)
    return b"glTF" + np.array([2, 12 + len(body)], np.uint32).tobytes() + body
