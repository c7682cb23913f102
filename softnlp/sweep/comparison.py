"""Comparing a workspace with measured tips or with another workspace: pose by pose at equal pressures.

Poses that the workspace does not hold are solved for this, from the tables that its file carries.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from softnlp.base.arrays import Array, Index
from softnlp.base.columns import OUTPUTS
from softnlp.base.errors import InputError
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.model.conventions import Coefficients
from softnlp.model.inputs import conventions_of_table, loads_of_table
from softnlp.model.materials import material_from_table
from softnlp.model.quantities import Model
from softnlp.model.rod import Loads
from softnlp.rings import ENERGY
from softnlp.statics.step import Run, Step
from softnlp.studies.forward import forward
from softnlp.sweep.measured import Measured
from softnlp.sweep.read import Workspace
from softnlp.sweep.summary import varied_besides_pressure

BENDING = OUTPUTS["bending_angle"]
WITHIN = 1.0  # pressures that differ by no more are equal [Pa]
_SAME_TIP = 1e-3  # of L_0: poses at one pressure with tips farther apart differ in something else


@dataclass(frozen=True, eq=False)
class Comparison:
    """M pairs of tips at equal pressures; SI.

    length : L_0 [m]. against : what the workspace is compared with, in a word or two. pressure : (M, sets) [Pa], of the
    other. tip_position, other : (M, 3) [m]. angle : (M,) bending angle minus the other's [rad], None for a measurement.
    row : (M,) which row or pose of the other. solved_again : (M,) whether the pose was solved for this comparison.
    rows : of the other in all. unmatched : without a pose at their pressure. unsolved : whose pose, on either side, has
    no solution. skipped : with blanks. reason : why the unmatched were not solved, "" where there are none.
    """

    against: str
    length: float
    pressure: Array
    tip_position: Array
    other: Array
    angle: Array | None
    row: Index
    solved_again: NDArray[np.bool_]
    rows: int
    unmatched: int
    unsolved: int
    skipped: int
    reason: str

    @property
    def error(self) -> Array:
        """The tip minus the other (M, 3) [m]."""
        return self.tip_position - self.other

    @property
    def distance(self) -> Array:
        """Between the two tips (M,) [m]."""
        return np.asarray(np.linalg.norm(self.error, axis=1))


def compare_measured(
    workspace: Workspace,
    measured: Measured,
    *,
    within: float = WITHIN,
    solve: bool = True,
    progress: Callable[[int, int], None] | None = None,
) -> Comparison:
    """Compare measured tips with the poses at their pressures.

    Parameters
    ----------
    within : pressures of a pose and a row that differ by no more [Pa], in any set, are equal.
    solve : solve the poses at measured pressures that the workspace does not hold, where its file tells the model in
        full; otherwise those rows are counted as unmatched.
    progress : called with how many poses were solved and how many there are to solve.

    Raises
    ------
    InputError
        When no row is left to compare, or poses at one pressure differ in something else.
    """
    found = _nearest(workspace, measured.pressure, within)
    tip = np.full((len(found), 3), np.nan)
    has_pose = found >= 0
    tip[has_pose] = workspace.tip_position[found[has_pose]]
    missing = np.flatnonzero(~has_pose)
    reason, again = "", np.zeros(len(found), bool)
    if len(missing) and solve:
        try:
            run = solve_again(
                workspace,
                measured.pressure[missing],
                None if progress is None else lambda k, step: progress(k + 1, len(missing)),
            )
        except InputError as error:
            reason = error.message
        else:
            again[missing] = has_pose[missing] = True
            for k, step in zip(missing, run.steps, strict=True):
                if step.pose is not None and step.status.has_solution:
                    tip[k] = step.pose.tip_position
    elif len(missing):
        reason = "no further poses were to be solved"
    known = np.isfinite(tip).all(axis=1)
    _require_some(known, workspace, measured.file.name, within, reason)
    return Comparison(
        against="measured",
        length=float(workspace.robot.length),
        pressure=measured.pressure[known],
        tip_position=tip[known],
        other=measured.tip_position[known],
        angle=None,
        row=np.flatnonzero(known),
        solved_again=again[known],
        rows=len(known) + measured.skipped,
        unmatched=int(np.count_nonzero(~has_pose)),
        unsolved=int(np.count_nonzero(has_pose & ~known)),
        skipped=measured.skipped,
        reason=reason,
    )


def compare_workspaces(workspace: Workspace, other: Workspace, *, within: float = WITHIN) -> Comparison:
    """Compare the poses of another workspace with those of this one at the same pressures.

    Where both have the same pressures in the same order, pose is compared with pose; otherwise each pose of the other
    with the one at the nearest pressure, if that is within `within` [Pa] in every set.

    Raises
    ------
    InputError
        When the robots have different numbers of chamber sets, no pair is left, or poses at one pressure differ in
        something else.
    """
    P, Q = workspace.pressure, other.pressure
    if P.shape[1] != Q.shape[1]:
        raise InputError(
            f"expected a workspace of {P.shape[1]} chamber sets, got one of {Q.shape[1]}", source=str(other.file)
        )
    if P.shape == Q.shape and np.abs(P - Q).max() <= within:
        found = np.arange(len(P), dtype=np.int64)
    else:
        _require_one_tip(other)
        found = _nearest(workspace, Q, within)
    has_pose = found >= 0
    mine = np.where(has_pose, found, 0)
    known = has_pose & workspace.solved[mine] & other.solved
    _require_some(known, workspace, str(other.file), within, "")
    mine = mine[known]
    return Comparison(
        against=other.title,
        length=float(workspace.robot.length),
        pressure=Q[known],
        tip_position=workspace.tip_position[mine],
        other=other.tip_position[known],
        angle=workspace.bending_angle[mine] - other.bending_angle[known],
        row=np.flatnonzero(known),
        solved_again=np.zeros(int(known.sum()), bool),
        rows=len(Q),
        unmatched=int(np.count_nonzero(~has_pose)),
        unsolved=int(np.count_nonzero(has_pose & ~known)),
        skipped=0,
        reason="",
    )


def model_of(workspace: Workspace) -> tuple[Model, Loads]:
    """Return the robot, silicone and loads that every pose of a sweep shares.

    Raises
    ------
    InputError
        When poses differ in more than pressure, when they stand at a wall, or when the file does not tell the model in
        full (a law of one's own).
    """
    source = str(workspace.file)
    if varied := varied_besides_pressure(workspace):
        raise InputError(f"expected a sweep of pressures alone; this varies {', '.join(varied)} too", source=source)
    if "contact" in workspace.attributes:
        raise InputError("expected a sweep of free poses; this one stands at a wall", source=source)
    try:
        tables = workspace.attributes
        made = replace(material_from_table(tables["material"]), set=tables.get("material_set", ""))
        known = {f.name for f in fields(Coefficients)}
        coefficients = Coefficients(**{k: float(v) for k, v in tables["coefficients"].items() if k in known})
        told = tables["conventions_in_full"]
        conventions = ENERGY if told.get("rings") else conventions_of_table(told)
        return Model(workspace.robot, made, coefficients, conventions), loads_of_table(tables["loads"])
    except (KeyError, TypeError, ValueError) as error:
        reason = error.message if isinstance(error, InputError) else f"no {error}"
        raise InputError(f"the file does not tell the model in full: {reason}", source=source) from None


def solve_again(workspace: Workspace, pressures: Array, progress: Callable[[int, Step], None] | None = None) -> Run:
    """Solve the poses at further pressures (M, sets) [Pa] of a sweep's robot.

    Raises
    ------
    InputError
        As `model_of`.
    """
    model, loads = model_of(workspace)
    return forward(
        model.robot,
        model.material,
        pressures,
        loads=loads,
        coefficients=model.coefficients,
        conventions=model.conventions,
        progress=progress,
    )


def _nearest(workspace: Workspace, pressures: Array, within: float) -> Index:
    """Return the pose at each row of pressures (M,), -1 where none is within so much in every set."""
    from scipy.spatial import cKDTree

    if not (np.isfinite(within) and within >= 0):
        raise InputError(f"expected a number of at least 0, got {within:g}", key="within")
    _require_one_tip(workspace)
    distance, found = cKDTree(workspace.pressure).query(pressures, p=np.inf)
    return np.where(distance <= within, found, -1).astype(np.int64)


def _require_one_tip(workspace: Workspace) -> None:
    """Refuse a sweep where the pressures alone do not say which pose is meant."""
    P = np.round(workspace.pressure / WITHIN)
    order = np.lexsort(P.T)
    same = (np.diff(P[order], axis=0) == 0).all(axis=1)
    apart = np.linalg.norm(np.diff(workspace.tip_position[order], axis=0), axis=1)
    if np.any(apart[same] > _SAME_TIP * float(workspace.robot.length)):
        raise InputError(
            "expected one pose at each pressure; this sweep has several, which differ in something else",
            source=str(workspace.file),
        )


def _require_some(known: NDArray[np.bool_], workspace: Workspace, other: str, within: float, reason: str) -> None:
    if not known.any():
        why = f" ({reason})" if reason else ""
        raise InputError(
            f"no pose of {workspace.file} is within {within / BAR:g} bar of a pressure of {other} and solved{why}"
        )


def comparison_rows(comparison: Comparison, measured: Measured | None = None) -> tuple[list[str], Iterator[list[str]]]:
    """Return the header of a comparison as CSV and what yields its rows.

    A measured file's own columns come first, as they stand in it; otherwise the pose's number and its pressures.
    """
    mm = [OUTPUTS[f"tip_{axis}"].measured for axis in "xyz"]
    header = ["pose", *(f"p{k + 1}_bar" for k in range(comparison.pressure.shape[1])), *(f"other_{x}" for x in mm)]
    if measured is not None:
        header = list(measured.header)
    header += [*(f"simulated_{x}" for x in mm), *(f"error_{x}" for x in mm), "error_mm", "error_percent"]
    header += [f"{BENDING.name}_difference_{BENDING.unit}"] * (comparison.angle is not None)
    header += ["pose_from"] * (measured is not None)
    return header, _rows(comparison, measured)


def _rows(c: Comparison, measured: Measured | None) -> Iterator[list[str]]:
    columns = [c.tip_position / MILLIMETRE, c.error / MILLIMETRE, c.distance / MILLIMETRE, 100 * c.distance / c.length]
    if measured is None:
        columns = [c.pressure / BAR, c.other / MILLIMETRE, *columns]
    if c.angle is not None:
        columns.append(BENDING.shown(c.angle))
    table = np.column_stack(columns)
    for k, row in enumerate(c.row.tolist()):
        numbers = [f"{value:.9g}" for value in table[k].tolist()]
        if measured is None:
            yield [str(row + 1), *numbers]
        else:
            yield [*measured.cells[row], *numbers, "solved" if c.solved_again[k] else "workspace"]
