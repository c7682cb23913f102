"""A finished run of a scenario from its steps."""

from __future__ import annotations

from collections.abc import Iterable

from softnlp.scenario.read import Scenario
from softnlp.statics.step import Run, Step


def run_of(scenario: Scenario, steps: Iterable[Step], *notes: str) -> Run:
    """Return the run that these steps make of a scenario, with its warnings and then `notes`."""
    return Run(
        study=scenario.study,
        robot=scenario.robot,
        material=scenario.material,
        coefficients=scenario.coefficients,
        conventions=scenario.conventions,
        loads=scenario.loads,
        steps=tuple(steps),
        title=scenario.title,
        warnings=(*scenario.warnings, *notes),
        contact=scenario.contact,
    )
