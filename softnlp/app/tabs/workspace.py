"""The workspace tab: a grid or samples of pressures, swept by worker processes, its tips as points in the 3-D view."""

from __future__ import annotations

from nicegui import ui

from softnlp.app.asking import scenario_with
from softnlp.app.fields import number_field
from softnlp.app.parts import NumberTable, RunRow, number_text, plain_words
from softnlp.app.session import Session
from softnlp.app.stage import Stage
from softnlp.app.tabs import cloud
from softnlp.base.errors import InputError
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.figures.space import shown
from softnlp.sweep.read import export_csv

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
        return "samples" if "samples" in session.document.table("workspace") else "levels"

    ui.label("Pressures").classes("text-base font-medium")
    toggle = ui.toggle({"levels": "Grid", "samples": "Samples"}, value=kind()).mark("workspace.kind")
    toggle.props("dense no-caps unelevated spread data-testid=workspace.kind").classes("w-full")
    with ui.row().classes("w-full gap-2 no-wrap"):
        levels = number_field(session, "workspace", "levels", "Levels a set", step=1, whole=True)
        samples = number_field(session, "workspace", "samples", "Samples", step=100, whole=True)
        number_field(session, "workspace", "from_bar", "From", "bar", default=lambda: 0.0, step=0.1)
        number_field(session, "workspace", "to_bar", "To", "bar", step=0.1)
    count = ui.label("").classes("text-sm opacity-70").mark("workspace.count")
    wall = ui.switch("Push against the wall of the blocked force").props("dense data-testid=workspace.wall")
    wall.mark("workspace.wall")

    def choose(chosen: str | None) -> None:
        if chosen is None or chosen == kind():
            return
        table = session.document.table("workspace")
        kept = {key: value for key, value in table.items() if key not in ("levels", "samples", "seed")}
        session.change_all("workspace", {chosen: _FIRST[chosen], **kept})

    def push(wanted: bool) -> None:
        document = session.document
        if wanted != document.sweeps_wall:
            document.sweeps_wall = wanted
            if wanted and not document.table("contact"):
                document.replace("contact", {"closure": "compliant"})
            session.reread()

    def refresh() -> None:
        toggle.set_value(kind())
        levels.set_visibility(kind() == "levels")
        samples.set_visibility(kind() == "samples")
        wall.set_value(session.document.sweeps_wall)
        scenario = session.scenario
        poses = scenario.step_count if scenario is not None and scenario.study == STUDY else None
        count.set_text("" if poses is None or session.problem is not None else f"{poses} poses")

    refresh()
    toggle.on_value_change(lambda event: choose(event.value))
    wall.on_value_change(lambda event: push(bool(event.value)))
    session.on_scenario(refresh)


class _Sweep:
    """Run, show, measure and take away a sweep."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._swept: cloud.Swept | None = None
        self._drawn = False
        self._words = ""
        self._workers = ui.number("Worker processes", value=cloud.processors(), min=1, max=64, precision=0)
        self._workers.props("dense outlined hide-bottom-space data-testid=workspace.workers").classes("w-full")
        self._workers.mark("workspace.workers")
        self._row = RunRow("workspace", "Run the sweep", self._begin)
        with ui.column().classes("w-full gap-2") as self._found:
            self._what = ui.select({}, label="Colour of the points", on_change=self._draw).classes("w-full")
            self._what.props("dense outlined options-dense data-testid=workspace.colour").mark("workspace.colour")
            with ui.row().classes("w-full items-center gap-2 no-wrap text-xs"):
                self._low = ui.label("").mark("workspace.low")
                self._bar = ui.element("div").classes("grow h-3 rounded")
                self._high = ui.label("").mark("workspace.high")
            self._pick = ui.switch("A click on a point takes its pressures").props("dense")
            self._pick.props("data-testid=workspace.pick").mark("workspace.pick")
            self._picked = ui.label("").classes("text-sm").mark("workspace.picked")
            with ui.row().classes("gap-1"):
                for label, name, act in (
                    ("workspace.nc", "netcdf", self._take_netcdf),
                    ("workspace.csv", "csv", self._take_csv),
                ):
                    button = ui.button(label, icon="download", on_click=act).mark(f"workspace.{name}")
                    button.props(f"dense flat no-caps size=sm data-testid=workspace.{name}")
        self._found.set_visibility(False)
        self._table = NumberTable("workspace.numbers", height="24rem")
        stage.view.on_sight(self._clicked)
        stage.session.on_scenario(self._follow)

    async def _begin(self) -> None:
        workers = self._workers.value
        try:
            if workers is None or not 1 <= workers <= 64:
                raise InputError("Worker processes: expected a whole number from 1 to 64")
            asked = scenario_with(self._stage.session, STUDY)
        except InputError as error:
            self._row.warn(plain_words(error))
            return
        folder = self._stage.session.folder / "sweeps"
        swept = await self._row.do(lambda progress: cloud.sweep(asked, folder, int(workers), progress))
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
        self._show()

    def _show(self) -> None:
        """Show the finished sweep."""
        assert self._swept is not None
        choices = cloud.quantities(self._swept)
        chosen = self._what.value if self._what.value in choices else next(iter(choices), None)
        self._what.set_options(choices, value=chosen)
        self._bar.style(f"background: {cloud.gradient()}")
        self._found.set_visibility(True)
        rows = [list(line) for line in cloud.lines(self._swept)]
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
        self._picked.set_text(f"Pose {number + 1}: {', '.join(f'{p / BAR:.4g}' for p in pressure)} bar")
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
