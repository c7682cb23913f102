"""One picture of a robot as plain arrays in millimetres, and as it goes to the browser.

That are a robot's triangles once, then a few kilobytes for each frame; arrays are base64.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softnlp.base.palette import COLOURS, colour
from softnlp.base.units import BAR, MILLIMETRE, NEWTON_MILLIMETRE
from softnlp.figures.mesh import display_mesh, resampled
from softnlp.figures.mesh.display import STATIONS
from softnlp.model.gravity import is_hanging
from softnlp.model.robot import Robot
from softnlp.model.segments import segments_of
from softnlp.results import Body
from softnlp.statics.step import ObstacleContact, SectionRadii
from softnlp.statics.wall import Wall

Array = NDArray[np.float64]

Layout = tuple[tuple[int, tuple[float, ...]], ...]

ARROW = 0.3  # length of every arrow, of L_0; its label says how much
_ROUND = 1.7  # least size of a moment's arrow, of the radius of the body that it goes round
_NOTHING = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Tube:
    """A body at `STATIONS` stations, lengths in mm.

    position : (K, 3). quaternion : (K, 4) as x, y, z, w, unit. radii : of the section, (K,) each where they are not the
    same along it. parts : of several segments each by itself, without the connectors between them.
    """

    position: Array
    quaternion: Array
    radii: SectionRadii
    parts: tuple[Tube, ...] = ()

    @property
    def pieces(self) -> tuple[Tube, ...]:
        """Its segments, itself where there is one."""
        return self.parts or (self,)


@dataclass(frozen=True, eq=False)
class Arrow:
    """A load.

    kind : "force", "moment", "wall", "gravity", or "contact 1" of the first obstacle. start, vector : (3,) [mm]; a
    moment's arrow turns about its vector.
    label : with its size and unit.
    inwards : whether it ends where it acts, so that there is room for the label at its start.
    """

    kind: str
    start: Array
    vector: Array
    label: str
    inwards: bool = False


@dataclass(frozen=True, eq=False)
class Frame:
    """What a `RobotView` shows at one time, lengths in mm.

    robot : gives the layout of the chambers and the natural length. body : the shape. ghost : another, drawn faint.
    pressure_bar : (sets,). arrows : the loads that are not zero. wall : its point nearest to the contact [mm] and its
    unit normal, or None. tip_cap : L_t [mm]. hanging : whether the base is shown on top.
    """

    robot: Robot
    body: Tube
    pressure_bar: Array
    ghost: Tube | None = None
    arrows: tuple[Arrow, ...] = ()
    wall: tuple[Array, Array] | None = None
    tip_cap: float = 0.0
    hanging: bool = False


def frame_of(
    robot: Robot,
    body: Body,
    pressure: ArrayLike,
    *,
    ghost: Body | None = None,
    tip_force: Sequence[float] = _NOTHING,
    tip_moment: Sequence[float] = _NOTHING,
    gravity: Sequence[float] = _NOTHING,
    wall: Wall | None = None,
    wall_force: float = 0.0,
    tip_cap: float = 0.0,
    contacts: Sequence[ObstacleContact] = (),
) -> Frame:
    """Return the frame of a shape.

    Parameters
    ----------
    pressure : (sets,) gauge [Pa].
    ghost : another shape, that without loads for instance.
    tip_force, tip_moment, gravity : as in `softnlp.model.rod.Loads`, world frame [N], [N m], [m/s^2].
    wall : a plane, drawn where the tip is nearest to it. wall_force : how hard it pushes the tip [N].
    tip_cap : L_t, from the tip to where it touches [m].
    contacts : what obstacles do to the body.

    Raises
    ------
    ValueError
        When there is not one pressure for each chamber set.
    """
    bar = np.asarray(pressure, dtype=float) / BAR
    if bar.shape != (robot.chamber_sets,):
        raise ValueError(f"expected {robot.chamber_sets} pressures, one a chamber set, got shape {bar.shape}")
    contact = body.position[-1] + tip_cap * body.rotation[-1, :, 2]
    push = np.zeros(3) if wall is None else wall_force * np.asarray(wall.normal, dtype=float)
    return Frame(
        robot,
        tube_of(body),
        bar,
        None if ghost is None else tube_of(ghost),
        (*_arrows(robot, body, (tip_force, tip_moment, gravity), contact, push), *_pushes(robot, body, contacts)),
        None if wall is None else ((contact - wall.gap(contact) * wall.normal) / MILLIMETRE, wall.normal),
        tip_cap / MILLIMETRE,
        is_hanging(gravity),
    )


def tube_of(body: Body) -> Tube:
    """Return a body at the stations of the view."""
    at = resampled(body, STATIONS)
    chord = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(body.position, axis=0), axis=1)))
    even = np.linspace(0.0, chord[-1], STATIONS)
    radii: dict[str, Any] = {field.name: getattr(body.radii, field.name) / MILLIMETRE for field in fields(body.radii)}
    along = {name: np.interp(even, chord, value) if np.ndim(value) else value for name, value in radii.items()}
    parts = tuple(tube_of(part) for part in body.parts)
    return Tube(at.position / MILLIMETRE, quaternions(at.rotation), SectionRadii(**along), parts)


def _arrows(
    robot: Robot, body: Body, loads: tuple[Sequence[float], ...], contact: Array, push: Array
) -> tuple[Arrow, ...]:
    """Return an arrow for each load that is not zero; one that pushes into the body ends where it acts.

    loads : tip force [N], tip moment [N m], gravity [m/s^2]. contact : where the wall pushes [m]. push : its force [N].
    """
    force, moment, gravity = (np.asarray(load, dtype=float) for load in loads)
    tip = body.position[-1]
    aside = np.array([0.75, 0.0, 0.5]) * robot.length - ARROW / 2 * robot.length * _unit(gravity)
    into_body = bool(force @ body.rotation[-1, :, 2] < 0)
    found = []
    for kind, vector, unit, text, at, inwards in (
        ("force", force, 1.0, "F {:.3g} N", tip, into_body),
        ("moment", moment, NEWTON_MILLIMETRE, "M {:.3g} N mm", tip, False),
        ("gravity", gravity, 1.0, "g {:.3g} m/s²", aside, False),
        ("wall", push, 1.0, "wall {:.3g} N", contact, True),
    ):
        if vector.any():
            length = max(ARROW * robot.length, _ROUND * float(np.max(body.radii.outer)) if kind == "moment" else 0.0)
            step = length / MILLIMETRE * _unit(vector)
            start = at / MILLIMETRE - (step if inwards else 0)
            found.append(Arrow(kind, start, step, text.format(np.linalg.norm(vector) / unit), inwards))
    return tuple(found)


def _pushes(robot: Robot, body: Body, contacts: Sequence[ObstacleContact]) -> list[Arrow]:
    """Return an arrow for what each obstacle pushes with, which ends on the body where it pushes on the mean."""
    chord = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(body.position, axis=0), axis=1)))
    radius = float(np.max(body.radii.outer))
    found = []
    for k, contact in enumerate(contacts):
        size = float(np.linalg.norm(contact.force))
        if contact.start is None or size == 0:
            continue
        weight = np.linalg.norm(contact.forces, axis=1)
        along = float(weight @ contact.arc / weight.sum()) * chord[-1]
        axis = np.array([np.interp(along, chord, component) for component in body.position.T])
        way = contact.force / size
        step = ARROW * robot.length / MILLIMETRE * way
        start = (axis - radius * way) / MILLIMETRE - step
        found.append(Arrow(f"contact {k + 1}", start, step, f"{size:.3g} N", True))
    return found


def _unit(vector: Array) -> Array:
    size = float(np.linalg.norm(vector))
    return vector / size if size > 0 else vector


def quaternions(rotation: Array) -> Array:
    """Return (K, 4) unit quaternions x, y, z, w of (K, 3, 3) rotations."""
    from scipy.spatial.transform import Rotation

    unit: Array = Rotation.from_matrix(rotation).as_quat()
    return unit


def layout_of(robot: Robot) -> Layout:
    """Return what the triangles depend on: sets and chamber angles. Other dimensions come with each frame."""
    return tuple(
        (own.chambers_per_set, tuple(float(theta) for theta in own.chamber_angles())) for own, _ in segments_of(robot)
    )


def pieces_message(robot: Robot) -> dict[str, Any]:
    """Return the triangles of each segment of a robot, base first."""
    return {"pieces": [robot_message(own, before) for own, before in segments_of(robot)], "palette": list(COLOURS)}


def robot_message(robot: Robot, before: int = 0) -> dict[str, Any]:
    """Return the triangles of a robot and what belongs to its sets. before : sets of the segments below it."""
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
        "sets": [{"colour": colour(before + k), "angle": float(np.angle(z))} for k, z in enumerate(middle)],
        "before": before,
        "palette": list(COLOURS),
    }


def frame_message(frame: Frame, number: int, full_bar: float) -> dict[str, Any]:
    """Return a frame; `full_bar` is the pressure at which a chamber has its full colour."""
    return {
        "id": number,
        "length": frame.robot.length / MILLIMETRE,
        "width": frame.robot.outer_diameter / MILLIMETRE,
        "body": tube_message(frame.body),
        "ghost": None if frame.ghost is None else tube_message(frame.ghost),
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


def tube_message(tube: Tube) -> dict[str, Any]:
    """Return a body as it goes to the browser."""
    r = tube.radii
    return {
        "axis": packed(np.column_stack([tube.position, tube.quaternion]), np.float32),
        "circle": _short(r.chamber_circle),
        "radii": [_short(x) for x in (r.outer, r.lumen, r.bore)],
        "parts": [tube_message(part) for part in tube.parts],
    }


def _short(radius: Any) -> Any:
    return np.round(radius, 5).tolist() if np.ndim(radius) else round(float(radius), 5)


def _rounded(vector: NDArray[np.float64], digits: int = 3) -> list[float]:
    return [round(float(x), digits) for x in vector]
