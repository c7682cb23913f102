"""A tip over time of a scenario: the file that was measured, as a trace, and what `identify` is to find of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.columns import OUTPUTS
from softnlp.base.csv_columns import TIME_COLUMN, Columns
from softnlp.base.errors import InputError, located
from softnlp.base.ranges import noise_note, unit_note, without_noise
from softnlp.base.units import BAR
from softnlp.dynamics.simulation import Dynamics
from softnlp.scenario.data import Read, Scenario
from softnlp.scenario.dynamic import DynamicTask, dynamics_of, row_times
from softnlp.scenario.laboratory import import_notes, laboratory_columns
from softnlp.scenario.measured_rows import ALIASES, TIP_COLUMNS, named_columns, near_misses
from softnlp.scenario.pressures import require_no_gap
from softnlp.studies.trace import Trace, TraceErrors, checked_trace, simulated_tips, times_of, trace_errors

if TYPE_CHECKING:  # imported where needed: to read a scenario takes none of them
    from softnlp.studies.identify_motion import MotionFit

Array = NDArray[np.float64]

_OWN = (TIME_COLUMN, *TIP_COLUMNS, *ALIASES)
_SHOWN = 100  # outputs of a run that ends with a trace, at least


@dataclass(frozen=True, eq=False)
class MotionTask:
    """What is to be found of a tip over time.

    asked : with the start. trace, file : what was measured. pressures : (rows, sets) [Pa] at times (rows,) [s].
    forces : (rows, 3) at the tip [N], or None. free : names. bounds : by name [s or 1]. notes : on what was read.
    """

    asked: Dynamics
    trace: Trace
    file: str
    pressures: Array
    times: Array
    forces: Array | None
    free: tuple[str, ...]
    bounds: Mapping[str, tuple[float, float]]
    notes: tuple[str, ...] = ()

    def step_count(self, pressures: int) -> int:
        """Return one: it is solved as a whole."""
        return 1


def motion_task(given: Read, table: Any) -> MotionTask:
    """Return what is to be found. table : [measurements].

    Raises
    ------
    InputError
        With table and key, for tables that do not go together and files that do not fit.
    """
    file = given.file
    for name in file.written(("robots", "contact", "registration")):
        raise InputError("this table is not used with [dynamic]; remove it", table=name)
    for name in sorted(file.sigma.model_fields_set):
        raise InputError(
            "not used with [dynamic]: every row of a trace counts alike; remove it", table="sigma", key=name
        )
    file.dynamic.refuse(
        ("duration_s", "output_step_s"), "not used by study 'identify', which ends with the trace", "dynamic"
    )
    if not {"robot", "material"} <= set(given.data):
        missing = "robot" if "robot" not in given.data else "material"
        raise InputError("missing; expected the robot whose tip was measured", table=missing)
    trace, columns, notes = read_trace(given.folder, table.named(), getattr(table, "import"))
    sets = given.robot.chamber_sets
    if file.pressure is not None:
        times, pressures, forces = row_times(file.pressure, given.steps), given.steps.pressures, given.steps.forces
    else:
        times, pressures, more = _logged(columns, sets)
        forces, notes = None, (*notes, *more)
    asked = dynamics_of(file.dynamic, float(trace.times[-1]), float(trace.times[-1]) / _SHOWN)
    bounds = {name: (low, high) for name, (low, high) in table.bounds.items()}
    return MotionTask(asked, trace, columns.file, pressures, times, forces, tuple(table.free), bounds, notes)


def read_trace(
    folder: Path, files: Sequence[str], settings: Mapping[str, Any] | None = None
) -> tuple[Trace, Columns, tuple[str, ...]]:
    """Return the tips over time of a file, its columns, and what to know of it.

    Raises `InputError` for a file without times or tips, and for times that do not rise.
    """
    if len(files) != 1 and settings is None:
        raise InputError("expected one file of tips over time", key="files")
    columns, imported = laboratory_columns(folder, list(files), "tips", _OWN, settings)
    columns = named_columns(columns)
    if TIME_COLUMN not in columns or not any(name in columns for name in TIP_COLUMNS):
        missing = TIME_COLUMN if TIME_COLUMN not in columns else TIP_COLUMNS[0]
        words = f"missing column {missing!r}; expected tips over time, {TIME_COLUMN} and {', '.join(TIP_COLUMNS)}"
        misses = near_misses(columns, (TIME_COLUMN, *TIP_COLUMNS), "not read")
        raise InputError(words + (f" ({misses[0]})" if misses else ""), source=columns.file)
    t = columns.numbers(TIME_COLUMN)
    for row in np.flatnonzero(np.diff(t) <= 0)[:1] + 1:
        words = f"expected a time above {t[row - 1]:g}, that of the row before, got {t[row]:g}"
        raise columns.wrong(int(row), TIME_COLUMN, words)
    tip = np.column_stack([columns.numbers(name, blank=True) for name in TIP_COLUMNS]) * OUTPUTS["tip_position"].scale
    notes = () if imported is None else tuple(import_notes(imported))
    with located(source=columns.file):
        return checked_trace(t, tip), columns, (*notes, *near_misses(columns, TIP_COLUMNS, "not read"))


def _logged(columns: Columns, sets: int) -> tuple[Array, Array, tuple[str, ...]]:
    """Return times, pressures [Pa] and notes of a log that has both pressures and tips."""
    names = [f"p{k + 1}_bar" for k in range(sets)]
    for name in names:
        if name not in columns:
            words = f"missing column {name!r}; expected the pressures at the regulators beside the tips, or [pressure]"
            raise InputError(words, source=columns.file)
    times, readings = columns.numbers(TIME_COLUMN), np.column_stack([columns.numbers(name) for name in names])
    with located(source=columns.file):
        require_no_gap(times, columns.lines)
    notes = (*noise_note(readings), *unit_note(readings))
    return times, without_noise(readings) * BAR, notes


def run_motion(scenario: Scenario, progress: Callable[[int, float], None] | None = None) -> MotionFit:
    """Find what a scenario asks of a trace; `progress` is that of `identify_motion`.

    Raises
    ------
    InputError
        As `softnlp.studies.identify_motion.identify_motion`.
    """
    from dataclasses import replace

    from softnlp.studies.identify_motion import identify_motion

    task = scenario.task
    assert isinstance(task, MotionTask)
    with located(source=str(scenario.path), table="measurements"):
        found = identify_motion(
            scenario.robot,
            scenario.material,
            task.pressures,
            task.asked,
            task.trace,
            task.free,
            times=task.times,
            forces=task.forces,
            bounds=task.bounds,
            progress=progress,
            **scenario.settings,
        )
    return replace(found, warnings=(*task.notes, *found.warnings))


def compared_trace(scenario: Scenario, path: str | PathLike[str]) -> tuple[Trace, Array, TraceErrors, tuple[str, ...]]:
    """Return a measured trace, the tips of a scenario of `dynamic` at its times, how far they are apart, and notes.

    Raises
    ------
    InputError
        For a file that does not fit, and a motion that cannot be followed to its end.
    """
    from dataclasses import replace

    from softnlp.dynamics.drive import Series
    from softnlp.dynamics.sections import Failed
    from softnlp.dynamics.simulation import Simulation
    from softnlp.model.segments import body_of
    from softnlp.studies.dynamic import chosen_intervals, sentence, series_of

    task = scenario.task
    assert isinstance(task, DynamicTask)
    trace, columns, notes = read_trace(Path(), [str(path)])
    duration = float(trace.times[-1])
    asked = replace(task.asked, duration=duration)
    t, F = series_of(task.times, task.forces, len(scenario.pressures))
    body, both = body_of(scenario.model), (Series(t, scenario.pressures), Series(t, F))
    numerics = scenario.numerics
    try:
        intervals, _ = chosen_intervals(body, scenario.loads, both, numerics)
        tolerance = min(numerics.tolerance, 1e-8) / 10
        made = Simulation(
            body,
            scenario.loads,
            asked,
            *both,
            intervals=intervals,
            tolerance=tolerance,
            numerics=numerics,
            kept=times_of(trace),
        )
        tips = simulated_tips(made, trace.times.size)
    except Failed as failure:
        raise InputError(f"{columns.file}: {sentence(failure)}", source=str(scenario.path)) from None
    return trace, tips, trace_errors(trace, tips), notes
