"""Where chambers go in a section of which only the sizes are known: circle and angle, and what else can be made."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from functools import partial
from math import asin, inf, pi, sin
from typing import Any

from softnlp.base.errors import RobotError
from softnlp.base.units import MILLIMETRE
from softnlp.model.robot import DIMENSIONS, MINIMUM_WALL, ROUND_OFF, Robot, metres_hint, require_dimensions
from softnlp.model.rules import in_mm, rules

_FAR = 1.0  # [m], beyond what is made of silicone
_CLOSE = 1e-9  # of a size, to which its limit is found
_PLACES = 120  # at which a value that can be made is looked for
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


def free_ranges(robot: Robot, minimum_wall: float = MINIMUM_WALL, allowed: Collection[str] = ()) -> dict[str, Limits]:
    """Return between what each dimension of a robot may be changed alone, all others as they are.

    By field of `Robot`, [m, rad]; a limit that nothing sets is 0 or infinite. Empty for a robot that breaks a rule.

    minimum_wall : delta_s [m]. allowed : rules of manufacture that do not count.
    """
    found = {}
    for field, highest in _changed_alone(robot):
        now, made = float(getattr(robot, field)), partial(_is_made, robot, minimum_wall, allowed, field)
        if made(now):
            low, high = (_last(made, now, far) for far in (0.0, highest))
            found[field] = (max(low, 0.0), high if high < highest else inf)
    return found


def mends(robot: Robot, minimum_wall: float = MINIMUM_WALL, allowed: Collection[str] = ()) -> dict[str, float]:
    """Return the dimensions that mend a robot alone, each with its nearest value that can be made [m, rad].

    By field of `Robot`; empty where none does. minimum_wall, allowed : as `free_ranges`.
    """
    found = {}
    for field, highest in _changed_alone(robot):
        now, made = float(getattr(robot, field)), partial(_is_made, robot, minimum_wall, allowed, field)
        far = min(highest, 4 * now)
        places = [far * (k + 0.5) / _PLACES for k in range(_PLACES)]
        good = min((x for x in places if made(x)), key=lambda x: abs(x - now), default=None)
        if good is not None and not made(now):
            found[field] = _last(made, good, now)
    return found


def _changed_alone(robot: Robot) -> list[tuple[str, float]]:
    """Return the dimensions that rules depend on, each with a value that is too large for any [m, rad]."""
    names = [d.field for d in DIMENSIONS if d.scale is not None and d.field not in ("length", "chamber_angle")]
    meet = robot.chamber_sets * (robot.chambers_per_set - 1)  # sets do, at 2 pi over it
    return [*((name, _FAR) for name in names), *([("chamber_angle", 2 * pi / meet)] if meet else [])]


def _is_made(robot: Robot, minimum_wall: float, allowed: Collection[str], field: str, value: float) -> bool:
    """Whether a robot with another value of one dimension keeps the rules."""
    change: dict[str, Any] = {field: value}
    every = rules(replace(robot, **change), minimum_wall)
    return all(rule.value >= rule.least - ROUND_OFF for rule in every if rule.name not in allowed)


def _last(is_made: Callable[[float], bool], good: float, far: float) -> float:
    """Return the last value on the way from a good one to a far one that is good, by halving."""
    if is_made(far):
        return far
    bad = far
    while abs(bad - good) > _CLOSE * abs(good):
        middle = (good + bad) / 2
        good, bad = (middle, bad) if is_made(middle) else (good, middle)
    return good


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
