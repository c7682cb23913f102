"""Rows of CSV files with what was measured of robots: which robot each row is of, its pressures, its numbers in SI."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.columns import OUTPUTS, Output
from softnlp.base.csv_columns import Columns
from softnlp.base.errors import InputError, nearest
from softnlp.base.ranges import PRESSURE, without_noise
from softnlp.base.reading import one_line, shown
from softnlp.base.units import BAR
from softnlp.model.robot import ROBOTS, Robot

Array = NDArray[np.float64]

TIP_COLUMNS = tuple(OUTPUTS[f"tip_{x}"].measured for x in "xyz")
ORIENTATION_COLUMNS = ("qx", "qy", "qz", "qw"), ("dx", "dy", "dz")
"""Of the quaternion of the tip's sensor, or of the direction of its z axis."""
SCALARS: Mapping[str, Output] = {name: OUTPUTS[name] for name in ("bending_angle", "elongation", "blocked_force")}
"""What is measured beside the tip."""
_COMPARED = (*(OUTPUTS[f"tip_{x}"] for x in "xyz"), *SCALARS.values(), OUTPUTS["tilt"], OUTPUTS["backbone_length"])
MEASURED_COLUMNS = tuple(output.measured for output in _COMPARED)
"""Of everything that can be measured."""
ALIASES: Mapping[str, str] = {other: output.measured for output in _COMPARED for other in output.others_measured}
"""Other names of columns, as results and people spell them."""
_NEAR = 0.85
_WITH_UNIT = tuple(f"_{unit}" for unit in ("bar", "mm", "deg", "N"))
_BAR = "Name it so, in bar; softnlp import converts other units"


@dataclass(frozen=True, eq=False)
class RobotRows:
    """The rows of one robot, which may stand in several files.

    label : the cell of the column robot, else the robot's name. places : the file of each row and its place there.
    """

    robot: Robot
    label: str
    places: tuple[tuple[Columns, int], ...]

    def column(self, name: str) -> Array:
        """Return a column as numbers (rows,), nan where a cell is blank or a file has no such column.

        Raises `InputError` for a cell that is not a finite number.
        """
        kept: dict[int, Array] = {}
        for columns, _ in self.places:
            if id(columns) not in kept:
                kept[id(columns)] = columns.numbers(name, blank=True)
        return np.array([kept[id(columns)][k] for columns, k in self.places])

    def pressure(self) -> Array:
        """Return the pressures (rows, sets) [Pa], noise below 0 taken as 0; raises `InputError` as `readings`."""
        return without_noise(self.readings()) * BAR

    def readings(self) -> Array:
        """Return the pressures (rows, sets) [bar] as they stand in the files.

        Raises `InputError` for one that is missing or out of range, and for one in a set that the robot does not have.
        """
        found = []
        for k in range(self.robot.chamber_sets):
            name = f"p{k + 1}_bar"
            values = self.column(name)
            for row in np.flatnonzero(np.isnan(values))[:1]:
                columns, place = self.places[row]
                near = [other for other in columns.header if name not in columns and near_column(other, [name])]
                if near:
                    raise InputError(f"missing column {name!r}; is it {shown(near[0])}? {_BAR}", source=columns.file)
                expected = f"expected a pressure from {PRESSURE.low:g} to {PRESSURE.high:g} bar"
                raise columns.wrong(place, name, f"{expected}, got nothing{PRESSURE.hint}")
            found.append(values)
        self._refuse_more_sets()
        return np.column_stack(found)

    def _refuse_more_sets(self) -> None:
        sets = self.robot.chamber_sets
        for name in dict.fromkeys(name for columns, _ in self.places for name in columns.header):
            number = name.removeprefix("p").removesuffix("_bar")
            if name == f"p{number}_bar" and number.isdecimal() and int(number) > sets:
                values = self.column(name)
                for row in np.flatnonzero(np.isfinite(values) & (values != 0))[:1]:
                    columns, place = self.places[row]
                    raise columns.wrong(place, name, f"expected 0 or nothing: {self.label} has {sets} sets")

    def tip_position(self) -> Array:
        """Return the tips (rows, 3) [m]."""
        return np.column_stack([self.column(name) for name in TIP_COLUMNS]) * OUTPUTS["tip_position"].scale

    def orientation(self) -> Array | None:
        """Return the quaternions (rows, 4) or directions (rows, 3) of the tip's sensor, None where there are none."""
        for names in ORIENTATION_COLUMNS:
            found = np.column_stack([self.column(name) for name in names])
            if np.isfinite(found).all(axis=1).any():
                return found
        return None

    def scalars(self) -> dict[str, Any]:
        """Return each of `SCALARS` (rows,), SI."""
        return {name: self.column(output.measured) * output.scale for name, output in SCALARS.items()}


def named_columns(columns: Columns) -> Columns:
    """Return a file whose columns have the names of this package in place of `ALIASES`."""
    header = [ALIASES.get(name, name) for name in columns.header]
    for name in header:
        if header.count(name) > 1 and name in MEASURED_COLUMNS:
            both = [old for old, new in zip(columns.header, header, strict=True) if new == name]
            raise InputError(f"expected {name!r} once, got {' and '.join(both)}", source=columns.file)
    return replace(columns, header=tuple(header))


def near_misses(columns: Columns, known: Collection[str], verdict: str) -> list[str]:
    """Say of each column that differs from a known one, which is not there, by case, unit or a letter.

    verdict : what becomes of it.
    """
    wanted = [name for name in known if name not in columns]
    others = [name for name in columns.header if name not in (*known, *ALIASES)]
    pairs = ((name, near_column(name, wanted)) for name in others)
    return [f"column {shown(name)} is {verdict}; did you mean {near!r}?" for name, near in pairs if near]


def near_column(name: str, known: Collection[str]) -> str:
    """Return which known column a name differs from by case, unit or a letter, "" where it is none."""

    def stem(word: str) -> str:
        plain = ALIASES.get(word.casefold(), word.casefold())
        return re.sub(r"[\s\[(]+", "_", plain).rpartition("_")[0] or plain

    spelled = {ALIASES.get(name.casefold(), name.casefold())}
    for one in known:
        if one.casefold() in spelled or (one.endswith(_WITH_UNIT) and stem(one) in (stem(name), name.casefold())):
            return one
    every = {other: other for other in known} | {other: one for other, one in ALIASES.items() if one in known}
    close = get_close_matches(name.casefold(), every, n=1, cutoff=_NEAR)
    return every[close[0]] if close and not re.fullmatch(r"p\d+_bar", name) else ""


def rows_by_robot(
    tables: Sequence[Columns], own: Mapping[str, Robot], unnamed: Callable[[Columns, int], Robot]
) -> list[RobotRows]:
    """Return the rows of each robot, in the order in which the robots come first.

    own : robots by the name that the column robot has for them, before those of the library. unnamed : gives the robot
    of a row without a name, or raises.
    """
    found: dict[tuple[str, int], tuple[Robot, list[tuple[Columns, int]]]] = {}
    for columns in tables:
        for k, name in enumerate(columns.text("robot")):
            robot = _named(name, own, columns, k) if name else unnamed(columns, k)
            found.setdefault((name or robot.name, id(robot)), (robot, []))[1].append((columns, k))
    return [RobotRows(robot, one_line(label), tuple(places)) for (label, _), (robot, places) in found.items()]


def _named(name: str, own: Mapping[str, Robot], columns: Columns, row: int) -> Robot:
    known = {**ROBOTS, **own}
    if name in known:
        return known[name]
    message = f"expected a robot of the scenario or of the library, got {shown(name)}{nearest(name, known)}"
    raise columns.wrong(row, "robot", message)
