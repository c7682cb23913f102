"""What all figures share: colours that colour-blind readers tell apart, plain axes, and saving."""

from __future__ import annotations

import io
import logging
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import chdir
from functools import wraps
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

import numpy as np

from softnlp.base.errors import InputError
from softnlp.base.palette import COLOURS as COLOURS
from softnlp.base.palette import colour as colour
from softnlp.base.reading import one_line
from softnlp.results import write_whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK, GREY, PALE = "#222222", "#767676", "#DDDDDD"
WRONG = "#C1121F"
DPI = 120
TEXT, SMALL = 9.0, 8.0
FORMATS = ("png", "pdf", "svg")
LONGEST_LABEL = 48
_P = ParamSpec("_P")
_R = TypeVar("_R")


def import_alone() -> None:
    """Import matplotlib without what the user has set for it, which may be broken: for commands, which draw alone.

    Its backend and its file of settings are read once, at its import. What it logs, of a folder that it cannot write
    for instance, is left out. A program that calls this package imports matplotlib as it likes.
    """
    if "matplotlib" in sys.modules:
        return
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    before = dict(os.environ)
    os.environ.update(MPLBACKEND="agg", MATPLOTLIBRC=os.devnull)
    try:
        with chdir(Path(__file__).parent):  # a matplotlibrc where the user stands counts before all others
            import matplotlib  # noqa: F401
    finally:
        os.environ.clear()
        os.environ.update(before)


def in_own_style(function: Callable[_P, _R]) -> Callable[_P, _R]:
    """Let a function make figures under the project's own settings; `new_figure` needs it."""

    @wraps(function)
    def under_own_settings(*args: _P.args, **kwargs: _P.kwargs) -> _R:
        from softnlp.figures.canvas import own_settings

        with own_settings():
            return function(*args, **kwargs)

    return under_own_settings


def ink_on(background: str) -> str:
    """Return the colour of text on a background: dark on the palette's light colours, else white."""
    return INK if background in COLOURS[4:] else "white"


def step_colours(steps: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Return (steps, 4) colours from first (dark) to last; the palest end of the map is left out."""
    from matplotlib import colormaps

    return np.asarray(colormaps["viridis"](np.linspace(0.0, 0.88, max(steps, 1))))


def new_figure(width: float, height: float, title: str, subtitle: str) -> Figure:
    """Return an empty figure [inch] with a heading on two lines, cut to its width.

    Raises
    ------
    RuntimeError
        Outside a function that is `in_own_style`.
    """
    from matplotlib import rcParams

    from softnlp.figures.canvas import OwnFigure

    if rcParams["text.parse_math"]:
        raise RuntimeError("a function that makes a figure needs the decorator softnlp.figures.style.in_own_style")
    figure = OwnFigure(figsize=(width, height), dpi=DPI, facecolor="white")
    left = 0.18 / width
    title, subtitle = (_heading(text, int(width * n)) for text, n in ((title, 8.0), (subtitle, 12.5)))
    figure.text(left, 1 - 0.12 / height, title, size=12, weight="bold", color=INK, va="top")
    figure.text(left, 1 - 0.37 / height, subtitle, size=TEXT, color=GREY, va="top")
    return figure


def user_text(text: str, longest: int = LONGEST_LABEL) -> str:
    """Return what a user named something as figures show it: on one line, printable, and cut.

    A blank goes before a first `_`, with which matplotlib would leave it out of a legend.
    """
    text = _cut(" ".join(text.split()), longest)
    return f" {text}" if text.startswith("_") else text


def _heading(text: str, longest: int) -> str:
    return _cut("  ".join(" ".join(part.split()) for part in text.split("  ")), longest)


def _cut(text: str, longest: int) -> str:
    text = one_line(text)
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


def legend(of: Figure | Axes, handles: Sequence[Any] | None = None, **look: Any) -> None:
    """Give a figure or a panel a legend without a box, of its own artists where no others are given."""
    of.legend(handles=handles, **{"fontsize": SMALL, "frameon": False, "labelcolor": INK, **look})


def mark(label: str, ink: str, marker: str = "", line: Any = "", **look: Any) -> Any:
    """Return what stands in a legend for marks or for a line."""
    from matplotlib.lines import Line2D

    return Line2D([], [], color=ink, marker=marker, linestyle=line, label=label, **look)


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
