"""Gravity and the dead load at the tip."""

from __future__ import annotations

from math import isfinite
from typing import Any

from nicegui import ui

from softnlp.app.fields import choice_field, tell_problem
from softnlp.app.session import Session
from softnlp.scenario_schema import DIRECTIONS

_WORDS = {
    "off": "off",
    "-z": "standing on its base (-z)",
    "+z": "hanging from its base (+z)",
    "-x": "towards -x",
    "+x": "towards +x",
    "-y": "towards -y",
    "+y": "towards +y",
}


def loads_panel(session: Session) -> None:
    """Build the controls of [gravity] and [tip_load]."""
    choice_field(
        session, "gravity", "direction", "Gravity", {name: _WORDS[name] for name in DIRECTIONS}, default="off"
    ).props("data-testid=gravity-direction")
    vector_fields(session, "tip_load", "force_N", "Force at the tip", "N", step=0.01)
    vector_fields(session, "tip_load", "moment_Nmm", "Moment at the tip", "N mm", step=0.1)
    ui.label("World frame; dead loads keep their direction as the robot moves.").classes("text-xs opacity-70")


def vector_fields(session: Session, table: str, key: str, label: str, unit: str, *, step: float) -> None:
    """Show the three components of a vector of the scenario; all zero takes the key out."""

    def shown() -> list[float]:
        value = session.document.get(table, key)
        usable = isinstance(value, list) and len(value) == 3 and all(isinstance(v, int | float) for v in value)
        return [float(v) for v in value] if usable else [0.0, 0.0, 0.0]

    def entered(index: int, event: Any) -> None:
        value = event.value
        if value is None or not isfinite(value):
            fields[index].props('error error-message="expected a number"')
            return
        vector = shown()
        if value != vector[index]:
            vector[index] = float(value)
            session.change(table, key, vector if any(vector) else None)

    ui.label(f"{label} [{unit}]").classes("text-sm")
    fields: list[ui.number] = []
    with ui.row().classes("w-full no-wrap gap-2"):
        for index, axis in enumerate("xyz"):
            field = ui.number(axis, value=shown()[index], step=step)
            field.on_value_change(lambda e, index=index: entered(index, e))
            field.props("dense outlined debounce=250 hide-bottom-space").classes("min-w-0 grow basis-0")
            field.props(f"data-testid={table}-{key}-{axis}").mark(f"{table}.{key}.{axis}")
            field.without_auto_validation()
            fields.append(field)

    def refresh() -> None:
        for field, value in zip(fields, shown(), strict=True):
            if field.value != value:
                field.set_value(value)
            field.props(remove="error error-message")
        tell_problem(session, fields[0], table, key)

    session.on_scenario(refresh)
