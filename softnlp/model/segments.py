"""A robot of several segments, or of one that varies along s, in the place that a `Robot` has in studies.

It has the sizes of the whole: sets and chambers of all segments, the length with the connectors, the largest diameter.
What only one section has is nan, so that nothing takes it for a number; the segments are in `segments`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import nan
from typing import Any

import numpy as np

from softnlp.base.errors import InputError
from softnlp.base.quantity import Quantity
from softnlp.model.body import Body, Segment
from softnlp.model.conventions import REPRODUCTION, UNIAXIAL
from softnlp.model.lined_chambers import LinedChambers
from softnlp.model.materials import Material
from softnlp.model.model import Model
from softnlp.model.outlined import OutlinedRobot
from softnlp.model.quantities import quantities
from softnlp.model.robot import Robot


@dataclass(frozen=True, eq=False)
class SegmentedRobot(Robot):
    """Segments one behind the other, base first; made by `segmented_robot`.

    Attributes
    ----------
    name
        Shown in every result.
    outer_diameter
        The largest, a number [m].
    lumen_diameter, chamber_circle_diameter, chamber_diameter, chamber_wall
        Not a number: those of one section [m].
    length
        Of segments and connectors together, unpressurised, a number [m].
    chamber_sets
        Of all segments, with one pressure each.
    chambers_per_set, chamber_angle
        0 and not a number: those of one section [rad].
    segments
        As of `softnlp.Body`.
    """

    segments: tuple[Segment, ...] = ()

    @property
    def chambers(self) -> int:
        """Number of chambers of all segments."""
        return sum(segment.robot.chambers for segment in self.segments)

    @property
    def set_of_chamber(self) -> tuple[int, ...]:
        """Set of each chamber, both counted from 0 through all segments."""
        found, sets = list[int](), 0
        for segment in self.segments:
            found += [sets + one for one in segment.robot.set_of_chamber]
            sets += segment.robot.chamber_sets
        return tuple(found)

    @cached_property
    def material(self) -> Material:
        """The silicone of all segments; of different ones the first, under all their names, to name them by."""
        every = [segment.material for segment in self.segments]
        names, laws = (
            " + ".join(dict.fromkeys(words)) for words in zip(*((m.name, m.law.name) for m in every), strict=True)
        )
        first = every[0]
        if (names, laws) == (first.name, first.law.name):
            return first
        return replace(first, name=names, law=replace(first.law, name=laws))

    @property
    def parts(self) -> dict[str, Robot]:
        """The robot at each knot of each segment, by what it is called in messages."""
        return {
            f"segment {k + 1}{f' at s = {s:g}' if segment.along else ''}": robot
            for k, segment in enumerate(self.segments)
            for s, robot in sections_of(segment)
        }

    @property
    def notes(self) -> list[str]:
        """What to know of the lines."""
        found = []
        for k, model in enumerate(_body(self.segments).models):
            if isinstance(model.section, LinedChambers):
                found += [f"segment {k + 1}: {note}" for note in model.section.notes]
        return found


def sections_of(segment: Segment) -> Iterator[tuple[float, Robot]]:
    """Yield the fractions of a segment's length between which it is linear in s, each with the robot there."""
    every = sorted({0.0, *(float(s) for at, _ in segment.tables.values() for s in at)})
    for s in every:
        there: dict[str, Any] = {
            key.removeprefix("robot."): float(np.interp(s, *table))
            for key, table in segment.tables.items()
            if key.startswith("robot.")
        }
        yield s, replace(segment.robot, **there)


def segmented_robot(segments: Sequence[Segment]) -> SegmentedRobot:
    """Return segments, base first, as a robot that studies take; its silicone is its `material`.

    Parameters
    ----------
    segments
        At least one, each of a `Robot` with the paper's section.

    Returns
    -------
    SegmentedRobot
        Not checked yet: studies do.

    Raises
    ------
    InputError
        Without a segment, and for what cannot vary along one.
    """
    _body(segments)  # for its errors
    return whole_robot(segments)


def _body(segments: Sequence[Segment]) -> Body:
    """Return the body of segments in the conventions that their sections have."""
    outlined = any(isinstance(segment.robot, OutlinedRobot) for segment in segments)
    return Body(tuple(segments), conventions=UNIAXIAL if outlined else REPRODUCTION)


def whole_robot(segments: Sequence[Segment]) -> SegmentedRobot:
    """Return the same of segments that are known to fit."""
    sizes = [robot for segment in segments for _, robot in sections_of(segment)]
    return SegmentedRobot(
        name=" + ".join(segment.robot.name for segment in segments),
        outer_diameter=max(float(robot.outer_diameter) for robot in sizes),
        lumen_diameter=nan,
        chamber_circle_diameter=nan,
        chamber_diameter=nan,
        chamber_wall=nan,
        length=float(sum(segment.robot.length + segment.connector for segment in segments)),
        chamber_sets=sum(segment.robot.chamber_sets for segment in segments),
        chambers_per_set=0,
        chamber_angle=nan,
        segments=tuple(segments),
    )


def body_of(model: Model) -> Body:
    """Return the body of a model.

    Raises
    ------
    InputError
        For a robot of several segments with another silicone than theirs.
    """
    robot = model.robot
    if not isinstance(robot, SegmentedRobot):
        return Body([Segment(robot, model.material, model.section_type)], model.coefficients, model.conventions)
    if model.material is not robot.material:
        raise InputError("a robot of several segments has the silicones of these; none can be given beside it")
    return Body(robot.segments, model.coefficients, model.conventions)


def segments_of(robot: Robot) -> list[tuple[Robot, int]]:
    """Return the robot of each segment at its base, with the number of sets before it; itself where it is one."""
    if not isinstance(robot, SegmentedRobot):
        return [(robot, 0)]
    found, sets = [], 0
    for segment in robot.segments:
        found.append((segment.robot, sets))
        sets += segment.robot.chamber_sets
    return found


def declared(model: Model) -> dict[str, Quantity]:
    """Return every quantity of a model by name: those of its body where it has several segments."""
    return body_of(model).quantities if isinstance(model.robot, SegmentedRobot) else quantities(model)


def require_one_segment(robot: Robot, what: str) -> None:
    """Raise `InputError` for a robot of several segments, or of one that varies. what : is not done for it."""
    if isinstance(robot, SegmentedRobot):
        raise InputError(f"{what} takes a robot of one uniform segment so far")
