"""A laboratory's files on the page: dropped, shown as they were read, corrected, and handed on as the project's CSV."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from shutil import rmtree

from nicegui import events, ui

from softnlp.app import controls
from softnlp.app.asking import Progress
from softnlp.app.imports import (
    KINDS,
    MOST_FILES,
    SETTINGS,
    Asked,
    Reading,
    check_rows,
    placed,
    read,
    registration_for,
    result_name,
    setting_rows,
    settings_of,
    told,
    traces,
)
from softnlp.app.parts import Chart, NumberTable, RunRow, while_open
from softnlp.app.session import Session
from softnlp.app.taken import LARGEST_FILE
from softnlp.base.errors import InputError, SoftnlpError
from softnlp.base.reading import IMPORTED
from softnlp.laboratory.recipe import recipe_text

_LIMITS = f"expected at most {MOST_FILES} files of at most {LARGEST_FILE / 1e6:.0f} MB"
_LOOK = f"{controls.BOX} debounce=800 maxlength=300"
_TENSILE_KEPT = ("name", "laws", "density_kg_m3")  # others are of a specimen, or of columns that the import has read

Uses = Mapping[str, Callable[[str, bytes], None]]


def import_part(session: Session, uses: Uses) -> None:
    """Build it in the current slot. uses : what takes a CSV by name and content, by the kinds that the tab can use."""
    with ui.expansion("Import files of a laboratory").classes("w-full softnlp-panel").props("dense data-testid=import"):
        _Import(session, uses)


def use_tensile(session: Session, name: str, content: bytes) -> None:
    """Make an imported tensile test that of the scenario; raises `InputError` where it cannot be read."""
    others = {key: value for key, value in session.table("tensile").items() if key in _TENSILE_KEPT}
    session.take_file("tensile", name, content, others, lambda p: (p.table, p.key) == ("tensile", "file"))


class _Import:
    """The files dropped, their settings, and what reading them gave."""

    def __init__(self, session: Session, uses: Uses) -> None:
        self._session, self._uses = session, uses
        self._folder = session.folder / ".laboratory"  # a name that no file of a scenario has
        self._drops = 0
        self._files: tuple[str, ...] = ()
        self._reading: Reading | None = None
        self._fields: dict[str, ui.input | ui.select] = {}
        self._fields_of = ""
        with ui.column().classes("w-full gap-2"):
            self._drop()
            ui.label(
                "Of testing machines, trackers, pressure and force loggers, as they wrote them; those of one test "
                "together. Nothing is written beside them."
            ).classes(controls.HINT)
            with ui.column().classes("w-full gap-2") as self._more:
                self._row = RunRow("import", "Read again", self._read)
                self._table = NumberTable("import.table", height="12rem")
                self._kind = controls.select(dict(KINDS), "import.kind", "Kind", value="", on_change=self._read)
                self._box = ui.element("div").classes("grid grid-cols-2 gap-2 w-full items-start")
                self._further = controls.named(ui.textarea("Other settings, a KEY=VALUE a line"), "import.further")
                self._further.props(f"{_LOOK} maxlength=5000 autogrow spellcheck=false input-class=font-mono").classes(
                    "w-full"
                )
                self._further.on_value_change(self._read)
                self._chart = Chart("import.chart", "", "", height="16rem")
                with ui.column().classes("w-full gap-2") as self._results:
                    self._told = ui.label("").classes("text-sm whitespace-pre-line break-words").mark("import.told")
                    self._settings = NumberTable("import.settings", height="14rem")
                    self._checks = NumberTable("import.checks", height="14rem")
                    with ui.row().classes("gap-1 items-center"):
                        self._use = controls.use_button("Use it", "import.use", self._hand_on)
                        self._files_made = [
                            controls.button(f"NAME{suffix}", "download", f"import{suffix}", partial(self._take, suffix))
                            for suffix in (".csv", IMPORTED)
                        ]
        self._more.set_visibility(False)
        self._results.set_visibility(False)

    def _drop(self) -> None:
        @while_open
        async def arrived(event: events.MultiUploadEventArguments) -> None:
            box.reset()
            try:
                if len(event.files) > MOST_FILES or any(file.size() > LARGEST_FILE for file in event.files):
                    raise InputError(_LIMITS)
                contents = [(file.name, await file.read()) for file in event.files]
                files = placed(self._folder / str(self._drops + 1), contents)
            except SoftnlpError as error:
                ui.notify(controls.plain_words(error), type="warning", multi_line=True)
                return
            rmtree(self._folder / str(self._drops), ignore_errors=True)
            self._files, self._drops = files, self._drops + 1
            self._start_anew()
            await self._read()

        box = ui.upload(
            label="Drop files of a testing machine, a tracker or a logger",
            multiple=True,
            auto_upload=True,
            max_file_size=LARGEST_FILE,
            on_multi_upload=arrived,
            on_rejected=lambda: ui.notify(_LIMITS, type="warning"),
        )
        box.props("flat bordered color=transparent text-color=primary")
        controls.named(box.classes("w-full softnlp-drop"), "import.drop")

    def _start_anew(self) -> None:
        """Take away what the settings were for the files before."""
        self._fields_of = ""
        self._box.clear()
        self._fields.clear()
        self._kind.set_value("")
        self._further.set_value("")
        self._more.set_visibility(True)

    def _now(self) -> Asked:
        """Return what the page asks for; raises `InputError` where a setting cannot be read."""
        texts = {key: controls.typed(field.value) for key, field in self._fields.items()}
        chosen = {key: texts.pop(key) for key, field in self._fields.items() if isinstance(field, ui.select)}
        settings = settings_of(texts, chosen, controls.typed(self._further.value))
        return Asked(self._folder / str(self._drops), self._files, self._kind.value or None, settings)

    async def _read(self, *_: object) -> None:
        """Read the files as the fields say, again where those change meanwhile."""
        if self._row.running or not self._files:
            return
        self._enable(False)
        asked = None
        try:
            while (wanted := self._now()) != asked:
                asked, self._reading = wanted, await self._row.do(partial(_read_unless_stopped, wanted))
                if self._reading is not None:
                    self._show_fields(self._reading)  # those of another kind go, with what was typed into them
        except InputError as error:
            self._row.warn(str(error))
            return
        if self._reading is not None:
            self._show(self._reading)

    def _show(self, reading: Reading) -> None:
        """Show what was read, or what it lacks."""
        imported = reading.imported
        name = "table" if imported is None else result_name(imported)
        self._table.show(reading.header, reading.rows, f"{name}.csv", csv=reading.csv or None)
        self._results.set_visibility(imported is not None)
        if imported is None:
            self._chart.show([])
            self._row.warn(reading.problem)
            return
        words = f"{', '.join(imported.files)}: {KINDS[imported.kind]}, {imported.rows} rows"
        self._row.say(f"{words}; {len(imported.checks)} checks, {len(imported.warnings)} with a warning.")
        self._told.set_text(told(imported))
        self._settings.show(*setting_rows(imported), "settings.csv")
        header, rows = check_rows(imported)
        self._checks.show(header, rows, "checks.csv", failed=[row[-1] != "passed" for row in rows])
        curves, x_label, y_label = traces(imported)
        self._chart.show(curves, x_label=x_label, y_label=y_label)
        self._enable(True)

    def _show_fields(self, reading: Reading) -> None:
        """Build the fields of a kind where it has changed, and say in each what was taken where it is empty."""
        if reading.kind and self._fields_of != reading.kind:
            self._fields_of = reading.kind
            self._box.clear()
            self._fields.clear()
            with self._box:
                for key, label, words in SETTINGS[reading.kind]:
                    name = f"import.{key}"
                    field: ui.input | ui.select
                    if words:
                        field = controls.select(list(words), name, label, look="clearable", on_change=self._read)
                    else:
                        field = controls.named(ui.input(label, on_change=self._read), name).props(_LOOK)
                    self._fields[key] = field.classes("w-full")
        used = {} if reading.imported is None else reading.imported.choices.used
        for key, field in self._fields.items():
            hint = f"taken: {used[key]}" if key in used and not field.value else None
            field.props.set_optional("hint", hint)

    def _enable(self, ready: bool) -> None:
        """Let the result be taken where there is one that is of the fields."""
        for control in self._files_made:
            control.set_enabled(ready)
        self._use.set_enabled(ready and self._fields_of in self._uses)

    def _hand_on(self) -> None:
        """Make the result the file of the tab's identification."""
        if self._reading is None or self._reading.imported is None:
            return
        imported, before = self._reading.imported, self._session.table("registration")
        if imported.kind == "tips":
            self._session.put("registration", registration_for(imported, before))
        try:
            self._uses[imported.kind](f"{result_name(imported)}.csv", self._reading.csv.encode())
        except SoftnlpError as error:
            self._session.put("registration", before)
            ui.notify(controls.plain_words(error), type="warning", multi_line=True)
            return
        ui.notify("The identification below has this file now", position="bottom-right", timeout=2000)

    def _take(self, suffix: str) -> None:
        """Offer the result as a file."""
        if self._reading is not None and (imported := self._reading.imported) is not None:
            folder = self._folder / str(self._drops)
            text = recipe_text(imported, folder, folder) if suffix == IMPORTED else self._reading.csv
            ui.download.content(text, f"{result_name(imported)}{suffix}", "text/plain")


def _read_unless_stopped(asked: Asked, progress: Progress) -> Reading:
    """Read files unless a person stops it, which ends it once they are read."""
    progress(0, 1, f"Reading {', '.join(asked.files)}")
    reading = read(asked)
    progress(1, 1)
    return reading
