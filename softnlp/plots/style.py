"""What all figures share: colours that colour-blind readers tell apart, plain axes, and saving."""

from __future__ import annotations

import io
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from softnlp.errors import InputError
from softnlp.palette import COLOURS as COLOURS
from softnlp.palette import colour as colour
from softnlp.results import write_whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, GREY, PALE = "#222222", "#767676", "#DDDDDD"
WRONG = "#C1121F"
DPI = 120
TEXT, SMALL = 9.0, 8.0
FORMATS = ("png", "pdf", "svg")


def ink_on(background: str) -> str:
    """Return the colour of text on a background: dark on the palette's light colours, else white."""
    return INK if background in COLOURS[4:] else "white"


def step_colours(steps: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return (steps, 4) colours from first (dark) to last; the palest end of the map is left out."""
    from matplotlib import colormaps

    return np.asarray(colormaps["viridis"](np.linspace(0.0, 0.88, max(steps, 1))))


def new_figure(width: float, height: float, title: str, subtitle: str) -> Figure:
    """Return an empty figure [inch] with a heading on two lines, cut to its width; `$` is shown as it is."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), dpi=DPI, facecolor="white")
    FigureCanvasAgg(figure)
    left = 0.18 / width
    title, subtitle = (_cut(text, int(width * n)) for text, n in ((title, 8.0), (subtitle, 12.5)))
    figure.text(left, 1 - 0.12 / height, title, size=12, weight="bold", color=INK, va="top", parse_math=False)
    figure.text(left, 1 - 0.37 / height, subtitle, size=TEXT, color=GREY, va="top", parse_math=False)
    return figure


def _cut(text: str, longest: int) -> str:
    text = "  ".join(" ".join(part.split()) for part in text.split("  "))
    return text if len(text) <= longest else f"{text[: longest - 1]}…"


def plain(axes: Axes, x_label: str, y_label: str) -> None:
    """Give a panel its labels, a pale grid and no box."""
    axes.set_xlabel(x_label, size=TEXT, color=INK)
    axes.set_ylabel(y_label, size=TEXT, color=INK)
    axes.tick_params(labelsize=SMALL, colors=INK, color=GREY)
    axes.grid(True, color=PALE, linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(GREY)


def listed(words: Sequence[str]) -> str:
    """Return "a", "a and b" or "a, b and c"."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def save_figure(figure: Figure, path: str | PathLike[str]) -> Path:
    """Write a figure as PNG, PDF or SVG, by the path's suffix; return the path.

    Raises
    ------
    InputError
        For another suffix, or when the file cannot be written.
    """
    target = Path(path)
    kind = target.suffix.lower().removeprefix(".")
    if kind not in FORMATS:
        raise InputError(
            f"expected a file name that ends in {listed([f'.{f}' for f in FORMATS]).replace(' and ', ' or ')}",
            source=str(target),
        )
    content = io.BytesIO()
    figure.savefig(content, format=kind)
    return write_whole(target, content.getvalue())
