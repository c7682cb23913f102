"""Pressures over time: drawn with the mouse for a set, or typed as a table of times."""

from __future__ import annotations

from typing import Any

from nicegui import ui

from softnlp.app import controls
from softnlp.app.asking import rows_bar
from softnlp.app.parts import csv_drop
from softnlp.app.session import Session
from softnlp.app.time_rows import Points, curves_of, drawn, table_of, table_of_text, text_of
from softnlp.app.view.pressure_draw import PressureDraw
from softnlp.base.errors import InputError
from softnlp.base.units import BAR
from softnlp.scenario.dynamic import DynamicTask

MOST_TYPED = 200
"""Rows that are shown as text to be edited; more come from a file."""
_LEAST_TOP, _ROOM = 1.0, 1.15  # of the picture [bar], and over the largest pressure


class PressuresOverTime:
    """The pressures of the scenario over time; what is drawn or typed makes it a motion."""

    def __init__(self, session: Session) -> None:
        """Build the picture and the table in the current slot."""
        self._session = session
        self._picture_of: Any = None
        controls.heading("Pressures over time")
        with ui.row().classes("w-full items-center no-wrap gap-2"):
            self._set = controls.select([1], "motion.set", "Set that is drawn", value=1, on_change=self._draw)
            self._set.classes("grow basis-0", remove="w-full")
            self._top = controls.number("Picture up to", "motion.top", "bar", "debounce=400", value=1.5, min=0.05)
            self._top.classes("grow basis-0").on_value_change(lambda _: self._draw())
        self._picture = controls.named(PressureDraw(), "motion.draw").classes("w-full").style("height: 13rem")
        self._picture.on_drawn(self._stroke)
        ui.label("Draw over a part of the line; two lines of one time in the table are a jump.").classes(controls.HINT)
        self._text = ui.textarea("One line per time: t [s], pressures [bar]").classes("w-full font-mono")
        controls.named(self._text, "motion.rows").props("dense outlined debounce=600 rows=5")
        self._text.without_auto_validation().on_value_change(lambda event: self._typed(event.value))
        self._problem = controls.problem_label("motion.problem")
        with ui.row().classes("w-full gap-1"):
            for words, name, act in (
                ("Step to the pressures shown", "motion.step", self._step),
                ("Hold the pressures shown", "motion.hold", self._hold),
            ):
                controls.button(words, None, name, act, controls.USE).classes("px-2")
        csv_drop("motion.drop", "Drop a CSV: t_s, p1_bar, p2_bar, …, fx_N, fy_N, fz_N", self._dropped)
        session.follow(self._refresh)

    # --- what a person does -------------------------------------------------------------------------------------------

    def _put(self, table: dict[str, Any]) -> None:
        """Make this the pressures over time, and a motion the study of the file."""
        session = self._session
        session.use()
        if table != session.table("pressure"):
            session.change_all("pressure", table)

    def _stroke(self, points: list[list[float]]) -> None:
        curves, chosen = self._curves(), int(self._set.value or 1) - 1
        if curves is None or chosen >= len(curves):
            return
        curves[chosen] = drawn(curves[chosen], points, self._duration(), self._height())
        self._put(table_of(curves))

    def _typed(self, text: str | None) -> None:
        if not self._text.enabled:
            return
        sets = len(self._session.pressure)
        try:
            table = table_of_text(text or "", sets)
        except InputError as error:
            self._problem.set_text(controls.plain_words(error))
            return
        self._problem.set_text("")
        now = self._shown()
        if now is None or (table["t_s"], table["sequence_bar"]) != now:
            self._put(table)

    def _step(self) -> None:
        (row,) = rows_bar([self._session.pressure])
        at, zeros = min(0.05, 0.1 * self._duration()), [0.0] * len(row)
        self._put({"t_s": [0.0, at, at], "sequence_bar": [zeros, zeros, row]})

    def _hold(self) -> None:
        self._put({"t_s": [0.0], "sequence_bar": rows_bar([self._session.pressure])})

    def _dropped(self, name: str, content: bytes) -> None:
        """Take a file of pressures and times; one that cannot be read leaves them as they were."""
        self._session.use()
        self._session.take_file("pressure", name, content, {}, lambda problem: problem.table == "pressure")

    # --- what is shown ------------------------------------------------------------------------------------------------

    def _task(self) -> DynamicTask | None:
        scenario = self._session.scenario
        return scenario.task if scenario is not None and isinstance(scenario.task, DynamicTask) else None

    def _shown(self) -> tuple[list[float], list[list[float]]] | None:
        """Return times [s] and rows [bar] of what the scenario says."""
        task, scenario = self._task(), self._session.scenario
        if task is None or scenario is None:
            return None
        return task.times.tolist(), rows_bar(scenario.pressures)

    def _curves(self) -> list[Points] | None:
        found = self._shown()
        return None if found is None else curves_of(*found)

    def _duration(self) -> float:
        task = self._task()
        return 1.0 if task is None else task.asked.duration

    def _height(self) -> float:
        scenario = self._session.scenario
        highest = 0.0 if scenario is None or not scenario.pressures.size else float(scenario.pressures.max()) / BAR
        asked = self._top.value
        return max(float(asked) if asked and asked > 0 else _LEAST_TOP, _ROOM * highest)

    def _refresh(self) -> None:
        found = self._shown()
        if found is None:
            return
        times, rows = found
        sets = len(rows[0])
        chosen = min(int(self._set.value or 1), sets)
        self._set.set_options(list(range(1, sets + 1)), value=chosen)
        from_file = "file" in self._session.table("pressure")
        many = len(rows) > MOST_TYPED or from_file
        self._text.set_enabled(not many)
        if many:
            self._text.set_value(f"{len(rows)} times of a file; what is drawn takes their place")
        elif not self._says(times, rows):
            self._text.set_value(text_of(times, rows))
            self._problem.set_text("")
        self._draw()

    def _says(self, times: list[float], rows: list[list[float]]) -> bool:
        """Whether the text says these rows already, so that what a person types stays as it is."""
        try:
            table = table_of_text(self._text.value or "", len(rows[0]))
        except InputError:
            return False
        return (table["t_s"], table["sequence_bar"]) == (times, rows)

    def _draw(self) -> None:
        curves = self._curves()
        if curves is None:
            return
        picture = (curves, self._duration(), self._height(), int(self._set.value or 1) - 1)
        if picture != self._picture_of:
            self._picture_of = picture
            self._picture.show(*picture)
