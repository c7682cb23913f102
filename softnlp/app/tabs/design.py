"""The design tab: what may be chosen, what is required, what is best; candidates as they come, one to use."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from math import isfinite
from typing import Any

from nicegui import ui

from softnlp.app import controls, wanted
from softnlp.app.conventions import is_energy
from softnlp.app.examples import empty_state
from softnlp.app.panels.robot import effective
from softnlp.app.session import Session, Stage
from softnlp.app.tabs.candidates import candidates_part
from softnlp.base.errors import InputError
from softnlp.model.robot import DIMENSIONS

STUDY = "design"
Table = dict[str, Any]


def design_tab(stage: Stage) -> None:
    """Build the tab in the current slot."""
    session = stage.session
    with ui.column().classes("w-full gap-3 pt-2"):
        empty_state(session, STUDY)
        _Choices(session)
        _Requirements(session)
        _Actuation(session)
        _objective(session)
        problem = controls.problem_label("design.problem")

        def refresh() -> None:
            told = controls.problem_of(session, "choices", "requirements", "actuation", "objective", "contact")
            problem.set_text(told if session.document.study == STUDY else "")

        session.follow(refresh)
        ui.separator()
        candidates_part(stage)


class _Rows:
    """Rows of one table, made anew where there are other keys; values typed by a person stay theirs."""

    def __init__(self, session: Session, table: str, title: str, add: str, every: Mapping[str, str]) -> None:
        self.session, self.table_name, self.every = session, table, every
        self._built: Any = None
        controls.heading(title)
        self._rows = ui.column().classes("w-full gap-2")
        self._add = controls.select({}, f"{table}.add", add, on_change=self._added)
        self._set: list[Callable[[], None]] = []
        session.follow(self._refresh)

    def entries(self) -> dict[str, Any]:
        """Return what there is a row for, by key."""
        return self.session.table(self.table_name)

    def put(self, entries: Mapping[str, Any]) -> None:
        """Take over changed entries."""
        self.session.put(self.table_name, dict(entries))

    def new(self, key: str) -> Any:
        """Return what a new entry starts with."""
        raise NotImplementedError

    def build(self, key: str, value: Any) -> None:
        """Build the fields of an entry."""
        raise NotImplementedError

    def kind(self, value: Any) -> Any:
        """Return what decides which fields an entry has."""
        return type(value).__name__

    def _added(self, event: Any) -> None:
        if event.value is not None and event.value not in self.entries():
            self.put({**self.entries(), event.value: self.new(event.value)})

    def _refresh(self) -> None:
        entries = self.entries()
        built = [(key, self.kind(value)) for key, value in entries.items()]
        if built != self._built:
            self._built = built
            self._rows.clear()
            self._set = []
            with self._rows:
                for key, value in entries.items():
                    with ui.row().classes("w-full items-center gap-2 no-wrap"):
                        self.build(key, value)
                        remove = partial(self._remove, key)
                        name = f"{self.table_name}.remove.{key}"
                        control = controls.button("", "close", name, remove, "flat dense round size=sm")
                        control.props(f'aria-label="remove {self.every.get(key, key)}"')
            self._add.set_options({k: w for k, w in self.every.items() if k not in entries}, value=None)
        for show in self._set:
            show()

    def _remove(self, key: str) -> None:
        self.put(wanted.without(self.entries(), key))

    def number(
        self, label: str, name: str, get: Callable[[], Any], typed: Callable[[float | None], None], whole: bool = False
    ) -> None:
        """Show a number of an entry."""

        def entered(value: Any) -> None:
            if value != get() and (value is None or isfinite(value)):
                typed(int(value) if whole and value is not None and value == int(value) else value)

        field = controls.number(label, name, look="debounce=400", value=get(), on_change=lambda e: entered(e.value))
        field.classes("grow min-w-0 basis-0")

        def show() -> None:
            field.set_value(get())

        self._set.append(show)


class _Choices(_Rows):
    """What may be chosen."""

    def __init__(self, session: Session) -> None:
        every = {key: wanted.words(key) for key in wanted.CHOICES}
        super().__init__(session, "choices", "What may be chosen", "Add a choice", every)

    def entries(self) -> dict[str, Any]:
        """Return the choices by whole key."""
        return wanted.chosen(self.session.table("choices"))

    def put(self, entries: Mapping[str, Any]) -> None:
        """Take over changed choices."""
        self.session.put("choices", wanted.choices_of(entries))

    def new(self, key: str) -> Any:
        """Return a range about what the robot has, or the first names of the library."""
        robot, material = self.session.table("robot"), self.session.table("material")
        sizes = {d.file_key: effective(robot, d) for d in DIMENSIONS}
        value = wanted.first_values(key, sizes, material)
        both = wanted.ends(value)  # a range, which the energy section does not search so far
        return [*both] if both is not None and is_energy(self.session.document) else value

    def build(self, key: str, value: Any) -> None:
        """Build both ends of a range, a list of numbers, or names to tick."""
        ui.label(self.every.get(key, key)).classes("text-sm w-32 shrink-0 leading-tight")
        if key in wanted.NAMES:
            names = wanted.names_of(key, self.session.table("material"))
            known = [name for name in value if name in names] if isinstance(value, list) else []
            box = controls.select(names, f"choices.{key}", look="use-chips", multiple=True, value=known)
            box.props(f'aria-label="{self.every[key]}"')
            box.on_value_change(lambda event: self._change(key, list(event.value or [])))
            return
        if wanted.ends(value) is not None:
            for side in ("from", "to"):
                self.number(side.capitalize(), f"choices.{key}.{side}", partial(self._end, key, side),
                            partial(self._typed_end, key, side))  # fmt: skip
        else:
            self._list(key)
        if key in wanted.SIZES and not (is_energy(self.session.document) and wanted.ends(value) is None):
            words = "list" if wanted.ends(value) is not None else "range"
            icon = "format_list_numbered" if words == "list" else "swap_horiz"
            other = controls.button(
                "", icon, f"choices.{key}.kind", partial(self._turn, key), "flat dense round size=sm"
            )
            other.props(f'aria-label="{self.every[key]} as a {words}"').tooltip(f"As a {words}")

    def _list(self, key: str) -> None:
        field = controls.named(ui.input("Values", value=wanted.listed(self.entries().get(key))), f"choices.{key}")
        field.props(f"{controls.BOX} debounce=600").without_auto_validation().classes("grow min-w-0")

        def entered(text: Any) -> None:
            try:
                values = wanted.numbers(str(text or ""), key in wanted.COUNTS)
            except InputError as error:
                controls.say_beside(field, error.message)
                return
            controls.say_beside(field, "")
            if values != self.entries().get(key):
                self._change(key, values)

        field.on_value_change(lambda event: entered(event.value))

    def _end(self, key: str, side: str) -> Any:
        value = self.entries().get(key)
        return value.get(side) if isinstance(value, Mapping) else None

    def _typed_end(self, key: str, side: str, value: float | None) -> None:
        now = self.entries().get(key)
        if value is not None and isinstance(now, Mapping):
            self._change(key, {**now, side: value})

    def _turn(self, key: str) -> None:
        value = self.entries().get(key)
        both = wanted.ends(value)
        if both is not None:
            self._change(key, [float(v) for v in both])
        elif isinstance(value, list) and value:
            low, high = min(value), max(value)
            self._change(key, {"from": float(low), "to": float(high if high > low else low + 1)})

    def _change(self, key: str, value: Any) -> None:
        self.put({**self.entries(), key: value})


class _Requirements(_Rows):
    """What a design must meet."""

    def __init__(self, session: Session) -> None:
        every = {key: f"{o.label} [{o.unit.sign or '-'}]" for key, o in wanted.REQUIRED.items()}
        super().__init__(session, "requirements", "What is required", "Add a requirement", every)

    def new(self, key: str) -> Any:
        """Return a limit that a person changes."""
        return {"at_least": 0.0}

    def kind(self, value: Any) -> Any:
        """Every requirement has the same two fields."""
        return ""

    def build(self, key: str, value: Any) -> None:
        """Build the two limits."""
        ui.label(self.every.get(key, key)).classes("text-sm w-32 shrink-0 leading-tight")
        for side, words in (("at_least", "At least"), ("at_most", "At most")):
            self.number(words, f"requirements.{key}.{side}", partial(self._limit, key, side),
                        partial(self._typed, key, side))  # fmt: skip

    def _limit(self, key: str, side: str) -> Any:
        limits = self.entries().get(key)
        return limits.get(side) if isinstance(limits, Mapping) else None

    def _typed(self, key: str, side: str, value: float | None) -> None:
        self.put(wanted.with_limit(self.entries(), key, side, value))


_ENDS = {"fixed": (), "range": ("from", "to"), "steps": ("step", "to")}


class _Actuation:
    """Which sets get which pressure."""

    def __init__(self, session: Session) -> None:
        self._session = session
        controls.heading("Pressure")
        self._kind = controls.toggle({"fixed": "Given", "range": "Optimised", "steps": "Lowest step"}, "actuation.kind")
        with ui.row().classes("w-full gap-2 no-wrap"):
            self._sets = controls.select([1], "actuation.sets", "Sets", multiple=True, look="use-chips")
            self._sets.classes("basis-0 grow")
            self._fields = {}
            for key, label in (("one", "Pressure"), ("from", "From"), ("step", "Step"), ("to", "To")):
                field = controls.number(label, f"actuation.{key}", "bar", "debounce=400", step=0.1)
                field.classes("basis-0 grow min-w-0")
                field.on_value_change(lambda event, key=key: self._typed(key, event.value))
                self._fields[key] = field
        session.follow(self._refresh)
        self._kind.on_value_change(lambda event: self._turn(event.value))
        self._sets.on_value_change(lambda event: self._put({"sets": sorted(event.value or [])}))

    def _value(self) -> Any:
        return self._session.document.get("actuation", "pressure_bar", 0.8)

    def _put(self, changed: Mapping[str, Any]) -> None:
        now = self._session.table("actuation")
        if changed != {key: now.get(key) for key in changed}:
            self._session.put("actuation", {**now, **changed})

    def _turn(self, kind: str | None) -> None:
        if kind is not None and kind != wanted.pressure_kind(self._value()):
            self._put({"pressure_bar": wanted.as_pressure(kind, self._value())})

    def _typed(self, key: str, value: float | None) -> None:
        now = self._value()
        if value is None or not isfinite(value) or value == self._shown(key):
            return
        self._put({"pressure_bar": value if key == "one" else {**now, key: value}})

    def _shown(self, key: str) -> Any:
        now = self._value()
        if key == "one":
            return None if isinstance(now, Mapping) else now
        return now.get(key) if isinstance(now, Mapping) else None

    def _refresh(self) -> None:
        kind = wanted.pressure_kind(self._value())
        self._kind.set_value(kind)
        for key, field in self._fields.items():
            field.set_visibility(key in (_ENDS[kind] or ("one",)))
            field.set_value(self._shown(key))
        sets = self._session.document.get("actuation", "sets", [1])
        known = list(range(1, len(self._session.pressure) + 1))
        self._sets.set_options(known, value=[k for k in sets if k in known] if isinstance(sets, list) else [1])


def _objective(session: Session) -> None:
    """Show what is maximised or minimised."""
    controls.heading("What is best")
    options = {
        key: f"{o.label} [{o.unit.sign or '-'}]" for key, o in wanted.REQUIRED.items() if o.name != "chamber_gap"
    }
    way = controls.toggle({"maximise": "Largest", "minimise": "Smallest"}, "objective.way")
    of = controls.select(options, "objective.of", "Of")

    def shown() -> tuple[str, str | None]:
        table = session.table("objective")
        found = "minimise" if "minimise" in table else "maximise"
        return found, table.get(found) if table.get(found) in options else None

    def put(kind: Any, key: Any) -> None:
        if kind and key and (kind, key) != shown():
            kept = {k: v for k, v in session.table("objective").items() if k not in ("maximise", "minimise")}
            session.put("objective", {kind: key, **kept})

    def refresh() -> None:
        kind, key = shown()
        way.set_value(kind)
        of.set_value(key)

    session.follow(refresh)
    way.on_value_change(lambda event: put(event.value, of.value))
    of.on_value_change(lambda event: put(way.value, event.value))
