"""A report as one HTML page that needs no other file: what was read and why, the numbers, the figures, the scenario."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator, Mapping, Sequence
from html import escape
from typing import Any, NamedTuple

from softnlp.model.inputs import package_version

_STYLE = """
body{font:16px/1.5 system-ui,sans-serif;max-width:64rem;margin:2rem auto;padding:0 1rem;color:#1c2833}
h1{font-size:1.6rem}h2{font-size:1.2rem;border-bottom:1px solid #ccd1d9;margin-top:2rem}
table{border-collapse:collapse;display:block;overflow-x:auto;font-size:.9rem}
th,td{padding:.2rem .7rem;text-align:left;border-bottom:1px solid #e5e8ec;font-variant-numeric:tabular-nums}
td.warned{background:#fff3cd}td.failed{background:#f8d7da}
pre{background:#f4f6f8;padding:1rem;overflow-x:auto;font-size:.85rem}img{max-width:100%}
@media print{body{margin:0;max-width:none}pre{white-space:pre-wrap}h2{break-after:avoid}img,tr{break-inside:avoid}}
"""
_LONGEST, _FEW = 200, 30  # rows of a table; of one that stands before the numbers
_SKIPPED = ("notes", "warnings", "checks", "ipopt_multipliers", "correlation")
_VERDICTS = ("warned", "failed")


class Section(NamedTuple):
    """A table of a report. title : above it. header, rows : of text. note : below it."""

    title: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""


def report_page(
    title: str,
    document: Mapping[str, Any],
    figures: Mapping[str, bytes],
    texts: Mapping[str, str],
    sections: Sequence[Section] = (),
) -> str:
    """Return a page.

    document : of the study, as its JSON. figures : PNG by caption. texts : such as the scenario, by their titles.
    """
    parts = [f"<h1>{escape(title)}</h1>", f"<p>softnlp {escape(package_version())}</p>"]
    for key, heading in (("notes", "What was read, guessed and left out"), ("warnings", "Warnings")):
        if lines := document.get(key):
            parts += [f"<h2>{heading}</h2><ul>", *(f"<li>{escape(str(line))}</li>" for line in lines), "</ul>"]
    if checks := document.get("checks"):
        header = ("name", "value", "unit", "verdict", "message")
        rows = [[_cell(check.get(name)) for name in header] for check in checks]
        parts.append(_table(Section("Checks", header, rows)))
    for caption, png in figures.items():
        image = base64.b64encode(png).decode("ascii")
        parts.append(f'<h2>{escape(caption)}</h2><img alt="{escape(caption)}" src="data:image/png;base64,{image}">')
    parts += _tables(document, few=True)
    parts += map(_table, sections)
    numbers = {key: value for key, value in document.items() if not _is_rows(value) and key not in _SKIPPED}
    parts.append(_table(Section("Numbers", ("name", "value"), [[key, _cell(value)] for key, value in _flat(numbers)])))
    parts += _tables(document, few=False)
    for heading, text in texts.items():
        parts.append(f"<h2>{escape(heading)}</h2><pre>{escape(text)}</pre>")
    body = "\n".join(parts)
    head = f'<meta charset="utf-8"><title>{escape(title)}</title><style>{_STYLE}</style>'
    return f'<!DOCTYPE html>\n<html lang="en"><head>{head}</head><body>\n{body}\n</body></html>\n'


def _tables(document: Mapping[str, Any], few: bool) -> Iterator[str]:
    """Yield each list of tables of a document as one, those with few rows or the others."""
    for key, rows in document.items():
        if _is_rows(rows) and key not in _SKIPPED and (len(rows) <= _FEW) == few:
            title, shown = key.replace("_", " ").capitalize(), [dict(row) for row in rows[:_LONGEST]]
            deep = [name for name in shown[0] if _is_deep(shown[0][name])]
            flat = [dict(_flat({name: row[name] for name in row if name not in deep})) for row in shown]
            header = list(dict.fromkeys(name for row in flat for name in row))
            more = len(rows) - _LONGEST
            note = f"and {more} rows more" if more > 0 else ""
            yield _table(Section(title, header, [[_cell(row.get(name)) for name in header] for row in flat], note))
            for name in deep:
                parts = [(str(n + 1), *part) for n, row in enumerate(shown) for part in _innermost(row[name])]
                inner = list(dict.fromkeys(k for *_, part in parts for k in part))
                lines = [[n, of, *(_cell(part.get(k)) for k in inner)] for n, of, part in parts]
                yield _table(Section(f"{title}: {name.replace('_', ' ')}", ["row", "of", *inner], lines))


def _innermost(value: Mapping[str, Any], label: str = "") -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield the tables that hold numbers within tables of tables, by their keys."""
    for key, part in value.items():
        name = f"{label}{key}"
        if _is_deep(part):
            yield from _innermost(part, f"{name}, ")
        else:
            yield name, part


def _flat(value: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the numbers within tables by their keys, those of inner tables behind a dot."""
    for key, inner in value.items():
        if isinstance(inner, Mapping) and inner:
            yield from _flat(inner, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", inner


def _is_deep(value: Any) -> bool:
    return isinstance(value, Mapping) and bool(value) and all(isinstance(part, Mapping) for part in value.values())


def _is_rows(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(row, Mapping) for row in value)


def _cell(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list):
        return ", ".join(_cell(one) or "-" for one in value) if len(value) <= 12 else f"{len(value)} entries"
    return json.dumps(value, ensure_ascii=False) if isinstance(value, Mapping | bool) else str(value)


def _table(section: Section) -> str:
    head = "".join(f"<th>{escape(cell)}</th>" for cell in section.header)
    rows = "".join(f"<tr>{''.join(map(_td, row))}</tr>" for row in section.rows)
    note = f"<p>{escape(section.note)}</p>" if section.note else ""
    return f"<h2>{escape(section.title)}</h2><table><tr>{head}</tr>{rows}</table>{note}"


def _td(cell: str) -> str:
    kind = f' class="{cell}"' if cell in _VERDICTS else ""
    return f"<td{kind}>{escape(cell)}</td>"
