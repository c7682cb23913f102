"""What any study found as one JSON document, which is what its command prints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from softnlp.base.errors import InputError
from softnlp.results.document import require_run, run_document
from softnlp.statics.step import Run

if TYPE_CHECKING:
    from softnlp.scenario.data import Scenario
    from softnlp.studies.design import Design
    from softnlp.studies.identified import Identified
    from softnlp.studies.tensile import TensileFit


def to_json(run: Run | Design | TensileFit | Identified, scenario: Scenario | None = None) -> dict[str, Any]:
    """Return what a study found as plain dicts, lists, strings, numbers and None; no NaN or infinity.

    Parameters
    ----------
    run
        Of any study but "workspace", whose results are a file.
    scenario
        Of study "identify", whose document says what was asked too.

    Returns
    -------
    dict
        What the command prints with --json. Numbers under keys with their unit, such as "tip_position_mm". A step
        without a solution keeps pressure, time, status, message, residual, certificate and warnings; its other numbers
        are None.

    Raises
    ------
    InputError
        For anything else, and for a fit without its scenario.
    """
    if isinstance(run, Run):  # what the others need takes time to import
        return run_document(run)
    from softnlp.results.design import design_document
    from softnlp.results.identify_document import robot_document, tensile_document
    from softnlp.results.motion_document import motion_document
    from softnlp.scenario.data import scenario_of
    from softnlp.scenario.motion import MotionTask
    from softnlp.studies.design import Design
    from softnlp.studies.identified import Identified
    from softnlp.studies.identify_motion import MotionFit
    from softnlp.studies.measurements import RobotTask, TensileTask
    from softnlp.studies.tensile import TensileFit

    if isinstance(run, Design):
        return design_document(run)
    if not isinstance(run, TensileFit | Identified | MotionFit):
        return run_document(require_run(run, "softnlp.to_json"))
    asked = scenario_of(scenario, "identify", "softnlp.to_json, of a fit,")
    if isinstance(run, TensileFit) and isinstance(asked.task, TensileTask):
        return tensile_document(asked, asked.task, run)
    if isinstance(run, Identified) and isinstance(asked.task, RobotTask):
        return robot_document(asked, asked.task, run)
    if isinstance(run, MotionFit) and isinstance(asked.task, MotionTask):
        return motion_document(asked, asked.task, run)
    raise InputError("expected the scenario of this fit, got that of another kind of measurement", key="scenario")
