"""The pinned states: their bodies as ghosts in the view, and a column of differences for each beside the numbers."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial

from nicegui import ui

from softnlp.app.controls import HINT, SMALL, button, named
from softnlp.app.panels.results import step_lines
from softnlp.app.pins import Pin, pin_of, pins_csv, recalled, rows, stored
from softnlp.app.session import Stage
from softnlp.base.errors import InputError
from softnlp.statics.step import Run

KEPT = "softnlp.pins"
LONGEST_NAME = 40


class PinsPanel:
    """The pins of a page. run : a function that gives the run shown, of one step, or None."""

    def __init__(self, stage: Stage, run: Callable[[], Run | None], kept: str = "") -> None:
        """Build the panel in the current slot, with the pins that the browser kept."""
        self._stage, self._run = stage, run
        self.pins: list[Pin] = []
        self._cells: dict[tuple[int, str], ui.label] = {}
        self._told: dict[int, ui.label] = {}
        self._built: list[str] = []
        self._box = ui.column().classes("w-full gap-2 pt-2")
        if kept:
            try:
                self.pins = recalled(kept)
            except InputError:
                self.pins = []
        self._changed(keep=False)

    def pin(self) -> None:
        """Pin what is on the screen."""
        run = self._run()
        if run is None:
            return
        try:
            self.pins.append(pin_of(run, self._stage.session.state(), "", self.pins))
        except InputError as error:
            ui.notify(error.message, type="warning")
            return
        self._changed()

    def show(self, run: Run) -> None:
        """Write the differences of a run of one step."""
        if not self.pins:
            return
        lines = step_lines(run).numbers
        if self._built != [line.key for line in lines]:
            self._build()
            return
        now = self._stage.session.state()
        for line, _, less in rows(lines, self.pins):
            for pin, value in zip(self.pins, less, strict=True):
                self._cells[pin.place, line.key].set_text(difference(value))
        for pin in self.pins:
            self._told[pin.place].set_text(f"Now: {pin.differs(now)}")

    def _changed(self, keep: bool = True) -> None:
        self._stage.view.pins([pin.message() for pin in self.pins])
        self._build()
        if keep:
            text = json.dumps(stored(self.pins))
            ui.run_javascript(f"sessionStorage.setItem({json.dumps(KEPT)}, {text})")

    def _build(self) -> None:
        """Build a line for each pin and the table of differences."""
        self._box.clear()
        self._cells, self._told = {}, {}
        run = self._run()
        lines = [] if run is None else step_lines(run).numbers
        self._built = [line.key for line in lines]
        self._box.set_visibility(bool(self.pins))
        if not self.pins:
            return
        with self._box:
            with ui.row().classes("w-full items-center justify-between no-wrap"):
                ui.label("Pinned states").classes("text-base font-medium").props('role=heading aria-level="2"')
                button("CSV", "download", "pins.csv", self._take)
            for pin in self.pins:
                self._line(pin)
            columns = f"minmax(0,1fr) repeat({len(self.pins)}, minmax(58px, auto))"
            with ui.grid(columns=columns).classes("w-full gap-x-2 gap-y-0 text-sm"):
                ui.label("Now less the pin").classes("opacity-80")
                for pin in self.pins:
                    ui.label(pin.letter).classes("text-right font-medium").style(
                        f"border-bottom: 2px solid {pin.colour}"
                    )
                for line in lines:
                    unit = f" [{line.unit}]" if line.unit else ""
                    ui.label(f"{line.label}{unit}").classes("opacity-80 truncate")
                    for pin in self.pins:
                        cell = named(ui.label("").classes("tabular-nums text-right"), f"pin.{pin.letter}.{line.key}")
                        self._cells[pin.place, line.key] = cell
        if run is not None:
            self.show(run)

    def _line(self, pin: Pin) -> None:
        """Build what names a pin, shows it again or takes it away."""
        with ui.row().classes("w-full items-center no-wrap gap-1"):
            mark = ui.label(pin.letter).classes("w-6 h-6 rounded-full text-center font-semibold shrink-0 leading-6")
            mark.style(f"background: {pin.colour}; color: #111")
            name = named(ui.input(value=pin.name), f"pin.{pin.letter}.name").without_auto_validation()
            name.props(f'dense borderless maxlength={LONGEST_NAME} debounce=400 aria-label="name of pin {pin.letter}"')
            name.classes("grow min-w-0").on_value_change(lambda event: self._rename(pin.place, str(event.value or "")))
            for icon, act, words in (
                ("restore", self._restore, f"Show {pin.letter} again"),
                ("close", self._remove, f"Take pin {pin.letter} away"),
            ):
                control = button("", icon, f"pin.{pin.letter}.{icon}", partial(act, pin.place), f"{SMALL} round")
                control.props(f'aria-label="{words}"').tooltip(words)
        self._told[pin.place] = ui.label("").classes(f"{HINT} leading-tight break-words pl-7 -mt-1")

    def _at(self, place: int) -> Pin:
        return next(pin for pin in self.pins if pin.place == place)

    def _rename(self, place: int, name: str) -> None:
        self.pins = [replace(pin, name=name or pin.letter) if pin.place == place else pin for pin in self.pins]
        text = json.dumps(stored(self.pins))
        ui.run_javascript(f"sessionStorage.setItem({json.dumps(KEPT)}, {text})")

    def _restore(self, place: int) -> None:
        self._stage.session.restore(self._at(place).state)

    def _remove(self, place: int) -> None:
        self.pins = [pin for pin in self.pins if pin.place != place]
        self._changed()

    def _take(self) -> None:
        run = self._run()
        lines = [] if run is None else [*step_lines(run).numbers, *step_lines(run).chambers]
        ui.download.content(pins_csv(lines, self.pins), "pinned_states.csv", "text/csv")


def difference(value: float | None) -> str:
    """Return a difference as the page shows it, with its sign."""
    if value is None:
        return "–"
    text = f"{value:+.3f}" if abs(value) < 1000 else f"{value:+.4g}"
    return "0" if float(text) == 0 else text
