"""Pressures of a scenario, step by step: a list, a ramp or a CSV file; over time, with a force at the tip beside."""

from __future__ import annotations

from array import array
from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softnlp.base.csv_columns import TIME_COLUMN, csv_rows
from softnlp.base.errors import InputError, located
from softnlp.base.ranges import FORCE, READING, TIME, noise_note, unit_note, without_noise
from softnlp.base.reading import LONGEST_NAME, did_you_mean, one_line, read_text, shown
from softnlp.base.units import BAR
from softnlp.scenario.laboratory import import_notes, or_imported
from softnlp.scenario.schema import PRESSURE_SOURCES, PressureTable, RampTable

Array = NDArray[np.float64]

FORCES = ("fx_N", "fy_N", "fz_N")
"""Columns of a force at the tip over time, world frame."""
_A_LOG, _REGULAR = 20, 0.9  # rows of a log at least, and the part of them that are one interval apart


class PressurePath(NamedTuple):
    """pressures : (steps, sets) [Pa]. times : (steps,) [s], or None when the source has none. notes : on readings.

    forces : (steps, 3) at the tip [N], or None.
    """

    pressures: Array
    times: Array | None
    notes: tuple[str, ...] = ()
    forces: Array | None = None


def pressure_path(table: PressureTable, sets: int, folder: Path, *, over_time: bool = False) -> PressurePath:
    """Return the pressures of every step.

    Parameters
    ----------
    table : [pressure] of the scenario.
    sets : chamber sets of the robot, one column each.
    folder : where a relative `file` is looked for.
    over_time : whether rows are instants of a series, with a force at the tip perhaps.

    Raises
    ------
    InputError
        With the key (no table, no source), when not exactly one source is given or it does not fit the robot.
    """
    sources = [name for name in PRESSURE_SOURCES if name in type(table).model_fields]
    given = table.written(sources)
    if len(given) != 1:
        raise InputError(
            f"expected exactly one of {', '.join(sources)}, got {' and '.join(given) or 'none'}",
            key=given[1] if given else None,
        )
    if table.sequence_bar is not None:
        return _path(_sequence(table.sequence_bar, sets))
    if table.ramp is not None:
        return PressurePath(_ramp(table.ramp, sets), None)
    file = table.file
    assert file is not None

    def own() -> PressurePath:
        with located(source=one_line(file, LONGEST_NAME)):
            return _csv(read_text(folder / file), sets, over_time=over_time)

    settings = getattr(table, "import")
    found = or_imported(own, folder, file, "pressure", [f"p{k}_bar" for k in range(1, sets + 1)], settings)
    if isinstance(found, PressurePath):
        return found
    columns, imported = found
    with located(source=columns.file):
        path = _csv(imported.csv(), sets, over_time=over_time)
    return path._replace(notes=(*import_notes(imported), *path.notes))


def _path(readings: Array, times: Array | None = None) -> PressurePath:
    """Return the path of readings [bar], noise below 0 taken as 0."""
    return PressurePath(without_noise(readings) * BAR, times, noise_note(readings))


def _sequence(rows: list[list[float]], sets: int) -> Array:
    """One row a step, one column a set."""
    for number, row in enumerate(rows, start=1):
        if len(row) != sets:
            raise InputError(
                f"row {number}: expected {sets} pressures, one for each chamber set, got {len(row)}",
                key="sequence_bar",
            )
    return np.array(rows, dtype=float)


def require_sets(chosen: Sequence[int], sets: int, key: str) -> None:
    """Refuse chamber sets, counted from 1, that the robot does not have or that are named twice."""
    for number, one in enumerate(chosen, start=1):
        if not 1 <= one <= sets:
            raise InputError(f"item {number}: expected a chamber set from 1 to {sets}, got {shown(one)}", key=key)
        if one in chosen[: number - 1]:
            raise InputError(f"item {number}: expected each chamber set once, got {one} twice", key=key)


def _ramp(ramp: RampTable, sets: int) -> Array:
    """Equal steps from one pressure to another in the named sets, zero in the others."""
    require_sets(ramp.sets, sets, "ramp.sets")
    pressures = np.zeros((ramp.steps, sets))
    pressures[:, [chosen - 1 for chosen in ramp.sets]] = np.linspace(ramp.from_bar, ramp.to_bar, ramp.steps)[:, None]
    return pressures * BAR


def _csv(text: str, sets: int, *, over_time: bool = False) -> PressurePath:
    """Read a header of t_s (optional) and one column a set, in any order, and one row a step.

    over_time : t_s is needed then, and fx_N, fy_N, fz_N may be there.
    """
    rows = csv_rows(text)
    line, header = next(rows, (1, []))
    if not header:
        raise InputError(f"expected a header {_names(sets)} and rows of numbers, got an empty file")
    found, notes = _columns(header, sets, line, FORCES if over_time else ())
    used = sorted(found.values())
    columns = {name: used.index(place) for name, place in found.items()}
    names = [header[place] for place in used]
    values, lines = array("d"), array("l")
    for line, row in rows:
        if len(row) != len(header):
            raise InputError(f"line {line}: expected {len(header)} values as in the header, got {len(row)}")
        cells = [row[place] for place in used] if len(used) < len(header) else row
        try:
            values.extend(map(float, cells))
        except ValueError:
            raise _not_a_number(line, names, cells) from None
        lines.append(line)
    if not lines:
        raise InputError("expected at least one row of numbers below the header, got none")
    table = np.frombuffer(values).reshape(-1, len(used))
    if text.count("_") > sum(name.count("_") for name in header):  # Python reads 1_5 as 15
        for line, row in list(csv_rows(text))[1:]:
            if any("_" in row[place] for place in used):
                raise _not_a_number(line, names, [row[place] for place in used])
    _require_possible(table, lines, columns)
    pressures = table[:, [columns[name] for name in columns if name != TIME_COLUMN and name not in FORCES]]
    path = _path(pressures, table[:, columns[TIME_COLUMN]].copy() if TIME_COLUMN in columns else None)
    if over_time and path.times is not None:
        require_no_gap(path.times, lines)
    if forces := [name for name in FORCES if name in columns]:
        acting = np.zeros((len(table), 3))
        acting[:, [FORCES.index(name) for name in forces]] = table[:, [columns[name] for name in forces]]
        path = path._replace(forces=acting)
    return path._replace(notes=(*path.notes, *notes, *unit_note(pressures)))


def require_no_gap(times: Array, lines: Sequence[int]) -> None:
    """Refuse a log with a gap: rows as regular as a clock, and then none for three of their intervals or more."""
    apart = np.diff(times)
    usual = float(np.median(apart)) if apart.size >= _A_LOG else 0.0
    if usual <= 0 or np.mean(np.abs(apart - usual) <= 0.1 * usual) < _REGULAR:
        return
    for row in np.flatnonzero(apart >= 3 * usual)[:1] + 1:
        raise InputError(
            f"line {lines[row]}: {TIME_COLUMN}: expected a row every {usual:g} s as in the others, got a gap of "
            f"{apart[row - 1]:g} s; fill it with rows, or take fewer rows of your own"
        )


def _columns(header: list[str], sets: int, line: int, more: Sequence[str]) -> tuple[dict[str, int], tuple[str, ...]]:
    """Return the position of each column, pressures in the order of the sets, and a word on what looks like one."""
    names = [name.strip() for name in header]
    expected = [TIME_COLUMN, *(f"p{k}_bar" for k in range(1, sets + 1))]
    for name in names:
        if name not in expected and (_is_set(name) or not set(expected[1:]) <= set(names)):
            if len(names) == 1 and (";" in name or "\t" in name):
                raise InputError(f"line {line}: expected columns separated by commas, got {shown(name)}")
            hint = did_you_mean(name, expected)
            raise InputError(f"line {line}: expected a header {_names(sets)}, got a column {shown(name)}{hint}")
        if names.count(name) > 1:
            raise InputError(f"line {line}: expected each column once, got {name!r} {names.count(name)} times")
    for name in expected[1:]:
        if name not in names:
            raise InputError(f"line {line}: missing column {name!r}; expected a header {_names(sets)}")
    stems = {known.rpartition("_")[0].lower(): known for known in expected}
    like = [(name, stems.get(name.rpartition("_")[0].lower())) for name in names if name not in (*expected, *more)]
    notes = tuple(f"column {shown(name)} is not used, but {known!r}" for name, known in like if known in names)
    return {name: names.index(name) for name in (*expected, *more) if name in names}, notes


def _is_set(name: str) -> bool:
    """Whether a column is of a chamber set, such as one that the robot does not have."""
    return name.startswith("p") and name.endswith("_bar") and name[1:-4].isdecimal()


def _require_possible(table: Array, lines: array[int], columns: dict[str, int]) -> None:
    """Raise InputError for the first value that is not finite, outside its range, or back in time."""
    known = {TIME_COLUMN: TIME, **dict.fromkeys(FORCES, FORCE)}
    limits = {p: known.get(name, READING) for name, p in columns.items()}
    wrong = np.column_stack([~limits[p].holds(table[:, p]) for p in range(table.shape[1])])
    for row, position in np.argwhere(wrong)[:1]:
        value = float(table[row, position])
        name = next(n for n, p in columns.items() if p == position)
        problem = limits[position].refusal(value) if isfinite(value) else f"expected a finite number, got {value}"
        raise InputError(f"line {lines[row]}: {name}: {problem}")
    if TIME_COLUMN in columns:
        times = table[:, columns[TIME_COLUMN]]
        for row in np.flatnonzero(np.diff(times) < 0)[:1] + 1:
            raise InputError(
                f"line {lines[row]}: {TIME_COLUMN}: expected a time of at least {times[row - 1]:g}, as in the row "
                f"before, got {times[row]:g}"
            )


def _not_a_number(line: int, header: list[str], row: list[str]) -> InputError:
    """Name the first cell of a row that is not a number."""
    for name, cell in zip(header, row, strict=True):
        try:
            float(cell)
            readable = "_" not in cell
        except ValueError:
            readable = False
        if not readable:
            return InputError(f"line {line}: {name.strip()}: expected a number, got {shown(cell)}")
    raise AssertionError("called for a row of numbers")


def _names(sets: int) -> str:
    """Return the header that a file for a robot has."""
    names = [f"p{k}_bar" for k in range(1, sets + 1)]
    shortened = names if sets <= 6 else [names[0], names[1], "...", names[-1]]
    return ", ".join([TIME_COLUMN, *shortened])
