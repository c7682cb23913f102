"""Files that a scenario names: the project's own CSV, a file as a laboratory wrote it, or a NAME.import.toml."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from softnlp.base.csv_columns import Columns, csv_rows, read_columns
from softnlp.base.errors import InputError, located
from softnlp.base.reading import IMPORTED, LONGEST_NAME, one_line

if TYPE_CHECKING:  # imported where needed: most scenarios name no file of a laboratory
    from softnlp.laboratory.imported import Imported

T = TypeVar("T")

_INLINE = "; here as a key of the table import"


def laboratory_columns(
    folder: Path,
    files: Sequence[str],
    kind: str,
    own: Collection[str],
    settings: Mapping[str, Any] | None,
    further: Mapping[str, Any] | None = None,
) -> tuple[Columns, Imported | None]:
    """Return the columns of one file, or of several that are imported together, and the import they come from.

    own : columns of which the project's own CSV has one. settings : of an import, None where a scenario asks for none.
    further : settings of a file that is imported, which do not ask for it.

    Raises
    ------
    InputError
        As `read_columns` and `softnlp.laboratory.importing.import_files`.
    """
    file = files[0]
    plain = len(files) == 1 and settings is None and not file.endswith(IMPORTED)
    if plain:
        found = _or_imported(
            lambda: read_columns(folder, file), folder, file, own, lambda: _imported(folder, files, kind, further or {})
        )
        return found if isinstance(found, tuple) else (found, None)
    return _imported(folder, files, kind, {**(further or {}), **(settings or {})})


def or_imported(
    read: Callable[[], T], folder: Path, file: str, kind: str, own: Collection[str], settings: Mapping[str, Any] | None
) -> T | tuple[Columns, Imported]:
    """Return what `read` makes of a file of the project's own, or else the columns of its import."""
    if settings is not None or file.endswith(IMPORTED):
        return _imported(folder, [file], kind, settings or {})
    return _or_imported(read, folder, file, own, lambda: _imported(folder, [file], kind, {}))


def _or_imported(
    read: Callable[[], T],
    folder: Path,
    file: str,
    own: Collection[str],
    imported: Callable[[], tuple[Columns, Imported]],
) -> T | tuple[Columns, Imported]:
    """Return the project's own reading of a file, and that of a laboratory's for one without a column of its own."""
    if _has_column(folder / file, own):
        return read()
    from softnlp.laboratory.choices import AskError, NamedError, NoHeaderError

    try:
        return imported()
    except NoHeaderError:
        return read()
    except (AskError, NamedError):
        raise
    except InputError:
        return read()


def _has_column(path: Path, own: Collection[str]) -> bool:
    """Whether the first row of a file has a column of the project's own, or the file is not there at all."""
    try:
        if not path.is_file():  # nor is a pipe opened
            return True
        with open(path, "rb") as file:
            head = file.read(20_000).decode("utf-8-sig", errors="replace")
    except (OSError, ValueError):
        return True
    try:
        _, first = next(csv_rows(head), (0, []))
    except InputError:
        return False
    # with another separator too: its message says what is wrong
    cells = {part.strip() for cell in first for part in re.split(r"[;\t]", cell)}
    return bool(cells & set(own))


def _imported(folder: Path, files: Sequence[str], kind: str, settings: Mapping[str, Any]) -> tuple[Columns, Imported]:
    """Import files and return their columns as text, as if they stood in the project's own CSV."""
    from softnlp.laboratory.choices import AskError, flat
    from softnlp.laboratory.importing import import_files
    from softnlp.laboratory.recipe import read_recipe

    label = one_line(", ".join(files), LONGEST_NAME)
    try:
        if len(files) == 1 and files[0].endswith(IMPORTED):
            recipe = read_recipe(folder / files[0])
            if recipe.kind != kind:
                raise InputError(f"expected an import of kind {kind!r}, got {recipe.kind!r}", source=label)
            with located(source=label):
                imported = recipe.run()
        else:
            with located(source=label):
                imported = import_files(list(files), kind, flat(settings), folder)
    except AskError as error:
        source = None if error.message.startswith(label) else error.source or label
        raise type(error)(f"{error.message}{_INLINE}", source=source, key=error.key) from None
    header, *rows = (tuple(line.split(",")) for line in imported.csv().splitlines())
    return Columns(label, header, tuple(rows), tuple(range(2, len(rows) + 2))), imported


def import_notes(imported: Imported) -> tuple[str, ...]:
    """Return what an import guessed, what it left out, and what its checks say."""
    name = ", ".join(imported.files)
    guesses = tuple(f"{name}: {g.key} = {g.value} was guessed: {g.reason}" for g in imported.choices.guesses)
    dropped = tuple(f"{name}: left out {count} {reason}" for reason, count in imported.choices.dropped.items())
    return (*guesses, *dropped, *(f"{name}: {note}" for note in imported.choices.notes), *imported.warnings)
