"""One segment of the robot on the screen, as a scenario of its own: what the panels Robot and Silicone edit."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.app.document import sets_of
from softnlp.app.session import Session
from softnlp.base.errors import InputError
from softnlp.model.inputs import robot_table
from softnlp.model.robot import DIMENSIONS, ROBOTS
from softnlp.model.segments import SegmentedRobot
from softnlp.scenario.read import Scenario
from softnlp.scenario.segments import MOST_SEGMENTS

Row = dict[str, Any]
Array = NDArray[np.float64]

LIST = "segment"
_INNER = ("robot", "material")
_OWN = ("connector_mm", "lines", "turn_deg")


ALONG = tuple(d.file_key for d in DIMENSIONS if d.scale is not None and d.field != "length")
"""The dimensions that may vary along a segment."""


class PartTables:
    """The tables [robot] and [material] of one segment, a dimension that varies as it is at the base."""

    def __init__(self, part: Part) -> None:
        self._part = part

    def table(self, name: str) -> Row:
        """Return a table; that of the whole scenario where it is none of a segment."""
        found = self._part.raw(name)
        return {key: at_base(key, value) for key, value in found.items()} if name == "robot" else found

    def get(self, table: str, key: str, default: Any = None) -> Any:
        """Return a value, or the default."""
        value = self.table(table).get(key)
        return default if value is None else value


class Part:
    """The segment that a person has chosen; of a robot without [[segment]] that is the robot.

    chosen : from 0.
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self.folder = session.folder
        self.chosen = 0
        self._seen: tuple[Any, int, PartTables] = session.document, 0, PartTables(self)
        self._listeners: list[Callable[[], None]] = []
        self._cut: tuple[Scenario, int, Scenario] | None = None
        session.on_scenario(self._follow)

    # --- what panels read ---------------------------------------------------------------------------------------------

    @property
    def document(self) -> PartTables:
        """The tables of the segment; others once another scenario is opened or another segment chosen."""
        if self._seen[0] is not self.session.document or self._seen[1] != self.chosen:
            self._seen = self.session.document, self.chosen, PartTables(self)
        return self._seen[2]

    def rows(self) -> list[Row]:
        """Return the tables [[segment]], none for a robot without."""
        return self.session.rows(LIST)

    def raw(self, name: str) -> Row:
        """Return a table as the file has it."""
        rows = self.rows()
        if name in _INNER and rows:
            found = rows[self.chosen].get(name)
            return dict(found) if isinstance(found, Mapping) else {}
        return self.session.table(name)

    def table(self, name: str) -> Row:
        """Return a table, with what varies as it is at the base."""
        return self.document.table(name)

    @property
    def problem(self) -> InputError | None:
        """What is wrong, with this segment's own tables where it is about this one."""
        problem = self.session.problem
        if problem is None or not self.rows():
            return problem
        place = place_of(problem)
        if place is None:
            return problem
        number, table, key = place
        return type(problem)(problem.message, table=table, key=key) if number == self.chosen else None

    @property
    def scenario(self) -> Scenario | None:
        """The scenario with this segment in place of the robot."""
        whole = self.session.scenario
        if whole is None or not isinstance(whole.robot, SegmentedRobot):
            return whole
        number = min(self.chosen, len(whole.robot.segments) - 1)
        if self._cut is None or self._cut[:2] != (whole, number):
            segment = whole.robot.segments[number]
            self._cut = whole, number, replace(whole, robot=segment.robot, material=segment.material)
        return self._cut[2]

    @property
    def pressure(self) -> Array:
        """The pressures of this segment's sets [Pa]."""
        whole = self.session.scenario
        if whole is None or not isinstance(whole.robot, SegmentedRobot):
            return self.session.pressure
        sets = [segment.robot.chamber_sets for segment in whole.robot.segments]
        number = min(self.chosen, len(sets) - 1)
        return self.session.pressure[sum(sets[:number]) : sum(sets[: number + 1])]

    def on_scenario(self, listener: Callable[[], None]) -> None:
        """Call a function after each change, and when another segment is chosen."""
        self._listeners.append(listener)

    def on_pressure(self, listener: Callable[[], None]) -> None:
        """Call a function after each change of the pressures."""
        self.session.on_pressure(listener)

    # --- what panels change -------------------------------------------------------------------------------------------

    def change(self, table: str, key: str, value: object) -> None:
        """Set a key of the segment, or take it out for None; of what varies the number at the base."""
        rows = self.rows()
        if table == "robot" and key in ALONG and value is not None:
            value = with_base(self.raw(table).get(key), value)
        if table not in _INNER or not rows:
            self.session.change(table, key, value)
            return
        inner = {k: v for k, v in self.raw(table).items() if k != key or value is not None}
        self._put(rows, {**rows[self.chosen], table: inner if value is None else {**inner, key: value}})

    def change_all(self, table: str, values: Mapping[str, object] | None) -> None:
        """Put these keys in place of a whole table's; what varies and is as before stays so."""
        rows = self.rows()
        old = self.raw(table)
        if table == "robot" and values is not None:
            kept = {key: old[key] for key, value in values.items() if key in old and at_base(key, old[key]) == value}
            values = {**values, **kept}
        if table not in _INNER or not rows:
            self.session.change_all(table, values)
            return
        self._put(rows, {**rows[self.chosen], table: dict(values or {})})

    def put_robot(self, key: str, value: object) -> None:
        """Set a key of the segment's robot as it stands: a number, or what varies."""
        rows = self.rows()
        if not rows:
            self.session.change("robot", key, value)
            return
        self._put(rows, {**rows[self.chosen], "robot": {**self.raw("robot"), key: value}})

    def effective(self, key: str) -> Any:
        """Return a dimension in the unit of the file: as written, or that of the library's robot."""
        own = self.table("robot")
        if own.get(key) is not None:
            return own[key]
        robot = ROBOTS.get(str(own.get("name")))
        return None if robot is None else robot_table(robot).get(key)

    def set_own(self, key: str, value: object) -> None:
        """Set connector_mm, lines or turn_deg of the segment, or take it out for None."""
        rows = self.rows()
        if rows and rows[self.chosen].get(key) != value:
            own = {k: v for k, v in rows[self.chosen].items() if k != key}
            self._put(rows, own if value is None else {**own, key: value})

    def choose(self, number: int) -> None:
        """Turn to another segment, from 0."""
        if number != self.chosen and 0 <= number < max(1, len(self.rows())):
            self.chosen = number
            self._tell()

    def duplicate(self) -> None:
        """Put a copy of the segment behind it; a robot without [[segment]] becomes one of two."""
        rows = self.rows() or [{name: self.session.table(name) for name in _INNER}]
        if len(rows) >= MOST_SEGMENTS:
            raise InputError(f"a robot has at most {MOST_SEGMENTS} segments")
        copied = deepcopy(rows[self.chosen])
        sets = sets_of(copied.get("robot") or {}) or 0
        end = sum(sets_of(row.get("robot") or {}) or 0 for row in rows[: self.chosen + 1])
        rows.insert(self.chosen + 1, copied)
        self.chosen += 1
        self._replace(rows, lambda row: [*row[:end], *[0.0] * sets, *row[end:]])

    def remove(self) -> None:
        """Take the segment away; the last one that is left becomes [robot] and [material] where it can."""
        rows = self.rows()
        if len(rows) < 2:
            return
        counts = [sets_of(row.get("robot") or {}) or 0 for row in rows]
        a, b = sum(counts[: self.chosen]), sum(counts[: self.chosen + 1])
        del rows[self.chosen]
        self.chosen = min(self.chosen, len(rows) - 1)
        self._replace(rows, lambda row: [*row[:a], *row[b:]])

    # --- how ----------------------------------------------------------------------------------------------------------

    def _put(self, rows: list[Row], row: Row) -> None:
        rows[self.chosen] = row
        self.session.put_rows(LIST, rows)

    def _replace(self, rows: Sequence[Row], columns: Callable[[list[float]], list[float]]) -> None:
        """Make these the segments, and give each row of pressures the columns of their sets."""
        session, document = self.session, self.session.document
        alone = len(rows) == 1 and not any(rows[0].get(key) not in (None, 0, 0.0, "none") for key in _OWN)
        document.replace_rows(LIST, [] if alone else rows)
        for name in _INNER:
            document.replace(name, rows[0].get(name) if alone else None)
        table = document.table("pressure")
        if isinstance(table.get("sequence_bar"), list):
            kept = [columns(row) if isinstance(row, list) else row for row in table["sequence_bar"]]
            document.replace("pressure", {**table, "sequence_bar": kept})
        session.pressure = np.array(columns(session.pressure.tolist()))
        session.reread()
        session.set_pressure(session.pressure) if not session.follows_file else session.show_step(-1)

    def _follow(self) -> None:
        """Stay with a segment that there is; turn to one that is told to be wrong."""
        count = max(1, len(self.rows()))
        self.chosen = min(self.chosen, count - 1)
        place = None if self.session.problem is None else place_of(self.session.problem)
        if place is not None and place[0] < count:
            self.chosen = place[0]
        self._tell()

    def _tell(self) -> None:
        for listener in tuple(self._listeners):
            listener()


def place_of(problem: InputError) -> tuple[int, str | None, str | None] | None:
    """Return the segment, from 0, its table and its key that an error is about; None for another one."""
    words = (problem.key or "").split(".") if problem.table is None else []
    if len(words) < 2 or words[0] != LIST or not words[1].isdigit():
        return None
    table = words[2] if len(words) > 2 and words[2] in _INNER else LIST
    rest = words[3:] if table in _INNER else words[2:]
    return int(words[1]) - 1, table, ".".join(rest) or None


def at_base(key: str, value: Any) -> Any:
    """Return a value of [robot] as it is at the base, where it varies."""
    found = ends_of(value) if key in ALONG else None
    return value if found is None else found[0]


def ends_of(value: Any) -> tuple[Any, Any] | None:
    """Return a dimension at base and tip where it varies; None for a number and what is none."""
    numbers = value.get("value") if isinstance(value, Mapping) else value
    return (numbers[0], numbers[-1]) if isinstance(numbers, list) and numbers else None


def with_base(value: Any, number: object) -> Any:
    """Return a dimension with another number at the base."""
    return with_end(value, 0, number) if ends_of(value) is not None else number


def with_end(value: Any, end: int, number: object) -> Any:
    """Return a dimension that varies with another number at its base (0) or its tip (-1)."""
    numbers = list(value["value"] if isinstance(value, Mapping) else value)
    numbers[end] = number
    return {**value, "value": numbers} if isinstance(value, Mapping) else numbers
