"""The compare tab: the robot of the page beside what was measured, with the statistics and figures of the command."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui import ui

from softnlp.app import controls
from softnlp.app.asking import Progress, scenario_with
from softnlp.app.parts import NumberTable, csv_drop, downloads, study_row
from softnlp.app.pictures import Pictures
from softnlp.app.session import Stage
from softnlp.base.columns import OUTPUTS
from softnlp.base.errors import InputError
from softnlp.figures.compare import figure_makers
from softnlp.model.contact_settings import CLOSURES
from softnlp.model.conventions import CONVENTIONS
from softnlp.model.materials import load_materials
from softnlp.results.comparison import STATISTICS, comparison_document, rows_text, statistics_cells, summary_text
from softnlp.results.document import document_text
from softnlp.scenario.compare import ALL, Asked, CompareTask, compare_task, run_compare
from softnlp.scenario.examples import shipped_folder
from softnlp.scenario.measured_rows import MEASURED_COLUMNS
from softnlp.studies.comparison import OBSERVABLES, Comparison
from softnlp.studies.variants import NAMED, OWN

Compared = tuple[CompareTask, Comparison]
_FORCE = OUTPUTS["blocked_force"].key
_EXAMPLE = "measured_angles.csv"


def compare_tab(stage: Stage) -> None:
    """Build the tab in the current slot."""
    with ui.column().classes("w-full gap-3 pt-2"):
        _Compare(stage)


class _Compare:
    def __init__(self, stage: Stage) -> None:
        self._stage, session = stage, stage.session
        self._session = session
        self._file: str | None = None
        controls.heading("What was measured")
        words = f"p1_bar, p2_bar … and some of {', '.join(MEASURED_COLUMNS)}"
        csv_drop("compare.drop", "Drop a CSV file here, or click +", self._take)
        ui.label(f"Columns: {words}.").classes("text-sm opacity-80")
        with ui.row().classes("w-full items-center no-wrap gap-2"):
            self._named = controls.named(ui.label("No file yet.").classes("text-sm grow"), "compare.file")
            controls.button("Open an example", "school", "compare.example", self._example, controls.USE).classes("px-2")
        controls.heading("With what it is compared")
        empty = "that of the scenario"
        self._choices = {
            "laws": self._choice("laws", "Laws", []),
            "coefficients": self._choice("coefficients", "Coefficients", [*NAMED, OWN]),
            "conventions": self._choice("conventions", "Conventions", [*CONVENTIONS]),
            "closures": self._choice("closures", "Closures", [*CLOSURES]),
        }
        ui.label(f"Nothing chosen is {empty}; several of each are compared with each other.").classes(
            "text-sm opacity-80"
        )
        self._shape = controls.toggle({"free": "Free shapes", "blocked": "Blocked shapes"}, "compare.shape", "free")
        self._row = study_row("compare", "Compare", self._asked, self._finish)
        self._table = NumberTable("compare.table", height="20rem")
        files = (("comparison.json", "application/json"), ("rows.csv", "text/csv"), ("summary.csv", "text/csv"))
        with ui.row().classes("gap-1") as self._files:
            self._texts = downloads(*((name, f"compare.{name}", kind) for name, kind in files))
        self._files.set_visibility(False)
        self._pictures = Pictures("compare")
        for box in (self._choices["closures"], self._shape):
            box.set_visibility(False)  # until there are forces
        session.follow(self._refresh)

    @staticmethod
    def _choice(name: str, label: str, options: list[str]) -> ui.select:
        return controls.select(options, f"compare.{name}", label, multiple=True, value=[], look="use-chips clearable")

    def _refresh(self) -> None:
        name = self._session.table("material").get("name")
        known = load_materials().get(str(name))
        options = [ALL, *({} if known is None else known.models)]
        kept = [law for law in self._choices["laws"].value or [] if law in options]
        self._choices["laws"].set_options(options, value=kept)

    def _take(self, name: str, content: bytes) -> None:
        kept = self._session.keep(name, content)
        self._file = kept
        lines = content.decode("utf-8", "replace").strip().count("\n")
        self._named.set_text(f"{kept}, {lines} rows")
        forces = _FORCE in content[:4000].decode("utf-8", "replace")
        self._choices["closures"].set_visibility(forces)
        self._shape.set_visibility(forces)

    def _example(self) -> None:
        self._take(_EXAMPLE, (shipped_folder() / "files" / _EXAMPLE).read_bytes())

    def _asked(self) -> Callable[[Progress], Compared]:
        if self._file is None:
            raise InputError("drop a file of measurements first, or open the example")
        path = self._session.folder / self._file
        forces = self._shape.visible
        scenario = scenario_with(self._session, "blocked-force" if forces else "forward", {"pressure": REST})
        chosen: dict[str, Any] = {key: tuple(box.value or ()) for key, box in self._choices.items()}
        if not forces:
            chosen["closures"] = ()
        task = compare_task(scenario, path, Asked(**chosen, shape=str(self._shape.value) if forces else "free"))

        def work(progress: Progress) -> Compared:
            def told(done: int, total: int) -> None:
                progress(done, total, f"{done} of {total} rows")

            return task, run_compare(task, told)

        return work

    async def _finish(self, compared: Compared) -> None:
        task, found = compared
        self._table.show(*statistics_rows(found), "summary.csv", csv=summary_text(found))
        told = [f"{len(task.columns.rows)} rows, {len(found.variants)} model{'s' * (len(found.variants) > 1)}."]
        if found.best is not None and len(found.variants) > 1:
            told.append(f"Least error: {found.labels[found.best]}.")
        told += [f"{found.lost(v)} rows of {found.labels[v]} have no solution." for v in range(len(found.variants))
                 if found.lost(v)]  # fmt: skip
        self._row.say(" ".join([*told, *(f"Note: {note}." for note in (*task.notes, *task.warnings))]))
        self._texts["comparison.json"] = lambda: document_text(comparison_document(task, found), compact=False)
        self._texts["rows.csv"] = lambda: rows_text(task, found)
        self._texts["summary.csv"] = lambda: summary_text(found)
        self._files.set_visibility(True)
        self._stage.figures["Compare"] = figure_makers(task, found)
        await self._pictures.draw(self._stage.figures["Compare"])


REST: dict[str, Any] = {"ramp": {"sets": [1], "to_bar": 0.1, "steps": 2}}
"""Pressures that are not used: those of the measurements are."""


def statistics_rows(found: Comparison) -> tuple[list[str], list[list[Any]]]:
    """Return header and rows of the errors: a row for each observable and model, in the unit of files."""
    rows = []
    for name in found.observables:
        for v, label in enumerate(found.labels):
            count, *numbers, _, _ = statistics_cells(found.statistics(v, name), name)
            rows.append([f"{OBSERVABLES[name].axis}", label, count, *numbers])
    names = [*STATISTICS][: len(rows[0]) - 2] if rows else []
    return ["number", "model", *(n.replace("_percent", " [%]").replace("_", " ") for n in names)], rows
