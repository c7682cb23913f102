"""From a scenario to a finished run: which study is called with what."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from softnlp.scenario import Scenario
from softnlp.studies.forward import forward
from softnlp.studies.step import Run, Step

Progress = Callable[[int, Step], None]


def run_scenario(scenario: Scenario, progress: Progress | None = None) -> Run:
    """Run the study of a scenario, every step in order; `progress` is called with each step as it is done."""
    run = forward(
        scenario.robot,
        scenario.material,
        scenario.pressures,
        loads=scenario.loads,
        coefficients=scenario.coefficients,
        conventions=scenario.conventions,
        numerics=scenario.numerics,
        times=scenario.times,
        title=scenario.title,
        progress=progress,
    )
    return replace(run, warnings=scenario.warnings)
