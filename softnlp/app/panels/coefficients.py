"""Stiffening and correction coefficients, and how ambiguous equations are read."""

from __future__ import annotations

from collections.abc import Callable

from nicegui import ui

from softnlp.app.fields import choice_field, number_field
from softnlp.app.session import Session
from softnlp.model.conventions import COEFFICIENT_SETS, CONVENTIONS

_FIELDS = (
    ("stiffening", "elongation", "k_e, axial stiffening, Eq. (10)", 0.05),
    ("stiffening", "bending", "k_b, bending stiffening, Eq. (12)", 0.05),
    ("corrections", "area", "k_a, factor of the silicone's area", 0.01),
    ("corrections", "inertia", "k_i, factor of its second moments of area", 0.01),
    ("corrections", "bore_fraction", "phi, how far the pressure acts towards the thread", 0.05),
)
_CONVENTIONS = {
    "reproduction": "reproduction: as the published results need",
    "as_printed": "as printed in the paper",
}


def coefficients_panel(session: Session) -> None:
    """Build the controls of [stiffening] and [corrections]."""
    choice_field(
        session, "stiffening", "set", "Set of coefficients", list(COEFFICIENT_SETS), default="reproduction"
    ).props("data-testid=stiffening-set")

    def standard(name: str) -> Callable[[], float | None]:
        def of_set() -> float | None:
            chosen = COEFFICIENT_SETS.get(session.document.get("stiffening", "set", "reproduction"))
            return None if chosen is None else float(getattr(chosen, name))

        return of_set

    for table, key, label, step in _FIELDS:
        field = number_field(session, table, key, label, default=standard(key), step=step)
        field.props(f"data-testid={table}-{key} clearable")
    with ui.row().classes("w-full no-wrap gap-2"):
        ui.button("No stiffening", on_click=lambda: switch_off(session)).props(
            "flat dense no-caps size=sm data-testid=no-stiffening"
        ).tooltip("k_e = k_b = 0")
        ui.button("Back to the set", on_click=lambda: back_to_set(session)).props(
            "flat dense no-caps size=sm data-testid=coefficients-back"
        )
    choice_field(
        session,
        "corrections",
        "conventions",
        "Conventions",
        {name: _CONVENTIONS[name] for name in CONVENTIONS},
        default="reproduction",
    ).props("data-testid=conventions")


def switch_off(session: Session) -> None:
    """Set both stiffening coefficients to zero."""
    kept = session.document.table("stiffening")
    session.change_all("stiffening", kept | {"elongation": 0.0, "bending": 0.0})


def back_to_set(session: Session) -> None:
    """Leave every coefficient to the set."""
    chosen = {key: value for key, value in session.document.table("stiffening").items() if key == "set"}
    session.document.replace("stiffening", chosen)
    kept = {key: value for key, value in session.document.table("corrections").items() if key == "conventions"}
    session.change_all("corrections", kept)
