"""From files to measurements: what they hold, by the names of their columns, or as asked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from softnlp.base.errors import InputError, listed
from softnlp.base.reading import choices as quoted
from softnlp.base.reading import shown
from softnlp.laboratory.choices import AskError, Choices
from softnlp.laboratory.formats import read_tables
from softnlp.laboratory.imported import Imported
from softnlp.laboratory.loads import import_force, is_force
from softnlp.laboratory.pressure import has_sets, import_pressure
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
    unused = [name for table in tables for name in table.names if (table.file, name) not in choices.read]
    if unused:
        choices.say(f"columns that are not used: {listed(dict.fromkeys(unused))}")
    return imported


def kind_of(tables: Sequence[RawTable], choices: Choices) -> str:
    """Return the kind that the columns of some files have; raises `AskError` where they tell none, or several.

    Files of tips and forces may hold pressures too, or come with a log of them.
    """
    fits = {"tips": is_tips, "tensile": is_tensile, "force": is_force, "pressure": has_sets}
    for table in tables:
        possible = [kind for kind, fit in fits.items() if fit(table)]
        if len(possible) > 1 and possible not in (["tips", "pressure"], ["force", "pressure"]):
            raise AskError(f"{_columns_of(table)} could be {' or '.join(possible)}; say --as {', '.join(possible)}")
    for kind, fit in fits.items():
        if any(fit(table) for table in tables):
            choices.take("as", kind, "by the names of its columns")
            return kind
    raise AskError(f"{_columns_of(tables[0])} do not tell what it is; say --as {', '.join(KINDS)}")


def _columns_of(table: RawTable) -> str:
    return f"{table.file}: the columns {', '.join(shown(name) for name in table.names[:12])}"
