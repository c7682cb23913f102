"""Measured tip positions at pressures: the CSV file of a workspace test."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from softnlp.base.arrays import Array
from softnlp.base.columns import OUTPUTS
from softnlp.base.csv_columns import TIME_COLUMN, read_columns
from softnlp.base.errors import InputError
from softnlp.base.ranges import noise_note, unit_note, without_noise
from softnlp.base.units import BAR, MILLIMETRE

TIP_COLUMNS = tuple(OUTPUTS[f"tip_{x}"].measured for x in "xyz")


@dataclass(frozen=True, eq=False)
class Measured:
    """M measured tips, in the world frame of the robot's base.

    pressure : (M, sets) [Pa]. tip_position : (M, 3) [m]. time : (M,) [s] or None. header, cells : of the M rows as they
    stand in the file, other columns among them. skipped : how many rows with a blank were left out.
    notes : of readings that count as 0.
    """

    file: Path
    pressure: Array
    tip_position: Array
    time: Array | None
    header: tuple[str, ...]
    cells: tuple[tuple[str, ...], ...]
    skipped: int
    notes: tuple[str, ...] = ()


def load_measured(path: str | PathLike[str], sets: int) -> Measured:
    """Read columns t_s (optional), p1_bar, …, x_mm, y_mm, z_mm and any others, in any order.

    A row with a blank in one of the named columns is left out and counted.

    Raises
    ------
    InputError
        On one line with the file, the line and the column, when a column is missing or a value impossible.
    """
    file = Path(path)
    needed = [*(f"p{k + 1}_bar" for k in range(sets)), *TIP_COLUMNS]
    columns = read_columns(Path(), str(file), needed)
    if (extra_set := f"p{sets + 1}_bar") in columns:
        raise InputError(f"expected pressures of {sets} chamber sets, got a column {extra_set!r}", source=columns.file)
    needed += [TIME_COLUMN] * (TIME_COLUMN in columns)
    table = np.column_stack([columns.numbers(name, blank=True) for name in needed])
    full = np.isfinite(table).all(axis=1)
    skipped = int(np.sum(~full))
    if not full.any():
        problem = f"expected at least one row of numbers, got none; {skipped} rows have blanks"
        raise InputError(problem, source=columns.file)
    return Measured(
        file=file,
        pressure=without_noise(table[full, :sets]) * BAR,
        tip_position=table[full, sets : sets + 3] * MILLIMETRE,
        time=table[full, sets + 3] if TIME_COLUMN in columns else None,
        header=columns.header,
        cells=tuple(columns.rows[k] for k in np.flatnonzero(full)),
        skipped=skipped,
        notes=(*noise_note(table[full, :sets]), *unit_note(table[full, :sets])),
    )
