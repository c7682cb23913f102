"""Pressures over time as the page edits them: rows of [pressure] with their times, and what a person draws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.reading import shown

Array = NDArray[np.float64]
Points = list[tuple[float, float]]
"""Of one set: times [s] that do not fall, and pressures [bar], linear between them; two of one time are a jump."""

STEP = "a step of pressure"
"""Among what a document offers: that a motion nobody has described yet is a step to the pressures of the file."""
_STEP_AT = 0.05  # [s], and at most that part of the duration
_EARLY = 0.1
_FLAT = 4e-3  # how far a drawn curve may be from its points, of the pressures and times shown


def timed(table: Mapping[str, Any], duration: float, sets: int, *, step: bool) -> dict[str, Any]:
    """Return [pressure] with a time for each row: those of a sequence or a ramp over the duration.

    sets : of the robot. step : whether a single row is reached by a jump from zero; else it is held, and needs no time.
    """
    rows = rows_of(table, sets)
    if "t_s" in table or rows is None or (len(rows) == 1 and not step):
        return dict(table)
    if len(rows) == 1:
        at, zeros = min(_STEP_AT, _EARLY * duration), [0.0] * len(rows[0])
        return {"t_s": [0.0, at, at], "sequence_bar": [zeros, zeros, rows[0]]}
    times = [float(f"{t:.6g}") for t in np.linspace(0.0, duration, len(rows))]
    return {"t_s": times, "sequence_bar": rows}


def rows_of(table: Mapping[str, Any], sets: int) -> list[list[float]] | None:
    """Return the rows of a sequence or a ramp [bar]; None for those of a file, and for what is none."""
    rows, ramp = table.get("sequence_bar"), table.get("ramp")
    if isinstance(rows, list) and rows and all(isinstance(row, list) for row in rows):
        return rows
    if not isinstance(ramp, Mapping) or not all(key in ramp for key in ("sets", "to_bar", "steps")):
        return None
    values = np.linspace(float(ramp.get("from_bar", 0.0)), float(ramp["to_bar"]), int(ramp["steps"]))
    return [[float(f"{v:.9g}") if k + 1 in ramp["sets"] else 0.0 for k in range(sets)] for v in values]


def curves_of(times: Sequence[float], rows: Sequence[Sequence[float]]) -> list[Points]:
    """Return the points of each set."""
    return [[(float(t), float(p)) for t, p in zip(times, column, strict=True)] for column in zip(*rows, strict=True)]


def table_of(curves: Sequence[Points]) -> dict[str, Any]:
    """Return [pressure] of the points of each set: a row wherever one of them has a corner or jumps."""
    instants = sorted({t for points in curves for t, _ in points})
    times: list[float] = []
    rows: list[list[float]] = []
    for t in instants:
        sides = [[_at(points, t, after) for points in curves] for after in (False, True)]
        for row in sides if sides[0] != sides[1] else sides[:1]:
            times.append(float(f"{t:.6g}"))
            rows.append([float(f"{p:.5g}") + 0.0 for p in row])
    kept = _corners(times, rows)
    return {"t_s": [times[k] for k in kept], "sequence_bar": [rows[k] for k in kept]}


def drawn(points: Points, stroke: Sequence[Sequence[float]], duration: float, top: float) -> Points:
    """Return the points of a set in whose place a person drew a stroke, from its first to its last time.

    stroke : (n, 2) times [s] and pressures [bar], in the order in which they were drawn. top : of the picture [bar].
    """
    fresh = sorted((min(max(float(t), 0.0), duration), max(float(p), 0.0)) for t, p in stroke)
    fresh = simplified(fresh, duration, top)
    if not fresh:
        return points
    start, end = fresh[0][0], fresh[-1][0]
    before = [point for point in points if point[0] < start]
    after = [point for point in points if point[0] > end]
    if start > 0 and before:
        before.append((start, _at(points, start, False)))
    if end < duration:
        after.insert(0, (end, _at(points, end, True)))
    joined = [*before, *fresh, *after]
    return [point for k, point in enumerate(joined) if k == 0 or point != joined[k - 1]]


def simplified(points: Points, duration: float, top: float) -> Points:
    """Return as few of some points as stand for all of them to a few thousandths of the picture."""
    if len(points) < 3:
        return points
    scaled = np.array(points) / [max(duration, 1e-9), max(top, 1e-9)]
    keep = {0, len(points) - 1}
    spans = [(0, len(points) - 1)]
    while spans:
        a, b = spans.pop()
        if b - a < 2:
            continue
        way = scaled[b] - scaled[a]
        off = scaled[a + 1 : b] - scaled[a]
        size = float(np.hypot(*way))
        far = np.abs(off[:, 0] * way[1] - off[:, 1] * way[0]) / size if size > 0 else np.hypot(*off.T)
        k = int(np.argmax(far))
        if far[k] > _FLAT:
            keep.add(a + 1 + k)
            spans += [(a, a + 1 + k), (a + 1 + k, b)]
    return [points[k] for k in sorted(keep)]


def text_of(times: Sequence[float], rows: Sequence[Sequence[float]]) -> str:
    """Return rows as a person edits them: the time, then the pressure of each set."""
    return "\n".join(", ".join(f"{v:.9g}" for v in (t, *row)) for t, row in zip(times, rows, strict=True))


def table_of_text(text: str, sets: int) -> dict[str, Any]:
    """Return [pressure] of what a person typed, a line a time; raises `InputError` for what is none, with its line."""
    times: list[float] = []
    rows: list[list[float]] = []
    for number, words in enumerate(text.splitlines(), start=1):
        row = [_number(number, word) for word in words.replace(",", " ").replace(";", " ").split()]
        if not row:
            continue
        if len(row) != sets + 1:
            raise InputError(f"line {number}: expected a time and {sets} pressures, got {len(row)} numbers")
        if times and row[0] < times[-1]:
            raise InputError(
                f"line {number}: expected a time of at least {times[-1]:g} s, as before it, got {row[0]:g}"
            )
        times.append(row[0])
        rows.append(row[1:])
    if not rows:
        raise InputError("expected a line for each time: the time in s, then a pressure in bar for each set")
    return {"t_s": times, "sequence_bar": rows}


def _number(line: int, word: str) -> float:
    try:
        value = float(word)
    except ValueError:
        raise InputError(f"line {line}: expected numbers, got {shown(word)}") from None
    if not isfinite(value) or "_" in word:
        raise InputError(f"line {line}: expected a finite number, got {shown(word)}")
    return value


def _at(points: Points, t: float, after: bool) -> float:
    """Return the pressure at a time; after : behind a jump there, else before it."""
    same = [p for s, p in points if s == t]
    if same:
        return same[-1] if after else same[0]
    return float(np.interp(t, [s for s, _ in points], [p for _, p in points]))


def _corners(times: Sequence[float], rows: Sequence[Sequence[float]]) -> list[int]:
    """Return the rows that are not on the line between their neighbours, and both ends."""
    kept = list(range(len(times)))
    k = 1
    while k < len(kept) - 1:
        a, b, c = kept[k - 1 : k + 2]
        span = times[c] - times[a]
        if times[a] < times[b] < times[c]:
            part = (times[b] - times[a]) / span
            between = np.array(rows[a]) + part * (np.array(rows[c]) - np.array(rows[a]))
            if np.allclose(between, rows[b], atol=1e-6, rtol=0):
                del kept[k]
                continue
        k += 1
    return kept
