"""The segments of the robot: the one that Robot and Silicone show, what joins them, what varies along them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from math import isfinite
from typing import Any

from nicegui import ui

from softnlp.app.controls import (
    HINT,
    USE,
    button,
    is_number,
    number,
    plain_words,
    problem_label,
    say_beside,
    select,
    unit_of,
)
from softnlp.app.part import ALONG, LIST, Part, ends_of, with_end
from softnlp.base.errors import InputError
from softnlp.scenario.segments import MOST_SEGMENTS

_LINES = {
    "none": "no lines of later segments",
    "slack": "lines hang in the lumen",
    "bonded": "lines are chambers here",
}
_JOINED = (("connector_mm", "Connector", "mm", 0.5), ("turn_deg", "Turned by", "°", 5.0))


def segments_panel(part: Part) -> None:
    """Build the panel in the current slot."""
    _Segments(part)


class _Segments:
    """The list of segments and the fields of the chosen one."""

    def __init__(self, part: Part) -> None:
        self._part = part
        self._ends: dict[tuple[str, int], ui.number] = {}
        self._varied: list[str] = []
        self._choice = select([], "segment.choice", "Segment that Robot and Silicone show")
        self._choice.on_value_change(lambda event: part.choose(event.value) if event.value is not None else None)
        with ui.row().classes("w-full no-wrap gap-2"):
            more = button("Duplicate", "content_copy", "segment.duplicate", self._duplicate, USE).classes("px-2")
            more.tooltip("A copy behind it, with sets of its own")
            self._more = more
            self._less = button("Remove", "delete", "segment.remove", part.remove, USE).classes("px-2")
        self._problem = problem_label("segment.problem")
        with ui.column().classes("w-full gap-2") as self._joined:
            with ui.row().classes("w-full no-wrap gap-2"):
                self._numbers = {key: self._own(key, label, unit, step) for key, label, unit, step in _JOINED}
            ui.label("The connector is rigid and follows the segment; the turn is about its axis.").classes(HINT)
            self._lines = select(dict(_LINES), "segment.lines", "Pressure lines of later segments")
            self._lines.on_value_change(lambda event: self._turned("lines", event.value, "none"))
        ui.label("Dimensions that vary along it").classes("text-sm font-medium")
        self._list = ui.column().classes("w-full gap-2")
        self._add = select([], "segment.vary", "Let a dimension vary")
        self._add.on_value_change(lambda event: self._vary(event.value))
        part.on_scenario(self._refresh)
        self._refresh()

    def _own(self, key: str, label: str, unit: str, step: float) -> ui.number:
        field = number(label, f"segment.{key}", unit, "debounce=250", value=0.0, step=step)
        field.on_value_change(lambda event: self._entered(key, event.value))
        return field.classes("grow basis-0 min-w-0")

    # --- what a person does -------------------------------------------------------------------------------------------

    def _duplicate(self) -> None:
        try:
            self._part.duplicate()
        except InputError as error:
            ui.notify(error.message, type="warning")

    def _entered(self, key: str, value: Any) -> None:
        if is_number(value) and isfinite(value):
            self._turned(key, float(value), 0.0)

    def _turned(self, key: str, value: Any, default: Any) -> None:
        rows = self._part.rows()
        if rows and value is not None and value != rows[self._part.chosen].get(key, default):
            self._part.set_own(key, None if value == default else value)

    def _vary(self, key: str | None) -> None:
        value = self._part.effective(key) if key is not None else None
        if key is not None and is_number(value):
            self._add.set_value(None)
            self._part.put_robot(key, [value, value])

    def _hold(self, key: str) -> None:
        found = ends_of(self._part.raw("robot").get(key))
        if found is not None:
            self._part.put_robot(key, found[0])

    def _moved(self, key: str, end: int, value: Any) -> None:
        now = self._part.raw("robot").get(key)
        found = ends_of(now)
        if found is not None and is_number(value) and isfinite(value) and found[end] != value:
            self._part.put_robot(key, with_end(now, end, float(value)))

    # --- what is shown ------------------------------------------------------------------------------------------------

    def _refresh(self) -> None:
        part = self._part
        rows = part.rows()
        self._choice.set_options(dict(enumerate(map(self._words, range(len(rows)), rows))), value=None)
        self._choice.set_value(part.chosen if rows else None)
        self._choice.set_visibility(bool(rows))
        self._joined.set_visibility(bool(rows))
        self._less.set_enabled(len(rows) > 1)
        self._more.set_enabled(len(rows) < MOST_SEGMENTS)
        own = rows[part.chosen] if rows else {}
        for key, field in self._numbers.items():
            field.set_value(own.get(key, 0.0))
        self._lines.set_value(own.get("lines", "none"))
        self._say()
        robot = part.raw("robot")
        varied = [key for key in ALONG if ends_of(robot.get(key)) is not None]
        if varied != self._varied:
            self._varied = varied
            self._build(robot)
        for (key, end), field in self._ends.items():
            found = ends_of(robot.get(key))
            field.set_value(None if found is None else found[end])
        self._add.set_options({key: label_of(key) for key in ALONG if key not in varied}, value=None)

    def _say(self) -> None:
        """Say beside its field what is wrong with what joins segments, above all fields what is wrong with several."""
        problem = self._part.session.problem
        mine = self._part.problem
        for key, field in self._numbers.items():
            about = mine is not None and (mine.table, mine.key) == (LIST, key)
            say_beside(field, mine.message if about and mine is not None else "")
        whole = problem is not None and problem.table == LIST
        self._problem.set_text(plain_words(problem) if whole and problem is not None else "")
        self._problem.set_visibility(whole)

    def _build(self, robot: Mapping[str, Any]) -> None:
        self._list.clear()
        self._ends.clear()
        with self._list:
            for key in self._varied:
                with ui.row().classes("w-full no-wrap gap-2 items-center"):
                    for end, words in ((0, "base"), (-1, "tip")):
                        label, mark = f"{label_of(key)}, {words}", f"segment.{key}.{words}"
                        field = number(label, mark, unit_of(key), "debounce=250", step=0.1)
                        field.on_value_change(partial(self._typed, key, end))
                        self._ends[key, end] = field.classes("grow basis-0 min-w-0")
                    words = f"{label_of(key)} the same along it"
                    hold = button(
                        "", "close", f"segment.{key}.hold", partial(self._hold, key), "flat dense round size=sm"
                    )
                    hold.props(f'aria-label="{words}"').tooltip(words)
                knots = robot[key].get("s", []) if isinstance(robot[key], Mapping) else []
                if len(knots) > 2:
                    ui.label(f"By {len(knots)} knots; those between are in the file.").classes(f"{HINT} -mt-1")

    def _typed(self, key: str, end: int, event: Any) -> None:
        self._moved(key, end, event.value)

    @staticmethod
    def _words(place: int, row: Mapping[str, Any]) -> str:
        names = [str((row.get(table) or {}).get("name", "own")) for table in ("robot", "material")]
        return f"{place + 1}: {', '.join(names)}"


def label_of(key: str) -> str:
    """Return a dimension as a label."""
    return key.removesuffix("_mm").removesuffix("_deg").replace("_", " ").capitalize()
