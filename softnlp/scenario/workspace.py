"""A workspace sweep: the tables of a scenario, what they ask, checked and in SI units, its plan and the sweep."""

from __future__ import annotations

import json
import sys
import tempfile
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from contextlib import ExitStack
from os import PathLike
from typing import TYPE_CHECKING, Annotated, Any
from weakref import finalize

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from softnlp.base.errors import InputError, located, nearest
from softnlp.base.reading import shown
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.batch.plan import CHUNK, Plan, cells
from softnlp.model.contact_settings import require_in_front
from softnlp.model.materials import Material
from softnlp.model.outlined import require_round_layout
from softnlp.model.robot import Robot
from softnlp.model.segments import require_one_segment
from softnlp.scenario.blocked_force import SEVERAL, contact_settings
from softnlp.scenario.data import Read, Scenario, scenario_of
from softnlp.scenario.obstacle_schema import Obstacles
from softnlp.scenario.pressures import require_sets
from softnlp.scenario.schema import ContactTable, NotNegative, PressureTable, RegistrationTable, ScenarioFile, Table
from softnlp.statics.kept import pose_solver
from softnlp.statics.obstacle_solver import among_obstacles
from softnlp.sweep.manufacture import check_many
from softnlp.sweep.task import Axis, WorkspaceTask, combinations, pressure_table, varied_quantities, varied_table

if TYPE_CHECKING:  # imported where needed: to read a sweep starts no process
    from softnlp.sweep.read import Workspace
    from softnlp.sweep.run import Report, Stop, SweepSummary

Array = NDArray[np.float64]

MOST_LEVELS = 20_000_000
MOST_POSES = 20_000_000
_MATERIALS_AT_ONCE = 10_000


class WorkspaceTable(Table):
    """[workspace]: a grid or samples of pressures, and what else differs between poses.

    `vary` holds a table for each varied key, which `_axes` reads.

    levels : a grid, so many equal steps in each set; as in 5
    samples : or so many pressures scattered evenly; as in 1000
    from_bar : the lowest pressure of grid and samples
    to_bar : the highest; as in 1.0
    sets : that are swept, counted from 1; by default all; as in [1, 2]
    seed : of samples: another seed, other samples
    vary : what else differs between poses; as in { "robot.length_mm" = { from = 40.0, to = 60.0, levels = 3 } }
    """

    levels: Annotated[int, Field(ge=1, le=MOST_LEVELS)] | None = None
    samples: Annotated[int, Field(ge=1)] | None = None
    from_bar: NotNegative = 0.0
    to_bar: NotNegative | None = None
    sets: Annotated[list[int], Field(min_length=1)] | None = None
    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 0
    vary: dict[str, Any] = Field(default_factory=dict)


class WorkspaceFile(ScenarioFile):
    """A whole scenario of `workspace`."""

    obstacle: Obstacles = Field(default=[])
    workspace: WorkspaceTable = WorkspaceTable()
    pressure: PressureTable | None = None
    contact: ContactTable | None = None
    registration: RegistrationTable = RegistrationTable()


def workspace_task(given: Read) -> WorkspaceTask:
    """Return what is asked of a sweep.

    Raises
    ------
    InputError
        With the key (and the table where it is not [workspace]), for keys that do not go together, more than 20 million
        poses, or a varied robot that breaks a rule of manufacture.
    """
    file: WorkspaceFile = given.file
    table, wall, robot = file.workspace, file.contact, given.robot
    if wall is not None and wall.mode != "blocked":
        raise InputError(f"expected 'blocked' in a sweep, got {shown(wall.mode)}", table="contact", key="mode")
    if wall is not None:
        other = 'not in a sweep, which finds the force at every pressure; use study = "blocked-force"'
        wall.refuse(SEVERAL, other, "contact")
    _check_source(file)
    if wall is not None:
        with located(table="contact"):
            require_one_segment(robot, "a wall")
            require_round_layout(robot, "a wall in a sweep")
    if file.obstacle and (wall is not None or table.vary):
        key, other = ("contact", "a wall") if wall is not None else ("workspace", "vary")
        raise InputError(f"{other} takes no [[obstacle]] beside it; leave one of them out", table=key)
    if table.vary:
        with located(table="workspace.vary"):
            require_one_segment(robot, "a sweep of other numbers than pressures")
            require_round_layout(robot, "a sweep of other numbers than pressures")
    sets = list(range(1, robot.chamber_sets + 1)) if table.sets is None else table.sets
    require_sets(sets, robot.chamber_sets, "sets")
    task = WorkspaceTask(
        levels=table.levels,
        samples=table.samples,
        sets=tuple(one - 1 for one in sets),
        lowest=table.from_bar * BAR,
        highest=(table.to_bar or 0.0) * BAR,
        seed=table.seed,
        vary=_axes(file, given.material),
    )
    poses = task.step_count(len(given.steps.pressures))
    if poses > MOST_POSES:
        source = [*table.written(("samples", "levels")), "vary"][0]
        raise InputError(f"expected at most {MOST_POSES} poses, got {poses}", key=source)
    _check_varied(task, file, robot, given.material)
    if wall is not None:
        lengths = [v for axis in task.vary if axis.quantity == "robot.length" for v in axis.values.tolist()]
        with located(table="contact"):
            require_in_front(contact_settings(wall), lengths)
    return task


def _check_source(file: WorkspaceFile) -> None:
    """Require exactly one source of pressures, and the keys that go with it."""
    table = file.workspace
    sources = table.written(("levels", "samples"))
    if file.pressure is not None:
        sources.append("[pressure]")
    if len(sources) != 1:
        raise InputError(
            f"expected exactly one of levels, samples or [pressure], got {' and '.join(sources) or 'none'}",
            key=sources[0] if sources else None,
        )
    if sources == ["[pressure]"]:
        table.refuse(("to_bar", "from_bar", "sets"), "expected only with levels or samples, not with [pressure]")
    elif table.to_bar is None:
        raise InputError(f"missing; expected with {sources[0]}: the highest pressure in bar", key="to_bar")
    elif table.to_bar < table.from_bar:
        raise InputError(f"expected at least from_bar = {table.from_bar:g}, got {table.to_bar:g}", key="to_bar")
    if table.levels == 1:
        raise InputError("expected a whole number of at least 2, got 1", key="levels")
    if table.samples is None:
        table.refuse(["seed"], "expected only with samples")


def _axes(file: WorkspaceFile, material: Material) -> tuple[Axis, ...]:
    """Return what differs besides the pressures, in the order of the file."""
    kinds = varied_quantities(material, file.gravity.direction)
    axes = []
    for key, entry in _flat(file.workspace.vary).items():
        place = f"vary.{key}"
        if key not in kinds:
            raise InputError(f"unknown quantity{nearest(key, kinds)}", key=place)
        kind = kinds[key]
        if kind.quantity == "gravity" and not any(file.gravity.direction):
            raise InputError("expected only with a direction in [gravity], which is off", key=place)
        given = _values(entry, place, sampled=file.workspace.samples is not None)
        axes.append(Axis(key, kind.quantity, kind.place, np.asarray(given) * kind.scale))
    return tuple(axes)


def _flat(vary: Mapping[str, Any], above: str = "") -> dict[str, Any]:
    """Return the entries of `vary` by their dotted key: TOML reads robot.length_mm without quotes as a table of one."""
    flat: dict[str, Any] = {}
    for key, value in vary.items():
        if not above and "." not in key and isinstance(value, dict) and value and not {*value} & {*_ENTRY}:
            flat |= _flat(value, f"{key}.")
        else:
            flat[above + key] = value
    return flat


_ENTRY = ("from", "to", "levels", "values")


def _values(entry: Any, place: str, *, sampled: bool) -> list[float]:
    """Return the levels of one varied quantity, or both ends of its range where it is sampled, in file units."""
    wanted = "{ from, to }" if sampled else "{ from, to, levels } or { values }"
    if not isinstance(entry, dict):
        raise InputError(f"expected a table {wanted}, got {shown(entry)}", key=place)
    known = _ENTRY[:2] if sampled else _ENTRY
    for key in entry:
        if key not in _ENTRY:
            raise InputError(f"unknown key{nearest(str(key), known)}", key=f"{place}.{key}")
        if key not in known:
            raise InputError(f"not with samples; expected {wanted}", key=f"{place}.{key}")
    if "values" in entry:
        values = entry["values"]
        if len(entry) > 1:
            raise InputError(f"expected {wanted}, got both", key=place)
        if not isinstance(values, list) or not values:
            raise InputError(f"expected a list of at least 1 number, got {shown(values)}", key=f"{place}.values")
        return [_number(value, f"{place}.values") for value in values]
    for key in known[:2] if sampled else known[:3]:
        if key not in entry:
            raise InputError(f"missing; expected {wanted}", key=f"{place}.{key}")
    low, high = (_number(entry[key], f"{place}.{key}") for key in ("from", "to"))
    if sampled:
        return [low, high]
    levels = entry["levels"]
    if isinstance(levels, bool) or not isinstance(levels, int) or not 2 <= levels <= MOST_POSES:
        raise InputError(f"expected a whole number from 2 to {MOST_POSES}, got {shown(levels)}", key=f"{place}.levels")
    return [float(value) for value in np.linspace(low, high, levels)]


def _number(value: Any, place: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"expected a number, got {shown(value)}", key=place)
    if not abs(value) <= sys.float_info.max:
        raise InputError(f"expected a finite number, got {shown(value)}", key=place)
    return float(value)


def _check_varied(task: WorkspaceTask, file: WorkspaceFile, robot: Robot, material: Material) -> None:
    """Refuse varied dimensions of which no robot, and varied constants of which no silicone, can be made."""
    of_robot = {a.quantity.removeprefix("robot."): k for k, a in enumerate(task.vary) if a.quantity[:6] == "robot."}
    names = {f"material.{c.name}": c.name for c in material.law.constants}
    of_material = {names[a.quantity]: k for k, a in enumerate(task.vary) if a.quantity in names}
    if not of_robot and not of_material:
        return
    table = combinations(task) if task.samples is None else varied_table(task, 0)
    if of_robot:
        columns = table[:, list(of_robot.values())]
        if task.samples is None:  # each robot once, in the order in which they come
            columns = columns[np.sort(np.unique(columns, axis=0, return_index=True)[1])]
        try:
            check_many(
                robot,
                dict(zip(of_robot, columns.T, strict=True)),
                allow=file.robot.allow,
                minimum_wall=file.robot.minimum_wall_mm * MILLIMETRE,
            )
        except InputError as error:
            raise InputError(error.message, key="vary") from None
    for start in range(0, len(table) if of_material else 0, _MATERIALS_AT_ONCE):
        part = table[start : start + _MATERIALS_AT_ONCE]
        constants = {**material.constants, **{name: part[:, k] for name, k in of_material.items()}}
        try:
            Material(material.name, material.law, constants, material.density, material.fitted_stretch, material.set)
        except InputError as error:
            raise InputError(error.message, key="vary") from None


def plan_of(scenario: Scenario) -> Plan:
    """Return the plan of a scenario of study "workspace".

    Poses are numbered as `softnlp.sweep.task` lists them. Grids and samples are walked cell by cell, so that
    neighbours are solved together; pressures of the scenario's own in the order in which they are given.

    Raises
    ------
    InputError
        For anything else.
    """
    task = scenario_of(scenario, "workspace", "plan_of").task
    assert isinstance(task, WorkspaceTask)
    model = scenario.model
    if scenario.obstacles:
        with located(source=str(scenario.path)):
            among_obstacles(pose_solver(model, scenario.numerics), scenario.obstacles)
    pressures = pressure_table(task, scenario.robot.chamber_sets, scenario.pressures)
    varied, columns = _varied(task, scenario, len(pressures))
    values = np.ascontiguousarray(np.concatenate([pressures, *columns], axis=1))
    own_order = task.levels is None and task.samples is None
    return Plan(
        model=model,
        loads=scenario.loads,
        numerics=scenario.numerics,
        contact=scenario.contact,
        varied=("pressure", *varied),
        values=values,
        order=np.arange(len(values), dtype=np.int64) if own_order else cells(values, CHUNK),
        times=None if scenario.times is None else np.tile(scenario.times, len(values) // len(scenario.times)),
        obstacles=scenario.obstacles,
    )


def _varied(task: WorkspaceTask, scenario: Scenario, poses: int) -> tuple[list[str], list[Array]]:
    """Return the quantities that differ besides the pressures, and the columns of each as (poses, size), SI."""
    if not task.vary:
        return [], []
    table = varied_table(task, len(scenario.pressures))
    columns: dict[str, Array] = {}
    for axis, values in zip(task.vary, table.T, strict=True):
        if axis.place is None:
            columns[axis.quantity] = values[:, None]
        elif isinstance(axis.place, tuple):
            columns[axis.quantity] = values[:, None] * np.asarray(axis.place)
        else:
            nominal = np.asarray(getattr(scenario.loads, axis.quantity), float)
            vector = columns.setdefault(axis.quantity, np.tile(nominal, (poses, 1)))
            vector[:, axis.place] = values
    return list(columns), list(columns.values())


def run_sweep(
    scenario: Scenario | Plan,
    folder: str | PathLike[str],
    *,
    executor: Executor | None = None,
    workers: int = 1,
    resume: bool = False,
    progress: Report | None = None,
    stop: Stop | None = None,
    about: Mapping[str, str] | None = None,
    csv: bool = False,
) -> SweepSummary:
    """Solve every pose of a workspace and write `workspace.nc`: the same, whoever solves what and in how many runs.

    Parameters
    ----------
    scenario
        Of study "workspace", or a plan of one.
    folder
        Made where missing, for the journal and the result.
    executor
        Solves the chunks, such as that of a Dask client; None takes processes of this machine.
    workers
        Processes, which do not run a script again; this one alone for one worker or very few poses.
    resume
        Continue the sweep that has begun in the folder, if one has.
    progress
        Called where poses were confirmed, the first time after the workers have started.
    stop
        Asked now and then whether to stop; what is being solved is finished and kept.
    about
        Attributes of the result file beside those of a scenario, such as a title.
    csv
        Write `workspace.csv` as well; one that is there is replaced in any case.

    Returns
    -------
    SweepSummary
        Counts and files; `softnlp.sweep.read.load_workspace` reads the poses.

    Raises
    ------
    InputError
        For anything but such a scenario or a plan; where the folder holds another sweep, or cannot be written.
    SweepError
        Where workers die again and again, or a chunk cannot be solved. What was confirmed before is kept.
    """
    from softnlp.sweep.run import sweep

    told: dict[str, str] = {}
    if isinstance(scenario, Plan):
        plan = scenario
    else:
        plan = plan_of(scenario_of(scenario, "workspace", "softnlp.run_sweep"))
        warnings = json.dumps(scenario.warnings)
        told = {"title": scenario.title, "scenario": scenario.text, "warnings": warnings}
    return sweep(
        plan,
        folder,
        {**told, **(about or {})},
        executor=executor,
        workers=workers,
        resume=resume,
        progress=progress,
        stop=stop,
        csv=csv,
    )


def run_workspace(
    scenario: Scenario, progress: Callable[[int, Any], None] | None, workers: int, folder: str | PathLike[str] | None
) -> Workspace:
    """Solve every pose of a workspace and read them. folder : as `run_sweep`; None takes a temporary one."""
    from softnlp.sweep.read import load_workspace

    with ExitStack() as stack:
        place = folder or stack.enter_context(tempfile.TemporaryDirectory(prefix="softnlp-"))
        report = None if progress is None else lambda news: progress(news.done, news)
        run_sweep(scenario, place, workers=workers, progress=report)
        solved = load_workspace(place)
        finalize(solved, stack.pop_all().close)
    return solved
