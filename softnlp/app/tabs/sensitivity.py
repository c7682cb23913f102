"""The sensitivity tab: what the pose shown is sensitive to, and what tolerances do to its tip, as the command says."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from nicegui import ui

from softnlp.app import controls, wanted
from softnlp.app.asking import Progress, bars
from softnlp.app.parts import NumberTable, downloads, study_row
from softnlp.app.pictures import Pictures
from softnlp.app.session import Stage
from softnlp.base.errors import InputError
from softnlp.figures.sensitivity import sensitivity_figure
from softnlp.model.quantities import Model
from softnlp.model.segments import SegmentedRobot, require_one_segment
from softnlp.results.document import document_text
from softnlp.results.sensitivity import sensitivity_document, table_rows
from softnlp.scenario.data import require_no_obstacles
from softnlp.studies.report import SensitivityReport, named_tolerances, sensitivity_report, tolerance_keys

_FIRST = {"length_mm": "0.2", "pressure_bar": "1 %"}
_TITLES = {"what 1 % more does (0.01 more of what is 0)": "What 1 % more does (0.01 more of what is 0)"}


def sensitivity_tab(stage: Stage) -> None:
    """Build the tab in the current slot."""
    with ui.column().classes("w-full gap-3 pt-2"):
        _Sensitivity(stage)


class _Sensitivity:
    def __init__(self, stage: Stage) -> None:
        self._stage, self._session = stage, stage.session
        self._tolerances: dict[str, str] = dict(_FIRST)
        controls.heading("Tolerances")
        ui.label("One standard deviation of each, as a number or in per cent.").classes("text-sm opacity-80")
        self._rows = ui.column().classes("w-full gap-2")
        self._add = controls.select([], "tolerance.add", "Add a tolerance", on_change=lambda e: self._added(e.value))
        self._samples = controls.number("Draws that check them", "sensitivity.samples", value=200, min=0, precision=0)
        self._samples.classes("w-full")
        self._build()
        self._row = study_row("sensitivity", "Differentiate the pose", self._asked, self._finish)
        self._tables = ui.column().classes("w-full gap-2")
        with ui.row().classes("gap-1") as self._files:
            self._texts = downloads(("sensitivity.json", "sensitivity.json", "application/json"))
        self._files.set_visibility(False)
        self._pictures = Pictures("sensitivity")

    def _known(self) -> list[str]:
        scenario = self._session.scenario
        if scenario is None or isinstance(scenario.robot, SegmentedRobot):
            return []
        return list(tolerance_keys(Model(scenario.robot, scenario.material)))

    def _build(self) -> None:
        """Build a row for each tolerance."""
        self._rows.clear()
        with self._rows:
            for key, text in self._tolerances.items():
                with ui.row().classes("w-full items-center gap-2 no-wrap"):
                    ui.label(key).classes("text-sm w-44 shrink-0")
                    field = controls.named(ui.input("Deviation", value=text), f"tolerance.{key}")
                    field.props(controls.BOX).without_auto_validation().classes("grow min-w-0")
                    field.on_value_change(lambda e, key=key: self._tolerances.update({key: str(e.value or "")}))
                    remove = partial(self._remove, key)
                    control = controls.button(
                        "", "close", f"tolerance.remove.{key}", remove, "flat dense round size=sm"
                    )
                    control.props(f'aria-label="remove {key}"')
        self._add.set_options(wanted.free_keys(self._known(), self._tolerances), value=None)

    def _added(self, key: str | None) -> None:
        if key is not None:
            self._tolerances[key] = "1 %"
            self._build()

    def _remove(self, key: str) -> None:
        del self._tolerances[key]
        self._build()

    def _asked(self) -> Callable[[Progress], SensitivityReport]:
        scenario, pressure = self._session.scenario, self._session.pressure.copy()
        if scenario is None or self._session.problem is not None:
            raise self._session.problem or InputError("expected a robot that can be made")
        require_one_segment(scenario.robot, "a sensitivity")
        require_no_obstacles(scenario, "a sensitivity")
        samples = self._samples.value
        if samples is None or samples < 0 or samples == 1:
            raise InputError("Draws: expected 0, or at least 2")
        given = [f"{key}={text.replace(' ', '')}" for key, text in self._tolerances.items() if text.strip()]
        try:
            tolerances = named_tolerances(given, scenario.robot, scenario.material, scenario.coefficients, pressure)
        except InputError as error:
            raise InputError(error.message) from None  # and not by the name of the command's option

        def work(progress: Progress) -> SensitivityReport:
            def told(done: int) -> None:
                progress(done, samples or 1, f"{done} of {samples:.0f} draws")

            return sensitivity_report(
                scenario.robot,
                scenario.material,
                pressure,
                tolerances,
                samples=int(samples),
                progress=told,
                **scenario.settings,
            )

        return work

    async def _finish(self, report: SensitivityReport) -> None:
        self._tables.clear()
        if not report.solved:
            step = report.sensitivities.step
            self._row.warn(f"{step.status.value.replace('_', ' ').capitalize()}: {step.message}.")
            return
        title = self._session.document.get("", "title", "") or report.robot.name
        self._row.say(f"{report.robot.name} at {bars(report.sensitivities.step.pressure)} bar.")
        with self._tables:
            for k, (heading, header, rows) in enumerate(table_rows(report)):
                words = _TITLES.get(heading, heading[:1].upper() + heading[1:])
                ui.label(words).classes("text-sm font-medium")
                NumberTable(f"sensitivity.table.{k}", height="14rem").show(
                    header, [[_number(cell) for cell in row] for row in rows], f"{heading.split(' (')[0]}.csv"
                )
        self._texts["sensitivity.json"] = lambda: document_text(sensitivity_document(report, title, 1, ()))
        self._files.set_visibility(True)
        self._stage.figures["Sensitivity"] = {"": lambda: sensitivity_figure(report, title)}
        await self._pictures.draw({"sensitivity": lambda: sensitivity_figure(report, title)})


def _number(cell: str) -> str | float:
    """Return a cell as a number, where it is one."""
    try:
        return float(cell)
    except ValueError:
        return cell
