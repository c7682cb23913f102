"""What a document says of its robot, also where that is no robot: what can be drawn, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import inf
from typing import Any

from softnlp.app.asking import sentence
from softnlp.app.document import Document
from softnlp.base.errors import RobotError
from softnlp.base.ranges import SIZE
from softnlp.base.reading import shown
from softnlp.base.units import MILLIMETRE
from softnlp.model.robot import (
    ALLOWABLE,
    DIMENSIONS,
    LENGTH_LIMITS,
    MINIMUM_WALL,
    ROBOTS,
    Dimension,
    Robot,
    Violation,
    is_number,
    touching_stretch,
    violations,
)

OWN = "own robot"
"""The name that a robot of one's own starts with."""

_WALLS = ("outer_diameter_mm", "lumen_diameter_mm")
_CHAMBERS = ("chamber_circle_diameter_mm", "chamber_diameter_mm", "chamber_wall_mm")
RULE_FIELDS: Mapping[str, tuple[str, ...]] = {
    "wall_thickness": (*_WALLS, "chamber_diameter_mm", "minimum_wall_mm"),
    "chamber_overlap": (*_CHAMBERS, "chamber_angle_deg", "chamber_sets", "chambers_per_set"),
    "chambers_inside_wall": (*_CHAMBERS, *_WALLS),
}
"""The keys of [robot] that each rule of manufacture depends on, the most likely one first."""

_ROOMY = replace(ROBOTS["D25L60"], outer_diameter=LENGTH_LIMITS[1], chamber_sets=1, chambers_per_set=1)
"""A robot in which any possible dimension is possible."""


@dataclass(frozen=True, eq=False)
class RobotState:
    """A robot as far as the document gives one.

    robot : where every dimension is a possible number, else None. said : by key of [robot], what is wrong with it.
    broken : rules of manufacture that it breaks. allowed : rules that may be broken.
    """

    robot: Robot | None
    said: Mapping[str, str]
    broken: tuple[Violation, ...]
    allowed: frozenset[str]

    @property
    def touching(self) -> float:
        """Stretch above which neighbouring chambers touch; infinite where there are none."""
        try:
            return inf if self.robot is None else touching_stretch(self.robot)
        except RobotError:  # a lumen wider than the body, which is drawn all the same
            return inf

    def red_chambers(self, stretch: float = 1.0) -> frozenset[int]:
        """Return the chambers, from 0, that break a rule, whether it is allowed or not, or touch at this stretch."""
        red = frozenset(n for violation in self.broken for n in violation.chambers)
        if self.robot is None or not stretch > self.touching:
            return red
        return red | frozenset(range(self.robot.chambers))

    def said_beside(self, latest: str | None = None) -> dict[str, str]:
        """Return messages by key: of values, and of each rule that may not be broken at one of its keys.

        latest : the key changed last, which has the message where the rule depends on it.
        """
        messages = dict(self.said)
        for violation in self.broken:
            if violation.rule in self.allowed:
                continue
            fields = RULE_FIELDS[violation.rule]
            key = latest if latest in fields else fields[0]
            known = [messages[key]] if key in messages else []
            messages[key] = "\n".join([*known, sentence(violation.message)])
        return messages


def robot_state(document: Document) -> RobotState:
    """Read the robot of a document; nothing is raised."""
    table = document.table("robot")
    allow = table.get("allow")
    allowed = frozenset(rule for rule in ALLOWABLE if isinstance(allow, list) and rule in allow)
    values = {d.field: effective(table, d) for d in DIMENSIONS}
    said = {d.file_key: problem for d in DIMENSIONS if (problem := _problem(d, values[d.field]))}
    wall = table.get("minimum_wall_mm", MINIMUM_WALL / MILLIMETRE)
    if not is_number(wall) or not SIZE.low <= wall <= SIZE.high:
        said["minimum_wall_mm"] = f"expected a length of {SIZE.low:g} to {SIZE.high:g} mm, got {shown(wall)}"
        wall = MINIMUM_WALL / MILLIMETRE
    if any(d.file_key in said for d in DIMENSIONS):
        return RobotState(None, said, (), allowed)
    name = table.get("name")
    sizes = {d.field: values[d.field] * (d.scale or 1) for d in DIMENSIONS}
    robot = Robot(name=name if isinstance(name, str) else OWN, **sizes)
    try:
        return RobotState(robot, said, violations(robot, wall * MILLIMETRE), allowed)
    except RobotError as error:  # two dimensions that do not go together
        key = next((d.file_key for d in DIMENSIONS if d.field == error.key), "chamber_sets")
        return RobotState(robot if error.key == "lumen_diameter" else None, {**said, key: error.message}, (), allowed)


def effective(table: Mapping[str, Any], dimension: Dimension) -> Any:
    """Return what holds for a dimension, in the unit of the file: as written, or of the library, or None."""
    value = table.get(dimension.file_key)
    return library_value(table, dimension) if value is None else value


def library_value(table: Mapping[str, Any], dimension: Dimension) -> float | None:
    """Return a dimension of the library's robot that the table names, in the unit of the file, or None."""
    name = table.get("name")
    if not isinstance(name, str) or name not in ROBOTS:
        return None
    value = getattr(ROBOTS[name], dimension.field)
    return int(value) if dimension.scale is None else float(f"{value / dimension.scale:.12g}")


def changed_keys(table: Mapping[str, Any]) -> list[str]:
    """Return the dimensions that differ from those of the library's robot."""
    return [d.file_key for d in DIMENSIONS if library_value(table, d) not in (None, effective(table, d))]


def library_table(table: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Return the table with a robot of the library in place of its dimensions; rules stay."""
    return {"name": name, **_rules(table)}


def own_table(table: Mapping[str, Any]) -> dict[str, Any]:
    """Return the table with every dimension in full, under a name that is not the library's."""
    full = {d.file_key: effective(table, d) for d in DIMENSIONS}
    return {"name": OWN, **{key: value for key, value in full.items() if value is not None}, **_rules(table)}


def _rules(table: Mapping[str, Any]) -> dict[str, Any]:
    return {key: table[key] for key in ("minimum_wall_mm", "allow") if key in table}


def _problem(dimension: Dimension, value: Any) -> str | None:
    """Return why a value is no possible dimension of any robot, or None."""
    if value is None:
        return "missing; a robot of your own needs every dimension"
    if not is_number(value):
        return f"expected a number, got {shown(value)}"
    scaled: Any = value if dimension.scale is None else _times(value, dimension.scale)
    if dimension.scale is None and isinstance(value, float):
        return f"expected a whole number, got {shown(value)}"
    try:
        changed: dict[str, Any] = {dimension.field: scaled}
        violations(replace(_ROOMY, **changed))
    except RobotError as error:
        return error.message if error.key in (dimension.field, "chamber_sets") else None
    return None


def _times(value: Any, scale: float) -> float:
    try:
        return float(value * scale)
    except OverflowError:  # an integer beyond the largest float
        return float("inf")
