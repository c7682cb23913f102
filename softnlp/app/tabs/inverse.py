"""The inverse tab: targets typed or picked in the view, the pressures that reach them, and how far is left."""

from __future__ import annotations

from math import isfinite

import numpy as np
from nicegui import ui

from softnlp.app.asking import failures, run_steps, said, scenario_with, step_rows
from softnlp.app.fields import number_field
from softnlp.app.parts import NumberTable, RunRow, plain_words
from softnlp.app.session import Session
from softnlp.app.stage import Stage
from softnlp.app.tabs.target_table import (
    KINDS,
    POSITION,
    Table,
    count_of,
    kind_of,
    rows_of,
    target_columns,
    with_added,
    with_kind,
    with_number,
    with_picked,
    without,
    words_of,
)
from softnlp.base.errors import InputError
from softnlp.results.table import table_text
from softnlp.statics.step import Step

STUDY = "inverse"
_FAR = 1e6  # [mm], farther targets are not marked
MOST_EDITED = 25
"""Targets that have fields of their own; more come from a file."""


def inverse_tab(stage: Stage) -> None:
    """Build the tab in the current slot."""
    with ui.column().classes("w-full gap-3 pt-2"):
        _Targets(stage)
        _bounds(stage.session)
        ui.separator()
        _Search(stage.session)


class _Targets:
    """The targets of the scenario: typed, added, picked, marked in the view."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._session = stage.session
        self._fields: dict[tuple[str, int, int], ui.number] = {}
        self._built: tuple[str, int] | None = None
        self._marked: list[list[float]] | None = None
        ui.label("Targets of the tip").classes("text-base font-medium")
        self._kind = ui.toggle({"position": "Position", "direction": "Direction", "both": "Both"})
        self._kind.props("dense no-caps unelevated spread data-testid=target.kind").classes("w-full").mark(
            "target.kind"
        )
        self._rows = ui.column().classes("w-full gap-2")
        with ui.row().classes("w-full items-center gap-2 no-wrap"):
            self._add = ui.button("Add a target", icon="add", on_click=lambda: self._put(with_added(self._table())))
            self._add.props("dense flat no-caps size=sm data-testid=target.add").mark("target.add")
            self._pick = ui.switch("Pick in the view").props("dense data-testid=target.pick").mark("target.pick")
        self._weight = number_field(
            self._session, "target", "length_per_radian_mm", "A radian counts as", "mm", default=self._length
        )
        self._problem = ui.label("").classes("text-sm text-negative break-words").mark("target.problem")
        self._problem.props("data-testid=target.problem")
        self._refresh()
        self._kind.on_value_change(lambda event: self._choose(event.value))
        self._session.on_scenario(self._refresh)
        stage.view.on_pick(self._picked)

    def _table(self) -> Table:
        return self._session.document.table("target")

    def _put(self, table: Table) -> None:
        if table != self._table():
            self._session.change_all("target", table)

    def _length(self) -> float | None:
        scenario = self._session.scenario
        return None if scenario is None else float(f"{scenario.robot.length * 1e3:.9g}")

    def _choose(self, kind: str | None) -> None:
        if kind is not None and kind != kind_of(self._table()):
            self._put(with_kind(self._table(), kind))

    def _refresh(self) -> None:
        table = self._table()
        kind, count = kind_of(table), count_of(table)
        self._kind.set_value(kind)
        self._weight.set_visibility(kind == "both")
        self._pick.set_visibility(kind != "direction")
        self._add.set_visibility(count < MOST_EDITED)
        if self._built != (kind, count):
            self._built = (kind, count)
            self._rows.clear()
            self._fields.clear()
            with self._rows:
                self._build(kind, count)
        for (key, row, column), field in self._fields.items():
            rows = rows_of(table, key)
            if row < len(rows) and field.value != rows[row][column]:
                field.set_value(rows[row][column])
        problem = self._session.problem
        ours = problem is not None and problem.table in ("target", "bounds")
        self._problem.set_text(plain_words(problem) if problem is not None and ours else "")
        self._mark_targets()

    def _build(self, kind: str, count: int) -> None:
        """Build a row of fields for each target."""
        if count > MOST_EDITED:
            ui.label(f"{count} targets; open them as a file to change them").classes("text-sm")
            return
        for row in range(count):
            for place, key in enumerate(KINDS[kind]):
                with ui.row().classes("w-full items-center gap-2 no-wrap"):
                    ui.label(str(row + 1) if place == 0 else "").classes("w-4 text-sm opacity-70 shrink-0")
                    for column, axis in enumerate("xyz"):
                        name = f"target.{key}.{row}.{column}"
                        field = ui.number(
                            f"{axis} [mm]" if key == POSITION else f"{axis} of axis",
                            value=rows_of(self._table(), key)[row][column],
                            on_change=lambda event, at=(key, row, column): self._typed(at, event.value),
                        )
                        field.props(f"dense outlined debounce=250 hide-bottom-space data-testid={name}")
                        field.classes("grow min-w-0").mark(name)
                        self._fields[key, row, column] = field
                    bin_ = ui.button(icon="close", on_click=lambda _, row=row: self._put(without(self._table(), row)))
                    bin_.props(f'flat dense round size=sm data-testid=target.remove.{row} aria-label="remove"')
                    bin_.mark(f"target.remove.{row}").classes("" if place == 0 else "invisible")
                    bin_.set_enabled(count > 1)

    def _typed(self, at: tuple[str, int, int], value: float | None) -> None:
        key, row, column = at
        rows = rows_of(self._table(), key)
        if value is not None and isfinite(value) and row < len(rows) and value != rows[row][column]:
            self._put(with_number(self._table(), key, row, column, value))

    def _picked(self, place: tuple[float, float, float]) -> None:
        if self._session.document.study == STUDY and self._pick.value and 0 < count_of(self._table()) <= MOST_EDITED:
            self._put(with_picked(self._table(), place))

    def _mark_targets(self) -> None:
        """Mark the targets in the view while this study is on the screen."""
        rows = rows_of(self._table(), POSITION) if self._session.document.study == STUDY else []
        marked = [row for row in rows if all(isinstance(x, int | float) and abs(x) < _FAR for x in row)] or None
        if marked != self._marked:
            self._marked = marked
            self._stage.view.targets(None if marked is None else np.array(marked, dtype=float))


def _bounds(session: Session) -> None:
    """Show [bounds]: one pair for every set, or say that there are several."""

    def pair() -> list[float] | None:
        rows = session.document.get("bounds", "pressure_bar", [0.0, 1.5])
        one = isinstance(rows, list) and len(rows) == 2 and not any(isinstance(row, list) for row in rows)
        return rows if one else None

    fields: list[ui.number] = []

    def entered(at: int, value: float | None) -> None:
        now = pair()
        if now is not None and value is not None and isfinite(value) and value != now[at]:
            session.change("bounds", "pressure_bar", [value if k == at else p for k, p in enumerate(now)])

    with ui.row().classes("w-full gap-2 no-wrap") as row:
        for at, (label, name) in enumerate((("Lowest pressure", "lowest"), ("Highest pressure", "highest"))):
            field = ui.number(label, step=0.1, on_change=lambda event, at=at: entered(at, event.value)).classes("grow")
            field.props(f'dense outlined debounce=250 hide-bottom-space suffix="bar" data-testid=bounds.{name}')
            fields.append(field.mark(f"bounds.{name}"))
    several = ui.label("Each set has bounds of its own, from the file.").classes("text-sm")

    def refresh() -> None:
        now = pair()
        row.set_visibility(now is not None)
        several.set_visibility(now is None)
        for field, value in zip(fields, now or (), strict=False):
            if field.value != value:
                field.set_value(value)

    refresh()
    session.on_scenario(refresh)


class _Search:
    """The search for pressures, and what it found."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._steps: list[Step] = []
        self._chosen = 0
        self._row = RunRow("inverse", "Find the pressures", self._begin)
        self._use = ui.button("Use these pressures", icon="tune", on_click=self._take).mark("inverse.use")
        self._use.props("dense outline no-caps size=sm data-testid=inverse.use").classes("px-2")
        self._use.set_visibility(False)
        self._table = NumberTable("inverse.table", self._choose)

    async def _begin(self) -> None:
        self._use.set_visibility(False)
        try:
            asked = scenario_with(self._session, STUDY)
        except InputError as error:
            self._row.warn(plain_words(error))
            return
        run = await self._row.do(lambda progress: run_steps(asked, progress))
        if run is None or not run.steps:
            return
        self._steps = list(run.steps)
        self._row.say(said(run))
        header, rows = step_rows(run, target_columns(run))
        self._table.show(["target", *header[1:]], rows, "targets.csv", csv=table_text(run), failed=failures(run))
        self._choose(0)
        if len(self._steps) > 1:
            self._row.say(f"{said(run)} A click on a row chooses a target.")

    def _choose(self, row: int) -> None:
        """Say what was found for a target, and offer its pressures."""
        if row >= len(self._steps):
            return
        self._chosen = row
        step = self._steps[row]
        words = words_of(step)
        self._row.say(words) if step.status.has_solution else self._row.warn(words)
        fits = np.isfinite(step.pressure).all() and len(step.pressure) == len(self._session.pressure)
        self._use.set_visibility(bool(fits))
        self._use.set_text("Use these pressures" if len(self._steps) == 1 else f"Use the pressures of target {row + 1}")

    def _take(self) -> None:
        step = self._steps[self._chosen]
        if len(step.pressure) == len(self._session.pressure):
            self._session.set_pressure(step.pressure)
