"""Excel workbooks (.xlsx) by openpyxl; only values are read, and a zip that would grow too large is refused first."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator
from datetime import datetime, time
from typing import Any

from softnlp.base.csv_columns import MOST_COLUMNS
from softnlp.base.errors import InputError, listed
from softnlp.base.reading import one_line, shown
from softnlp.laboratory.cells import is_number
from softnlp.laboratory.choices import Choices
from softnlp.laboratory.table import RawTable
from softnlp.laboratory.text import cells_table

_LARGEST, _GROWTH = 150_000_000, 300  # bytes of all parts together, and that over the size of the archive
_MOST_ROWS = 300_000
_TOO_MANY = f"expected at most {_MOST_ROWS} rows in a sheet; write it as .csv"


def workbook_tables(label: str, content: bytes, choices: Choices) -> list[RawTable]:
    """Return the table of the sheet that is asked for, or of the one with the most numbers.

    Raises
    ------
    InputError
        For an archive that is no workbook, one that is too large unpacked, and one without rows of numbers.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            parts = archive.infolist()
            size = sum(part.file_size for part in parts)
            names = {part.filename for part in parts}
            if "xl/workbook.xml" not in names:
                raise InputError("this is a zip archive and no workbook; unpack it first")
            if size > _LARGEST or size > max(1_000_000, _GROWTH * len(content)):
                raise InputError(
                    f"the workbook would take {size / 1e6:.4g} MB unpacked, from {len(content) / 1e6:.4g} MB"
                )
            plain = io.BytesIO()  # without compression, so that nothing in it is larger than it says
            with zipfile.ZipFile(plain, "w") as copy:
                for part in parts:
                    copy.writestr(part.filename, _text_of(archive, part))
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, OSError) as error:
        raise InputError(f"not a valid workbook: {one_line(str(error), 80)}") from None
    sheets = _sheets(plain)
    asked = choices.get("sheet")
    if asked is not None and asked not in sheets:
        raise InputError(f"expected {listed(sheets)}, got {shown(asked)}", key="sheet")
    counts = {name: sum(is_number(c, ".") for row in rows for c in row) for name, rows in sheets.items()}
    chosen = asked if asked is not None else max(counts, key=lambda name: counts[name])
    if asked is None and sum(count > 0 for count in counts.values()) > 1:
        choices.take("sheet", chosen, f"it holds the most numbers of {listed(sheets)}")
    return [cells_table(label, sheets[chosen], choices)]


def _text_of(archive: zipfile.ZipFile, part: zipfile.ZipInfo) -> bytes:
    """Return a part; raises `InputError` for one that declares entities, or has more rows than are read."""
    with archive.open(part) as opened:
        text = opened.read(part.file_size)
    if b"<!DOCTYPE" in text[:2000].upper():
        raise InputError("the workbook declares entities, which none that Excel writes does")
    if text.count(b"<row") > _MOST_ROWS:
        raise InputError(_TOO_MANY)
    return text


def _sheets(content: io.BytesIO) -> dict[str, list[list[str]]]:
    """Return the cells of every sheet as text."""
    try:
        from openpyxl import load_workbook
    except ImportError:
        raise InputError("a workbook needs openpyxl: pip install 'softnlp[lab]'") from None
    try:
        book = load_workbook(content, read_only=True, data_only=True, keep_links=False)
        return {sheet.title: list(_rows(sheet)) for sheet in book.worksheets}
    except InputError:
        raise
    except Exception as error:  # openpyxl raises what its XML parser does, and KeyError, ValueError or TypeError
        raise InputError(f"not a valid workbook: {one_line(f'{type(error).__name__}: {error}', 80)}") from None


def _rows(sheet: Any) -> Iterator[list[str]]:
    # A sheet may claim a million columns; what it says of its size is not believed.
    sheet.reset_dimensions()
    for count, row in enumerate(sheet.iter_rows(values_only=True)):
        if count >= _MOST_ROWS:
            raise InputError(_TOO_MANY)
        if len(row) > MOST_COLUMNS:
            raise InputError(f"sheet {shown(sheet.title)}: expected at most {MOST_COLUMNS} columns, got {len(row)}")
        yield [_cell(value) for value in row]


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, datetime | time):
        return value.isoformat()
    return repr(float(value)) if isinstance(value, int | float) else one_line(str(value), 200)
