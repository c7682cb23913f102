"""The robustness map as a figure and as a page."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

import numpy as np

from softnlp.figures.style import GREY, INK, SMALL, in_own_style, new_figure, save_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.image import AxesImage

    from benchmarks.robustness_map import Outcome, Tried

_MESSAGES = 4  # of each way, the most frequent


@in_own_style
def figure(poses: Sequence[Tried], buckling: float, path: Path) -> None:
    """Draw one panel a way: the share of directions solved, with the median iterations of those."""
    names = [outcome.method for outcome in poses[0].outcomes]
    each = len({pose.direction for pose in poses if (pose.pressure_bar, pose.force) == _cell(poses[0])})
    drawn = new_figure(
        12.0,
        7.6,
        "Which way finds an equilibrium, from nothing",
        f"{each} directions of the force a cell; its number: median iterations of those solved; (n): n solutions "
        "are not the load path's",
    )
    axes = drawn.subplots(2, 4, sharex=True, sharey=True)
    drawn.subplots_adjust(left=0.06, right=0.9, top=0.86, bottom=0.09, wspace=0.08, hspace=0.2)
    for k, (panel, name) in enumerate(zip(axes.flat, [*names, "the load path itself"], strict=True)):
        share, labels = _stable_path(poses) if k == len(names) else _solved(poses, k)
        image = _panel(panel, share, labels)
        panel.set_title(f"{name}: {'stable' if k == len(names) else 'solved'}", size=9, color=INK)
        panel.set_xticks(range(share.shape[1]), [f"{p:g}" for p in _axis(poses, "pressure_bar")], size=SMALL)
        panel.set_yticks(range(share.shape[0]), [f"{f:g}" for f in _axis(poses, "force")], size=SMALL)
    for panel in axes[1]:
        panel.set_xlabel("pressure of set 1 [bar]", size=9, color=INK)
    for panel in axes[:, 0]:
        panel.set_ylabel(f"tip force [of {buckling:.3g} N, where the straight robot buckles]", size=SMALL, color=INK)
    bar = drawn.colorbar(image, cax=drawn.add_axes((0.92, 0.09, 0.015, 0.77)))
    bar.set_label("share of the directions [1]", size=9, color=INK)
    bar.ax.tick_params(labelsize=SMALL, color=GREY)
    save_figure(drawn, path)


def _panel(panel: Axes, share: np.ndarray, labels: list[list[str]]) -> AxesImage:
    image = panel.imshow(share, origin="lower", aspect="auto", vmin=0.0, vmax=1.0, cmap="cividis")
    for row, texts in enumerate(labels):
        for column, text in enumerate(texts):
            ink = "black" if share[row, column] > 0.55 else "white"
            panel.text(column, row, text, ha="center", va="center", size=6.5, color=ink)
    return image


def _cell(pose: Tried) -> tuple[float, float]:
    return pose.pressure_bar, pose.force


def _axis(poses: Sequence[Tried], name: str) -> list[float]:
    return sorted({getattr(pose, name) for pose in poses})


def _cells(poses: Sequence[Tried]) -> list[list[list[Tried]]]:
    """Return the poses by force and pressure."""
    by_cell: dict[tuple[float, float], list[Tried]] = {}
    for pose in poses:
        by_cell.setdefault(_cell(pose), []).append(pose)
    return [[by_cell[p, f] for p in _axis(poses, "pressure_bar")] for f in _axis(poses, "force")]


def _solved(poses: Sequence[Tried], k: int) -> tuple[np.ndarray, list[list[str]]]:
    """Return the share solved by the k-th way and what its cells say."""
    shares, labels = [], []
    for row in _cells(poses):
        ends = [[pose.outcomes[k] for pose in cell] for cell in row]
        shares.append([np.mean([end.solved for end in cell]) for cell in ends])
        labels.append([_label(cell) for cell in ends])
    return np.array(shares), labels


def _label(ends: Sequence[Outcome]) -> str:
    solved = [end.iterations for end in ends if end.solved]
    others = sum(end.same is False for end in ends)
    number = f"{median(solved):.0f}" if solved else "–"
    return f"{number}\n({others})" if others else number


def _stable_path(poses: Sequence[Tried]) -> tuple[np.ndarray, list[list[str]]]:
    """Return the share of directions whose load path arrives and is stable; cells say how many turn back."""
    cells = _cells(poses)
    shares = [[np.mean([bool(pose.path_stable) for pose in cell]) for cell in row] for row in cells]
    back = [[sum(pose.path_stable is None for pose in cell) for cell in row] for row in cells]
    return np.array(shares), [[f"{n} turn\nback" if n else "" for n in row] for row in back]


def markdown(poses: Sequence[Tried], buckling: float, machine: Mapping[str, str], seconds: float) -> str:
    """Return the page of numbers."""
    names = [outcome.method for outcome in poses[0].outcomes]
    ends = {name: [pose.outcomes[k] for pose in poses] for k, name in enumerate(names)}
    parts = ["# Robustness: the numbers"]
    parts.append("Written by `python -m benchmarks.robustness_map`; [what they mean](../robustness.md).")
    listed = ", ".join(f"{key}: {machine[key]}" for key in ("processor", "cores", "Python", "casadi", "scipy", "date"))
    parts.append(
        f"{listed}. D15L60 in Ecoflex 00-50, {len(poses)} poses, {seconds:.0f} s. "
        f"The straight robot buckles at {buckling:.4g} N."
    )
    parts.append(_load_paths(poses))
    head = "| way | solved | the load path's | another, stable | another, unstable | iterations, median | nine in ten |"
    parts.append("\n".join([head, "|---|--:|--:|--:|--:|--:|--:|", *(_line(n, e) for n, e in ends.items())]))
    parts.append("A solution where the load path turns back is counted by whether it is stable.")
    parts.append(_by_force(poses, names))
    parts.append("## What those that failed ended with")
    words = ["| way | times | words |", "|---|--:|---|"]
    for name, outcomes in ends.items():
        counted = Counter(_without_numbers(end.words) for end in outcomes if not end.solved)
        words += [f"| {name} | {n} | {text} |" for text, n in counted.most_common(_MESSAGES)]
        words += [] if counted else [f"| {name} | 0 | – |"]
    parts.append("\n".join(words))
    return "\n\n".join(parts) + "\n"


def _load_paths(poses: Sequence[Tried]) -> str:
    """Return how many load paths arrive, and what the package does where the path's end is unstable or missing."""
    stable, back = sum(p.path_stable is True for p in poses), sum(p.path_stable is None for p in poses)
    left = [p.outcomes[-1] for p in poses if p.path_stable is not True]
    return (
        f"The load path arrives at a stable equilibrium in {stable} of them, at an unstable one in "
        f"{len(poses) - stable - back}, and turns back in {back}. Of those {len(left)} that do not end stable, "
        f"softnlp finds a stable equilibrium in {sum(end.stable for end in left)}."
    )


def _line(name: str, ends: Sequence[Outcome]) -> str:
    solved = [end for end in ends if end.solved]
    others = [end for end in solved if end.same is not True]
    counts = (len(solved), len(solved) - len(others), sum(e.stable for e in others), sum(not e.stable for e in others))
    shares = " | ".join(f"{100 * n / len(ends):.1f} %" for n in counts)
    spent = [end.iterations for end in solved]
    numbers = f"{median(spent):.0f} | {np.quantile(spent, 0.9):.0f}" if spent else "– | –"
    return f"| {name} | {shares} | {numbers} |"


def _by_force(poses: Sequence[Tried], names: Sequence[str]) -> str:
    """Return the share solved at each force."""
    forces = _axis(poses, "force")
    lines = [f"| solved at a force of | {' | '.join(f'{f:g}' for f in forces)} |", "|---" + "|--:" * len(forces) + "|"]
    for k, name in enumerate(names):
        shares = [np.mean([pose.outcomes[k].solved for pose in poses if pose.force == f]) for f in forces]
        lines.append(f"| {name} | {' | '.join(f'{100 * s:.0f} %' for s in shares)} |")
    return "\n".join(lines)


def _without_numbers(words: str) -> str:
    """Return a message with its numbers left out, so that equal ones are counted together."""
    return re.sub(r"\d+(\.\d+)?(e[+-]?\d+)?", "…", words)
