"""Blocked tip force: how hard the tip pushes against a wall, by pressure or by the wall's offset."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.model.contact_settings import Closure, ClosureWeights, ContactSettings
from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.robot import LOWERABLE_RULES, Robot, check
from softnlp.model.rod import Loads
from softnlp.model.segments import SegmentedRobot, require_one_segment
from softnlp.statics.blocked_grid import Blocked
from softnlp.statics.kept import blocked_solver
from softnlp.statics.multistart import other_equilibria
from softnlp.statics.step import Run, Step
from softnlp.statics.wall import Wall, checked_contact, standing_wall
from softnlp.studies.blocked_chain import ChainWall
from softnlp.studies.forward import checked_loads, followed, pressure_table
from softnlp.studies.weight_sensitivity import given_weights, sensitivities

Array = NDArray[np.float64]


def blocked_force(
    robot: Robot,
    material: Material,
    pressures: Any,
    contact: ContactSettings = ContactSettings(),
    *,
    loads: Loads = Loads(),
    coefficients: Coefficients = Coefficients(),
    conventions: Conventions = REPRODUCTION,
    numerics: Numerics = Numerics(),
    times: Sequence[float] | None = None,
    title: str = "",
    progress: Callable[[int, Step], None] | None = None,
    branches: int = 0,
    weight_sensitivity: bool = False,
) -> Run:
    """Solve the blocked tip force at each pressure in order, each followed from zero pressure or from the last.

    Parameters
    ----------
    robot, material, pressures
        As `softnlp.forward`.
    contact
        The wall, the tip's cap and the closure.
    loads, coefficients, conventions, numerics, times, title, progress
        As `softnlp.forward`; k_c of `compliant` is `coefficients.chamber_reaction`.
    branches
        How many other first guesses are tried at each step; other equilibria found are warnings of the step.
    weight_sensitivity
        Whether `contact` of each step says how the force of `weighted` answers to each weight that is given.

    Returns
    -------
    Run
        Its steps carry the blocked shape and `contact`, or a named status where there is none.

    Raises
    ------
    RobotError
        For a robot that is geometrically impossible.
    InputError
        For pressures, loads or a contact of the wrong shape, not finite, or out of range.
    """
    warnings = check(robot, allow=LOWERABLE_RULES)
    P = pressure_table(pressures, robot.chamber_sets)
    loads, contact = checked_loads(loads), checked_contact(contact, [robot])
    if times is not None and len(times) != len(P):
        raise InputError(f"expected one time a step, got {len(times)} times for {len(P)} steps", key="times")
    if branches < 0:
        raise InputError(f"expected a number that is not negative, got {branches}", key="branches")
    if weight_sensitivity:
        given_weights(contact)
    model = Model(robot, material, coefficients, conventions)
    if isinstance(robot, SegmentedRobot):
        if branches or weight_sensitivity:
            require_one_segment(robot, "a search of other branches")
        chain = ChainWall(model, numerics, contact, loads)
        there = standing_wall(chain.poses, contact, P, loads)
        steps = followed(lambda pressure, near: chain.solve(pressure, there, near), P, progress, times)
        return Run("blocked-force", robot, material, coefficients, conventions, loads, steps, title, warnings, contact)
    solver = blocked_solver(model, numerics, contact)
    wall = standing_wall(solver.poses, solver.contact, P, loads)

    def solve(pressure: Array, near: Blocked | None) -> tuple[Step, Blocked | None]:
        step, solved = solver.solve(pressure, loads, wall, near)
        if solved is not None and branches:
            step = replace(step, warnings=(*step.warnings, *other_equilibria(solver, solved, branches)))
        if solved is not None and step.contact is not None and weight_sensitivity:
            step = replace(step, contact=replace(step.contact, sensitivity=sensitivities(solver, solved)))
        return step, solved

    steps = followed(solve, P, progress, times)
    return Run("blocked-force", robot, material, coefficients, conventions, loads, steps, title, warnings, contact)


def force_against_offset(
    robot: Robot,
    material: Material,
    pressure: Any,
    offsets: Any,
    contact: ContactSettings = ContactSettings(),
    *,
    loads: Loads = Loads(),
    coefficients: Coefficients = Coefficients(),
    conventions: Conventions = REPRODUCTION,
    numerics: Numerics = Numerics(),
    title: str = "",
    progress: Callable[[int, Step], None] | None = None,
) -> Run:
    """Solve the characteristic curve: the blocked force at one pressure against where the wall stands.

    Parameters
    ----------
    robot, material
        As `softnlp.blocked_force`.
    pressure
        (sets,) gauge [Pa].
    offsets
        (steps,) h [m], along x; for a wall given by a point, how far it is moved from it in the direction in which it
        pushes. Each is followed from the last while there is contact.
    contact, loads, coefficients, conventions, numerics, title, progress
        As `softnlp.blocked_force`.

    Returns
    -------
    Run
        One step an offset, as of `softnlp.blocked_force`.

    Raises
    ------
    RobotError
        For a robot that is geometrically impossible.
    InputError
        For more than one pressure a set, or offsets that are not a list of finite numbers.
    """
    warnings = check(robot, allow=LOWERABLE_RULES)
    P = pressure_table(pressure, robot.chamber_sets)
    h = np.asarray(offsets, float)
    if len(P) != 1:
        raise InputError(f"expected one pressure a set, got {len(P)} steps", key="pressure")
    if h.ndim != 1 or h.size == 0 or not np.all(np.isfinite(h)):
        raise InputError("expected a list of finite offsets", key="offsets")
    loads, contact = checked_loads(loads), checked_contact(contact, [robot], h)
    solver = blocked_solver(Model(robot, material, coefficients, conventions), numerics, contact)
    given = contact.wall_point is not None
    first = standing_wall(solver.poses, contact if given else replace(contact, offset=0.0), P, loads)
    steps: list[Step] = []
    near: Blocked | None = None
    for k, offset in enumerate(h):
        point = first.point + offset * first.normal if given else np.array([offset, 0.0, 0.0])
        step, near = solver.solve(P[0], loads, Wall(point, first.normal), near)
        steps.append(step)
        if progress is not None:
            progress(k, step)
    return Run(
        "blocked-force", robot, material, coefficients, conventions, loads, tuple(steps), title, warnings, contact
    )


def constrained_pose(
    robot: Robot,
    material: Material,
    pressure: Any,
    loads: Loads,
    closure: str | Closure = "compliant",
    *,
    weights: ClosureWeights = ClosureWeights(),
    coefficients: Coefficients = Coefficients(),
    conventions: Conventions = REPRODUCTION,
    numerics: Numerics = Numerics(),
) -> Step:
    """Solve the pose under dead loads whose pressurised chambers are held at the lengths they have without loads.

    This is the paper's constrained loaded kinematics; the closure says how they are held, as for a wall.

    Parameters
    ----------
    robot, material
        As `softnlp.forward`.
    pressure
        (sets,) gauge [Pa].
    loads
        As `softnlp.forward`.
    closure, weights
        As of `ContactSettings`.
    coefficients, conventions, numerics
        As `softnlp.blocked_force`.

    Returns
    -------
    Step
        Its `contact` carries the chamber reactions and the shape without loads; its force and normal are 0.

    Raises
    ------
    RobotError
        For a robot that is geometrically impossible.
    InputError
        For more than one pressure a set, or an unknown closure.
    """
    check(robot, allow=LOWERABLE_RULES)
    P = pressure_table(pressure, robot.chamber_sets)
    if len(P) != 1:
        raise InputError(f"expected one pressure a set, got {len(P)} steps", key="pressure")
    contact = checked_contact(ContactSettings(closure=closure, weights=weights))  # type: ignore[arg-type]
    solver = blocked_solver(Model(robot, material, coefficients, conventions), numerics, contact, wall=False)
    return solver.solve(P[0], checked_loads(loads), None)[0]
