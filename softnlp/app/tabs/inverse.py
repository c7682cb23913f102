"""The inverse tab: targets typed or picked in the view, the pressures that reach them, and how far is left."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import isfinite
from typing import Any

import numpy as np
from nicegui import ui

from softnlp.app import controls
from softnlp.app.asking import Progress, bars, run_steps, said, scenario_with, sentence
from softnlp.app.examples import empty_state
from softnlp.app.parts import NumberTable, study_row
from softnlp.app.session import Session, Stage
from softnlp.base.columns import OUTPUTS
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.statics.step import Run, Step
from softnlp.studies.fields import value

Table = dict[str, Any]

STUDY = "inverse"
POSITION, DIRECTION = OUTPUTS["tip_position"].key, "tip_direction"
KINDS: Mapping[str, tuple[str, ...]] = {
    "position": (POSITION,),
    "direction": (DIRECTION,),
    "both": (POSITION, DIRECTION),
}
_LEFT = {"distance": OUTPUTS["distance"], "angle": OUTPUTS["direction_error"]}
_FIRST: Mapping[str, list[float]] = {POSITION: [-20.0, 0.0, 62.0], DIRECTION: [0.0, 0.0, 1.0]}
_FIRST_PRESSURE, _TRIES = 0.5 * BAR, 6  # of what is looked for first [Pa]
_FAR = 1e6  # [mm], farther targets are not marked
MOST_EDITED = 25
"""Targets that have fields of their own; more come from a file."""


def inverse_tab(stage: Stage) -> None:
    """Build the tab in the current slot."""
    with ui.column().classes("w-full gap-3 pt-2"):
        empty_state(stage.session, "inverse")
        _Targets(stage)
        _bounds(stage.session)
        ui.separator()
        _Search(stage.session)


class _Targets:
    """The targets of the scenario: typed, added, picked, marked in the view."""

    def __init__(self, stage: Stage) -> None:
        self._view = stage.view
        self._session = stage.session
        self._fields: dict[tuple[str, int, int], ui.number] = {}
        self._built: tuple[str, int] | None = None
        self._marked: list[list[float]] | None = None
        controls.heading("Targets of the tip")
        self._kind = controls.toggle({"position": "Position", "direction": "Direction", "both": "Both"}, "target.kind")
        self._rows = ui.column().classes("w-full gap-2")
        with ui.row().classes("w-full items-center gap-2 no-wrap"):
            self._add = controls.button(
                "Add a target", "add", "target.add", lambda: self._put(with_added(self._table()))
            )
            self._pick = controls.named(ui.switch("Pick in the view").props("dense"), "target.pick")
        self._weight = controls.number_field(
            self._session, "target", "length_per_radian_mm", "A radian counts as", default=self._length
        )
        self._problem = controls.problem_label("target.problem")
        offer_target(self._session)
        self._session.follow(self._refresh)
        self._kind.on_value_change(lambda event: self._choose(event.value))
        stage.view.on_pick(self._picked)

    def _table(self) -> Table:
        return self._session.table("target")

    def _put(self, table: Table) -> None:
        self._session.put("target", table)

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
            if row < len(rows):
                field.set_value(rows[row][column])
        self._problem.set_text(controls.problem_of(self._session, "target", "bounds"))
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
                        field = controls.number(
                            f"{axis} [mm]" if key == POSITION else f"{axis} of axis",
                            f"target.{key}.{row}.{column}",
                            look="debounce=250",
                            value=rows_of(self._table(), key)[row][column],
                            on_change=lambda event, at=(key, row, column): self._typed(at, event.value),
                        )
                        self._fields[key, row, column] = field.classes("grow min-w-0")
                    remove = partial(self._remove, row)
                    bin_ = controls.button("", "close", f"target.remove.{row}", remove, "flat dense round size=sm")
                    bin_.props('aria-label="remove"').classes("" if place == 0 else "invisible")
                    bin_.set_enabled(count > 1)

    def _remove(self, row: int) -> None:
        self._put(without(self._table(), row))

    def _typed(self, at: tuple[str, int, int], value: float | None) -> None:
        key, row, column = at
        rows = rows_of(self._table(), key)
        if value is not None and isfinite(value) and row < len(rows) and value != rows[row][column]:
            rows[row][column] = value
            self._put({**self._table(), key: rows})

    def _picked(self, place: tuple[float, float, float]) -> None:
        if self._session.document.study == STUDY and self._pick.value and 0 < count_of(self._table()) <= MOST_EDITED:
            self._put(with_picked(self._table(), place))

    def _mark_targets(self) -> None:
        """Mark the targets in the view while this study is on the screen."""
        rows = rows_of(self._table(), POSITION) if self._session.document.study == STUDY else []
        marked = [row for row in rows if all(isinstance(x, int | float) and abs(x) < _FAR for x in row)] or None
        if marked != self._marked:
            self._marked = marked
            self._view.targets(None if marked is None else np.array(marked, dtype=float))


def _bounds(session: Session) -> None:
    """Show [bounds]: one pair for every set, or say that there are several."""

    def pair() -> list[float] | None:
        rows = session.document.get("bounds", "pressure_bar", [0.0, 1.5])
        one = isinstance(rows, list) and len(rows) == 2 and not any(isinstance(row, list) for row in rows)
        return rows if one else None

    def entered(at: int, value: float | None) -> None:
        now = pair()
        if now is not None and value is not None and isfinite(value) and value != now[at]:
            session.change("bounds", "pressure_bar", [value if k == at else p for k, p in enumerate(now)])

    with ui.row().classes("w-full gap-2 no-wrap") as row:
        ends = ("Lowest", "Highest")
        fields = [
            controls.number(f"{e} pressure", f"bounds.{e.lower()}", "bar", "debounce=250", step=0.1) for e in ends
        ]
    several = ui.label("Each set has bounds of its own, from the file.").classes("text-sm")

    def refresh() -> None:
        now = pair()
        row.set_visibility(now is not None)
        several.set_visibility(now is None)
        for field, bar in zip(fields, now or (), strict=False):
            field.set_value(bar)

    session.follow(refresh)
    for at, field in enumerate(fields):
        field.classes("grow").on_value_change(lambda event, at=at: entered(at, event.value))


class _Search:
    """The search for pressures, and what it found."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._steps: Sequence[Step] = ()
        self._row = study_row("inverse", "Find the pressures", self._asked, self._finish)
        self._table = NumberTable("inverse.table", self._choose)

    def _asked(self) -> Callable[[Progress], Run]:
        asked = scenario_with(self._session, STUDY)
        return lambda progress: run_steps(asked, progress)

    def _finish(self, run: Run) -> None:
        if not run.steps:
            return
        self._steps = run.steps
        self._table.show_steps(run, target_columns(run), "targets.csv", "target")
        self._choose(0)
        if len(self._steps) > 1:
            self._row.say(f"{said(run)} The robot is at target 1; a click on a row moves it to another.")

    def _choose(self, row: int) -> None:
        """Say what was found for a target, and move the robot there."""
        if row >= len(self._steps):
            return
        step = self._steps[row]
        words = words_of(step)
        self._row.say(words) if step.status.has_solution else self._row.warn(words)
        if np.isfinite(step.pressure).all():
            self._session.use_pressure(step.pressure)  # the robot goes there at once; undo takes it back


def offer_target(session: Session) -> None:
    """Begin with a target that this robot reaches, where a person has given none: a place on its way, well inside."""
    scenario = session.scenario
    if "target" not in session.document.offered or scenario is None or session.is_stale:
        return
    shown = session.pressure if session.pressure.any() else np.eye(len(session.pressure))[0] * _FIRST_PRESSURE
    pressure = 0.6 * shown + 0.1 * float(shown.max())
    for _ in range(_TRIES):
        step = session.live.pose(scenario, pressure)[0].steps[0]
        if step.status.has_solution and step.pose is not None:
            place = [round(float(x), 1) for x in step.pose.tip_position / MILLIMETRE]
            session.document.replace("target", {POSITION: [place]})
            session.document.offered.add("target")  # still nobody's
            session.reread()
            return
        pressure = pressure / 2


def kind_of(table: Mapping[str, Any]) -> str:
    """Return what the targets are: a position, a direction, or both."""
    keys = tuple(key for key in KINDS["both"] if isinstance(table.get(key), list))
    return next((kind for kind, wanted in KINDS.items() if wanted == keys), "position")


def rows_of(table: Mapping[str, Any], key: str) -> list[list[Any]]:
    """Return the rows of a key, of three entries each."""
    rows = table.get(key)
    return [list(row) for row in rows if isinstance(row, list) and len(row) == 3] if isinstance(rows, list) else []


def count_of(table: Mapping[str, Any]) -> int:
    """Return the number of targets."""
    return max(len(rows_of(table, key)) for key in KINDS["both"])


def with_kind(table: Table, kind: str) -> Table:
    """Return the table with targets of another kind, as many as before."""
    count = max(count_of(table), 1)
    gone = KINDS["both"] if kind == "both" else (*KINDS["both"], "length_per_radian_mm")
    kept = {key: v for key, v in table.items() if key not in gone}
    return {key: (rows_of(table, key) + [_FIRST[key]] * count)[:count] for key in KINDS[kind]} | kept


def with_added(table: Table) -> Table:
    """Return the table with one more target, like the last."""
    added = {}
    for key in KINDS[kind_of(table)]:
        rows = rows_of(table, key)
        added[key] = [*rows, list(rows[-1] if rows else _FIRST[key])]
    return {**table, **added}


def without(table: Table, row: int) -> Table:
    """Return the table without a target; the only one stays."""
    if count_of(table) < 2:
        return table
    return {**table, **{k: [r for j, r in enumerate(rows_of(table, k)) if j != row] for k in KINDS[kind_of(table)]}}


def with_picked(table: Table, place_mm: Sequence[float]) -> Table:
    """Return the table with the last target at a place of the view."""
    if kind_of(table) == "direction":
        return table
    rows = rows_of(table, POSITION)
    return {**table, POSITION: [*rows[:-1], [round(float(x), 1) for x in place_mm]]}


def words_of(step: Step) -> str:
    """Return in words what was found for a target."""
    aimed = step.aimed
    if not step.status.has_solution or aimed is None:
        return sentence(step.message)
    known = [(value(output, step), output.unit) for output in _LEFT.values()]
    left = [f"{size:.2g} {unit}" for size, unit in known if size is not None]
    return f"Reached at {bars(step.pressure)} bar, {' and '.join(left)} left."


def target_columns(run: Run) -> dict[str, list[Any]]:
    """Return the columns of a table of targets, by label; None where there is none."""
    columns: dict[str, list[Any]] = {}
    wanted = OUTPUTS["target"]
    for step in run.steps:
        target = value(wanted, step)
        places = [None] * 3 if target is None else map(float, target)
        entries = {f"{axis} wanted [{wanted.unit}]": place for axis, place in zip("xyz", places, strict=True)}
        entries |= {f"{name} left [{output.unit}]": value(output, step) for name, output in _LEFT.items()}
        for label, entry in entries.items():
            columns.setdefault(label, []).append(entry)
    return {label: values for label, values in columns.items() if any(entry is not None for entry in values)}
