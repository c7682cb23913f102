"""Two recordings of one experiment: their clocks laid together, and what stands still taken as measurements."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.reading import shown
from softnlp.laboratory.choices import AskError, Choices
from softnlp.laboratory.pressure import lag_check, pressures_of
from softnlp.laboratory.signals import lag_between, plateaus
from softnlp.laboratory.table import RawTable
from softnlp.studies.check import Check

Array = NDArray[np.float64]

_SURE = 0.5  # R^2 below which a lag cannot be told


def with_pressures(
    columns: Mapping[str, Array], response: Array, log: RawTable, choices: Choices
) -> tuple[dict[str, Array], list[Check], dict[str, float]]:
    """Return the columns of a stream with the pressures of a log beside them, checks, and the lag.

    columns : with t_s. response : (rows, channels) of them that pressures move.

    Raises
    ------
    AskError
        Where the pressures do not explain what moved at any lag.
    """
    command_time, pressures, checks = pressures_of(log, choices)
    if command_time is None:
        raise AskError(f"{log.file}: no column tells the time of the pressures: --set rate_Hz=…")
    time = columns["t_s"]
    lag, error, quality = choices.number("lag_s", -1e9), 0.0, 1.0
    if lag is None:
        lag, error, quality = lag_between(time, response, command_time, pressures)
        if quality < _SURE:
            raise AskError(
                f"{log.file}: its pressures explain {100 * quality:.0f} % of what moved, at best; say --set lag_s=…"
            )
        lag = choices.take("lag_s", round(lag, 4), f"the pressures then explain {100 * quality:.1f} % of what moved")
    rest = {name: column for name, column in columns.items() if name != "t_s"}
    rows, values = _rows(time, command_time - lag, pressures, response, choices)
    found = {"t_s": np.array([time[r].mean() for r in rows])}
    found |= {f"p{k + 1}_bar": column for k, column in enumerate(values.T)}
    found |= {name: np.array([column[r].mean() for r in rows]) for name, column in rest.items()}
    checks.append(lag_check(float(lag)))
    likely = "the pressures do not move what was measured: another experiment, or another order of rows"
    checks.append(Check("part of the motion that the pressures explain", quality, (0.8, 1.0), (0.0, 1.0), likely))
    return found, checks, {"lag_s": float(lag), "lag_error_s": error}


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
