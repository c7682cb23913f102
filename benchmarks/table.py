"""The table of a run as Markdown and as JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import groupby

from benchmarks.race import Row

HEADER = "| tool | resolution | time | ratio | first | error | repeats | note |\n|---|---|--:|--:|--:|--:|--:|---|"


@dataclass(frozen=True)
class Heading:
    """What the rows of one task are of. unit : one answer. error : what the error is of."""

    unit: str
    error: str


def duration(seconds: float | None) -> str:
    """Return a time with three digits in s, ms or µs."""
    if seconds is None:
        return "–"
    for factor, unit in ((1.0, "s"), (1e3, "ms"), (1e6, "µs")):
        if seconds * factor >= 1.0 or unit == "µs":
            return f"{seconds * factor:.3g} {unit}"
    raise AssertionError("unreachable")


def markdown(rows: Sequence[Row], headings: Mapping[str, Heading], machine: Mapping[str, str], seconds: float) -> str:
    """Return the page: the machine, then a table for each task."""
    parts = ["# Benchmarks: the table", "Written by `python -m benchmarks`; [how to read it](../benchmarks.md)."]
    parts.append("\n".join(f"- {name}: {value}" for name, value in machine.items()))
    parts.append(f"The whole run took {seconds:.0f} s. **Bold** is what the ratios of a task are relative to.")
    for task, group in groupby(rows, key=lambda row: row.task):
        heading = headings[task]
        lines = "\n".join(_line(row) for row in group)
        parts.append(
            f"## {task[0].upper()}{task[1:]}\n\nTime a {heading.unit}. Error: {heading.error}.\n\n{HEADER}\n{lines}"
        )
    return "\n\n".join(parts) + "\n"


def _line(row: Row) -> str:
    tool = f"**{row.tool}**" if row.reference else row.tool
    ratio = "–" if row.ratio is None else f"{row.ratio:.3g}"
    error = "–" if row.error is None else "0" if row.error == 0 else f"{row.error:.1e}"
    cells = [tool, row.resolution, duration(row.seconds), ratio, duration(row.first_seconds), error]
    return f"| {' | '.join(cells)} | {row.repeats or '–'} | {row.note} |"


def document(rows: Sequence[Row], headings: Mapping[str, Heading], machine: Mapping[str, str], seconds: float) -> str:
    """Return the same as JSON; times in s."""
    tasks = {name: asdict(heading) for name, heading in headings.items()}
    whole = {"machine": dict(machine), "seconds": seconds, "tasks": tasks, "rows": [asdict(row) for row in rows]}
    return json.dumps(whole, indent=1, allow_nan=False) + "\n"
