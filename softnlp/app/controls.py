"""Controls: plain ones under a name, and those that show one key of the scenario and say beside it what is wrong."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from math import isfinite
from typing import Any, TypeVar, get_args

from nicegui import ElementFilter, ui
from nicegui.elements.mixins.value_element import ValueElement
from pydantic.fields import FieldInfo

from softnlp.app.inputs import Inputs
from softnlp.base.errors import InputError, SoftnlpError
from softnlp.scenario.check import SCHEMAS

E = TypeVar("E", bound=ui.element)
BOX = "dense outlined hide-bottom-space"
SMALL = "dense flat no-caps size=sm"
USE = "dense outline no-caps size=sm"
HINT = "text-xs opacity-70"
_SUFFIXES = {"_mm": "mm", "_bar": "bar", "_deg": "°", "_kg_m3": "kg/m³", "_percent": "%"}


def named(element: E, name: str, test: str = "") -> E:
    """Give an element the name under which it is found on the page. test : in the browser, where that is another."""
    return element.mark(name).props(f'data-testid="{test or name}"')


def dashed(element: E, name: str) -> E:
    """Give an element a name, which has dashes in place of dots in the browser."""
    return named(element, name, name.replace(".", "-"))


def button(
    words: str, icon: str | None, name: str, act: Callable[..., Any], look: str = SMALL, test: str = ""
) -> ui.button:
    """Show a button."""
    return named(ui.button(words, icon=icon, on_click=act).props(look), name, test)


def use_button(words: str, name: str, act: Callable[[], Any]) -> ui.button:
    """Show a button that takes over what was found."""
    return button(words, "tune", name, act, USE).classes("px-2")


def number(label: str, name: str, unit: str = "", look: str = "", test: str = "", **more: Any) -> ui.number:
    """Show a number that is no key of the scenario, or one of several in a key."""
    box = named(ui.number(label, **more), name, test).props(f"{BOX} {look}")
    if unit:
        box.props(f'suffix="{unit}"')
    return box.without_auto_validation()  # it would take away what `say_beside` says


def select(
    options: Any, name: str, label: str | None = None, *, look: str = "", test: str = "", **more: Any
) -> ui.select:
    """Show a choice from a list."""
    box = named(ui.select(options, label=label, **more), name, test).props(f"{BOX} options-dense {look}")
    return box.classes("w-full").without_auto_validation()


def toggle(options: Any, name: str, value: str | None = None, test: str = "") -> ui.toggle:
    """Show a choice between a few words in a row."""
    switch = named(ui.toggle(options, value=value), name, test)
    return switch.props("dense no-caps unelevated spread").classes("w-full")


def heading(words: str) -> ui.label:
    """Show the heading of a part of a tab."""
    return ui.label(words).classes("text-base font-medium").props("role=heading aria-level=2")


def problem_label(name: str) -> ui.label:
    """Show a place for what is wrong, in words (`problem_of`)."""
    return named(ui.label("").classes("text-sm text-negative break-words"), name)


def problem_of(session: Inputs, *tables: str) -> str:
    """Return what is wrong with one of some tables, in words, "" for nothing."""
    problem = session.problem
    return plain_words(problem) if problem is not None and problem.table in tables else ""


def plain_words(error: SoftnlpError) -> str:
    """Return an error in one line without the file that it is about: on the page there is but one."""
    if isinstance(error, InputError):
        return str(type(error)(error.message, table=error.table, key=error.key))
    return str(error)


def refuse(words: str) -> None:
    """Say in place of an earlier refusal why something was not done; it stays until it is closed or things go well."""
    dismiss_refusals()
    close = [{"label": "Close", "color": "white"}]
    ui.notification(words, type="negative", multi_line=True, timeout=None, actions=close)


def dismiss_refusals() -> None:
    """Take away what was refused before on this page."""
    for refusal in ElementFilter(kind=ui.notification):
        refusal.dismiss()


def is_number(value: Any) -> bool:
    """Whether a value of a file is a number."""
    return isinstance(value, int | float) and not isinstance(value, bool)


@cache
def known(table: str, key: str) -> FieldInfo:
    """Return what the schema of scenarios says of a key."""
    kinds = (schema.model_fields[table].annotation for schema in SCHEMAS.values() if table in schema.model_fields)
    models = (kind for annotation in kinds for kind in annotation_parts(annotation) if hasattr(kind, "model_fields"))
    info: FieldInfo = next(model.model_fields[key] for model in models if key in model.model_fields)
    return info


def annotation_parts(annotation: Any) -> Iterator[Any]:
    """Yield a type and all that it is made of."""
    yield annotation
    for part in get_args(annotation):
        yield from annotation_parts(part)


def unit_of(key: str) -> str:
    """Return the unit that a key of a file ends with, "" for none that the page shows."""
    return next((unit for suffix, unit in _SUFFIXES.items() if key.endswith(suffix)), "")


def number_field(
    session: Inputs,
    table: str,
    key: str,
    label: str,
    unit: str | None = None,
    *,
    default: Callable[[], float | None] | None = None,
    step: float | None = None,
    test: str = "",
) -> ui.number:
    """Show a number of the scenario; an empty field takes the key out, and the default is shown in its place.

    unit : as the page shows it, by default that of the key. default : what holds where the scenario does not give the
    key, by default what the schema says. test : a name of its own in the browser.
    """
    field_info = known(table, key)
    whole = int in annotation_parts(field_info.annotation)

    def shown() -> Any:
        value = session.document.get(table, key)
        if is_number(value):
            return value
        return field_info.default if default is None else default()

    def entered(event: Any) -> None:
        value = event.value
        if value == shown() or (value is None and session.document.get(table, key) is None):
            return
        if value is None or isfinite(value):
            session.change(table, key, int(value) if whole and value is not None and value == int(value) else value)

    unit = unit_of(key) if unit is None else unit
    name, look = f"{table}.{key}", "debounce=250"
    field = number(label, name, unit, look, test, value=shown(), step=step, on_change=entered)
    _follow(session, table, key, [field], lambda: [shown()])
    return field.classes("w-full")


def choice_field(
    session: Inputs,
    table: str,
    key: str,
    label: str,
    options: Sequence[str] | Mapping[Any, str],
    *,
    default: Any = None,
    test: str = "",
) -> ui.select:
    """Show one of some words of the scenario; the default, by default the schema's, is not written into the file."""
    standard = known(table, key).default if default is None else default

    def shown() -> Any:
        value = session.document.get(table, key, standard)
        return value if value in list(options) else None

    def entered(event: Any) -> None:
        if event.value is not None and event.value != session.document.get(table, key, standard):
            session.change(table, key, None if event.value == standard else event.value)

    field = select(options, f"{table}.{key}", label, test=test, value=shown(), on_change=entered)
    _follow(session, table, key, [field], lambda: [shown()])
    return field


def vector_field(
    session: Inputs,
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
        usable = isinstance(value, list) and len(value) == len(labels) and all(map(is_number, value))
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
            name, value = f"{table}.{key}.{index}", shown()[index]
            fields.append(number(label, name, unit, "debounce=250", value=value, step=step))
            fields[-1].on_value_change(lambda event, index=index: entered(index, event.value))
            fields[-1].classes("min-w-0 grow basis-0")
    _follow(session, table, key, fields, shown)


def _follow(
    session: Inputs,
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
            field.set_value(value)
            say_beside(field, "")
        tell_problem(session, fields[0], table, key)

    session.on_scenario(refresh)


def tell_problem(session: Inputs, field: ui.element, table: str, *keys: str) -> None:
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
