"""Transcription, intervals, accuracy and tolerance."""

from __future__ import annotations

from math import isfinite
from typing import Any

from nicegui import ui

from softnlp.app.fields import choice_field, number_field, tell_problem
from softnlp.app.session import Session
from softnlp.numerics import Numerics

_TRANSCRIPTIONS = {"multiple-shooting": "multiple shooting, RK4", "collocation": "collocation"}


def solver_panel(session: Session) -> None:
    """Build the controls of [solver]."""
    choice_field(
        session, "solver", "transcription", "Transcription", _TRANSCRIPTIONS, default=Numerics.transcription
    ).props("data-testid=solver-transcription")
    _intervals(session)
    number_field(
        session, "solver", "accuracy", "Accuracy of the tip", "of L0", default=lambda: Numerics.accuracy, step=1e-6
    ).props("data-testid=solver-accuracy")
    number_field(
        session, "solver", "tolerance", "Tolerance of the equations", "scaled", default=lambda: Numerics.tolerance
    ).props("data-testid=solver-tolerance")


def _intervals(session: Session) -> None:
    """Show the number of intervals; an empty field means auto."""

    def shown() -> float | None:
        value = session.document.get("solver", "intervals")
        return float(value) if isinstance(value, int) and not isinstance(value, bool) else None

    def entered(event: Any) -> None:
        value = event.value
        if value == shown() or (value is not None and not isfinite(value)):
            return
        session.change("solver", "intervals", value if value is None or value != int(value) else int(value))

    field = ui.number("Intervals", value=shown(), placeholder="auto", on_change=entered, step=1)
    field.props("dense outlined clearable stack-label debounce=250 hide-bottom-space data-testid=solver-intervals")
    field.without_auto_validation()
    field.classes("w-full").mark("solver.intervals").tooltip("Empty: as many as the accuracy needs")

    def refresh() -> None:
        if field.value != shown():
            field.set_value(shown())
        tell_problem(session, field, "solver", "intervals")

    session.on_scenario(refresh)
