"""Where chambers go in a section of which only the sizes are known: circle and angle, and what else can be made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import asin, inf, pi, sin

from softnlp.base.errors import RobotError
from softnlp.base.units import MILLIMETRE
from softnlp.model.robot import DIMENSIONS, MINIMUM_WALL, ROUND_OFF, Robot, metres_hint, require_dimensions
from softnlp.model.rules import in_mm

_WALL, _LENGTH = 0.5 * MILLIMETRE, 60 * MILLIMETRE  # of the library's robots
Limits = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Fit:
    """A robot whose chambers are in the middle of its wall, evenly around.

    robot : it. limits : by the field of `Robot`, between which one dimension may be changed alone [m, rad]; circle and
    angle follow the diameters, and stay where one of them is changed. A limit that nothing sets is 0 or infinite.
    """

    robot: Robot
    limits: Mapping[str, Limits]


def fit_robot(
    outer_diameter: float,
    lumen_diameter: float,
    chamber_diameter: float,
    chamber_sets: int = 3,
    chambers_per_set: int = 2,
    *,
    chamber_wall: float = _WALL,
    length: float = _LENGTH,
    minimum_wall: float = MINIMUM_WALL,
) -> Fit:
    """Return the robot of some sizes [m] with its chambers where they have most room, and what else can be made.

    Raises
    ------
    RobotError
        Where no robot of these sizes can be made, with the sizes that mend it.
    """
    n, r_co = chamber_sets * chambers_per_set, chamber_diameter / 2 + chamber_wall
    circle, angle = (outer_diameter + lumen_diameter) / 2, 2 * pi / max(n, 1)
    made = Robot(
        *("fitted", outer_diameter, lumen_diameter, circle, chamber_diameter, chamber_wall, length),
        *(chamber_sets, chambers_per_set, angle),
    )
    require_dimensions(made)
    share = sin(pi / n) if n > 1 else inf  # of the circle's radius, for a chamber
    wall, both = 2 * chamber_diameter + 4 * minimum_wall, outer_diameter - lumen_diameter
    limits = {
        "outer_diameter": (max(lumen_diameter + max(wall, 4 * r_co), 4 * r_co / share - lumen_diameter), inf),
        "lumen_diameter": (max(4 * r_co / share - outer_diameter, 0.0), outer_diameter - max(wall, 4 * r_co)),
        "chamber_diameter": (
            0.0,
            min(both / 2 - 2 * max(minimum_wall, chamber_wall), (circle * share) - 2 * chamber_wall),
        ),
    }
    _require(made, limits)
    touching = 2 * asin(min(r_co / (circle / 2), 1.0))
    least = max(lumen_diameter + 2 * r_co, 2 * r_co / share)
    limits["chamber_circle_diameter"] = (least, outer_diameter - 2 * r_co)
    if chambers_per_set > 1:
        limits["chamber_angle"] = (touching, (2 * pi / chamber_sets - touching) / (chambers_per_set - 1))
    return Fit(made, limits)


def _require(robot: Robot, limits: Mapping[str, Limits]) -> None:
    """Raise `RobotError` where a size is beyond its limits, with how far, and every size that would mend it alone."""
    short = limits["outer_diameter"][0] - robot.outer_diameter
    if short <= ROUND_OFF:
        return
    ways = [f"outer diameter at least {in_mm(limits['outer_diameter'][0])}"]
    for name, words in (("chamber_diameter", "bore"), ("lumen_diameter", "lumen")):
        low, high = limits[name]
        if high > low:
            now = getattr(robot, name)
            ways.append(f"{words} {f'at most {in_mm(high)}' if now > high else f'at least {in_mm(low)}'}")
    *others, last = ways
    told = f"{', '.join(others)} or {last}" if others else last
    raise RobotError(f"{in_mm(short)} too little wall for {robot.chambers} chambers: {told}{metres_hint(robot)}")


def fit_rows(found: Fit) -> list[list[str]]:
    """Return a row for each dimension: its key, its value in the unit of the key, and between what it may be."""
    rows = []
    for d in DIMENSIONS:
        scale = d.scale or 1
        low, high = found.limits.get(d.field, (0.0, inf))
        ends = ["-" if not 0 < end < inf else f"{round(end / scale, 6):g}" for end in (low, high)]
        rows.append([d.file_key, f"{round(getattr(found.robot, d.field) / scale, 6):g}", *ends])
    return rows
