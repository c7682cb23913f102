"""From what was found of a blocked pose to a step in SI units: blocked, touching, or lost and why."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.base.units import BAR
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.rod import STATE_SIZE
from softnlp.nlp.solver import EquationResidual, certificate, outputs
from softnlp.statics.blocked_grid import Blocked
from softnlp.statics.loadcase import RodFunctions
from softnlp.statics.pose import pose_of, pose_warnings, shape_and_bend, shape_of, stability
from softnlp.statics.solver import PoseSolver
from softnlp.statics.step import Contact, Pose, Step
from softnlp.statics.wall import Wall

Array = NDArray[np.float64]

PULL = 1e-6  # of EI / L_0^2: what rounding and the grid leave of no force; below minus this the wall would pull


def touching_step(free: Step, contact: ContactSettings, wall: Wall, gap: float, touch: float) -> Step:
    """Return the step of a free shape that does not reach the wall, or only touches it; the force is 0."""
    assert free.pose is not None
    status = Status.NO_CONTACT if gap > touch else Status.SOLVED
    return replace(
        free,
        status=status,
        message=status.advice
        if status is Status.NO_CONTACT
        else "the free shape just touches the wall; the force is 0",
        contact=Contact(
            force=0.0,
            normal=wall.normal,
            wall_point=wall.point,
            tip_cap=contact.tip_cap,
            closure=contact.closure_name,
            chamber_reaction=np.zeros_like(free.pose.chamber_length),
            free=free.pose,
            gap=gap,
            length_error=0.0,
        ),
    )


def failed_step(pressure: Array, reached: Array, folded: bool, stopped: bool, iterations: int, began: float) -> Step:
    """Return the step of a branch that was lost on the way, with the last pressures at which it was held."""
    status = Status.FOLD if folded else Status.DIVERGED
    last = ", ".join(f"{P / BAR:.4g}" for P in reached)
    return Step(
        pressure,
        status,
        f"{status.advice}; the last blocked shape on it is at {last} bar"
        + "; stopped, since it took too long" * stopped,
        iterations=iterations,
        solve_time=time.perf_counter() - began,
    )


def inaccurate_step(pressure: Array, found: Blocked, iterations: int, began: float) -> Step:
    """Return the step of a solution that misses the accuracy on the finest grid that has it."""
    return Step(
        pressure,
        Status.INACCURATE,
        f"{Status.INACCURATE.advice}; with {found.grid.intervals} intervals it is {found.error:.2g} L_0",
        residual=found.solution.residual,
        iterations=iterations,
        solve_time=time.perf_counter() - began,
    )


def solved_step(
    poses: PoseSolver,
    functions: RodFunctions,
    settings: ContactSettings,
    found: Blocked,
    free: Pose,
    iterations: int,
    began: float,
) -> Step:
    """Return the step of a solution with its certificate, the wall and the warnings."""
    model, grid, solution = poses.model, found.grid, found.solution
    problem, situation = grid.problem, found.situation
    L_0, F_0 = (float(v) for v in np.asarray(problem.units(solution.x, solution.p)).ravel())
    y = grid.tip_forces(solution.x)
    if situation.wall is not None and y[0] < -PULL - 10 * found.refinement_error:
        message = (
            f"{Status.DIVERGED.advice}; on the branch followed the wall would have to pull with {-y[0] * F_0:.3g} N"
        )
        return Step(situation.pressure, Status.DIVERGED, message, iterations=iterations)
    nodes = np.ascontiguousarray(grid.nodes(solution.x)[:STATE_SIZE])
    s, values, bending = shape_and_bend(poses.shape, nodes, found.constants)
    shape = shape_of(values, s, L_0, F_0)
    result = outputs(problem, solution)
    column = solution.p[: functions.section.size1_in(0)]
    unloaded = np.asarray(functions.arc(column, float(result["stretch"][0]), 1.0)).ravel()[:3] * L_0
    # The branch keeps the sign of its determinant, so it is as stable in the plane as the free shape it begins at.
    pose = pose_of(model, result, shape, bending, unloaded, stability(situation.loads, free.stable))
    warnings = list(pose_warnings(model, pose))
    if found.slips is not None:
        warnings.append(
            f"the blocked shape may slip sideways past the wall above {found.slips / BAR:.3g} bar: nothing but "
            "friction holds it in the plane"
        )
    if found.error > poses.numerics.accuracy:
        warnings.append(
            f"estimated discretisation error {found.error:.2g} of the length is above the accuracy asked for with "
            f'{grid.intervals} intervals; set [solver] intervals = "auto" or a larger number'
        )
    wall = situation.wall
    tip = grid.nodes(solution.x)[:, -1]
    a = functions.tip_numbers(solution.p)
    T, e_L, _ = (np.asarray(v).ravel() for v in functions.contact(tip, found.constants, y, a, [L_0, F_0]))
    if wall is None:
        wall = Wall(pose.tip_position, np.zeros(3))
        gap = 0.0
    else:
        gap = wall.gap(free.tip_position + settings.tip_cap * free.tip_rotation[:, 2])
    return Step(
        pressure=situation.pressure,
        status=Status.SOLVED,
        message=Status.SOLVED.advice,
        pose=pose,
        residual=solution.residual,
        certificate=certificate(problem, solution),
        discretisation_error=found.error,
        intervals=grid.intervals,
        iterations=iterations,
        solve_time=time.perf_counter() - began,
        warnings=tuple(warnings),
        engine=poses.numerics.engine,
        ipopt=solution.ipopt,
        contact=Contact(
            force=max(float(y[0]) * F_0, 0.0) if situation.wall is not None else 0.0,
            normal=wall.normal,
            wall_point=wall.point,
            tip_cap=settings.tip_cap,
            closure=settings.closure_name,
            chamber_reaction=T * F_0,
            free=free,
            gap=gap,
            length_error=float(e_L[0]) * L_0,
            weighted=_left(solution.p, float(e_L[0]), L_0, F_0) if settings.closure == "weighted" else (),
        ),
    )


def _left(p: Array, e_L: float, L_0: float, F_0: float) -> tuple[EquationResidual, ...]:
    """Return what `weighted` left of each equation: the largest component, in SI units and scaled."""
    e_n, e_m, e_h = (float(np.max(np.abs(part))) for part in (p[-7:-4], p[-4:-1], p[-1:]))
    return (
        EquationResidual("e_n", e_n, "N", e_n / F_0),
        EquationResidual("e_m", e_m, "N m", e_m / (F_0 * L_0)),
        EquationResidual("e_L", abs(e_L) * L_0, "m", abs(e_L)),
        EquationResidual("e_h", e_h, "m", e_h / L_0),
    )
