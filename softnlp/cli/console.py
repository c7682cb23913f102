"""What the commands share: output, one-line errors, a progress bar, and stopping between steps."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import Any

from softnlp.base.errors import InputError
from softnlp.base.reading import one_line

SOLVED, BAD_INPUT, SOME_UNSOLVED, STOPPED = 0, 2, 3, 130
"""Exit statuses."""

Advance = Callable[[int], None]
"""Called with the number of steps done so far."""


def say(text: str) -> None:
    """Print text. A reader that has gone, as `head` goes, is no error.

    Raises
    ------
    InputError
        When standard output cannot be written: it is a file on a full disk, for instance.
    """
    try:
        print(text, flush=True)
    except UnicodeEncodeError:  # an old terminal, or a file name that is no text
        encoding = sys.stdout.encoding
        print(text.encode(encoding, "replace").decode(encoding), flush=True)
    except OSError as error:
        # Python would try once more at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if not isinstance(error, BrokenPipeError):
            raise InputError(f"cannot be written: {error.strerror}", source="standard output") from None


def complain(message: str) -> None:
    """Say on one printable line of standard error what was wrong."""
    print(f"softnlp: {one_line(message)}", file=sys.stderr)


def say_rows(header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print aligned columns of plain text, which pipes well."""
    say("\n".join(aligned(header, rows)))


def aligned(header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """Return the lines of a table: columns of numbers to the right, a row a line whatever is in it."""
    table = [[one_line(cell) for cell in row] for row in (header, *rows)]
    widths = [max(len(row[k]) for row in table) for k in range(len(header))]
    numeric = [all(_is_number(row[k]) for row in rows) for k in range(len(header))]
    lines = []
    for row in table:
        cells = (c.rjust(w) if n else c.ljust(w) for c, w, n in zip(row, widths, numeric, strict=True))
        lines.append("  ".join(cells).rstrip())
    return lines


def _is_number(text: str) -> bool:
    try:
        float(text.replace(",", ""))
    except ValueError:
        return False
    return True


def rich_text(heading: str, lines: Any, width: int) -> str:
    """Return a heading and what rich prints below it as text, coloured on a terminal, of at least a width."""
    from rich.console import Console
    from rich.text import Text

    console = Console(highlight=False)
    if not console.is_terminal or console.width < width:
        console = Console(highlight=False, width=width)
    with console.capture() as shown:
        console.print(Text(heading, "bold"))
        console.print(lines)
    return shown.get().rstrip("\n")


@contextmanager
def progress(total: int, title: str) -> Iterator[tuple[Advance, Callable[[], bool]]]:
    """Show a progress bar on standard error when that is a terminal, and wait for Ctrl-C.

    Yields what advances the bar, and what says whether Ctrl-C was pressed. It is for the caller to stop between two
    steps: in the middle of a solve CasADi loses the interrupt or makes another error of it. A second Ctrl-C ends the
    process at once.
    """
    with progress_bar(total, title) as (advance, describe), interrupt_asked(describe) as asked:
        yield advance, asked


@contextmanager
def progress_bar(total: int, title: str) -> Iterator[tuple[Advance, Callable[[str], None]]]:
    """Show a bar with a fraction and the time left on a terminal; yields what advances it and what changes its text."""
    if not sys.stderr.isatty():
        yield lambda done: None, lambda text: None
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(escape(title), total=total)
        yield (
            lambda done: bar.update(task, completed=done),
            lambda text: bar.update(task, description=escape(text)),
        )


@contextmanager
def interrupt_asked(describe: Callable[[str], None]) -> Iterator[Callable[[], bool]]:
    """Take the first Ctrl-C as a request; yields whether it was made."""
    if threading.current_thread() is not threading.main_thread():  # no signal comes here
        yield lambda: False
        return
    asked = False

    def ask(number: int, frame: FrameType | None) -> None:
        nonlocal asked
        asked = True
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        describe("stopping after this step (Ctrl-C again: at once)")

    before = signal.signal(signal.SIGINT, ask)
    try:
        yield lambda: asked
    finally:
        signal.signal(signal.SIGINT, before)
