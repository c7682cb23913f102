"""From a solution among obstacles to a step in SI units: the pose, and what each obstacle does to it."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.base.units import MILLIMETRE
from softnlp.model.obstacles import Obstacle
from softnlp.model.rod import STATE_SIZE, Loads
from softnlp.nlp.solver import certificate, outputs
from softnlp.statics.obstacle_grid import Touched
from softnlp.statics.obstacle_nodes import between, gaps_between
from softnlp.statics.pose import SHAPE_POINTS, pose_of, pose_warnings, shape_of, stability
from softnlp.statics.solver import PoseSolver
from softnlp.statics.stability import answered
from softnlp.statics.step import ObstacleContact, Step

Array = NDArray[np.float64]

_RIGID = 1e6  # EI/L_0^3: the stiffness that stands for an obstacle where it touches
OVERLAP = 0.02 * MILLIMETRE
"""Between nodes, above which a step is warned of."""


def names_of(obstacles: Sequence[Obstacle]) -> list[str]:
    """Return what results call each obstacle."""
    return [o.name or f"{o.kind} {k + 1}" for k, o in enumerate(obstacles)]


def obstacle_step(
    poses: PoseSolver,
    obstacles: Sequence[Obstacle],
    pressure: Array,
    loads: Loads,
    found: Touched,
    error: float,
    iterations: int,
    began: float,
) -> Step:
    """Return the step of a solved pose. error : estimated, of the tip over L_0."""
    problem, solution = found.grid.problem, found.solution
    L_0, F_0 = found.units
    result = outputs(problem, solution)
    s = np.linspace(0, 1, SHAPE_POINTS)
    shape = shape_of(between(poses.shape, found, s), s, L_0, F_0)
    column = poses.column(poses.values(pressure, loads))
    arc_tip = np.asarray(poses.functions.arc(column, float(result["stretch"][0]), 1.0)).ravel()[:3]
    stable = stability(loads, is_minimum(poses, found))
    pose = pose_of(poses.model, result, shape, float(result["bending_angle"][0]), arc_tip * L_0, stable)
    contacts = contacts_of(obstacles, found, poses)
    warnings = list(pose_warnings(poses.model, pose))
    if found.snapped:
        warnings.append(
            "the branch that the last pose is on turns back before this one: the robot snaps, and this is the first "
            "stable pose after that"
        )
    if error > poses.numerics.accuracy:
        warnings.append(
            f"estimated discretisation error {error:.2g} of the length is above the accuracy asked for with "
            f"{found.grid.intervals} intervals"
        )
    for contact in contacts:
        if contact.gap < -OVERLAP:
            warnings.append(
                f"the body overlaps {contact.obstacle} by {-contact.gap / MILLIMETRE:.3g} mm between nodes; set "
                "[solver] intervals to a larger number"
            )
    return Step(
        pressure=pressure,
        status=Status.SOLVED,
        message=Status.SOLVED.advice,
        pose=pose,
        residual=solution.residual,
        certificate=certificate(problem, solution),
        discretisation_error=error,
        intervals=found.grid.intervals,
        iterations=iterations,
        solve_time=time.perf_counter() - began,
        warnings=tuple(warnings),
        engine=poses.numerics.engine,
        ipopt=solution.ipopt,
        contacts=contacts,
        complementarity=float(np.sum(found.pushes[:, 1:] * np.abs(found.gaps[:, 1:]))) * F_0 * L_0,
    )


def contacts_of(obstacles: Sequence[Obstacle], found: Touched, poses: PoseSolver) -> tuple[ObstacleContact, ...]:
    """Return what each obstacle does: its force on the robot, where along it, and the least gap."""
    L_0, F_0 = found.units
    _, gaps = gaps_between(poses.shape, found)
    every, at = [], found.grid.case.touching.at
    for j, name in enumerate(names_of(obstacles)):
        alone = np.zeros_like(found.pushes)
        alone[j] = found.pushes[j]
        behind, _ = at(found.before, alone, found.radius, found.numbers)
        forces = (found.before[12:15] - behind[12:15]).T * F_0
        forces[0] = 0.0
        where = found.s[found.active[j]]
        every.append(
            ObstacleContact(
                obstacle=name,
                force=forces.sum(axis=0),
                start=float(where[0]) if where.size else None,
                end=float(where[-1]) if where.size else None,
                gap=float(np.min(gaps[j])) * L_0,
                arc=where,
                forces=forces[found.active[j]],
            )
        )
    return tuple(every)


def is_minimum(poses: PoseSolver, found: Touched) -> bool:
    """Whether the energy is least among all shapes that keep in touch where they are."""
    K, count = found.s.size - 1, len(found.grid.case.obstacles)
    stiffness = found.grid.case.touching.stiffness.map(K + 1)
    given = found.before, found.pushes, found.radius, found.numbers
    curved, slopes = (np.asarray(part) for part in stiffness(*given))
    curved = curved.reshape(6, K + 1, 6).transpose(1, 0, 2)
    slopes = slopes.reshape(6, K + 1, count).transpose(1, 2, 0)
    springs = np.where(np.any(found.active, axis=0)[:, None, None], curved, 0.0)
    for j in range(count):
        springs -= _RIGID * found.active[j][:, None, None] * slopes[:, j, :, None] * slopes[:, j, None, :]
    springs[0] = 0.0
    transition = poses.equations.transition(K, every=True)
    nodes = found.behind[:STATE_SIZE]
    return answered(transition, nodes, found.constants, np.zeros((6, 6)), springs, np.diff(found.s))[0] == 0
