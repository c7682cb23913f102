"""A run as a self-describing netCDF dataset, with the shape of every step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.columns import OUTPUTS, Output
from softnlp.base.netcdf import dataset_bytes, flag_attributes, said
from softnlp.model.inputs import file_attributes, pressure_bar
from softnlp.model.quantities import Model
from softnlp.nlp.solver import EquationResidual
from softnlp.statics.step import Run, Step
from softnlp.studies.fields import (
    BLOCKED_FORCE,
    FLAGS,
    closure_of,
    dataset_outputs,
    left_by_weights,
    series,
    solved_pose,
)

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
Variable = tuple[tuple[str, ...], Any, dict[str, Any]]

AXES = ("x", "y", "z")


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
    """
    import xarray as xr

    steps, pressure = run.steps, OUTPUTS["pressure"]
    sizes = {
        "axis": 3,
        "row": 3,
        "col": 3,
        "chamber": run.robot.chambers,
        "s": max((_points(step) for step in steps), default=0),
    }
    variables: dict[str, Variable] = {
        pressure.key: (
            ("step", *pressure.dims),
            [pressure_bar(step.pressure) for step in steps],
            said(pressure.unit.attribute, pressure.meaning),
        ),
        "status": (("step",), _text([s.status.value for s in steps]), said("1", "how the step ended")),
        "message": (("step",), _text([s.message for s in steps]), said("1", "the same in words")),
        "warnings": (
            ("step",),
            _text(["; ".join(s.warnings) for s in steps]),
            said("1", "warnings of the step"),
        ),
    }
    variables |= {output.key: _variable(output, steps, sizes) for output in dataset_outputs(run)}
    variables |= _certificate(steps)
    if run.study == BLOCKED_FORCE:
        closures = _text([closure_of(run, step) or "" for step in steps])
        variables["closure"] = (("step",), closures, said("1", "which equations close the blocked shape"))
        variables |= _weighted(steps)
    model = Model(run.robot, run.material, run.coefficients, run.conventions)
    about = file_attributes(run.study, model, run.loads, run.contact, "warnings", run.warnings)
    return xr.Dataset(variables, coords=_coordinates(run, variables["arc"][1]), attrs={"title": run.title, **about})


def netcdf_bytes(run: Run) -> bytes:
    """Return the netCDF file of a run.

    It is made in memory: HDF5 writing to a full disk ends the interpreter instead of raising.
    """
    return dataset_bytes(to_dataset(run))


def _number(value: float | None) -> float:
    return float("nan") if value is None else float(value)


def _text(values: Sequence[str]) -> NDArray[np.object_]:
    return np.array(values, dtype=object)


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


def _spread(lines: Sequence[tuple[EquationResidual, ...]]) -> tuple[Array, dict[str, str]]:
    """Return (2, step, equation) value and scaled value, and each equation's unit, in order of first appearance."""
    units = {line.equation: line.unit for step in lines for line in step}
    column = {equation: k for k, equation in enumerate(units)}
    values = np.full((2, len(lines), len(units)), np.nan)
    for k, step in enumerate(lines):
        for line in step:
            values[:, k, column[line.equation]] = line.value, line.scaled
    return values, units


def _weighted(steps: Sequence[Step]) -> dict[str, Variable]:
    """Return what the `weighted` closure left as (step, weighted_equation); nothing for other closures."""
    values, units = _spread([left_by_weights(step) for step in steps])
    if not units:
        return {}
    dims, line = ("step", "weighted_equation"), ("weighted_equation",)
    return {
        **_by_unit("weighted_residual", dims, values[0], units, "what `weighted` left of each equation"),
        "weighted_residual_scaled": (dims, values[1], said("1", "the same, scaled as the certificate")),
        "weighted_residual_unit": (line, _text(list(units.values())), said("1", "unit of what was left")),
        "weighted_equation": (line, _text(list(units)), said("1", "equation that `weighted` weighs")),
    }


def _by_unit(
    name: str, dims: tuple[str, ...], values: Array, units: Mapping[str, str], meaning: str
) -> dict[str, Variable]:
    """Return values of equations (step, equation) as a variable for each unit, NaN at the equations of another one."""
    made: dict[str, Variable] = {}
    for unit in dict.fromkeys(units.values()):
        own = np.where([other == unit for other in units.values()], values, np.nan)
        label = name if unit == "1" else f"{name}_{unit.replace(' ', '')}"
        made[label] = (dims, own, said(unit, f"{meaning} that has this unit"))
    return made


def _certificate(steps: Sequence[Step]) -> dict[str, Variable]:
    """Return the certificates as (step, equation)."""
    values, units = _spread([step.certificate for step in steps])
    dims = ("step", "equation")
    return {
        **_by_unit("certificate", dims, values[0], units, "largest error of each equation"),
        "certificate_scaled": (
            dims,
            values[1],
            said("1", "the same: force by EI/L^2, moment by EI/L, length by L"),
        ),
        "equation_unit": (("equation",), _text(list(units.values())), said("1", "unit of the certificate")),
        "equation": (("equation",), _text(list(units)), said("1", "equation of the certificate")),
    }


def _coordinates(run: Run, arc: Array) -> dict[str, Variable]:
    robot = run.robot
    axes = {"axis": "axis", "row": "world axis", "col": "body axis"}
    coordinates: dict[str, Variable] = {
        "step": (("step",), np.arange(1, len(run.steps) + 1), said("1", "step of the run, from 1")),
        "set": (("set",), np.arange(1, robot.chamber_sets + 1), said("1", "chamber set, from 1")),
        "chamber": (("chamber",), np.arange(1, robot.chambers + 1), said("1", "chamber, set by set, from 1")),
        "chamber_set": (
            ("chamber",),
            np.array(robot.set_of_chamber) + 1,
            said("1", "set of each chamber, from 1"),
        ),
        **{name: ((name,), list(AXES), said("1", meaning)) for name, meaning in axes.items()},
    }
    if any(step.time is not None for step in run.steps):
        times = [_number(step.time) for step in run.steps]
        coordinates["t_s"] = (("step",), times, said("s", OUTPUTS["t"].meaning))
    solved = arc[~np.isnan(arc[:, :1]).all(axis=1)]
    if len(solved) and (solved == solved[0]).all():
        coordinates["s"] = (("s",), solved[0], said("1", OUTPUTS["arc"].meaning))
    return coordinates
