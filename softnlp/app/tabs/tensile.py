"""A tensile test on the page: its file and specimen, the laws fitted to it, and one of them taken over."""

from __future__ import annotations

from nicegui import ui

from softnlp.app.asking import scenario_with
from softnlp.app.fields import choice_field, number_field
from softnlp.app.parts import Chart, NumberTable, RunRow, csv_drop, plain_words
from softnlp.app.session import Session
from softnlp.app.tabs.identify_table import law_rows, law_traces
from softnlp.base.errors import InputError
from softnlp.results.identify_document import material_file_text, material_table, tensile_table_text
from softnlp.scenario.read import Scenario
from softnlp.scenario.run_identify import run_tensile
from softnlp.studies.measurements import TensileTask
from softnlp.studies.tensile import LawFit, TensileFit

STUDY = "identify"
_SPECIMEN = {
    "gauge_length_mm": "Gauge length",
    "diameter_mm": "Diameter",
    "width_mm": "Width",
    "thickness_mm": "Thickness",
}


def tensile_part(session: Session) -> None:
    """Build it in the current slot."""
    _test(session)
    ui.separator()
    _Fit(session)


def _test(session: Session) -> None:
    """Show the keys of [tensile]."""
    ui.label("Tensile test").classes("text-base font-medium")
    named = ui.label("").classes("text-sm").mark("tensile.file")

    def dropped(name: str, content: bytes) -> None:
        """Take a file; what it needs beside it can be typed afterwards, what cannot be read is not taken."""
        before = session.document.table("tensile")
        kept = session.keep(name, content)
        session.change_all("tensile", {**{k: v for k, v in before.items() if k != "files"}, "file": kept})
        problem = session.problem
        if problem is not None and problem.table == "tensile" and problem.key == "file":
            session.change_all("tensile", before or None)
            raise InputError(problem.message)

    csv_drop("tensile.drop", "Drop a CSV: stretch, stress_MPa or displacement_mm, force_N", dropped)
    choice_field(
        session,
        "tensile",
        "stress",
        "Stress of the file",
        {"engineering": "Engineering: over the area before the test", "true": "True: over the area at the time"},
        default="engineering",
    )
    ui.label("The specimen, where the file has force and displacement").classes("text-xs opacity-70")
    with ui.grid(columns=2).classes("w-full gap-2"):
        for key, label in _SPECIMEN.items():
            number_field(session, "tensile", key, f"{label} [mm]")
    told = ui.label("").classes("text-sm text-negative break-words").mark("tensile.problem")
    told.props("data-testid=tensile.problem")

    def refresh() -> None:
        table, problem = session.document.table("tensile"), session.problem
        files = table.get("files") or ([table["file"]] if "file" in table else [])
        named.set_text(f"From {', '.join(map(str, files))}" if files else "")
        ours = bool(files) and problem is not None and problem.table in ("tensile", "material")
        told.set_text(plain_words(problem) if problem is not None and ours else "")

    refresh()
    session.on_scenario(refresh)


class _Fit:
    """The laws fitted to the test."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._fit: TensileFit | None = None
        self._asked: Scenario | None = None
        self._row = RunRow("tensile", "Fit the laws", self._begin)
        with ui.column().classes("w-full gap-2") as self._box:
            self._chart = Chart("tensile.chart", "stretch [-]", "engineering stress [kPa]", height="18rem")
            self._table = NumberTable("tensile.laws")
            with ui.row().classes("w-full gap-2 items-center no-wrap"):
                self._law = ui.select([], label="Law").classes("grow").mark("tensile.law")
                self._law.props("dense outlined options-dense data-testid=tensile.law")
                use = ui.button("Use this silicone", icon="tune", on_click=self._use).mark("tensile.use")
                use.props("dense outline no-caps size=sm data-testid=tensile.use").classes("px-2")
            with ui.row().classes("gap-1"):
                for label, mark, act in (
                    ("material.toml", "tensile.toml", self._take_material),
                    ("table.csv", "tensile.csv", self._take_rows),
                ):
                    button = ui.button(label, icon="download", on_click=act).mark(mark)
                    button.props(f"dense flat no-caps size=sm data-testid={mark}")
            self._told = ui.label("").classes("text-sm whitespace-pre-line break-words").mark("tensile.told")
            self._told.props("data-testid=tensile.told")
        self._box.set_visibility(False)

    async def _begin(self) -> None:
        try:
            asked = scenario_with(self._session, STUDY)
            if not isinstance(asked.task, TensileTask):
                raise InputError("expected a tensile test; drop a CSV first")
        except InputError as error:
            missing = "file" not in self._session.document.table("tensile")
            self._row.warn("Drop a CSV of a tensile test first." if missing else plain_words(error))
            return
        fit = await self._row.do(lambda progress: run_tensile(asked))
        if fit is None:
            return
        self._fit, self._asked = fit, asked
        best = fit.best
        usable = [law for law, found in fit.fits.items() if found.material is not None]
        points = f"{fit.stretch.size} points{asked.task.left_out}"
        self._row.say(f"{points}; best: {best.law.name}." if best else f"{points}; no law is a material to use.")
        self._told.set_text("\n".join((*fit.problems, *fit.warnings)))
        self._law.set_options(usable, value=best.law.name if best else None)
        self._table.show(*law_rows(fit), "laws.csv")
        self._chart.show(law_traces(fit))
        self._box.set_visibility(True)

    def _use(self) -> None:
        """Make the fitted law the scenario's silicone."""
        chosen: LawFit | None = None if self._fit is None else self._fit.fits.get(str(self._law.value))
        if chosen is None or chosen.material is None:
            return
        self._session.change_all("material", material_table(chosen.material))
        ui.notify("The scenario has this silicone now", position="bottom-right", timeout=2000)

    def _take_material(self) -> None:
        if self._fit is not None and self._asked is not None and isinstance(self._asked.task, TensileTask):
            ui.download.content(material_file_text(self._asked.task, self._fit), "material.toml", "text/plain")

    def _take_rows(self) -> None:
        if self._fit is not None and self._asked is not None and isinstance(self._asked.task, TensileTask):
            ui.download.content(tensile_table_text(self._asked.task, self._fit), "table.csv", "text/csv")
