"""From a scenario of `identify` to the constants that it asks for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from softnlp.contact_settings import ContactSettings
from softnlp.scenario import Scenario
from softnlp.studies.identified import Identified
from softnlp.studies.identify import identify
from softnlp.studies.identify_task import RobotTask, TensileTask
from softnlp.studies.tensile import TensileFit, fit_tensile

Progress = Callable[[int, float], None]


def run_robots(scenario: Scenario, progress: Progress | None = None) -> Identified:
    """Identify constants from the measurements of robots; `progress` is that of `softnlp.identify`.

    Raises
    ------
    InputError
        As `softnlp.identify`.
    """
    task = scenario.task
    assert isinstance(task, RobotTask)
    found = identify(
        task.measurements,
        scenario.material,
        task.free,
        coefficients=scenario.coefficients,
        bounds=task.bounds,
        contact=scenario.contact or ContactSettings(),
        loads=scenario.loads,
        conventions=scenario.conventions,
        numerics=scenario.numerics,
        progress=progress,
    )
    return replace(found, warnings=(*task.notes, *found.warnings))


def run_tensile(scenario: Scenario) -> TensileFit:
    """Fit the laws that a tensile test asks for.

    Raises
    ------
    InputError
        As `softnlp.fit_tensile`.
    """
    task = scenario.task
    assert isinstance(task, TensileTask)
    return fit_tensile(task.stretch, task.stress, task.laws, name=task.name, density=task.density, start=task.start)
