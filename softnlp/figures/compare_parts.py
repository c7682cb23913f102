"""What the figures of a comparison share: how a variant looks, its legend, bars and boxes of errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from softnlp.base.arrays import Array
from softnlp.figures.style import COLOURS, GREY, INK, SMALL, WRONG, colour, legend, mark, plain, user_text
from softnlp.studies.comparison import OBSERVABLES, Comparison

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_LINES: tuple[Any, ...] = ("-", "--", ":", (0, (6, 1, 1, 1)), (0, (1, 1)), (0, (8, 2, 2, 2)))
_HATCHES = ("", "////", "....", "xxxx", "----", "\\\\\\\\")
MEASURED = "measured"
LEGEND_ROW = 0.2  # [inch]
_LABEL_WIDTH, _MOST_WRAPPED = 24, 8
_LONGEST_LABEL, _LONGEST_ROBOT = 72, 24  # characters of a variant's label and of a robot's
_NOTE_WIDTH = 4.4  # [inch]
_WIDEST_BAR = 0.3
_NOTE = "boxes: quartiles and median, diamonds: mean"


@dataclass(frozen=True)
class Look:
    """How a variant is drawn."""

    colour: str
    line: Any
    hatch: str


def looks(found: Comparison) -> list[Look]:
    """Return the look of each variant: a colour for each law, a line for each set of the rest; one law has colours."""
    laws = list(dict.fromkeys(v.law for v in found.variants))
    rest = list(dict.fromkeys((v.named, v.conventions.name, v.closure) for v in found.variants))
    made = []
    for v in found.variants:
        law, other = laws.index(v.law), rest.index((v.named, v.conventions.name, v.closure))
        if len(laws) == 1:
            law, other = other, other // len(COLOURS)
        made.append(Look(colour(law), _LINES[other % len(_LINES)], _HATCHES[other % len(_HATCHES)]))
    return made


def shown_labels(found: Comparison) -> list[str]:
    """Return the labels of the variants as figures show them."""
    return [user_text(label, _LONGEST_LABEL) for label in found.labels]


def robot_label(found: Comparison, robot: int) -> str:
    """Return the label of a robot as figures show it."""
    return user_text(found.observed[robot].label, _LONGEST_ROBOT)


def legend_rows(found: Comparison, width: float) -> tuple[int, int]:
    """Return (columns, rows) of a legend of the variants and the measurement on a figure so wide [inch]."""
    longest = max(len(label) for label in [*shown_labels(found), MEASURED])
    columns = max(1, min(len(found.labels) + 1, int((width - _NOTE_WIDTH) / (0.75 + 0.068 * longest))))
    return columns, -(-(len(found.labels) + 1) // columns)


def variant_marks(found: Comparison, made: Sequence[Look]) -> list[Any]:
    """Return what stands in a legend for each variant."""
    return [
        mark(label, look.colour, line=look.line, linewidth=1.8)
        for look, label in zip(made, shown_labels(found), strict=True)
    ]


def foot_legend(figure: Figure, handles: Sequence[Any], columns: int, more: str = "") -> None:
    """Put the legend at the foot of a figure, and beside it what the marks of all of them mean."""
    note: dict[str, Any] = {"size": SMALL, "color": GREY, "ha": "right"}
    figure.text(1 - 0.15 / figure.get_figwidth(), 0.1 / figure.get_figheight(), _NOTE + more, **note)
    place = (0.1 / figure.get_figwidth(), 0.04 / figure.get_figheight())
    look: dict[str, Any] = {"handlelength": 2.6, "borderaxespad": 0.0, "columnspacing": 1.4}
    legend(figure, handles, loc="lower left", bbox_to_anchor=place, ncols=columns, **look)


def bars(axes: Axes, found: Comparison, name: str, made: Sequence[Look]) -> None:
    """Draw the mean size of the errors of each robot, a bar a variant; a red cross where nothing has a solution."""
    what = OBSERVABLES[name]
    robots = [k for k in range(len(found.observed)) if found.measured(name, k)]
    plain(axes, "", f"mean error [{what.unit}]")
    width = min(0.82 / len(made), _WIDEST_BAR)
    for v, look in enumerate(made):
        means = np.array([found.statistics(v, name, k).mean for k in robots]) / what.scale
        places = np.arange(len(robots)) + (v - (len(made) - 1) / 2) * width
        style: dict[str, Any] = {"color": look.colour, "hatch": look.hatch, "edgecolor": "white", "linewidth": 0.3}
        axes.bar(places, means, 0.92 * width, label=found.labels[v], **style)
        if (lost := ~np.isfinite(means)).any():
            foot = axes.get_xaxis_transform()
            axes.plot(places[lost], [0.025] * int(lost.sum()), "x", color=WRONG, markersize=4, transform=foot)
    axes.set_xticks(range(len(robots)), [robot_label(found, k) for k in robots])
    axes.set_xlim(-0.6, len(robots) - 0.4)
    axes.grid(False, axis="x")
    crowded = sum(len(robot_label(found, k)) for k in robots) > 40
    axes.tick_params(axis="x", length=0, rotation=30 if crowded else 0)


def box_labels(found: Comparison) -> list[str]:
    """Return the names of the boxes: none of a single one, long ones on two lines where there is room for them."""
    if len(found.labels) == 1:
        return [""]
    width = _LABEL_WIDTH if len(found.labels) <= _MOST_WRAPPED else 100
    return ["\n".join(wrap(label, width)) for label in shown_labels(found)]


def boxes(axes: Axes, found: Comparison, name: str, made: Sequence[Look]) -> None:
    """Draw a box of the errors of each variant, the first on top; below zero the model is below the measurement."""
    what = OBSERVABLES[name]
    plain(axes, f"simulated - measured [{what.unit}]", "")
    order = range(len(made))[::-1]
    values = [found.errors(v, name)[0] / what.scale for v in order]
    axes.axvline(0, color=GREY, linewidth=0.8, zorder=1)
    draw_boxes(axes, values, [made[v].colour for v in order], hatches=[made[v].hatch for v in order], mean=True)
    names = box_labels(found)
    axes.set_yticks(range(1, len(made) + 1), [names[v] for v in order])
    axes.tick_params(axis="y", length=0)
    axes.tick_params(labelsize=SMALL if len(made) <= 12 else SMALL - 1.5)
    axes.grid(False, axis="y")


def draw_boxes(
    axes: Axes,
    values: Sequence[Array],
    faces: Sequence[str],
    *,
    hatches: Sequence[str] | None = None,
    positions: Sequence[float] | None = None,
    width: float = 0.6,
    mean: bool = False,
    upright: bool = False,
) -> None:
    """Draw a box for each array of values, 1, 2, … from below or at positions; `mean` adds diamonds.

    Boxes are quartiles with the median, whiskers reach the last value within 1.5 times their height, dots lie beyond.
    """
    drawn: dict[str, Any] = axes.boxplot(
        list(values),
        orientation="vertical" if upright else "horizontal",
        positions=positions,
        widths=width,
        showmeans=mean,
        patch_artist=True,
        medianprops={"color": INK, "linewidth": 1.5},
        whiskerprops={"color": GREY},
        capprops={"color": GREY},
        meanprops={"marker": "D", "markerfacecolor": "white", "markeredgecolor": INK, "markersize": 4},
        flierprops={"marker": ".", "markersize": 3, "markeredgecolor": GREY, "rasterized": True},
    )
    for k, (box, face) in enumerate(zip(drawn["boxes"], faces, strict=True)):
        box.set(facecolor=face, edgecolor=GREY, alpha=0.75)
        if hatches is not None and hatches[k]:
            box.set(hatch=hatches[k])
