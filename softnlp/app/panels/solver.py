"""Engine, transcription, intervals, accuracy and tolerance."""

from __future__ import annotations

from softnlp.app.fields import choice_field, number_field
from softnlp.app.session import Session
from softnlp.model.numerics import Numerics

_TRANSCRIPTIONS = {"multiple-shooting": "multiple shooting, RK4", "collocation": "collocation"}

_ENGINES = {
    "auto": "Newton, closed by IPOPT",
    "ipopt": "IPOPT for every solve",
    "newton": "Newton alone",
}


def solver_panel(session: Session) -> None:
    """Build the controls of [solver]."""
    choice_field(session, "solver", "engine", "Engine", _ENGINES, default=Numerics.engine).props(
        "data-testid=solver-engine"
    )
    choice_field(
        session, "solver", "transcription", "Transcription", _TRANSCRIPTIONS, default=Numerics.transcription
    ).props("data-testid=solver-transcription")
    intervals = number_field(session, "solver", "intervals", "Intervals", step=1, whole=True)
    intervals.props("clearable stack-label placeholder=auto data-testid=solver-intervals")
    intervals.tooltip("Empty: as many as the accuracy needs")
    number_field(
        session, "solver", "accuracy", "Accuracy of the tip", "of L0", default=lambda: Numerics.accuracy, step=1e-6
    ).props("data-testid=solver-accuracy")
    number_field(
        session, "solver", "tolerance", "Tolerance of the equations", "scaled", default=lambda: Numerics.tolerance
    ).props("data-testid=solver-tolerance")
