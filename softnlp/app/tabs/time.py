"""The tab of motion: pressures over time drawn or typed, the run, its frames played in the view, and its modes."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from nicegui import ui

from softnlp.app import controls
from softnlp.app.asking import Progress, run_steps, said, scenario_with
from softnlp.app.examples import empty_state
from softnlp.app.panels.modes import modes_part
from softnlp.app.parts import Chart, NumberTable, downloads, line, study_row
from softnlp.app.session import Session, Stage
from softnlp.app.tabs.time_pressures import PressuresOverTime
from softnlp.app.tabs.time_series import QUANTITIES, curves, table_rows
from softnlp.base.columns import OUTPUTS
from softnlp.figures.dynamic import dynamic_figure
from softnlp.figures.style import colour
from softnlp.results import json_text, netcdf_bytes, table_text, view_of_run
from softnlp.scenario.dynamic import DynamicTask
from softnlp.scenario.read import Scenario
from softnlp.statics.step import Run, Step

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STUDY = "dynamic"
_SPEEDS = {1.0: "as fast as it is", 0.25: "4 times slower", 0.1: "10 times slower", 0.02: "50 times slower"}
_PICTURE_S = 0.05  # between two pictures that are played
_RULES = {"trapezoid": "trapezoid: keeps the energy", "bdf2": "BDF2: damps what is too fast for the step"}
_STARTS = {"static": "the pose at rest of the first row", "rest": "straight, without pressure and load"}
_NUMBERS = (
    ("duration_s", "Duration", "s", 0.1),
    ("damping_s", "Damping time", "s", 0.001),
    ("lag_s", "Lag of the pressure", "s", 0.01),
    ("dead_time_s", "Dead time", "s", 0.01),
    ("step_s", "Longest step", "s", 0.001),
    ("output_step_s", "Kept every", "s", 0.005),
    ("tip_mass_g", "Mass at the tip", "g", 0.5),
)


def time_tab(stage: Stage) -> None:
    """Build the tab in the current slot."""
    with ui.column().classes("w-full gap-3 pt-2"):
        empty_state(stage.session, STUDY)
        PressuresOverTime(stage.session)
        _settings(stage.session)
        ui.separator()
        _Motion(stage)
        ui.separator()
        modes_part(stage.session)


def _settings(session: Session) -> None:
    """Show the keys of [dynamic]."""
    controls.heading("How it moves")

    def duration() -> float | None:
        task = None if session.scenario is None else session.scenario.task
        return task.asked.duration if isinstance(task, DynamicTask) else None

    with ui.element("div").classes("grid grid-cols-2 gap-2 w-full items-start"):
        for key, label, unit, step in _NUMBERS:
            default = duration if key == "duration_s" else None
            field = controls.number_field(session, "dynamic", key, label, unit, default=default, step=step)
            if key in ("step_s", "output_step_s"):
                words = "by its error" if key == "step_s" else "a hundredth"
                field.props(f'clearable stack-label placeholder="{words}"')
    controls.choice_field(session, "dynamic", "rule", "Rule in time", _RULES)
    controls.choice_field(session, "dynamic", "start", "Begins at", _STARTS)
    release = controls.named(ui.switch("The tip load ends at t = 0").props("dense"), "dynamic.release")

    def entered(value: bool) -> None:
        if value != bool(session.document.get("dynamic", "release", False)):
            session.change("dynamic", "release", value or None)

    release.on_value_change(lambda event: entered(bool(event.value)))
    problem = controls.problem_label("dynamic.problem")

    def refresh() -> None:
        release.set_value(bool(session.document.get("dynamic", "release", False)))
        words = controls.problem_of(session, "dynamic", "pressure", "solver") if session.document.study == STUDY else ""
        problem.set_text(words)

    session.follow(refresh)


class _Motion:
    """The run over time: drawn as it comes, played in the view, in a table, to take away."""

    def __init__(self, stage: Stage) -> None:
        self._stage, self._session = stage, stage.session
        self._asked_scenario: Scenario | None = None
        self._steps: list[Step] = []
        self._began: tuple[float, float] | None = None  # of the playing: the clock, and the time of the motion
        self._row = study_row("motion", "Run the motion", self._asked, self._finish, self._draw)
        with ui.column().classes("w-full gap-2") as self._shown:
            with ui.row().classes("w-full items-center no-wrap gap-2"):
                self._button = controls.button("Play", "play_arrow", "motion.play", self._turn, controls.USE)
                self._button.classes("px-2 shrink-0")
                self._speed = controls.select(_SPEEDS, "motion.speed", "Speed", value=0.25).classes(
                    "grow", remove="w-full"
                )
            with ui.row().classes("w-full items-center no-wrap gap-3 pr-3"):
                self._at = controls.named(ui.label("").classes("text-sm shrink-0 tabular-nums w-24"), "motion.at")
                self._slider = ui.slider(min=0, max=1, value=0, step=1, on_change=self._moved).props("dense")
                controls.named(self._slider, "motion.slider").props('aria-label="time of the motion"')
            labels = {key: words for key, (words, _) in QUANTITIES.items()}
            self._what = controls.select(labels, "motion.quantity", "Over time", value="tip", on_change=self._draw)
            self._chart = Chart("motion.chart", OUTPUTS["t"].axis, "")
            self._table = NumberTable("motion.table", self._row_chosen)
            with ui.row().classes("gap-1"):
                self._texts = downloads(("motion.json", "motion.json", "application/json"))
                controls.button("motion.nc", "download", "motion.nc", self._take)
        self._shown.set_visibility(False)
        self._run: Run | None = None
        self._timer = ui.timer(_PICTURE_S, self._tick, active=False)
        self._session.on_pressure(self.pause)
        self._session.on_scenario(self.pause)

    # --- the run ------------------------------------------------------------------------------------------------------

    def _asked(self) -> Callable[[Progress], Run]:
        self.pause()
        asked = scenario_with(self._session, STUDY)
        self._asked_scenario = asked
        steps: list[Step] = []
        self._steps = steps
        return lambda progress: run_steps(asked, progress, steps.append)

    def _finish(self, run: Run) -> None:
        self._steps, self._run = list(run.steps), run
        words = said(run).replace("steps solved", "times solved")
        energy = run.energy
        if energy and energy["exchanged"] > 0:
            part = abs(energy["imbalance"]) / energy["exchanged"]
            words += f" Energy is balanced to {part:.0e} of what was exchanged."
        notes = [f"Note: {note}." for note in run.warnings if not note.startswith("stopped")]
        self._row.say(" ".join([words, *notes]))
        self._texts["motion.json"] = lambda: json_text(run)
        header, rows = table_rows(run.steps)
        failed = [not step.status.has_solution for step in run.steps]
        self._table.show(header, rows, "motion.csv", csv=table_text(run), failed=failed)
        if len(run.steps) > 1:
            self._stage.figures["Motion"] = {"": partial(_figure, run)}
        self._draw()
        self._show(0)

    def _draw(self) -> None:
        steps = [step for step in self._steps if step.time is not None]
        self._shown.set_visibility(bool(steps))
        if not steps:
            return
        self._slider.props(f"max={max(1, len(steps) - 1)}")
        axis = QUANTITIES[str(self._what.value)][1]
        times = [float(step.time or 0.0) for step in steps]
        traces = [
            line(times, values, colour(k), name, mode="lines")
            for k, (name, values) in enumerate(curves(steps, str(self._what.value)).items())
        ]
        self._chart.show(traces, y_label=axis)

    def _take(self) -> None:
        if self._run is not None:
            ui.download.content(netcdf_bytes(self._run), "motion.nc", "application/x-netcdf")

    # --- playing ------------------------------------------------------------------------------------------------------

    def _turn(self) -> None:
        """Play from where it is, from the start at the end; or pause."""
        if self._timer.active:
            self.pause()
            return
        if len(self._steps) < 2:
            return
        if int(self._slider.value) >= len(self._steps) - 1:
            self._stage.view.clear_trail()
            self._show(0)
        self._began = time.perf_counter(), float(self._steps[int(self._slider.value)].time or 0.0)
        self._timer.active = True
        self._look()

    def pause(self) -> None:
        """Stop playing; what is shown stays."""
        if self._timer.active:
            self._timer.active = False
            self._look()

    def _look(self) -> None:
        playing = self._timer.active
        self._button.set_text("Pause" if playing else "Play")
        self._button.props(f"icon={'pause' if playing else 'play_arrow'}")

    def _tick(self) -> None:
        if self._began is None or not self._steps or self._row.running:
            self.pause()
            return
        clock, first = self._began
        now = first + (time.perf_counter() - clock) * float(self._speed.value or 1.0)
        times = np.array([step.time for step in self._steps], float)
        place = int(np.searchsorted(times, now, side="right")) - 1
        if place != int(self._slider.value):
            self._show(place)
        if place >= len(times) - 1:
            self.pause()

    def _moved(self) -> None:
        """Show the time that a person drags to."""
        if not self._timer.active:
            self._show(int(self._slider.value))

    def _row_chosen(self, row: int) -> None:
        self.pause()
        self._show(row)

    def _show(self, place: int) -> None:
        if not 0 <= place < len(self._steps):
            return
        step = self._steps[place]
        self._at.set_text(f"t = {step.time:.4g} s")
        if int(self._slider.value) != place:
            self._slider.set_value(place)
        if self._asked_scenario is not None:
            for play in self._stage.plays:
                play(at_time(self._asked_scenario, step), step)


def _figure(run: Run) -> Figure:
    view = view_of_run(run)
    assert view.moving is not None
    return dynamic_figure(view, view.moving)


def at_time(scenario: Scenario, step: Step) -> Scenario:
    """Return the scenario with the loads that act at a step's time."""
    task, t = scenario.task, float(step.time or 0.0)
    if not isinstance(task, DynamicTask):
        return scenario
    loads: Any = scenario.loads
    if task.asked.release and t > 0:
        loads = replace(loads, tip_force=(0.0, 0.0, 0.0), tip_moment=(0.0, 0.0, 0.0))
    if task.forces is not None:
        more = [np.interp(t, task.times, column) for column in np.asarray(task.forces, float).T]
        loads = replace(loads, tip_force=tuple(float(a + b) for a, b in zip(loads.tip_force, more, strict=True)))
    return replace(scenario, loads=loads)
