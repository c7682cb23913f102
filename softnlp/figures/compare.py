"""Figures of a comparison with measurements, as the paper draws them: a figure for each number, and one of tips."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.arrays import Array
from softnlp.base.columns import OUTPUTS
from softnlp.base.statistics import USED, groups
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.figures.compare_parts import (
    LEGEND_ROW,
    MEASURED,
    Look,
    bars,
    box_labels,
    boxes,
    draw_boxes,
    foot_legend,
    legend_rows,
    looks,
    robot_label,
    variant_marks,
)
from softnlp.figures.space import around, draw_lines, mark_size, space_axes
from softnlp.figures.style import GREY, INK, PALE, SMALL, TEXT, WRONG, in_own_style, mark, new_figure, plain
from softnlp.scenario.compare import CompareTask
from softnlp.studies.comparison import AXES, NUMBERS, OBSERVABLES, Comparison
from softnlp.sweep.boundary import thinned

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH, _LEFT = 11.0, 6.6  # of the figure, and of its panels of curves [inch]
_MOST_PANELS, _MOST_LANES = 12, 24
_FEWEST = 3  # pressures of a curve
_TIPS_HEIGHT = 6.8  # of the figure of tips, without its legend [inch]
_MOST_SHOWN = 4_000  # pairs of tips
_BINS = 24


@dataclass(frozen=True, eq=False)
class _Panel:
    """Rows of one robot that are drawn in one panel, by what they are drawn against. rows : numbers of the robot's."""

    robot: int
    title: str
    rows: NDArray[np.intp]
    x: Array
    label: str

    @property
    def is_curve(self) -> bool:
        """Whether there are enough of them for a line."""
        return len(np.unique(np.round(self.x, 3))) >= _FEWEST


def compare_figures(task: CompareTask, found: Comparison) -> dict[str, Figure]:
    """Return the figures of a comparison by name: one of each number measured, and "tips" of tip positions."""
    return {name: figure() for name, figure in figure_makers(task, found).items()}


def figure_makers(task: CompareTask, found: Comparison) -> dict[str, Callable[[], Figure]]:
    """Return what draws each of the `compare_figures`, by name."""
    title, times = task.scenario.title, _times(task)
    made: dict[str, Callable[[], Figure]] = {}
    for name in found.main_observables:
        if name == "tip_position":
            made["tips"] = partial(tips_figure, found, title)
        else:
            made[name] = partial(observable_figure, found, name, title, times)
    return made


def _times(task: CompareTask) -> list[Array]:
    """Return the time of each robot's rows [s], nan where there is none."""
    return [task.time[[place for _, place in rows.places]] for rows in task.rows]


@in_own_style
def observable_figure(found: Comparison, name: str, title: str, times: list[Array] | None = None) -> Figure:
    """Draw one number measured: its curves, the mean error by robot, the errors as boxes.

    Left, measured markers and a line for each variant against pressure, a panel for each robot and combination of sets;
    against time or row where the sets of a row have different pressures. Where there are too few pressures for curves,
    a lane for each measurement. Above right, bars of the mean error; below, boxes of the errors.
    """
    what = OBSERVABLES[name]
    every = [None] * len(found.observed) if times is None else times
    panels = [p for k, time in enumerate(every) for p in _panels(found, name, k, time)]
    curved = any(p.is_curve for p in panels)
    lanes = list({(p.robot, int(row)): (p, int(row)) for p in panels for row in p.rows}.values())
    count = len(panels) if curved else len(lanes)
    panels, lanes = panels[:_MOST_PANELS], lanes[:_MOST_LANES]
    columns = 1 if len(panels) == 1 else 2 if len(panels) <= 8 else 3
    rows = -(-len(panels) // columns)
    legend_columns, lines = legend_rows(found, _WIDTH)
    foot = 0.12 + LEGEND_ROW * lines
    left = 2.05 * rows if curved else 0.5 + 0.3 * len(lanes)
    height = 0.8 + foot + max(4.0, left, 2.6 + 0.26 * len(found.variants))
    robots = [robot_label(found, k) for k in range(len(found.observed)) if found.measured(name, k)]
    subtitle = [", ".join(robots), found.variants[0].material.name, f"{found.measured(name):,} measured"]
    best = found.best_of(name)
    if best is not None and len(found.variants) > 1:
        subtitle.append(f"least RMSE: {found.labels[best]}")
    figure = new_figure(_WIDTH, height, f"{title}: {what.label}", "  ·  ".join(subtitle))
    made = looks(found)
    top, bottom = 1 - 0.86 / height, (foot + 0.5) / height
    if curved:
        _curves(figure, found, name, panels, made, (columns, rows), (bottom, top))
    else:
        longest = max(len(robot_label(found, panel.robot)) for panel, _ in lanes)
        edge = 1.75 + 0.066 * max(0, longest - len("D25L60"))
        axes = figure.add_axes((edge / _WIDTH, bottom, (_LEFT - 0.2 - edge) / _WIDTH, top - bottom))
        _measurements(axes, found, name, lanes, made)
    drawn = len(panels) if curved else len(lanes)
    if drawn < count:
        note = f"the first {drawn} of {count} {'curves' if curved else 'measurements'}"
        figure.text(0.65 / _WIDTH, top + 0.2 / height, note, size=SMALL, color=GREY)
    right = _LEFT + 0.65
    half = (top - bottom) * min(max(0.12 + 0.04 * len(found.variants), 0.34), 0.52)
    over = bottom + half + 0.62 / height
    bars(figure.add_axes((right / _WIDTH, over, (_WIDTH - right - 0.15) / _WIDTH, top - over)), found, name, made)
    start = _LEFT + 0.25 + max(len(line) for label in box_labels(found) for line in label.split("\n")) * 0.066
    start = max(start, right)
    boxes(figure.add_axes((start / _WIDTH, bottom, (_WIDTH - start - 0.15) / _WIDTH, half)), found, name, made)
    lost = any(found.statistics(v, name).count < found.measured(name) for v in range(len(made)))
    shape: dict[str, Any] = {"marker": "o", "markersize": 5} if curved else {"marker": "|", "markersize": 11}
    handles = [mark(MEASURED, INK, markerfacecolor="white", markeredgewidth=1.2, **shape), *variant_marks(found, made)]
    foot_legend(figure, handles, legend_columns, "; crosses: no solution" if lost else "")
    return figure


# --- curves -----------------------------------------------------------------------------------------------------------


def _panels(found: Comparison, name: str, robot: int, time: Array | None) -> list[_Panel]:
    """Return the panels of a robot; rows at rest begin the curve of each combination of sets."""
    o, name_of_robot = found.observed[robot], robot_label(found, robot)
    kept = np.flatnonzero(np.isfinite(o.values[:, NUMBERS.index(name)]))
    P = o.pressure[kept]
    if not len(kept):
        return []
    used = np.where(P > USED, P, np.nan)
    rest = np.all(P <= USED, axis=1)
    some = used[~rest]
    if np.any(np.nanmax(some, axis=1, initial=0.0) - np.nanmin(some, axis=1, initial=np.inf) > USED):
        if time is not None and np.isfinite(time[kept]).all():
            return [_Panel(robot, name_of_robot, kept, time[kept], OUTPUTS["t"].axis)]
        return [_Panel(robot, name_of_robot, kept, np.arange(1.0, len(kept) + 1), "row")]
    combinations = [(words, mask) for words, mask in groups(P) if not rest[mask].all()] or [("no set", rest)]
    made = []
    for words, mask in combinations:
        own = mask | rest
        order = np.argsort(P[own].max(axis=1), kind="stable")
        title = name_of_robot if len(combinations) == 1 else f"{name_of_robot}, {words}"
        x = P[own].max(axis=1)[order] / BAR
        made.append(_Panel(robot, title, kept[own][order], x, f"pressure of {words} [bar]"))
    return made


def _curves(
    figure: Figure,
    found: Comparison,
    name: str,
    panels: list[_Panel],
    made: list[Look],
    grid: tuple[int, int],
    span: tuple[float, float],
) -> None:
    """Draw the panels."""
    columns, rows = grid
    bottom, top = span
    what = OBSERVABLES[name]
    gap = 0.42 / figure.get_figheight()
    height = (top - bottom - gap * (rows - 1)) / rows
    width = (_LEFT - 0.65 * columns) / columns / _WIDTH
    same = len({p.label for p in panels}) == 1
    for j, panel in enumerate(panels):
        row, column = divmod(j, columns)
        left = 0.65 * (column + 1) / _WIDTH + column * width
        axes = figure.add_axes((left, top - (row + 1) * height - row * gap, width, height))
        last = j + columns >= len(panels)
        pressures = all(p.label.startswith("pressure") for p in panels)
        label = panel.label if same or not pressures else "pressure [bar]"
        plain(axes, label if last else "", f"{what.axis}" if column == 0 else "")
        if len(panels) > 1:
            axes.set_title(panel.title, size=TEXT, color=INK, weight="bold", loc="left", pad=3)
        _curve_panel(axes, found, name, panel, made)


def _curve_panel(axes: Axes, found: Comparison, name: str, panel: _Panel, made: list[Look]) -> None:
    """Draw the curves of one panel; rows without a solution are crosses at its foot, in the variant's colour."""
    column, scale = NUMBERS.index(name), OBSERVABLES[name].scale
    measured = found.observed[panel.robot].values[panel.rows, column] / scale
    many = len(panel.rows) > 60
    for v, look in enumerate(made):
        simulated = found.simulated[v][panel.robot].values[panel.rows, column] / scale
        known = np.isfinite(simulated)
        style: dict[str, Any] = {"color": look.colour, "linestyle": look.line, "linewidth": 1.0 if many else 1.6}
        alone = "." if known.sum() < 2 else None
        axes.plot(panel.x, simulated, marker=alone, zorder=2, label=found.labels[v], **style)
        if not known.all():
            foot = axes.get_xaxis_transform()
            places = panel.x[~known]
            axes.plot(places, [0.03] * len(places), "x", color=look.colour, markersize=4, transform=foot, zorder=3)
    dot: dict[str, Any] = {"markerfacecolor": "white", "markersize": 2.5 if many else 4.6, "markeredgewidth": 0.9}
    axes.plot(panel.x, measured, "o", color=INK, zorder=3, label=MEASURED, **dot)
    axes.margins(x=0.04)
    if panel.label.startswith("pressure"):
        axes.set_xlim(left=-0.03 * float(panel.x.max()))
        if axes.dataLim.y0 >= 0:
            axes.set_ylim(bottom=-0.03 * axes.dataLim.y1)


# --- single measurements ----------------------------------------------------------------------------------------------


def _measurements(axes: Axes, found: Comparison, name: str, lanes: list[tuple[_Panel, int]], made: list[Look]) -> None:
    """Draw a lane a measurement: what was measured as a bar across it, each variant as a dot, a cross where lost."""
    what, column = OBSERVABLES[name], NUMBERS.index(name)
    plain(axes, f"{what.axis}", "")
    names: list[str] = []
    step = 0.62 / max(len(made), 2)
    for y, (panel, row) in enumerate(lanes):
        o = found.observed[panel.robot]
        names.append(f"{robot_label(found, panel.robot)}, {_pressed(o.pressure[row])}")
        measured = o.values[row, column] / what.scale
        axes.axhline(y, color=PALE, linewidth=0.8, zorder=0)
        for v, look in enumerate(made):
            value = found.simulated[v][panel.robot].values[row, column] / what.scale
            at = y + (v - (len(made) - 1) / 2) * step
            if np.isfinite(value):
                ends = [measured, value]
                axes.plot(ends, [at, at], color=look.colour, linestyle=look.line, linewidth=1.1, zorder=1)
                axes.plot(value, at, "o", color=look.colour, markersize=4.5, zorder=3, label=found.labels[v])
            else:
                foot = axes.get_yaxis_transform()
                axes.plot(0.015, at, "x", color=look.colour, markersize=4, transform=foot, zorder=3)
        axes.plot([measured] * 2, [y - 0.4, y + 0.4], color=INK, linewidth=1.6, zorder=2, label=MEASURED)
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.set_yticks(range(len(names)), names)
    axes.grid(False, axis="y")
    axes.tick_params(axis="y", length=0)


def _pressed(pressure: Array) -> str:
    """Return pressures in a few words: "sets 1+2 at 1.5 bar"."""
    (words, _), *_ = groups(pressure[None, :])
    used = pressure[pressure > USED]
    if not used.size:
        return "at rest"
    if np.ptp(used) > USED:
        return " / ".join(f"{P / BAR:.3g}" for P in pressure) + " bar"
    return f"{words} at {used[0] / BAR:.3g} bar"


# --- tips -------------------------------------------------------------------------------------------------------------


@in_own_style
def tips_figure(found: Comparison, title: str) -> Figure:
    """Draw measured and simulated tips, and how far they are apart.

    Left, the tips in 3-D: measured ones hollow, simulated ones of the best variant filled, each pair joined by a line.
    Right, the errors of every variant by axis and as a distance (boxes), and a histogram of the distances.
    """
    best = found.best_of("tip_position")
    parts = [", ".join(o.label for o in found.observed[:4]), found.variants[0].material.name]
    parts.append(f"{found.measured('tip_position'):,} tips")
    if best is not None:
        s = found.statistics(best, "tip_position")
        least = f"{found.labels[best]}: " if len(found.variants) > 1 else ""
        parts.append(f"{least}mean {s.mean / MILLIMETRE:.3g} mm, {s.mape:.3g} % of the length")
    columns, lines = legend_rows(found, _WIDTH)
    foot = 0.12 + LEGEND_ROW * lines
    height = _TIPS_HEIGHT + LEGEND_ROW * lines
    figure = new_figure(_WIDTH, height, f"{title}: tip position", "  ·  ".join(parts))
    if best is None:
        figure.text(0.5, 0.5, "No row has a solution", size=TEXT, color=WRONG, ha="center")
        return figure
    made = looks(found)
    bottom, top = (foot + 0.5) / height, 1 - 0.75 / height
    _clouds(figure, found, best, made[best], (-0.01, foot / height, 0.54, top - foot / height + 0.02))
    half = (top - bottom - 0.7 / height) / 2
    _axis_boxes(figure.add_axes((0.62, top - half, 0.37, half)), found, made)
    _histogram(figure.add_axes((0.62, bottom, 0.37, half)), found, made)
    handles = [mark(MEASURED, INK, "o", markerfacecolor="white", markersize=5), *variant_marks(found, made)]
    handles[1 + best].set(marker="o", markersize=4)
    foot_legend(figure, handles, columns, "; thin lines: mean distances")
    return figure


def _clouds(figure: Figure, found: Comparison, v: int, look: Look, place: tuple[float, float, float, float]) -> None:
    """Draw pairs of tips in 3-D."""
    measured = np.concatenate([o.values[:, :3] for o in found.observed]) / MILLIMETRE
    simulated = np.concatenate([s.values[:, :3] for s in found.simulated[v]]) / MILLIMETRE
    both = np.isfinite(measured).all(axis=1) & np.isfinite(simulated).all(axis=1)
    measured, simulated = measured[both], simulated[both]
    k = thinned(measured, _MOST_SHOWN)
    measured, simulated = measured[k], simulated[k]
    axes = space_axes(figure, place, around(np.vstack([measured, simulated])))
    draw_lines(axes, np.stack([measured, simulated], axis=1), 0.6, colors=GREY, zorder=1, label="pairs")
    size = max(mark_size(len(k), 9_000), 4.0)
    plot: dict[str, Any] = {"s": size, "depthshade": False, "rasterized": True}
    axes.scatter(*simulated.T, color=look.colour, linewidths=0, zorder=3, label=found.labels[v], **plot)
    axes.scatter(*measured.T, facecolors="none", edgecolors=INK, linewidths=0.8, zorder=3, label=MEASURED, **plot)


def _axis_boxes(axes: Axes, found: Comparison, made: list[Look]) -> None:
    """Draw the errors along each axis and the distance, a box a variant."""
    plain(axes, "", "simulated - measured [mm]")
    width = 0.8 / len(made)
    names = (*AXES, "tip_position")
    values, faces, hatches, places = [], [], [], []
    for g, name in enumerate(names):
        for v, look in enumerate(made):
            values.append(found.errors(v, name)[0] / MILLIMETRE)
            faces.append(look.colour)
            hatches.append(look.hatch)
            places.append(g + (v - (len(made) - 1) / 2) * width)
    axes.axhline(0, color=GREY, linewidth=0.8, zorder=1)
    draw_boxes(
        axes, values, faces, hatches=hatches, positions=places, width=0.85 * width, mean=len(made) <= 3, upright=True
    )
    axes.set_xticks(range(len(names)), ["x", "y", "z", "distance"])
    axes.tick_params(axis="x", length=0, labelsize=TEXT)
    axes.grid(False, axis="x")
    axes.set_xlim(-0.55, len(names) - 0.45)


def _histogram(axes: Axes, found: Comparison, made: list[Look]) -> None:
    """Draw how many tips are how far apart."""
    distances = [found.errors(v, "tip_position")[0] / MILLIMETRE for v in range(len(made))]
    highest = max((float(d.max()) for d in distances if d.size), default=0.0) or 1.0
    edges = np.linspace(0.0, highest, _BINS + 1)
    plain(axes, OBSERVABLES["tip_position"].axis, "tips")
    for d, look, label in zip(distances, made, found.labels, strict=True):
        counts, _ = np.histogram(d, edges)
        axes.stairs(counts, edges, color=look.colour, linestyle=look.line, linewidth=1.6, label=label)
        if len(made) == 1:
            axes.stairs(counts, edges, color=look.colour, alpha=0.25, fill=True)
        if d.size:
            axes.axvline(float(np.mean(d)), color=look.colour, linestyle=look.line, linewidth=0.9, alpha=0.8)
    axes.set_xlim(0.0, highest)
    axes.set_ylim(bottom=0)
    axes.tick_params(labelsize=SMALL)
