"""Paths of a scenario: their tables and file, what they ask, checked and in SI units, and the run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from softnlp.base.csv_columns import TIME_COLUMN, Columns, read_columns
from softnlp.base.errors import InputError
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.scenario.data import Read, Scenario, run_of
from softnlp.scenario.inverse import BoundsTable, Directions, Rows, pressures_of
from softnlp.scenario.obstacle_schema import MOST_OBSTACLES, ObstacleTable
from softnlp.scenario.schema import MOST_STEPS, FileName, NotNegative, Positive, ScenarioFile, Table
from softnlp.scenario.segments import allowed
from softnlp.statics.step import Run, Step
from softnlp.studies.targets import Target
from softnlp.studies.trajectory import followed_path, limits_of
from softnlp.studies.trajectory_problem import PathTask
from softnlp.studies.trajectory_solver import PathSolver

Array = NDArray[np.float64]

POSITION, DIRECTION = ("x_mm", "y_mm", "z_mm"), ("dx", "dy", "dz")
MOST_POINTS = min(MOST_STEPS, 1000)
"""How long a path may be: it is one program."""
_SECOND = 1.0  # from a point to the next, where nothing says when


class TrajectoryTable(Table):
    """[trajectory]: the path of the tip over time, what limits it, and what is made small.

    tip_position_mm : rows of x, y, z, evenly over duration_s; as in [[-20.0, 0.0, 62.0], [-18.0, 5.0, 62.0]]
    tip_direction : rows of a vector along which the tip is to point, one a position; as in [[0.0, 0.0, 1.0]]
    file : CSV with t_s, x_mm, y_mm, z_mm and, where wanted, dx, dy, dz; as in "path.csv"
    duration_s : from the first row to the last; by default a second from row to row; as in 10.0
    rate_bar_per_s : largest rate of change of any pressure; by default any; as in 0.2
    clearance_mm : least distance between the body and every [[obstacle]]; by default 0.0; as in 1.0
    minimise : where pressures are left to choose: their squares, or those of their changes
    length_per_radian_mm : weighs a direction against a position; by default the robot's length; as in 60.0
    """

    tip_position_mm: Rows | None = None
    tip_direction: Directions | None = None
    file: FileName | None = None
    duration_s: Positive | None = None
    rate_bar_per_s: Positive | None = None
    clearance_mm: NotNegative | None = None
    minimise: Literal["pressure", "rate"] = "pressure"
    length_per_radian_mm: Positive | None = None


class TrajectoryFile(ScenarioFile):
    """A whole scenario of `trajectory`."""

    trajectory: TrajectoryTable = Field(description="a table with one of tip_position_mm, file")
    bounds: BoundsTable = BoundsTable()
    obstacle: Annotated[list[ObstacleTable], Field(max_length=MOST_OBSTACLES)] = Field(default=[])


class _Path(NamedTuple):
    """positions : (T, 3) [m]. directions : (T, 3), None where there are none. times : (T,) [s]."""

    positions: Array
    directions: Array | None
    times: Array


def trajectory_task(given: Read) -> PathTask:
    """Return what is asked of the path.

    Raises
    ------
    InputError
        With the table and the key, for a path that does not fit, limits without what they limit, and an engine without
        IPOPT.
    """
    table: TrajectoryTable = given.file.trajectory
    path = _given(table, given.folder)
    lower, upper = pressures_of(given.file.bounds, given.robot.chamber_sets)
    if table.clearance_mm is not None and not given.file.obstacle:
        raise InputError("expected only beside [[obstacle]]", table="trajectory", key="clearance_mm")
    if path.directions is None and table.length_per_radian_mm is not None:
        raise InputError("expected only where directions are given", table="trajectory", key="length_per_radian_mm")
    if given.file.solver.engine == "newton":
        problem = "a path is one program, which IPOPT solves; expected 'auto' or 'ipopt', got 'newton'"
        raise InputError(problem, table="solver", key="engine")
    targets = tuple(
        Target(p, None if path.directions is None else path.directions[k]) for k, p in enumerate(path.positions)
    )
    weight = table.length_per_radian_mm
    return PathTask(
        targets=targets,
        times=path.times,
        lower=lower,
        upper=upper,
        rate=None if table.rate_bar_per_s is None else table.rate_bar_per_s * BAR,
        clearance=(table.clearance_mm or 0.0) * MILLIMETRE,
        minimise=table.minimise,
        length_per_radian=float(given.robot.length) if weight is None else weight * MILLIMETRE,
        allow=allowed(given.file),
    )


def _given(table: TrajectoryTable, folder: Path) -> _Path:
    """Return the path of the table, or of the file that it names."""
    sources = table.written(["tip_position_mm", "file"])
    if len(sources) != 1:
        raise InputError(
            f"expected exactly one of tip_position_mm, file, got {' and '.join(sources) or 'none'}",
            table="trajectory",
            key=sources[1] if sources else None,
        )
    if table.file is not None:
        table.refuse(["tip_direction", "duration_s"], "expected in the file only", "trajectory")
        return _read(read_columns(folder, table.file, (TIME_COLUMN, *POSITION)))
    rows, directions = table.tip_position_mm or [], table.tip_direction
    if directions is not None and len(directions) != len(rows):
        problem = f"expected one direction a position, got {len(directions)} for {len(rows)}"
        raise InputError(problem, table="trajectory", key="tip_direction")
    if len(rows) > MOST_POINTS:
        problem = f"expected at most {MOST_POINTS} rows, got {len(rows)}"
        raise InputError(problem, table="trajectory", key="tip_position_mm")
    if table.duration_s is None and table.rate_bar_per_s is not None and len(rows) > 1:
        raise InputError("missing; a rate takes a time", table="trajectory", key="duration_s")
    duration = table.duration_s or _SECOND * (len(rows) - 1)
    times = np.linspace(0.0, duration, len(rows))
    return _Path(np.array(rows, float) * MILLIMETRE, None if directions is None else np.array(directions), times)


def _read(columns: Columns) -> _Path:
    """Return the path of a file."""
    if len(columns.rows) > MOST_POINTS:
        raise InputError(f"expected at most {MOST_POINTS} rows, got {len(columns.rows)}", source=columns.file)
    times = columns.numbers(TIME_COLUMN)
    for k in np.flatnonzero(np.diff(times) <= 0)[:1] + 1:
        problem = f"expected a time after {times[k - 1]:g}, that of the row before, got {times[k]:g}"
        raise columns.wrong(int(k), TIME_COLUMN, problem)
    positions = np.column_stack([columns.numbers(name) for name in POSITION]) * MILLIMETRE
    known = [name for name in DIRECTION if name in columns]
    if not known:
        return _Path(positions, None, times)
    if missing := [name for name in DIRECTION if name not in columns]:
        raise InputError(f"missing column {missing[0]!r}, beside {known[0]!r}", source=columns.file)
    directions = np.column_stack([columns.numbers(name) for name in DIRECTION])
    sizes = np.linalg.norm(directions, axis=1)
    for k in np.flatnonzero(sizes == 0)[:1]:
        raise columns.wrong(int(k), DIRECTION[0], "expected a direction, got zeros")
    return _Path(positions, directions / sizes[:, None], times)


def run_trajectory(scenario: Scenario, progress: Callable[[int, Step], None] | None, branches: int = 0) -> Run:
    """Run a path, a step a target; `branches` means nothing here."""
    task = scenario.task
    assert isinstance(task, PathTask)
    solver = PathSolver(scenario.model, scenario.numerics, scenario.loads, task, scenario.obstacles)
    return replace(run_of(scenario, followed_path(solver, progress)), limits=limits_of(task))
