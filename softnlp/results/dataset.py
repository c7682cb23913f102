"""A run as a self-describing netCDF dataset, with the shape of every step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from softnlp.base.arrays import Array
from softnlp.base.columns import OUTPUTS, Output
from softnlp.base.netcdf import Variable, file_bytes, flag_attributes, said
from softnlp.base.units import MILLIMETRE, NEWTON_MILLIMETRE
from softnlp.model.inputs import file_attributes, pressure_bar
from softnlp.model.obstacle_tables import obstacle_tables
from softnlp.model.quantities import Model
from softnlp.nlp.solver import EquationResidual
from softnlp.results.document import require_run
from softnlp.statics.obstacle_step import names_of
from softnlp.statics.step import Run, Step
from softnlp.studies.fields import (
    BLOCKED_FORCE,
    FLAGS,
    closure_of,
    dataset_outputs,
    left_by_weights,
    series,
    sizes_of,
    solved_pose,
)

if TYPE_CHECKING:
    import xarray as xr

_CERTIFICATE = (
    "largest error of each equation",
    "the same: force by EI/L^2, moment by EI/L, length by L",
    "unit of the certificate",
    "equation of the certificate",
)
_WEIGHTED = (
    "what `weighted` left of each equation",
    "the same, scaled as the certificate",
    "unit of what was left",
    "equation that `weighted` weighs",
)


def to_dataset(run: Run) -> xr.Dataset:
    """Return a run as a dataset; every variable has `units` and `long_name`, every name its unit.

    Parameters
    ----------
    run
        Of any study that returns one.

    Returns
    -------
    xarray.Dataset
        Dimensions: `step`, `set` and `chamber` count from 1; `axis`, `row` (world) and `col` (body) are x, y, z; `s`
        runs
        along the rod, with the coordinate `s` = s/L where all solved steps share it (else see `arc`); `equation` names
        the
        lines of the certificate. Numbers of a step without a solution are NaN (`stable` is -1, as
        under a dead tip moment).

    Raises
    ------
    InputError
        For the result of another study, naming what takes it.
    """
    import xarray as xr

    variables, coordinates, attributes = _parts(require_run(run, "softnlp.to_dataset"))
    return xr.Dataset(variables, coords=coordinates, attrs=attributes)


def netcdf_bytes(run: Run) -> bytes:
    """Return the netCDF file of a run.

    It is made in memory: HDF5 writing to a full disk ends the interpreter instead of raising.
    """
    return file_bytes(*_parts(run))


def _parts(run: Run) -> tuple[dict[str, Variable], dict[str, Variable], dict[str, Any]]:
    """Return variables, coordinates and attributes: a run is written without xarray, which takes long to import."""
    steps, pressure = run.steps, OUTPUTS["pressure"]
    points = max((_points(step) for step in steps), default=0)
    sizes = {"axis": 3, "row": 3, "col": 3, **sizes_of(run), "s": points}
    variables: dict[str, Variable] = {
        pressure.key: (
            ("step", *pressure.dims),
            [pressure_bar(step.pressure) for step in steps],
            said(pressure.unit.attribute, pressure.meaning),
        ),
        "status": _words("step", [s.status.value for s in steps], "how the step ended"),
        "message": _words("step", [s.message for s in steps], "the same in words"),
        "warnings": _words("step", ["; ".join(s.warnings) for s in steps], "warnings of the step"),
    }
    variables |= {output.key: _variable(output, steps, sizes) for output in dataset_outputs(run)}
    variables |= _errors("certificate", "equation", "equation_unit", [s.certificate for s in steps], _CERTIFICATE)
    if run.study == BLOCKED_FORCE:
        closures = [closure_of(run, step) or "" for step in steps]
        variables["closure"] = _words("step", closures, "which equations close the blocked shape")
        if any(left := [left_by_weights(step) for step in steps]):
            variables |= _errors("weighted_residual", "weighted_equation", "weighted_residual_unit", left, _WEIGHTED)
    if run.obstacles:
        variables |= _contacts(run)
    model = Model(run.robot, run.material, run.coefficients, run.conventions)
    own: dict[str, Any] = {"warnings": list(run.warnings)}
    if run.obstacles:
        own["obstacles"] = obstacle_tables(run.obstacles)
    if run.limits:
        own["limits"] = dict(run.limits)
    about = file_attributes(run.study, model, run.loads, run.contact, own)
    return variables, _coordinates(run, variables["arc"][1]), {"title": run.title, **about}


def _contacts(run: Run) -> dict[str, Variable]:
    """Return what each obstacle does in each step (step, obstacle), NaN without a touch or a solution."""
    count, steps = len(run.obstacles), run.steps
    force = np.full((len(steps), count, 3), np.nan)
    ends, gap, left = (
        np.full((2, len(steps), count), np.nan),
        np.full((len(steps), count), np.nan),
        np.full(len(steps), np.nan),
    )
    for k, step in enumerate(steps):
        if solved_pose(step) is None:
            continue
        left[k] = np.nan if step.complementarity is None else step.complementarity / NEWTON_MILLIMETRE
        for j, contact in enumerate(step.contacts):
            force[k, j], gap[k, j] = contact.force, contact.gap / MILLIMETRE
            if contact.start is not None and contact.end is not None:
                ends[:, k, j] = contact.start, contact.end
    dims = ("step", "obstacle")
    return {
        "contact_force_N": ((*dims, "axis"), force, said("N", "force of the obstacle on the robot, world frame")),
        "contact_from_s": (dims, ends[0], said("1", "first point where it touches, s/L")),
        "contact_to_s": (dims, ends[1], said("1", "last point where it touches, s/L")),
        f"contact_{OUTPUTS['gap'].key}": (
            dims,
            gap,
            said("mm", "least distance to the body, < 0 overlaps between nodes"),
        ),
        "complementarity_Nmm": (("step",), left, said("N mm", "sum of each contact's force times its gap")),
        "obstacle": _words("obstacle", names_of(run.obstacles), "name of the obstacle"),
    }


def _words(along: str, texts: Sequence[str], meaning: str) -> Variable:
    return (along,), np.array(texts, dtype=object), said("1", meaning)


def _variable(output: Output, steps: Sequence[Step], sizes: Mapping[str, int]) -> Variable:
    """Return an output over the steps; a shape with fewer points than another is filled up with NaN at the tip."""
    flags = FLAGS.get(output.name)
    more = {} if flags is None else flag_attributes(flags)
    about = said(output.unit.attribute, output.meaning, **more)
    return ("step", *output.dims), series(output, steps, sizes), about


def _points(step: Step) -> int:
    """Return the points of a step's longest shape."""
    if (pose := solved_pose(step)) is None:
        return 0
    return max(pose.shape.arc.size, 0 if step.contact is None else step.contact.free.shape.arc.size)


def _errors(
    name: str,
    along: str,
    unit_name: str,
    lines: Sequence[tuple[EquationResidual, ...]],
    words: tuple[str, str, str, str],
) -> dict[str, Variable]:
    """Return errors of equations (step, equation) as a variable for each unit, NaN at the equations of another one.

    lines : of each step; equations stand in order of first appearance. words : of errors, scaled, units, equations.
    """
    units = {line.equation: line.unit for step in lines for line in step}
    column = {equation: k for k, equation in enumerate(units)}
    values = np.full((2, len(lines), len(units)), np.nan)
    for k, step in enumerate(lines):
        for line in step:
            values[:, k, column[line.equation]] = line.value, line.scaled
    dims, made = ("step", along), {}
    for unit in dict.fromkeys(units.values()):
        own = np.where([other == unit for other in units.values()], values[0], np.nan)
        label = name if unit == "1" else f"{name}_{unit.replace(' ', '')}"
        made[label] = (dims, own, said(unit, f"{words[0]} that has this unit"))
    return {
        **made,
        f"{name}_scaled": (dims, values[1], said("1", words[1])),
        unit_name: _words(along, list(units.values()), words[2]),
        along: _words(along, list(units), words[3]),
    }


def _coordinates(run: Run, arc: Array) -> dict[str, Variable]:
    robot = run.robot
    axes = {"axis": "axis", "row": "world axis", "col": "body axis"}
    coordinates: dict[str, Variable] = {
        "step": (("step",), np.arange(1, len(run.steps) + 1), said("1", "step of the run, from 1")),
        "set": (("set",), np.arange(1, robot.chamber_sets + 1), said("1", "chamber set, from 1")),
        "chamber": (("chamber",), np.arange(1, robot.chambers + 1), said("1", "chamber, set by set, from 1")),
        "chamber_set": (("chamber",), np.array(robot.set_of_chamber) + 1, said("1", "set of each chamber, from 1")),
        **{name: ((name,), list("xyz"), said("1", meaning)) for name, meaning in axes.items()},
    }
    if (count := sizes_of(run)["segment"]) > 1:
        coordinates["segment"] = (("segment",), np.arange(1, count + 1), said("1", "segment, base first, from 1"))
    if any(step.time is not None for step in run.steps):
        times = [np.nan if step.time is None else float(step.time) for step in run.steps]
        coordinates["t_s"] = (("step",), times, said("s", OUTPUTS["t"].meaning))
    solved = arc[~np.isnan(arc[:, :1]).all(axis=1)]
    if len(solved) and (solved == solved[0]).all():
        coordinates["s"] = (("s",), solved[0], said("1", OUTPUTS["arc"].meaning))
    return coordinates
