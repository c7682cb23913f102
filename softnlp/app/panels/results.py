"""What was found: certificate in words, numbers, chamber lengths, strains and forces along the rod."""

from __future__ import annotations

import json
from collections.abc import Mapping

import numpy as np
from nicegui import ui
from numpy.typing import NDArray

from softnlp.app.numbers import NOTHING, Line, certificate_words, step_lines
from softnlp.app.parts import Chart, csv_text, line
from softnlp.base.columns import MM, OUTPUTS, PER_M, Output
from softnlp.base.units import MILLIMETRE
from softnlp.figures.style import COLOURS
from softnlp.results import table_text, to_json
from softnlp.statics.step import Run, Shape
from softnlp.studies.fields import value

Array = NDArray[np.float64]

_ALONG: Mapping[str, Output] = {
    key: OUTPUTS[name]
    for key, name in (
        ("curvature", "curvature"),
        ("strain", "shear_extension"),
        *((name, name) for name in ("force", "moment", "position")),
    )
}


_ENDS = {
    "well": ("check_circle", "text-green-700 dark:text-green-400"),
    "warned": ("warning", "text-orange-700 dark:text-orange-300"),
    "failed": ("error", "text-red-700 dark:text-red-300"),
}


class ResultsPanel:
    """Shows one step; `show` is called with each new one, and only the texts that changed travel to the browser."""

    def __init__(self) -> None:
        """Build the panel in the current slot."""
        self._run: Run | None = None
        self._labels: dict[str, ui.label] = {}
        self._drawn: Shape | None = None
        with ui.row().classes("w-full items-start no-wrap gap-2"):
            self._icon = ui.icon("hourglass_empty").classes("text-xl shrink-0")
            self._certificate = ui.label("solving …").classes("text-sm").props("data-testid=certificate")
            self._certificate.mark("certificate")
        self._warnings = ui.label().classes("text-xs text-orange-800 dark:text-orange-300 whitespace-pre-line")
        self._warnings.props("data-testid=warnings")
        self._numbers = ui.grid(columns="1fr auto 52px").classes("w-full gap-x-2 gap-y-0 text-sm mt-2")
        with ui.row().classes("w-full gap-1"):
            ui.button("Copy", icon="content_copy", on_click=self._copy).props(
                "flat dense no-caps size=sm data-testid=results-copy"
            )
            ui.button("CSV", icon="download", on_click=self._download).props(
                "flat dense no-caps size=sm data-testid=results-csv"
            )
            ui.button("JSON", icon="download", on_click=self._download_json).props(
                "flat dense no-caps size=sm data-testid=results-json"
            )

    def details(self) -> None:
        """Build what few people look at, in the current slot: chambers, strains and forces along the rod, equations."""
        with ui.expansion("Chambers").classes("w-full softnlp-panel").props("dense data-testid=chambers"):
            self._chambers = ui.grid(columns="1fr auto 52px").classes("w-full gap-x-2 gap-y-0 text-sm")
        self._along = ui.expansion("Strains and internal force along the rod").classes("w-full softnlp-panel")
        self._along.props("dense data-testid=along")
        with self._along:
            self._quantity = ui.select(
                {key: f"{output.title} [{output.unit.sign or NOTHING}]" for key, output in _ALONG.items()},
                value="curvature",
                on_change=lambda: self._draw(force=True),
            ).props("dense outlined options-dense data-testid=along-quantity")
            self._quantity.classes("w-full")
            self._plot = Chart("along-plot", f"s [{MM}]", f"u [{PER_M}]", height="14rem")
            ui.button("CSV along the rod", icon="download", on_click=self._download_along).props(
                "flat dense no-caps size=sm data-testid=along-csv"
            )
        self._along.on_value_change(lambda: self._draw(force=True))
        with ui.expansion("Equations").classes("w-full softnlp-panel").props("dense data-testid=equations"):
            self._equations = ui.grid(columns="1fr auto 52px").classes("w-full gap-x-2 gap-y-0 text-xs")
        ui.timer(0.3, self._draw)

    @property
    def run(self) -> Run | None:
        """The run shown, of one step."""
        return self._run

    def show(self, run: Run) -> None:
        """Show the only step of a run."""
        self._run = run
        step = run.steps[0]
        solved = step.status.has_solution
        _set(self._certificate, certificate_words(run))
        icon, tint = _ENDS["failed" if not solved else "warned" if step.warnings else "well"]
        self._icon.name = icon
        self._icon.classes(replace=f"text-xl shrink-0 {tint}")
        _set(self._warnings, "\n".join((*run.warnings, *step.warnings)))
        self._warnings.set_visibility(bool(self._warnings.text))
        lines = step_lines(run)
        self._fill(self._numbers, "numbers", lines.numbers)
        self._fill(self._chambers, "chambers", lines.chambers)
        equations = [
            Line(f"equation.{line.equation}", line.equation, f"{line.value:.1e}", line.unit)
            for line in step.certificate
        ]
        self._fill(self._equations, "equations", equations)

    def _fill(self, grid: ui.grid, group: str, lines: list[Line]) -> None:
        """Write numbers into a grid; its rows are made anew only when there are others."""
        keys = [f"{group}/{line.key}" for line in lines]
        if [key for key in self._labels if key.startswith(f"{group}/")] != keys:
            for key in [key for key in self._labels if key.startswith(f"{group}/")]:
                del self._labels[key]
            grid.clear()
            with grid:
                for key, line in zip(keys, lines, strict=True):
                    ui.label(line.label).classes("opacity-80")
                    label = ui.label(line.text).classes("tabular-nums text-right")
                    self._labels[key] = label.props(f'data-testid="value-{line.key}"').mark(f"value.{line.key}")
                    ui.label(line.unit).classes("opacity-70")
        for key, line in zip(keys, lines, strict=True):
            _set(self._labels[key], line.text)

    def _draw(self, *, force: bool = False) -> None:
        """Draw what is chosen along the rod, some time after the last change and only where it is open."""
        if self._run is None or not self._along.value:
            return
        pose = self._run.steps[0].pose
        shape = None if pose is None else pose.shape
        if shape is self._drawn and not force:
            return
        self._drawn = shape
        output = _ALONG[str(self._quantity.value)]
        traces = []
        if pose is not None and shape is not None:
            s = np.asarray(shape.arc) * pose.stretch * self._run.robot.length / MILLIMETRE
            traces = [
                line(s.tolist(), values.tolist(), COLOURS[k], axis, mode="lines")
                for k, (axis, values) in enumerate(zip("xyz", value(output, self._run.steps[0]).T, strict=True))
            ]
        frame = output.meaning.split()[-2]  # "in the body frame"
        words = f"{output.title.split()[-1]} [{output.unit.sign or NOTHING}], {frame} frame"
        self._plot.show(traces, y_label=words)

    def _copy(self) -> None:
        if self._run is None:
            return
        lines = step_lines(self._run)
        rows = [f"{line.label}\t{line.text}\t{line.unit}" for line in (*lines.numbers, *lines.chambers)]
        ui.clipboard.write("\n".join(rows))
        ui.notify("copied", type="positive")

    def _download(self) -> None:
        if self._run is not None:
            ui.download.content(table_text(self._run), "softnlp_pose.csv", "text/csv")

    def _download_json(self) -> None:
        if self._run is not None:
            ui.download.content(json.dumps(to_json(self._run), indent=2), "softnlp_pose.json", "application/json")

    def _download_along(self) -> None:
        if self._run is not None and self._run.steps[0].pose is not None:
            ui.download.content(along_csv(self._run), "softnlp_along_the_rod.csv", "text/csv")


def along_csv(run: Run) -> str:
    """Return everything along the rod of the only step of a run as CSV; raises `ValueError` where it has no pose."""
    pose = run.steps[0].pose
    if pose is None:
        raise ValueError("the step has no pose")
    header = ["arc", *(output.entry((k,)) for output in _ALONG.values() for k in range(3))]
    along = (value(output, run.steps[0]) for output in _ALONG.values())
    columns = np.hstack([np.asarray(pose.shape.arc)[:, None], *along])
    return csv_text(header, columns.tolist())


def _set(label: ui.label, text: str) -> None:
    if label.text != text:
        label.set_text(text)
