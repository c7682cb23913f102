"""Controls that show one key of the scenario, change it, and say beside it what is wrong with it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from typing import Any

from nicegui import ui
from nicegui.elements.mixins.value_element import ValueElement

from softnlp.app.session import Session


def number_field(
    session: Session,
    table: str,
    key: str,
    label: str,
    unit: str = "",
    *,
    default: Callable[[], float | None] = lambda: None,
    step: float | None = None,
    whole: bool = False,
) -> ui.number:
    """Show a number of the scenario; an empty field takes the key out, and the default is shown in its place.

    unit : of the number as the file has it. default : what holds where the scenario does not give the key.
    """

    def shown() -> float | None:
        value = session.document.get(table, key)
        return value if isinstance(value, int | float) and not isinstance(value, bool) else default()

    def entered(event: Any) -> None:
        value = event.value
        if value == shown() or (value is None and session.document.get(table, key) is None):
            return
        if value is not None and not isfinite(value):
            return
        session.change(table, key, int(value) if whole and value is not None and value == int(value) else value)

    field = ui.number(label, value=shown(), step=step, on_change=entered)
    field.props("dense outlined debounce=250 hide-bottom-space").classes("w-full").mark(f"{table}.{key}").props(
        f"data-testid={table}.{key}"
    )
    field.without_auto_validation()  # it would take away what `tell_problem` says
    if unit:
        field.props(f'suffix="{unit}"')

    _follow(session, table, key, [field], lambda: [shown()])
    return field


def choice_field(
    session: Session,
    table: str,
    key: str,
    label: str,
    options: Sequence[str] | Mapping[str, str],
    *,
    default: str,
) -> ui.select:
    """Show one of some words of the scenario; the default is not written into the file."""

    def entered(event: Any) -> None:
        if event.value is not None and event.value != session.document.get(table, key, default):
            session.change(table, key, None if event.value == default else event.value)

    known = list(options)

    def shown() -> str | None:
        value = session.document.get(table, key, default)
        return value if value in known else None

    field = ui.select(dict(options) if isinstance(options, Mapping) else known, label=label, value=shown())
    field.on_value_change(entered)
    field.props("dense outlined options-dense hide-bottom-space").classes("w-full").mark(f"{table}.{key}").props(
        f"data-testid={table}.{key}"
    )
    field.without_auto_validation()

    _follow(session, table, key, [field], lambda: [shown()])
    return field


def vector_field(
    session: Session,
    table: str,
    key: str,
    labels: Sequence[str],
    unit: str,
    *,
    default: Sequence[float] = (0.0, 0.0, 0.0),
    step: float | None = None,
    written: bool = True,
) -> None:
    """Show a list of numbers of the scenario, a field for each. written : whether the file says the default too."""

    def shown() -> list[float]:
        value = session.document.get(table, key)
        usable = isinstance(value, list) and len(value) == len(labels)
        usable = usable and all(isinstance(v, int | float) and not isinstance(v, bool) for v in value)
        return [float(v) for v in value] if usable else list(default)

    def entered(index: int, value: float | None) -> None:
        if value is None or not isfinite(value):
            say_beside(fields[index], "expected a number")
            return
        vector = shown()
        if value != vector[index]:
            vector[index] = float(value)
            session.change(table, key, vector if written or vector != list(default) else None)

    fields: list[ui.number] = []
    with ui.row().classes("w-full no-wrap gap-2"):
        for index, label in enumerate(labels):
            field = ui.number(label, value=shown()[index], step=step)
            field.on_value_change(lambda event, index=index: entered(index, event.value))
            field.props("dense outlined debounce=250 hide-bottom-space").classes("min-w-0 grow basis-0")
            field.mark(f"{table}.{key}.{index}").props(f"data-testid={table}.{key}.{index}")
            if unit:
                field.props(f'suffix="{unit}"')
            field.without_auto_validation()
            fields.append(field)
    _follow(session, table, key, fields, shown)


def _follow(
    session: Session,
    table: str,
    key: str,
    fields: Sequence[ValueElement[Any]],
    shown: Callable[[], Sequence[Any]],
) -> None:
    """Let fields follow the scenario, and the first say what is wrong with the key.

    While a person types, a field is theirs: only a value that means something else is put in its place.
    """

    def refresh() -> None:
        for field, value in zip(fields, shown(), strict=True):
            if field.value != value:
                field.set_value(value)
            say_beside(field, "")
        tell_problem(session, fields[0], table, key)

    session.on_scenario(refresh)


def tell_problem(session: Session, field: ui.element, table: str, *keys: str) -> None:
    """Put what is wrong with a key beside its field, or take it away."""
    problem = session.problem
    about = problem is not None and problem.table == table and (problem.key or "").split(".")[0] in keys
    say_beside(field, problem.message if about and problem is not None else "")


def say_beside(field: ui.element, message: str) -> None:
    """Put a message beside a field, or take away the one there for ""; a person's text in it is shown as it is."""
    field.props.set_bool("error", bool(message))
    field.props.set_optional("error-message", message or None)


def typed(value: Any) -> str:
    """Return what a person typed as text that a file can hold: halves of characters become question marks."""
    return str(value or "").encode("utf-8", "replace").decode()
