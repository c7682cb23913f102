"""Figures of a comparison with measurements, as the paper draws them: a figure for each thing measured."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softnlp.evaluation.comparison import Comparison
from softnlp.evaluation.observed import NUMBERS, OBSERVABLES, Observed
from softnlp.evaluation.statistics import USED, groups
from softnlp.plots.compare_parts import LEGEND_ROW, MEASURED, Look, bars, boxes, legend, legend_rows, looks
from softnlp.plots.compare_tips import tips_figure
from softnlp.plots.style import GREY, INK, PALE, SMALL, TEXT, new_figure, plain
from softnlp.runner_compare import CompareTask
from softnlp.units import BAR

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_WIDTH, _LEFT = 11.0, 6.6  # of the figure, and of its panels of curves [inch]
_MARKERS = ("o", "s", "^", "D", "v", "P", "X", "*")
_MOST_ROBOTS = 8
_FEWEST = 3  # pressures of a curve


def compare_figures(task: CompareTask, found: Comparison) -> dict[str, Figure]:
    """Return the figures of a comparison by name: one of each number measured, and "tips" of tip positions."""
    made: dict[str, Figure] = {}
    if "tip_position" in found.observables:
        made["tips"] = tips_figure(found, task.scenario.title)
    for name in found.main_observables:
        if name != "tip_position":
            made[name] = observable_figure(found, name, task.scenario.title, _times(task))
    return made


def _times(task: CompareTask) -> list[Array]:
    """Return the time of each robot's rows [s], nan where there is none."""
    return [task.time[[place for _, place in rows.places]] for rows in task.rows]


def observable_figure(found: Comparison, name: str, title: str, times: list[Array] | None = None) -> Figure:
    """Draw one number measured: its curves, the mean error by robot, the errors as boxes.

    Left, measured markers and a line for each variant against pressure, a panel a robot; a marker shape for each
    combination of sets. Where the sets of a row have different pressures, against time or row. Where there are too few
    pressures for curves, a line a measurement. Above right, bars of the mean error; below, boxes of the errors.
    """
    what = OBSERVABLES[name]
    robots = [k for k in range(len(found.observed)) if found.measured(name, k)]
    shown = robots[:_MOST_ROBOTS]
    curved = any(_is_curve(_rows_of(found, name, k)) for k in shown)
    panels = len(shown) if curved else 1
    columns, rows = (1, 1) if panels == 1 else (2, -(-panels // 2))
    legend_columns, lines = legend_rows(found, _WIDTH)
    foot = 0.12 + LEGEND_ROW * lines
    lanes = 0 if curved else sum(len(_rows_of(found, name, k).values) for k in shown)
    height = 0.75 + foot + max(4.0, 2.05 * rows if curved else 0.0, 0.6 + 0.3 * lanes, 2.6 + 0.26 * len(found.variants))
    count = sum(found.measured(name, k) for k in robots)
    subtitle = [", ".join(found.observed[k].label for k in shown), found.variants[0].material.name, f"{count} measured"]
    if found.best_of(name) is not None and len(found.variants) > 1:
        subtitle.append(f"least RMSE: {found.labels[found.best_of(name) or 0]}")
    figure = new_figure(_WIDTH, height, f"{title}: {what.words}", "  ·  ".join(subtitle))
    made = looks(found)
    top, bottom = 1 - 0.72 / height, (foot + 0.5) / height
    if curved:
        _curves(figure, found, name, shown, made, (columns, rows), (bottom, top), times)
    else:
        _measurements(
            figure.add_axes((1.75 / _WIDTH, bottom, (_LEFT - 1.95) / _WIDTH, top - bottom)), found, name, shown, made
        )
    widest = max(len(label) for label in found.labels) * 0.066 + 0.15
    right = _LEFT + 0.65
    half = (top - bottom - 0.75 / height) * len(found.variants) / (len(found.variants) + 4)
    half = min(max(half, 0.3 * (top - bottom)), 0.52 * (top - bottom))
    over = bottom + half + 0.62 / height
    bars(figure.add_axes((right / _WIDTH, over, (_WIDTH - right - 0.15) / _WIDTH, top - over)), found, name, made)
    left = _LEFT + 0.1 + widest
    boxes(figure.add_axes((left / _WIDTH, bottom, (_WIDTH - left - 0.15) / _WIDTH, half)), found, name, made)
    legend(figure, _handles(found, made), legend_columns)
    return figure


def _handles(found: Comparison, made: list[Look]) -> list[Any]:
    from matplotlib.lines import Line2D

    measured = Line2D([], [], color=INK, marker="o", markerfacecolor="white", linestyle="none", markersize=5)
    measured.set_label(MEASURED)
    lines = [
        Line2D([], [], color=look.colour, linestyle=look.line, linewidth=1.8, label=label)
        for look, label in zip(made, found.labels, strict=True)
    ]
    return [measured, *lines]


def _rows_of(found: Comparison, name: str, robot: int) -> Observed:
    """Return the rows of a robot in which something was measured of an observable."""
    o = found.observed[robot]
    kept = np.isfinite(o.values[:, NUMBERS.index(name)])
    return Observed(o.robot, o.label, o.pressure[kept], o.values[kept])


def _shared(pressure: Array) -> bool:
    """Whether in every row the sets that have pressure have the same, so that one number tells it."""
    used = np.where(pressure > USED, pressure, np.nan)
    some = used[np.isfinite(used).any(axis=1)]
    return not len(some) or bool(np.all(np.nanmax(some, axis=1) - np.nanmin(some, axis=1) <= USED))


def _is_curve(o: Observed) -> bool:
    """Whether a robot was measured at enough pressures of one combination of sets, or at pressures that vary apart."""
    if not _shared(o.pressure):
        return True
    kinds = [o.pressure[mask].max(axis=1) for _, mask in groups(o.pressure)]
    return any(len(np.unique(np.round(P / USED))) >= _FEWEST for P in kinds)


# --- curves -----------------------------------------------------------------------------------------------------------


def _curves(
    figure: Figure,
    found: Comparison,
    name: str,
    shown: list[int],
    made: list[Look],
    grid: tuple[int, int],
    span: tuple[float, float],
    times: list[Array] | None,
) -> None:
    """Draw a panel for each robot."""
    columns, rows = grid
    bottom, top = span
    what = OBSERVABLES[name]
    gap = 0.42 / figure.get_figheight()
    height = (top - bottom - gap * (rows - 1)) / rows
    width = (_LEFT - 0.65 * columns) / columns / _WIDTH
    for j, k in enumerate(shown):
        row, column = divmod(j, columns)
        place = (0.65 * (column + 1) / _WIDTH + column * width, top - (row + 1) * height - row * gap, width, height)
        axes = figure.add_axes(place)
        label = _curve_panel(axes, found, name, k, made, None if times is None else times[k])
        last = j + columns >= len(shown)
        plain(axes, label if last else "", f"{what.words} [{what.unit}]" if column == 0 else "")
        if len(found.observed) > 1:
            axes.set_title(found.observed[k].label, size=TEXT, color=INK, weight="bold", loc="left", pad=3)
        axes.margins(x=0.03)


def _curve_panel(axes: Axes, found: Comparison, name: str, k: int, made: list[Look], time: Array | None) -> str:
    """Draw the curves of a robot; return what they are drawn against."""
    o = found.observed[k]
    column, scale = NUMBERS.index(name), OBSERVABLES[name].scale
    measured = o.values[:, column] / scale
    kept = np.isfinite(measured)
    x, label, named = _abscissa(o.pressure, time, kept)
    for g, (words, mask) in enumerate(named):
        rows = np.flatnonzero(mask & kept)
        rows = rows[np.argsort(x[rows], kind="stable")]
        for v, look in enumerate(made):
            simulated = found.simulated[v][k].values[rows, column] / scale
            alone = int(np.isfinite(simulated).sum()) < 2
            axes.plot(
                x[rows],
                simulated,
                color=look.colour,
                linestyle=look.line,
                linewidth=1.6,
                marker="." if alone else None,
                zorder=2,
                label=found.labels[v],
            )
        axes.plot(
            x[rows],
            measured[rows],
            linestyle="none",
            marker=_MARKERS[g % len(_MARKERS)],
            color=INK,
            markerfacecolor="white",
            markersize=4.6 if len(rows) < 60 else 2.5,
            markeredgewidth=0.9,
            zorder=3,
            label=f"{MEASURED}, {words}",
        )
        if len(named) > 1 and len(rows):
            beside = (x[rows[-1]], measured[rows[-1]])
            axes.annotate(
                words, beside, (-5, 5), textcoords="offset points", size=SMALL - 1, color=GREY, ha="right", va="bottom"
            )
    return label


def _abscissa(pressure: Array, time: Array | None, kept: Mask) -> tuple[Array, str, list[tuple[str, Mask]]]:
    """Return what rows are drawn against, its label, and the rows of each curve; those at rest begin each curve."""
    if _shared(pressure[kept]):
        rest = np.all(pressure <= USED, axis=1)
        named = [(words, mask | rest) for words, mask in groups(pressure) if not rest[mask].all() and kept[mask].any()]
        if not named:
            named = [("none", rest)]
        label = "pressure of set 1 [bar]" if [w for w, _ in named] == ["set 1"] else "pressure [bar]"
        return pressure.max(axis=1) / BAR, label, named
    every = [("all", np.ones(len(pressure), bool))]
    if time is not None and np.isfinite(time[kept]).all():
        return time, "time [s]", every
    return np.arange(1, len(pressure) + 1, dtype=float), "row", every


# --- single measurements ----------------------------------------------------------------------------------------------


def _measurements(axes: Axes, found: Comparison, name: str, shown: list[int], made: list[Look]) -> None:
    """Draw a lane for each measurement: measured as a bar across it, each variant as a dot."""
    what, column = OBSERVABLES[name], NUMBERS.index(name)
    plain(axes, f"{what.words} [{what.unit}]", "")
    names: list[str] = []
    for k in shown:
        o = found.observed[k]
        for row in np.flatnonzero(np.isfinite(o.values[:, column])):
            y = len(names)
            names.append(f"{o.label}, {_pressed(o.pressure[row])}")
            measured = o.values[row, column] / what.scale
            values = np.array([s[k].values[row, column] for s in found.simulated]) / what.scale
            axes.axhline(y, color=PALE, linewidth=0.8, zorder=0)
            step = 0.62 / max(len(made), 2)
            for v, look in enumerate(made):
                at = y + (v - (len(made) - 1) / 2) * step
                axes.plot(
                    [measured, values[v]], [at, at], color=look.colour, linestyle=look.line, linewidth=1.1, zorder=1
                )
                axes.plot(values[v], at, "o", color=look.colour, markersize=4.5, zorder=3, label=found.labels[v])
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
