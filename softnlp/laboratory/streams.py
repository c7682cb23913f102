"""Two recordings of one experiment: their clocks laid together, and what stands still taken as measurements."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.reading import shown
from softnlp.laboratory.choices import AskError, Choices
from softnlp.laboratory.clock import day_start
from softnlp.laboratory.imported import ANY, require_possible
from softnlp.laboratory.pressure import lag_check, pressures_of
from softnlp.laboratory.signals import Commands, changes, explained, lag_between, plateaus
from softnlp.laboratory.table import RawTable
from softnlp.studies.check import Check

Array = NDArray[np.float64]

_SURE = 0.6  # R^2 below which a lag cannot be told
_SAME, _DAY = 0.02, 86400.0  # of the range, of equal pressures; [s]


def with_pressures(
    columns: Mapping[str, Array], response: Array, table: RawTable, log: RawTable, choices: Choices
) -> tuple[dict[str, Array], list[Check], dict[str, float]]:
    """Return the columns of a stream with the pressures of a log beside them, checks, and the lag.

    columns : of the table, with t_s. response : (rows, channels) of them that pressures move.

    Raises
    ------
    AskError
        Where the pressures do not explain what moved at any lag.
    """
    command_time, pressures, checks = pressures_of(log, choices)
    if command_time is None:
        raise AskError(f"{log.file}: no column tells the time of the pressures: --set rate_Hz=…")
    time = columns["t_s"]
    lag, error = choices.number("lag_s", -1e9), 0.0
    if lag is not None:
        quality = explained(time, response, Commands(command_time, pressures), lag)
    else:
        lag, error, quality = lag_between(time, response, command_time, pressures)
        if quality < _SURE:
            raise AskError(
                f"{log.file}: its pressures explain {100 * quality:.0f} % of what moved, at best; say --set lag_s=…"
            )
        lag = choices.take("lag_s", round(lag, 4), f"the pressures then explain {100 * quality:.1f} % of what moved")
    checks += _shared_checks(time, command_time - lag, (table, log))
    require_possible(checks, choices)
    changed = _change_checks(time, response, command_time - lag, pressures)
    checks += changed if "x_mm" in columns else changed[:1]  # a force need not answer to every set
    rest = {name: column for name, column in columns.items() if name != "t_s"}
    rows, values = _rows(time, command_time - lag, pressures, response, choices)
    found = {"t_s": np.array([time[r].mean() for r in rows])}
    found |= {f"p{k + 1}_bar": column for k, column in enumerate(values.T)}
    found |= {name: np.array([column[r].mean() for r in rows]) for name, column in rest.items()}
    checks.append(lag_check(float(lag), error))
    likely = (
        "the pressures do not move what was measured: another experiment, another lag_s, or too few plateaus to tell"
    )
    checks.append(Check("part of the motion that the pressures explain", quality, (0.8, 1.0), (0.0, 1.0), likely))
    checks += _level_checks(values, np.array([response[r].mean(axis=0) for r in rows]))
    return found, checks, {"lag_s": float(lag), "lag_error_s": error}


def _shared_checks(time: Array, command_time: Array, tables: tuple[RawTable, RawTable]) -> list[Check]:
    """Return the checks of how much of the shorter recording the two share, at the lag and by the time of the day."""
    shorter = max(min(np.ptp(time), np.ptp(command_time)), 1e-9)

    def shared(later: float) -> float:
        return float(min(time[-1], command_time[-1] + later) - max(time[0], command_time[0] + later)) / shorter

    likely = "the two are not of one experiment, or another lag_s"
    found = [Check("time that two recordings share", max(0.0, shared(0.0)), (0.5, 1.01), (0.01, 1.01), likely)]
    starts = [day_start(table) for table in tables]
    if starts[0] is not None and starts[1] is not None:
        apart = (starts[1] - starts[0] + _DAY / 2) % _DAY - _DAY / 2
        by_clock = max(0.0, shared(apart - float(command_time[0] - time[0])))
        likely = "by their clocks the two were recorded at other times of the day: another experiment, or a wrong clock"
        found.append(Check("time that two recordings share by the day", by_clock, (0.5, 1.01), ANY, likely))
    return found


def _change_checks(time: Array, response: Array, command_time: Array, pressures: Array) -> list[Check]:
    """Return the checks of steps of the one recording at which the other stands still."""
    moves, steps = changes(time, response), changes(command_time, pressures)
    begin, end = max(time[0], command_time[0]), min(time[-1], command_time[-1])
    moves, steps = (c[(c[:, 0] >= begin) & (c[:, 1] <= end)] for c in (moves, steps))
    if len(moves) < 2 and len(steps) < 2:
        return []

    def alone(one: Array, other: Array) -> float:
        return (
            float(np.mean([not np.any((other[:, 0] <= b) & (other[:, 1] >= a)) for a, b in one])) if len(one) else 0.0
        )

    likely = "something moved while the pressures stood still: another experiment, another lag_s, or a load"
    back = "the pressures changed and nothing moved: another experiment, another lag_s, or a valve that did not open"
    return [
        Check("share of moves without a change of pressure", alone(moves, steps), (0, 0.1), ANY, likely),
        Check("share of changes of pressure without a move", alone(steps, moves), (0, 0.25), ANY, back),
    ]


def _level_checks(pressures: Array, response: Array) -> list[Check]:
    """Return the check of how far apart measurements at equal pressures are, over all of the motion."""
    if len(pressures) > 400:  # samples: their plateaus have been looked at
        return []
    size = max(float(np.max(np.ptp(pressures, axis=0))), 1e-9)
    sets = int(np.sum(np.ptp(pressures, axis=0) > _SAME * size))
    likely = "so few plateaus go with nearly any motion: take more levels, or see that the two are of one experiment"
    found = [
        Check("plateaus beyond those that any motion goes with", len(pressures) - sets - 1, (2, np.inf), ANY, likely)
    ]
    apart = np.max(np.abs(pressures[:, None] - pressures[None]), axis=2) / size
    away = np.linalg.norm(response[:, None] - response[None], axis=2)
    equal = np.triu(apart < _SAME, 1)
    if not np.any(equal):
        return found
    value = float(np.max(away[equal]) / max(float(np.max(away)), 1e-30))
    likely = "equal pressures did not move it to the same place: another experiment, another lag_s, creep or a slip"
    return [*found, Check("distance at equal pressures over the motion", value, (0, 0.2), ANY, likely)]


def _rows(
    time: Array, command_time: Array, pressures: Array, response: Array, choices: Choices
) -> tuple[list[NDArray[np.intp]], Array]:
    """Return the samples that each measurement is the mean of, and its pressures [bar]."""
    inside = (time >= command_time[0]) & (time <= command_time[-1])
    now = np.column_stack([np.interp(time, command_time, column) for column in pressures.T])
    still = [r[inside[r]] for r in plateaus(np.column_stack([response, now]))]
    still = [r for r in still if len(r)]
    if choices.get("rows") is None:
        share = sum(map(len, still)) / max(1, int(np.sum(inside)))
        reason = f"{len(still)} plateaus hold {100 * share:.0f} % of the samples; --set rows=samples takes each"
        guess = "plateaus" if share > 0.5 and len(still) > 1 else "samples"
        choices.take("rows", guess, reason)
    asked = choices.used["rows"]
    if asked == "plateaus":
        if not still:
            raise InputError("nothing stands still", key="rows")
        command = [np.median(now[r], axis=0) for r in still]
        return still, np.array(command)
    if asked != "samples":
        raise InputError(f"expected 'plateaus' or 'samples', got {shown(asked)}", key="rows")
    choices.drop(int(np.sum(~inside)), "samples outside of the log of the pressures")
    every = [np.array([k]) for k in np.flatnonzero(inside)]
    return every, now[inside]
