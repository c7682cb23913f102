"""The log of the pressures: one column a chamber set, gauge, in bar, whatever the logger's unit and zero."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError, listed
from softnlp.base.reading import shown
from softnlp.base.units import BAR
from softnlp.laboratory.choices import AskError, Choices
from softnlp.laboratory.clock import time_of
from softnlp.laboratory.imported import ANY, Imported, require_possible
from softnlp.laboratory.samples import sample_checks
from softnlp.laboratory.signals import lag_between, noise
from softnlp.laboratory.table import RawTable, in_si, no_unit
from softnlp.laboratory.units import UNITS
from softnlp.studies.check import Check

Array = NDArray[np.float64]

_NAMES = r"^(p|pressure|press|druck|ch|chamber|valve|actuator|sensor)[ _#-]?\(?(\d+)\)?$"
_WORDS = r"(?<!com)press|(?<![a-z])druck|chamber|valve|actuator|supply|regulator|^p\b|^p_|^ch"
_COMMAND = r"set ?point|set|command|cmd|soll|target|desired|ref"
_ATMOSPHERE = (0.85, 1.08)  # [bar]: of the air where people live
_AT_REST = (0.05, 0.1)  # [bar]: sets that rest at more, all of them, are hardly at 0; are not
_HIGHEST = 6.0  # [bar]: what drives no silicone robot
_UNITS = ("mbar", "kPa", "bar", "psi", "Pa")


def pressure_columns(table: RawTable) -> list[int]:
    """Return the columns of the sets, in the order of their numbers."""
    found = table.named(_NAMES)
    found = [k for k in found if (unit := table.units[k]) is None or unit.kind in ("pressure", "other")]

    def number_of(k: int) -> int:
        digits = re.search(r"(\d+)", table.names[k])
        return int(digits[1]) if digits else 0

    return sorted(found, key=number_of)


def is_pressure(table: RawTable) -> bool:
    """Whether a table is a log of pressures."""
    return bool(pressure_columns(table)) or any(u is not None and u.kind == "pressure" for u in table.units)


def has_sets(table: RawTable) -> bool:
    """Whether a table is a log of pressures by the names of its columns, not only by a unit that a stress has too."""
    return bool(pressure_columns(table)) or any(
        unit is not None and unit.kind == "pressure" and re.search(_WORDS, name, re.IGNORECASE)
        for name, unit in zip(table.names, table.units, strict=True)
    )


def import_pressure(tables: Sequence[RawTable], choices: Choices) -> Imported:
    """Return the gauge pressures of a log; a second log, by another clock, tells the lag of the first.

    Raises
    ------
    AskError
        Where unit or zero are not known.
    InputError
        For settings that do not fit, or a table without pressures.
    """
    if len(tables) > 2:
        raise InputError(
            "expected one log of pressures, or two of which the second has the clock to follow", key="FILE"
        )
    time, pressures, checks = pressures_of(tables[0], choices)
    numbers: dict[str, float] = {}
    if len(tables) == 2:
        other_time, other, _ = pressures_of(tables[1], Choices({}))
        if time is None or other_time is None:
            raise AskError("no column tells the time of the pressures: --set rate_Hz=…")
        lag, error, _ = lag_between(other_time, other, time, pressures)
        lag = float(choices.take("lag_s", round(lag, 4), f"the two logs then go together; taken off {tables[0].file}"))
        time = time - lag
        checks.append(lag_check(lag, error))
        numbers |= {"lag_s": lag, "lag_error_s": error}
    deadband = choices.number("deadband_bar")
    if deadband is not None:
        pressures = np.where(np.abs(pressures) < deadband, 0.0, pressures)
    columns = {} if time is None else {"t_s": time}
    columns |= {f"p{k + 1}_bar": column for k, column in enumerate(pressures.T)}
    numbers["noise_bar"] = float(max(map(noise, pressures.T)))
    every = (*checks, *_level_checks(pressures), *sample_checks(columns, time))
    require_possible(every, choices)
    return Imported("pressure", tuple(table.file for table in tables), columns, every, choices, numbers)


def pressures_of(table: RawTable, choices: Choices, timed: bool = True) -> tuple[Array | None, Array, list[Check]]:
    """Return time [s], gauge pressures (rows, sets) [bar] and checks of a log, but rows with a missing cell."""
    time, checks = time_of(table, choices) if timed else (None, [])
    asked = choices.get("sets")
    if asked is not None:
        names = asked if isinstance(asked, list) else [asked]
        chosen = [k for name in names for k, known in enumerate(table.names) if known == name]
        if len(chosen) != len(names):
            raise InputError(
                f"expected columns of the file in the order of the sets: {listed(table.names)}", key="sets"
            )
    else:
        chosen = pressure_columns(table)
        if not chosen:
            chosen = [
                k for k, u in enumerate(table.units) if u is not None and u.kind == "pressure" and table.is_number(k)
            ]
        if not chosen:
            raise InputError(f"{table.file}: expected columns of pressures, p1, p2, …; it has {listed(table.names)}")
        names = [table.names[k] for k in chosen]
        if names != [f"p{k + 1}" for k in range(len(names))]:
            choices.take("sets", names, "in this order they are p1_bar, p2_bar, …")
    values = _in_bar(table, chosen, choices)
    checks += _command_checks(table, chosen, choices)
    gauge = _gauge(values, choices)
    checks.append(_rest_check(gauge, choices))
    known = np.all(np.isfinite(gauge), axis=1) & (np.isfinite(time) if time is not None else True)
    choices.drop(int(np.sum(~known)), "rows with a missing cell")
    return (None if time is None else time[known]), gauge[known], checks


def _command_checks(table: RawTable, chosen: Sequence[int], choices: Choices) -> list[Check]:
    """Return the check of measured pressures against their commands, where the log holds both [bar]."""
    found = []
    for k in chosen:
        pattern = rf"^{re.escape(table.names[k])}[ _-]*({_COMMAND})$|^({_COMMAND})[ _-]*{re.escape(table.names[k])}$"
        for j in table.named(pattern):
            asked, given = (in_si(table, column, "pressure", choices, "pressure") for column in (j, k))
            if asked is not None and given is not None:
                found.append(float(np.nanpercentile(np.abs(asked - given), 90)) / BAR)
    if not found:
        return []
    likely = "the regulator did not reach what was asked for, or another unit or order of the columns"
    return [Check("pressure away from its command", max(found), (0, 0.05), ANY, likely, "bar")]


def _in_bar(table: RawTable, chosen: Sequence[int], choices: Choices) -> Array:
    """Return columns in bar, absolute or gauge as they are."""
    columns = []
    for k in chosen:
        unit = table.units[k]
        if (unit is not None and unit.kind == "other") or (unit is None and "calibration" in choices.given):
            columns.append(_calibrated(table, k, choices))
            continue
        choices.read.add((table.file, table.names[k]))
        known = in_si(table, k, "pressure", choices, "pressure")
        if known is None:
            known = table.columns[k] * UNITS[_unit(table, chosen, choices)].scale
        columns.append(known / BAR)
    return np.column_stack(columns)


def _calibrated(table: RawTable, k: int, choices: Choices) -> Array:
    """Return a column of a sensor's volts, amperes or counts in bar, by two numbers that a person gives."""
    line = choices.numbers("calibration", 2)
    if line is None:
        unit = table.units[k]
        assert unit is not None
        raise AskError(
            f"{table.file}: column {shown(table.names[k])} is in {unit.name}: say how it becomes bar, "
            f"--set calibration=[zero in {unit.name}, bar a {unit.name}]"
        )
    plain: Array = table.columns[k]
    return (plain - line[0]) * line[1]


def _unit(table: RawTable, chosen: Sequence[int], choices: Choices) -> str:
    """Return the unit of columns that have none: that in which the sets rest at the pressure of the air.

    Whole numbers are asked about, since counts of a converter may rest there by chance.
    """
    values = np.column_stack([table.columns[k] for k in chosen])
    counts = bool(np.all(np.mod(values[np.isfinite(values)], 1) == 0))
    rest = float(np.median(np.nanmin(values, axis=0)))
    air = [u for u in _UNITS if _ATMOSPHERE[0] <= rest * UNITS[u].scale / BAR <= _ATMOSPHERE[1]]
    if len(air) == 1 and not counts:
        return str(
            choices.take("unit.pressure", air[0], f"the sets rest at {rest:.5g}, the air's pressure in {air[0]}")
        )
    top = float(np.nanmax(values))
    told = [
        f"in {u} it goes to {top * UNITS[u].scale / BAR:.3g} bar"
        + (", which no silicone robot takes" if top * UNITS[u].scale / BAR > _HIGHEST else "")
        + f" (--set unit.pressure={u})"
        for u in _UNITS[:4]
    ]
    if counts:
        told.append("it may be counts too, for all are whole (--set calibration=[counts at 0 bar, bar a count])")
    raise AskError(f"{table.file}: {no_unit(table, chosen[0], 'pressure')}: {'; '.join(told)}")


def _gauge(values: Array, choices: Choices) -> Array:
    """Return pressures over that of the air, which absolute ones rest at."""
    rest = np.nanpercentile(values, 5, axis=0)
    level = float(np.median(rest))
    zero = choices.get("zero")
    if zero is None:
        absolute = _ATMOSPHERE[0] <= level <= _ATMOSPHERE[1] and float(np.ptp(rest)) < 0.1
        if not absolute:
            return values
        zero = choices.take("zero", "absolute", f"the sets rest at {level:.4g} bar, as the air does")
    if zero == "gauge":
        return values
    if isinstance(zero, int | float) and not isinstance(zero, bool):
        return values - float(zero)
    if zero == "tare":
        return values - rest
    if zero != "absolute":
        raise InputError(f"expected 'absolute', 'gauge', 'tare' or a pressure in bar, got {shown(zero)}", key="zero")
    # the air of that day: what the sets without pressure show, all of them together
    low = values[values < level + 0.05]
    return values - float(
        choices.take("atmosphere_bar", round(float(np.median(low)), 6), "the median of the sets at rest")
    )


def _rest_check(gauge: Array, choices: Choices) -> Check:
    """Return the check of the level at which all sets rest [bar], which is that of the air, so 0 where it is gauge."""
    level = float(np.min(np.nanpercentile(gauge, 5, axis=0)))
    usual, most = _AT_REST
    if choices.used.get("zero") == "gauge":  # a person knows that none of them goes to 0
        usual = most = max(usual, level)
    likely = (
        "neither 0, as a gauge shows at rest, nor the pressure of the air: --set zero=absolute where the air has so "
        f"little, high up; zero=tare, or zero={level:.4g}, where a sensor or regulator rests there; zero=gauge where "
        "no set goes to 0"
    )
    return Check("level at which all sets rest", level, (-usual, usual), (-np.inf, most), likely, "bar")


def lag_check(lag: float, error: float) -> Check:
    """Return the check of how much later one clock reads than another, and of the error of that [s]."""
    likely = "the clocks differ by this; it was taken off the time of the pressures"
    least = max(0.01, error)
    return Check("lag between two files", lag, (-least, least), ANY, likely, "s")


def _level_checks(pressures: Array) -> list[Check]:
    """Return the checks of what a gauge pressure in bar can be."""
    top, rest = float(np.max(pressures)), float(np.min(np.max(pressures, axis=1)))
    low = float(np.min(pressures))
    return [
        Check("highest pressure", top, (0.02, 3.0), (0.0, 50.0), "looks like kPa, mbar or psi read as bar", "bar"),
        Check(
            "lowest pressure",
            low,
            (-0.05, 0.8),
            ANY,
            "absolute read as gauge, or a zero that drifts; --set zero=tare",
            "bar",
        ),
        Check(
            "pressure at rest", rest, (-0.05, 0.8), ANY, "absolute pressures read as gauge; --set zero=absolute", "bar"
        ),
    ]
