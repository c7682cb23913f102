"""Undo, redo and the list of what happened, by buttons and by Ctrl+Z and Ctrl+Y; a link to what is on the screen."""

from __future__ import annotations

from functools import partial

from nicegui import ui

from softnlp.app.controls import button, refuse
from softnlp.app.history import History, State
from softnlp.app.links import packed
from softnlp.app.session import Session
from softnlp.app.theme import Redraw
from softnlp.base.errors import InputError

_REST_S = 0.35  # after which a drag of a slider is one state
_SHOWN = 40  # states of the list
# In a field or an editor the keys are those of the text.
_KEYS = """
document.addEventListener("keydown", event => {
  if (!(event.ctrlKey || event.metaKey) || event.altKey) return;
  const inside = event.target;
  if (inside.isContentEditable || /^(input|textarea|select)$/i.test(inside.tagName)) return;
  const key = event.key.toLowerCase();
  const back = key === "z" && !event.shiftKey, forth = key === "y" || (key === "z" && event.shiftKey);
  if (!back && !forth) return;
  event.preventDefault();
  emitEvent(back ? "softnlp-undo" : "softnlp-redo");
});
"""


class Past:
    """The history of a page, with its buttons in the current slot."""

    def __init__(self, session: Session) -> None:
        """Build the buttons, and note each state of the session from now on."""
        self._session = session
        self.history = History(session.state())
        look = "flat dense round"
        self._undo = button("", "undo", "undo", self.undo, look)
        self._redo = button("", "redo", "redo", self.redo, look)
        with button("", "history", "history", lambda: None, look) as opener:
            opener.props('aria-label="What happened"').tooltip("What happened")
            menu = ui.menu().props("max-height=60vh").classes("max-w-96")
            menu.on_value_change(lambda event: self._list() if event.value else None)
            with menu:
                self._entries = ui.column().classes("gap-0 w-full")
        self._soon = Redraw(ui.context.client.content, self.note, _REST_S, at_rest=True)
        session.on_scenario(self._soon)
        session.on_pressure(self._soon)
        ui.run_javascript(_KEYS)
        ui.on("softnlp-undo", self.undo)
        ui.on("softnlp-redo", self.redo)
        self._show()

    def note(self) -> None:
        """Take in what is on the screen now."""
        if self.history.note(self._session.state()):
            self._show()

    def undo(self) -> None:
        """Show the state before."""
        self.note()
        if self.history.back is not None:
            self._go(self.history.at - 1)

    def redo(self) -> None:
        """Show the state that was undone."""
        self.note()
        if self.history.forth is not None:
            self._go(self.history.at + 1)

    def _go(self, place: int) -> None:
        self._session.restore(self.history.go(place))
        self._show()

    def _show(self) -> None:
        """Say on the buttons what they would do."""
        history = self.history
        told = history.states[history.at].what
        for control, state, words in (
            (self._undo, history.back, f"Undo: {told} (Ctrl+Z)"),
            (self._redo, history.forth, f"Redo: {'' if history.forth is None else history.forth.what} (Ctrl+Y)"),
        ):
            name = words if state is not None else words.split(":")[0]
            control.set_enabled(state is not None)
            control.props["aria-label"] = control.props["title"] = name
            control.update()

    def _list(self) -> None:
        """List the states, the newest first."""
        self.note()
        self._entries.clear()
        with self._entries:
            ui.menu_item("Copy a link to this state", on_click=self._link).props("data-testid=history-link")
            ui.separator()
            states = list(enumerate(self.history.states))[-_SHOWN:]
            for place, state in reversed(states):
                self._entry(place, state)

    def _entry(self, place: int, state: State) -> None:
        here = place == self.history.at
        item = ui.menu_item(on_click=partial(self._go, place)).props(f"dense data-testid=history-{place}")
        with item:
            ui.icon("check" if here else "").classes("w-5 shrink-0")
            ui.label(state.what).classes("text-sm whitespace-normal" + (" font-medium" if here else ""))

    async def _link(self) -> None:
        """Copy an address that opens what is on the screen."""
        session = self._session
        try:
            code = packed(session.kept(), session.kept_files())
        except InputError as error:
            refuse(error.message)
            return
        address = await ui.run_javascript("return location.origin + location.pathname", timeout=10.0)
        ui.clipboard.write(f"{address}?state={code}")
        ui.notify("copied a link to this state", type="positive")
