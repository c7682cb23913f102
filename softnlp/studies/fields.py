"""How to get the outputs of `softnlp.base.columns` from a step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.columns import Output, outputs
from softnlp.model.segments import SegmentedRobot
from softnlp.nlp.solver import EquationResidual
from softnlp.statics.step import SELF_INTERSECTING_FLAGS, STABLE_FLAGS, Pose, Run, Step, stable_flag

BLOCKED_FORCE, INVERSE, DYNAMIC, TRAJECTORY = "blocked-force", "inverse", "dynamic", "trajectory"
AIMED = (INVERSE, TRAJECTORY)
"""The studies whose steps have targets."""

FLAGS: Mapping[str, Mapping[str, int]] = {"stable": STABLE_FLAGS, "self_intersecting": SELF_INTERSECTING_FLAGS}
"""What files of numbers hold of the outputs that are true, false or neither."""

_KNOWN_OF_FAILED = ("target", "margins", "certificate")


def solved_pose(step: Step) -> Pose | None:
    """Return the pose of a step that carries a solution, else None: no number of another step is ever shown."""
    return step.pose if step.status.has_solution else None


def si_value(output: Output, step: Step) -> Any:
    """Return an output of a step in SI, None where it has none."""
    if output.group not in _KNOWN_OF_FAILED and solved_pose(step) is None:
        return None
    return output.found(step)


def value(output: Output, step: Step) -> Any:
    """Return an output of a step in the unit that it is shown in, None where it has none."""
    found = si_value(output, step)
    return None if found is None else output.shown(found)


def series(output: Output, steps: Sequence[Step], sizes: Mapping[str, int], of: Any = value) -> NDArray[Any]:
    """Return an output of every step, nan where there is none; flags as int8.

    sizes : of the dimensions; what is shorter is filled up with nan. of : `value`, or `si_value`.
    """
    if output.name in FLAGS:
        return np.array([stable_flag(of(output, step)) for step in steps], np.int8)
    array = np.full((len(steps), *(sizes[d] for d in output.dims)), np.nan)
    for k, step in enumerate(steps):
        if (found := of(output, step)) is not None:
            entries = np.asarray(found, dtype=float)
            array[k, ...][tuple(slice(n) for n in entries.shape)] = entries
    return array


def document_outputs(run: Run) -> tuple[Output, ...]:
    """Return what JSON holds of a step, in order, beside its segments."""
    weights = any(step.contact is not None and step.contact.sensitivity for step in run.steps)
    return (
        *(outputs("target") if run.study in AIMED else ()),
        *(outputs("margins") if run.study == TRAJECTORY else ()),
        *outputs("pose"),
        *(outputs("motion") if run.study == DYNAMIC else ()),
        *(outputs("wall") if run.study == BLOCKED_FORCE else ()),
        *(outputs("weights") if weights else ()),
        *deviation_outputs(run),
        *outputs("solve"),
    )


def deviation_outputs(run: Run) -> tuple[Output, ...]:
    """Return the standard deviations that a run has."""
    known = outputs("std") if run.uncertainty else ()
    return tuple(o for o in known if run.study == BLOCKED_FORCE or o.name != "std_blocked_force")


def table_outputs(run: Run) -> tuple[Output, ...]:
    """Return what CSV holds of a step: the same, and each of several segments."""
    return (*document_outputs(run), *(outputs("segments") if isinstance(run.robot, SegmentedRobot) else ()))


def sizes_of(run: Run) -> dict[str, int]:
    """Return the sizes of the dimensions of outputs that depend on the robot."""
    robot = run.robot
    sets = {"set": robot.chamber_sets, "chamber": robot.chambers}
    return {**sets, "segment": len(robot.segments) if isinstance(robot, SegmentedRobot) else 1}


def dataset_outputs(run: Run) -> tuple[Output, ...]:
    """Return what netCDF holds of a step: the same, the section, and shapes along the rod."""
    free = outputs("free") if run.study == BLOCKED_FORCE else ()
    outline = outputs("outline") if isinstance(run.robot, SegmentedRobot) else ()
    return (*table_outputs(run), *outputs("certificate", "section", "shape"), *outline, *free)


def closure_of(run: Run, step: Step) -> str | None:
    """Return the closure of a step, known of a failed one by what was asked."""
    if step.contact is not None:
        return step.contact.closure
    return None if run.contact is None else run.contact.closure_name


def left_by_weights(step: Step) -> tuple[EquationResidual, ...]:
    """Return what `weighted` left of its equations, nothing for other closures and failed steps."""
    return step.contact.weighted if step.contact is not None and step.status.has_solution else ()
