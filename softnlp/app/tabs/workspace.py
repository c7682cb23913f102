"""The workspace tab: a grid or samples of pressures, swept by worker processes, its tips as points in the 3-D view."""

from __future__ import annotations

from collections.abc import Callable

from nicegui import ui

from softnlp.app.asking import Progress, bars, scenario_with
from softnlp.app.fields import heading, named, number_box, number_field, select_box, toggle
from softnlp.app.parts import NumberTable, RunRow, downloads, number_text
from softnlp.app.session import Session, Stage
from softnlp.app.tabs import cloud
from softnlp.base.errors import InputError
from softnlp.base.processes import processors
from softnlp.base.units import MILLIMETRE
from softnlp.figures.cloud import shown
from softnlp.sweep.export import export_csv

STUDY = "workspace"
_FIRST = {"levels": 8, "samples": 1000}


def workspace_tab(stage: Stage) -> None:
    """Build the tab in the current slot."""
    with ui.column().classes("w-full gap-3 pt-2"):
        _source(stage.session)
        _Sweep(stage)


def _source(session: Session) -> None:
    """Show the keys of [workspace]."""

    def kind() -> str:
        return "samples" if "samples" in session.table("workspace") else "levels"

    heading("Pressures")
    kinds = toggle({"levels": "Grid", "samples": "Samples"}, "workspace.kind", kind())
    with ui.row().classes("w-full gap-2 no-wrap"):
        levels, samples, *_ = (
            number_field(session, "workspace", key, label, step=step)
            for key, label, step in (
                ("levels", "Levels a set", 1),
                ("samples", "Samples", 100),
                ("from_bar", "From", 0.1),
                ("to_bar", "To", 0.1),
            )
        )
    count = ui.label("").classes("text-sm opacity-70").mark("workspace.count")
    wall = named(ui.switch("Push against the wall of the blocked force").props("dense"), "workspace.wall")

    def choose(chosen: str | None) -> None:
        if chosen is None or chosen == kind():
            return
        kept = {
            key: value for key, value in session.table("workspace").items() if key not in ("levels", "samples", "seed")
        }
        session.change_all("workspace", {chosen: _FIRST[chosen], **kept})

    def push(wanted: bool) -> None:
        document = session.document
        if wanted != document.sweeps_wall:
            document.sweeps_wall = wanted
            if wanted and not document.table("contact"):
                document.replace("contact", {"closure": "compliant"})
            session.reread()

    def refresh() -> None:
        kinds.set_value(kind())
        levels.set_visibility(kind() == "levels")
        samples.set_visibility(kind() == "samples")
        wall.set_value(session.document.sweeps_wall)
        scenario = session.scenario
        poses = scenario.step_count if scenario is not None and scenario.study == STUDY else None
        count.set_text("" if poses is None or session.problem is not None else f"{poses} poses")

    session.follow(refresh)
    kinds.on_value_change(lambda event: choose(event.value))
    wall.on_value_change(lambda event: push(bool(event.value)))


class _Sweep:
    """Run, show, measure and take away a sweep."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._swept: cloud.Swept | None = None
        self._drawn = False
        self._words = ""
        self._workers = number_box(
            "Worker processes", "workspace.workers", value=processors(), min=1, max=64, precision=0
        ).classes("w-full")
        self._row = RunRow("workspace", "Run the sweep", self._begin)
        with ui.column().classes("w-full gap-2") as self._found:
            self._what = select_box({}, "workspace.colour", "Colour of the points", on_change=self._draw)
            with ui.row().classes("w-full items-center gap-2 no-wrap text-xs"):
                self._low = ui.label("").mark("workspace.low")
                self._bar = ui.element("div").classes("grow h-3 rounded")
                self._high = ui.label("").mark("workspace.high")
            self._pick = named(ui.switch("A click on a point takes its pressures").props("dense"), "workspace.pick")
            self._picked = ui.label("").classes("text-sm").mark("workspace.picked")
            with ui.row().classes("gap-1"):
                downloads(
                    ("workspace.nc", "workspace.netcdf", self._take_netcdf),
                    ("workspace.csv", "workspace.csv", self._take_csv),
                )
        self._found.set_visibility(False)
        self._table = NumberTable("workspace.numbers", height="24rem")
        stage.view.on_sight(self._clicked)
        stage.session.on_scenario(self._follow)

    def _asked(self) -> Callable[[Progress], cloud.Swept]:
        workers, session = self._workers.value, self._stage.session
        if workers is None or not 1 <= workers <= 64:
            raise InputError("Worker processes: expected a whole number from 1 to 64")
        asked = scenario_with(session, STUDY)
        return lambda progress: cloud.sweep(asked, session.folder / "sweeps", int(workers), progress)

    async def _begin(self) -> None:
        swept = await self._row.ask(self._asked)
        if swept is None:
            return
        news = swept.news
        if news.stopped:
            self._row.say(f"Stopped after {news.done} of {news.poses} poses, which are kept: run again to go on.")
            return
        self._swept = swept
        timed = f", {news.seconds:.2f} s, {news.rate:.0f} poses/s" if news.rate else ""
        self._words = f"{news.done} poses, {news.failed} failed{timed}."
        self._row.say(self._words)
        self._show(swept)

    def _show(self, swept: cloud.Swept) -> None:
        """Show the finished sweep."""
        choices = cloud.quantities(swept)
        chosen = self._what.value if self._what.value in choices else next(iter(choices), None)
        self._what.set_options(choices, value=chosen)
        self._bar.style(f"background: {cloud.gradient()}")
        self._found.set_visibility(True)
        rows = [list(line) for line in cloud.lines(swept)]
        self._table.show(["number", "value", "unit"], rows, "workspace_numbers.csv")
        self._draw()

    def _draw(self) -> None:
        """Put the points into the view, in the colours of the chosen quantity."""
        swept = self._swept
        if swept is None or swept.workspace is None or self._what.value is None:
            return
        key = str(self._what.value)
        values = cloud.values_of(swept, key)
        low, high = cloud.limits(values)
        unit = cloud.QUANTITIES[key][1]
        self._low.set_text(number_text(low, 4))
        self._high.set_text(f"{number_text(high, 4)} {unit}" if unit != "-" else number_text(high, 4))
        solved = swept.workspace.solved
        tips, colours = swept.workspace.tip_position[solved], cloud.colours_of(values)[solved]
        kept = shown(tips) if len(tips) else slice(None)
        self._stage.view.points(tips[kept] / MILLIMETRE, colours[kept])
        self._drawn = True

    def _follow(self) -> None:
        """Take the points away where another study is on the screen, and show them again."""
        here = self._stage.session.document.study == STUDY
        if self._drawn and not here:
            self._stage.view.points(None, None)
            self._drawn = False
        elif here and not self._drawn and self._swept is not None:
            self._draw()

    def _clicked(self, viewer: cloud.Point, along: cloud.Point) -> None:
        session, swept = self._stage.session, self._swept
        if session.document.study != STUDY or not self._pick.value or swept is None or swept.workspace is None:
            return
        number = cloud.in_sight(swept.workspace, viewer, along)
        if number is None or swept.workspace.pressure.shape[1] != len(session.pressure):
            return
        pressure = swept.workspace.pressure[number]
        self._picked.set_text(f"Pose {number + 1}: {bars(pressure)} bar")
        session.set_pressure(pressure)

    def _take_netcdf(self) -> None:
        if self._swept is not None and self._swept.workspace is not None:
            ui.download.file(self._swept.workspace.file, "workspace.nc")

    async def _take_csv(self) -> None:
        workspace = None if self._swept is None else self._swept.workspace
        if workspace is None:
            return
        target = workspace.file.with_suffix(".csv")
        if await self._row.do(lambda progress: export_csv(workspace, target)) is not None:
            ui.download.file(target, "workspace.csv")
            self._row.say(self._words)
