"""Sensitivities: exact derivatives of what a robot does by what it is made of and given, through the solved problem."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError, nearest
from softnlp.base.status import Status
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.numerics import Numerics
from softnlp.model.outlined import require_round_layout
from softnlp.model.quantities import Model
from softnlp.model.robot import LOWERABLE_RULES, Robot, check
from softnlp.model.rod import Loads
from softnlp.model.segments import require_one_segment
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.blocked_grid import Blocked
from softnlp.statics.kept import blocked_solver, pose_solver
from softnlp.statics.pose_grid import Solved
from softnlp.statics.solver import PoseSolver
from softnlp.statics.step import Step
from softnlp.statics.wall import checked_contact, standing_wall
from softnlp.studies.derivatives import (
    UNITS,
    LinearPoint,
    PoseDerivatives,
    blocked_point,
    checked_names,
    entries_of,
    is_straight,
    labels,
    quantities_of,
)
from softnlp.studies.forward import checked_loads, pressure_table

Array = NDArray[np.float64]

TIP = ("tip_position", "tip_rotation")
WRENCH = ("tip_force", "tip_moment")


@dataclass(frozen=True, eq=False)
class Sensitivities:
    """Derivatives of outputs by quantities at one solved step, world frame.

    Attributes
    ----------
    step
        The pose; where it has no solution every number here is NaN.
    outputs, output_units
        A name for each row, such as "tip_position.x", and its unit.
    quantities, quantity_units
        A name for each column, such as "robot.length", and its unit.
    values
        (outputs,) in their units [SI].
    nominal
        (quantities,) in their units [SI].
    matrix
        (outputs, quantities) derivatives, unit of the output over that of the quantity [SI].
    point
        For solving again nearby; None where no equation was differentiated.
    warnings
        Of the step, and why a row has no derivative.
    """

    step: Step
    outputs: tuple[str, ...]
    output_units: tuple[str, ...]
    quantities: tuple[str, ...]
    quantity_units: tuple[str, ...]
    values: Array
    nominal: Array
    matrix: Array
    point: LinearPoint | None
    warnings: tuple[str, ...] = ()

    @property
    def solved(self) -> bool:
        """Whether there are derivatives."""
        return bool(np.isfinite(self.matrix).any())

    def of(self, output: str, quantity: str) -> Array:
        """Return the derivatives of one output by one quantity: of "tip_position" by "pressure" they are (3, sets).

        Parameters
        ----------
        output, quantity
            A vector such as "tip_position", all its entries, or one entry, "tip_position.x".

        Returns
        -------
        array
            (rows, columns) of `matrix` [SI].

        Raises
        ------
        InputError
            For a name that is not there.
        """
        rows, columns = _where(self.outputs, output, "output"), _where(self.quantities, quantity, "quantity")
        block: Array = self.matrix[np.ix_(rows, columns)]
        return block

    @property
    def relative(self) -> Array:
        """Per cent of an output for a per cent of a quantity, (outputs, quantities) [1]; NaN where an output is 0."""
        with np.errstate(divide="ignore", invalid="ignore"):
            share: Array = self.matrix * self.nominal / self.values[:, None]
        return np.where(np.isfinite(share), share, np.nan)


def _where(names: Sequence[str], wanted: str, key: str) -> list[int]:
    """Return where a name is, or the entries of the vector that it names."""
    found = entries_of(names, wanted)
    if not found:
        raise InputError(f"no such {key} here{nearest(wanted, names)}", key=key)
    return found


def sensitivities(
    robot: Robot,
    material: Material,
    pressure: Any,
    *,
    outputs: Sequence[str] = TIP,
    by: Sequence[str] = ("pressure",),
    loads: Loads = Loads(),
    contact: ContactSettings | None = None,
    coefficients: Coefficients = Coefficients(),
    conventions: Conventions = REPRODUCTION,
    numerics: Numerics = Numerics(),
) -> Sensitivities:
    """Solve one pose, or one blocked force, and differentiate outputs by quantities.

    Parameters
    ----------
    robot, material
        As `softnlp.forward`.
    pressure
        (sets,) gauge [Pa].
    outputs
        Any of tip_position, tip_rotation (rotation vector, world frame), bending_angle, backbone_length, elongation,
        stretch, chamber_lengths and, with `contact`, blocked_force.
    by
        Any of pressure, tip_force, tip_moment, gravity, robot.DIMENSION, material.CONSTANT, material.density,
        stiffening.elongation, stiffening.bending, corrections.area, corrections.inertia, corrections.bore_fraction and,
        with `contact`, contact.wall_point, contact.tip_cap, contact.chamber_reaction; see `softnlp.model.quantities`.
    loads
        As `softnlp.forward`.
    contact
        A wall: the outputs are those of the blocked shape, and its free chamber lengths move along.
    coefficients, conventions, numerics
        As `softnlp.forward`.

    Returns
    -------
    Sensitivities
        Without numbers where the step has no solution; `step` says why.

    Raises
    ------
    InputError
        For unknown names, blocked_force without a wall, closure "weighted", pressures or loads out of range.
    RobotError
        For a robot that is geometrically impossible.
    """
    require_one_segment(robot, "a sensitivity")
    require_round_layout(robot, "a sensitivity")
    check(robot, allow=LOWERABLE_RULES)
    P = pressure_table(pressure, robot.chamber_sets)
    if len(P) != 1:
        raise InputError(f"expected one pressure a set, got {len(P)} steps", key="pressure")
    loads = checked_loads(loads)
    model = Model(robot, material, coefficients, conventions)
    if contact is None:
        poses = pose_solver(model, numerics)
        return pose_sensitivities(PoseDerivatives(poses), P[0], loads, outputs, by)
    return _blocked_sensitivities(model, numerics, P[0], loads, contact, outputs, by)


def pose_sensitivities(
    derivatives: PoseDerivatives, pressure: Array, loads: Loads, outputs: Sequence[str], by: Sequence[str]
) -> Sensitivities:
    """Return the sensitivities of one pose; `derivatives` keeps what is compiled for the next one.

    Raises
    ------
    InputError
        For unknown names.
    """
    known = quantities_of(derivatives.poses)
    rows = checked_names(outputs, [name for name in UNITS if name != "blocked_force"], "outputs")
    columns = checked_names(by, list(known), "by")
    return solved_sensitivities(derivatives, *derivatives.poses.solve(pressure, loads), rows, columns)


def solved_sensitivities(
    derivatives: PoseDerivatives, step: Step, solved: Solved | None, rows: tuple[str, ...], columns: tuple[str, ...]
) -> Sensitivities:
    """Return the sensitivities of a pose that is solved. rows, columns : names that are known."""
    if solved is None:
        return _empty(derivatives.poses, step, rows, columns, step.message)
    try:
        found = _empty(derivatives.poses, step, rows, columns, "")
        return _assembled(found, derivatives.at(solved, columns), rows)
    except np.linalg.LinAlgError:
        return _empty(derivatives.poses, step, rows, columns, _SINGULAR)


_SINGULAR = "the equations are singular here, at a fold or a branch point: there are no derivatives"


def _blocked_sensitivities(
    model: Model,
    numerics: Numerics,
    pressure: Array,
    loads: Loads,
    contact: ContactSettings,
    outputs: Sequence[str],
    by: Sequence[str],
) -> Sensitivities:
    """Return the sensitivities of one blocked force."""
    contact = checked_contact(contact, [model.robot])
    if contact.closure == "weighted":
        raise InputError(
            "expected 'free', 'compliant' or 'rigid': a blocked force of closure 'weighted' is a compromise that no "
            "equation fixes",
            key="closure",
        )
    solver = blocked_solver(model, numerics, contact)
    rows = checked_names(outputs, list(UNITS), "outputs")
    columns = checked_names(by, list(quantities_of(solver)), "by")
    wall = standing_wall(solver.poses, contact, pressure[None, :], loads)
    return pressed_sensitivities(solver, loads, *solver.solve(pressure, loads, wall), rows, columns)


def pressed_sensitivities(
    solver: BlockedSolver,
    loads: Loads,
    step: Step,
    found: Blocked | None,
    rows: tuple[str, ...],
    columns: tuple[str, ...],
) -> Sensitivities:
    """Return the sensitivities of a blocked pose that is solved. rows, columns : names that are known."""
    why = _SINGULAR
    if found is None and step.status is Status.SOLVED:
        why = "the tip only touches the wall: pressed further it has a force, moved away it has none"
    elif found is None and not step.status.has_solution:
        why = step.message
    else:
        try:
            if found is None:
                return _away_from_wall(solver, step, loads, rows, columns)
            if (point := blocked_point(solver, found, columns)) is not None:
                return _assembled(_empty(solver, step, rows, columns, ""), point, rows)
        except np.linalg.LinAlgError:
            pass
    return _empty(solver, step, rows, columns, why)


def _away_from_wall(
    solver: BlockedSolver, step: Step, loads: Loads, rows: tuple[str, ...], columns: tuple[str, ...]
) -> Sensitivities:
    """Return the sensitivities of a free shape that does not reach the wall: nothing changes its force of 0."""
    free = pose_sensitivities(
        PoseDerivatives(solver.poses),
        step.pressure,
        loads,
        [name for name in rows if name != "blocked_force"] or TIP,
        [name for name in columns if not name.startswith("contact.")] or ("pressure",),
    )
    found = _empty(solver, step, rows, columns, "")
    matrix, values, nominal = np.zeros_like(found.matrix), np.zeros_like(found.values), found.nominal.copy()
    (k, k_free), (j, j_free) = _common(found.outputs, free.outputs), _common(found.quantities, free.quantities)
    matrix[np.ix_(k, j)] = free.matrix[np.ix_(k_free, j_free)]
    values[k], nominal[j] = free.values[k_free], free.nominal[j_free]
    return replace(found, values=values, nominal=nominal, matrix=matrix, warnings=free.warnings)


def _common(names: Sequence[str], others: Sequence[str]) -> tuple[list[int], list[int]]:
    """Return where the names that are in both stand in each."""
    both = [name for name in names if name in others]
    return [names.index(name) for name in both], [others.index(name) for name in both]


def _empty(
    solver: PoseSolver | BlockedSolver, step: Step, rows: tuple[str, ...], columns: tuple[str, ...], why: str
) -> Sensitivities:
    """Return sensitivities without numbers."""
    known, sizes = (
        quantities_of(solver),
        {"tip_position": 3, "tip_rotation": 3, "chamber_lengths": solver.model.robot.chambers},
    )
    out = [(label, UNITS[name]) for name in rows for label in labels(name, sizes.get(name, 1))]
    of = [(label, known[name].unit) for name in columns for label in labels(name, known[name].size)]
    return Sensitivities(
        step=step,
        outputs=tuple(name for name, _ in out),
        output_units=tuple(unit for _, unit in out),
        quantities=tuple(name for name, _ in of),
        quantity_units=tuple(unit for _, unit in of),
        values=np.full(len(out), np.nan),
        nominal=np.concatenate([known[name].nominal for name in columns]),
        matrix=np.full((len(out), len(of)), np.nan),
        point=None,
        warnings=(why,) if why else (),
    )


def _assembled(found: Sensitivities, point: LinearPoint, rows: tuple[str, ...]) -> Sensitivities:
    """Fill in the derivatives of a solved point."""
    blocks = {name: point.derivative(name) for name in rows}
    warnings = list(found.step.warnings)
    if "bending_angle" in rows and is_straight(point):
        blocks["bending_angle"] = np.full_like(blocks["bending_angle"], np.nan)
        warnings.append("the robot is straight: its bending angle has a kink there, so it has no derivative")
    return replace(
        found,
        values=np.concatenate([point.value(name) for name in rows]),
        nominal=point.theta,
        matrix=np.vstack([blocks[name] for name in rows]),
        point=point,
        warnings=tuple(warnings),
    )


def tip_jacobian(robot: Robot, material: Material, pressure: Any, **settings: Any) -> Sensitivities:
    """Return how the tip moves with each pressure.

    Parameters
    ----------
    robot, material, pressure
        As `softnlp.sensitivities`.
    settings
        Its others, except `outputs` and `by`.

    Returns
    -------
    Sensitivities
        Its matrix is (6, sets): position [m/Pa] above rotation vector [rad/Pa].

    Raises
    ------
    InputError
        As `softnlp.sensitivities`.
    """
    return sensitivities(robot, material, pressure, outputs=TIP, by=("pressure",), **settings)


def tip_compliance(robot: Robot, material: Material, pressure: Any, **settings: Any) -> Sensitivities:
    """Return how the tip gives way to a wrench.

    The matrix is symmetric where no tip moment acts. A dead moment M has no potential: it leaves the inverse, the
    stiffness, an antisymmetric part in the rotations.

    Parameters
    ----------
    robot, material, pressure
        As `softnlp.sensitivities`.
    settings
        Its others, except `outputs` and `by`.

    Returns
    -------
    Sensitivities
        Its matrix is (6, 6): position [m] above rotation vector [rad], by force [N] and moment [N m].

    Raises
    ------
    InputError
        As `softnlp.sensitivities`.
    """
    return sensitivities(robot, material, pressure, outputs=TIP, by=WRENCH, **settings)
