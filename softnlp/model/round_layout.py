"""Chambers that are given one by one and make a round layout, turned or not."""

from __future__ import annotations

from cmath import phase
from dataclasses import replace
from math import atan2, hypot, pi

from softnlp.model.outlined import Chamber, OutlinedRobot
from softnlp.model.plane import Circle, turned
from softnlp.model.robot import Robot

_SAME = 1e-9  # places closer than this are of the round layout [m]


def as_round(robot: OutlinedRobot) -> Robot | None:
    """Return the round layout that has these chambers in the same order, None where there is none."""
    circles = [c.form for c in robot.chamber_list if isinstance(c.form, Circle)]
    first, sets = robot.chamber_list[0], robot.chamber_sets
    per_set, rest = divmod(robot.chambers, sets)
    plain = isinstance(robot.surface, Circle) and robot.reinforcement == "chamber" and robot.lumen is not None
    if len(circles) < robot.chambers or rest or not plain:
        return None
    r_cp = hypot(*circles[0].centre)
    angles = [atan2(circle.y, circle.x) for circle in circles]
    alpha = (angles[1] - angles[0]) % (2 * pi) if per_set > 1 else 0.0
    made = Robot(
        robot.name, robot.outer_diameter, robot.lumen_diameter, 2 * r_cp, 2 * circles[0].radius, first.wall,
        robot.length, sets, per_set, alpha,
    )  # fmt: skip
    same = made.set_of_chamber == robot.set_of_chamber and all(
        hypot(float(x) - circle.x, float(y) - circle.y) < _SAME
        and abs(circle.radius - circles[0].radius) < _SAME
        and abs(chamber.wall - first.wall) < _SAME
        for (x, y), circle, chamber in zip(made.chamber_centres(), circles, robot.chamber_list, strict=True)
    )
    return made if same else None


def turned_round(robot: OutlinedRobot) -> Robot | None:
    """Return the round layout whose section this one's is, turned about the axis and its sets in any order, or None."""
    circles = [c.form for c in robot.chamber_list if isinstance(c.form, Circle)]
    sets, per_set = robot.chamber_sets, robot.chambers // robot.chamber_sets
    if len(circles) < robot.chambers:
        return None
    middles = [
        sum(complex(circle.x, circle.y) for circle, own in zip(circles, robot.set_of_chamber, strict=True) if own == k)
        for k in range(sets)
    ]
    if min(map(abs, middles)) < _SAME:
        return None
    turn = phase(middles[0])
    order = sorted(range(sets), key=lambda k: (phase(middles[k]) - turn + _SAME) % (2 * pi))
    wide = pi / sets - _SAME  # of a set to one side of its middle
    moved = list[tuple[int, float, Chamber]]()
    for circle, chamber in zip(circles, robot.chamber_list, strict=True):
        own = order.index(chamber.set)
        (x, y), *_ = turned([circle.centre], -turn).corners
        at = (atan2(y, x) - 2 * pi * own / sets + pi) % (2 * pi)
        moved.append((own, at, Chamber(own, Circle(x, y, circle.radius), chamber.wall)))
    if any(abs(at - pi) > wide for _, at, _ in moved) and per_set > 1:
        return None
    every = tuple(chamber for *_, chamber in sorted(moved, key=lambda entry: entry[:2]))
    return as_round(replace(robot, chamber_list=every))
