"""The mould tab: sizes of moulds, their parts in the 3-D view, what was measured of them, and every file as a zip."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Literal, get_args, get_origin

from nicegui import ui

from softnlp.app import controls
from softnlp.app.asking import Progress, sentence
from softnlp.app.files import zipped
from softnlp.app.mould_parts import hex_of
from softnlp.app.mould_work import Asked, Made, Parts, made_apart
from softnlp.app.parts import NumberTable, study_row
from softnlp.app.session import Stage
from softnlp.base.errors import InputError
from softnlp.figures.mesh import require
from softnlp.mould.assembly import sizes_of
from softnlp.mould.bill import bill_csv
from softnlp.mould.checks import in_words
from softnlp.mould.sizes import Sizes
from softnlp.mould.solids import MIDDLE
from softnlp.scenario.describe import UNITS, Key, keys_of
from softnlp.scenario.mould import MouldTable

TAB, TABLE = "mould", "mould"
_KINDS = {"shell": "shell", "plate": "plates", "core": "cores", "key": "keys", "rod": "rods", "thread": "thread",
          "cap": "cups of caps", "connector": "connectors"}  # fmt: skip
_SETTLED: dict[str, Callable[[Sizes], float]] = {
    "groove_depth_mm": lambda sizes: sizes.depth,
    "gate_mm": lambda sizes: sizes.gate,
    "tube_mm": lambda sizes: 2 * sizes.tube_hole,
}
"""What holds where a person leaves one of these open."""
_MISSING = "Moulds need the extra mesh: pip install -e '.[gui,mesh]' in the folder of the repository, then start again."


def mould_tab(stage: Stage) -> None:
    """Build the tab in the current slot."""
    with ui.column().classes("w-full gap-3 pt-2"):
        ui.label("Moulds to print and cast the robot on the screen in, with a bill and a page of steps.").classes(
            "text-sm opacity-80"
        )
        try:
            require(MIDDLE)
        except InputError:
            controls.problem_label("mould.missing").set_text(_MISSING)
            return
        _Mould(stage)


class _Mould:
    def __init__(self, stage: Stage) -> None:
        self._stage, self._session = stage, stage.session
        self._parts: Parts | None = None
        self._made: Made | None = None
        self._drawn: Parts | None = None
        self._shown = ""  # the scene in the view
        self._of: tuple[Any, ...] | None = None  # what the moulds are of
        self._problem = controls.problem_label("mould.problem")
        self._row = study_row("mould", "Make the moulds", self._asked, self._finish, self._watch)
        self._build_view()
        self._old = controls.named(ui.label("").classes("text-sm"), "mould.old")
        self._notes = controls.named(ui.label("").classes("text-sm break-words"), "mould.notes")
        with ui.row().classes("gap-1") as self._files:
            controls.button("All files (zip)", "download", "mould.zip", self._take, controls.USE).classes("px-2")
            controls.button("Steps (HTML)", "description", "mould.steps", self._steps, controls.USE).classes("px-2")
        self._checks = controls.named(ui.column().classes("w-full gap-1"), "mould.checks").props("role=list")
        self._table = NumberTable("mould.bill", height="18rem")
        for part in (self._files, self._checks, self._notes):
            part.set_visibility(False)
        panel = ui.expansion("Sizes").classes("w-full softnlp-panel")
        panel.props("dense header-class=font-semibold data-testid=panel-mould")
        self._fields: dict[str, ui.element] = {}
        with panel, ui.column().classes("w-full gap-2 pb-3"):
            self._sizes()
        self._panel = panel
        self._session.follow(self._refresh)
        stage.turned.append(self._turned)

    def _build_view(self) -> None:
        with ui.column().classes("w-full gap-2") as self._views:
            self._scene = controls.select([], "mould.scene", "Parts", on_change=lambda: self._show())
            looks = {"robot": "Robot", "together": "Together", "apart": "Apart"}
            self._look = controls.toggle(looks, "mould.look", "apart")
            self._look.props('aria-label="What the view shows"')
            self._look.on_value_change(lambda: self._show())
            self._legend = ui.row().classes("gap-x-3 gap-y-1 text-sm")
        self._views.set_visibility(False)

    def _sizes(self) -> None:
        """Build a field for each key of the table."""
        for key in keys_of(MouldTable):
            field: ui.element
            if get_origin(MouldTable.model_fields[key.name].annotation) is Literal:
                field = self._choice(key)
            elif key.name == "bed_mm":
                default, labels = MouldTable().bed_mm, ("Bed x", "Bed y", "Bed z")
                controls.vector_field(self._session, TABLE, key.name, labels, "mm", default=default, written=False)
                continue
            else:
                default_of = partial(self._default, key.name) if key.name in _SETTLED else None
                field = controls.number_field(self._session, TABLE, key.name, label_of(key), default=default_of)
            field.tooltip(f"{key.comment[:1].upper()}{key.comment[1:]}")
            self._fields[key.name] = field

    def _choice(self, key: Key) -> ui.select:
        options = {value: str(value) for value in get_args(MouldTable.model_fields[key.name].annotation)}
        return controls.choice_field(self._session, TABLE, key.name, label_of(key), options)

    def _default(self, key: str) -> float | None:
        """Return what holds of the robot on the screen where a key is left open; None where nothing can be made."""
        scenario = self._session.scenario
        if scenario is None or self._session.is_stale:
            return None
        try:
            return round(_SETTLED[key](sizes_of(scenario.robot, scenario.mould)[0]), 6)
        except InputError:
            return None

    def _refusal(self) -> InputError | None:
        """Return why the robot on the screen cannot be moulded, as far as that is known before anything is made."""
        scenario = self._session.scenario
        if scenario is None or self._session.is_stale:
            return self._session.problem or InputError("expected a robot that can be made")
        try:
            sizes_of(scenario.robot, scenario.mould)
        except InputError as error:
            return error
        return None

    def _refresh(self) -> None:
        """Say what cannot be moulded, beside its field where it has one, and whether what was made is of this robot."""
        error = None if self._session.is_stale else self._refusal()
        field = None if error is None else self._fields.get(error.key or "")
        if error is not None and field is not None:
            controls.say_beside(field, error.message)
            self._panel.set_value(True)
        _say(self._problem, "" if error is None or field is not None else sentence(error.message))
        is_other = self._of is not None and self._of != self._now()
        _say(self._old, "These are of an earlier robot or of other sizes: make them again." if is_other else "")
        if self._of is not None and self._of[:2] != self._now()[:2]:
            self._look.set_value("robot")  # which changes on the screen

    def _now(self) -> tuple[Any, ...]:
        """Return what moulds depend on: the robot first."""
        return tuple(self._session.document.get("", name) for name in ("robot", "segment", TABLE, "material"))

    def _asked(self) -> Callable[[Progress], Made]:
        if (error := self._refusal()) is not None:
            raise error
        scenario = self._session.scenario
        assert scenario is not None
        asked = Asked.of(scenario, self._session.name.removesuffix(".toml") or "scenario")
        self._made = None
        self._files.set_visibility(False)
        self._checks.set_visibility(False)
        self._of = self._now()
        _say(self._old, "")
        _say(self._notes, "")
        return lambda progress: made_apart(asked, progress, self._arrived)

    def _arrived(self, parts: Parts) -> None:
        self._parts = parts  # from the thread of the work; `_watch` draws it

    def _watch(self) -> None:
        """Show the parts once they are there."""
        parts = self._parts
        if parts is None or parts is self._drawn:
            return
        self._drawn, self._shown = parts, ""
        self._views.set_visibility(True)
        chosen = self._scene.value if self._scene.value in parts.views else next(iter(parts.views))
        self._scene.set_options(list(parts.views), value=chosen)
        _say(self._notes, " ".join(map(sentence, parts.notes)))
        if self._look.value == "robot":
            self._look.set_value("apart")
        self._show()

    def _finish(self, made: Made) -> None:
        self._parts, self._made = made.parts, made
        self._watch()
        self._row.say(f"{made.parts.words}; {len(made.checks)} checks hold.")
        scenario = self._session.scenario
        least = MouldTable().minimum_wall_mm if scenario is None else scenario.mould.minimum_wall_mm
        self._checks.clear()
        self._checks.set_visibility(True)
        with self._checks:
            for words in in_words(made.checks, least):
                ui.label(words).classes("text-sm break-words").props("role=listitem")
        self._files.set_visibility(True)
        rows = [[row["item"], row["count"], row["size"], amount_of(row)] for row in made.rows]
        self._table.show(["what", "count", "size", "amount"], rows, "bill.csv", csv=bill_csv(made.rows))

    def _show(self) -> None:
        """Show what is chosen in the view: parts of the chosen scene, or the robot."""
        view, parts, name = self._stage.view, self._drawn, str(self._scene.value)
        if parts is None or name not in parts.views or self._look.value == "robot":
            view.parts(None)
            self._shown = ""
            return
        share = 1.0 if self._look.value == "apart" else 0.0
        if name == self._shown:
            view.explode(share)
            return
        self._shown = name
        view.parts({**parts.views[name], "apart": share})
        self._legend.clear()
        with self._legend:
            for kind in parts.views[name]["kinds"]:
                with ui.row().classes("items-center gap-1 no-wrap"):
                    ui.element("span").classes("w-3 h-3 rounded-sm").style(f"background: {hex_of(kind)}")
                    ui.label(_KINDS[kind])

    def _turned(self, tab: str) -> None:
        """Show the parts while this tab is open, and make moulds where another tab asked for them."""
        if tab != TAB:
            self._stage.view.parts(None)
            self._shown = ""
            return
        self._show()
        if TAB in self._stage.asked:
            self._stage.asked.discard(TAB)
            with self._views:
                ui.timer(0.05, self._row.begin, once=True)

    def _take(self) -> None:
        if self._made is not None:
            name = self._session.name.removesuffix(".toml") or "scenario"
            ui.download.content(zipped(self._made.files), f"{name}-moulds.zip", "application/zip")

    def _steps(self) -> None:
        for name, content in ({} if self._made is None else self._made.files).items():
            if name.endswith("-steps.html"):
                ui.download.content(content, name, "text/html")


def _say(label: ui.label, words: str) -> None:
    """Show words, or no line at all."""
    label.set_text(words)
    label.set_visibility(bool(words))


def label_of(key: Key) -> str:
    """Return a key as the label of a field: without its unit, which stands behind the number."""
    ending = next((end for end, unit in UNITS.items() if unit == key.unit and key.name.endswith(end)), "")
    words = key.name.removesuffix(ending).replace("_", " ")
    return words[:1].upper() + words[1:]


def amount_of(row: dict[str, Any]) -> str:
    """Return the amount of a row of the bill, with what is to be prepared."""
    if row["amount"] is None:
        return ""
    more = "" if row["with_waste"] is None else f", prepare {row['with_waste']:.2f}"
    return f"{row['amount']:.2f}{more} {row['unit']}"
