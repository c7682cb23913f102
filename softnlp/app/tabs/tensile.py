"""A tensile test on the page: its file and specimen, the laws fitted to it, and one of them taken over."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import numpy as np
from nicegui import ui

from softnlp.app import controls
from softnlp.app.asking import Progress, scenario_with
from softnlp.app.parts import Chart, NumberTable, csv_drop, downloads, line, marks, study_row
from softnlp.app.session import Session
from softnlp.base.errors import InputError
from softnlp.figures.style import colour
from softnlp.results.identify_document import material_file_text, material_table, tensile_table_text
from softnlp.scenario.read import Scenario
from softnlp.scenario.tensile import run_tensile
from softnlp.studies.measurements import TensileTask
from softnlp.studies.tensile import TensileFit

T = TypeVar("T")
Rows = list[list[Any]]

GREY = "#909090"
_STRESSES = {"engineering": "Engineering: over the area before the test", "true": "True: over the area at the time"}
_SPECIMEN = {
    "gauge_length_mm": "Gauge length",
    "diameter_mm": "Diameter",
    "width_mm": "Width",
    "thickness_mm": "Thickness",
}
_DASHES = ("solid", "dash", "dashdot", "dot", "longdash")


def from_files(table: Mapping[str, Any]) -> str:
    """Return which files a table names, in words."""
    files = table.get("files") or ([table["file"]] if "file" in table else [])
    return f"From {', '.join(map(str, files))}" if files else ""


def asked_with(session: Session, kind: type[T], what: str, named: bool) -> tuple[Scenario, T]:
    """Return the identification on the screen and its task of a kind; raises `InputError`.

    what : its file is of. named : whether the scenario names one; else a person is asked for it.
    """
    asked = None
    try:
        asked = scenario_with(session, "identify")
    except InputError:
        if named:
            raise
    if asked is None or not isinstance(asked.task, kind):
        raise InputError(f"Drop a CSV of {what} first.")
    return asked, asked.task


def tensile_part(session: Session) -> None:
    """Build it in the current slot."""
    _test(session)
    ui.separator()
    _Fit(session)


def _test(session: Session) -> None:
    """Show the keys of [tensile]."""
    controls.heading("Tensile test")
    files = ui.label("").classes("text-sm").mark("tensile.file")

    def dropped(name: str, content: bytes) -> None:
        """Take a file; what it needs beside it can be typed afterwards, what cannot be read is not taken."""
        others = {key: value for key, value in session.table("tensile").items() if key != "files"}
        session.take_file("tensile", name, content, others, lambda p: (p.table, p.key) == ("tensile", "file"))

    csv_drop("tensile.drop", "Drop a CSV: stretch, stress_MPa or displacement_mm, force_N", dropped)
    controls.choice_field(session, "tensile", "stress", "Stress of the file", _STRESSES)
    ui.label("The specimen, where the file has force and displacement").classes(controls.HINT)
    with ui.grid(columns=2).classes("w-full gap-2"):
        for key, label in _SPECIMEN.items():
            controls.number_field(session, "tensile", key, f"{label} [mm]", "")
    problem = controls.problem_label("tensile.problem")

    def refresh() -> None:
        words = from_files(session.table("tensile"))
        files.set_text(words)
        problem.set_text(controls.problem_of(session, "tensile", "material") if words else "")

    session.follow(refresh)


class _Fit:
    """The laws fitted to the test."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._fit: TensileFit | None = None
        self._row = study_row("tensile", "Fit the laws", self._asked, self._finish)
        with ui.column().classes("w-full gap-2") as self._box:
            self._chart = Chart("tensile.chart", "stretch [-]", "engineering stress [kPa]", height="18rem")
            self._table = NumberTable("tensile.laws")
            with ui.row().classes("w-full gap-2 items-center no-wrap"):
                self._law = controls.select([], "tensile.law", "Law").classes("grow", remove="w-full")
                controls.use_button("Use this silicone", "tensile.use", self._use)
            with ui.row().classes("gap-1"):
                self._texts = downloads(
                    ("material.toml", "tensile.toml", "text/plain"), ("table.csv", "tensile.csv", "text/csv")
                )
            self._told = controls.named(ui.label("").classes("text-sm whitespace-pre-line break-words"), "tensile.told")
        self._box.set_visibility(False)

    def _asked(self) -> Callable[[Progress], tuple[TensileTask, TensileFit]]:
        asked, task = asked_with(self._session, TensileTask, "a tensile test", "file" in self._session.table("tensile"))
        return lambda progress: (task, run_tensile(asked))

    def _finish(self, done: tuple[TensileTask, TensileFit]) -> None:
        task, fit = done
        self._fit = fit
        self._texts["material.toml"] = lambda: material_file_text(task, fit)
        self._texts["table.csv"] = lambda: tensile_table_text(task, fit)
        best = fit.best
        usable = [law for law, found in fit.fits.items() if found.material is not None]
        points = f"{fit.stretch.size} points{task.left_out}"
        self._row.say(f"{points}; best: {best.law.name}." if best else f"{points}; no law is a material to use.")
        self._told.set_text("\n".join((*fit.problems, *fit.warnings)))
        self._law.set_options(usable, value=best.law.name if best else None)
        self._table.show(*law_rows(fit), "laws.csv")
        self._chart.show(law_traces(fit))
        self._box.set_visibility(True)

    def _use(self) -> None:
        """Make the fitted law the scenario's silicone."""
        chosen = None if self._fit is None else self._fit.fits.get(str(self._law.value))
        if chosen is None or chosen.material is None:
            return
        self._session.change_all("material", material_table(chosen.material))
        ui.notify("The scenario has this silicone now", position="bottom-right", timeout=2000)


def law_rows(fit: TensileFit) -> tuple[list[str], Rows]:
    """Return header and rows of the laws fitted to a tensile test."""
    rows: Rows = []
    for f in fit.fits.values():
        constants = ", ".join(
            f"{c.file_key} = {f.constants[c.name] / c.scale:.5g} ± {f.standard_errors[c.name] / c.scale:.2g}"
            + (f.notes[c.name] and f" ({f.notes[c.name]})")
            for c in f.law.constants
        )
        problem = f.problem and f"{f.status}: {f.problem}"
        rows.append([f.law.name, f.r_squared, f.misfit.rmse / 1e3, f.misfit.mape, constants, problem])
    header = ["law", "R²", "rms [kPa]", "mean [%]", "constants ± standard error", "problem"]
    return (header, rows) if any(row[-1] for row in rows) else (header[:-1], [row[:-1] for row in rows])


def law_traces(fit: TensileFit) -> list[dict[str, Any]]:
    """Return the traces of a tensile test and of the laws fitted to it, stretch against kPa."""
    low, high = next(iter(fit.fits.values())).fitted_stretch
    stretch = np.linspace(low, high, 121)
    traces = [marks(fit.stretch, fit.stress / 1e3, GREY, "data", size=5, symbol=100)]
    for k, f in enumerate(fit.fits.values()):
        trace = line(stretch, f.stress(stretch) / 1e3, colour(k), f.law.name, mode="lines")
        trace["line"] |= {"dash": _DASHES[k % len(_DASHES)]}
        traces.append(trace)
    return traces
