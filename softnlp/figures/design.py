"""The figure of a design study: every candidate, feasible or why not, and the section of the best."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from softnlp.base.columns import ONE, Output
from softnlp.figures.section import draw_section, stretched_radii
from softnlp.figures.style import COLOURS, GREY, INK, PALE, SMALL, TEXT, in_own_style, new_figure, plain, user_text
from softnlp.results.design import held_back, label, pressure_words
from softnlp.studies.design import Design
from softnlp.studies.design_candidate import Candidate
from softnlp.studies.design_task import OUTPUTS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_BARS = 30
_FEWEST = 8  # rows of the panel of bars
_LONGEST = 62  # characters of a reason
_BEST, _FEASIBLE = COLOURS[1], COLOURS[0]
_WIDTH, _ROW, _HEAD = 11.5, 0.24, 1.3  # of the figure, of a bar and of what is around the bars [inch]


@in_own_style
def design_figure(done: Design) -> Figure:
    """Draw a design: bars of the objective, the objective against what is required, and the best one's section.

    Bars are in the order of the candidates, of more than `MOST_BARS` those of the best; a candidate that is not
    feasible has its reason in place of a bar.
    """
    task = done.task
    shown = list(done.candidates)
    if len(shown) > MOST_BARS:
        shown = [*done.feasible, *(c for c in shown if not c.is_feasible)][:MOST_BARS]
    height = max(6.4, _HEAD + _ROW * len(shown))
    way = "largest" if task.maximise else "smallest"
    sets = f"set{'s' * (len(task.sets) > 1)} {', '.join(str(k + 1) for k in task.sets)}"
    subtitle = (
        f"{way} {task.objective.label}  ·  {sets} at "
        f"{pressure_words(task.pressure)}  ·  {len(done.feasible)} of {len(done.candidates)} feasible"
    )
    figure = new_figure(_WIDTH, height, done.title or "Design", subtitle)
    few = done.best is not None and len(shown) <= _FEWEST // 2
    lines = list(held_back(done, done.best)) if done.best is not None and few else []
    beneath = 0.35 + _ROW * (len(lines) + 1) if lines else 0.0  # what stands below the bars [inch]
    _bars(figure.add_axes((0.21, (0.62 + beneath) / height, 0.37, 1 - (_HEAD + beneath) / height)), done, shown)
    for k, line in enumerate(["held back by", *lines] if lines else []):
        bold = "normal" if k else "bold"
        figure.text(0.03, (beneath - 0.2 - _ROW * k) / height, line, size=SMALL, color=INK, weight=bold)
    _scatter(figure.add_axes((0.66, (height - 3.0) / height, 0.32, 2.15 / height)), done)
    if done.best is not None:
        best = done.best
        axes = figure.add_axes((0.64, 0.0, 0.35, 2.7 / height))
        title = f"best: {user_text(label(done, best), 34)}, {best.outputs['pressure'] / 1e5:.4g} bar"
        figure.text(0.63, 2.87 / height, title, size=TEXT, weight="bold", color=INK, va="top")
        draw_section(axes, best.robot, stretched_radii(best.robot, 1.0), "", set(), made=True)
    return figure


def _axis(output: Output) -> str:
    return output.label if output.unit is ONE else f"{output.label} [{output.unit}]"


def _colour(done: Design, candidate: Candidate) -> str:
    return _BEST if candidate is done.best else _FEASIBLE if candidate.is_feasible else GREY


def _bars(axes: Axes, done: Design, shown: list[Candidate]) -> None:
    """Draw a bar for each feasible candidate, and in words why there is none."""
    objective = done.task.objective
    rows = np.arange(len(shown))
    values = [c.objective / objective.scale if c.is_feasible else 0.0 for c in shown]
    axes.barh(rows, values, color=[_colour(done, c) for c in shown], height=0.66)
    widest = max((abs(v) for v in values), default=0.0) or 1.0
    for row, (candidate, value) in enumerate(zip(shown, values, strict=True)):
        words = f" {value:.4g}" if candidate.is_feasible else f" {_why(candidate)}"
        colour = INK if candidate.is_feasible else GREY
        bold = "bold" if candidate is done.best else "normal"
        axes.text(max(value, 0.0) + 0.005 * widest, row, words, size=SMALL, color=colour, weight=bold, va="center",
                  clip_on=False)  # fmt: skip
    axes.set_xlim(min(0.0, *values), 1.15 * widest)
    plain(axes, _axis(objective), "")
    axes.set_yticks(rows, [f"{user_text(label(done, c), 32)}  {c.number}" for c in shown], size=SMALL)
    axes.tick_params(axis="y", length=0)
    axes.grid(False, axis="y")
    axes.set_ylim(max(len(shown), _FEWEST // 2) - 0.4, -0.6)
    if len(shown) < len(done.candidates):
        axes.set_title(f"the first {len(shown)} of {len(done.candidates)}", size=SMALL, color=GREY, loc="left")


def _why(candidate: Candidate) -> str:
    """Return the reason why a candidate is not feasible, cut to the width of a panel."""
    words = "; ".join(candidate.reasons)
    for general in ("no step of the pressure", "no pressure"):
        words = words.removeprefix(f"{general} meets everything; nearest is ")
    return user_text(words, _LONGEST)


def across(done: Design) -> Output:
    """Return what to draw the objective against: the first requirement on what a robot does, else the pressure."""
    task = done.task
    for name in task.requirements:
        if name != task.objective.name and OUTPUTS[name].group != "robot":
            return OUTPUTS[name]
    return OUTPUTS["bending_angle"] if task.objective.name == "pressure" else OUTPUTS["pressure"]


def _scatter(axes: Axes, done: Design) -> None:
    """Draw the objective against a requirement, with its limits; crosses are not feasible."""
    against, objective = across(done), done.task.objective
    groups = (
        ("not feasible", [c for c in done.candidates if not c.is_feasible], GREY, "x", 26),
        ("feasible", [c for c in done.feasible if c is not done.best], _FEASIBLE, "o", 22),
        ("best", [done.best] if done.best else [], _BEST, "*", 120),
    )
    for name, members, colour, marker, size in groups:
        known = [c for c in members if against.name in c.outputs]
        # Where the objective was not worked out any more the cross stands at the foot.
        y = [c.outputs.get(objective.name, np.nan) / objective.scale for c in known]
        shown = name if np.all(np.isfinite(y)) else f"{name} (at 0: not worked out)"
        y = [0.0 if not np.isfinite(v) else v for v in y]
        if known:
            x = [c.outputs[against.name] / against.scale for c in known]
            axes.scatter(x, y, s=size, c=colour, marker=marker, label=shown, zorder=3, clip_on=False)
    limits = done.task.requirements.get(against.name)
    if limits is not None:
        for value, words in ((limits.lower, "at least"), (limits.upper, "at most")):
            if np.isfinite(value):
                axes.axvline(value / against.scale, color=INK, linewidth=0.9, linestyle=(0, (5, 3)), zorder=2)
                axes.text(
                    value / against.scale, 1.01, f"{words} {value / against.scale:g}", size=SMALL, color=INK,
                    ha="center", va="bottom", transform=axes.get_xaxis_transform(),
                )  # fmt: skip
    plain(axes, _axis(against), _axis(objective))
    if axes.collections:
        axes.legend(fontsize=SMALL, frameon=True, framealpha=0.9, edgecolor=PALE, labelcolor=INK, loc="best")
