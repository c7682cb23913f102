"""What is wrong with a robot in plain words, with the sizes that mend it, and between what each size may be."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from math import inf

from softnlp.base.units import DEGREE, MILLIMETRE
from softnlp.model.fit import free_ranges, mends
from softnlp.model.robot import DIMENSIONS, Robot, Violation, metres_hint

_WORDS = {
    "outer_diameter": "outer diameter",
    "chamber_diameter": "bore",
    "lumen_diameter": "lumen",
    "chamber_circle_diameter": "chamber circle",
    "chamber_wall": "chamber wall",
    "chamber_angle": "chamber angle",
}


def mending_words(robot: Robot, broken: Sequence[Violation], minimum_wall: float, allowed: Collection[str]) -> str:
    """Return one sentence: what is wrong, and each size that would mend all of it alone."""
    ways = []
    found = mends(robot, minimum_wall, allowed)
    for name, words in _WORDS.items():
        if name in found:
            side = "at least" if found[name] > float(getattr(robot, name)) else "at most"
            ways.append(f"{words} {side} {_rounded(name, found[name], side == 'at least')}")
    lead = " and ".join(dict.fromkeys(map(_lead, broken)))
    hint = metres_hint(robot)
    if hint:
        return f"{lead[:1].upper()}{lead[1:]}{hint}."
    if not ways:
        return f"{lead[:1].upper()}{lead[1:]}: no size alone mends it."
    told = ways[0] if len(ways) == 1 else f"{', '.join(ways[:-1])}, or {ways[-1]}"
    return f"{lead[:1].upper()}{lead[1:]}: {told}."


def _lead(violation: Violation) -> str:
    """Return in a few words what is wrong."""
    told = violation.message
    if violation.rule == "wall_thickness":
        short = re.search(r"([\d.e-]+ mm) too little", told)
        return f"{short[1]} too little wall" if short else "too little wall"
    if violation.rule == "chamber_overlap":
        pair = re.search(r"chambers (\d+) and (\d+)", told)
        return f"chambers {pair[1]} and {pair[2]} overlap" if pair else "chambers overlap"
    sides = [words for sign, words in (("beyond", "the surface"), ("inside the lumen", "the lumen")) if sign in told]
    return f"the chambers break through {' and '.join(sides)}"


def range_words(robot: Robot | None, minimum_wall: float, allowed: Collection[str]) -> dict[str, str]:
    """Return by key of [robot] between what each size may be alone; nothing where the robot cannot be made."""
    if robot is None:
        return {}
    words = {}
    ranges = free_ranges(robot, minimum_wall, allowed)
    for d in DIMENSIONS:
        low, high = ranges.get(d.field, (0.0, inf))
        ends = [_number(d.field, low, up=True), _number(d.field, high, up=False)]
        if low > 0 and high < inf:
            words[d.file_key] = f"{ends[0]} to {ends[1]}"
        elif low > 0 or high < inf:
            words[d.file_key] = f"at least {ends[0]}" if low > 0 else f"at most {ends[1]}"
    return words


def _rounded(name: str, size: float, up: bool) -> str:
    return f"{_number(name, size, up)}{'°' if name == 'chamber_angle' else ' mm'}"


def _number(name: str, size: float, up: bool) -> str:
    """Return a size in the unit of its field to a hundredth, rounded so that what is said can be made."""
    if not 0 < size < inf:
        return ""
    value = size / (DEGREE if name == "chamber_angle" else MILLIMETRE)
    hundredths = round(100 * value, 5)
    whole = -(-hundredths // 1) if up else hundredths // 1
    return f"{whole / 100:g}" if whole > 0 else f"{value:.3g}"
