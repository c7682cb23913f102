"""Loads, coefficients and solver: the panels whose fields are the keys of their tables."""

from __future__ import annotations

from functools import partial

from nicegui import ui

from softnlp.app.controls import HINT, button, choice_field, dashed, number_field, select, vector_field
from softnlp.app.conventions import Aside, is_energy, turn
from softnlp.app.session import Session
from softnlp.model.conventions import COEFFICIENT_SETS
from softnlp.model.gravity import DIRECTIONS, gravity_named, gravity_words
from softnlp.rings import ALL_CONVENTIONS

_GRAVITY = {
    "off": "off",
    "standing": "standing",
    "hanging": "hanging",
    **{name: f"{name}: {gravity_words(gravity_named(name))}" for name in DIRECTIONS if name[0] in "-+"},
}
_TIP_LOADS = (("force_N", "Force at the tip [N]", 0.01), ("moment_Nmm", "Moment at the tip [N mm]", 0.1))
_COEFFICIENTS = (
    ("stiffening", "elongation", "k_e, axial stiffening, Eq. (10)", 0.05),
    ("stiffening", "bending", "k_b, bending stiffening, Eq. (12)", 0.05),
    ("corrections", "area", "k_a, factor of the silicone's area", 0.01),
    ("corrections", "inertia", "k_i, factor of its second moments of area", 0.01),
    ("corrections", "bore_fraction", "phi, how far the pressure acts towards the thread", 0.05),
)
_CONVENTIONS = {
    "reproduction": "reproduction: as the published results need",
    "as_printed": "as printed in the paper",
    "energy": "energy: one potential, no other coefficient",
}
_ENGINES = {
    "auto": "Newton, closed by IPOPT",
    "ipopt": "IPOPT for every solve",
    "newton": "Newton alone",
}
_TRANSCRIPTIONS = {"multiple-shooting": "multiple shooting, RK4", "collocation": "collocation"}


def loads_panel(session: Session) -> None:
    """Build the controls of [gravity] and [tip_load]."""
    choice_field(session, "gravity", "direction", "Gravity", _GRAVITY, default="off", test="gravity-direction")
    held = dashed(ui.label().classes(HINT), "gravity.words")

    def say_held() -> None:
        held.set_text("" if session.scenario is None else gravity_words(session.scenario.loads.gravity))

    session.follow(say_held)
    for key, label, step in _TIP_LOADS:
        ui.label(label).classes("text-sm")
        vector_field(session, "tip_load", key, "xyz", "", step=step, written=False)
    ui.label("World frame; dead loads keep their direction as the robot moves.").classes(HINT)


def coefficients_panel(session: Session) -> None:
    """Build the controls of [stiffening] and [corrections]: coefficients, and how ambiguous equations are read.

    The energy section has one coefficient of its own and none of the others.
    """
    aside = Aside()
    names = {name: _CONVENTIONS[name] for name in ALL_CONVENTIONS}
    conventions = select(names, "corrections.conventions", "Conventions", test="conventions")
    conventions.on_value_change(lambda event: turn(session, event.value, aside) if event.value is not None else None)

    def of_set(name: str) -> float | None:
        chosen = COEFFICIENT_SETS.get(session.document.get("stiffening", "set", "reproduction"))
        return None if chosen is None else float(getattr(chosen, name))

    with ui.column().classes("w-full gap-2") as paper:
        sets = list(COEFFICIENT_SETS)
        choice_field(session, "stiffening", "set", "Set of coefficients", sets, test="stiffening-set")
        for table, key, label, step in _COEFFICIENTS:
            standard = partial(of_set, key)
            field = number_field(session, table, key, label, default=standard, step=step, test=f"{table}-{key}")
            field.props("clearable")
        with ui.row().classes("w-full no-wrap gap-2"):
            button("No stiffening", None, "no-stiffening", partial(switch_off, session)).tooltip("k_e = k_b = 0")
            button("Back to the set", None, "coefficients-back", partial(back_to_set, session))
    factor = "c_m, factor of the stress"
    own = number_field(session, "corrections", "modulus_factor", factor, step=0.01, test="corrections-modulus_factor")
    own.props("clearable")

    def refresh() -> None:
        energy = is_energy(session.document)
        value = session.document.get("corrections", "conventions", "reproduction")
        conventions.set_value(value if value in names else None)
        paper.set_visibility(not energy)
        own.set_visibility(energy)

    session.follow(refresh)


def switch_off(session: Session) -> None:
    """Set both stiffening coefficients to zero."""
    session.change_all("stiffening", session.table("stiffening") | {"elongation": 0.0, "bending": 0.0})


def back_to_set(session: Session) -> None:
    """Leave every coefficient to the set."""
    for table, kept in (("stiffening", "set"), ("corrections", "conventions")):
        session.document.replace(table, {key: v for key, v in session.table(table).items() if key == kept})
    session.reread()


def solver_panel(session: Session) -> None:
    """Build the controls of [solver]."""
    choice_field(session, "solver", "engine", "Engine", _ENGINES, test="solver-engine")
    choice_field(session, "solver", "transcription", "Transcription", _TRANSCRIPTIONS, test="solver-transcription")
    intervals = number_field(session, "solver", "intervals", "Intervals", step=1, test="solver-intervals")
    intervals.props("clearable stack-label placeholder=auto").tooltip("Empty: as many as the accuracy needs")
    number_field(session, "solver", "accuracy", "Accuracy of the tip", "of L0", step=1e-6, test="solver-accuracy")
    number_field(session, "solver", "tolerance", "Tolerance of the equations", "scaled", test="solver-tolerance")
