"""The pressure sequence: a list, a ramp or a file, all its steps solved and drawn, any of them shown."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np
from nicegui import ui

from softnlp.app import controls
from softnlp.app.asking import Progress, rows_bar, run_steps, said, scenario_with
from softnlp.app.parts import Chart, NumberTable, csv_drop, line, study_row
from softnlp.app.session import Session, Stage
from softnlp.base.columns import MM, OUTPUTS, Output
from softnlp.base.errors import InputError
from softnlp.base.reading import shown
from softnlp.base.units import BAR
from softnlp.figures.run import run_figure
from softnlp.figures.style import colour
from softnlp.results import view_of_run
from softnlp.statics.step import Run, Step
from softnlp.studies import fields

STUDY = "forward"
RAMP: Mapping[str, Any] = {"sets": [1], "to_bar": 1.5, "steps": 11}
MOST_TYPED = 200
"""Steps that are shown as text to be edited; more come from a file."""
QUANTITIES: Mapping[str, Output] = {
    "bending": OUTPUTS["bending_angle"],
    "length": OUTPUTS["backbone_length"],
    "tip": OUTPUTS["tip_position"],
}


def sequence_tab(stage: Stage) -> None:
    """Build the tab in the current slot."""
    with ui.column().classes("w-full gap-3 pt-2"):
        _Source(stage.session)
        _StepSlider(stage.session)
        ui.separator()
        _Results(stage)


class _Source:
    """Where the pressures come from, and the controls of each."""

    def __init__(self, session: Session) -> None:
        self._session = session
        controls.heading("Pressure sequence")
        self._kind = controls.toggle({"list": "List", "ramp": "Ramp", "file": "CSV file"}, "pressure.source")
        with ui.column().classes("w-full gap-1") as self._list:
            self._text = ui.textarea("One line per step: each set's pressure [bar]").classes("w-full font-mono")
            controls.named(self._text, "pressure.sequence_bar").props("dense outlined debounce=600 rows=5")
            controls.button("Add the pressures shown", "add", "pressure.add", self._add)
        with ui.column().classes("w-full gap-2") as self._ramp:
            self._sets = controls.select([1], "pressure.ramp.sets", "Sets", multiple=True, look="use-chips")
            self._numbers: dict[str, ui.number] = {}
            with ui.row().classes("w-full gap-2 no-wrap"):
                for key, label, unit in (("from_bar", "From", "bar"), ("to_bar", "To", "bar"), ("steps", "Steps", "")):
                    number = controls.number(label, f"pressure.ramp.{key}", unit, "debounce=250").classes("grow")
                    number.on_value_change(lambda event, key=key: self._ramped(key, event.value))
                    self._numbers[key] = number
        with ui.column().classes("w-full gap-1") as self._file:
            self._named = ui.label("").classes("text-sm").mark("pressure.file")
            csv_drop("pressure.drop", "Drop a CSV: t_s (optional), p1_bar, p2_bar, …", self._dropped)
        self._problem = controls.problem_label("pressure.problem")
        self._asked_file = False
        session.follow(self._refresh)
        self._kind.on_value_change(lambda event: self._choose(event.value))
        self._text.on_value_change(lambda event: self._typed(event.value))
        self._sets.on_value_change(lambda event: self._ramped("sets", sorted(event.value or [])))

    def _table(self) -> dict[str, Any]:
        return self._session.table("pressure")

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
                number.set_value(ramp.get(key, 0.0 if key == "from_bar" else None))
        self._named.set_text(f"From {table['file']}" if kind == "file" else "")
        self._problem.set_text(controls.problem_of(session, "pressure"))
        controls.tell_problem(session, self._text, "pressure", "sequence_bar")

    def _show_rows(self, rows: list[list[float]]) -> None:
        many = len(rows) > MOST_TYPED
        self._text.set_enabled(not many)
        if many:
            self._text.set_value(f"{len(rows)} steps; open them as a file to change them")
            return
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
        return rows_bar(rows if 0 < len(rows) <= MOST_TYPED else [self._session.pressure])

    def _typed(self, text: str | None) -> None:
        if source_of(self._table()) != "list" or not self._text.enabled:
            return
        try:
            rows = rows_of_text(text or "")
        except InputError as error:
            self._problem.set_text(controls.plain_words(error))
            return
        self._problem.set_text("")
        self._put({"sequence_bar": rows})

    def _add(self) -> None:
        rows = self._table().get("sequence_bar")
        rows = rows if isinstance(rows, list) else []
        self._put({"sequence_bar": [*rows, *rows_bar([self._session.pressure])]})

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
        self._session.take_file("pressure", name, content, {}, lambda problem: problem.table == "pressure")
        self._asked_file = False
        self._session.show_step(-1)


class _StepSlider:
    """Which step the page shows."""

    def __init__(self, session: Session) -> None:
        self._session = session
        with ui.row().classes("w-full items-center gap-3 pr-3 no-wrap") as self._row:
            self._label = ui.label("").classes("text-sm shrink-0").mark("sequence.shown")
            self._slider = ui.slider(min=1, max=2, value=1, on_change=self._moved).props("snap dense")
            controls.named(self._slider, "sequence.step")
        session.follow(self._refresh)
        session.on_pressure(self._follow)

    def _count(self) -> int:
        return 0 if self._session.scenario is None else len(self._session.scenario.pressures)

    def _refresh(self) -> None:
        count = self._count()
        self._row.set_visibility(count > 1)
        self._slider.props(f"max={max(count, 2)}")
        self._follow()

    def _follow(self) -> None:
        """Say which step the page shows, and move there; a pose of other controls is none."""
        session, count = self._session, self._count()
        if session.scenario is None or count < 2:
            return
        rows, at = session.scenario.pressures, min(int(self._slider.value), count) - 1
        alike = session.follows_file and rows.shape[1] == len(session.pressure)
        same = (rows == session.pressure).all(axis=1) if alike else np.zeros(count, bool)
        if not same.any():
            self._label.set_text(f"{count} steps")
            return
        if not same[at]:
            at = int(same.argmax())
            self._slider.set_value(at + 1)
        self._label.set_text(f"Step {at + 1} of {count}")

    def _moved(self) -> None:
        count = self._count()
        if count > 1 and self._session.problem is None:
            self._session.show_step(min(int(self._slider.value), count) - 1)


class _Results:
    """All steps solved: drawn, in a table, to take away."""

    def __init__(self, stage: Stage) -> None:
        self._stage, self._session = stage, stage.session
        self._steps: Sequence[Step] = []
        self._row = study_row("sequence", "Run all steps", self._asked, self._finish, lambda: self._draw())
        labels = {key: output.label.capitalize() for key, output in QUANTITIES.items()}
        axes = {"pressure": "Against pressure", "step": "Against step or time"}
        with ui.row().classes("w-full gap-2 no-wrap") as self._choice:
            self._what, self._along = (
                controls.select(options, name, value=first, on_change=self._draw).classes("grow", remove="w-full")
                for options, name, first in (
                    (labels, "sequence.quantity", "bending"),
                    (axes, "sequence.axis", "pressure"),
                )
            )
        self._choice.set_visibility(False)
        self._chart = Chart("sequence.chart", "", "")
        self._table = NumberTable("sequence.table", self._show_step)

    def _finish(self, run: Run) -> None:
        self._steps = run.steps
        self._draw()
        self._row.say(said(run))
        if len(run.steps) > 1:
            self._stage.figures["Steps"] = {"": lambda: run_figure(view_of_run(run))}
        self._table.show_steps(run, series(run.steps), "steps.csv")

    def _asked(self) -> Callable[[Progress], Run]:
        asked = scenario_with(self._session, STUDY)
        steps: list[Step] = []
        self._steps = steps
        self._along.set_value("pressure" if _rises(asked.pressures) else "step")
        return lambda progress: run_steps(asked, progress, steps.append)

    def _draw(self) -> None:
        steps = list(self._steps)
        self._choice.set_visibility(bool(steps))
        what = str(self._what.value)
        x, x_label = against(steps, str(self._along.value))
        found, output = series(steps, [what]), QUANTITIES[what]
        names = {name: name.removesuffix(f" [{MM}]") for name in found}
        spreads: Sequence[list[float] | None] = deviations(steps, output) or [None] * len(names)
        traces = [
            line(x, found[name], colour(k), words, spread)
            for k, ((name, words), spread) in enumerate(zip(names.items(), spreads, strict=True))
        ]
        self._chart.show(traces if steps else [], x_label=x_label, y_label=output.axis)

    def _show_step(self, row: int) -> None:
        scenario = self._session.scenario
        if scenario is not None and row < len(self._steps):
            same = len(scenario.pressures) == len(self._steps)
            if same and (scenario.pressures[row] == self._steps[row].pressure).all():
                self._session.show_step(row)
            else:
                self._session.use_pressure(self._steps[row].pressure)


def _rises(pressures: Any) -> bool:
    """Whether the largest pressure only rises, so that a curve against it is a line."""
    largest = pressures.max(axis=1)
    return bool((largest[1:] > largest[:-1]).all())


def source_of(table: Mapping[str, Any]) -> str:
    """Return where the pressures come from: ramp, file or list."""
    return next((key for key in ("ramp", "file") if key in table), "list")


def rows_text(rows: Sequence[Sequence[float]]) -> str:
    """Return rows of pressures as a person edits them, a line a step."""
    return "\n".join(", ".join(f"{p:.12g}" for p in row) for row in rows)


def rows_of_text(text: str) -> list[list[float]]:
    """Return the rows of pressures [bar] that a person typed; commas, semicolons or blanks between the numbers.

    Raises
    ------
    InputError
        For what is not a number, with its line.
    """
    rows = []
    for number, words in enumerate(text.splitlines(), start=1):
        row = []
        for word in words.replace(",", " ").replace(";", " ").split():
            try:
                row.append(float(word))
            except ValueError:
                raise InputError(f"line {number}: expected pressures in bar, got {shown(word)}") from None
            if not np.isfinite(row[-1]) or "_" in word:
                raise InputError(f"line {number}: expected a finite number, got {shown(word)}")
        if row:
            rows.append(row)
    if not rows:
        raise InputError("expected a line of pressures in bar for each step")
    return rows


def series(steps: Sequence[Step], quantities: Iterable[str] = tuple(QUANTITIES)) -> dict[str, list[float]]:
    """Return what is drawn of steps by column label, nan where a step has no solution."""
    found: dict[str, list[float]] = {}
    for output in (QUANTITIES[name] for name in quantities):
        labels = [output.axis] if not output.dims else [f"tip {x} [{output.unit}]" for x in "xyz"]
        values = fields.series(output, steps, {"axis": 3}).reshape(-1, len(labels))
        found |= dict(zip(labels, values.T.tolist(), strict=True))
    return found


def deviations(steps: Sequence[Step], output: Output) -> list[list[float]]:
    """Return the standard deviations of each entry of an output, nan where there is none; nothing without any."""
    scatter = OUTPUTS.get(f"std_{output.name}")
    if scatter is None or not any(step.deviation for step in steps):
        return []
    values = fields.series(scatter, steps, {"axis": 3}).reshape(len(steps), -1)
    return [list(map(float, column)) for column in values.T]


def against(steps: Sequence[Step], axis: str) -> tuple[list[float], str]:
    """Return the numbers and the label of the axis that steps are drawn along: pressure, or time or number."""
    if axis == "pressure":
        return [float(step.pressure.max()) / BAR for step in steps], "largest pressure [bar]"
    times = [step.time for step in steps]
    if all(time is not None for time in times) and times:
        return [float(time or 0.0) for time in times], OUTPUTS["t"].axis
    return [float(k) for k in range(1, len(steps) + 1)], "step"
