"""The project's own matplotlib settings, and the figure that is drawn and saved under them wherever it is.

This is the only module that imports matplotlib as it is itself imported; the others wait until they draw.
"""

from __future__ import annotations

import logging
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from threading import RLock
from typing import Any

from matplotlib import rc_context, rcParamsDefault
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager
from matplotlib.ticker import LogFormatter, LogFormatterMathtext

from softnlp.base.reading import one_line

_FAMILY = "DejaVu Sans"  # comes with matplotlib
EAST_ASIAN = (
    *(f"Noto Sans {name}" for name in ("CJK JP", "CJK SC", "CJK TC", "CJK KR", "JP", "SC", "TC", "KR")),
    *("Source Han Sans", "IPAexGothic", "IPAGothic", "WenQuanYi Zen Hei", "WenQuanYi Micro Hei", "NanumGothic"),
    *("Droid Sans Fallback", "Unifont", "Hiragino Sans", "PingFang SC", "Apple SD Gothic Neo", "Arial Unicode MS"),
    *("Yu Gothic", "MS Gothic", "Microsoft YaHei", "Microsoft JhengHei", "SimHei", "Malgun Gothic"),
)
"""Fonts, each used where it is installed, for the characters that the first font does not have."""

# The backend is the one setting that matplotlib does not put back; a canvas of our own needs none.
_DEFAULTS: dict[Any, Any] = {key: value for key, value in rcParamsDefault.items() if key != "backend"}
_GLYPH = re.compile(r"Glyph (\d+) .*missing from", re.DOTALL)
_FONT_LOG = logging.getLogger("matplotlib.font_manager")
_LOCK = RLock()  # the settings are those of the process, so threads draw one after the other


class MissingGlyphs(UserWarning):
    """Characters of a figure that no installed font has; boxes stand for them."""

    def __init__(self, characters: str) -> None:
        super().__init__(characters)
        self.characters = characters

    def __str__(self) -> str:
        return (
            f"no font that figures use has the characters {one_line(self.characters, 40)}, boxes are drawn instead; "
            f"a font such as {EAST_ASIAN[0]} is used where it is installed"
        )


@contextmanager
def own_settings() -> Iterator[None]:
    """Set matplotlib's defaults with the project's own; what the user has set comes back at the end.

    Text is shown as it is, since most of it is the user's: mathematics of our own is drawn with `parse_math=True`.
    """
    installed = {font.name for font in fontManager.ttflist}
    families = [_FAMILY, *(name for name in EAST_ASIAN if name in installed)]
    with _LOCK, rc_context({**_DEFAULTS, "text.parse_math": False, "font.family": families}):
        before = _FONT_LOG.level
        _FONT_LOG.setLevel(logging.ERROR)  # a font without a bold face is told of each time
        try:
            yield
        finally:
            _FONT_LOG.setLevel(before)


class OwnFigure(Figure):
    """A figure of the project: drawn and saved under its own settings, whoever does it and whatever they have set."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        FigureCanvasAgg(self)

    def draw(self, renderer: Any) -> None:
        """Draw; characters that no font has are one warning, powers of ten are written without mathematics."""
        for axis in (axis for axes in self.axes for axis in (axes.xaxis, axes.yaxis)):
            if isinstance(axis.get_major_formatter(), LogFormatterMathtext):
                axis.set_major_formatter(LogFormatter())
                axis.set_minor_formatter(LogFormatter())
        with own_settings(), warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("always")
            super().draw(renderer)
        missing = ""
        for w in heard:
            if glyph := _GLYPH.match(str(w.message)):
                missing += chr(int(glyph[1]))
            else:
                warnings.warn_explicit(w.message, w.category, w.filename, w.lineno)
        if missing:
            warnings.warn(MissingGlyphs("".join(dict.fromkeys(missing))), stacklevel=2)

    def savefig(self, *args: Any, **kwargs: Any) -> None:
        """Save as `Figure.savefig` does."""
        with own_settings():
            super().savefig(*args, **kwargs)
