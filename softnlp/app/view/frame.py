"""One picture of a robot as plain arrays in millimetres: what is drawn, apart from how."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softnlp.mesh import resampled
from softnlp.mesh.display import STATIONS
from softnlp.results import Body, ContactView
from softnlp.robot import Robot
from softnlp.studies.step import SectionRadii
from softnlp.units import BAR, MILLIMETRE, NEWTON_MILLIMETRE

Array = NDArray[np.float64]

ARROW = 0.3  # length of every arrow, of L_0; its label says how much
_NOTHING = (0.0, 0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Wall:
    """The wall of a blocked force, SI units.

    point : (3,) of its surface, where it is touched [m]. normal : (3,) unit vector along which it pushes. force : [N].
    """

    point: Array
    normal: Array
    force: float


def wall_of(contact: ContactView, step: int) -> Wall | None:
    """Return the wall of one step (from 0) of a blocked force; None where it has none."""
    if not np.isfinite(contact.normal[step]).all() or not np.isfinite(contact.force[step]):
        return None
    return Wall(contact.wall_point[step], contact.normal[step], float(contact.force[step]))


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
    """

    kind: str
    start: Array
    vector: Array
    label: str


@dataclass(frozen=True, eq=False)
class Frame:
    """What a `RobotView` shows at one time, lengths in mm.

    robot : gives the layout of the chambers and the natural length. body : the shape. ghost : another, drawn faint.
    pressure_bar : (sets,). arrows : the loads that are not zero. wall : (point [mm], normal), or None.
    """

    robot: Robot
    body: Tube
    pressure_bar: Array
    ghost: Tube | None = None
    arrows: tuple[Arrow, ...] = ()
    wall: tuple[Array, Array] | None = None


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
) -> Frame:
    """Return the frame of a shape.

    Parameters
    ----------
    pressure : (sets,) gauge [Pa].
    ghost : another shape, that without loads for instance.
    tip_force, tip_moment, gravity : as in `softnlp.rod.Loads`, world frame [N], [N m], [m/s^2].
    wall : where it is and how hard it pushes.

    Raises
    ------
    ValueError
        When there is not one pressure for each chamber set.
    """
    bar = np.asarray(pressure, dtype=float) / BAR
    if bar.shape != (robot.chamber_sets,):
        raise ValueError(f"expected {robot.chamber_sets} pressures, one a chamber set, got shape {bar.shape}")
    tube = _tube(body)
    return Frame(
        robot,
        tube,
        bar,
        None if ghost is None else _tube(ghost),
        _arrows(robot, body, tip_force, tip_moment, gravity, wall),
        None if wall is None else (np.asarray(wall.point) / MILLIMETRE, np.asarray(wall.normal, dtype=float)),
    )


def _tube(body: Body) -> Tube:
    """Return a body at the stations of the view."""
    at = resampled(body, STATIONS)
    r = at.radii
    scaled = (x / MILLIMETRE for x in (r.outer, r.lumen, r.chamber_circle, r.chamber, r.bore))
    return Tube(at.position / MILLIMETRE, quaternions(at.rotation), SectionRadii(*scaled))


def _arrows(
    robot: Robot,
    body: Body,
    tip_force: Sequence[float],
    tip_moment: Sequence[float],
    gravity: Sequence[float],
    wall: Wall | None,
) -> tuple[Arrow, ...]:
    """Return an arrow for each load; one that pushes into the body ends where it acts, others start there."""
    size = ARROW * robot.length / MILLIMETRE
    tip, outwards = body.position[-1] / MILLIMETRE, body.rotation[-1, :, 2]
    force, moment, weight = (np.asarray(x, dtype=float) for x in (tip_force, tip_moment, gravity))
    found = []
    if (F := float(np.linalg.norm(force))) > 0:
        vector = size * force / F
        start = tip - vector if vector @ outwards < 0 else tip
        found.append(Arrow("force", start, vector, f"F {F:.3g} N"))
    if (M := float(np.linalg.norm(moment))) > 0:
        found.append(Arrow("moment", tip, size * moment / M, f"M {M / NEWTON_MILLIMETRE:.3g} N mm"))
    if (g := float(np.linalg.norm(weight))) > 0:
        aside = np.array([0.75, 0.0, 0.5]) * robot.length / MILLIMETRE
        vector = size * weight / g
        found.append(Arrow("gravity", aside - vector / 2, vector, f"g {g:.3g} m/s²"))
    if wall is not None and wall.force > 0:
        vector = size * np.asarray(wall.normal, dtype=float)
        label = f"F_b {wall.force:.3g} N"
        found.append(Arrow("wall", np.asarray(wall.point) / MILLIMETRE - vector, vector, label))
    return tuple(found)


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
