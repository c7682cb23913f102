"""A CSV file of measurements: columns by name, blank cells where nothing was measured, others passed through."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from math import isfinite
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError, listed, located
from softnlp.base.ranges import range_of
from softnlp.base.reading import LONGEST_NAME, did_you_mean, one_line, read_text, shown

Array = NDArray[np.float64]

TIME_COLUMN = "t_s"
MOST_COLUMNS = 2000


def csv_rows(text: str) -> Iterator[tuple[int, list[str]]]:
    """Yield each row that is not blank with the line it ends on, counted from 1."""
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        for row in reader:
            if len(row) > MOST_COLUMNS:
                problem = f"expected at most {MOST_COLUMNS} columns, got {len(row)}"
                raise InputError(f"line {reader.line_num}: {problem}")
            if any(row) and any(cell.strip() for cell in row):
                yield reader.line_num, row
    except csv.Error as error:
        raise InputError(f"line {reader.line_num}: not valid CSV: {one_line(str(error))}") from None


@dataclass(frozen=True, eq=False)
class Columns:
    """The cells of a file as text. file : as it was named. lines : of each row, counted from 1."""

    file: str
    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    lines: tuple[int, ...]

    def __contains__(self, name: str) -> bool:
        return name in self.header

    def text(self, name: str) -> list[str]:
        """Return the cells of a column, "" where the file has no such column."""
        if name not in self.header:
            return [""] * len(self.rows)
        at = self.header.index(name)
        return [row[at].strip() for row in self.rows]

    def numbers(self, name: str, *, blank: bool = False) -> Array:
        """Return a column as numbers; nan where a cell is blank, if it may be, or where there is no such column.

        Raises `InputError` naming file, line and column of the first cell that is no finite number in its range.
        """
        values = np.full(len(self.rows), np.nan)
        if name not in self.header:
            return values
        for k, cell in enumerate(self.text(name)):
            if blank and cell.lower() in ("", "nan"):
                continue
            try:
                values[k] = float(cell)
            except ValueError:
                raise self.wrong(k, name, f"expected a number, got {shown(cell)}") from None
            if not isfinite(values[k]) or "_" in cell:
                raise self.wrong(k, name, f"expected a finite number, got {shown(cell)}")
        if (limits := range_of(name)) is not None:
            for k in np.flatnonzero(~(limits.holds(values) | np.isnan(values)))[:1]:
                raise self.wrong(int(k), name, limits.refusal(float(values[k])))
        return values

    def wrong(self, row: int, name: str, message: str) -> InputError:
        """Return an error about a cell."""
        return InputError(f"line {self.lines[row]}: {name}: {message}", source=self.file)


def read_columns(folder: Path, file: str, needed: Collection[str] = ()) -> Columns:
    """Return the columns of a CSV file.

    Raises `InputError` of the file for one that cannot be read, a column that is missing or given twice, a
    row of another length, or no row.
    """
    label = one_line(file, LONGEST_NAME)
    with located(source=label):
        return _columns(label, list(csv_rows(read_text(folder / file))), needed)


def _columns(label: str, rows: list[tuple[int, list[str]]], needed: Collection[str]) -> Columns:
    if len(rows) < 2:
        got = "the header alone" if rows else "an empty file"
        raise InputError(f"expected a header and rows of numbers, at least one row, got {got}")
    header = tuple(one_line(name.strip(), LONGEST_NAME) for name in rows[0][1])
    if len(header) == 1 and re.search(r"[;\t]", rows[0][1][0].strip()):
        got = shown(rows[0][1][0].strip())
        raise InputError(f"expected columns separated by commas, and a decimal point in numbers, got {got}")
    for name in header:
        if name and header.count(name) > 1:
            raise InputError(f"expected each column once, got {shown(name)} {header.count(name)} times")
    for name in needed:
        if name not in header:
            raise InputError(f"missing column {name!r}; it has {listed(header)}{did_you_mean(name, header)}")
    for line, row in rows[1:]:
        if len(row) != len(header):
            raise InputError(f"line {line}: expected {len(header)} values as in the header, got {len(row)}")
    cells = tuple(tuple(row) for _, row in rows[1:])
    return Columns(label, header, cells, tuple(line for line, _ in rows[1:]))
