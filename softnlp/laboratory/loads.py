"""Forces of a load cell: in newtons, without the bias at rest, perhaps beside the log of the pressures."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError, listed
from softnlp.base.reading import shown
from softnlp.laboratory.choices import AskError, Choices
from softnlp.laboratory.clock import time_of
from softnlp.laboratory.imported import Imported, require_possible
from softnlp.laboratory.pressure import is_pressure
from softnlp.laboratory.samples import sample_checks
from softnlp.laboratory.signals import noise, plateaus
from softnlp.laboratory.specimen import ALONG
from softnlp.laboratory.streams import with_pressures
from softnlp.laboratory.table import RawTable, in_si, no_unit
from softnlp.studies.check import Check

Array = NDArray[np.float64]

_FORCE, _MOMENT = r"^(force[ _]?)?f?[xyz]$", r"^(torque[ _]?|moment[ _]?)?[tm][xyz]$"
_COUNTS = r"counts? per {} {{0,3}}[:=]? {{0,3}}([\d.]+)"
_SETTLED = 0.2  # of the spread of a plateau: the first one stands for the bias


def force_columns(table: RawTable) -> list[int]:
    """Return the columns of the three components of a force, or of the one that there is."""
    every = [k for axis in "xyz" for k in table.named(rf"^((force|kraft)[ _]?)?f?[ _]?{axis}$")]
    found = [k for k in every if "f" in table.names[k].lower()]
    return found if len(found) == 3 else table.named(r"^(force|load|kraft|f)$")[:1]


def is_force(table: RawTable) -> bool:
    """Whether a table is of a load cell."""
    return bool(force_columns(table)) and not table.named(ALONG)


def import_force(tables: Sequence[RawTable], choices: Choices) -> Imported:
    """Return the forces of a load cell, at rest 0, with the pressures where their log is given too.

    Raises
    ------
    AskError
        Where the unit is not known.
    InputError
        For settings that do not fit, or a table without forces.
    """
    cells = [table for table in tables if force_columns(table)]
    logs = [table for table in tables if table not in cells and is_pressure(table)]
    if len(cells) != 1 or len(cells) + len(logs) != len(tables):
        raise InputError("expected one file of a load cell, and at most one log of pressures", key="FILE")
    table = cells[0]
    chosen = force_columns(table)
    time, checks = time_of(table, choices, need=bool(logs))
    force = np.column_stack([_newtons(table, k, choices) for k in chosen])
    known = np.all(np.isfinite(force), axis=1)
    choices.drop(int(np.sum(~known)), "rows with a missing cell")
    force, time = force[known], None if time is None else time[known]
    force = force - _bias(force, choices)
    names = ("fx_N", "fy_N", "fz_N") if len(chosen) == 3 else ("force_N",)
    columns = {} if time is None else {"t_s": time}
    columns |= dict(zip(names, force.T, strict=True))
    checks += sample_checks(columns, time, int(np.sum(~known)))
    top = float(np.max(np.linalg.norm(force, axis=1)))
    checks.append(Check("largest force", top, (0.005, 100.0), (0.0, 1e5), "looks like mN, kN or counts read as N", "N"))
    numbers = {"noise_N": float(max(map(noise, force.T)))}
    if logs and time is not None:
        columns, more, found = with_pressures(columns, force, table, logs[0], choices)
        checks, numbers = [*checks, *more], numbers | found
    require_possible(checks, choices)
    files = tuple(t.file for t in tables)
    return Imported("force", files, columns, tuple(checks), choices, numbers)


def _newtons(table: RawTable, k: int, choices: Choices) -> Array:
    """Return a column as a force; counts by what the preamble says of them."""
    known = in_si(table, k, "force", choices, "force")
    if known is not None:
        return known
    counts = choices.number("counts_per_N")
    if counts is None:
        said = re.search(_COUNTS.format("n(?!m)"), " ".join(table.preamble), re.IGNORECASE)
        if said is None:
            raise AskError(
                f"{table.file}: {no_unit(table, k, 'force')}: --set unit.force=N, or counts_per_N=…; it has "
                f"{listed(table.names)}"
            )
        counts = float(choices.take("counts_per_N", float(said[1]), f"{shown(said[0])} of the preamble"))
    plain: Array = table.columns[k]
    return plain / counts


def _bias(force: Array, choices: Choices) -> Array:
    """Return what is taken off: the force on the first plateau, or what is asked for [N]."""
    asked = choices.get("tare_N")
    if asked is not None:
        values = choices.numbers("tare_N", force.shape[1])
        return np.array(values)
    first = next(plateaus(force), None)
    if first is None or first[0] > max(3, 0.1 * len(force)):
        raise AskError("no rest at the start tells the bias: --set tare_N=[0, 0, 0], or the bias of each axis")
    bias = [round(float(v), 9) for v in np.mean(force[first], axis=0)]
    reason = f"the mean of the first {len(first)} samples, which stand still"
    return np.array(choices.take("tare_N", bias, reason))
