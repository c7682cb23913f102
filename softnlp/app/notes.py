"""What the study of a tab cannot do with the robot or the obstacles on the screen, in a sentence."""

from __future__ import annotations

from nicegui import ui

from softnlp.app.controls import named
from softnlp.app.session import Session
from softnlp.model.segments import SegmentedRobot
from softnlp.scenario.segments import OF_SEGMENTS

STUDY_WORDS = {
    "forward": "Kinematics",
    "blocked-force": "The blocked force",
    "workspace": "The workspace",
    "inverse": "Inverse kinematics",
    "identify": "Identification",
    "design": "The design",
    "dynamic": "The motion over time",
    "compare": "The comparison with measurements",
    "sensitivity": "The sensitivity",
}


def study_words(session: Session, study: str | None = None) -> str:
    """Return what a study is called in a sentence; that on the screen without one."""
    return STUDY_WORDS.get(study or session.document.study, "This study")


def note_words(session: Session, study: str | None, name: str) -> str:
    """Return what a tab leaves out or refuses, "" for nothing.

    study, name : of the tab; a tab of any study has None.
    """
    found = []
    alone = study is None and name in STUDY_WORDS  # tabs of any study that take one robot alone
    words = study_words(session, name if alone else study)
    several = bool(session.rows("segment"))
    varies = not several and session.scenario is not None and isinstance(session.scenario.robot, SegmentedRobot)
    if (several or varies) and (alone or study not in (None, *OF_SEGMENTS)):
        what = "a robot of several segments" if several else "a robot that varies along its length"
        found.append(f"{words} does not take {what}; one uniform segment is needed.")
    if session.rows("obstacle") and (alone or (study is not None and not session.takes("obstacle"))):
        found.append(f"{words} does not take obstacles{'' if alone else ', which are left out here'}.")
    return " ".join(found)


def tab_note(session: Session, study: str | None, name: str) -> None:
    """Build the place of that sentence in the current slot."""
    note = named(ui.label().classes("text-sm text-orange-800 dark:text-orange-300 pt-2"), f"{name}.note")

    def refresh() -> None:
        if study is not None and study != session.document.study:
            return  # of a tab that is not open
        note.set_text(note_words(session, study, name))
        note.set_visibility(bool(note.text))

    session.follow(refresh)
