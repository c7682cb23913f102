"""The workspace tab: a grid or samples of pressures, swept by worker processes, its tips as points in the 3-D view."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from nicegui import ui
from numpy.typing import NDArray

from softnlp.app.asking import Progress, Stopped, bars, few_enough, scenario_with
from softnlp.app.controls import button, heading, named, number, number_field, select, toggle
from softnlp.app.conventions import is_energy
from softnlp.app.examples import empty_state
from softnlp.app.parts import NumberTable, number_text, study_row
from softnlp.app.session import Session, Stage
from softnlp.base.columns import ONE, OUTPUTS
from softnlp.base.errors import InputError, reworded
from softnlp.base.processes import processors
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.figures.space import shown
from softnlp.model.contact_settings import NO_CLOSURE
from softnlp.scenario.read import Scenario
from softnlp.scenario.workspace import plan_of, run_sweep
from softnlp.sweep.read import Workspace, column_names, export_csv, load_workspace, read_column
from softnlp.sweep.run import WORKSPACE_FILE, SweepProgress, SweepSummary
from softnlp.sweep.summary import Summary, summarise
from softnlp.sweep.task import WorkspaceTask

Array = NDArray[np.float64]

MOST_POSES = 1_000_000
"""Of a sweep that is run from the page; `softnlp sweep` takes more."""
MANIPULABILITY = "manipulability"
QUANTITIES: Mapping[str, tuple[str, str]] = {
    **{
        output.key: (output.label.capitalize(), "-" if output.unit is ONE else output.unit.label)
        for output in map(OUTPUTS.__getitem__, ("bending_angle", "tilt", "stretch", "backbone_length", "blocked_force"))
    },
    MANIPULABILITY: ("Manipulability, by differences", "mm³/bar³"),
}
Point = tuple[float, float, float]
_ALIKE = 0.004  # angle between points that the eye cannot tell apart [rad]
_CHUNK_OF_FORCES = 32
_CUBIC_CENTIMETRE = 1e-6
_SQUARE_CENTIMETRE = 1e-4
STUDY = "workspace"
_FIRST = {"levels": 8, "samples": 1000}


def workspace_tab(stage: Stage) -> None:
    """Build the tab in the current slot."""
    with ui.column().classes("w-full gap-3 pt-2"):
        empty_state(stage.session, "workspace")
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
                ("levels", "Levels per set", 1),
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
            session.use()
            if wanted and not document.table("contact"):
                document.replace("contact", {"closure": NO_CLOSURE if is_energy(document) else "compliant"})
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
        self._swept: Swept | None = None
        self._drawn = False
        self._words = ""
        self._workers = number(
            "Worker processes", "workspace.workers", value=processors(), min=1, max=64, precision=0
        ).classes("w-full")
        self._row = study_row("workspace", "Run the sweep", self._asked, self._finish)
        with ui.column().classes("w-full gap-2") as self._found:
            self._what = select({}, "workspace.colour", "Colour of the points", on_change=self._draw)
            with ui.row().classes("w-full items-center gap-2 no-wrap text-xs"):
                self._low = ui.label("").mark("workspace.low")
                self._bar = ui.element("div").classes("grow h-3 rounded")
                self._high = ui.label("").mark("workspace.high")
            self._pick = named(ui.switch("A click on a point takes its pressures").props("dense"), "workspace.pick")
            self._picked = ui.label("").classes("text-sm").mark("workspace.picked")
            with ui.row().classes("gap-1"):
                button("workspace.nc", "download", "workspace.netcdf", self._take_netcdf)
                button("workspace.csv", "download", "workspace.csv", self._take_csv)
        self._found.set_visibility(False)
        self._table = NumberTable("workspace.numbers", height="24rem")
        stage.view.on_sight(self._clicked)
        stage.session.on_scenario(self._follow)

    def _asked(self) -> Callable[[Progress], Swept]:
        workers, session = self._workers.value, self._stage.session
        if workers is None or not 1 <= workers <= 64:
            raise InputError("Worker processes: expected a whole number from 1 to 64")
        asked = scenario_with(session, STUDY)
        return lambda progress: sweep(asked, session.folder / "sweeps", int(workers), progress)

    def _finish(self, swept: Swept) -> None:
        """Show a sweep, where it was not stopped."""
        news = swept.news
        if news.stopped:
            self._row.say(f"Stopped after {news.done} of {news.poses} poses, which are kept: run again to go on.")
            return
        self._swept = swept
        timed = f", {news.seconds:.2f} s, {news.rate:.0f} poses/s" if news.rate else ""
        self._words = f"{news.done} poses, {news.failed} failed{timed}."
        self._row.say(self._words)
        choices = quantities(swept)
        chosen = self._what.value if self._what.value in choices else next(iter(choices), None)
        self._what.set_options(choices, value=chosen)
        self._bar.style(f"background: {gradient()}")
        self._found.set_visibility(True)
        self._table.show(["number", "value", "unit"], lines(swept), "workspace_numbers.csv")
        self._draw()

    def _draw(self) -> None:
        """Put the points into the view, in the colours of the chosen quantity."""
        swept = self._swept
        if swept is None or swept.workspace is None or self._what.value is None:
            return
        key = str(self._what.value)
        values = values_of(swept, key)
        low, high = limits(values)
        unit = QUANTITIES[key][1]
        self._low.set_text(number_text(low, 4))
        self._high.set_text(f"{number_text(high, 4)} {unit}" if unit != "-" else number_text(high, 4))
        solved = swept.workspace.solved
        tips, colours = swept.workspace.tip_position[solved], colours_of(values)[solved]
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

    def _clicked(self, viewer: Point, along: Point) -> None:
        session, swept = self._stage.session, self._swept
        if session.document.study != STUDY or not self._pick.value or swept is None or swept.workspace is None:
            return
        pose = in_sight(swept.workspace, viewer, along)
        if pose is None or swept.workspace.pressure.shape[1] != len(session.pressure):
            return
        pressure = swept.workspace.pressure[pose]
        self._picked.set_text(f"Pose {pose + 1}: {bars(pressure)} bar")
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


@dataclass(frozen=True, eq=False)
class Swept:
    """A sweep of the page. workspace, summary : None where it was stopped before the end. task : what was asked."""

    asked: Scenario
    news: SweepSummary
    workspace: Workspace | None
    summary: Summary | None


def sweep(asked: Scenario, folder: Path, workers: int, progress: Progress) -> Swept:
    """Run a sweep in worker processes. Stopped, it keeps what is solved, and goes on from there when run again.

    folder : for the sweeps of a page; each has its own in it.

    Raises
    ------
    InputError
        For more poses than a page should wait for.
    SweepError
        As `run_sweep`.
    """
    few_enough(asked, MOST_POSES, "poses", "softnlp sweep", table="workspace")
    plan = plan_of(asked)
    if plan.contact is not None:  # a force takes a hundred times as long: pieces that a person can wait for
        plan = replace(plan, chunk=_CHUNK_OF_FORCES)
    place = folder / plan.fingerprint()[:16]

    def report(news: SweepProgress) -> None:
        rate = (news.done - news.already) / news.seconds if news.seconds > 0 else 0.0
        failed = f", {news.failed} failed" if news.failed else ""
        try:
            progress(news.done, news.poses, f"{news.done} of {news.poses} poses{failed}, {rate:.0f} poses/s")
        except Stopped:  # the sweep asks for itself whether to stop, and then keeps what its workers finish
            return

    about = {"title": asked.title, "scenario": asked.text, "warnings": json.dumps(asked.warnings)}
    with reworded({"resume=True goes on": "another run goes on"}):
        news = run_sweep(
            plan, place, workers=workers, resume=True, progress=report, stop=lambda: progress.stopping, about=about
        )
    if news.stopped:
        return Swept(asked, news, None, None)
    workspace = load_workspace(place / WORKSPACE_FILE)
    return Swept(asked, news, workspace, summarise(workspace))


def quantities(swept: Swept) -> dict[str, str]:
    """Return what the points may be coloured by: key and label."""
    if swept.workspace is None:
        return {}
    known = set(column_names(swept.workspace))
    if manipulability_of_grid(swept) is not None:
        known.add(MANIPULABILITY)
    return {key: label for key, (label, _) in QUANTITIES.items() if key in known}


def values_of(swept: Swept, quantity: str) -> Array:
    """Return a quantity of every pose (N,) in its unit, nan where there is none."""
    assert swept.workspace is not None
    if quantity == MANIPULABILITY:
        found = manipulability_of_grid(swept)
        assert found is not None
        return found
    return read_column(swept.workspace, quantity).values


def manipulability_of_grid(swept: Swept) -> Array | None:
    """Return sqrt(det J J^T) of the tip position by the pressures (N,) [mm^3/bar^3], by differences over the grid.

    nan at poses with an unsolved neighbour; None where the poses are no grid of at least 3 levels over 3 sets or more.
    """
    workspace, task = swept.workspace, swept.asked.task
    if workspace is None or not isinstance(task, WorkspaceTask) or task.vary or (task.levels or 0) < 3:
        return None
    sets, levels = len(task.sets), task.levels or 0
    if sets < 3 or levels**sets != workspace.poses or task.highest <= task.lowest:
        return None
    tips = (workspace.tip_position / MILLIMETRE).reshape(*[levels] * sets, 3)
    step = (task.highest - task.lowest) / BAR / (levels - 1)
    slopes: Any = np.gradient(tips, step, axis=tuple(range(sets)), edge_order=2)
    J = np.stack(slopes, axis=-1).reshape(-1, 3, sets)
    determinant = np.full(len(J), np.nan)
    known = np.isfinite(J).all(axis=(1, 2))
    determinant[known] = np.linalg.det(J[known] @ J[known].transpose(0, 2, 1))
    return np.asarray(np.sqrt(np.maximum(determinant, 0.0)))


def limits(values: Array) -> tuple[float, float]:
    """Return the smallest and the largest number, both 0 without any."""
    known = values[np.isfinite(values)]
    return (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)


def colours_of(values: Array) -> Array:
    """Return (N, 3) colours from 0 to 1, from dark for the smallest number to light; grey where there is none."""
    from matplotlib import colormaps

    low, high = limits(values)
    known = np.isfinite(values)
    part = np.where(known, (values - low) / (high - low) if high > low else 0.5, 0.0)
    return np.where(known[:, None], np.asarray(colormaps["viridis"](part))[:, :3], 0.5)


def gradient() -> str:
    """Return the colours of `colours_of` from smallest to largest, as CSS has a bar of them."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    return f"linear-gradient(to right, {', '.join(to_hex(c) for c in colormaps['viridis'](np.linspace(0, 1, 12)))})"


def in_sight(workspace: Workspace, viewer_mm: Point, along: Point) -> int | None:
    """Return the number (from 0) of the solved pose whose tip is nearest to a line of sight; None without any.

    Of those that the eye cannot tell apart it is the one in front. along : a unit vector.
    """
    offset = workspace.tip_position / MILLIMETRE - np.asarray(viewer_mm)
    depth = offset @ np.asarray(along)
    seen = np.flatnonzero(np.isfinite(depth) & (depth > 0))
    if not seen.size:
        return None
    aside = np.linalg.norm(offset[seen] - depth[seen, None] * np.asarray(along), axis=1) / depth[seen]
    near = seen[aside <= aside.min() + _ALIKE]
    return int(near[np.argmin(depth[near])])


def lines(swept: Swept) -> list[list[str]]:
    """Return a finished sweep in numbers: name, value and unit of each."""
    summary, news = swept.summary, swept.news
    if summary is None:
        return []
    found = [["Poses", str(summary.poses), ""], ["Solved", str(summary.solved), ""]]
    found += [[f"Ended {status.value.replace('_', ' ')}", str(n), ""] for status, n in summary.failed.items()]
    if news.done > news.already:
        found += [["Time", f"{news.seconds:.2f}", "s"], ["Rate", f"{news.rate:.0f}", "poses/s"]]
    if not summary.solved:
        return found
    reach, boundary, hull, dexterity = summary.reach, summary.boundary, summary.hull, summary.dexterity
    counts = {
        "Not stable": summary.unstable,
        "Stability undefined": summary.undefined,
        "Pass through themselves": summary.self_intersecting,
    }
    measures = (
        ("Volume", boundary.volume / _CUBIC_CENTIMETRE, "cm³"),
        ("Volume of the convex hull", hull.volume / _CUBIC_CENTIMETRE, "cm³"),
        ("Area", boundary.area / _SQUARE_CENTIMETRE, "cm²"),
    )
    return [
        *found,
        *([label, str(count), ""] for label, count in counts.items() if count),
        ["Distance from the axis", _range(reach.nearest_to_axis, reach.farthest_from_axis), "mm"],
        ["Distance from the base", _range(reach.nearest_to_base, reach.farthest_from_base), "mm"],
        ["Height", _range(reach.lowest, reach.highest), "mm"],
        ["Shape of the workspace", boundary.extent.meaning, ""],
        *([label, f"{size:.4g}", unit] for label, size, unit in measures if size),
        *([] if dexterity is None else [["Directions of the tip", f"{100 * dexterity.overall:.3g}", "% of all"]]),
        ["Largest residual", f"{summary.worst_residual:.1e}", ""],
    ]


def _range(low: float, high: float) -> str:
    return f"{low / MILLIMETRE:.4g} to {high / MILLIMETRE:.4g}"
