"""What can be made: each rule of manufacture as value >= least, for robots of numbers and of symbols (model section 1).

`softnlp.robot` refuses by them what is read; a design keeps to them as rows of its program, and judges by them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import pi, sin
from types import MappingProxyType
from typing import Any

import casadi as ca

from softnlp.base.units import MILLIMETRE

RULES = ("wall_thickness", "chamber_overlap", "chambers_inside_wall")
LOWERABLE_RULES = RULES[:2]
SELF_INTERSECTION = "self_intersection"
"""Allowed, answers of inverse kinematics and design may be shapes that no body takes without passing through itself."""
ALLOWABLE = (*LOWERABLE_RULES, SELF_INTERSECTION)
ROUND_OFF = 1e-9  # lengths closer than this are equal: published dimensions meet their rules exactly [m]


@dataclass(frozen=True)
class Violation:
    """A rule of manufacture that a robot breaks.

    rule : "wall_thickness", "chamber_overlap" or "chambers_inside_wall". message : the rule and its numbers in mm,
    chambers counted from 1. lowerable : whether it may be lowered to a warning. chambers : those concerned, counted
    from 0 as in `Robot.chamber_centres`.
    """

    rule: str
    message: str
    lowerable: bool
    chambers: tuple[int, ...]


def neighbours(robot: Any) -> list[tuple[Any, int, int]]:
    """Return (chord between centres [m], chamber, next chamber) once around the circle, last to first included.

    The chambers are sorted by angle first: with a large alpha_1 those of different sets interleave. Of an angle that is
    a symbol they are taken not to, and one pair of each kind stands for all: within a set, and from one to the next.
    """
    n1, n2, r_cp = robot.chamber_sets, robot.chambers_per_set, robot.chamber_circle_radius
    if isinstance(robot.chamber_angle, ca.MX | ca.SX):
        apart = [(robot.chamber_angle, 0, 1)] if n2 > 1 else []
        if n1 > 1 or n2 > 2:
            apart.append((2 * pi / n1 - (n2 - 1) * robot.chamber_angle, n2 - 1, n2 % robot.chambers))
        return [(2 * r_cp * ca.sin(angle / 2), i, j) for angle, i, j in apart]
    angles = [theta % (2 * pi) for theta in robot.chamber_angles()]
    order = sorted(range(robot.chambers), key=angles.__getitem__)
    pairs = list(pairwise(order))
    if robot.chambers > 2:
        pairs.append((order[-1], order[0]))
    return [(2 * r_cp * abs(sin((angles[j] - angles[i]) / 2)), i, j) for i, j in pairs]


@dataclass(frozen=True, eq=False)
class Rule:
    """A rule of manufacture for one place of a robot: value >= least.

    name : one of `RULES`. row : its name as a limit. value, least : [m], numbers or symbols. words : what a robot of
    numbers that breaks it does. chambers : those concerned.
    """

    name: str
    row: str
    value: Any
    least: float
    words: Callable[[], str]
    chambers: tuple[int, ...]


def rules(robot: Any, minimum_wall: float, walls: Mapping[str, bool] = MappingProxyType({})) -> list[Rule]:
    """Return every rule of manufacture of a robot, of numbers or symbols.

    minimum_wall : delta_s [m]. walls : of "outer_wall" and "inner_wall", what searches have to keep beside Eq. (1),
    which takes the chambers to be in the middle. One that a choice moves (True) leaves delta_s of silicone outside the
    threads; of one that is given, the layer inside the thread counts, as it does in Eq. (1).
    """
    outer, inner = robot.side_walls
    r_cp, r_co, every = robot.chamber_circle_radius, robot.chamber_radius, tuple(range(robot.chambers))
    mean, sides = robot.chamber_wall + robot.outer_wall, {"outer_wall": outer, "inner_wall": inner}

    def thin(name: str, moved: bool) -> Rule:
        value = sides[name] + (0.0 if moved else robot.chamber_wall)

        def words() -> str:
            place, wall = "threads" if moved else "bores", name.replace("_", " ")
            short = f"{in_mm(minimum_wall - value)} below minimum_wall_mm = {in_mm(minimum_wall)}"
            return f"the {wall} beside the {place} is {in_mm(value)}, {short}"

        return Rule("wall_thickness", name, value, minimum_wall, words, every)

    def close(chord: Any, i: int, j: int) -> Rule:
        def words() -> str:
            apart = f"neighbouring chambers {i + 1} and {j + 1} are {in_mm(chord)} apart"
            ways = [f"chamber circle at least {in_mm(4 * r_cp * r_co / chord)}"] if chord > ROUND_OFF else []
            bore = chord - 2 * robot.chamber_wall
            ways += [f"bore at most {in_mm(bore)}"] if bore > ROUND_OFF else []
            mend = f" ({' or '.join(ways)})" if ways else ""
            return f"the centres of {apart}, less than 2 r_co = {in_mm(2 * r_co)}{mend}"

        return Rule("chamber_overlap", "chamber_overlap", chord - 2 * r_co, 0.0, words, (i, j))

    def leaves(value: Any, words: Callable[[], str]) -> Rule:
        return Rule("chambers_inside_wall", "chambers_inside_wall", value, 0.0, words, every)

    def eq_1() -> str:
        sides = "Eq. (1) leaves delta_c + delta_r = (D_r - D_i - 2 D_c)/4"
        D_r, D_i, D_c = robot.outer_diameter, robot.lumen_diameter, robot.chamber_diameter
        short = 4 * (minimum_wall - mean)  # of a diameter
        ways = [f"outer diameter at least {in_mm(D_r + short)}"]
        ways += [f"bore at most {in_mm(D_c - short / 2)}"] if D_c > short / 2 else []
        ways += [f"lumen at most {in_mm(D_i - short)}"] if D_i > short else []
        mend = f"{in_mm(short)} too little: {' or '.join(ways)}"
        return f"{sides} = {in_mm(mean)} of wall, less than the minimum {in_mm(minimum_wall)}; {mend}"

    return [
        Rule("wall_thickness", "wall_thickness", mean, minimum_wall, eq_1, every),
        *(thin(name, moved) for name, moved in walls.items()),
        *(close(*pair) for pair in neighbours(robot)),
        leaves(
            outer,
            lambda: (
                f"reach r_cp + r_co = {in_mm(r_cp + r_co)}, beyond the outer radius {in_mm(robot.outer_radius)} "
                f"(outer diameter at least {in_mm(2 * (r_cp + r_co))} or chamber circle at most "
                f"{in_mm(2 * (robot.outer_radius - r_co))})"
            ),
        ),
        leaves(
            inner,
            lambda: (
                f"begin at r_cp - r_co = {in_mm(r_cp - r_co)}, inside the lumen radius {in_mm(robot.lumen_radius)} "
                f"(chamber circle at least {in_mm(2 * (robot.lumen_radius + r_co))} or lumen at most "
                f"{in_mm(2 * max(r_cp - r_co, 0.0))})"
            ),
        ),
    ]


def broken(rules: Iterable[Rule]) -> tuple[Violation, ...]:
    """Return what a robot of numbers breaks, one entry for each name."""
    found: dict[str, list[Rule]] = {}
    for rule in rules:
        if rule.value < rule.least - ROUND_OFF:
            found.setdefault(rule.name, []).append(rule)
    return tuple(_violation(name, places) for name, places in found.items())


def _violation(name: str, broken: Sequence[Rule]) -> Violation:
    """Word one broken rule in all its places."""
    if name == "chamber_overlap":
        more = f" (and {len(broken) - 1} more pairs)" if len(broken) > 1 else ""
        message = min(broken, key=lambda r: r.value).words() + more
    else:
        message = "the reinforced chambers " * (name == "chambers_inside_wall") + " and ".join(
            r.words() for r in broken
        )
    return Violation(name, message, name in LOWERABLE_RULES, tuple(sorted({n for r in broken for n in r.chambers})))


def in_mm(length: float) -> str:
    """Format a length with as many digits as a drawing needs."""
    return f"{round(length / MILLIMETRE, 6):.6g} mm"
