"""Measured tip positions at pressures: the CSV file of a workspace test."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass
from math import isfinite
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softnlp.errors import InputError
from softnlp.pressures import HIGHEST_BAR, TIME_COLUMN, UNIT_HINT
from softnlp.reading import did_you_mean, one_line, read_text, shown
from softnlp.units import BAR, MILLIMETRE

Array = NDArray[np.float64]

TIP_COLUMNS = ("x_mm", "y_mm", "z_mm")


@dataclass(frozen=True, eq=False)
class Measured:
    """M measured tips, in the world frame of the robot's base.

    pressure : (M, sets) [Pa]. tip_position : (M, 3) [m]. time : (M,) [s] or None. header, cells : of the M rows as they
    stand in the file, other columns among them. skipped : how many rows with a blank were left out.
    """

    file: Path
    pressure: Array
    tip_position: Array
    time: Array | None
    header: tuple[str, ...]
    cells: tuple[tuple[str, ...], ...]
    skipped: int


def load_measured(path: str | PathLike[str], sets: int) -> Measured:
    """Read columns t_s (optional), p1_bar, …, x_mm, y_mm, z_mm and any others, in any order.

    A row with a blank in one of the named columns is left out and counted.

    Raises
    ------
    InputError
        On one line with the file, the line and the column, when a column is missing or a value impossible.
    """
    file = Path(path)
    try:
        return _measured(file, read_text(file), sets)
    except InputError as error:
        raise error.located(source=one_line(str(file))) from None


def _measured(file: Path, text: str, sets: int) -> Measured:
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        rows = [(reader.line_num, row) for row in reader if any(cell.strip() for cell in row)]
    except csv.Error as error:
        raise InputError(f"line {reader.line_num}: not valid CSV: {one_line(str(error))}") from None
    expected = [*(f"p{k + 1}_bar" for k in range(sets)), *TIP_COLUMNS]
    if not rows:
        raise InputError(f"expected a header {', '.join(expected)} and rows of numbers, got an empty file")
    (line, first), *rows = rows
    header = [name.strip() for name in first]
    for name in expected:
        if name not in header:
            near = did_you_mean(name, header)
            raise InputError(f"line {line}: missing column {name!r}; expected {', '.join(expected)}{near}")
    for name in header:
        if name and header.count(name) > 1:
            raise InputError(f"line {line}: expected each column once, got {shown(name)} {header.count(name)} times")
    extra_set = f"p{sets + 1}_bar"
    if extra_set in header:
        raise InputError(f"line {line}: expected pressures of {sets} chamber sets, got a column {extra_set!r}")
    needed = expected + [TIME_COLUMN] * (TIME_COLUMN in header)
    places = [header.index(name) for name in needed]
    values, cells, skipped = [], [], 0
    for line, row in rows:
        if len(row) != len(header):
            raise InputError(f"line {line}: expected {len(header)} values as in the header, got {len(row)}")
        if any(not row[place].strip() for place in places):
            skipped += 1
            continue
        values.append([_number(line, name, row[place]) for name, place in zip(needed, places, strict=True)])
        cells.append(tuple(row))
    if not values:
        blank = f"; {skipped} rows have blanks" if skipped else ""
        raise InputError(f"expected at least one row of numbers below the header, got none{blank}")
    table = np.array(values)
    return Measured(
        file=file,
        pressure=table[:, :sets] * BAR,
        tip_position=table[:, sets : sets + 3] * MILLIMETRE,
        time=table[:, sets + 3] if TIME_COLUMN in header else None,
        header=tuple(header),
        cells=tuple(cells),
        skipped=skipped,
    )


def _number(line: int, name: str, cell: str) -> float:
    """Return a cell as a number that its column may hold."""
    try:
        value = float(cell)
    except ValueError:
        value = float("nan")
    if "_" in cell or not isfinite(value):  # Python reads 1_5 as 15
        raise InputError(f"line {line}: {name}: expected a finite number, got {shown(cell.strip())}")
    if name.endswith("_bar") and value < 0:
        raise InputError(f"line {line}: {name}: expected a gauge pressure of at least 0, got {value:g}")
    if name.endswith("_bar") and value > HIGHEST_BAR:
        raise InputError(f"line {line}: {name}: expected at most {HIGHEST_BAR:g} bar, got {value:g}; {UNIT_HINT}")
    return value
