"""Blocked tip force: how hard the tip pushes against a wall, at each pressure of a sequence or against the wall's offset."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.contact_settings import ContactSettings
from softnlp.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.errors import InputError
from softnlp.materials import Material
from softnlp.numerics import Numerics
from softnlp.quantities import Model
from softnlp.robot import LOWERABLE_RULES, Robot, check
from softnlp.rod import Loads
from softnlp.studies.blocked import Blocked, BlockedSolver
from softnlp.studies.forward import checked_loads, pressure_table
from softnlp.studies.multistart import other_equilibria
from softnlp.studies.step import Run, Step
from softnlp.studies.wall import Wall, checked_contact, wall_of

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
) -> Run:
    """Solve the blocked tip force at each pressure in order, each followed from zero pressure or from the last.

    Parameters
    ----------
    robot, material, pressures, loads, coefficients, conventions, numerics, times, title, progress
        As `softnlp.forward`; k_c of `compliant` is `coefficients.chamber_reaction`.
    contact
        The wall, the tip's cap and the closure.
    branches
        How many other first guesses are tried at each step; other equilibria found are warnings of the step.

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
    loads, contact = checked_loads(loads), checked_contact(contact)
    if times is not None and len(times) != len(P):
        raise InputError(f"expected one time a step, got {len(times)} times for {len(P)} steps", key="times")
    if branches < 0:
        raise InputError(f"expected a number that is not negative, got {branches}", key="branches")
    solver = BlockedSolver(Model(robot, material, coefficients, conventions), numerics, contact)
    wall = standing_wall(solver, P, loads)
    steps: list[Step] = []
    near: Blocked | None = None
    for k, pressure in enumerate(P):
        step, solved = solver.solve(pressure, loads, wall, near)
        near = solved or near
        if solved is not None and branches:
            step = replace(step, warnings=(*step.warnings, *other_equilibria(solver, solved, branches)))
        if times is not None:
            step = replace(step, time=float(times[k]))
        steps.append(step)
        if progress is not None:
            progress(k, step)
    return Run(
        "blocked-force", robot, material, coefficients, conventions, loads, tuple(steps), title, warnings, contact
    )


def standing_wall(solver: BlockedSolver, pressures: Array, loads: Loads) -> Wall:
    """Return the wall that the solver's settings describe, where the free shape goes at the largest pressure."""
    contact = solver.contact
    largest = pressures[int(np.argmax(np.sum(pressures, axis=1)))]
    rest = np.array([0.0, 0.0, float(solver.model.robot.length) + contact.tip_cap])
    for tried in (loads, Loads()):
        pose = solver.poses.solve(largest, tried)[0].pose
        if pose is not None:
            return wall_of(contact, rest, pose.tip_position + contact.tip_cap * pose.tip_rotation[:, 2])
    small = solver.poses.solve(1e-3 * largest, Loads())[0].pose
    if small is None:
        return wall_of(contact, rest, rest)
    return wall_of(contact, rest, small.tip_position + contact.tip_cap * small.tip_rotation[:, 2])
