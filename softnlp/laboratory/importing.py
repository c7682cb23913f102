"""From files to measurements: what they hold, by the names of their columns, or as asked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from softnlp.base.errors import InputError
from softnlp.base.reading import choices as quoted
from softnlp.base.reading import shown
from softnlp.laboratory.choices import AskError, Choices
from softnlp.laboratory.formats import read_tables
from softnlp.laboratory.imported import Imported
from softnlp.laboratory.loads import import_force, is_force
from softnlp.laboratory.pressure import import_pressure, is_pressure
from softnlp.laboratory.table import RawTable
from softnlp.laboratory.tensile import import_tensile, is_tensile
from softnlp.laboratory.tips import import_tips, is_tips

KINDS = ("tensile", "pressure", "tips", "force")


def import_files(
    files: Sequence[str], kind: str | None = None, settings: Mapping[str, Any] | None = None, folder: Path = Path()
) -> Imported:
    """Read files as machines wrote them.

    Parameters
    ----------
    files
        Of one test; tips and forces may come with the log of the pressures.
    kind
        Of `KINDS`, or None for what the columns' names say.
    settings
        By key, as docs/import.md lists them; each decides what would be guessed or asked.
    folder
        Where relative files are looked for.

    Returns
    -------
    Imported
        Columns under the names that scenarios take, with checks, guesses and what was left out.

    Raises
    ------
    AskError
        Where the files can be read in more than one way, or lack a number.
    InputError
        For files that cannot be read, and settings that do not fit or that nothing asked for.
    """
    if kind is not None and kind not in KINDS:
        raise InputError(f"expected {quoted(KINDS)}, got {shown(kind)}", key="--as")
    if not files:
        raise InputError("expected a file", key="FILE")
    choices = Choices(dict(settings or {}))
    tables = [table for file in files for table in read_tables(folder, file, choices)]
    chosen = kind or kind_of(tables, choices)
    made = {"tensile": import_tensile, "pressure": import_pressure, "tips": import_tips, "force": import_force}[chosen]
    imported = made(tables, choices)
    choices.require_used()
    return imported


def kind_of(tables: Sequence[RawTable], choices: Choices) -> str:
    """Return the kind that the columns of some files have; raises `AskError` where they tell none."""
    for kind, fits in (("tips", is_tips), ("tensile", is_tensile), ("force", is_force), ("pressure", is_pressure)):
        if any(fits(table) for table in tables):
            choices.take("as", kind, "by the names of its columns")
            return kind
    names = ", ".join(shown(name) for name in tables[0].names[:12])
    raise AskError(f"{tables[0].file}: what is it? Its columns are {names}; say --as {', '.join(KINDS)}")
