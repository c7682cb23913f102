"""From a scenario to a finished run: which study is called with what."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from os import PathLike
from typing import TYPE_CHECKING, Any

from softnlp.base.errors import InputError
from softnlp.base.processes import require_workers
from softnlp.scenario.blocked_force import run_blocked
from softnlp.scenario.data import Scenario, run_of, scenario_of
from softnlp.scenario.design import run_design
from softnlp.scenario.dynamic import run_dynamic
from softnlp.scenario.identify import run_identify
from softnlp.scenario.inverse import run_inverse
from softnlp.scenario.workspace import run_workspace
from softnlp.statics.step import Run, Step
from softnlp.studies.forward import forward
from softnlp.studies.uncertainty import Deviations

if TYPE_CHECKING:  # imported where needed: a run takes none of them
    from softnlp.studies.design import Design
    from softnlp.studies.identified import Identified
    from softnlp.studies.identify_motion import MotionFit
    from softnlp.studies.tensile import TensileFit
    from softnlp.sweep.read import Workspace

Progress = Callable[[int, Step], None]


def run_scenario(
    scenario: Scenario,
    progress: Callable[[int, Any], None] | None = None,
    branches: int = 0,
    *,
    workers: int = 1,
    folder: str | PathLike[str] | None = None,
) -> Run | Identified | MotionFit | TensileFit | Design | Workspace:
    """Run the study of a scenario.

    Parameters
    ----------
    scenario
        Of `softnlp.load_scenario`.
    progress
        Called with a count and what is done: each step, candidate, evaluation of a fit, or `SweepProgress`.
    branches
        As `softnlp.blocked_force`.
    workers
        As `softnlp.run_sweep` and `softnlp.design`; the other studies take one process.
    folder
        Of study "workspace" alone, as `softnlp.run_sweep`; without it a temporary one, kept as long as the result.

    Returns
    -------
    Run, Identified, MotionFit, TensileFit, Design or Workspace
        A run for forward, blocked-force, inverse and dynamic, whose steps carry a solution or a named status.

    Raises
    ------
    InputError
        For anything but a scenario, and for what the study refuses.
    """
    study = scenario_of(scenario, None, "softnlp.run_scenario").study
    require_workers(workers)
    if folder is not None and study != "workspace":
        raise InputError(f"only study 'workspace' takes one, not {study!r}; softnlp.save writes a run", key="folder")
    if study == "identify":
        return run_identify(scenario, progress)
    if study == "design":
        return run_design(scenario, progress, workers)
    if study == "workspace":
        return run_workspace(scenario, progress, workers, folder)
    return solve_steps(scenario, progress, branches)


def solve_steps(scenario: Scenario, progress: Progress | None = None, branches: int = 0) -> Run:
    """Run a scenario whose study is a run, every step in order; as `run_scenario`."""
    study = STUDIES[scenario.study]
    if scenario.uncertainty is None:
        run = study(scenario, progress, branches)
        own = run.warnings if scenario.study == "dynamic" else ()  # of the motion, beside those of the robot
        return replace(run, warnings=tuple(dict.fromkeys((*scenario.warnings, *own))))
    contact = scenario.contact if scenario.study == "blocked-force" else None
    deviations = Deviations(scenario.model, scenario.numerics, scenario.loads, contact, scenario.uncertainty)
    steps: list[Step] = []

    def keep(count: int, step: Step) -> None:
        steps.append(deviations.added(step))
        if progress is not None:
            progress(count, steps[-1])

    run = study(scenario, keep, branches)
    return replace(run, steps=tuple(steps), warnings=scenario.warnings, uncertainty=dict(scenario.uncertainty.written))


def partial_run(scenario: Scenario, steps: Sequence[Step]) -> Run:
    """Return the run of a scenario that was stopped after some steps; a warning says so."""
    note = f"stopped by the user after {len(steps)} of {scenario.step_count} steps"
    return run_of(scenario, steps, note)


def _forward(scenario: Scenario, progress: Progress | None, branches: int) -> Run:
    asked = {"title": scenario.title, "progress": progress, **scenario.settings}
    times = None if scenario.times is None else scenario.times.tolist()
    asked["obstacles"] = scenario.obstacles
    return forward(scenario.robot, scenario.material, scenario.pressures, times=times, **asked)


STUDIES: Mapping[str, Callable[[Scenario, Progress | None, int], Run]] = {
    "forward": _forward,
    "blocked-force": run_blocked,
    "inverse": run_inverse,
    "dynamic": run_dynamic,
}
