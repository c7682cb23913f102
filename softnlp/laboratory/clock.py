"""The clock of a file: the column or columns that hold the time, in seconds from the first sample or as they stand."""

from __future__ import annotations

import re
from datetime import UTC, datetime
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.laboratory.choices import AskError, Choices
from softnlp.laboratory.imported import ANY
from softnlp.laboratory.table import RawTable, in_si, no_unit
from softnlp.laboratory.units import UNITS
from softnlp.studies.check import Check

Array = NDArray[np.float64]

_NAMES = (
    r"^((test|elapsed|relative|run|unix|epoch|total|sample|log|system|recording|rel\.?)[ _]?)?"
    r"(time|zeit|temps|tiempo|tempo|tijd|t|x_value|seconds|timestamp|time ?stamp|(milli|micro)s|m?s$)\b"
)
_PARTS = (("hour", 3600.0), ("minute", 60.0), ("second", 1.0), (r"ms|millisecond", 1e-3))
_RATES = (0.1, 5000.0)  # samples a second that a laboratory's logger takes
_CLOCK = re.compile(
    r"^(?:(?:\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4})[ T]+)?(\d{1,2}):(\d{2}):(\d{2}(?:[.,:]\d+)?) ?([AP]M)?$", re.IGNORECASE
)
_DAY = 86400.0


def time_of(table: RawTable, choices: Choices, need: bool = False) -> tuple[Array | None, list[Check]]:
    """Return the time of each row [s], and the check of a second clock in the same file.

    Raises
    ------
    AskError
        Where the unit of the time is not known, or `need` and there is none.
    """
    found = table.named(_NAMES, r"date|delta|step|out")
    asked = choices.get("column.time")
    if asked is not None:
        found = [k for k, name in enumerate(table.names) if name == asked and table.is_number(k)]
    found = [k for k in found if (unit := table.units[k]) is None or unit.kind == "time"]
    clocks = [(k, _seconds(table, k, choices)) for k in found]
    known = [(k, t) for k, t in clocks if t is not None]
    if known:
        # one that counts from the start comes before one that counts from midnight
        k, time = min(known, key=lambda pair: abs(float(pair[1][0])))
        return time, [check for j, other in known if j != k for check in _two_clocks(time, other)]
    made = _of_day(table, choices)
    made = made - made[0] if made is not None else _from_step(table, choices)
    if made is None and need:
        raise AskError(f"{table.file}: no column tells the time; say --set rate_Hz=…, or --set column.time=…")
    return made, []


def _seconds(table: RawTable, k: int, choices: Choices) -> Array | None:
    """Return a column as seconds; without a unit the rate at which it was sampled tells, or asks."""
    known = in_si(table, k, "time", choices, "time")
    if known is not None:
        return _past_midnight(known, table, choices)
    plain: Array = table.columns[k]
    for word, scale in (("millis", 1e-3), ("micros", 1e-6), ("ms", 1e-3), ("s", 1.0)):
        if table.names[k].lower() == word:
            return np.asarray(plain * scale)
    steps = np.diff(plain[np.isfinite(plain)])
    step = float(np.median(steps)) if steps.size else 0.0
    if not step > 0:
        return None
    known_units = [(u, UNITS[u].scale) for u in ("day", "s", "ms", "us", "ns")]
    likely = [(unit, scale) for unit, scale in known_units if _RATES[0] <= 1 / (step * scale) <= _RATES[1]]
    if len(likely) != 1:
        raise AskError(
            f"{table.file}: {no_unit(table, k, 'time')}; it rises by {step:g}: {1 / step:.4g} samples a second in s "
            f"(--set unit.time=s), {1e3 / step:.4g} in ms (--set unit.time=ms), {1e6 / step:.4g} in us (unit.time=us)"
        )
    unit, scale = likely[0]
    choices.take("unit.time", unit, f"{1 / (step * scale):.4g} samples a second, as loggers take")
    return np.asarray(plain * scale)


def _two_clocks(time: Array, other: Array) -> list[Check]:
    """Return the check of how two clocks of a file differ, each counted from its round start."""
    offset = float(np.median(time - (other - other[0])))
    drift = float(np.ptp(time - other))
    likely = (
        "the log began later than its clock; the lag to the other files is found from what they hold, or --set lag_s=…"
    )
    return [
        Check("offset between two clocks of a file", offset, (-0.01, 0.01), ANY, likely, "s"),
        Check("drift between two clocks of a file", drift, (-0.01, 0.01), ANY, "one of the clocks runs fast", "s"),
    ]


def day_start(table: RawTable) -> float | None:
    """Return the time of the day at which a file begins by its clock [s], None where it has none."""
    made = _of_day(table, Choices({}))
    if made is None:
        found = [k for k in table.named("midnight") if getattr(table.units[k], "kind", "") == "time"]
        made = in_si(table, found[0], "time", Choices({}), "time") if found else None
    return None if made is None or not made.size else float(made[0]) % _DAY


def _of_day(table: RawTable, choices: Choices) -> Array | None:
    """Return the time of columns of hours, minutes and seconds, or of one of dates or times of the day, unwrapped."""
    total, used = np.zeros(table.rows), []
    for pattern, scale in _PARTS:
        if found := table.named(rf"^({pattern})s?$"):
            total = total + table.columns[found[0]] * scale
            used.append(found[0])
    if len(used) > 1:
        choices.read |= {(table.file, table.names[k]) for k in used}
        return _past_midnight(total, table, choices)
    for k, name in enumerate(table.names):
        if table.is_number(k):
            continue
        values = [_moment(cell) for cell in table.columns[k]]
        if values and all(value is not None for value in values):
            choices.read.add((table.file, name))
            return _past_midnight(np.array(values, float), table, choices)
    return None


def _past_midnight(time: Array, table: RawTable, choices: Choices) -> Array:
    """Return a clock of the day that goes on where it began again at midnight, which is said."""
    falls = np.concatenate([[False], np.diff(time) < -_DAY / 2]) & bool(np.nanmax(time) <= 1.001 * _DAY)
    if not np.any(falls):
        return time
    row = int(np.flatnonzero(falls)[0]) + 1
    choices.say(
        f"{table.file}: the clock begins again at midnight, in row {row}; the rows from there are of the next day"
    )
    return np.asarray(time + _DAY * np.cumsum(falls))


def _moment(cell: Any) -> float | None:
    """Return the time of the day that a cell holds [s], with its date where that is spelt as ISO 8601 has it."""
    text = str(cell).strip()
    try:
        moment = datetime.fromisoformat(text) if len(text) > 9 and text[:4].isdigit() else None
    except ValueError:
        moment = None
    if moment is None:
        return _clock(text)
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()  # no hour is told twice in summer


def _clock(text: str) -> float | None:
    found = _CLOCK.match(text)
    if not found:
        return None
    hour, noon = int(found[1]), (found[4] or "").lower()
    if noon:
        hour = hour % 12 + 12 * (noon == "pm")
    return 3600.0 * hour + 60.0 * int(found[2]) + float(found[3].replace(",", ".").replace(":", "."))


def _from_step(table: RawTable, choices: Choices) -> Array | None:
    """Return the time of rows at equal steps: a rate that is given, or LabVIEW's Delta_X."""
    rate = choices.number("rate_Hz")
    if rate is not None:
        return np.asarray(np.arange(table.rows) / rate)
    step = table.values.get("delta_x")
    if step is None or not step[0] > 0:
        return None
    return np.asarray(np.arange(table.rows) * step[0])
