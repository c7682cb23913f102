"""The pressure sequence: a list, a ramp or a file, all its steps solved and drawn, any of them shown."""

from __future__ import annotations

from collections.abc import Mapping
from math import isfinite
from typing import Any

from nicegui import ui

from softnlp.app.asking import failures, run_steps, said, scenario_with, step_rows
from softnlp.app.fields import tell_problem
from softnlp.app.parts import Chart, NumberTable, RunRow, csv_drop, line, plain_words
from softnlp.app.session import Session
from softnlp.app.stage import Stage
from softnlp.app.tabs.sequence_table import (
    MOST_TYPED,
    QUANTITIES,
    RAMP,
    against,
    rows_of_text,
    rows_text,
    series,
    source_of,
)
from softnlp.base.columns import MM
from softnlp.base.errors import InputError
from softnlp.base.units import BAR
from softnlp.figures.style import colour
from softnlp.results.table import table_text
from softnlp.statics.step import Run, Step

STUDY = "forward"


def sequence_tab(stage: Stage) -> None:
    """Build the tab in the current slot."""
    with ui.column().classes("w-full gap-3 pt-2"):
        _Source(stage.session)
        _StepSlider(stage.session)
        ui.separator()
        _Results(stage.session)


class _Source:
    """Where the pressures come from, and the controls of each."""

    def __init__(self, session: Session) -> None:
        self._session = session
        ui.label("Pressure sequence").classes("text-base font-medium")
        self._kind = ui.toggle({"list": "List", "ramp": "Ramp", "file": "CSV file"}).mark("pressure.source")
        self._kind.props("dense no-caps unelevated spread data-testid=pressure.source").classes("w-full")
        with ui.column().classes("w-full gap-1") as self._list:
            self._text = ui.textarea("A line a step: the pressure of each set [bar]").classes("w-full font-mono")
            self._text.props("dense outlined debounce=600 rows=5 data-testid=pressure.sequence_bar")
            self._text.mark("pressure.sequence_bar")
            add = ui.button("Add the pressures shown", icon="add", on_click=self._add).mark("pressure.add")
            add.props("dense flat no-caps size=sm data-testid=pressure.add")
        with ui.column().classes("w-full gap-2") as self._ramp:
            self._sets = ui.select([1], multiple=True, label="Sets").classes("w-full").mark("pressure.ramp.sets")
            self._sets.props("dense outlined use-chips options-dense hide-bottom-space data-testid=pressure.ramp.sets")
            self._numbers: dict[str, ui.number] = {}
            with ui.row().classes("w-full gap-2 no-wrap"):
                for key, label, unit in (("from_bar", "From", "bar"), ("to_bar", "To", "bar"), ("steps", "Steps", "")):
                    number = ui.number(label).classes("grow").mark(f"pressure.ramp.{key}")
                    number.props(f'dense outlined debounce=250 hide-bottom-space suffix="{unit}"')
                    number.props(f"data-testid=pressure.ramp.{key}")
                    self._numbers[key] = number
        with ui.column().classes("w-full gap-1") as self._file:
            self._named = ui.label("").classes("text-sm").mark("pressure.file")
            csv_drop("pressure.drop", "Drop a CSV: t_s (optional), p1_bar, p2_bar, …", self._dropped)
        self._problem = ui.label("").classes("text-sm text-negative break-words").mark("pressure.problem")
        self._problem.props("data-testid=pressure.problem")
        self._asked_file = False
        self._refresh()
        self._kind.on_value_change(lambda event: self._choose(event.value))
        self._text.on_value_change(lambda event: self._typed(event.value))
        self._sets.on_value_change(lambda event: self._ramped("sets", sorted(event.value or [])))
        for key, number in self._numbers.items():
            number.on_value_change(lambda event, key=key: self._ramped(key, event.value))
        session.on_scenario(self._refresh)

    def _table(self) -> dict[str, Any]:
        return self._session.document.table("pressure")

    def _put(self, table: Mapping[str, Any]) -> None:
        """Make this the scenario's pressures, and show the last of its steps."""
        if table == self._table():
            return
        self._session.change_all("pressure", table)
        if self._session.problem is None:
            self._session.show_step(-1)

    def _refresh(self) -> None:
        table, session = self._table(), self._session
        kind = source_of(table)
        self._kind.set_value("file" if self._asked_file else kind)
        for name, box in (("list", self._list), ("ramp", self._ramp), ("file", self._file)):
            box.set_visibility(self._kind.value == name)
        rows = table.get("sequence_bar")
        if kind == "list" and isinstance(rows, list) and all(isinstance(row, list) for row in rows):
            self._show_rows(rows)
        ramp = table.get("ramp") if kind == "ramp" else None
        if isinstance(ramp, dict):
            sets = session.scenario.robot.chamber_sets if session.scenario is not None else 1
            self._sets.set_options(list(range(1, sets + 1)), value=[k for k in ramp.get("sets", []) if 1 <= k <= sets])
            for key, number in self._numbers.items():
                value = ramp.get(key, 0.0 if key == "from_bar" else None)
                if number.value != value:
                    number.set_value(value)
        self._named.set_text(f"From {table['file']}" if kind == "file" else "")
        problem = session.problem
        ours = problem is not None and problem.table == "pressure"
        self._problem.set_text(plain_words(problem) if ours and problem is not None else "")
        tell_problem(session, self._text, "pressure", "sequence_bar")

    def _show_rows(self, rows: list[list[float]]) -> None:
        many = len(rows) > MOST_TYPED
        self._text.set_enabled(not many)
        if many:
            self._text.set_value(f"{len(rows)} steps; open them as a file to change them")
        else:
            try:
                same = rows_of_text(self._text.value or "") == rows
            except InputError:
                same = False
            if not same:
                self._text.set_value(rows_text(rows))

    def _choose(self, kind: str | None) -> None:
        now = source_of(self._table())
        self._asked_file = kind == "file" and now != "file"
        if kind == "ramp" and now != "ramp":
            self._put({"ramp": dict(RAMP)})
        elif kind == "list" and now != "list":
            self._put({"sequence_bar": self._rows()})
        else:
            self._refresh()

    def _rows(self) -> list[list[float]]:
        """Return the rows of the last sequence that could be read [bar], or those shown where they are too many."""
        scenario = self._session.scenario
        rows: Any = [] if scenario is None else scenario.pressures
        rows = rows if 0 < len(rows) <= MOST_TYPED else [self._session.pressure]
        return [[float(f"{p / BAR:.12g}") for p in row] for row in rows]

    def _typed(self, text: str | None) -> None:
        if source_of(self._table()) != "list" or not self._text.enabled:
            return
        try:
            rows = rows_of_text(text or "")
        except InputError as error:
            self._problem.set_text(plain_words(error))
            return
        self._problem.set_text("")
        self._put({"sequence_bar": rows})

    def _add(self) -> None:
        rows = self._table().get("sequence_bar")
        rows = rows if isinstance(rows, list) else []
        shown = [float(f"{p / BAR:.12g}") for p in self._session.pressure]
        self._put({"sequence_bar": [*rows, shown]})

    def _ramped(self, key: str, value: Any) -> None:
        ramp = self._table().get("ramp")
        if not isinstance(ramp, dict) or value is None or value == [] or value == ramp.get(key):
            return
        if isinstance(value, int | float) and (
            not isfinite(value) or (key == "from_bar" and value == 0 and key not in ramp)
        ):
            return
        self._put({"ramp": {**ramp, key: int(value) if key == "steps" and value == int(value) else value}})

    def _dropped(self, name: str, content: bytes) -> None:
        """Take a file of pressures; one that cannot be read leaves the sequence as it was."""
        session, before = self._session, self._table()
        kept = session.keep(name, content)
        session.change_all("pressure", {"file": kept})
        problem = session.problem
        if problem is not None and problem.table == "pressure":
            session.change_all("pressure", before)
            raise InputError(problem.message)
        self._asked_file = False
        session.show_step(-1)


class _StepSlider:
    """Which step the page shows."""

    def __init__(self, session: Session) -> None:
        self._session = session
        with ui.row().classes("w-full items-center gap-3 pr-3 no-wrap") as self._row:
            self._label = ui.label("").classes("text-sm shrink-0")
            self._slider = ui.slider(min=1, max=2, value=1, on_change=self._moved).props("snap dense")
            self._slider.mark("sequence.step").props("data-testid=sequence.step")
        self._refresh()
        session.on_scenario(self._refresh)
        session.on_pressure(self._follow)

    def _count(self) -> int:
        return 0 if self._session.scenario is None else len(self._session.scenario.pressures)

    def _refresh(self) -> None:
        count = self._count()
        self._row.set_visibility(count > 1)
        self._slider.props(f"max={max(count, 2)}")
        self._label.set_text(f"Step {min(int(self._slider.value), count)} of {count}")

    def _follow(self) -> None:
        """Move to the step that another control has shown."""
        session = self._session
        if not session.follows_file or session.scenario is None or self._count() < 2:
            return
        same = (session.scenario.pressures == session.pressure).all(axis=1)
        if same.any() and not same[min(int(self._slider.value), len(same)) - 1]:
            self._slider.set_value(int(same.argmax()) + 1)

    def _moved(self) -> None:
        count = self._count()
        if count > 1 and self._session.problem is None:
            self._session.show_step(min(int(self._slider.value), count) - 1)
            self._label.set_text(f"Step {int(self._slider.value)} of {count}")


class _Results:
    """All steps solved: drawn, in a table, to take away."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._steps: list[Step] = []
        self._row = RunRow("sequence", "Run all steps", self._begin)
        with ui.row().classes("w-full gap-2 no-wrap") as self._choice:
            labels = {key: output.label.capitalize() for key, output in QUANTITIES.items()}
            self._what = ui.select(labels, value="bending", on_change=self._draw).classes("grow")
            self._along = ui.select(
                {"pressure": "Against pressure", "step": "Against step or time"}, value="pressure", on_change=self._draw
            ).classes("grow")
            for select, name in ((self._what, "sequence.quantity"), (self._along, "sequence.axis")):
                select.props(f"dense outlined options-dense data-testid={name}").mark(name)
        self._choice.set_visibility(False)
        self._chart = Chart("sequence.chart", "", "")
        self._table = NumberTable("sequence.table", self._show_step)

    async def _begin(self) -> None:
        try:
            asked = scenario_with(self._session, STUDY)
        except InputError as error:
            self._row.warn(plain_words(error))
            return
        steps: list[Step] = []
        self._steps = steps
        self._along.set_value("pressure" if _rises(asked.pressures) else "step")
        run = await self._row.do(lambda progress: run_steps(asked, progress, steps.append), self._draw)
        if run is not None:
            self._steps = list(run.steps)
            self._finish(run)

    def _finish(self, run: Run) -> None:
        self._draw()
        self._row.say(said(run))
        header, rows = step_rows(run, series(run.steps))
        self._table.show(header, rows, "steps.csv", csv=table_text(run), failed=failures(run))

    def _draw(self) -> None:
        steps = list(self._steps)
        self._choice.set_visibility(bool(steps))
        what = str(self._what.value)
        x, x_label = against(steps, str(self._along.value))
        found, output = series(steps, [what]), QUANTITIES[what]
        names = {name: name.removesuffix(f" [{MM}]") for name in found}
        traces = [line(x, found[name], colour(k), words) for k, (name, words) in enumerate(names.items())]
        self._chart.show(traces if steps else [], x_label=x_label, y_label=output.axis)

    def _show_step(self, row: int) -> None:
        scenario = self._session.scenario
        if scenario is not None and row < len(self._steps):
            same = len(scenario.pressures) == len(self._steps)
            if same and (scenario.pressures[row] == self._steps[row].pressure).all():
                self._session.show_step(row)
            elif len(self._steps[row].pressure) == len(self._session.pressure):
                self._session.set_pressure(self._steps[row].pressure)


def _rises(pressures: Any) -> bool:
    """Whether the largest pressure only rises, so that a curve against it is a line."""
    largest = pressures.max(axis=1)
    return bool((largest[1:] > largest[:-1]).all())
