"""From a scenario to the plan of its sweep."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softnlp.batch.plan import CHUNK, Plan, cells
from softnlp.scenario.read import Scenario, scenario_of
from softnlp.sweep.task import WorkspaceTask, pressure_table, varied_table

Array = NDArray[np.float64]


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
