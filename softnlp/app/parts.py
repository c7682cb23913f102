"""What the tabs share: a run that can be stopped, numbers that can be taken away, a chart, a dropped file."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping, Sequence
from functools import partial
from math import isfinite
from typing import Any, TypeVar

import numpy as np
from nicegui import events, ui
from numpy.typing import NDArray

from softnlp.app.asking import Progress, Stopped
from softnlp.app.controls import HINT, button, named, plain_words
from softnlp.app.taken import LARGEST_FILE
from softnlp.app.theme import darkness, figure_config, figure_layout, figure_text, on_dark
from softnlp.base.errors import InputError, SoftnlpError
from softnlp.base.units import BAR
from softnlp.results import document
from softnlp.results.table import table_text
from softnlp.statics.step import Run

T = TypeVar("T")
Numbers = Sequence[float] | NDArray[np.float64]

MOST_ROWS = 400
"""Rows of a table on the page; the CSV has all."""

MOST_MARKS = 2000
"""Of a line of a chart."""


class RunRow:
    """A run button, a stop button, a progress bar, and a line that says how it went. One run at a time."""

    def __init__(self, marker: str, label: str, begin: Callable[[], Awaitable[None]]) -> None:
        """Build the row; `begin` is called by the button, and calls `do`."""
        self.begin = begin
        self.progress = Progress()
        self.running = False
        self._watch: Callable[[], None] | None = None
        with ui.row().classes("w-full items-center gap-2 no-wrap"):
            self._start = button(label, "play_arrow", f"{marker}.run", begin, "dense unelevated no-caps")
            self._end = button("Stop", "stop", f"{marker}.stop", self.stop, "dense outline no-caps")
            for control in (self._start, self._end):
                control.classes("px-3 shrink-0")
            self._bar = ui.linear_progress(0.0, show_value=False, size="8px").props("rounded instant-feedback")
        self._words = named(ui.label("").classes("text-sm break-words w-full"), f"{marker}.message")
        self._timer = ui.timer(0.25, self._look, active=False)
        self._end.set_visibility(False)
        self._bar.set_visibility(False)
        ui.context.client.on_delete(self.stop)

    async def do(self, work: Callable[[Progress], T], watch: Callable[[], None] | None = None) -> T | None:
        """Do work in the background and return its result; None where it was stopped or is not possible, which is said.

        watch : called now and then meanwhile, to draw what there is already.
        """
        if self.running:
            return None
        self.running, self.progress, self._watch = True, Progress(), watch
        self._show(True)
        self.say("Starting…")
        try:
            return await asyncio.to_thread(work, self.progress)
        except Stopped:
            self.say("Stopped.")
        except SoftnlpError as error:
            self.warn(plain_words(error))
        except Exception as error:  # the page stays alive whatever a study does, and says that it went wrong
            self.warn(f"This did not work: {type(error).__name__}: {' '.join(str(error).split())[:300]}")
        finally:
            self.running = False
            self._show(False)
        return None

    def stop(self) -> None:
        """Ask the run to end."""
        self.progress.stop()

    def say(self, words: str) -> None:
        """Say something about the run."""
        self._words.set_text(words)
        self._words.classes(remove="text-negative")

    def warn(self, words: str) -> None:
        """Say what went wrong."""
        self._words.set_text(words)
        self._words.classes(add="text-negative")

    def _show(self, running: bool) -> None:
        self._start.set_enabled(not running)
        self._end.set_visibility(running)
        self._bar.set_visibility(running)
        self._bar.set_value(0.0)
        self._timer.active = running

    def _look(self) -> None:
        if not self.running:  # a look that was due as the work ended: what was said of its end stays
            return
        begun = self.progress.fraction > 0
        self._bar.props(remove="indeterminate") if begun else self._bar.props("indeterminate")
        self._bar.set_value(self.progress.fraction)
        self.say("Stopping after this step…" if self.progress.stopping else self.progress.words() or "Working…")
        if self._watch is not None:
            self._watch()


def study_row(
    marker: str,
    label: str,
    asked: Callable[[], Callable[[Progress], T]],
    done: Callable[[T], Awaitable[None] | None],
    watch: Callable[[], None] | None = None,
) -> RunRow:
    """Show the row of a study: the button does the work that `asked` returns, `done` gets its result.

    What is not possible is said. done : may go on drawing (a coroutine). watch : as of `RunRow.do`.
    """

    async def begin() -> None:
        try:
            work = asked()
        except InputError as error:
            row.warn(plain_words(error))
            return
        found = await row.do(work, watch)
        if found is not None and (drawing := done(found)) is not None:
            await drawing

    row = RunRow(marker, label, begin)
    return row


def number_text(value: Any, digits: int = 5) -> str:
    """Return a number as a table on the page has it; other things as text, nothing for None and nan."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value + 0.0:.{digits}g}" if isfinite(value) else ""
    return "" if value is None else str(value)


def csv_text(header: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """Return rows as CSV, numbers in full, empty where there is none."""
    return document.csv_text(header, ([None if v != v else v for v in row] for row in rows))


class NumberTable:
    """Rows of numbers, with their CSV to copy and to download. A row that failed is marked."""

    def __init__(self, marker: str, on_row: Callable[[int], None] | None = None, height: str = "16rem") -> None:
        """Build the table, hidden until there is something to show; `on_row` is called with the row clicked."""
        self._csv, self._name = "", "table.csv"
        with ui.column().classes("w-full gap-1") as self._box:
            self._table = named(ui.table(columns=[], rows=[], row_key="row"), marker).style(f"max-height: {height}")
            self._table.props("dense flat bordered wrap-cells hide-bottom :rows-per-page-options=[0]")
            self._table.classes("w-full softnlp-numbers")
            self._table.add_slot(
                "body-cell",
                "<q-td :props=\"props\" :class=\"props.row.failed ? 'text-negative' : ''\">{{ props.value }}</q-td>",
            )
            if on_row is not None:
                self._table.classes("cursor-pointer")
                self._table.on("rowClick", lambda event: on_row(int(event.args[1]["row"])), args=[None, ["row"], None])
            with ui.row().classes("gap-1 items-center"):
                self._more = ui.label("").classes(HINT)
                button("Copy", "content_copy", f"{marker}.copy", self._copy)
                button("CSV", "download", f"{marker}.download", self._take)
        self._box.set_visibility(False)

    def show(
        self,
        header: Sequence[str],
        rows: Sequence[Sequence[Any]],
        name: str,
        *,
        csv: str | None = None,
        failed: Sequence[bool] = (),
    ) -> None:
        """Show rows under a header with units. csv : the whole text to take away, by default these rows."""
        self._csv, self._name = csv_text(header, rows) if csv is None else csv, name
        self._table.columns = [
            {"name": f"c{k}", "label": label, "field": f"c{k}", "align": "right" if _is_number(rows, k) else "left"}
            for k, label in enumerate(header)
        ]
        self._table.rows = [
            {"row": j, "failed": bool(failed[j]) if failed else False}
            | {f"c{k}": number_text(value) for k, value in enumerate(row)}
            for j, row in enumerate(rows[:MOST_ROWS])
        ]
        self._table.update()
        self._more.set_text(f"first {MOST_ROWS} of {len(rows)} rows" if len(rows) > MOST_ROWS else "")
        self._box.set_visibility(True)

    def show_steps(self, run: Run, columns: Mapping[str, Sequence[Any]], name: str, first: str = "step") -> None:
        """Show the steps of a run: number, pressures, some columns by their label, how each ended."""
        header = [first, *(f"p{k + 1} [bar]" for k in range(run.robot.chamber_sets)), *columns, "status"]
        header += ["message"] * bool(run.failed)
        failed = [not step.status.has_solution for step in run.steps]
        rows = []
        for k, step in enumerate(run.steps):
            words = [step.message if failed[k] else ""] * bool(run.failed)
            bars = [float(p) / BAR for p in step.pressure]
            rows.append([k + 1, *bars, *(values[k] for values in columns.values()), str(step.status), *words])
        self.show(header, rows, name, csv=table_text(run), failed=failed)

    def _copy(self) -> None:
        ui.clipboard.write(self._csv)
        ui.notify("Copied as CSV", position="bottom-right", timeout=1500)

    def _take(self) -> None:
        ui.download.content(self._csv, self._name, "text/csv")


def _is_number(rows: Sequence[Sequence[Any]], column: int) -> bool:
    return all(row[column] is None or isinstance(row[column], int | float) for row in rows)


class Chart:
    """A plotly chart with two labelled axes that follows the page from light to dark."""

    def __init__(self, marker: str, x_label: str, y_label: str, height: str = "15rem") -> None:
        """Build the chart, hidden until there is something to show."""
        self._labels = (x_label, y_label)
        self._traces: list[dict[str, Any]] = []
        self._marker = marker
        self._place = ui.element("div").classes("w-full").style(f"height: {height}")
        self._place.set_visibility(False)
        self._plot: ui.plotly | None = None
        self._dark = darkness()
        on_dark(self._draw)

    def show(
        self, traces: Sequence[Mapping[str, Any]], *, x_label: str | None = None, y_label: str | None = None
    ) -> None:
        """Show traces, as plotly has them; their names may be a person's."""
        self._traces = [dict(trace) for trace in traces]
        for trace in self._traces:
            trace["name"] = figure_text(trace.get("name", ""))
        self._labels = (x_label or self._labels[0], y_label or self._labels[1])
        self._place.set_visibility(bool(traces))
        if traces and self._plot is None:  # plotly cannot draw where nothing is shown
            with self._place:
                self._plot = named(ui.plotly({"data": [], "layout": {}}).classes("w-full h-full"), self._marker)
        self._draw()

    def _draw(self) -> None:
        if self._plot is None:
            return
        layout = figure_layout(self._dark())
        for axis, label in zip(("xaxis", "yaxis"), self._labels, strict=True):
            layout[axis]["title"] = {"text": label, "standoff": 6}
        layout["legend"] = {"orientation": "h", "yanchor": "bottom", "y": 1.02, "xanchor": "left", "x": 0.0}
        layout["showlegend"] = len([t for t in self._traces if t.get("name")]) > 1
        self._plot.update_figure({"data": self._traces, "layout": layout, "config": figure_config()})


def marks(x: Numbers, y: Numbers, colour: str, name: str = "", **more: Any) -> dict[str, Any]:
    """Return a trace of marks; one without a number is left out."""
    shown = {"x": list(map(_number, x)), "y": list(map(_number, y)), "marker": {"color": colour, **more}}
    return {"type": "scatter", "mode": "markers", "name": name, **shown}


def line(
    x: Numbers, y: Numbers, colour: str, name: str = "", spread: Numbers | None = None, **more: Any
) -> dict[str, Any]:
    """Return a trace of a line with marks; there is a gap where there is no number. A long one is thinned evenly.

    spread : one standard deviation of each number, drawn as a bar.
    """
    every = -(-len(x) // MOST_MARKS) or 1
    kept = sorted({*range(0, len(x), every), *range(len(x))[-1:]})
    trace = marks([x[k] for k in kept], [y[k] for k in kept], colour, name, size=6)
    if spread is not None:
        bars = {"type": "data", "array": [_number(spread[k]) for k in kept], "thickness": 1.5, "width": 0}
        trace["error_y"] = {**bars, "color": colour}
    return trace | {"mode": "lines+markers", "line": {"color": colour, "width": 2}} | more


def _number(value: float) -> float | None:
    return float(value) if isfinite(value) else None


def while_open(take: Callable[[T], Awaitable[None]]) -> Callable[[T], Awaitable[None]]:
    """Return a function that lets go of `take` when the page of the current slot is deleted.

    For what a library holds longer than the page: FastAPI keeps the last 4096 functions that took an upload.
    """
    held = [take]
    ui.context.client.on_delete(held.clear)
    return lambda event: held[0](event)


def csv_drop(marker: str, label: str, take: Callable[[str, bytes], None]) -> ui.upload:
    """Show where a CSV file is dropped; `take` gets its name and content, and what it raises is told."""

    @while_open
    async def arrived(event: events.UploadEventArguments) -> None:
        box.reset()
        if event.file.size() > LARGEST_FILE:
            ui.notify(_too_large(event.file.name), type="warning")
            return
        content = await event.file.read()
        try:
            take(event.file.name, content)
        except SoftnlpError as error:
            ui.notify(plain_words(error), type="warning", multi_line=True)

    ui.add_css(DROP)
    box = ui.upload(
        label=label,
        on_upload=arrived,
        on_rejected=lambda: ui.notify(_too_large("This file"), type="warning"),
        max_file_size=LARGEST_FILE,
        auto_upload=True,
    )
    box.props("accept=.csv,text/csv flat bordered color=transparent text-color=primary")
    return named(box.classes("w-full softnlp-drop"), marker)


def downloads(*files: tuple[str, str, str]) -> dict[str, Callable[[], str]]:
    """Show a button for each file to take away, and return where its text is put by name once there is one.

    files : name, that of the button, and kind (text/csv).
    """
    texts: dict[str, Callable[[], str]] = {}

    def offer(name: str, kind: str) -> None:
        if name in texts:
            ui.download.content(texts[name](), name, kind)

    for name, mark, kind in files:
        button(name, "download", mark, partial(offer, name, kind))
    return texts


# The list of files is empty at once: a dropped one is named by the tab.
DROP = """
.softnlp-drop .q-uploader__list, .softnlp-drop .q-uploader__subtitle { display: none }
.softnlp-drop .q-uploader__header { background: transparent !important; color: inherit !important }
.softnlp-drop .q-uploader__title { font-size: 0.85rem; font-weight: 400; line-height: 1.3 }
"""


def _too_large(name: str) -> str:
    return f"{name} is not taken: expected a CSV table of at most {LARGEST_FILE / 1e6:.0f} MB"
