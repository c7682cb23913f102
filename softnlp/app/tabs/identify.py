"""The identification tab: constants from measurements of robots, or a law from a tensile test."""

from __future__ import annotations

from math import isfinite
from typing import Any

from nicegui import ui

from softnlp.app.asking import scenario_with
from softnlp.app.fields import number_field
from softnlp.app.job import Progress
from softnlp.app.parts import Chart, NumberTable, RunRow, csv_drop, plain_words
from softnlp.app.session import Session
from softnlp.app.stage import Stage
from softnlp.app.tabs.identify_table import (
    MEASURED,
    SIGMAS,
    Table,
    bounds_of,
    compared,
    constant_rows,
    first_free,
    free_choices,
    misfit_rows,
    observables,
    with_bound,
    with_free,
)
from softnlp.app.tabs.tensile import tensile_part
from softnlp.base.columns import OUTPUTS
from softnlp.base.csv_columns import read_columns
from softnlp.base.errors import InputError
from softnlp.base.status import Status
from softnlp.results.identify_document import identified_text, robot_table_text, scenario_tables
from softnlp.scenario.read import Scenario
from softnlp.scenario.run_identify import run_robots
from softnlp.studies.identified import Identified
from softnlp.studies.measurements import OBSERVABLES, RobotTask

STUDY = "identify"
_GUESS = 40  # evaluations; most identifications need fewer


def identify_tab(stage: Stage) -> None:
    """Build the tab in the current slot."""
    session = stage.session
    aside: dict[str, Table] = {}

    def kind() -> str:
        tables = session.document
        return "tensile" if tables.table("tensile") and not tables.table("measurements") else "measurements"

    def choose(chosen: str | None) -> None:
        """Put the tables of the other kind aside, and take out those that were put aside before."""
        if chosen is None:
            return
        for name, box in boxes.items():
            box.set_visibility(name == chosen)
        other = "tensile" if chosen == "measurements" else "measurements"
        table = session.document.table(other)
        if table:
            aside[other] = table
            session.document.replace(other, None)
        if chosen in aside and not session.document.table(chosen):
            session.document.replace(chosen, aside[chosen])
        session.reread()

    with ui.column().classes("w-full gap-3 pt-2"):
        toggle = ui.toggle({"measurements": "Robots", "tensile": "Tensile test"}, value=kind()).mark("identify.kind")
        toggle.props("dense no-caps unelevated spread data-testid=identify.kind").classes("w-full")
        boxes: dict[str, ui.column] = {}
        with ui.column().classes("w-full gap-3") as boxes["measurements"]:
            _Measurements(session)
            ui.separator()
            _Identification(session)
        with ui.column().classes("w-full gap-3") as boxes["tensile"]:
            tensile_part(session)
    for name, box in boxes.items():
        box.set_visibility(name == kind())
    toggle.on_value_change(lambda event: choose(event.value))


class _Measurements:
    """[measurements] and [sigma]: the file, the free constants and their bounds, the standard deviations."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._built: Any = None
        self._fields: dict[tuple[str, int], ui.number] = {}
        ui.label("Measurements of robots").classes("text-base font-medium")
        self._file = ui.label("").classes("text-sm").mark("measurements.file")
        csv_drop("measurements.drop", "Drop a CSV of measurements", self._dropped)
        ui.label(
            f"Columns p1_bar, p2_bar, … and any of {', '.join(MEASURED)}; robot, weight and sigma_… if there are."
        ).classes("text-xs opacity-70")
        with ui.column().classes("w-full gap-2") as self._more:
            self._free = ui.select({}, multiple=True, label="Free constants").classes("w-full")
            self._free.props("dense outlined use-chips options-dense hide-bottom-space data-testid=measurements.free")
            self._free.mark("measurements.free")
            self._bounds = ui.column().classes("w-full gap-2")
            with ui.expansion("Standard deviations").classes("w-full").props("dense data-testid=sigma"):
                ui.label("One of each kind; without any, 1 % of each number.").classes("text-xs opacity-70")
                with ui.grid(columns=2).classes("w-full gap-2"):
                    for key, (label, unit) in SIGMAS.items():
                        number_field(session, "sigma", key, f"{label} [{unit}]")
        self._problem = ui.label("").classes("text-sm text-negative break-words").mark("measurements.problem")
        self._problem.props("data-testid=measurements.problem")
        self._refresh()
        self._free.on_value_change(lambda event: self._chosen(event.value or []))
        session.on_scenario(self._refresh)

    def _table(self) -> Table:
        return self._session.document.table("measurements")

    def _put(self, table: Table) -> None:
        if table != self._table():
            self._session.change_all("measurements", table)

    def _refresh(self) -> None:
        table, scenario, problem = self._table(), self._session.scenario, self._session.problem
        files = table.get("files") or ([table["file"]] if "file" in table else [])
        self._file.set_text(f"From {', '.join(map(str, files))}" if files else "")
        self._more.set_visibility(bool(table))
        material = None if scenario is None else scenario.material
        choices = free_choices(material)
        by_key = {} if material is None else {c.file_key: c.name for c in material.law.constants}
        self._free.set_options(
            choices, value=[by_key.get(n, n) for n in table.get("free", []) if by_key.get(n, n) in choices]
        )
        if material is not None:
            self._show_bounds(bounds_of(table, material))
        ours = bool(table) and problem is not None and problem.table in ("measurements", "sigma", "material", "contact")
        self._problem.set_text(plain_words(problem) if problem is not None and ours else "")

    def _show_bounds(self, bounds: dict[str, tuple[float | None, float | None, str]]) -> None:
        """Build the fields of each free constant where those changed, and fill them."""
        if self._built != tuple(bounds):
            self._built = tuple(bounds)
            self._bounds.clear()
            self._fields.clear()
            with self._bounds:
                for name, (low, high, unit) in bounds.items():
                    with ui.row().classes("w-full items-center gap-2 no-wrap"):
                        ui.label(name).classes("w-16 text-sm shrink-0")
                        for at, (label, value) in enumerate((("from", low), ("to", high))):
                            mark = f"measurements.bounds.{name}.{at}"
                            field = ui.number(label, value=value, on_change=lambda _, name=name: self._bounded(name))
                            field.props(f'dense outlined debounce=400 hide-bottom-space suffix="{unit}"')
                            field.props(f'data-testid="{mark}" placeholder="open" stack-label').mark(mark)
                            field.classes("grow min-w-0")
                            self._fields[name, at] = field
        for (name, at), field in self._fields.items():
            bound = bounds[name][:2][at]
            if bound is not None and field.value != bound:
                field.set_value(bound)

    def _bounded(self, name: str) -> None:
        """Write the bounds of a constant once both are there."""
        pair = [self._fields[name, at].value for at in (0, 1) if (name, at) in self._fields]
        if len(pair) == 2 and all(value is not None and isfinite(value) for value in pair):
            scenario = self._session.scenario
            if scenario is not None and bounds_of(self._table(), scenario.material).get(name, ())[:2] != tuple(pair):
                self._put(with_bound(self._table(), name, pair))

    def _chosen(self, free: list[str]) -> None:
        table = self._table()
        if table and free:
            scenario = self._session.scenario
            by_key = {} if scenario is None else {c.file_key: c.name for c in scenario.material.law.constants}
            if [by_key.get(name, name) for name in table.get("free", [])] != free:
                self._put(with_free(table, free))

    def _dropped(self, name: str, content: bytes) -> None:
        """Take a file of measurements; one that cannot be read leaves the scenario as it was."""
        session, before = self._session, self._table()
        kept = session.keep(name, content)
        header = read_columns(session.folder, kept).header
        table = {key: value for key, value in before.items() if key != "files"}
        session.change_all("measurements", {**table, "file": kept, "free": table.get("free") or first_free(header)})
        problem = session.problem
        if problem is not None and (problem.table or "").split(".")[0] in ("measurements", "robots"):
            session.change_all("measurements", before or None)
            raise InputError(problem.message)


class _Identification:
    """The search for the constants, and what it found."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._found: Identified | None = None
        self._asked: Scenario | None = None
        self._row = RunRow("identify", "Identify", self._begin)
        with ui.column().classes("w-full gap-2") as self._box:
            self._constants = NumberTable("identify.constants")
            with ui.row().classes("gap-1 items-center"):
                use = ui.button("Use these constants", icon="tune", on_click=self._use).mark("identify.use")
                use.props("dense outline no-caps size=sm data-testid=identify.use").classes("px-2")
                for label, mark, act in (
                    ("identified.toml", "identify.toml", self._take_tables),
                    ("table.csv", "identify.csv", self._take_rows),
                ):
                    button = ui.button(label, icon="download", on_click=act).mark(mark)
                    button.props(f"dense flat no-caps size=sm data-testid={mark}")
            self._misfits = NumberTable("identify.misfits")
            self._what = ui.select({}, on_change=self._draw).classes("w-full").mark("identify.observable")
            self._what.props("dense outlined options-dense data-testid=identify.observable")
            self._chart = Chart("identify.chart", "measured", "model", height="18rem")
            self._warnings = ui.label("").classes("text-sm whitespace-pre-line break-words").mark("identify.warnings")
        self._box.set_visibility(False)

    async def _begin(self) -> None:
        try:
            asked = scenario_with(self._session, STUDY)
            if not isinstance(asked.task, RobotTask):
                raise InputError("expected measurements of robots; drop a CSV first")
        except InputError as error:
            missing = not self._session.document.table("measurements")
            self._row.warn("Drop a CSV of measurements first." if missing else plain_words(error))
            return

        def work(progress: Progress) -> Identified:
            def tell(evaluations: int, error: float) -> None:
                words = f"{evaluations} evaluations, root mean square of the residuals {error:.4g} sigma"
                progress(min(evaluations, _GUESS - 1), _GUESS, words)

            return run_robots(asked, tell)

        found = await self._row.do(work)
        if found is None:
            return
        self._found, self._asked = found, asked
        if found.status is not Status.SOLVED:
            self._box.set_visibility(False)
            self._row.warn(f"{found.message}.")
            return
        self._row.say(f"Found after {found.evaluations} evaluations: {found.message}.")
        self._show(found)

    def _show(self, found: Identified) -> None:
        self._constants.show(*constant_rows(found), "constants.csv")
        self._misfits.show(*misfit_rows(found), "misfit.csv")
        choices = observables(found)
        self._what.set_options(choices, value=next(iter(choices), None))
        self._warnings.set_text("\n".join(found.warnings))
        self._box.set_visibility(True)
        self._draw()

    def _draw(self) -> None:
        if self._found is not None and self._what.value in OBSERVABLES:
            key = str(self._what.value)
            traces = compared(self._found, key)
            label = OUTPUTS[key].axis
            self._chart.show(traces, x_label=f"measured {label}", y_label=f"model {label}")

    def _use(self) -> None:
        """Write the constants into the scenario."""
        if self._found is None:
            return
        document = self._session.document
        for table, values in scenario_tables(self._found).items():
            document.replace(table, values if table == "material" else {**document.table(table), **values})
        self._session.reread()
        ui.notify("The scenario has these constants now", position="bottom-right", timeout=2000)

    def _take_tables(self) -> None:
        if self._found is not None and self._asked is not None:
            ui.download.content(identified_text(self._asked, self._found), "identified.toml", "text/plain")

    def _take_rows(self) -> None:
        if self._found is not None and self._asked is not None and isinstance(self._asked.task, RobotTask):
            ui.download.content(robot_table_text(self._asked.task, self._found), "table.csv", "text/csv")
