"""From a design scenario to a finished design."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from softnlp.model.contact_settings import ContactSettings
from softnlp.scenario.read import Scenario, scenario_of
from softnlp.studies.design import Design, design, finished
from softnlp.studies.design_candidate import Candidate
from softnlp.studies.design_task import DesignTask, Setting

Progress = Callable[[int, Candidate], None]


def run_design(scenario: Scenario, progress: Progress | None = None, workers: int = 1) -> Design:
    """Run a scenario of study "design".

    Parameters
    ----------
    scenario
        Of `softnlp.load_scenario`, of study "design".
    progress, workers
        As `softnlp.design`.

    Returns
    -------
    Design
        As `softnlp.design`.

    Raises
    ------
    InputError
        For anything but such a scenario, and as `softnlp.design`.
    """
    task = scenario_of(scenario, "design", "softnlp.run_design").task
    assert isinstance(task, DesignTask)
    return design(
        scenario.robot,
        scenario.material,
        task,
        loads=scenario.loads,
        contact=scenario.contact or ContactSettings(),
        coefficients=scenario.coefficients,
        conventions=scenario.conventions,
        numerics=scenario.numerics,
        title=scenario.title,
        workers=workers,
        progress=progress,
    )


def finished_design(scenario: Scenario, candidates: Sequence[Candidate]) -> Design:
    """Return the design of a scenario that was stopped after some candidates."""
    assert isinstance(scenario.task, DesignTask)
    setting = Setting(
        scenario.robot,
        scenario.material,
        scenario.coefficients,
        scenario.conventions,
        scenario.loads,
        scenario.contact or ContactSettings(),
        scenario.numerics,
    )
    return finished(setting, scenario.task, candidates, scenario.title)
