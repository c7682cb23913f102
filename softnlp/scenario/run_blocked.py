"""From a scenario of `blocked-force` to a run: the force at each pressure, or what else was asked of the wall."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from softnlp.model.contact_settings import ContactTask
from softnlp.scenario.partial import run_of
from softnlp.scenario.read import Scenario
from softnlp.statics.step import Run, Step
from softnlp.studies.blocked_force import blocked_force, constrained_pose, force_against_offset
from softnlp.studies.force_inversion import pressure_for_force

Progress = Callable[[int, Step], None]


def run_blocked(scenario: Scenario, progress: Progress | None, branches: int = 0) -> Run:
    """Run a blocked force; `branches` other starts a step are tried for other equilibria.

    Raises
    ------
    InputError
        For pressures or loads that the study refuses.
    """
    contact, task = scenario.contact, scenario.task
    assert contact is not None
    assert isinstance(task, ContactTask)
    model = (scenario.robot, scenario.material)
    settings: dict[str, Any] = {
        "coefficients": scenario.coefficients,
        "conventions": scenario.conventions,
        "numerics": scenario.numerics,
    }
    if task.constrained:
        return _constrained(scenario, progress, settings)
    settings["loads"] = scenario.loads
    if task.target_force is not None:
        bound = scenario.pressures[-1]
        sets = np.flatnonzero(bound).tolist()
        _, step = pressure_for_force(*model, sets, task.target_force, contact, highest=float(bound.max()), **settings)
        if progress is not None:
            progress(0, step)
        return run_of(scenario, [step])
    settings |= {"title": scenario.title, "progress": progress}
    if task.offsets is not None:
        return force_against_offset(*model, scenario.pressures[0], task.offsets, contact, **settings)
    settings["weight_sensitivity"] = task.weight_sensitivity
    times = None if scenario.times is None else scenario.times.tolist()
    return blocked_force(*model, scenario.pressures, contact, times=times, branches=branches, **settings)


def _constrained(scenario: Scenario, progress: Progress | None, settings: dict[str, Any]) -> Run:
    """Run the loaded poses whose chambers are held at their free lengths."""
    assert scenario.contact is not None
    steps = []
    for k, pressure in enumerate(scenario.pressures):
        step = constrained_pose(
            scenario.robot,
            scenario.material,
            pressure,
            scenario.loads,
            scenario.contact.closure,
            weights=scenario.contact.weights,
            **settings,
        )
        if scenario.times is not None:
            step = replace(step, time=float(scenario.times[k]))
        steps.append(step)
        if progress is not None:
            progress(k, step)
    return run_of(scenario, steps)
