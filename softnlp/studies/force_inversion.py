"""Which pressure gives a blocked force: the free and the blocked shape in one problem that shares a free pressure."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.quantity import quantity
from softnlp.base.status import Status
from softnlp.base.units import BAR
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.robot import LOWERABLE_RULES, Robot, check
from softnlp.model.rod import Loads
from softnlp.nlp.problem import CompiledProblem, Constraint, compile_problem
from softnlp.nlp.solver import Engine, Solution
from softnlp.nlp.transcription import method_named
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.blocked_grid import Blocked
from softnlp.statics.condensed import linear_solver
from softnlp.statics.kept import blocked_solver
from softnlp.statics.loadcase import blocked_case, load_case
from softnlp.statics.step import Step
from softnlp.statics.wall import checked_contact, standing_wall
from softnlp.studies.forward import checked_loads

Array = NDArray[np.float64]

_STEPS = 6
_SECANTS = 30


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
        the
        branch ended before, and the pressures are nan.

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

    def solve(P: float, near: Blocked | None) -> tuple[Step, Blocked | None, float]:
        step, solved = solver.solve(direction * P, loads, wall, near)
        return step, solved, step.contact.force if step.contact is not None else np.nan

    low, low_force, near = 0.0, 0.0, None
    for P in np.linspace(0, highest, _STEPS + 1):
        step, solved, found = solve(float(P), near)
        if not step.status.has_solution:
            return np.full_like(direction, np.nan), step
        if found >= force:
            break
        low, low_force, near = float(P), found, solved or near
    else:
        message = f"{Status.OUT_OF_REACH.advice}: {found:.4g} N at {highest / BAR:.4g} bar, {force:.4g} N wanted"
        lost = Step(direction * highest, Status.OUT_OF_REACH, message, solve_time=step.solve_time)
        return np.full_like(direction, np.nan), lost
    exact = contact.closure == "weighted"
    pressure, step, solved = _bracketed(
        solve, (low, low_force), (float(P), found), force, near, 1e-10 if exact else 1e-3
    )
    if solved is not None and not exact:
        refined = _jointly(solver, solved, direction, pressure, force)
        if refined is not None and abs(refined - pressure) < 0.05 * pressure:
            again, on_branch, _ = solve(refined, near)
            if on_branch is not None:
                pressure, step = refined, again
    return direction * pressure, step


def _bracketed(
    solve: Callable[[float, Blocked | None], tuple[Step, Blocked | None, float]],
    low: tuple[float, float],
    high: tuple[float, float],
    force: float,
    near: Blocked | None,
    accuracy: float,
) -> tuple[float, Step, Blocked | None]:
    """Return the pressure between two that gives the force, by the Illinois method, with its step and solution."""
    (a, f_a), (b, f_b) = (low[0], low[1] - force), (high[0], high[1] - force)
    for _ in range(_SECANTS):
        P = b if f_b == f_a else (a * f_b - b * f_a) / (f_b - f_a)
        step, solved, found = solve(P, near)
        error = found - force
        if not abs(error) > accuracy * force:
            break
        if error * f_b < 0:
            a, f_a = b, f_b
        else:
            f_a /= 2
        b, f_b = P, error
    return P, step, solved


def joint_problem(solver: BlockedSolver, intervals: int, *, free_pressure: bool) -> CompiledProblem:
    """Return the problem of the free and the blocked shape with shared pressure, geometry and material.

    The blocked shape takes its free chamber lengths from the free shape's states. With every quantity fixed the wall's
    force is found for a pressure. With `free_pressure` the pressure is "pressure scale" (free) times "pressure", and
    the wall's force has to be "target force" [N].
    """
    declared = solver.functions.declared(solver.model)
    scale = quantity("pressure scale", "1", 1.0, lower=0.0)
    shared = dict(declared)
    if free_pressure:
        pressure = declared["pressure"]
        shared["pressure"] = replace(pressure, symbol=scale.symbol * pressure.symbol)
    method = method_named(solver.numerics.transcription, intervals)
    free = load_case("free", solver.poses.functions, shared, method)
    blocked = blocked_case("blocked", solver.functions, shared, free, method)
    del declared["contact.free_lengths"]
    if not free_pressure:
        return compile_problem(list(declared.values()), [free, blocked])
    target = quantity("target force", "N", 0.0)
    error = blocked.outputs["tip_forces"][0] - target.symbol
    wanted = Constraint("blocked force", error, unit="N", scale=blocked.force_unit)
    return compile_problem(
        [*declared.values(), scale, target], [free, blocked], free=["pressure scale"], constraints=[wanted]
    )


def joint_engine(solver: BlockedSolver, intervals: int, *, free_pressure: bool) -> Engine:
    """Return what solves `joint_problem`, kept with what the solver has compiled."""
    numerics = solver.numerics
    key = ("joint", numerics.transcription, numerics.engine, numerics.ipopt, intervals, free_pressure)

    def made() -> Engine:
        problem = joint_problem(solver, intervals, free_pressure=free_pressure)
        by_ipopt = numerics.engine == "ipopt"
        linear = None if by_ipopt else linear_solver(problem)
        return Engine(problem, linear=linear, newton_only=numerics.engine == "newton", options=numerics.ipopt)

    return solver.equations.kept(key, made)


def joint_solution(
    solver: BlockedSolver, near: Blocked, given: Mapping[str, Any], *, free_pressure: bool
) -> tuple[Engine, Solution, Array]:
    """Solve both shapes at once from a blocked solution nearby; return what solved them, the solution, and its start.

    given : values of `joint_problem` by name other than those of the blocked solution.
    """
    engine = joint_engine(solver, near.grid.intervals, free_pressure=free_pressure)
    values = solver.values(near.situation, near.pressed, np.zeros(0))
    del values["contact.free_lengths"]
    p = engine.problem.pack({**values, **given})
    grid, shape = solver.poses.grid(near.grid.intervals), near.free
    arc = solver.poses.arc_guess(grid, shape.column, shape.stretch)
    guess = arc if shape.solved is None else solver.poses.transfer(shape.solved, grid)
    free = grid.engine.solve(shape.column, guess)
    start = np.concatenate([[1.0] * free_pressure, free.x, near.solution.x])
    return engine, engine.solve(p, start), start


def _jointly(solver: BlockedSolver, near: Blocked, direction: Array, pressure: float, force: float) -> float | None:
    """Solve both shapes with the pressure free, from a blocked solution nearby; return the pressure [Pa]."""
    given = {"pressure": direction * pressure, "target force": force}
    engine, solution, _ = joint_solution(solver, near, given, free_pressure=True)
    if not solution.holds(solver.numerics.tolerance):
        return None
    return float(engine.problem.free_values(solution.x)["pressure scale"][0]) * pressure
