"""A slider and a number for each chamber set, in the unit that a person chooses."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import ceil, isfinite
from typing import Any

import numpy as np
from nicegui import ui

from softnlp.app.controls import button, dashed
from softnlp.app.session import Session
from softnlp.app.theme import Redraw
from softnlp.base.ranges import PRESSURE
from softnlp.base.units import BAR
from softnlp.figures.style import colour


@dataclass(frozen=True)
class PressureUnit:
    """name : as shown. pascal : of one. step : of a slider, a round number near 10 mbar. decimals : shown."""

    name: str
    pascal: float
    step: float
    decimals: int

    def shown(self, pressure: float) -> float:
        """Return a pressure [Pa] as it is shown."""
        return round(pressure / self.pascal, self.decimals)


UNITS = (
    PressureUnit("bar", BAR, 0.01, 3),
    PressureUnit("kPa", 1e3, 1.0, 1),
    PressureUnit("psi", 6894.757293168361, 0.1, 2),
)
PRESSURE_UNITS: Mapping[str, PressureUnit] = {unit.name: unit for unit in UNITS}
FIRST_LIMIT = 1.5 * BAR  # of the sliders


class _Slider(ui.slider):
    """A slider whose own moves are not sent back to it: under load they would come late and pull it back."""

    LOOPBACK = False


@dataclass
class _Shown:
    """unit : of the controls. limit : right end of the sliders [Pa]."""

    unit: PressureUnit
    limit: float


def pressure_panel(session: Session) -> None:
    """Build the controls of the pressures."""
    state = _Shown(PRESSURE_UNITS["bar"], _limit(session, FIRST_LIMIT))
    with ui.row().classes("w-full items-center justify-between no-wrap"):
        units = dashed(ui.toggle(list(PRESSURE_UNITS), value="bar", on_change=lambda e: turn(e.value)), "pressure.unit")
        units.props("dense no-caps unelevated size=sm")
        button("All to zero", None, "pressure-zero", lambda: session.set_pressure(0 * session.pressure))
    rows = ui.column().classes("w-full gap-1")

    def turn(name: str) -> None:
        state.unit = PRESSURE_UNITS[name]
        rebuild()

    def rebuild() -> None:
        rows.clear()
        with rows:
            for k in range(len(session.pressure)):
                refreshers[k] = _row(session, state, k)
            with ui.row().classes("w-full items-center no-wrap"):
                ui.label("Sliders reach to").classes("text-xs opacity-70 grow")
                limit = ui.number(value=state.unit.shown(state.limit), min=0, on_change=reach)
                limit.props(f'dense borderless suffix="{state.unit.name}" data-testid=pressure-limit')
                limit.props("debounce=400 input-class=text-right").classes("w-28")
                limit.tooltip("Right end of the sliders; a number typed beside a slider may be higher")

    def reach(event: Any) -> None:
        value = event.value
        if isinstance(value, int | float) and isfinite(value) and 0 < value * state.unit.pascal <= PRESSURE.high * BAR:
            state.limit = max(value * state.unit.pascal, float(np.max(session.pressure, initial=0.0)))
            rebuild()
        else:
            ui.notify(f"expected a pressure above 0 and up to {PRESSURE.high:g} bar", type="warning")

    refreshers: dict[int, Callable[[], None]] = {}

    def follow() -> None:
        highest = _limit(session, state.limit)
        if len(refreshers) != len(session.pressure) or highest > state.limit:
            state.limit = highest
            refreshers.clear()
            rebuild()
        for refresh in refreshers.values():
            refresh()

    rebuild()
    later = Redraw(rows, follow, 0.08)  # the robot moves first
    session.on_pressure(later)
    session.on_scenario(later)


def _row(session: Session, state: _Shown, k: int) -> Callable[[], None]:
    """Build the controls of one set and return what brings them up to date."""
    unit = state.unit

    def shown() -> float:
        return unit.shown(float(session.pressure[k]))

    def entered(event: Any) -> None:
        value = event.value
        is_number = isinstance(value, int | float) and isfinite(value)
        if not is_number or not 0 <= value * unit.pascal <= PRESSURE.high * BAR:
            most = unit.shown(PRESSURE.high * BAR)
            field.props(f'error error-message="expected a pressure from 0 to {most:g} {unit.name}"')
            return
        field.props(remove="error error-message")
        if value != shown():
            pressure = session.pressure.copy()
            pressure[k] = value * unit.pascal
            session.set_pressure(pressure)

    with ui.row().classes("w-full items-center no-wrap gap-2"):
        ui.element("div").classes("shrink-0 rounded-full").style(f"width:12px;height:12px;background:{colour(k)}")
        ui.label(f"Set {k + 1}").classes("text-sm shrink-0 w-9")
        slider = _Slider(min=0, max=_ceil(state.limit, unit), step=unit.step, value=shown(), on_change=entered)
        dashed(slider, f"pressure.slider.{k + 1}").props(f'dense aria-label="pressure of set {k + 1}"')
        slider.classes("grow min-w-0").style(f"--q-primary: {colour(k)}")
        field = ui.number(value=shown(), step=unit.step, on_change=entered, min=0)
        field.props(f'dense outlined hide-bottom-space debounce=250 suffix="{unit.name}"')
        dashed(field.without_auto_validation(), f"pressure.number.{k + 1}").classes("w-24 shrink-0")

    def refresh() -> None:
        for control in (slider, field):
            control.set_value(shown())

    return refresh


def _limit(session: Session, at_least: float) -> float:
    """Return a right end of the sliders that shows every pressure of the scenario [Pa]."""
    scenario = session.scenario
    steps = scenario.pressures if scenario is not None else session.pressure
    return max(at_least, float(np.max(session.pressure, initial=0.0)), float(np.max(steps, initial=0.0)))


def _ceil(limit: float, unit: PressureUnit) -> float:
    return round(ceil(limit / unit.pascal / unit.step - 1e-9) * unit.step, unit.decimals)
