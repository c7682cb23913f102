"""Pinned states: what was on the screen, to stand beside what is there now."""

from __future__ import annotations

import json
from base64 import b64decode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from softnlp.app.history import State, changes
from softnlp.app.panels.results import Line, step_lines
from softnlp.app.view.frame import Tube, packed, pieces_message, tube_message, tube_of
from softnlp.base.errors import InputError
from softnlp.base.palette import COLOURS
from softnlp.base.units import BAR
from softnlp.model.inputs import robot_of_segments, robot_of_table, robot_table, segment_tables
from softnlp.model.robot import Robot
from softnlp.model.segments import SegmentedRobot
from softnlp.results import body_of_pose
from softnlp.results.document import csv_text
from softnlp.statics.step import Run, SectionRadii

MOST_PINS = 4
PIN_COLOURS = (COLOURS[3], COLOURS[4], COLOURS[5], "#7a5195")
_LETTERS = "ABCD"


@dataclass(frozen=True, eq=False)
class Pin:
    """A state that stays beside the one on the screen.

    name : a person's. place : from 0 to 3, of its colour. robot, tube : its picture. numbers : its results. state :
    what was on the screen, to be shown again.
    """

    name: str
    place: int
    robot: Robot
    tube: Tube
    numbers: tuple[Line, ...]
    state: State

    @property
    def letter(self) -> str:
        """Its sign in the view and above its column."""
        return _LETTERS[self.place]

    @property
    def colour(self) -> str:
        """Its colour."""
        return PIN_COLOURS[self.place]

    def message(self) -> dict[str, Any]:
        """Return it as the view draws it."""
        look = {"colour": self.colour, "label": self.letter}
        return {"robot": pieces_message(self.robot), "tube": tube_message(self.tube), **look}

    def differs(self, now: State) -> str:
        """Return in words what is different on the screen now."""
        same = self.state.own == now.own and self.state.pressure == now.pressure
        return "the same inputs" if same else "; ".join(changes(self.state, now))


def pin_of(run: Run, state: State, name: str, taken: Sequence[Pin]) -> Pin:
    """Return a pin of a run of one step.

    Raises
    ------
    InputError
        Where as many as there may be are pinned, or the step has no shape.
    """
    free = [place for place in range(MOST_PINS) if place not in [pin.place for pin in taken]]
    pose = run.steps[0].pose
    if not free:
        raise InputError(f"{MOST_PINS} states are pinned; take one away first")
    if pose is None:
        raise InputError("there is no solved pose to pin")
    tube = tube_of(body_of_pose(pose))
    lines = step_lines(run)
    numbers = (*lines.numbers, *lines.chambers)
    return Pin(name or _LETTERS[free[0]], free[0], run.robot, tube, numbers, state)


def rows(now: Sequence[Line], pins: Sequence[Pin]) -> list[tuple[Line, list[float | None], list[float | None]]]:
    """Return each number of now with those of the pins, and what is now less each of them."""
    found = []
    for line in now:
        pinned = [next((other.value for other in pin.numbers if other.key == line.key), None) for pin in pins]
        less = [None if line.value is None or value is None else line.value - value for value in pinned]
        found.append((line, pinned, less))
    return found


def pins_csv(now: Sequence[Line], pins: Sequence[Pin]) -> str:
    """Return the pinned states as CSV: a row for each number, now and in each pin, and now less the pin."""
    header = ["number", "unit", "now", *(p.name for p in pins), *(f"now less {p.name}" for p in pins)]
    table: list[list[Any]] = [
        [line.label, line.unit, line.value, *pinned, *less] for line, pinned, less in rows(now, pins)
    ]
    most = max((len(pin.state.pressure) for pin in pins), default=0)
    for k in range(most):
        bars = [pin.state.pressure[k] / BAR if k < len(pin.state.pressure) else None for pin in pins]
        table.append([f"pressure of set {k + 1}", "bar", None, *bars, *[None] * len(pins)])
    return csv_text(header, table)


def stored(pins: Sequence[Pin]) -> str:
    """Return pins as text that a browser keeps."""
    return json.dumps([_stored(pin) for pin in pins])


def recalled(text: str) -> list[Pin]:
    """Return the pins of a `stored` text.

    Raises
    ------
    InputError
        For any other text.
    """
    try:
        return [_recalled(table) for table in json.loads(text)][:MOST_PINS]
    except (ValueError, KeyError, TypeError, AttributeError, IndexError):
        raise InputError("expected the pins that a tab of this app had kept") from None


def _stored(pin: Pin) -> dict[str, Any]:
    return {
        "name": pin.name,
        "place": pin.place,
        "robot": segment_tables(pin.robot) if isinstance(pin.robot, SegmentedRobot) else robot_table(pin.robot),
        "segmented": isinstance(pin.robot, SegmentedRobot),
        "tube": _stored_tube(pin.tube),
        "numbers": [[line.key, line.label, line.text, line.unit, line.value] for line in pin.numbers],
        "state": {**vars(pin.state)},
    }


def _stored_tube(tube: Tube) -> dict[str, Any]:
    axis = np.column_stack([tube.position, tube.quaternion])
    radii = [np.asarray(getattr(tube.radii, field.name)).tolist() for field in fields(tube.radii)]
    return {"axis": packed(axis, np.float32), "radii": radii, "parts": [_stored_tube(part) for part in tube.parts]}


def _recalled(table: Mapping[str, Any]) -> Pin:
    state = dict(table["state"])
    state["pressure"] = tuple(map(float, state["pressure"]))
    place, numbers = int(table["place"]), table["numbers"]
    if not 0 <= place < MOST_PINS:
        raise ValueError(place)
    robot = robot_of_segments(table["robot"]) if table["segmented"] else robot_of_table(table["robot"])
    return Pin(
        str(table["name"])[:40],
        place,
        robot,
        _recalled_tube(table["tube"]),
        tuple(Line(str(key), str(label), str(text), str(unit), value) for key, label, text, unit, value in numbers),
        State(**state),
    )


def _recalled_tube(table: Mapping[str, Any]) -> Tube:
    axis = np.frombuffer(b64decode(table["axis"]), "<f4").astype(float).reshape(-1, 7)
    radii: Any = [np.asarray(one, float) if isinstance(one, list) else float(one) for one in table["radii"]]
    return Tube(axis[:, :3], axis[:, 3:], SectionRadii(*radii), tuple(map(_recalled_tube, table["parts"])))
