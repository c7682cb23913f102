"""What the robot may touch: obstacles added, named, placed by numbers, by dragging and by keys, and taken away."""

from __future__ import annotations

from contextlib import nullcontext
from functools import partial
from math import isfinite
from typing import Any

from nicegui import ui

from softnlp.app.controls import HINT, USE, button, named, number, say_beside, select, typed, unit_of
from softnlp.app.notes import study_words
from softnlp.app.obstacle_rows import (
    LIST,
    first_row,
    is_vector,
    keys_of,
    kinds,
    moved,
    of_kind,
    parts_of,
    problem_of_row,
)
from softnlp.app.session import Session, Stage
from softnlp.app.view.obstacles import obstacle_message
from softnlp.model.robot import ROBOTS
from softnlp.scenario.obstacle_schema import MOST_OBSTACLES
from softnlp.statics.obstacle_step import names_of

Row = dict[str, Any]

_MOVE = (
    "In the view: drag one (a plane by its edge), or choose one by the key O and move it by Shift with an arrow key."
)
_LABELS = {"from": "From", "to": "To", "centre": "Centre", "point": "Point", "normal": "Normal", "axis": "Axis"}


def obstacles_panel(session: Session) -> None:
    """Build the panel in the current slot."""
    _Obstacles(session)


def draw_obstacles(stage: Stage) -> None:
    """Show the obstacles of the session in its view from now on, and move there what a person moves."""
    session = stage.session
    drawn: list[Any] = [None]

    def draw() -> None:
        scenario = session.scenario
        wanted = () if scenario is None else scenario.obstacles
        length = 0.0 if scenario is None else scenario.robot.length
        if (wanted, names_of(wanted), length) == drawn[0]:
            return
        drawn[0] = (wanted, names_of(wanted), length)
        named_ones = zip(wanted, names_of(wanted), strict=True)
        stage.view.obstacles([obstacle_message(one, name, length) for one, name in named_ones])

    def go(place: int, by: tuple[float, float, float], done: bool) -> None:
        rows = session.rows(LIST)
        if place < len(rows) and session.takes(LIST) and all(map(isfinite, by)):
            rows[place] = moved(rows[place], by)
            session.put_rows(LIST, rows)

    stage.view.on_moved(go)
    session.follow(draw)


class _Obstacles:
    """The fields of every obstacle; they are built anew when there are others."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._built: list[str] = []
        self._fields: dict[tuple[int, str, int], Any] = {}
        self._note = named(ui.label().classes("text-sm"), "obstacle.note")
        self._list = ui.column().classes("w-full gap-3")
        with ui.row().classes("w-full items-center no-wrap gap-2"):
            self._kind = select(list(kinds()), "obstacle.new", "Kind", value="sphere").classes("grow", remove="w-full")
            self._add = button("Add", "add", "obstacle.add", self._added, USE).classes("px-2 shrink-0")
        self._hint = ui.label(_MOVE).classes(HINT)
        session.follow(self._refresh)

    # --- what a person does -------------------------------------------------------------------------------------------

    def _rows(self) -> list[Row]:
        return self._session.rows(LIST)

    def _robot(self) -> Any:
        scenario = self._session.scenario
        return ROBOTS["D25L60"] if scenario is None else scenario.robot

    def _added(self) -> None:
        self._session.put_rows(LIST, [*self._rows(), first_row(str(self._kind.value), self._robot())])

    def _removed(self, place: int) -> None:
        rows = self._rows()
        self._session.put_rows(LIST, rows[:place] + rows[place + 1 :])

    def _change(self, place: int, key: str, value: Any) -> None:
        """Set a key of an obstacle, or take it out for None."""
        rows = self._rows()
        if place < len(rows) and rows[place].get(key) != value:
            rows[place] = (
                {k: v for k, v in rows[place].items() if k != key}
                if value is None
                else {
                    **rows[place],
                    key: value,
                }
            )
            self._session.put_rows(LIST, rows)

    def _turned(self, place: int, kind: str | None) -> None:
        rows = self._rows()
        if kind is not None and place < len(rows) and rows[place].get("kind") != kind:
            rows[place] = of_kind(rows[place], kind, self._robot())
            self._session.put_rows(LIST, rows)

    def _entered(self, place: int, key: str, index: int, value: Any) -> None:
        field = self._fields[place, key, index]
        if value is None or not isfinite(value):
            say_beside(field, "expected a number")
            return
        if is_vector(key):
            vector = [float(one.value or 0.0) for (at, k, _), one in self._fields.items() if (at, k) == (place, key)]
            vector[index] = float(value)
            value = vector
        self._change(place, key, value)

    # --- what is shown ------------------------------------------------------------------------------------------------

    def _refresh(self) -> None:
        rows, session = self._rows(), self._session
        shape = [str(row.get("kind")) for row in rows]
        if shape != self._built:
            self._build(rows)
        left = (
            "" if not rows or session.takes(LIST) else f"{study_words(session)} takes no obstacles: they are left out."
        )
        self._note.set_text(left or ("" if rows else "Nothing that the robot could touch."))
        self._note.set_visibility(bool(self._note.text))
        self._hint.set_visibility(bool(rows))
        self._add.set_enabled(len(rows) < MOST_OBSTACLES)
        for (place, key, index), field in self._fields.items():
            value = rows[place].get(key, {"part": "body", "name": ""}.get(key))
            if isinstance(value, list):
                value = value[index] if index < len(value) else None
            field.set_value(value)
            problem = problem_of_row(session.problem, place)
            say_beside(field, problem[1] if problem is not None and problem[0] == key and index == 0 else "")

    def _build(self, rows: list[Row]) -> None:
        self._built = [str(row.get("kind")) for row in rows]
        self._list.clear()
        self._fields.clear()
        with self._list:
            for place, row in enumerate(rows):
                with ui.column().classes("w-full gap-2 rounded border border-neutral-300 dark:border-neutral-700 p-2"):
                    self._one(place, str(row.get("kind")))

    def _one(self, place: int, kind: str) -> None:
        mark = f"obstacle.{place + 1}"
        with ui.row().classes("w-full items-center no-wrap gap-1"):
            name = named(ui.input(f"{kind} {place + 1}"), f"{mark}.name").without_auto_validation()
            name.props('dense outlined debounce=400 maxlength=60 placeholder="name"').classes("grow min-w-0")
            name.on_value_change(
                lambda event: self._change(place, "name", " ".join(typed(event.value).split()) or None)
            )
            words = f"Take {kind} {place + 1} away"
            away = button("", "close", f"{mark}.remove", partial(self._removed, place), "flat dense round size=sm")
            away.props(f'aria-label="{words}"').tooltip(words)
        self._fields[place, "name", 0] = name
        with ui.row().classes("w-full no-wrap gap-2"):
            turn = select(list(kinds()), f"{mark}.kind", "Kind", value=kind)
            turn.on_value_change(lambda event: self._turned(place, event.value))
            part = select(parts_of(kind), f"{mark}.part", "Touched by", value="body")
            part.on_value_change(
                lambda event: self._change(place, "part", None if event.value == "body" else event.value)
            )
            for box in (turn, part):
                box.classes("grow basis-0 min-w-0", remove="w-full")
        self._fields[place, "kind", 0], self._fields[place, "part", 0] = turn, part
        numbers = [key for key in keys_of(kind) if not is_vector(key)]
        for key in keys_of(kind):
            if is_vector(key):
                self._row_of(place, key, mark)
        with ui.row().classes("w-full no-wrap gap-2") if numbers else nullcontext():
            for key in numbers:
                self._number(place, key, 0, label_of(key), f"{mark}.{key}", 1.0, unit_of(key))

    def _row_of(self, place: int, key: str, mark: str) -> None:
        with ui.row().classes("w-full items-center no-wrap gap-2"):
            unit = f" [{unit_of(key)}]" if unit_of(key) else ""
            ui.label(f"{label_of(key)}{unit}").classes("text-xs w-12 shrink-0 leading-tight opacity-80")
            for index, axis in enumerate("xyz"):
                self._number(place, key, index, axis, f"{mark}.{key}.{index}", 1.0 if unit else 0.1)
                self._fields[place, key, index].props(f'aria-label="{label_of(key)} {axis}, obstacle {place + 1}"')

    def _number(self, place: int, key: str, index: int, label: str, mark: str, step: float, unit: str = "") -> None:
        field = number(label, mark, unit, "debounce=250 no-error-icon", step=step).classes("grow basis-0 min-w-0")
        self._fields[place, key, index] = field
        field.on_value_change(lambda event: self._entered(place, key, index, event.value))


def label_of(key: str) -> str:
    """Return a key of an obstacle as a label."""
    plain = key.removesuffix("_mm")
    return _LABELS.get(plain, plain.capitalize())
