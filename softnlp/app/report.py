"""The report of what is on the screen: one HTML page that needs no other file, of the writer of the commands."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING

from nicegui import ui

from softnlp.app.controls import plain_words, refuse
from softnlp.app.panels.results import Line, certificate_words, step_lines
from softnlp.app.pictures import png_of
from softnlp.app.pins import Pin, rows
from softnlp.app.session import Stage
from softnlp.base.errors import InputError, SoftnlpError
from softnlp.figures.section import section_figure
from softnlp.model.inputs import versions
from softnlp.model.segments import segments_of
from softnlp.results import to_json
from softnlp.results.report_page import Section, report_page
from softnlp.statics.step import Run

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NAME = "softnlp_report.html"


async def report_text(stage: Stage, run: Run, pins: Sequence[Pin]) -> str:
    """Return the page of a run of one step, with its picture, its section, what the tabs have drawn, and the pins.

    Raises
    ------
    InputError
        Where what is on the screen makes no sense.
    """
    asked = stage.session.asked()
    if stage.session.is_stale:
        raise stage.session.problem or InputError("expected a robot that can be made")
    figures: dict[str, bytes] = {}
    with suppress(TimeoutError, RuntimeError):  # a page without a browser has no picture
        figures["The robot"] = await stage.view.picture()
    parts = segments_of(run.robot)
    makers: dict[str, Callable[[], Figure]] = {
        f"Section of segment {k + 1}" if len(parts) > 1 else "Section": partial(section_figure, own)
        for k, (own, _) in enumerate(parts)
    }
    for title, drawn in stage.figures.items():
        makers |= {f"{title}: {name.replace('_', ' ')}" if name else title: make for name, make in drawn.items()}
    for caption, make in makers.items():
        figures[caption] = await asyncio.to_thread(png_of, make)
    lines = step_lines(run)
    numbers = [[line.label, line.text, line.unit] for line in (*lines.numbers, *lines.chambers)]
    sections = [Section("On the screen", ("number", "value", "unit"), numbers, certificate_words(run))]
    if pins:
        sections.append(_pinned(lines.numbers, pins, stage))
    texts = {"Scenario": asked.text, "Versions": json.dumps(versions(), indent=2)}
    return report_page(asked.title, to_json(run), figures, texts, sections)


def _pinned(now: Sequence[Line], pins: Sequence[Pin], stage: Stage) -> Section:
    """Return the pinned states beside the present one, with what is different now."""
    header = ("number", "unit", "now", *(pin.name for pin in pins), *(f"now less {pin.name}" for pin in pins))
    table = []
    for line, pinned, less in rows(now, pins):
        numbers = ["" if value is None else f"{value:.6g}" for value in (line.value, *pinned, *less)]
        table.append([line.label, line.unit, *numbers])
    state = stage.session.state()
    note = ". ".join(f"{pin.name}, and now: {pin.differs(state)}" for pin in pins)
    return Section("Pinned states", header, table, note)


def report_menu(stage: Stage, run: Callable[[], Run | None], pins: Callable[[], Sequence[Pin]]) -> None:
    """Build menu entries that offer the report. run, pins : functions that give what is shown."""

    async def made() -> str | None:
        shown = run()
        if shown is None:
            return None
        try:
            return await report_text(stage, shown, pins())
        except SoftnlpError as error:
            refuse(f"no report: {plain_words(error)}")
        return None

    async def save() -> None:
        text = await made()
        if text is not None:
            ui.download.content(text, NAME, "text/html")

    async def show() -> None:
        text = await made()
        if text is not None:
            ui.run_javascript(
                f"const page = open(URL.createObjectURL(new Blob([{json.dumps(text)}], {{type: 'text/html'}})));"
                "page?.addEventListener('load', () => page.print());"
            )

    ui.menu_item("Report, HTML", on_click=save).props("data-testid=report")
    ui.menu_item("Report, to print or as PDF", on_click=show).props("data-testid=report-print")
    ui.separator()
