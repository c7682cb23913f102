"""From a scenario to a finished run: which study is called with what."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from softnlp.runner_blocked import run_blocked
from softnlp.runner_inverse import run_inverse
from softnlp.runner_run import run_of
from softnlp.scenario import Scenario
from softnlp.studies.forward import forward
from softnlp.studies.step import Run, Step

Progress = Callable[[int, Step], None]


def run_scenario(scenario: Scenario, progress: Progress | None = None, branches: int = 0) -> Run:
    """Run the study of a scenario, every step in order.

    Parameters
    ----------
    scenario
        Of `softnlp.load_scenario`, of a study that is a run: forward, blocked-force or inverse.
    progress
        Called with the index and the step as each is done.
    branches
        As `softnlp.blocked_force`.

    Returns
    -------
    Run
        Its steps carry a solution or a named status.

    Raises
    ------
    InputError
        For pressures or loads that the study refuses.
    """
    return replace(STUDIES[scenario.study](scenario, progress, branches), warnings=scenario.warnings)


def partial_run(scenario: Scenario, steps: Sequence[Step]) -> Run:
    """Return the run of a scenario that was stopped after some steps; a warning says so."""
    note = f"stopped by the user after {len(steps)} of {scenario.step_count} steps"
    return run_of(scenario, steps, note)


def _forward(scenario: Scenario, progress: Progress | None, branches: int) -> Run:
    return forward(
        scenario.robot,
        scenario.material,
        scenario.pressures,
        loads=scenario.loads,
        coefficients=scenario.coefficients,
        conventions=scenario.conventions,
        numerics=scenario.numerics,
        times=None if scenario.times is None else scenario.times.tolist(),
        title=scenario.title,
        progress=progress,
    )


STUDIES: Mapping[str, Callable[[Scenario, Progress | None, int], Run]] = {
    "forward": _forward,
    "blocked-force": run_blocked,
    "inverse": run_inverse,
}
