"""One picture of a robot as plain arrays in millimetres: what is drawn, apart from how."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softnlp.base.units import BAR, MILLIMETRE, NEWTON_MILLIMETRE
from softnlp.figures.mesh import resampled
from softnlp.figures.mesh.display import STATIONS
from softnlp.model.gravity import is_hanging
from softnlp.model.robot import Robot
from softnlp.results import Body
from softnlp.statics.step import SectionRadii
from softnlp.statics.wall import Wall

Array = NDArray[np.float64]

ARROW = 0.3  # length of every arrow, of L_0; its label says how much
_NOTHING = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Tube:
    """A body at `STATIONS` stations, lengths in mm.

    position : (K, 3). quaternion : (K, 4) as x, y, z, w, unit. radii : of the section, in mm.
    """

    position: Array
    quaternion: Array
    radii: SectionRadii


@dataclass(frozen=True, eq=False)
class Arrow:
    """A load.

    kind : "force", "moment", "wall" or "gravity". start, vector : (3,) [mm]. label : with its size and unit.
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
) -> Frame:
    """Return the frame of a shape.

    Parameters
    ----------
    pressure : (sets,) gauge [Pa].
    ghost : another shape, that without loads for instance.
    tip_force, tip_moment, gravity : as in `softnlp.model.rod.Loads`, world frame [N], [N m], [m/s^2].
    wall : a plane, drawn where the tip is nearest to it. wall_force : how hard it pushes the tip [N].
    tip_cap : L_t, from the tip to where it touches [m].

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
        _tube(body),
        bar,
        None if ghost is None else _tube(ghost),
        _arrows(robot, body, (tip_force, tip_moment, gravity), contact, push),
        None if wall is None else ((contact - wall.gap(contact) * wall.normal) / MILLIMETRE, wall.normal),
        tip_cap / MILLIMETRE,
        is_hanging(gravity),
    )


def _tube(body: Body) -> Tube:
    """Return a body at the stations of the view."""
    at = resampled(body, STATIONS)
    r = at.radii
    scaled = (x / MILLIMETRE for x in (r.outer, r.lumen, r.chamber_circle, r.chamber, r.bore))
    return Tube(at.position / MILLIMETRE, quaternions(at.rotation), SectionRadii(*scaled))


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
            step = ARROW * robot.length / MILLIMETRE * _unit(vector)
            start = at / MILLIMETRE - (step if inwards else 0)
            found.append(Arrow(kind, start, step, text.format(np.linalg.norm(vector) / unit), inwards))
    return tuple(found)


def _unit(vector: Array) -> Array:
    size = float(np.linalg.norm(vector))
    return vector / size if size > 0 else vector


def quaternions(rotation: Array) -> Array:
    """Return (K, 4) unit quaternions x, y, z, w of (K, 3, 3) rotations, by the largest of the four."""
    R = rotation
    t = np.array([R[:, 0, 0], R[:, 1, 1], R[:, 2, 2]])
    # Row k is 4 q_k (x, y, z, w); the row of the largest q_k is divided by the least rounding.
    xy, xz, yz = R[:, 0, 1] + R[:, 1, 0], R[:, 0, 2] + R[:, 2, 0], R[:, 1, 2] + R[:, 2, 1]
    wx, wy, wz = R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]
    rows = np.array(
        [
            [1 + t[0] - t[1] - t[2], xy, xz, wx],
            [xy, 1 - t[0] + t[1] - t[2], yz, wy],
            [xz, yz, 1 - t[0] - t[1] + t[2], wz],
            [wx, wy, wz, 1 + t[0] + t[1] + t[2]],
        ]
    )
    largest = np.argmax([rows[k, k] for k in range(4)], axis=0)
    q = rows[largest, :, np.arange(len(R))]
    unit: Array = q / np.linalg.norm(q, axis=1, keepdims=True)
    return unit
