"""Lists of tables of a scenario, [[obstacle]] and [[segment]]: read as plain Python, written so that comments stay."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import tomlkit
from tomlkit.items import AoT, InlineTable, Table

Row = dict[str, Any]


def rows_of(tables: Any, name: str) -> list[Row]:
    """Return the tables of a list as plain Python; none where there is no such list."""
    found = tables.get(name)
    return [dict(row.unwrap()) for row in found] if isinstance(found, AoT) else []


def put_rows(tables: Any, name: str, rows: Sequence[Mapping[str, Any]]) -> None:
    """Put rows in place of those of a list, or take it out for none; what stays keeps its comments."""
    before = rows_of(tables, name)
    if not rows:
        tables.pop(name, None)
    elif len(rows) == len(before):
        for k, row in enumerate(rows):
            if row != before[k]:
                merge(tables[name][k], row)
    else:
        left = list(enumerate(before))
        made = tomlkit.aot()
        for row in rows:
            same = next((place for place in left if place[1] == row), None)
            if same is None:
                table = tomlkit.table()
                merge(table, row)
                _last(table).add(tomlkit.nl())
            else:
                left.remove(same)
                table = tables[name][same[0]]
            made.append(table)
        tables[name] = made


def _last(table: Any) -> Any:
    """Return the table that a table ends with in its file."""
    inner = [value for value in table.values() if isinstance(value, Table)]
    return inner[-1] if inner else table


def merge(table: Any, values: Mapping[str, Any]) -> None:
    """Give a table these keys and no others; inner tables of a file stay tables, new ones of a row become such."""
    for key in [key for key in table if key not in values]:
        table.remove(key)
    for key, value in values.items():
        inner = table.get(key)
        if isinstance(value, Mapping) and (inner is None or isinstance(inner, Table)) and key in _INNER:
            if inner is None:
                table[key] = tomlkit.table()
            merge(table[key], value)
        elif getattr(inner, "unwrap", lambda inner=inner: inner)() != value:
            table[key] = in_line(value)


_INNER = ("robot", "material")  # of a segment: tables of their own in a file


def in_line(value: Any) -> Any:
    """Return a value as a file has it in one line."""
    if not isinstance(value, Mapping) or isinstance(value, InlineTable):
        return value
    line = tomlkit.inline_table()
    for key, inner in value.items():
        line.append(key, getattr(inner, "unwrap", lambda inner=inner: inner)())
    return line


def inner_tables(rows: Sequence[Row]) -> Iterator[Row]:
    """Yield the tables inside of rows, that of the robot of a segment for instance."""
    for row in rows:
        yield from (part for part in row.values() if isinstance(part, dict))
