"""The blocked-force tab: the wall, how the chambers answer to it, and the force against the pressure."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from nicegui import ui
from numpy.typing import NDArray

from softnlp.app.asking import failures, run_steps, said, scenario_with, step_rows
from softnlp.app.fields import number_field, tell_problem, vector_field
from softnlp.app.parts import Chart, NumberTable, RunRow, line, plain_words
from softnlp.app.session import Session
from softnlp.app.stage import Stage
from softnlp.app.tabs.contact_table import (
    CLOSURES,
    WEIGHTS,
    force_points,
    of_a_curve,
    of_a_target,
    pushing,
    rising,
    with_closure,
    with_mode,
    with_wall,
)
from softnlp.base.columns import OUTPUTS
from softnlp.base.errors import InputError
from softnlp.base.units import BAR
from softnlp.figures.style import colour
from softnlp.results.table import table_text
from softnlp.statics.step import Run, Step

Array = NDArray[np.float64]

STUDY = "blocked-force"
MOST_CURVES = 7  # colours that can be told apart


def blocked_tab(stage: Stage) -> None:
    """Build the tab in the current slot."""
    with ui.column().classes("w-full gap-3 pt-2"):
        _contact_fields(stage.session)
        ui.separator()
        _Curves(stage.session)
        ui.separator()
        _target(stage.session)


def _contact_fields(session: Session) -> None:
    """Show the keys of [contact]."""

    def table() -> dict[str, Any]:
        return session.document.table("contact")

    def closure() -> str:
        return str(table().get("closure", "compliant"))

    ui.label("Contact").classes("text-base font-medium")
    mode = ui.toggle({"blocked": "Blocked by a wall", "constrained": "Chambers held"}).mark("contact.mode")
    mode.props("dense no-caps unelevated spread data-testid=contact.mode").classes("w-full")
    options = {key: f"{key.capitalize()}: {use}" for key, use in CLOSURES.items()}
    select = ui.select(options, label="Closure").classes("w-full").mark("contact.closure")
    select.props("dense outlined options-dense hide-bottom-space data-testid=contact.closure")
    select.without_auto_validation()
    good_for = ui.label("").classes("text-xs opacity-70 -mt-2")
    reaction = number_field(
        session,
        "contact",
        "chamber_reaction",
        "Chamber reaction, k_c",
        default=lambda: None if session.scenario is None else session.scenario.coefficients.chamber_reaction,
        step=0.05,
    )
    with ui.column().classes("w-full gap-2") as weights:
        for key, (label, unit) in WEIGHTS.items():
            number_field(session, "contact", key, f"{label} [{unit}]")
    with ui.column().classes("w-full gap-2") as wall:
        number_field(session, "contact", "tip_cap_mm", "Tip cap, L_t", "mm", default=lambda: 0.0, step=1)
        anywhere = ui.switch("Wall by point and normal").mark("contact.wall").props("dense data-testid=contact.wall")
        offset = number_field(
            session, "contact", "offset_mm", "Offset of the wall, h", "mm", default=lambda: 0.0, step=1
        )
        with ui.column().classes("w-full gap-2") as place:
            vector_field(session, "contact", "wall_point_mm", ("Point x", "y", "z"), "mm")
            vector_field(session, "contact", "wall_normal", ("Normal x", "y", "z"), "", default=(1.0, 0.0, 0.0))
            ui.label("The normal is the way in which the wall pushes the robot.").classes("text-xs opacity-70")

    def put(new: dict[str, Any]) -> None:
        if new != table():
            session.change_all("contact", new)

    def refresh() -> None:
        held = table().get("mode", "blocked") == "constrained"
        mode.set_value("constrained" if held else "blocked")
        offered = {key: words for key, words in options.items() if not (held and key == "free")}
        select.set_options(offered, value=closure() if closure() in offered else None)
        select.props(f'display-value="{closure().capitalize()}"' if closure() in CLOSURES else 'display-value=""')
        good_for.set_text(CLOSURES.get(closure(), ""))
        reaction.set_visibility(closure() == "compliant")
        weights.set_visibility(closure() == "weighted")
        wall.set_visibility(not held)
        placed = "wall_point_mm" in table() or "wall_normal" in table()
        anywhere.set_value(placed)
        place.set_visibility(placed)
        offset.set_visibility(not placed)
        tell_problem(session, select, "contact", "closure", "mode")

    refresh()

    def choose_closure(closure: str | None) -> None:
        if closure is not None:
            put(with_closure(table(), closure))

    def choose_wall(placed: bool) -> None:
        if placed != ("wall_point_mm" in table()):
            put(with_wall(table(), placed))

    aside: dict[str, Any] = {}

    def choose_mode(chosen: str) -> None:
        """Put the keys of the wall aside where there is none, and take them out again."""
        new = with_mode(table(), chosen)
        if chosen == table().get("mode", "blocked"):
            return
        if chosen == "constrained":
            aside.update({key: value for key, value in table().items() if key not in new})
        else:
            new = with_closure(aside | new, str((aside | new).get("closure", "compliant")))
            aside.clear()
        put(new)

    mode.on_value_change(lambda event: choose_mode(str(event.value)))
    select.on_value_change(lambda event: choose_closure(event.value))
    anywhere.on_value_change(lambda event: choose_wall(event.value))
    session.on_scenario(refresh)


@dataclass(eq=False)
class _Curve:
    """A force-pressure curve: what it is of, and its steps so far."""

    name: str
    steps: list[Step] = field(default_factory=list)


class _Curves:
    """The force against the pressure: run, drawn as it comes, kept for comparison."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._kept: list[_Curve] = []
        self._last: _Curve | None = None
        self._pressures: list[Array] = []
        ui.label("Force against pressure").classes("text-base font-medium")
        self._source = ui.toggle({"ramp": "Ramp to the pose shown", "steps": "Scenario's steps"}, value="ramp")
        self._source.props("dense no-caps unelevated spread data-testid=blocked.source").classes("w-full")
        self._source.mark("blocked.source")
        self._count = ui.number("Steps", value=11, min=2, max=1000, precision=0).mark("blocked.steps")
        self._count.props("dense outlined hide-bottom-space data-testid=blocked.steps").classes("w-full")
        self._count.bind_visibility_from(self._source, "value", value="ramp")
        self._row = RunRow("blocked", "Run the curve", self._begin)
        self._chart = Chart("blocked.chart", "pressure [bar]", OUTPUTS["blocked_force"].axis)
        with ui.row().classes("gap-1") as self._buttons:
            keep = ui.button("Keep curve", icon="push_pin", on_click=self._keep).mark("blocked.keep")
            keep.props("dense flat no-caps size=sm data-testid=blocked.keep")
            clear = ui.button("Clear kept", icon="clear_all", on_click=self._clear).mark("blocked.clear")
            clear.props("dense flat no-caps size=sm data-testid=blocked.clear")
        self._buttons.set_visibility(False)
        self._table = NumberTable("blocked.table", self._show_pressure)

    async def _begin(self) -> None:
        count = self._count.value
        if self._source.value == "ramp" and not (count and 2 <= count <= 1000):
            self._row.warn("Steps: expected a whole number from 2 to 1000")
            return
        try:
            contact = of_a_curve(self._session.document.table("contact"))
            tables: dict[str, Any] = {"contact": contact}
            if self._source.value == "ramp":
                tables["pressure"] = {"sequence_bar": rising(self._session.pressure, int(count))}
            asked = scenario_with(self._session, STUDY, tables)
        except InputError as error:
            self._row.warn(plain_words(error))
            return
        held = contact.get("mode") == "constrained"
        curve = _Curve(f"{contact.get('closure', 'compliant')}{', held' if held else ''}, {asked.robot.name}")
        self._last = curve
        run = await self._row.do(lambda progress: run_steps(asked, progress, curve.steps.append), self._draw)
        if run is not None:
            self._finish(run)

    def _finish(self, run: Run) -> None:
        self._draw()
        self._row.say(said(run))
        header, rows = step_rows(run, {OUTPUTS["blocked_force"].heading: force_points(run.steps)[1]})
        self._table.show(header, rows, "force_pressure.csv", csv=table_text(run), failed=failures(run))
        self._pressures = [step.pressure for step in run.steps]

    def _draw(self) -> None:
        curves = [*self._kept, *([self._last] if self._last and self._last.steps else [])]
        points = [(curve.name, *force_points(list(curve.steps))) for curve in curves]
        self._chart.show([line(x, y, colour(k), name) for k, (name, x, y) in enumerate(points)])
        self._buttons.set_visibility(bool(curves))

    def _keep(self) -> None:
        if self._last is None or self._row.running:
            return
        if len(self._kept) >= MOST_CURVES - 1:
            ui.notify(f"{MOST_CURVES - 1} curves are kept at most; clear them first", type="warning")
            return
        self._kept.append(self._last)
        self._last = None
        self._draw()

    def _clear(self) -> None:
        self._kept.clear()
        self._draw()

    def _show_pressure(self, row: int) -> None:
        if row < len(self._pressures) and len(self._pressures[row]) == len(self._session.pressure):
            self._session.set_pressure(self._pressures[row])


def _target(session: Session) -> None:
    """Find the pressure of a force."""
    ui.label("Pressure for a force").classes("text-base font-medium")
    with ui.row().classes("w-full gap-2 no-wrap"):
        force = ui.number("Force wanted", value=0.5, step=0.1).classes("grow").mark("blocked.target")
        force.props('dense outlined hide-bottom-space suffix="N" data-testid=blocked.target')
        highest = ui.number("Highest pressure", value=1.5, step=0.1).classes("grow").mark("blocked.highest")
        highest.props('dense outlined hide-bottom-space suffix="bar" data-testid=blocked.highest')
    found: list[Step] = []

    async def begin() -> None:
        found.clear()
        use.set_visibility(False)
        try:
            if force.value is None or highest.value is None:
                raise InputError("expected a force and a highest pressure")
            tables = {
                "contact": of_a_target(session.document.table("contact"), float(force.value)),
                "pressure": {"sequence_bar": pushing(session.pressure, float(highest.value))},
            }
            asked = scenario_with(session, STUDY, tables)
        except InputError as error:
            row.warn(plain_words(error))
            return
        run = await row.do(lambda progress: run_steps(asked, progress))
        if run is None or not run.steps:
            return
        step = run.steps[-1]
        if step.status.has_solution and step.contact is not None:
            found.append(step)
            bars = ", ".join(f"{p / BAR:.4g}" for p in step.pressure)
            row.say(f"{step.contact.force:.4g} N at {bars} bar")
            use.set_visibility(True)
        else:
            row.warn(step.message)

    def take() -> None:
        session.set_pressure(found[0].pressure)

    row = RunRow("blocked.find", "Find the pressure", begin)
    use = ui.button("Use this pressure", icon="tune", on_click=take)
    use.props("dense flat no-caps size=sm data-testid=blocked.use").mark("blocked.use").set_visibility(False)
