"""A table of named constants that rows are added to and removed from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from nicegui import ui

from softnlp.app.fields import typed
from softnlp.app.material_state import constants_of_rows

LONGEST_NAME = 40
MOST_ROWS = 30


class ConstantRows:
    """Rows of a name and a value; `changed` is called with the constants whenever a person changes one."""

    def __init__(self, changed: Callable[[dict[str, float]], None]) -> None:
        """Build the table in the current slot, without rows."""
        self._changed = changed
        self._rows: list[tuple[ui.element, ui.input, ui.number]] = []
        self._table = ui.column().classes("w-full gap-1").props("data-testid=material-rows")
        add = ui.button("Add constant", icon="add", on_click=self._added)
        add.props("flat dense no-caps size=sm data-testid=material-add").mark("material.add")

    def show(self, constants: Mapping[str, Any]) -> None:
        """Show other constants; rows that say this already stay as they are, also while a person types in one."""
        if self.values()[0] == dict(constants):
            return
        self._table.clear()
        self._rows.clear()
        for name, value in constants.items():
            self._row(str(name), value if isinstance(value, int | float) and not isinstance(value, bool) else None)

    def values(self) -> tuple[dict[str, float], str]:
        """Return the constants, and what is wrong with the rows."""
        return constants_of_rows([(typed(name.value).strip(), value.value) for _, name, value in self._rows])

    def say(self, name: str, message: str) -> bool:
        """Put a message beside the row of a constant; return whether there is one."""
        found = False
        for _, field, _ in self._rows:
            mine = bool(message) and typed(field.value).strip() == name
            field.props.set_bool("error", mine)
            found = found or mine
        return found

    def _row(self, name: str, value: float | None) -> None:
        with self._table, ui.row().classes("w-full no-wrap gap-2 items-center") as row:
            look = "dense outlined debounce=300 hide-bottom-space no-error-icon"
            name_field = ui.input("Name", value=name, on_change=self._tell).without_auto_validation()
            name_field.props(f"{look} maxlength={LONGEST_NAME} data-testid=material-constant-name").classes("w-24")
            value_field = ui.number("Value", value=value, on_change=self._tell).without_auto_validation()
            value_field.props(f"{look} data-testid=material-constant-value").classes("grow")
            entry = (row, name_field.mark("material.constant-name"), value_field.mark("material.constant-value"))
            remove = ui.button(icon="close", on_click=lambda: self._removed(entry))
            remove.props('flat dense round size=sm data-testid=material-remove aria-label="remove this constant"')
            remove.mark("material.remove")
        self._rows.append(entry)

    def _added(self) -> None:
        if len(self._rows) < MOST_ROWS:
            self._row("", None)

    def _removed(self, entry: tuple[ui.element, ui.input, ui.number]) -> None:
        if entry in self._rows:
            self._rows.remove(entry)
            self._table.remove(entry[0])
            self._tell()

    def _tell(self) -> None:
        self._changed(self.values()[0])
