"""What goes to the browser: a robot's triangles once, then a few kilobytes for each frame; arrays are base64."""

from __future__ import annotations

from base64 import b64encode
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.app.view.frame import Frame, Tube
from softnlp.base.palette import COLOURS, colour
from softnlp.base.units import MILLIMETRE
from softnlp.figures.mesh import display_mesh
from softnlp.model.robot import Robot

Layout = tuple[int, tuple[float, ...]]


def layout_of(robot: Robot) -> Layout:
    """Return what the triangles depend on: sets and chamber angles. Other dimensions come with each frame."""
    return robot.chambers_per_set, tuple(float(theta) for theta in robot.chamber_angles())


def robot_message(robot: Robot) -> dict[str, Any]:
    """Return the triangles of a robot and what belongs to its sets."""
    mesh = display_mesh(robot)
    wide = len(mesh.station) > np.iinfo(np.uint16).max
    index = np.uint32 if wide else np.uint16
    angles = np.array([float(theta) for theta in robot.chamber_angles()])
    sets = np.array(robot.set_of_chamber)
    middle = [np.exp(1j * angles[sets == k]).mean() for k in range(robot.chamber_sets)]
    return {
        "station": packed(mesh.station, np.uint16),
        "centre": packed(mesh.centre, np.float32),
        "around": packed(mesh.around, np.float32),
        "radius": packed(mesh.radius, np.uint8),
        "normal": packed(127 * mesh.normal, np.int8),
        "wide": wide,
        "parts": [
            {
                "kind": part.kind,
                "set": None if part.chamber is None else robot.set_of_chamber[part.chamber],
                "faces": packed(part.faces + part.first, index),
            }
            for part in mesh.parts
        ],
        "sets": [{"colour": colour(k), "angle": float(np.angle(z))} for k, z in enumerate(middle)],
        "palette": list(COLOURS),
    }


def frame_message(frame: Frame, number: int, full_bar: float) -> dict[str, Any]:
    """Return a frame; `full_bar` is the pressure at which a chamber has its full colour."""
    return {
        "id": number,
        "length": frame.robot.length / MILLIMETRE,
        "width": frame.robot.outer_diameter / MILLIMETRE,
        "body": _tube(frame.body),
        "ghost": None if frame.ghost is None else _tube(frame.ghost),
        "level": np.clip(frame.pressure_bar / full_bar, 0, 1).round(4).tolist(),
        "arrows": [
            {
                "kind": a.kind,
                "start": _rounded(a.start),
                "vector": _rounded(a.vector),
                "label": a.label,
                "inwards": a.inwards,
            }
            for a in frame.arrows
        ],
        "cap": round(frame.tip_cap, 3),
        "hanging": frame.hanging,
        "wall": None
        if frame.wall is None
        else {"point": _rounded(frame.wall[0]), "normal": _rounded(frame.wall[1], digits=6)},
    }


def cloud_message(points: NDArray[Any] | None, colours: NDArray[Any] | None) -> dict[str, Any] | None:
    """Return points [mm] and their colours 0 to 1 (grey without); those that are not finite are left out.

    Raises
    ------
    ValueError
        When a shape is not (n, 3), or the two differ.
    """
    if points is None:
        return None
    xyz = np.asarray(points, dtype=float)
    rgb = np.full(xyz.shape, 0.5) if colours is None else np.asarray(colours, dtype=float)
    if xyz.ndim != 2 or xyz.shape[1] != 3 or rgb.shape != xyz.shape:
        raise ValueError(f"expected points and colours of shape (n, 3), got {xyz.shape} and {rgb.shape}")
    known = np.isfinite(xyz).all(axis=1)
    return {
        "points": packed(xyz[known], np.float32),
        "colours": packed(255 * np.clip(rgb[known], 0, 1), np.uint8),
    }


def packed(values: NDArray[Any], kind: type[np.generic]) -> str:
    """Return an array as base64 of little-endian numbers of a kind; whole numbers are rounded to."""
    array = np.asarray(values)
    if np.issubdtype(kind, np.integer) and not np.issubdtype(array.dtype, np.integer):
        array = np.rint(array)
    return b64encode(np.ascontiguousarray(array, dtype=np.dtype(kind).newbyteorder("<")).tobytes()).decode()


def _tube(tube: Tube) -> dict[str, Any]:
    r = tube.radii
    return {
        "axis": packed(np.column_stack([tube.position, tube.quaternion]), np.float32),
        "circle": round(r.chamber_circle, 5),
        "radii": [round(x, 5) for x in (r.outer, r.lumen, r.bore)],
    }


def _rounded(vector: NDArray[np.float64], digits: int = 3) -> list[float]:
    return [round(float(x), digits) for x in vector]
