"""Gravity and the dead load at the tip."""

from __future__ import annotations

from nicegui import ui

from softnlp.app.fields import choice_field, vector_field
from softnlp.app.session import Session
from softnlp.model.gravity import DIRECTIONS, gravity_named, gravity_words

_WORDS = {
    "off": "off",
    "standing": "standing",
    "hanging": "hanging",
    **{name: f"{name}: {gravity_words(gravity_named(name))}" for name in DIRECTIONS if name[0] in "-+"},
}


def loads_panel(session: Session) -> None:
    """Build the controls of [gravity] and [tip_load]."""
    choice_field(session, "gravity", "direction", "Gravity", _WORDS, default="off").props(
        "data-testid=gravity-direction"
    )
    held = ui.label().classes("text-xs opacity-70").props("data-testid=gravity-words").mark("gravity.words")

    def say_held() -> None:
        held.set_text("" if session.scenario is None else gravity_words(session.scenario.loads.gravity))

    say_held()
    session.on_scenario(say_held)
    for key, label, unit, step in (
        ("force_N", "Force at the tip", "N", 0.01),
        ("moment_Nmm", "Moment at the tip", "N mm", 0.1),
    ):
        ui.label(f"{label} [{unit}]").classes("text-sm")
        vector_field(session, "tip_load", key, "xyz", "", step=step, written=False)
    ui.label("World frame; dead loads keep their direction as the robot moves.").classes("text-xs opacity-70")
