"""From a scenario of `inverse` to a run: a step a target."""

from __future__ import annotations

from collections.abc import Callable

from softnlp.scenario.partial import run_of
from softnlp.scenario.read import Scenario
from softnlp.statics.step import Run, Step
from softnlp.studies.inverse import follow_targets
from softnlp.studies.inverse_solver import InverseSolver
from softnlp.studies.targets import InverseTask

Progress = Callable[[int, Step], None]


def run_inverse(scenario: Scenario, progress: Progress | None, branches: int = 0) -> Run:
    """Run inverse kinematics; `branches` means nothing here."""
    task = scenario.task
    assert isinstance(task, InverseTask)
    solver = InverseSolver(scenario.model, scenario.numerics, scenario.loads, task, "newton")
    return run_of(scenario, follow_targets(solver, progress))
