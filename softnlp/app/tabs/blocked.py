"""The blocked-force tab: the wall, how the chambers answer to it, and the force against the pressure."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from nicegui import ui
from numpy.typing import NDArray

from softnlp.app import controls
from softnlp.app.asking import Progress, bars, run_steps, said, scenario_with
from softnlp.app.conventions import ENERGY, is_energy
from softnlp.app.examples import empty_state
from softnlp.app.parts import Chart, NumberTable, line, study_row
from softnlp.app.session import Session, Stage
from softnlp.app.tabs.sequence import deviations
from softnlp.base.columns import OUTPUTS
from softnlp.base.errors import InputError
from softnlp.base.units import BAR
from softnlp.figures.style import colour
from softnlp.model.contact_settings import NO_CLOSURE
from softnlp.statics.step import Run, Step

Table = dict[str, Any]
Array = NDArray[np.float64]
Curve = tuple[str, list[Step]]
"""Of force against pressure: what it is of, and its steps so far."""

STUDY = "blocked-force"
MOST_CURVES = 7  # colours that can be told apart
CLOSURES: Mapping[str, str] = {
    "compliant": "chambers give way by k_c, one constant for all robots; within 6.5 % on the mean at 1.5 bar",
    "free": "no chamber constraint, a lower bound: forces come out 20 to 60 % low",
    "rigid": "chambers keep their free length, an upper bound: forces come out 3 to 5 times high",
    "weighted": "the paper's least squares, to compare with it: the force depends on the weights",
}
OF_ENERGY: Mapping[str, str] = {NO_CLOSURE: "the energy alone closes the equations, without a coefficient of the wall"}
_WEIGHTS = {
    "weight_force_per_N": "Weight of force, W_n [1/N]",
    "weight_moment_per_Nmm": "Weight of moment, W_m [1/(N mm)]",
    "weight_length_per_mm": "Weight of length, W_L [1/mm]",
    "weight_position_per_mm": "Weight of position, W_h [1/mm]",
}
_OF_A_WALL = ("offset_mm", "offsets_mm", "offset_ramp", "wall_point_mm", "wall_normal", "target_force_N", "tip_cap_mm")
_OF_A_FORCE = ("offsets_mm", "offset_ramp", "target_force_N", "weight_sensitivity")


def blocked_tab(stage: Stage) -> None:
    """Build the tab in the current slot."""
    with ui.column().classes("w-full gap-3 pt-2"):
        empty_state(stage.session, "blocked-force")
        _contact_fields(stage.session)
        ui.separator()
        _Curves(stage.session)
        ui.separator()
        _target(stage.session)


def _contact_fields(session: Session) -> None:
    """Show the keys of [contact]."""

    def table() -> Table:
        return session.table("contact")

    def closure() -> str:
        return closure_of(session)

    controls.heading("Contact")
    mode = controls.toggle({"blocked": "Blocked by a wall", "constrained": "Chambers held"}, "contact.mode")
    select = controls.select([], "contact.closure", "Closure")
    good_for = ui.label("").classes(f"{controls.HINT} -mt-2")
    reaction = controls.number_field(
        session,
        "contact",
        "chamber_reaction",
        "Chamber reaction, k_c",
        default=lambda: None if session.scenario is None else session.scenario.coefficients.chamber_reaction,
        step=0.05,
    )
    with ui.column().classes("w-full gap-2") as weights:
        for key, label in _WEIGHTS.items():
            controls.number_field(session, "contact", key, label, "")
    with ui.column().classes("w-full gap-2") as wall:
        controls.number_field(session, "contact", "tip_cap_mm", "Tip cap, L_t", step=1)
        anywhere = controls.named(ui.switch("Wall by point and normal").props("dense"), "contact.wall")
        offset = controls.number_field(
            session, "contact", "offset_mm", "Offset of the wall, h", default=lambda: 0.0, step=1
        )
        with ui.column().classes("w-full gap-2") as place:
            controls.vector_field(session, "contact", "wall_point_mm", ("Point x", "y", "z"), "mm")
            controls.vector_field(
                session, "contact", "wall_normal", ("Normal x", "y", "z"), "", default=(1.0, 0.0, 0.0)
            )
            ui.label("The normal is the way in which the wall pushes the robot.").classes(controls.HINT)

    def refresh() -> None:
        held = table().get("mode", "blocked") == "constrained"
        mode.set_value("constrained" if held else "blocked")
        known = closures_of(session)
        offered = {k: f"{k.capitalize()}: {use}" for k, use in known.items() if not (held and k == "free")}
        select.set_options(offered, value=closure() if closure() in offered else None)
        select.props(f'display-value="{closure().capitalize()}"' if closure() in known else 'display-value=""')
        good_for.set_text(known.get(closure(), ""))
        mode.set_visibility(held or known is CLOSURES)  # the energy section holds no chambers
        placed = "wall_point_mm" in table() or "wall_normal" in table()
        anywhere.set_value(placed)
        for element, shown in (
            (reaction, closure() == "compliant"),
            (weights, closure() == "weighted"),
            (wall, not held),
            (place, placed),
            (offset, not placed),
        ):
            element.set_visibility(shown)
        controls.tell_problem(session, select, "contact", "closure", "mode")

    aside: Table = {}

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
        session.put("contact", new)

    def choose_closure(closure: str | None) -> None:
        if closure is not None and closure != closure_of(session):
            session.put("contact", with_closure(table(), closure))

    def choose_wall(placed: bool) -> None:
        if placed != ("wall_point_mm" in table()):
            session.put("contact", with_wall(table(), placed))

    session.follow(refresh)
    mode.on_value_change(lambda event: choose_mode(str(event.value)))
    select.on_value_change(lambda event: choose_closure(event.value))
    anywhere.on_value_change(lambda event: choose_wall(event.value))


class _Curves:
    """The force against the pressure: run, drawn as it comes, kept for comparison."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._kept: list[Curve] = []
        self._last: Curve | None = None
        self._pressures: list[Array] = []
        controls.heading("Force against pressure")
        self._source = controls.toggle(
            {"ramp": "Ramp to the pose shown", "steps": "Scenario's steps"}, "blocked.source", "ramp"
        )
        self._count = controls.number("Steps", "blocked.steps", value=11, min=2, max=1000, precision=0).classes(
            "w-full"
        )
        self._count.bind_visibility_from(self._source, "value", value="ramp")
        self._row = study_row("blocked", "Run the curve", self._asked, self._finish, self._draw)
        self._chart = Chart("blocked.chart", "pressure [bar]", OUTPUTS["blocked_force"].axis)
        with ui.row().classes("gap-1") as self._buttons:
            controls.button("Keep curve", "push_pin", "blocked.keep", self._keep)
            controls.button("Clear kept", "clear_all", "blocked.clear", self._clear)
        self._buttons.set_visibility(False)
        self._table = NumberTable("blocked.table", self._show_pressure)

    def _finish(self, run: Run) -> None:
        self._draw()
        self._row.say(said(run))
        forces = {OUTPUTS["blocked_force"].heading: force_points(run.steps)[1]}
        self._table.show_steps(run, forces, "force_pressure.csv")
        self._pressures = [step.pressure for step in run.steps]

    def _asked(self) -> Callable[[Progress], Run]:
        contact, count = of_a_curve(self._session.table("contact")), self._count.value
        tables: dict[str, Table] = {"contact": contact}
        if self._source.value == "ramp":
            if not (count and 2 <= count <= 1000):
                raise InputError("Steps: expected a whole number from 2 to 1000")
            tables["pressure"] = {"sequence_bar": rising(self._session.pressure, int(count))}
        asked = scenario_with(self._session, STUDY, tables)
        held = contact.get("mode") == "constrained"
        steps: list[Step] = []
        closed = ENERGY if is_energy(self._session.document) else contact.get("closure", "compliant")
        self._last = f"{closed}{', held' if held else ''}, {asked.robot.name}", steps
        return lambda progress: run_steps(asked, progress, steps.append)

    def _draw(self) -> None:
        curves = [*self._kept, *([self._last] if self._last and self._last[1] else [])]
        lines = [
            line(*force_points(list(steps)), colour(k), name, *deviations(list(steps), OUTPUTS["blocked_force"]))
            for k, (name, steps) in enumerate(curves)
        ]
        self._chart.show(lines)
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
        if row < len(self._pressures):
            self._session.use_pressure(self._pressures[row])


def _target(session: Session) -> None:
    """Find the pressure of a force."""
    controls.heading("Pressure for a force")
    with ui.row().classes("w-full gap-2 no-wrap"):
        force = controls.number("Force wanted", "blocked.target", "N", value=0.5, step=0.1).classes("grow")
        highest = controls.number("Highest pressure", "blocked.highest", "bar", value=1.5, step=0.1).classes("grow")
    found: list[Step] = []

    def asked() -> Callable[[Progress], Run]:
        found.clear()
        use.set_visibility(False)
        if force.value is None or highest.value is None:
            raise InputError("expected a force and a highest pressure")
        tables = {
            "contact": of_a_target(session.table("contact"), float(force.value)),
            "pressure": {"sequence_bar": pushing(session.pressure, float(highest.value))},
        }
        scenario = scenario_with(session, STUDY, tables)
        return lambda progress: run_steps(scenario, progress)

    def finish(run: Run) -> None:
        if not run.steps:
            return
        step = run.steps[-1]
        if step.status.has_solution and step.contact is not None:
            found.append(step)
            row.say(f"{step.contact.force:.4g} N at {bars(step.pressure)} bar")
            use.set_visibility(True)
        else:
            row.warn(step.message)

    row = study_row("blocked.find", "Find the pressure", asked, finish)
    use = controls.button("Use this pressure", "tune", "blocked.use", lambda: session.set_pressure(found[0].pressure))
    use.set_visibility(False)


def closures_of(session: Session) -> Mapping[str, str]:
    """Return the closures that the conventions on the screen have, with what they are good for."""
    return OF_ENERGY if is_energy(session.document) else CLOSURES


def closure_of(session: Session) -> str:
    """Return the closure of the scenario."""
    standard = NO_CLOSURE if is_energy(session.document) else "compliant"
    return str(session.table("contact").get("closure", standard))


def with_closure(table: Table, closure: str) -> Table:
    """Return the table under another closure, without the weights where they mean nothing."""
    kept = {key: v for key, v in table.items() if closure == "weighted" or not key.startswith("weight_")}
    return _with(kept, "closure", closure, "compliant")


def with_mode(table: Table, mode: str) -> Table:
    """Return the table in another mode: where only the chambers are held there is no wall, and they are held."""
    if mode == "constrained":
        table = {key: value for key, value in table.items() if key not in (*_OF_A_WALL, "weight_sensitivity")}
        if table.get("closure") == "free":
            table = with_closure(table, "compliant")
    return _with(table, "mode", mode, "blocked")


def with_wall(table: Table, anywhere: bool) -> Table:
    """Return the table with a wall by point and normal, at first where the offset had it, or with an offset.

    The normal is that of a wall which the unbent tip, at x = 0, is not behind.
    """
    plain = {key: v for key, v in table.items() if key not in ("offset_mm", "wall_point_mm", "wall_normal")}
    if not anywhere:
        return plain
    offset = table.get("offset_mm", 0.0)
    return {**plain, "wall_point_mm": [offset, 0.0, 0.0], "wall_normal": [-1.0 if offset > 0 else 1.0, 0.0, 0.0]}


def of_a_curve(table: Table) -> Table:
    """Return the table that asks for the force at each pressure."""
    return {key: value for key, value in table.items() if key not in _OF_A_FORCE}


def of_a_target(table: Table, force: float) -> Table:
    """Return the table that asks for the pressure of a force [N]."""
    return {**of_a_curve(table), "target_force_N": force}


def rising(pressure: Array, steps: int) -> list[list[float]]:
    """Return rows [bar] that rise together from zero to a pressure (sets,) [Pa]."""
    return [[float(f"{p / BAR * k / (steps - 1):.12g}") for p in pressure] for k in range(steps)]


def pushing(pressure: Array, highest_bar: float) -> list[list[float]]:
    """Return the row [bar] that bounds the search for a force: the highest in the sets with pressure, or the first."""
    sets = pressure > 0 if np.any(pressure > 0) else np.arange(len(pressure)) == 0
    return [[highest_bar if pushes else 0.0 for pushes in sets]]


def force_points(steps: Sequence[Step]) -> tuple[list[float], list[float]]:
    """Return the largest pressure [bar] and the wall's force [N] of each step, nan where it has no solution."""
    bars = [float(step.pressure.max()) / BAR for step in steps]
    forces = [step.contact.force if step.status.has_solution and step.contact else float("nan") for step in steps]
    return bars, forces


def _with(table: Table, key: str, value: Any, default: Any) -> Table:
    """Return the table with a key, which the default does not need."""
    rest = {k: v for k, v in table.items() if k != key}
    return rest if value == default else {**rest, key: value}
