"""What a pose comes to beside its one set of numbers: what each obstacle does, and each segment by itself."""

from __future__ import annotations

from typing import Any

import numpy as np
from nicegui import ui

from softnlp.app.controls import HINT, named
from softnlp.app.parts import NumberTable
from softnlp.base.columns import OUTPUTS
from softnlp.base.units import MILLIMETRE, NEWTON_MILLIMETRE
from softnlp.statics.step import Run, Step

CONTACTS = ("obstacle", "F [N]", "x", "y", "z", "at s/L", OUTPUTS["gap"].axis)
_TIP, _STRETCH, _BEND = (OUTPUTS[name] for name in ("tip_position", "stretch", "bending_angle"))
SEGMENTS = ("no.", f"tip x [{_TIP.unit}]", "y", "z", _STRETCH.label, f"bending [{_BEND.unit.sign}]")


class FoundTables:
    """Two tables beneath the numbers, each there only where it has something to say."""

    def __init__(self) -> None:
        """Build them in the current slot, empty."""
        with ui.column().classes("w-full gap-1 py-2") as self._contacts:
            ui.label("Obstacles").classes("text-base font-medium").props("role=heading aria-level=2")
            self._contact_table = NumberTable("contacts", height="16rem")
            self._complementarity = named(ui.label().classes(HINT), "complementarity")
        with ui.column().classes("w-full gap-1 py-2") as self._segments:
            ui.label("Segments").classes("text-base font-medium").props("role=heading aria-level=2")
            self._segment_table = NumberTable("segments", height="12rem")
        for box in (self._contacts, self._segments):
            box.set_visibility(False)

    def show(self, run: Run) -> None:
        """Show the only step of a run."""
        step = run.steps[0]
        self._contacts.set_visibility(bool(step.contacts))
        if step.contacts:
            self._contact_table.show(CONTACTS, contact_rows(step), "contacts.csv")
            size = (step.complementarity or 0.0) / NEWTON_MILLIMETRE
            self._complementarity.set_text(f"Complementarity {size:.1e} N mm: each push times its gap, 0 if exact.")
        several = step.pose is not None and len(step.pose.segments) > 1
        self._segments.set_visibility(several)
        if several:
            self._segment_table.show(SEGMENTS, segment_rows(step), "segments.csv")


def contact_rows(step: Step) -> list[list[Any]]:
    """Return what each obstacle does: its size, its parts, where it touches, and the gap."""
    return [
        [
            one.obstacle,
            round(float(np.linalg.norm(one.force)), 4),
            *(round(float(part), 4) + 0.0 for part in one.force),
            where(one.start, one.end),
            round(one.gap / MILLIMETRE, 3) + 0.0,
        ]
        for one in step.contacts
    ]


def where(start: float | None, end: float | None) -> str:
    """Return where the robot touches, fractions of its length, in words."""
    if start is None or end is None:
        return "–"
    return f"{start:.2f}" if f"{start:.2f}" == f"{end:.2f}" else f"{start:.2f}–{end:.2f}"


def segment_rows(step: Step) -> list[list[Any]]:
    """Return where each segment ends, how it is stretched and by how much it bends."""
    assert step.pose is not None
    return [
        [
            k + 1,
            *(round(float(x), 3) + 0.0 for x in _TIP.shown(part.tip_position)),
            round(float(part.stretch), 5),
            round(float(_BEND.shown(part.bending_angle)), 3),
        ]
        for k, part in enumerate(step.pose.segments)
    ]
