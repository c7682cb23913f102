"""The examples of the package: in the dialog that opens files, and where a tab has nothing to show yet."""

from __future__ import annotations

from functools import cache, partial

from nicegui import ui

from softnlp.app.controls import dismiss_refusals, named, refuse, select
from softnlp.app.session import Session
from softnlp.base.errors import SoftnlpError
from softnlp.scenario.examples import shipped_scenarios


@cache
def examples() -> dict[str, str]:
    """Return the title of every example that the page shows, by name: those of round chambers."""
    return {
        name: str(table.get("title") or name)
        for name, (_, table) in shipped_scenarios().items()
        if "chamber" not in table and not any("chamber" in segment for segment in table.get("segment", []))
    }


def open_example(session: Session, name: str) -> bool:
    """Show an example of the package; what is wrong is said, and then False is returned."""
    try:
        session.open_path(shipped_scenarios()[name][0])
    except SoftnlpError as error:
        refuse(f"not opened: {error}")
        return False
    dismiss_refusals()
    ui.notify(f"opened {session.name}", type="positive")
    return True


def example_choice(session: Session, dialog: ui.dialog) -> None:
    """Build a list of the examples, which opens the one chosen and closes a dialog."""

    def opened(name: str | None) -> None:
        if name is None:
            return
        box.set_value(None)
        if open_example(session, name):
            dialog.close()

    titles = {name: f"{name}: {title}" for name, title in examples().items()}
    box = select(titles, "open.example", "Or an example", with_input=True, clearable=True)
    box.on_value_change(lambda event: opened(event.value))


_EMPTY = {
    "blocked-force": ("blocked/D25L60_curve", "The robot pushes against a wall; its force is found."),
    "workspace": ("workspace/D25L60_grid", "Every pressure of a grid; the tips become a cloud in the view."),
    "inverse": ("inverse/circle", "Say where the tip shall be; the pressures that put it there are found."),
    "dynamic": ("dynamic/D25L60_step", "Pressures change over time, and the robot swings; its motion is found."),
    "identify": ("identify/measured_angles", "Drop what was measured; the constants that fit it are found."),
    "design": ("design/D25L60_dimensions", "Say what may be chosen and required; the best design is found."),
}
"""An example of each study, and what the study does."""


def empty_state(session: Session, study: str) -> None:
    """Say what a tab is for while nothing was asked of it, with an example to open."""
    name, words = _EMPTY[study]
    with named(ui.row().classes("w-full items-center gap-2 no-wrap softnlp-empty"), f"{study}.empty") as line:
        ui.label(words).classes("text-sm grow")
        button = ui.button("Open an example", icon="school", on_click=partial(open_example, session, name))
        named(button.props("dense outline no-caps size=sm").classes("px-2 shrink-0"), f"{study}.example")

    def show() -> None:
        line.set_visibility(not session.is_used(study))

    session.follow(show)
