"""What was found: certificate in words, numbers, chamber lengths, strains and forces along the rod.

The numbers are taken from the document that `softnlp run --json` prints.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from nicegui import ui

from softnlp.app.controls import SMALL, button, named
from softnlp.app.parts import Chart, csv_text, line
from softnlp.base.columns import MM, OUTPUTS, PER_M, TABLES, Output, written
from softnlp.base.units import MILLIMETRE
from softnlp.figures.style import COLOURS
from softnlp.results import table_text, to_json
from softnlp.statics.step import Run, Shape
from softnlp.studies.fields import value

NOTHING = "–"
_ALONG: Mapping[str, Output] = {
    "curvature": OUTPUTS["curvature"],
    "strain": OUTPUTS["shear_extension"],
    **{name: OUTPUTS[name] for name in ("force", "moment", "position")},
}
_ENDS = {
    "well": ("check_circle", "text-green-700 dark:text-green-400"),
    "warned": ("warning", "text-orange-700 dark:text-orange-300"),
    "failed": ("error", "text-red-700 dark:text-red-300"),
}
_GRID = "1fr auto 52px"


class ResultsPanel:
    """Shows one step; `show` is called with each new one, and only the texts that changed travel to the browser."""

    def __init__(self) -> None:
        """Build the panel in the current slot."""
        self._run: Run | None = None
        self._labels: dict[str, ui.label] = {}
        self._drawn: Shape | None = None
        self._headline = ui.element("div").classes("w-full grid grid-cols-2 gap-x-3 gap-y-1")
        with ui.row().classes("w-full items-center no-wrap gap-2 mt-1"):
            self._icon = ui.icon("hourglass_empty").classes("text-xl shrink-0")
            self._ended = named(ui.label("Solving …").classes("text-sm grow"), "ended").props("role=status")
            self._fold = button("How well", "expand_more", "certificate-fold", self._turn, SMALL)
        self._certificate = named(ui.label("").classes("text-sm opacity-90 pl-7"), "certificate")
        self._certificate.set_visibility(False)
        self._warnings = ui.label().classes("text-xs text-orange-800 dark:text-orange-300 whitespace-pre-line")
        self._warnings.props("data-testid=warnings")
        self._numbers = ui.grid(columns=_GRID).classes("w-full gap-x-2 gap-y-0 text-sm mt-2")
        with ui.row().classes("w-full gap-1"):
            for words, icon, act in (
                ("Copy", "content_copy", self._copy),
                ("CSV", "download", partial(self._offer, table_text, "softnlp_pose.csv")),
                ("JSON", "download", partial(self._offer, _json, "softnlp_pose.json", "application/json")),
            ):
                button(words, icon, f"results-{words.lower()}", act)

    def details(self) -> None:
        """Build what few people look at, in the current slot: chambers, strains and forces along the rod, equations."""
        with _part("Chambers", "chambers"):
            self._chambers = ui.grid(columns=_GRID).classes("w-full gap-x-2 gap-y-0 text-sm")
        with _part("Strains and internal force along the rod", "along") as self._along:
            labels = {key: f"{output.title} [{output.unit.sign or NOTHING}]" for key, output in _ALONG.items()}
            self._quantity = ui.select(labels, value="curvature", on_change=lambda: self._draw(force=True))
            self._quantity.props("dense outlined options-dense data-testid=along-quantity").classes("w-full")
            self._plot = Chart("along-plot", f"s [{MM}]", f"u [{PER_M}]", height="14rem")
            button("CSV along the rod", "download", "along-csv", self._offer_along)
        self._along.on_value_change(lambda: self._draw(force=True))
        with _part("Equations", "equations"):
            self._equations = ui.grid(columns=_GRID).classes("w-full gap-x-2 gap-y-0 text-xs")
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
        self._ended.set_text(ended_words(run))
        self._certificate.set_text(certificate_words(run))
        icon, tint = _ENDS["failed" if not solved else "warned" if step.warnings else "well"]
        self._icon.name = icon
        self._icon.classes(replace=f"text-xl shrink-0 {tint}")
        self._warnings.set_text("\n".join((*run.warnings, *step.warnings)))
        self._warnings.set_visibility(bool(self._warnings.text))
        lines = step_lines(run)
        cards = headline(lines.numbers)
        first = [line for _, group in cards for line in group]
        self._fill_headline(cards)
        self._fill(self._numbers, "numbers", [line for line in lines.numbers if line not in first])
        self._fill(self._chambers, "chambers", lines.chambers)
        equations = [
            Line(f"equation.{line.equation}", line.equation, f"{line.value:.1e}", line.unit)
            for line in step.certificate
        ]
        self._fill(self._equations, "equations", equations)

    def _turn(self) -> None:
        """Unfold or fold how well the equations hold."""
        wanted = not self._certificate.visible
        self._certificate.set_visibility(wanted)
        self._fold.props(f"icon={'expand_less' if wanted else 'expand_more'} aria-expanded={str(wanted).lower()}")

    def _fill_headline(self, cards: list[tuple[str, list[Line]]]) -> None:
        """Write what matters first, in large digits."""
        lines = [line for _, group in cards for line in group]
        keys = [f"headline/{line.key}" for line in lines]
        if [key for key in self._labels if key.startswith("headline/")] != keys:
            for key in [key for key in self._labels if key.startswith("headline/")]:
                del self._labels[key]
            self._headline.clear()
            with self._headline:
                for title, group in cards:
                    wide = "col-span-2" if len(group) > 1 else ""
                    with ui.column().classes(f"gap-0 {wide}"):
                        ui.label(title).classes("text-xs opacity-80")
                        with ui.row().classes("items-baseline gap-3 no-wrap"):
                            for line in group:
                                size = "text-lg" if len(group) > 1 else "text-2xl"
                                label = ui.label(line.text).classes(f"tabular-nums font-medium leading-tight {size}")
                                self._labels[f"headline/{line.key}"] = named(
                                    label, f"value.{line.key}", f"value-{line.key}"
                                )
                            ui.label(group[0].unit).classes("text-sm opacity-80 -ml-2")
        for key, line in zip(keys, lines, strict=True):
            self._labels[key].set_text(line.text)

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
                    self._labels[key] = named(label, f"value.{line.key}", f"value-{line.key}")
                    ui.label(line.unit).classes("opacity-70")
        for key, line in zip(keys, lines, strict=True):
            self._labels[key].set_text(line.text)

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

    def _offer(self, text: Callable[[Run], str], name: str, kind: str = "text/csv") -> None:
        if self._run is not None:
            ui.download.content(text(self._run), name, kind)

    def _offer_along(self) -> None:
        if self._run is not None and self._run.steps[0].pose is not None:
            self._offer(along_csv, "softnlp_along_the_rod.csv")


def along_csv(run: Run) -> str:
    """Return everything along the rod of the only step of a run as CSV; raises `ValueError` where it has no pose."""
    pose = run.steps[0].pose
    if pose is None:
        raise ValueError("the step has no pose")
    header = ["arc", *(output.entry((k,)) for output in _ALONG.values() for k in range(3))]
    along = (value(output, run.steps[0]) for output in _ALONG.values())
    columns = np.hstack([np.asarray(pose.shape.arc)[:, None], *along])
    return csv_text(header, columns.tolist())


def _json(run: Run) -> str:
    return json.dumps(to_json(run), indent=2)


def _part(label: str, test: str) -> ui.expansion:
    return ui.expansion(label).classes("w-full softnlp-panel").props(f"dense data-testid={test}")


@dataclass(frozen=True)
class Line:
    """A number with its name and unit.

    key : of the JSON document, with the index of an entry, `tip_position_mm.0`. value : in full, or
    None.
    """

    key: str
    label: str
    text: str
    unit: str
    value: float | None = None


@dataclass(frozen=True)
class Lines:
    """The numbers of a step. numbers : without a solution each is a dash. chambers : of each chamber."""

    numbers: list[Line]
    chambers: list[Line]


def step_lines(run: Run) -> Lines:
    """Return what the document of a run says of its only step."""
    step = to_json(run)["steps"][0]
    return Lines(_numbers(run, step), _lines(step, TABLES["page, chambers"], run))


def _numbers(run: Run, step: dict[str, Any]) -> list[Line]:
    names = [*TABLES["page"]]
    if any(run.loads.tip_force) or any(run.loads.tip_moment) or any(run.loads.gravity):
        names += TABLES["page, loads"]
    longer = OUTPUTS["elongation"]
    backbone, length = step[OUTPUTS["backbone_length"].key], longer.shown(run.robot.length)
    elongation = None if backbone is None else backbone - length
    lines = _lines({**step, longer.key: elongation}, [*names, *TABLES["page, wall"]], run)
    share = None if elongation is None else 100 * elongation / length
    at = 1 + next(k for k, line in enumerate(lines) if line.key == longer.key)
    percent = Line(f"{longer.name}_percent", lines[at - 1].label, written(share, ".2f", NOTHING), "% of L₀", share)
    return [*lines[:at], percent, *lines[at:]]


def _lines(step: dict[str, Any], names: Sequence[str], run: Run) -> list[Line]:
    """Return the lines of the outputs that the document of a step has."""
    lines = []
    for output in (OUTPUTS[name] for name in names if OUTPUTS[name].key in step):
        found, title = step[output.key], output.title or output.label.capitalize()
        if not output.dims:
            text = written(found, output.page, NOTHING) + _spread(step, output)
            lines.append(Line(output.key, title, text, output.unit.sign, _float(found)))
            continue
        indices = list("xyz") if output.dims == ("axis",) else [str(n + 1) for n in range(run.robot.chambers)]
        for k, index in enumerate(indices):
            entry = None if found is None or k >= len(found) else found[k]
            text = written(entry, output.page, NOTHING) + _spread(step, output, k)
            lines.append(Line(f"{output.key}.{k}", title.format(index), text, output.unit.sign, _float(entry)))
    return lines


def _float(value: Any) -> float | None:
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None


def _spread(step: dict[str, Any], output: Output, entry: int | None = None) -> str:
    """Return one standard deviation of an output, or of an entry of it, in words, where the document has it."""
    found = step.get("std", {}).get(output.key)
    if entry is not None:
        found = found[entry] if found is not None and entry < len(found) else None
    return "" if found is None else f" ± {written(found, output.page)}"


def headline(lines: Sequence[Line]) -> list[tuple[str, list[Line]]]:
    """Return what matters first: the bending, the force where the robot pushes, else its length, and the tip."""
    known = {line.key: line for line in lines}
    second = next(known[key] for key in (OUTPUTS[n].key for n in ("blocked_force", "backbone_length")) if key in known)
    tip = [known[f"{OUTPUTS['tip_position'].key}.{k}"] for k in range(3)]
    bending = known[OUTPUTS["bending_angle"].key]
    return [(bending.label, [bending]), (second.label, [second]), ("Tip x, y, z", tip)]


def ended_words(run: Run) -> str:
    """Return in a few words how a step ended; what a person has to do is told in full."""
    step = run.steps[0]
    if not step.status.has_solution or step.residual is None:
        return certificate_words(run)
    if step.time is not None and step.moving is not None:
        return f"At t = {step.time:.4g} s of the motion."
    if step.status.value != "solved":
        return "No contact: the robot does not reach the wall."
    return "Solved, with warnings." if step.warnings else "Solved."


def certificate_words(run: Run) -> str:
    """Return in plain words how a step ended and how well its equations hold, or what to do next."""
    step = run.steps[0]
    if not step.status.has_solution or step.residual is None:
        return f"{step.status.value.replace('_', ' ').capitalize()}: {step.message}."
    error = "" if step.discretisation_error is None else f", tip within {step.discretisation_error:.0e} L₀"
    lead = "Solved" if step.status.value == "solved" else "No contact: the robot does not reach the wall"
    return f"{lead}, residual {step.residual:.0e}{error}, {step.intervals} intervals."
