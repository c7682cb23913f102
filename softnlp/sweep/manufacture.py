"""Rules of manufacture for many robots at once; `softnlp.model.robot.check` words what the first of them breaks."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.arrays import Array
from softnlp.base.errors import RobotError
from softnlp.model.robot import DIMENSIONS, LENGTH_LIMITS, ROUND_OFF, Robot, check

_BLOCK = 65_536
_MARGIN = 1e-12  # suspects are looked at again one by one [m]


def check_many(robot: Robot, varied: Mapping[str, Array], *, allow: Collection[str], minimum_wall: float) -> None:
    """Refuse a robot whose varied dimensions make it one that cannot be made.

    Parameters
    ----------
    varied : by `Robot` field, (robots,) SI; the other dimensions are those of `robot`.
    allow, minimum_wall : as in `softnlp.model.robot.check`.

    Raises
    ------
    RobotError
        For the first robot that breaks a rule that is not allowed.
    """
    count = next(iter(varied.values())).size
    for start in range(0, count, _BLOCK):
        part: dict[str, Any] = {name: values[start : start + _BLOCK] for name, values in varied.items()}
        for k in np.flatnonzero(_suspect(replace(robot, **part), allow, minimum_wall)):
            one: dict[str, Any] = {name: float(values[k]) for name, values in part.items()}
            try:
                check(replace(robot, **one), allow=allow, minimum_wall=minimum_wall)
            except RobotError as error:
                raise RobotError(f"{_shown(one)}: {error.message}") from None


def _shown(dimensions: Mapping[str, float]) -> str:
    """Return the varied dimensions of one robot as a scenario would give them."""
    given = [(d.file_key, d.scale, dimensions[d.field]) for d in DIMENSIONS if d.field in dimensions]
    return ", ".join(f"{key} = {value / (scale or 1.0):.6g}" for key, scale, value in given)


def _suspect(robots: Robot, allow: Collection[str], minimum_wall: float) -> NDArray[np.bool_]:
    """Return which robots, given as one with arrays for dimensions, may break a rule."""
    lengths = (
        *(robots.outer_diameter, robots.lumen_diameter, robots.chamber_circle_diameter),
        *(robots.chamber_diameter, robots.chamber_wall, robots.length),
    )
    low, high = LENGTH_LIMITS
    angle = np.asarray(robots.chamber_angle)
    suspect = (angle < 0) | (angle > 2 * np.pi)
    if robots.chambers_per_set > 1:
        suspect = suspect | (angle == 0)
    for length in lengths:
        suspect = suspect | ~((np.asarray(length) >= low) & (np.asarray(length) <= high))
    limit = ROUND_OFF - _MARGIN
    suspect = suspect | (robots.lumen_radius >= robots.outer_radius - ROUND_OFF - _MARGIN)
    if "wall_thickness" not in allow:
        suspect = suspect | (robots.chamber_wall + robots.outer_wall < minimum_wall - limit)
    if "chamber_overlap" not in allow and robots.chambers > 1:
        suspect = suspect | (_shortest_chord(robots) < 2 * robots.chamber_radius - limit)
    suspect = suspect | (robots.chamber_circle_radius + robots.chamber_radius > robots.outer_radius + limit)
    suspect = suspect | (robots.chamber_circle_radius - robots.chamber_radius < robots.lumen_radius - limit)
    return np.atleast_1d(suspect)


def _shortest_chord(robots: Robot) -> Array:
    """Return the least distance of neighbouring chamber centres of each robot [m]."""
    angles = np.sort(np.stack(np.broadcast_arrays(*robots.chamber_angles()), axis=-1) % (2 * np.pi), axis=-1)
    turns = np.diff(angles, axis=-1, append=angles[..., :1] + 2 * np.pi)
    return np.asarray(2 * robots.chamber_circle_radius * np.abs(np.sin(turns / 2)).min(axis=-1))
