"""Figures of the commands: drawn after the numbers are written, and never at their cost."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from softnlp.base.errors import SoftnlpError
from softnlp.cli.console import complain, progress_bar

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def draw(figures: Mapping[Path, Callable[[], Figure]], results: Path | None = None) -> list[Path]:
    """Draw figures and save each in its file; return the files.

    One that cannot be drawn is one line on standard error that says where the numbers are, `results`; it leaves no
    file, since one of an earlier run would not belong to them. What is to be warned of is said once for all figures.
    """
    written: list[Path] = []
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("default")
        for path, figure in _told(figures):
            try:
                written.append(_saved(figure, path))
            except SoftnlpError:
                raise
            except Exception as error:  # whatever fails in drawing, the numbers are there and count
                with suppress(OSError):
                    path.unlink()
                kept = "" if results is None else f"; the results are in {results}"
                complain(f"the figure could not be drawn: {path.name}: {type(error).__name__}: {error}{kept}")
    _say_warnings([w.message for w in heard])
    return written


def _told(figures: Mapping[Path, Callable[[], Figure]]) -> Iterator[tuple[Path, Callable[[], Figure]]]:
    """Yield figures with a progress bar."""
    with progress_bar(len(figures), "figures") as (advance, _):
        for k, item in enumerate(figures.items()):
            advance(k)
            yield item


def _saved(figure: Callable[[], Figure], path: Path) -> Path:
    from softnlp.figures.style import import_alone, save_figure

    import_alone()
    return save_figure(figure(), path)


def _say_warnings(heard: list[Warning | str]) -> None:
    """Say each warning once, the characters without a font of all figures in one."""
    if not heard:
        return
    from softnlp.figures.canvas import MissingGlyphs

    missing = "".join(w.characters for w in heard if isinstance(w, MissingGlyphs))
    others = [str(w) for w in heard if not isinstance(w, MissingGlyphs)]
    if missing:
        others.append(str(MissingGlyphs("".join(dict.fromkeys(missing)))))
    for words in dict.fromkeys(others):
        complain(f"warning: {words}")
