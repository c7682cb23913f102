"""`softnlp import`: files as laboratories write them to the project's CSV, with each guess and its reason."""

from __future__ import annotations

import json as json_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from softnlp.base.errors import InputError
from softnlp.base.reading import IMPORTED
from softnlp.cli.console import SOLVED, SOME_UNSOLVED, say, say_rows
from softnlp.cli.study import Json

if TYPE_CHECKING:
    from softnlp.laboratory.imported import Imported

_SHOWN = 5  # rows of the table that are printed


def import_(
    files: Annotated[tuple[Path, ...], Parameter(name="FILE")] = (),
    /,
    *,
    as_: Annotated[str | None, Parameter(name="--as")] = None,
    set_: Annotated[tuple[str, ...], Parameter(name="--set", negative=(), consume_multiple=True)] = (),
    out: Path | None = None,
    force: bool = False,
    strict: bool = False,
    json: Json = False,
) -> int:
    """Read files of testing machines, trackers, pressure and force loggers as they are.

    Prints what was read, every guess with its reason, and the checks that have something to say. The exit status is 0,
    2 where it must ask (the message shows the readings and the setting that tells), 3 for a warning with --strict.

    Parameters
    ----------
    files
        Of one test, or one NAME.import.toml. Tips and forces may come with the log of the pressures.
    as_
        tensile, pressure, tips or force; by default what the columns' names say.
    set_
        Settings as KEY=VALUE, such as gauge_length_mm=25 or unit.stress=kPa; may be repeated.
        docs/import.md lists them.
    out
        Name for the results: NAME.csv, which scenarios take, and NAME.import.toml, which repeats the import.
    force
        Replace results that are there.
    strict
        End with exit status 3 where a check warns.
    """
    from softnlp.laboratory.choices import settings_from_words
    from softnlp.laboratory.importing import import_files
    from softnlp.laboratory.recipe import read_recipe, write_import

    files += tuple(Path(word) for word in set_ if "=" not in word)  # --set takes all the words behind it
    settings = settings_from_words(word for word in set_ if "=" in word)
    if len(files) == 1 and files[0].name.endswith(IMPORTED):
        recipe = read_recipe(files[0])
        if as_ not in (None, recipe.kind):
            raise InputError(f"expected {recipe.kind!r}, as in {files[0]}", key="--as")
        folder = recipe.folder
        known = {**recipe.settings, **settings}
        imported = recipe.run() if not settings else import_files(recipe.files, recipe.kind, known, folder)
    else:
        folder = Path()
        imported = import_files([str(file) for file in files], as_, settings, folder)
    written = [] if out is None else write_import(imported, out, folder, force)
    if json:
        say(json_module.dumps(imported.document(), indent=2, ensure_ascii=False))
    else:
        _say(imported)
        for path in written:
            say(f"wrote {path}")
    return SOME_UNSOLVED if strict and imported.warnings else SOLVED


def _say(imported: Imported) -> None:
    """Print what was read and why."""
    names = list(imported.columns)
    say(f"{', '.join(imported.files)}: {imported.kind}, {imported.rows} rows")
    rows = [[f"{imported.columns[name][k]:.6g}" for name in names] for k in range(min(_SHOWN, imported.rows))]
    say_rows(names, rows)
    for reason, count in imported.choices.dropped.items():
        say(f"left out: {count} {reason}")
    for note in imported.choices.notes:
        say(f"note: {note}")
    for guess in imported.choices.guesses:
        say(f"guessed: {guess.key} = {guess.value}: {guess.reason}")
    for name, value in imported.numbers.items():
        say(f"{name}: {value:.5g}")
    say(f"checks: {len(imported.checks)}, {len(imported.warnings)} with a warning")
    for warning in imported.warnings:
        say(f"warning: {warning}")
