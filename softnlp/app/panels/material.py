"""The silicone: from the library, with constants or a formula of one's own, and its curves."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from functools import partial
from typing import Any, TypeVar

from nicegui import ui

from softnlp.app import controls, silicone
from softnlp.app.inputs import Inputs
from softnlp.app.live_view import PoseStretch
from softnlp.app.theme import Redraw, darkness, on_dark
from softnlp.model.formula import MAX_LENGTH
from softnlp.model.laws import LAWS
from softnlp.model.materials import DENSITY, FITTED_STRETCH, MaterialEntry

_FORMS: Mapping[silicone.Form, str] = {"library": "Library", "constants": "Own constants", "formula": "Own formula"}
T = TypeVar("T", ui.input, ui.textarea)
_SMALL = "text-xs opacity-80 w-full"
_LONGEST_NAME = 40
_MOST_ROWS = 30


def material_panel(session: Inputs) -> None:
    """Build the panel in the current slot."""
    _MaterialPanel(session)


class _MaterialPanel:
    """The controls of one page; forms that a person left are kept, so that nothing typed is lost."""

    def __init__(self, session: Inputs) -> None:
        self.session = session
        self.dark = darkness()
        self.stretch = PoseStretch(session)
        self.seen = session.document
        self.left: dict[silicone.Form, dict[str, Any]] = {}
        self.measure = "engineering_stress"
        self.constants: dict[str, ui.number] = {}
        self.entries: Mapping[str, MaterialEntry] = silicone.known_silicones(session.document, session.folder)
        self.file = session.document.get("material", "file")
        self.read_from: Any = None
        self.state = self._read()
        with ui.column().classes("w-full gap-2").props("data-testid=material-panel") as self.root:
            self._build()
        self.redraw = Redraw(self.root, self._draw)
        self.move = Redraw(self.root, self._mark, 0.25, at_rest=True)
        session.on_scenario(self._changed)
        session.on_pressure(self.move)
        on_dark(self._draw)
        self._show()
        self._draw()

    # --- controls -----------------------------------------------------------------------------------------------------

    def _build(self) -> None:
        """Build the fields of every form; `_show` hides those of the others."""
        self.form = self._toggle(dict(_FORMS), "form", self._form_chosen)
        names = list(self.entries)
        self.silicone = controls.select(names, "material.name", "Silicone", test="material-name")
        self.silicone.on_value_change(self._silicone_chosen)
        self.sets = controls.select([], "material.set", "Set of constants", test="material-set")
        self.sets.on_value_change(self._set_chosen)
        self.own_name = self._text_box(ui.input, "Silicone", "name", "own_name", "maxlength=200")
        self.law = controls.select(dict(silicone.LAW_NAMES), "material.model", "Law", test="material-model")
        self.law.on_value_change(self._law_chosen)
        self.own_law = self._text_box(ui.input, "Name of the law", "model", "own_model", "maxlength=200")
        self.constants_box = ui.element("div").classes("grid grid-cols-2 gap-2 w-full items-start")
        self.constants_law = ""
        with ui.column().classes("w-full gap-2") as self.formula_box:
            look = f"autogrow maxlength={MAX_LENGTH} spellcheck=false input-class=font-mono"
            self.formula = self._text_box(ui.textarea, "Engineering stress [MPa] =", "formula", "formula", look)
            ui.label("Of stretch and the constants below; 0 at stretch 1, rising.").classes(_SMALL)
            self.rows = _ConstantRows(self._rows_changed)
        self.error = ui.label().classes("text-xs text-red-700 dark:text-red-300 leading-tight")
        controls.dashed(self.error.props("role=alert"), "material.said")
        key, test = "density_kg_m3", "material-density_kg_m3"
        self.density = controls.number_field(
            self.session, "material", key, "Density", default=self._density, step=10, test=test
        )
        with ui.row().classes("w-full no-wrap gap-2") as self.fitted_box:
            self.fitted = [
                self._number(label, f"fitted_stretch.{k}", f"material-fitted_stretch-{k}", step=0.1).classes("w-1/2")
                for k, label in enumerate(("Fitted from stretch", "to stretch"))
            ]
        for end in self.fitted:
            end.on_value_change(self._fitted_changed)
        measures = {measure: label for measure, (label, _) in silicone.MEASURES.items()}
        self._toggle(measures, "measure", self._measure_chosen, self.measure)
        self.plot = controls.dashed(ui.plotly(self._figure()).classes("self-center"), "material.plot")
        self.caption = controls.dashed(ui.label().classes(_SMALL), "material.caption")

    def _text_box(self, kind: type[T], label: str, key: str, name: str, look: str) -> T:
        """Show a text of [material] that is a person's own."""
        box = controls.dashed(kind(label, on_change=lambda event: self._text(key, event.value)), f"material.{name}")
        return box.props(f"{controls.BOX} debounce=300 {look}").classes("w-full").without_auto_validation()

    @staticmethod
    def _number(label: str, name: str, test: str, **more: Any) -> ui.number:
        return controls.number(label, f"material.{name}", look="debounce=300 no-error-icon", test=test, **more)

    @staticmethod
    def _toggle(options: Any, name: str, act: Callable[[Any], None], value: str | None = None) -> ui.toggle:
        choice = controls.toggle(options, f"material.{name}", value, f"material-{name}").props("size=sm")
        return choice.on_value_change(act)

    # --- what a person does -------------------------------------------------------------------------------------------

    @property
    def _table(self) -> dict[str, Any]:
        return self.session.table("material")

    def _entry(self) -> MaterialEntry | None:
        name = self._table.get("name")
        return self.entries.get(name) if isinstance(name, str) else None

    def _form_chosen(self, event: Any) -> None:
        table = self._table
        before = silicone.form_of(table)
        wanted: silicone.Form = event.value or before
        if wanted == before:
            return
        self.left[before] = table
        kept, entry, model = self.left.get(wanted), self._entry(), table.get("model")
        if kept is None and wanted == "library":
            kept = silicone.library_form(table, entry if entry is not None else next(iter(self.entries.values())))
        elif kept is None and wanted == "constants":
            kept = silicone.constants_form(table, silicone.law_or_default(model, LAWS), entry)
        elif kept is None:
            kept = silicone.formula_form(table, entry)
        if "constants" in kept:
            kept = kept | {"constants": silicone.inline(kept["constants"])}
        self.session.change_all("material", kept)

    def _silicone_chosen(self, event: Any) -> None:
        if event.value is None or event.value == self._table.get("name"):
            return
        self.session.change_all("material", silicone.library_form(self._table, self.entries[event.value]))

    def _set_chosen(self, event: Any) -> None:
        entry = self._entry()
        if event.value is None or entry is None or event.value == silicone.set_of(self._table, entry).name:
            return
        self.session.change_all("material", silicone.library_form({**self._table, "set": event.value}, entry))

    def _law_chosen(self, event: Any) -> None:
        if event.value is None or event.value == self._table.get("model"):
            return
        if silicone.form_of(self._table) == "constants":
            self.session.change_all("material", silicone.constants_form(self._table, event.value, self._entry()))
        else:
            self.session.change("material", "model", event.value)

    def _text(self, key: str, value: Any) -> None:
        text = controls.typed(value)
        form = silicone.form_of(self._table)
        if (form == "library") or (form == "constants" and key != "name") or text == self._table.get(key, ""):
            return
        self.session.change("material", key, text)

    def _constant_changed(self, key: str, event: Any) -> None:
        constants, value = self._table.get("constants"), event.value
        if (
            silicone.form_of(self._table) != "constants"
            or not isinstance(constants, dict)
            or constants.get(key) == value
        ):
            return
        constants = {k: v for k, v in constants.items() if k != key} | ({} if value is None else {key: value})
        self.session.change("material", "constants", silicone.inline(constants))

    def _rows_changed(self, constants: dict[str, float]) -> None:
        if silicone.form_of(self._table) == "formula" and constants != self._table.get("constants"):
            self.session.change("material", "constants", silicone.inline(constants))
        else:
            self._say()

    def _fitted_changed(self) -> None:
        low, high = (field.value for field in self.fitted)
        wanted = silicone.fitted_range(low, high)
        if silicone.form_of(self._table) != "library" and (wanted or list(FITTED_STRETCH)) != self._fitted_shown():
            self.session.change("material", "fitted_stretch", wanted)

    def _measure_chosen(self, event: Any) -> None:
        self.measure = event.value or self.measure
        self._draw()

    # --- what is shown ------------------------------------------------------------------------------------------------

    def _read(self) -> silicone.MaterialState:
        """Read the silicone again where something about it changed; most changes are of other tables."""
        problem = self.session.problem
        read_from = (self._table, str(problem) if problem is not None and problem.table == "material" else "")
        if read_from == self.read_from:
            return self.state
        self.read_from = read_from
        return silicone.material_state(self.session.document, self.entries, self.session.folder, problem)

    def _density(self) -> float:
        models = getattr(self._entry(), "models", {}) if silicone.form_of(self._table) == "library" else {}
        return float(next(iter(models.values())).density) if models else DENSITY

    def _fitted_shown(self) -> list[Any]:
        shown = self._table.get("fitted_stretch")
        return list(shown) if isinstance(shown, list) and len(shown) == 2 else list(FITTED_STRETCH)

    def _changed(self) -> None:
        """Show the document; the curves follow a moment later."""
        self._show()
        self.redraw()

    def _show(self) -> None:
        table = self._table
        if self.session.document is not self.seen:  # another scenario was opened
            self.seen = self.session.document
            self.left.clear()
            self.read_from = None
        if table.get("file") != self.file or self.read_from is None:
            self.file = table.get("file")
            self.entries = silicone.known_silicones(self.session.document, self.session.folder)
        self.state = self._read()
        form = self.state.form
        self.form.set_value(form)
        for element, shown in (
            (self.silicone, form == "library"),
            (self.own_name, form != "library"),
            (self.law, form != "formula"),
            (self.own_law, form == "formula"),
            (self.constants_box, form == "constants"),
            (self.formula_box, form == "formula"),
            (self.fitted_box, form != "library"),
        ):
            element.set_visibility(shown)
        entry = self._entry()
        self.sets.set_visibility(form == "library" and entry is not None and len(entry.sets) > 1)
        self._show_names(table, form)
        self._show_constants(table, form)
        if form == "formula":
            self.formula.set_value(table.get("formula", ""))
            constants = table.get("constants", {})
            self.rows.show(constants if isinstance(constants, dict) else {})
        for field, value in zip(self.fitted, self._fitted_shown(), strict=True):
            field.set_value(value)
        self._say()

    def _show_names(self, table: Mapping[str, Any], form: silicone.Form) -> None:
        name, model = table.get("name"), table.get("model")
        if form == "library":
            self.silicone.set_options(list(self.entries), value=name if name in self.entries else None)
        else:
            self.own_name.set_value(name or "")
        if form == "formula":
            self.own_law.set_value(model or "")
            return
        entry = self._entry()
        laws = list(LAWS)
        if form == "library" and entry is not None:
            chosen = silicone.set_of(table, entry)
            laws = list(chosen.models)
            self.sets.set_options(list(entry.sets), value=chosen.name)
        self.law.set_options({law: silicone.law_name(law) for law in laws}, value=model if model in laws else None)

    def _show_constants(self, table: Mapping[str, Any], form: silicone.Form) -> None:
        """Show a field for each constant of the law; another law has others."""
        law = str(table.get("model")) if form == "constants" else ""
        if law != self.constants_law:
            self.constants_law = law
            self.constants_box.clear()
            self.constants = {}
            with self.constants_box:
                for constant in LAWS[law].constants if law in LAWS else ():
                    key, unit = constant.file_key, "" if constant.unit == "1" else constant.unit
                    field = self._number(constant.name, f"constants.{key}", f"material-{key}", unit=unit)
                    field.props("step=any")
                    field.on_value_change(partial(self._constant_changed, key))
                    self.constants[key] = field.classes("w-full")
        given = table.get("constants")
        for key, field in self.constants.items():
            field.set_value(given.get(key) if isinstance(given, dict) else None)

    def _say(self) -> None:
        """Put what is wrong beside its field; what has none stands below them all."""
        said = dict(self.state.said)
        if self.state.form == "formula" and (problem := self.rows.values()[1]):
            said.setdefault("constants", problem)
        own = self.state.form != "library"
        beside: tuple[tuple[ui.element, str], ...] = (
            (self.own_name if own else self.silicone, "name"),
            (self.sets, "set"),
            (self.own_law if self.state.form == "formula" else self.law, "model"),
            (self.formula, "formula"),
            (self.density, "density_kg_m3"),
        )
        for element, key in beside:
            controls.say_beside(element, said.pop(key, "") if element.visible else "")
        names = [(key.removeprefix("constants."), message) for key, message in said.items()]
        left = [message if name in ("", "constants") else f"{name}: {message}" for name, message in names]
        for key, field in self.constants.items():
            field.props.set_bool("error", f"constants.{key}" in said)
        self.rows.say({key.removeprefix("constants.") for key in said if key.startswith("constants.")})
        for end in self.fitted:
            end.props.set_bool("error", "fitted_stretch" in said)
        self.error.set_text(" ".join(left))
        self.error.set_visibility(bool(left))

    def _figure(self) -> dict[str, Any]:
        return silicone.material_figure(
            self.state.material, self.state.others, self.measure, self.stretch(), self.dark()
        )

    def _draw(self) -> None:
        self.plot.update_figure(self._figure())
        self._describe()

    def _mark(self) -> None:
        """Move the point of the pose; the curves stay."""
        silicone.mark_pose(self.plot.figure, self.state.material, self.measure, self.stretch())
        self.plot.update()
        self._describe()

    def _describe(self) -> None:
        material, stretch = self.state.material, self.stretch()
        if material is None:
            self.caption.set_text("No curve of this law can be drawn yet.")
            return
        low, high = material.fitted_stretch
        words = f"Fitted for stretch {low:.4g} to {high:.4g}."
        if stretch is not None:
            words += f" The pose has {stretch:.4g}{'' if low <= stretch <= high else ', outside it'}."
        self.caption.set_text(words)


class _ConstantRows:
    """Rows of a name and a value; `changed` is called with the constants whenever a person changes one."""

    def __init__(self, changed: Callable[[dict[str, float]], None]) -> None:
        """Build the table in the current slot, without rows."""
        self._changed = changed
        self._rows: list[tuple[ui.element, ui.input, ui.number]] = []
        self._table = ui.column().classes("w-full gap-1").props("data-testid=material-rows")
        controls.button("Add constant", "add", "material.add", self._added, test="material-add")

    def show(self, constants: Mapping[str, Any]) -> None:
        """Show other constants; rows that say this already stay as they are, also while a person types in one."""
        if self.values()[0] == dict(constants):
            return
        self._table.clear()
        self._rows.clear()
        for name, value in constants.items():
            self._row(str(name), value if controls.is_number(value) else None)

    def values(self) -> tuple[dict[str, float], str]:
        """Return the constants, and what is wrong with the rows."""
        return silicone.constants_of_rows(
            [(controls.typed(name.value).strip(), value.value) for _, name, value in self._rows]
        )

    def say(self, names: Collection[str]) -> None:
        """Mark the rows of constants with which something is wrong."""
        for _, field, _ in self._rows:
            field.props.set_bool("error", controls.typed(field.value).strip() in names)

    def _row(self, name: str, value: float | None) -> None:
        with self._table, ui.row().classes("w-full no-wrap gap-2 items-center") as row:
            look = f"{controls.BOX} debounce=300 no-error-icon"
            name_field = ui.input("Name", value=name, on_change=self._tell).without_auto_validation().classes("w-24")
            controls.dashed(name_field, "material.constant-name")
            name_field.props(f"{look} maxlength={_LONGEST_NAME}")
            value_field = controls.number("Value", "material.constant-value", look=look, test="material-constant-value")
            entry = (row, name_field, value_field.classes("grow"))
            value_field.set_value(value).on_value_change(self._tell)
            remove = controls.button(
                "",
                "close",
                "material.remove",
                partial(self._removed, entry),
                "flat dense round size=sm",
                "material-remove",
            )
            remove.props('aria-label="remove this constant"')
        self._rows.append(entry)

    def _added(self) -> None:
        if len(self._rows) < _MOST_ROWS:
            self._row("", None)

    def _removed(self, entry: tuple[ui.element, ui.input, ui.number]) -> None:
        if entry in self._rows:
            self._rows.remove(entry)
            self._table.remove(entry[0])
            self._tell()

    def _tell(self) -> None:
        self._changed(self.values()[0])
