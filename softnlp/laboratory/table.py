"""A file as a table: columns with names and units, and what stands above them."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import takewhile
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError, listed
from softnlp.base.reading import LONGEST_NAME, one_line, shown
from softnlp.laboratory.cells import is_number, number
from softnlp.laboratory.choices import AskError, Choices, NoHeaderError
from softnlp.laboratory.units import Unit, nearest_unit, split_unit, unit_named, unknown_unit

Array = NDArray[np.float64]

SKIP = "-"
_KINDS_OF_AXES = re.compile(r"^(position|rotation|orientation)$", re.IGNORECASE)
_BRACKET = re.compile(r"\s*[(\[{<][^()\[\]{}<>]*[)\]}>]$")
_COUNTS_ON = re.compile(r"time|zeit|^t$|index|^(no|nr|row|reading|sample|scan|frame|point)s?\b", re.IGNORECASE)
_MOST_SUMMED = 8  # rows of a summary: mean, deviation, least, largest, count and the like
_ONE_CELL = re.compile(r"^(.+?)\s*[:=]\s*([+-]?[\d.,]+(?:[eE][+-]?\d+)?)\s*(\S*)$")


class Header(NamedTuple):
    """names : of the columns as they stand there, none where there is no header. units : of a row of units below."""

    names: tuple[str, ...]
    units: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class RawTable:
    """What a file holds.

    file : as it was named. names, units : of each column. columns : numbers, nan where a cell is missing, or texts.
    repeat : (rows,) how often the header stood above a row again. values : of the preamble, by its label in lower case,
    with their units. preamble : its lines. later : the values above each repeat of the header.
    results : of a label of the preamble with a column of several numbers below it, all of them.
    """

    file: str
    names: tuple[str, ...]
    units: tuple[Unit | None, ...]
    columns: tuple[Any, ...]
    repeat: Array
    values: Mapping[str, tuple[float, Unit | None]]
    preamble: tuple[str, ...]
    later: tuple[Mapping[str, tuple[float, Unit | None]], ...] = ()
    results: Mapping[str, tuple[float, ...]] = field(default_factory=dict)

    @property
    def rows(self) -> int:
        """How many rows of numbers there are."""
        return len(self.repeat)

    def is_number(self, k: int) -> bool:
        """Whether a column holds numbers."""
        return isinstance(self.columns[k], np.ndarray)

    def named(self, pattern: str, without: str = "$.") -> list[int]:
        """Return the columns of numbers whose names a pattern is found in, in any case, and another is not."""
        wanted, other = re.compile(pattern, re.IGNORECASE), re.compile(without, re.IGNORECASE)
        return [
            k
            for k, name in enumerate(self.names)
            if self.is_number(k) and wanted.search(name) and not other.search(name)
        ]

    def kept(self, rows: Array | NDArray[np.bool_] | NDArray[np.intp]) -> RawTable:
        """Return the table with some of its rows."""
        where = np.asarray(rows)
        index = np.flatnonzero(where) if where.dtype == bool else where.astype(int)
        columns = tuple(c[index] if isinstance(c, np.ndarray) else [c[int(k)] for k in index] for c in self.columns)
        return replace(self, columns=columns, repeat=self.repeat[index])

    def block(self, k: int) -> RawTable:
        """Return the rows below a repeat of the header, 0 for the first, with the values of its own preamble."""
        own = self.later[k - 1] if 0 < k <= len(self.later) else {}
        return replace(self.kept(self.repeat == k), values={**self.values, **own}, later=())

    def only(self, chosen: Sequence[int]) -> RawTable:
        """Return the table with some of its columns."""
        pick = [(self.names[k], self.units[k], self.columns[k]) for k in chosen]
        names, units, columns = zip(*pick, strict=True)
        return replace(self, names=names, units=units, columns=columns)

    def value(self, *patterns: str) -> tuple[str, float, Unit | None] | None:
        """Return the first value of the preamble whose label one of some patterns is found in."""
        for pattern in patterns:
            for label, (found, unit) in self.values.items():
                if re.search(pattern, label):
                    return label, found, unit
        return None


def header_rows(before: Sequence[Sequence[str]], width: int) -> Header:
    """Return the names and units above a block of numbers; before : the rows above it."""
    filled = [_stripped(row) for row in before if any(row)]
    if not filled:
        return Header((), ())
    units: list[str] = []
    last = filled[-1]
    if len(filled) > 1 and _are_units(last, filled[-2]):
        units, last = last, filled[-2]
    above = filled[-3 if units else -2] if len(filled) > (2 if units else 1) else []
    if len(set(last)) < len(last) and any(_KINDS_OF_AXES.search(cell) for cell in above):
        # axes under the words rotation and position, as motion capture writes them
        last = [f"{above[k]} {cell}".strip() if k < len(above) else cell for k, cell in enumerate(last)]
    if units == [] and len(last) > width:
        last = _joined(last, width)
    words = [c for c in last if c]
    named = sum(not is_number(c, ".") for c in words)
    if not words or 2 * named < len(words) or (len(words) < max(1, width - 2) and len(last) < width):
        return Header((), ())
    return Header(tuple(last), tuple(units))


def _are_units(row: Sequence[str], above: Sequence[str]) -> bool:
    """Whether a row holds the units of the names above it; one of them may be unknown, or a word for a count."""
    cells = [cell for cell in row if cell]
    known = sum(unit_named(cell) is not None for cell in cells)
    return known > 0 and len(cells) <= len(above) and (known == len(cells) or (known > 1 and known + 1 == len(cells)))


def _stripped(row: Sequence[str]) -> list[str]:
    cells = [cell.strip() for cell in row]
    while cells and not cells[-1]:
        cells.pop()
    if cells and cells[0][:1] in ("#", "%") and (cells[0] != "%" or any(unit_named(c) is None for c in cells)):
        cells[0] = cells[0].lstrip("#% ")
        if not cells[0]:
            cells.pop(0)
    return cells


def _joined(cells: Sequence[str], width: int) -> list[str]:
    """Return names that blanks have cut, a unit in brackets with its name, if they then are as many as columns."""
    found: list[str] = []
    for cell in cells:
        if found and cell[:1] in "([":
            found[-1] = f"{found[-1]} {cell}"
        else:
            found.append(cell)
    return found if len(found) == width else list(cells)


def assembled(
    label: str,
    header: Header,
    before: Sequence[Sequence[str]],
    pieces: Sequence[Sequence[Any]],
    choices: Choices,
    decimal: str,
    later: Sequence[Sequence[Sequence[str]]] = (),
) -> RawTable:
    """Return the table of a file from the pieces of its columns, the last one the repeats of its header."""
    *columns, repeats = [_whole(piece) for piece in pieces]
    if not len(repeats):
        raise InputError("expected rows of numbers, got none")
    count = len(columns)
    given = choices.get("columns")
    names = list(header.names) + [f"column {k + 1}" for k in range(len(header.names), count)]
    if given is not None:
        if not isinstance(given, list) or len(given) > count or not all(isinstance(n, str) for n in given):
            raise InputError(f"expected a list of at most {count} names, '-' for one to leave out", key="columns")
        names = [*given, *names[len(given) :]]
    elif not header.names:
        raise NoHeaderError(_without_header(columns))
    spelt = dict(enumerate(header.units)) | dict(enumerate(_labview_units(before)))
    split = [split_unit(one_line(name, LONGEST_NAME)) for name in names]
    units = [unit_named(spelt.get(k, "")) or unit for k, (_, unit) in enumerate(split)]
    for k, word in spelt.items():
        if word and k < count and unit_named(word) is None and split[k][1] is None:
            split[k] = f"{split[k][0]} ({word.strip('()[]')})", None  # a unit that is not known stays with the name
    kept = [k for k in range(count) if names[k] != SKIP and not _is_blank(columns[k])]
    table = RawTable(
        file=label,
        names=tuple(split[k][0] or f"column {k + 1}" for k in kept),
        units=tuple(units[k] for k in kept),
        columns=tuple(columns[k] for k in kept),
        repeat=repeats,
        values=_values(before, decimal),
        preamble=tuple(" ".join(c for c in row if c) for row in before if any(row)),
        later=tuple(_values(above, decimal) for above in later),
        results=_results(before, decimal),
    )
    end = summary_rows(table)
    choices.drop(len(end), "rows at the end where what counted on turns back or jumps, as a summary of the rows does")
    return table.kept(np.setdiff1d(np.arange(table.rows), end)) if len(end) else table


def summary_rows(table: RawTable) -> NDArray[np.intp]:
    """Return the rows at the end of each block that are no samples.

    A column that counts on in all rows before, a time, an index or the first one but for a load, turns back or jumps
    there.
    """
    counting = [
        table.columns[k]
        for k, name in enumerate(table.names)
        if table.is_number(k)
        and (_COUNTS_ON.search(name) or (k == 0 and getattr(table.units[k], "kind", "") not in ("force", "pressure")))
    ]
    found: set[int] = set()
    for block in np.unique(table.repeat):
        rows = np.flatnonzero(table.repeat == block)
        last = min(_MOST_SUMMED, len(rows) // 4)
        for column in counting:
            steps = np.diff(column[rows])
            body = steps[: len(steps) - last]
            sign = np.sign(body[0]) if last > 2 else 0.0
            if not sign or not np.all(sign * body > 0):
                continue
            tail = sign * steps[len(steps) - last :]
            wrong = np.flatnonzero((tail < -3 * np.median(abs(body))) | (tail > 20 * np.max(abs(body))))
            if wrong.size:
                found |= set(rows[len(rows) - last + int(wrong[0]) :].tolist())
    return np.array(sorted(found), int)


def _whole(pieces: Sequence[Any]) -> Any:
    if not pieces or isinstance(pieces[0], np.ndarray):
        return np.concatenate(pieces) if pieces else np.zeros(0)
    return [cell for piece in pieces for cell in piece]


def _is_blank(column: Any) -> bool:
    return bool(np.all(np.isnan(column))) if isinstance(column, np.ndarray) else not any(column)


def _without_header(columns: Sequence[Any]) -> str:
    """Say what is in columns that have no names."""
    told = []
    for k, column in enumerate(columns):
        if isinstance(column, np.ndarray) and not _is_blank(column):
            steps = np.diff(column)
            even = len(steps) > 1 and np.ptp(steps) <= 1e-6 * abs(steps[0]) and steps[0] > 0
            low, high = np.nanmin(column), np.nanmax(column)
            how = f"rises evenly by {steps[0]:g}" if even else f"{low:g} to {high:g}"
            told.append(f"column {k + 1} {how}")
    example = '["t_ms", "p1_bar", …], "-" for one to leave out'
    return f"no header names the columns ({listed(told[:8])}): name them with their units, --set columns='{example}'"


def _labview_units(before: Sequence[Sequence[str]]) -> list[str]:
    """Return the units of LabVIEW's header, one a column."""
    rows = [row for row in before if row and row[0].strip() == "Y_Unit_Label"]
    return [""] + [cell.strip() for cell in rows[-1][1:]] if rows else []


def _values(before: Sequence[Sequence[str]], decimal: str) -> dict[str, tuple[float, Unit | None]]:
    """Return the numbers of a preamble by their labels, which stand to the left of them, above, or in the same cell."""
    found: dict[str, tuple[float, Unit | None]] = {}

    def at(i: int, j: int) -> str:
        return before[i][j].strip() if i < len(before) and j < len(before[i]) else ""

    for i, row in enumerate(before):
        for j, cell in enumerate(row):
            text = cell.strip()
            if not text or is_number(text, decimal) or len(text) > 80:
                continue
            if (inside := _ONE_CELL.match(text)) and is_number(inside[2], decimal):
                label, value, unit = inside[1], inside[2], unit_named(inside[3])
            else:
                label, unit = split_unit(text.rstrip(":= "))
                if is_number(at(i, j + 1), decimal):
                    value, unit = at(i, j + 1), unit or unit_named(at(i, j + 2))
                elif is_number(at(i + 1, j), decimal):
                    value = at(i + 1, j)
                elif (below := unit_named(at(i + 1, j))) and is_number(at(i + 2, j), decimal):
                    value, unit = at(i + 2, j), below
                else:
                    continue
            found.setdefault(one_line(label.strip().lower(), LONGEST_NAME), (number(value, decimal), unit))
    return found


def _results(before: Sequence[Sequence[str]], decimal: str) -> dict[str, tuple[float, ...]]:
    """Return the columns of several numbers in a preamble, as a table of results has, by their labels."""
    found: dict[str, tuple[float, ...]] = {}
    for i, row in enumerate(before):
        for j, cell in enumerate(row):
            if not cell.strip() or is_number(cell.strip(), decimal) or len(cell) > 80:
                continue
            below = [other[j].strip() if j < len(other) else "" for other in before[i + 1 :]]
            if below and unit_named(below[0]):
                below = below[1:]
            column = list(takewhile(lambda text: is_number(text, decimal), below))
            if len(column) > 1:
                label = one_line(split_unit(cell.strip().rstrip(":= "))[0].strip().lower(), LONGEST_NAME)
                found.setdefault(label, tuple(number(text, decimal) for text in column))
    return found


def in_si(table: RawTable, k: int, kind: str, choices: Choices, role: str) -> Array | None:
    """Return a column in SI, None where nothing says its unit.

    Its unit is that of the setting `unit.NAME`, else the one that the file has for it, else that of `unit.ROLE`.

    Raises
    ------
    InputError
        For a unit that is none, or that measures something else.
    """
    name = table.names[k]
    choices.read.add((table.file, name))
    unit = own = table.units[k]
    named = (f"unit.{name}", f"unit.{_BRACKET.sub('', name)}")  # the second of a column whose unit is not known
    for key in dict.fromkeys((*named, f"unit.{role}")):
        asked = choices.get(key)
        if asked is not None:
            unit = unit_named(str(asked))
            if unit is None or unit.kind != kind:
                hint = nearest_unit(str(asked), kind) if unit is None else ""
                raise InputError(f"expected a unit of {kind}, got {shown(asked)}{hint}", key=key)
            if key not in named and own is not None:
                if own != unit:
                    told = f"{table.file}: column {shown(name)} is in {own.name}, got {unit.name}"
                    choices.against[key] = f"{told}; where the file is wrong, say --set unit.{name}={unit.name}"
                unit = own
            else:
                choices.decisive.add(key)
            break
    if unit is None:
        return None
    if unit.kind != kind:
        raise InputError(f"{table.file}: column {shown(name)} is in {unit.name}, which is no unit of {kind}")
    column: Array = table.columns[k] * unit.scale
    return column


def no_unit(table: RawTable, k: int, kind: str) -> str:
    """Say that a column has no unit, or one that is not known, and which one of a kind is near."""
    name, word = table.names[k], unknown_unit(table.names[k])
    if not word:
        return f"column {shown(name)} has no unit"
    return f"column {shown(name)}: the unit {shown(word)} is not known{nearest_unit(word, kind)}"


def one_column(table: RawTable, role: str, found: Sequence[int], choices: Choices) -> int | None:
    """Return the column of a role, of those that its name fits; raises `AskError` where several do."""
    asked = choices.get(f"column.{role}")
    if asked is not None:
        for k, name in enumerate(table.names):
            if name == asked or split_unit(str(asked))[0] == name:
                return k
        raise InputError(f"no such column; {table.file} has {listed(table.names)}", key=f"column.{role}")
    if len(found) > 1:
        names = " or ".join(shown(table.names[k]) for k in found)
        raise AskError(
            f"several columns could be the {role}: {names}; say --set column.{role}={shown(table.names[found[0]])}"
        )
    return found[0] if found else None
