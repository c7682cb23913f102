"""Dynamics of a scenario: its tables, what they ask, checked and in SI units, and the run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, PlainValidator

from softnlp.base.errors import InputError
from softnlp.base.reading import shown
from softnlp.dynamics.simulation import LONGEST, Dynamics
from softnlp.scenario.data import Read, Scenario
from softnlp.scenario.pressures import PressurePath
from softnlp.scenario.schema import (
    MOST_STEPS,
    FileName,
    ImportSettings,
    NotNegative,
    Positive,
    ScenarioFile,
    Table,
    optional_keys,
    wrong,
)
from softnlp.scenario.values import is_number
from softnlp.statics.step import Run, Step

if TYPE_CHECKING:
    from softnlp.studies.modes import Modes

Array = NDArray[np.float64]

_GRAM = 1e-3
_OUTPUTS = 100  # in a run, where no step between them is asked for
_MOST_TIME_STEPS = 10_000_000


def _step(value: Any) -> float | None:
    """Return a step in seconds, None for "auto"."""
    if value == "auto":
        return None
    if not is_number(value) or value <= 0:
        raise wrong(f"expected 'auto' or a number above 0, got {shown(value)}")
    return float(value)


class DynamicPressureTable(optional_keys({"import": ImportSettings})):  # type: ignore[misc]
    """[pressure]: exactly one of sequence_bar and file; over time, linear between rows.

    t_s : the time of each row of sequence_bar; two rows of one time are a jump; not needed for one row, which is held;
        as in [0.0, 0.1]
    sequence_bar : a row for each time with one pressure a set; as in [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]
    file : CSV with t_s, p1_bar, p2_bar, ..., and fx_N, fy_N, fz_N of a force at the tip; as in "pressures.csv"
    import : settings of a file as a logger wrote it; as in { "unit.pressure" = "kPa" }
    """

    ramp: ClassVar[None] = None
    t_s: Annotated[list[float], Field(min_length=1, max_length=MOST_STEPS)] | None = None
    sequence_bar: Annotated[list[list[float]], Field(min_length=1)] | None = None
    file: FileName | None = None


class DynamicTable(Table):
    """[dynamic]: how long, in which steps, and what damps and delays.

    duration_s : of the run; by default until the last row of the pressures; as in 1.0
    step_s : the longest step of time, or "auto": chosen by its estimated error; by default "auto"; as in 0.001
    rule : in time; the trapezoid keeps the energy, BDF2 damps what is too fast for the step
    damping_s : Kelvin-Voigt time of all strains: stress is stiffness times (strain + damping_s times its rate)
    lag_s : of the pressure in the chambers behind that at the regulators, first order
    dead_time_s : before a change at a regulator reaches its chambers
    output_step_s : between the times that are kept; by default a hundredth of the duration; as in 0.01
    start : the pose at rest of the first row, or straight without pressure and load
    release : whether the tip load ends at t = 0
    tip_mass_g : a mass at the tip beside the silicone's
    step_accuracy : of "auto": largest estimated error of a position in one step, of the length
    """

    duration_s: Positive | None = None
    step_s: Annotated[float | None, PlainValidator(_step)] = None
    rule: Literal["trapezoid", "bdf2"] = "trapezoid"
    damping_s: NotNegative = 0.0
    lag_s: NotNegative = 0.0
    dead_time_s: NotNegative = 0.0
    output_step_s: Positive | None = None
    start: Literal["static", "rest"] = "static"
    release: bool = False
    tip_mass_g: NotNegative = 0.0
    step_accuracy: Positive = Dynamics.accuracy


class DynamicFile(ScenarioFile):
    """A whole scenario of `dynamic`."""

    pressure: DynamicPressureTable = Field(description="a table with one of sequence_bar, file")
    dynamic: DynamicTable = DynamicTable()


@dataclass(frozen=True, eq=False)
class DynamicTask:
    """What is asked over time. times : (rows,) of the pressures [s]. forces : (rows, 3) at the tip [N], or None."""

    asked: Dynamics
    times: Array
    forces: Array | None

    def step_count(self, pressures: int) -> int:
        """Return how many outputs there are."""
        return int(self.asked.outputs.size)


def dynamic_task(given: Read) -> DynamicTask:
    """Return what is asked of the motion.

    Raises
    ------
    InputError
        With the table and the key, for times that do not fit.
    """
    table: DynamicTable = given.file.dynamic
    times = row_times(given.file.pressure, given.steps)
    duration = table.duration_s
    if duration is None:
        if not times[-1] > 0:
            raise InputError("missing; the pressures say no time to go to", table="dynamic", key="duration_s")
        duration = float(times[-1])
    if duration > LONGEST:
        raise InputError(f"expected at most {LONGEST:g} s, got {duration:g} s", table="dynamic", key="duration_s")
    if table.step_s is not None and table.step_s > duration:
        problem = f"expected at most the duration of {duration:g} s, got {table.step_s:g} s"
        raise InputError(problem, table="dynamic", key="step_s")
    output = duration / _OUTPUTS if table.output_step_s is None else table.output_step_s
    if duration / output > MOST_STEPS:
        raise InputError(f"expected at most {MOST_STEPS} outputs, got {duration / output:.3g}", key="output_step_s")
    if table.step_s is not None and duration / table.step_s > _MOST_TIME_STEPS:
        raise InputError(f"expected at most {_MOST_TIME_STEPS} steps, got {duration / table.step_s:.3g}", key="step_s")
    asked = dynamics_of(table, duration, min(output, duration))
    return DynamicTask(asked, times, given.steps.forces)


def dynamics_of(table: DynamicTable, duration: float, output: float) -> Dynamics:
    """Return a table in SI units, with a duration and the time between outputs [s]."""
    return Dynamics(
        duration=duration,
        step=table.step_s,
        rule=table.rule,
        damping=table.damping_s,
        lag=table.lag_s,
        dead_time=table.dead_time_s,
        output_step=output,
        start=table.start,
        release=table.release,
        tip_mass=table.tip_mass_g * _GRAM,
        accuracy=table.step_accuracy,
    )


def row_times(table: DynamicPressureTable, steps: PressurePath) -> Array:
    """Return the time of each row [s]."""
    rows = len(steps.pressures)
    times = steps.times
    if table.t_s is not None:
        if table.file is not None:
            raise InputError("expected in the file only", table="pressure", key="t_s")
        times = np.array(table.t_s, float)
        if times.size != rows:
            raise InputError(f"expected {rows} times, one a row, got {times.size}", table="pressure", key="t_s")
        for k in np.flatnonzero(np.diff(times) < 0)[:1] + 1:
            problem = f"item {k + 1}: expected a time of at least {times[k - 1]:g}, as before it, got {times[k]:g}"
            raise InputError(problem, table="pressure", key="t_s")
    if times is None:
        if rows > 1:
            problem = f"missing; expected the time of each of the {rows} rows"
            raise InputError(problem, table="pressure", key="t_s")
        times = np.zeros(1)
    return times


def run_dynamic(scenario: Scenario, progress: Callable[[int, Step], None] | None, branches: int = 0) -> Run:
    """Run the motion, a step an output; `branches` means nothing here."""
    from softnlp.studies.dynamic import dynamic  # here, as in `modes_of`: files of other studies do without it

    task = scenario.task
    assert isinstance(task, DynamicTask)
    return dynamic(
        scenario.robot,
        scenario.material,
        scenario.pressures,
        task.asked,
        times=task.times,
        forces=task.forces,
        title=scenario.title,
        progress=progress,
        **scenario.settings,
    )


def modes_of(scenario: Scenario) -> Modes:
    """Return the modes about the pose at rest of the last pressures and loads of a scenario."""
    from softnlp.studies.modes import modes

    task, loads = scenario.task, scenario.loads
    more: dict[str, Any] = {}
    if isinstance(task, DynamicTask):
        asked = task.asked
        more = {"damping": asked.damping, "lag": asked.lag, "tip_mass": asked.tip_mass}
        if asked.release:
            loads = replace(loads, tip_force=(0.0, 0.0, 0.0), tip_moment=(0.0, 0.0, 0.0))
        if task.forces is not None:
            loads = replace(loads, tip_force=np.asarray(loads.tip_force, float) + task.forces[-1])
    settings = {**scenario.settings, "loads": loads}
    return modes(scenario.robot, scenario.material, scenario.pressures[-1], **settings, **more)
