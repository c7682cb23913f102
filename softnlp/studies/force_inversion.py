"""Which pressure gives a blocked force: the free and the blocked shape in one problem that shares a free pressure."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.status import Status
from softnlp.base.units import BAR
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.robot import LOWERABLE_RULES, Robot, check
from softnlp.model.rod import Loads
from softnlp.nlp.places import crossing
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.blocked_grid import Blocked
from softnlp.statics.joint import joint_solution
from softnlp.statics.kept import blocked_solver
from softnlp.statics.step import Step
from softnlp.statics.wall import checked_contact, standing_wall
from softnlp.studies.forward import checked_loads

Array = NDArray[np.float64]

_STEPS = 6


def pressure_for_force(
    robot: Robot,
    material: Material,
    sets: Sequence[int],
    force: float,
    contact: ContactSettings = ContactSettings(),
    *,
    highest: float = 1.5 * BAR,
    loads: Loads = Loads(),
    coefficients: Coefficients = Coefficients(),
    conventions: Conventions = REPRODUCTION,
    numerics: Numerics = Numerics(),
) -> tuple[Array, Step]:
    """Find the pressure, the same in some sets and 0 in others, that gives a blocked force.

    The branch from zero pressure is followed until it passes the force; there both shapes are solved at once with the
    pressure free.

    Parameters
    ----------
    robot, material
        As `softnlp.blocked_force`.
    sets
        Counted from 0.
    force
        Above 0 [N].
    contact
        As `softnlp.blocked_force`.
    highest
        The largest pressure allowed [Pa].
    loads, coefficients, conventions, numerics
        As `softnlp.blocked_force`.

    Returns
    -------
    tuple
        The pressures (sets,) [Pa] and the step. Where the force is not reached the step is `out_of_reach`, or says how
        the branch ended before, and the pressures are nan.

    Raises
    ------
    InputError
        For sets that the robot does not have, a force or a pressure that is not above 0.
    """
    check(robot, allow=LOWERABLE_RULES)
    loads, contact = checked_loads(loads), checked_contact(contact, [robot])
    chosen = sorted(set(sets))
    if not chosen or any(k not in range(robot.chamber_sets) for k in chosen):
        raise InputError(f"expected sets out of 0 to {robot.chamber_sets - 1}, got {list(sets)}", key="sets")
    for key, value in (("force", force), ("highest", highest)):
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"expected a number above 0, got {value}", key=key)
    direction = np.zeros(robot.chamber_sets)
    direction[chosen] = 1.0
    solver = blocked_solver(Model(robot, material, coefficients, conventions), numerics, contact)
    wall = standing_wall(solver.poses, solver.contact, (direction * highest)[None, :], loads)

    tried: dict[float, tuple[Step, Blocked | None]] = {}
    near: Blocked | None = None

    def excess(P: float) -> float:
        if P not in tried:
            tried[P] = solver.solve(direction * P, loads, wall, near)
        contact = tried[P][0].contact
        return np.nan if contact is None else contact.force - force

    low = 0.0
    for P in np.linspace(0, highest, _STEPS + 1).tolist():
        above = excess(P)
        step, solved = tried[P]
        if not step.status.has_solution:
            return np.full_like(direction, np.nan), step
        if above >= 0:
            break
        low, near = P, solved or near
    else:
        found = f"{above + force:.4g} N at {highest / BAR:.4g} bar"
        message = f"{Status.OUT_OF_REACH.advice}: {found}, {force:.4g} N wanted"
        lost = Step(direction * highest, Status.OUT_OF_REACH, message, solve_time=step.solve_time)
        return np.full_like(direction, np.nan), lost
    exact = contact.closure == "weighted"
    pressure = crossing(excess, low, P, (1e-10 if exact else 1e-3) * force)
    step, solved = tried[pressure]
    if solved is not None and not exact:
        refined = _jointly(solver, solved, direction, pressure, force)
        if refined is not None and abs(refined - pressure) < 0.05 * pressure:
            again, on_branch = solver.solve(direction * refined, loads, wall, near)
            if on_branch is not None:
                pressure, step = refined, again
    return direction * pressure, step


def _jointly(solver: BlockedSolver, near: Blocked, direction: Array, pressure: float, force: float) -> float | None:
    """Solve both shapes with the pressure free, from a blocked solution nearby; return the pressure [Pa]."""
    given = {"pressure": direction * pressure, "target force": force}
    engine, solution, _ = joint_solution(solver, near, given, free_pressure=True)
    if not solution.holds(solver.numerics.tolerance):
        return None
    return float(engine.problem.free_values(solution.x)["pressure scale"][0]) * pressure
