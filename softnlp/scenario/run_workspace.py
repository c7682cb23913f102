"""From a scenario of study "workspace" to its solved poses."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from contextlib import ExitStack
from os import PathLike
from typing import Any
from weakref import finalize

from softnlp.batch.plan import Plan
from softnlp.scenario.planning import plan_of
from softnlp.scenario.read import Scenario, scenario_of
from softnlp.sweep.read import Workspace, load_workspace
from softnlp.sweep.run import Report, Stop, SweepSummary, sweep


def run_sweep(
    scenario: Scenario | Plan,
    folder: str | PathLike[str],
    *,
    executor: Executor | None = None,
    workers: int = 1,
    resume: bool = False,
    progress: Report | None = None,
    stop: Stop | None = None,
    about: Mapping[str, str] | None = None,
    csv: bool = False,
) -> SweepSummary:
    """Solve every pose of a workspace and write `workspace.nc`: the same, whoever solves what and in how many runs.

    Parameters
    ----------
    scenario
        Of study "workspace", or a plan of one.
    folder
        Made where missing, for the journal and the result.
    executor
        Solves the chunks, such as that of a Dask client; None takes processes of this machine.
    workers
        Processes, which do not run a script again; this one alone for one worker or very few poses.
    resume
        Continue the sweep that has begun in the folder, if one has.
    progress
        Called where poses were confirmed, the first time after the workers have started.
    stop
        Asked now and then whether to stop; what is being solved is finished and kept.
    about
        Attributes of the result file beside those of a scenario, such as a title.
    csv
        Write `workspace.csv` as well; one that is there is replaced in any case.

    Returns
    -------
    SweepSummary
        Counts and files; `softnlp.sweep.read.load_workspace` reads the poses.

    Raises
    ------
    InputError
        For anything but such a scenario or a plan; where the folder holds another sweep, or cannot be written.
    SweepError
        Where workers die again and again, or a chunk cannot be solved. What was confirmed before is kept.
    """
    told: dict[str, str] = {}
    if isinstance(scenario, Plan):
        plan = scenario
    else:
        plan = plan_of(scenario_of(scenario, "workspace", "softnlp.run_sweep"))
        warnings = json.dumps(scenario.warnings)
        told = {"title": scenario.title, "scenario": scenario.text, "warnings": warnings}
    return sweep(
        plan,
        folder,
        {**told, **(about or {})},
        executor=executor,
        workers=workers,
        resume=resume,
        progress=progress,
        stop=stop,
        csv=csv,
    )


def run_workspace(
    scenario: Scenario, progress: Callable[[int, Any], None] | None, workers: int, folder: str | PathLike[str] | None
) -> Workspace:
    """Solve every pose of a workspace and read them. folder : as `run_sweep`; None takes a temporary one."""
    with ExitStack() as stack:
        place = folder or stack.enter_context(tempfile.TemporaryDirectory(prefix="softnlp-"))
        report = None if progress is None else lambda news: progress(news.done, news)
        run_sweep(scenario, place, workers=workers, progress=report)
        solved = load_workspace(place)
        finalize(solved, stack.pop_all().close)
    return solved
