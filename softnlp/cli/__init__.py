"""The command `softnlp`.

Exit status: 0 when every step solved, 3 when some did not (the others' results are kept), 2 for bad input, 130 when
stopped by Ctrl-C (the finished steps are kept).
"""

from __future__ import annotations

import gc
import sys
from collections.abc import Sequence
from importlib import import_module
from typing import TYPE_CHECKING

from softnlp.cli.console import BAD_INPUT, SOLVED, STOPPED, complain, say

if TYPE_CHECKING:
    from cyclopts import App

_OBJECTS = 1_000_000
"""New objects before some are collected: those of the imports all stay, and looking at them took a tenth of a run."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line (that of the process by default) and return its exit status."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    usual = gc.get_threshold()
    gc.set_threshold(_OBJECTS, *usual[1:])
    try:
        return _version() if words == ["--version"] else _run(words)
    except KeyboardInterrupt:
        complain("stopped")
        return STOPPED
    finally:
        gc.set_threshold(*usual)


def _version() -> int:
    """Print the version without the imports that every other command needs."""
    from softnlp import __version__

    say(__version__)
    return SOLVED


def _run(words: list[str]) -> int:
    """Run one command; what is wrong with its input is one line on standard error."""
    from cyclopts import CycloptsError

    from softnlp.base.errors import SoftnlpError

    try:
        return int(_app()(words, exit_on_error=False, print_error=False) or SOLVED)
    except CycloptsError as error:
        complain(f"{' '.join(str(error).split())} (--help after any command lists what it takes)")
    except SoftnlpError as error:
        for mistake in getattr(error, "errors", (error,)):
            complain(str(mistake))
    return BAD_INPUT


def _app() -> App:
    """Return the commands."""
    from cyclopts import App, Parameter

    from softnlp import __version__

    def add(to: App, commands: str, module: str = "", prefix: str = "") -> None:
        for name in commands.split():
            home = import_module(f"softnlp.cli.{module or name}")
            to.command(getattr(home, prefix + name), name=name)

    app = App(
        name="softnlp",
        help="Statics of pneumatic soft manipulators: how far they bend and stretch, and where the tip is under load.",
        version=__version__,
        help_format="plaintext",
        result_action="return_value",
        suppress_keyboard_interrupt=False,
        default_parameter=Parameter(negative=()),
    )
    commands = "run check workspace sweep inverse sensitivity modes identify compare design gui mesh mould example new"
    add(app, f"{commands} convert")
    add(app, "robots materials", "library")
    app.command(import_module("softnlp.cli.importing").import_, name="import")
    plot = App(name="plot", help="Draw the figures of a results folder again; or a cross-section, silicones, one run.")
    plot.default(import_module("softnlp.cli.plot").plot_folder)
    add(plot, "section material run", "plot", "plot_")
    app.command(plot)
    return app
