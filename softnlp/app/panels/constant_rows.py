"""A table of named constants that rows are added to and removed from."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from functools import partial
from typing import Any

from nicegui import ui

from softnlp.app.fields import BOX, button, is_number, named, number_box, typed
from softnlp.app.material_state import constants_of_rows

LONGEST_NAME = 40
MOST_ROWS = 30
_ROUND = "flat dense round size=sm"


class ConstantRows:
    """Rows of a name and a value; `changed` is called with the constants whenever a person changes one."""

    def __init__(self, changed: Callable[[dict[str, float]], None]) -> None:
        """Build the table in the current slot, without rows."""
        self._changed = changed
        self._rows: list[tuple[ui.element, ui.input, ui.number]] = []
        self._table = ui.column().classes("w-full gap-1").props("data-testid=material-rows")
        button("Add constant", "add", "material.add", self._added, test="material-add")

    def show(self, constants: Mapping[str, Any]) -> None:
        """Show other constants; rows that say this already stay as they are, also while a person types in one."""
        if self.values()[0] == dict(constants):
            return
        self._table.clear()
        self._rows.clear()
        for name, value in constants.items():
            self._row(str(name), value if is_number(value) else None)

    def values(self) -> tuple[dict[str, float], str]:
        """Return the constants, and what is wrong with the rows."""
        return constants_of_rows([(typed(name.value).strip(), value.value) for _, name, value in self._rows])

    def say(self, names: Collection[str]) -> None:
        """Mark the rows of constants with which something is wrong."""
        for _, field, _ in self._rows:
            field.props.set_bool("error", typed(field.value).strip() in names)

    def _row(self, name: str, value: float | None) -> None:
        with self._table, ui.row().classes("w-full no-wrap gap-2 items-center") as row:
            look = f"{BOX} debounce=300 no-error-icon"
            name_field = ui.input("Name", value=name, on_change=self._tell).without_auto_validation().classes("w-24")
            named(name_field, "material.constant-name", "material-constant-name")
            name_field.props(f"{look} maxlength={LONGEST_NAME}")
            value_field = number_box("Value", "material.constant-value", look=look, test="material-constant-value")
            entry = (row, name_field, value_field.classes("grow"))
            value_field.set_value(value).on_value_change(self._tell)
            remove = button("", "close", "material.remove", partial(self._removed, entry), _ROUND, "material-remove")
            remove.props('aria-label="remove this constant"')
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
