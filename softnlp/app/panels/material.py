"""The silicone: from the library, with constants or a formula of one's own, and its curves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from nicegui import ui

from softnlp.app.fields import number_field, say_beside, typed
from softnlp.app.material_figure import LAW_NAMES, MEASURES, law_name, mark_pose, material_figure
from softnlp.app.material_state import (
    Form,
    MaterialState,
    constants_form,
    fitted_range,
    form_of,
    formula_form,
    inline,
    known_silicones,
    law_or_default,
    library_form,
    material_state,
)
from softnlp.app.panels.constant_rows import ConstantRows
from softnlp.app.redraw import Redraw
from softnlp.app.session import Session
from softnlp.app.stretch import PoseStretch
from softnlp.app.theme import darkness, on_dark
from softnlp.model.formula import MAX_LENGTH
from softnlp.model.laws import LAWS
from softnlp.model.materials import DENSITY, FITTED_STRETCH, MaterialEntry

_FORMS: Mapping[Form, str] = {"library": "Library", "constants": "Own constants", "formula": "Own formula"}
_LOOK = "dense outlined hide-bottom-space"
_SMALL = "text-xs opacity-80 w-full"


def material_panel(session: Session) -> None:
    """Build the panel in the current slot."""
    _MaterialPanel(session)


class _MaterialPanel:
    """The controls of one page; forms that a person left are kept, so that nothing typed is lost."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.dark = darkness()
        self.stretch = PoseStretch(session)
        self.seen = session.document
        self.left: dict[Form, dict[str, Any]] = {}
        self.measure = "engineering_stress"
        self.constants: dict[str, ui.number] = {}
        self.entries: Mapping[str, MaterialEntry] = known_silicones(session.document, session.folder)
        self.file = session.document.get("material", "file")
        self.read_from: Any = None
        self.state = self._read()
        with ui.column().classes("w-full gap-2").props("data-testid=material-panel") as self.root:
            self.form = ui.toggle(dict(_FORMS), on_change=self._form_chosen)
            self.form.props("dense no-caps spread unelevated size=sm data-testid=material-form").classes("w-full")
            self.form.mark("material.form")
            self._identity()
            self._own_constants()
            self._own_formula()
            self.error = ui.label().classes("text-xs text-red-700 dark:text-red-300 leading-tight")
            self.error.props("data-testid=material-said role=alert").mark("material.said")
            self._numbers()
            self._curves()
        self.redraw = Redraw(self.root, self._draw)
        self.move = Redraw(self.root, self._mark, 0.25, at_rest=True)
        session.on_scenario(self._changed)
        session.on_pressure(self.move)
        on_dark(self._draw)
        self._show()
        self._draw()

    # --- controls -----------------------------------------------------------------------------------------------------

    def _identity(self) -> None:
        self.silicone = ui.select(list(self.entries), label="Silicone", on_change=self._silicone_chosen)
        self.silicone.props(f"{_LOOK} options-dense data-testid=material-name").classes("w-full")
        self.silicone.without_auto_validation().mark("material.name")
        self.own_name = ui.input("Silicone", on_change=lambda event: self._text("name", event.value))
        self.own_name.props(f"{_LOOK} debounce=300 maxlength=200 data-testid=material-own_name").classes("w-full")
        self.own_name.without_auto_validation().mark("material.own_name")
        self.law = ui.select(dict(LAW_NAMES), label="Law", on_change=self._law_chosen)
        self.law.props(f"{_LOOK} options-dense data-testid=material-model").classes("w-full")
        self.law.without_auto_validation().mark("material.model")
        self.own_law = ui.input("Name of the law", on_change=lambda event: self._text("model", event.value))
        self.own_law.props(f"{_LOOK} debounce=300 maxlength=200 data-testid=material-own_model").classes("w-full")
        self.own_law.without_auto_validation().mark("material.own_model")

    def _own_constants(self) -> None:
        self.constants_box = ui.element("div").classes("grid grid-cols-2 gap-2 w-full items-start")
        self.constants_law = ""

    def _own_formula(self) -> None:
        with ui.column().classes("w-full gap-2") as self.formula_box:
            self.formula = ui.textarea(
                "Engineering stress [MPa] =", on_change=lambda event: self._text("formula", event.value)
            )
            look = f"{_LOOK} autogrow debounce=300 maxlength={MAX_LENGTH} spellcheck=false input-class=font-mono"
            self.formula.props(f"{look} data-testid=material-formula")
            self.formula.classes("w-full").without_auto_validation().mark("material.formula")
            ui.label("Of stretch and the constants below; 0 at stretch 1, rising.").classes(_SMALL)
            self.rows = ConstantRows(self._rows_changed)

    def _numbers(self) -> None:
        self.density = number_field(
            self.session, "material", "density_kg_m3", "Density", "kg/m³", default=lambda: self._density(), step=10
        )
        self.density.props("data-testid=material-density_kg_m3")
        with ui.row().classes("w-full no-wrap gap-2") as self.fitted_box:
            self.fitted: list[ui.number] = []
            for k, label in enumerate(("Fitted from stretch", "to stretch")):
                end = ui.number(label, step=0.1, on_change=self._fitted_changed).without_auto_validation()
                end.props(f"{_LOOK} debounce=300 no-error-icon data-testid=material-fitted_stretch-{k}")
                self.fitted.append(end.classes("w-1/2").mark(f"material.fitted_stretch.{k}"))

    def _curves(self) -> None:
        names = {measure: label for measure, (label, _) in MEASURES.items()}
        choice = ui.toggle(names, value=self.measure, on_change=self._measure_chosen)
        choice.props("dense no-caps spread unelevated size=sm data-testid=material-measure").classes("w-full")
        choice.mark("material.measure")
        self.plot = ui.plotly(self._figure()).classes("self-center").props("data-testid=material-plot")
        self.plot.mark("material.plot")
        self.caption = ui.label().classes(_SMALL).props("data-testid=material-caption").mark("material.caption")

    # --- what a person does -------------------------------------------------------------------------------------------

    @property
    def _table(self) -> dict[str, Any]:
        return self.session.document.table("material")

    def _entry(self) -> MaterialEntry | None:
        name = self._table.get("name")
        return self.entries.get(name) if isinstance(name, str) else None

    def _form_chosen(self, event: Any) -> None:
        table = self._table
        before = form_of(table)
        wanted: Form = event.value or before
        if wanted == before:
            return
        self.left[before] = table
        kept = self.left.get(wanted)
        if kept is None and wanted == "library":
            entry = self._entry()
            name = entry.name if entry is not None else next(iter(self.entries))
            kept = library_form(table, name, law_or_default(table.get("model"), self.entries[name].models))
        elif kept is None and wanted == "constants":
            kept = constants_form(table, law_or_default(table.get("model"), LAWS), self._entry())
        elif kept is None:
            kept = formula_form(table, self._entry())
        if "constants" in kept:
            kept = kept | {"constants": inline(kept["constants"])}
        self.session.change_all("material", kept)

    def _silicone_chosen(self, event: Any) -> None:
        if event.value is None or event.value == self._table.get("name"):
            return
        model = law_or_default(self._table.get("model"), self.entries[event.value].models)
        self.session.change_all("material", library_form(self._table, event.value, model))

    def _law_chosen(self, event: Any) -> None:
        if event.value is None or event.value == self._table.get("model"):
            return
        if form_of(self._table) == "constants":
            self.session.change_all("material", constants_form(self._table, event.value, self._entry()))
        else:
            self.session.change("material", "model", event.value)

    def _text(self, key: str, value: Any) -> None:
        text = typed(value)
        form = form_of(self._table)
        if (form == "library") or (form == "constants" and key != "name") or text == self._table.get(key, ""):
            return
        self.session.change("material", key, text)

    def _constant_changed(self, key: str, value: float | None) -> None:
        constants = self._table.get("constants")
        if form_of(self._table) != "constants" or not isinstance(constants, dict) or constants.get(key) == value:
            return
        constants = {k: v for k, v in constants.items() if k != key} | ({} if value is None else {key: value})
        self.session.change("material", "constants", inline(constants))

    def _rows_changed(self, constants: dict[str, float]) -> None:
        if form_of(self._table) == "formula" and constants != self._table.get("constants"):
            self.session.change("material", "constants", inline(constants))
        else:
            self._say()

    def _fitted_changed(self) -> None:
        low, high = (field.value for field in self.fitted)
        wanted = fitted_range(low, high)
        if form_of(self._table) != "library" and (wanted or list(FITTED_STRETCH)) != self._fitted_shown():
            self.session.change("material", "fitted_stretch", wanted)

    def _measure_chosen(self, event: Any) -> None:
        self.measure = event.value or self.measure
        self._draw()

    # --- what is shown ------------------------------------------------------------------------------------------------

    def _read(self) -> MaterialState:
        """Read the silicone again where something about it changed; most changes are of other tables."""
        problem = self.session.problem
        read_from = (self._table, str(problem) if problem is not None and problem.table == "material" else "")
        if read_from == self.read_from:
            return self.state
        self.read_from = read_from
        return material_state(self.session.document, self.entries, self.session.folder, problem)

    def _density(self) -> float:
        models = getattr(self._entry(), "models", {}) if form_of(self._table) == "library" else {}
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
            self.entries = known_silicones(self.session.document, self.session.folder)
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
        self._show_names(table, form)
        self._show_constants(table, form)
        if form == "formula":
            _put(self.formula, table.get("formula", ""))
            constants = table.get("constants", {})
            self.rows.show(constants if isinstance(constants, dict) else {})
        for field, value in zip(self.fitted, self._fitted_shown(), strict=True):
            _put(field, value)
        self._say()

    def _show_names(self, table: Mapping[str, Any], form: Form) -> None:
        name, model = table.get("name"), table.get("model")
        if form == "library":
            self.silicone.set_options(list(self.entries), value=name if name in self.entries else None)
        else:
            _put(self.own_name, name or "")
        if form == "formula":
            _put(self.own_law, model or "")
            return
        entry = self._entry()
        laws = list(entry.models) if form == "library" and entry is not None else list(LAWS)
        self.law.set_options({law: law_name(law) for law in laws}, value=model if model in laws else None)

    def _show_constants(self, table: Mapping[str, Any], form: Form) -> None:
        """Show a field for each constant of the law; another law has others."""
        law = str(table.get("model")) if form == "constants" else ""
        if law != self.constants_law:
            self.constants_law = law
            self.constants_box.clear()
            self.constants = {}
            with self.constants_box:
                for constant in LAWS[law].constants if law in LAWS else ():
                    self.constants[constant.file_key] = self._constant(constant.file_key, constant.name, constant.unit)
        given = table.get("constants")
        for key, field in self.constants.items():
            _put(field, given.get(key) if isinstance(given, dict) else None)

    def _constant(self, key: str, name: str, unit: str) -> ui.number:
        field = ui.number(name, on_change=lambda event: self._constant_changed(key, event.value))
        field.props(f"{_LOOK} debounce=300 no-error-icon step=any data-testid=material-{key}").classes("w-full")
        if unit != "1":
            field.props(f"suffix={unit}")
        return field.without_auto_validation().mark(f"material.constants.{key}")

    def _say(self) -> None:
        """Put what is wrong beside its field; what has none stands below them all."""
        said = dict(self.state.said)
        if self.state.form == "formula" and (problem := self.rows.values()[1]):
            said.setdefault("constants", problem)
        own = self.state.form != "library"
        beside: tuple[tuple[ui.element, str], ...] = (
            (self.own_name if own else self.silicone, "name"),
            (self.own_law if self.state.form == "formula" else self.law, "model"),
            (self.formula, "formula"),
            (self.density, "density_kg_m3"),
        )
        for element, key in beside:
            say_beside(element, said.pop(key, "") if element.visible else "")
        left = []
        for key, message in said.items():
            name = key.removeprefix("constants.")
            left.append(f"{name}: {message}" if name not in ("", "constants") else message)
        if self.state.form == "constants":
            for key, field in self.constants.items():
                field.props.set_bool("error", f"constants.{key}" in said)
        self.rows.say("", "")
        for key, message in said.items():
            if self.state.form == "formula" and key.startswith("constants."):
                self.rows.say(key.removeprefix("constants."), message)
        for end in self.fitted:
            end.props.set_bool("error", "fitted_stretch" in said)
        self.error.set_text(" ".join(left))
        self.error.set_visibility(bool(left))

    def _figure(self) -> dict[str, Any]:
        return material_figure(self.state.material, self.state.others, self.measure, self.stretch(), self.dark())

    def _draw(self) -> None:
        self.plot.update_figure(self._figure())
        self._describe()

    def _mark(self) -> None:
        """Move the point of the pose; the curves stay."""
        mark_pose(self.plot.figure, self.state.material, self.measure, self.stretch())
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


def _put(field: Any, value: Any) -> None:
    """Show a value; a field that shows it already keeps what a person is typing."""
    if field.value != value:
        field.set_value(value)
