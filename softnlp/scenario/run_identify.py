"""From a scenario of `identify` to the constants that it asks for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from softnlp.base.errors import located
from softnlp.base.statistics import NOTHING
from softnlp.model.contact_settings import ContactSettings
from softnlp.scenario.read import Scenario
from softnlp.studies.identified import Identified
from softnlp.studies.identify import identify
from softnlp.studies.measurements import RobotTask, TensileTask
from softnlp.studies.tensile import LawFit, TensileFit, fit_tensile, tensile_misfit

Progress = Callable[[int, float], None]


def run_identify(scenario: Scenario, progress: Progress | None = None) -> Identified | TensileFit:
    """Identify what a scenario asks for, from a tensile test, which has no progress, or from robots."""
    return run_tensile(scenario) if isinstance(scenario.task, TensileTask) else run_robots(scenario, progress)


def run_robots(scenario: Scenario, progress: Progress | None = None) -> Identified:
    """Identify constants from the measurements of robots; `progress` is that of `softnlp.identify`.

    Raises
    ------
    InputError
        As `softnlp.identify`.
    """
    task = scenario.task
    assert isinstance(task, RobotTask)
    with located(source=str(scenario.path), table="measurements"):
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
    with located(source=str(scenario.path), table="tensile"):
        fit = fit_tensile(
            task.stretch,
            task.stress,
            task.laws,
            name=task.name,
            density=task.density,
            start=task.start,
            numerics=scenario.numerics,
        )
    fits = {name: replace(law, warnings=(*law.warnings, *_further(task, law))) for name, law in fit.fits.items()}
    return replace(fit, fits=fits, checks=(*task.checks, *fit.checks))


def _further(task: TensileTask, fit: LawFit) -> tuple[str, ...]:
    """Say whether a fitted law is further from the data than the material before."""
    before = task.before
    was = np.inf if before is None else tensile_misfit(before, task.stretch, task.stress).rmse
    if before is None or not fit.misfit.rmse > was * (1 + NOTHING):
        return ()
    return (f"it is further from the data than {before.name} ({before.law.name}) before, by the rms error",)
