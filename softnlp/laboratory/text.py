"""The text reader: separator, decimal sign, quoting and where the numbers begin, decided together.

No sign in a file tells its dialect by itself. So every combination of separator and decimal sign is tried on the first
lines, and the one wins whose largest block of rows holds the most numbers in rows of one width. Two readings that do
nearly as well and differ in a number are an error that shows both.
"""

from __future__ import annotations

import codecs
import csv
import io
from collections import Counter, deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from sys import intern
from typing import Any

import numpy as np

from softnlp.base.csv_columns import MOST_COLUMNS
from softnlp.base.errors import InputError
from softnlp.base.reading import one_line, shown
from softnlp.laboratory.cells import MISSING, is_grouped, is_number, number, numbers
from softnlp.laboratory.choices import AskError, Choices
from softnlp.laboratory.table import RawTable, assembled, header_rows

SEPARATORS = {",": "comma", ";": "semicolon", "\t": "tab", "|": "bar", " ": "spaces"}
_LONGEST_LINE = 1_000_000
_SAMPLE_LINES, _SAMPLE = 600, 400_000
_CHUNK = 20_000
_PREAMBLE = 200  # lines above a repeated header
_MOST_ROWS = 10_000_000
_NEARLY = 0.9  # of the best score: another reading that is as likely
_WHITE = 0.9  # of the score of a reading by spaces, which text has too


@dataclass(frozen=True)
class Dialect:
    """separator : "," ";" tab "|" or " " for any run of spaces. decimal : "." or ","."""

    separator: str
    decimal: str

    @property
    def words(self) -> str:
        """How the two are named in settings."""
        return (
            f"--set separator={SEPARATORS[self.separator]} --set decimal={'comma' if self.decimal == ',' else 'point'}"
        )


@dataclass(frozen=True)
class Block:
    """Rows of numbers, first to before `end`, of the sample; score : how many numbers, by how regular they stand."""

    dialect: Dialect
    first: int
    end: int
    width: int
    score: float
    rows: tuple[tuple[str, ...], ...]


def encoding_of(content: bytes, choices: Choices) -> str:
    """Return the encoding of a text.

    Raises
    ------
    InputError
        For binary data, and for an encoding that the bytes are not of.
    """
    asked = choices.get("encoding")
    if asked is not None:
        try:
            content.decode(str(asked))
        except (LookupError, UnicodeError) as error:
            raise InputError(f"cannot be read as {shown(asked)}: {one_line(str(error), 80)}", key="encoding") from None
        return str(asked)
    for mark, name in (
        (codecs.BOM_UTF8, "utf-8-sig"),
        (codecs.BOM_UTF16_LE, "utf-16"),
        (codecs.BOM_UTF16_BE, "utf-16"),
    ):
        if content.startswith(mark):
            return name
    if b"\0" in content:
        head = content[:4000]
        for odd, name in ((1, "utf-16-le"), (0, "utf-16-be")):
            if len(head) > 8 and head[odd::2].count(0) > 0.8 * len(head[odd::2]):
                return str(choices.take("encoding", name, "every other byte is 0"))
        line = content.count(b"\n", 0, content.find(b"\0")) + 1
        raise InputError(f"expected text, got binary data (a byte 0 on line {line})")
    try:
        content.decode("utf-8")
    except UnicodeDecodeError as error:
        return str(choices.take("encoding", "cp1252", f"byte 0x{content[error.start]:02x} is not of UTF-8"))
    return "utf-8"


def _lines(content: bytes, encoding: str) -> io.TextIOWrapper:
    return io.TextIOWrapper(io.BytesIO(content), encoding, errors="replace", newline=None)


def text_table(label: str, content: bytes, choices: Choices) -> RawTable:
    """Return what stands in a text file.

    Raises
    ------
    AskError
        Where two readings are as likely; the text shows the first row of numbers in both.
    InputError
        For binary data, a line or a row that is too long, or no rows of numbers.
    """
    encoding = encoding_of(content, choices)
    if max(content.count(b"\n"), content.count(b"\r")) > _MOST_ROWS:
        raise InputError(f"expected at most {_MOST_ROWS} rows, got more; thin them, or cut the file")
    lines = _sample(content, encoding)
    block = _decided(lines, choices)
    choices.note("separator", SEPARATORS[block.dialect.separator])
    choices.note("decimal", "comma" if block.dialect.decimal == "," else "point")
    before = [list(_split(line, block.dialect.separator)) for line in lines[: block.first]]
    return _block_table(label, before, block, _rows(_lines(content, encoding), block), choices)


def cells_table(label: str, rows: Sequence[Sequence[str]], choices: Choices) -> RawTable:
    """Return what stands in rows of cells, whose numbers have a decimal point; raises `InputError` for no numbers."""
    block = next(_blocks(rows, Dialect("", ".")), None)
    if block is None:
        raise InputError("expected rows of numbers, got none")
    below = (list(row) for row in rows[block.first :])
    return _block_table(label, [list(row) for row in rows[: block.first]], block, below, choices)


def _block_table(
    label: str, before: list[list[str]], block: Block, rows: Iterator[list[str]], choices: Choices
) -> RawTable:
    """Return the table of a block and of the rows from its first one on."""
    header = header_rows(before, block.width)
    width = max(block.width, len(header.names))
    pieces, later = _columns(rows, block, width, header.names, choices)
    return assembled(label, header, before, pieces, choices, block.dialect.decimal, later)


def _sample(content: bytes, encoding: str) -> list[str]:
    """Return the first lines; raises `InputError` for one that is too long."""
    lines: list[str] = []
    size = 0
    file = _lines(content, encoding)
    while len(lines) < _SAMPLE_LINES and size < _SAMPLE and (line := file.readline(_LONGEST_LINE + 1)):
        if len(line) > _LONGEST_LINE:
            raise InputError(f"line {len(lines) + 1}: expected at most {_LONGEST_LINE} characters, got more")
        lines.append(line.rstrip("\n"))
        size += len(line)
    return lines


def _split(line: str, separator: str) -> Sequence[str]:
    """Return the cells of one line without blanks around them."""
    if separator == " ":
        return line.split()
    if '"' not in line:
        return [cell.strip() for cell in line.split(separator)]
    row: list[str] = next(csv.reader([line], delimiter=separator, skipinitialspace=True), [])
    return [cell.strip() for cell in row]


def _decided(lines: Sequence[str], choices: Choices) -> Block:
    """Return the block of rows that parses best; raises `AskError` where another does nearly as well."""
    separators = {name: sign for sign, name in SEPARATORS.items()} | {sign: sign for sign in SEPARATORS}
    decimals = {"comma": ",", "point": ".", ",": ",", ".": "."}
    asked_separator, asked_decimal = choices.get("separator"), choices.get("decimal")
    for key, asked, known in (("separator", asked_separator, separators), ("decimal", asked_decimal, decimals)):
        if asked is not None and asked not in known:
            raise InputError(f"expected {', '.join(w for w in known if w.isalpha())}, got {shown(asked)}", key=key)
    quoted = any('"' in line for line in lines)
    found: list[Block] = []
    for separator in SEPARATORS if asked_separator is None else (separators[asked_separator],):
        if asked_separator is None and separator != " " and not any(separator in line for line in lines):
            continue
        for decimal in (".", ",") if asked_decimal is None else (decimals[asked_decimal],):
            if (separator, decimal) != (",", ",") or quoted:
                found += _blocks([_split(line, separator) for line in lines], Dialect(separator, decimal))
    if not found:
        raise InputError("expected rows of numbers, got none")
    found.sort(key=lambda block: -block.score)
    best = found[0]
    shown_best = _values(best)
    for other in found[1:]:
        if other.dialect == best.dialect or other.score < _NEARLY * best.score:
            continue
        if _values(other) != shown_best:
            row = lines[best.first].strip()
            raise AskError(
                f"two readings of {shown(row[:60])} are as likely: {_told(best)} ({best.dialect.words}), or "
                f"{_told(other)} ({other.dialect.words})"
            )
    return best


def _values(block: Block) -> list[float]:
    """Return the numbers of the first rows of a block."""
    cells = [cell for row in block.rows[:20] for cell in row if is_number(cell, block.dialect.decimal)]
    return [number(cell, block.dialect.decimal) for cell in cells]


def _told(block: Block) -> str:
    decimal = block.dialect.decimal
    return " | ".join(f"{number(c, decimal):.10g}" if is_number(c, decimal) else c for c in block.rows[0][:8])


def _blocks(lines: Sequence[Sequence[str]], dialect: Dialect) -> Iterator[Block]:
    """Yield the largest run of rows of numbers among rows of cells."""
    run: list[tuple[int, tuple[str, ...]]] = []
    best: list[tuple[int, tuple[str, ...]]] = []
    for k, row in enumerate([*map(tuple, lines), ("end",)]):
        row = row[: len(row) - next((j for j, cell in enumerate(reversed(row)) if cell), len(row))]
        if not row:
            continue
        if len(row) > MOST_COLUMNS:
            raise InputError(f"line {k + 1}: expected at most {MOST_COLUMNS} columns, got {len(row)}")
        count = sum(is_number(cell, dialect.decimal) for cell in row)
        if count and 2 * count >= sum(cell.lower() not in MISSING for cell in row if cell):
            run.append((k, row))
            continue
        best = max(best, run, key=len)
        run = []
    if best:
        yield _scored(lines, dialect, best)


def _scored(lines: Sequence[Sequence[str]], dialect: Dialect, run: Sequence[tuple[int, tuple[str, ...]]]) -> Block:
    rows = [row for _, row in run]
    widths = Counter(map(len, rows))
    width, usual = widths.most_common(1)[0]
    score = 0.0
    for row in rows:
        filled = [cell for cell in row if cell and cell.lower() not in MISSING]
        count = sum(is_number(cell, dialect.decimal) for cell in filled)
        score += count - (len(filled) - count)
    score *= usual / len(rows)
    first = run[0][0]
    if dialect.separator == " ":
        score *= _WHITE
    above = next((row for row in reversed(lines[:first]) if any(row)), None)
    if above is not None:
        cells = [cell for cell in above if cell]
        if width > 1 and len(cells) < max(2, width - 2):
            score *= 0.6  # names of another number of columns
        elif len(cells) >= width - 1:
            score *= 1.2
    if all(is_grouped(c, dialect.decimal) or "," not in c for row in rows for c in row) and dialect.separator != ",":
        score *= 0.95  # a comma that only groups digits is rare
    return Block(dialect, first, run[-1][0] + 1, width, score, tuple(rows))


def _columns(
    rows: Iterator[list[str]], block: Block, width: int, header: Sequence[str], choices: Choices
) -> tuple[list[list[Any]], list[list[list[str]]]]:
    """Return the pieces of each column below the first row of numbers; the last is the repeat of the header above.

    With them come the rows of text above each repeat.
    """
    later: list[list[list[str]]] = []
    notes_above: deque[list[str]] = deque(maxlen=_PREAMBLE)
    pieces: list[list[Any]] = [[] for _ in range(width + 1)]
    wrong = repeat = notes = 0
    numeric = [_is_numeric(block, k) for k in range(width)]
    names = [name for name in header if name]
    while chunk := list(islice(rows, _CHUNK)):
        table, repeats = _of_width(chunk, width), np.full(len(chunk), repeat)
        told = [k for k in _doubtful(table, numeric, block.dialect.decimal) if _is_note(table[k], numeric)]
        for k in told:
            row = [cell.strip() for cell in table[k]]
            if row[0][:1].isalpha():
                notes_above.append(row)
            if names and [c for c in row if c] == names:
                repeat += 1
                repeats[k:] = repeat
                later.append(list(notes_above))
                notes_above.clear()
            notes += any(row)
        for k in reversed(told):
            del table[k]
        pieces[width].append(np.delete(repeats, told).astype(float))
        for k, column in enumerate(zip(*table, strict=True)):
            if numeric[k]:
                values, bad = numbers(column, block.dialect.decimal)
                pieces[k].append(values)
                wrong += bad
            else:
                pieces[k].append([intern(cell.strip()) for cell in column])  # each word of a state once
    choices.drop(notes, "rows of text between the numbers")
    choices.drop(wrong, "cells that are no number")
    return pieces, later


def _of_width(rows: list[list[str]], width: int) -> list[list[str]]:
    """Return rows of one width; raises `InputError` for one that holds more."""
    if set(map(len, rows)) == {width}:
        return rows
    for row in rows:
        if any(cell.strip() for cell in row[width:]):
            raise InputError(f"expected at most {width} columns as above, got a row of {len(row)}")
    return [row[:width] + [""] * (width - len(row)) for row in rows]


def _doubtful(rows: Sequence[Sequence[str]], numeric: Sequence[bool], decimal: str) -> list[int]:
    """Return which rows may be no data: those without a number in the first column that has numbers."""
    first = next((k for k, is_one in enumerate(numeric) if is_one), 0)
    values, _ = numbers([row[first] for row in rows], decimal)
    return [int(k) for k in np.flatnonzero(np.isnan(values))]


def _is_note(row: Sequence[str], numeric: Sequence[bool]) -> bool:
    """Whether a row has no number in a column of numbers, or begins with a word there."""
    cells = [cell.strip() for cell in row]
    return _begins_with_word(cells, numeric) or not any(
        is_one and cell[:1] in _BEGINS for cell, is_one in zip(cells, numeric, strict=True)
    )


def _begins_with_word(row: Sequence[str], numeric: Sequence[bool]) -> bool:
    """Whether the first cell of a row that is not blank has a word where a column has numbers: "Mean", "Width"."""
    for cell, is_one in zip(row, numeric, strict=False):
        if cell:
            return is_one and cell[:1].isalpha() and cell.lower() not in MISSING
    return False


_BEGINS = frozenset("0123456789+-.,nN")


def _is_numeric(block: Block, column: int) -> bool:
    """Whether most cells of a column in the sample are numbers."""
    cells = [row[column] for row in block.rows if column < len(row) and row[column]]
    cells = [cell for cell in cells if cell.lower() not in MISSING]
    return 2 * sum(is_number(cell, block.dialect.decimal) for cell in cells) > len(cells)


def _rows(file: io.TextIOWrapper, block: Block) -> Iterator[list[str]]:
    """Yield the rows from the first one of numbers on."""
    lines: Iterable[str] = islice(_short_lines(file), block.first, None)
    if block.dialect.separator == " ":
        yield from map(str.split, lines)
        return
    reader = csv.reader(lines, delimiter=block.dialect.separator, skipinitialspace=True)
    try:
        for row in reader:
            if len(row) > MOST_COLUMNS + 1:
                raise InputError(f"expected at most {MOST_COLUMNS} columns, got a row of {len(row)}")
            yield row
    except csv.Error as error:
        raise InputError(f"line {block.first + reader.line_num}: {one_line(str(error))}") from None


def _short_lines(file: io.TextIOWrapper) -> Iterator[str]:
    """Yield the lines of a file; raises `InputError` for one that is too long."""
    for number_of, line in enumerate(file, start=1):
        if len(line) > _LONGEST_LINE:
            raise InputError(f"line {number_of}: expected at most {_LONGEST_LINE} characters, got more")
        yield line
