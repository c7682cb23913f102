"""Forward and loaded kinematics: the pose at each pressure of a sequence, each started from the last."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.ranges import PRESSURE
from softnlp.base.units import MILLIMETRE
from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.numerics import Numerics
from softnlp.model.obstacles import Obstacle
from softnlp.model.quantities import Model
from softnlp.model.robot import LOWERABLE_RULES, Robot, check
from softnlp.model.rod import Loads
from softnlp.statics.guards import LIMITS
from softnlp.statics.kept import pose_solver
from softnlp.statics.obstacle_solver import among_obstacles
from softnlp.statics.step import Run, Step


def forward(
    robot: Robot,
    material: Material,
    pressures: Any,
    *,
    loads: Loads = Loads(),
    coefficients: Coefficients = Coefficients(),
    conventions: Conventions = REPRODUCTION,
    numerics: Numerics = Numerics(),
    times: Sequence[float] | None = None,
    title: str = "",
    progress: Callable[[int, Step], None] | None = None,
    obstacles: Sequence[Obstacle] = (),
) -> Run:
    """Solve the pose at each pressure in order, warm-started along the sequence.

    Parameters
    ----------
    robot, material
        From `softnlp.robot` and `softnlp.material`, or built in full.
    pressures
        (steps, sets) or (sets,) gauge pressures [Pa], not negative.
    loads
        Dead tip force [N], tip moment [N m] and gravity [m/s^2], world frame; the same at every step.
    coefficients, conventions
        Stiffening and corrections; how ambiguous equations are read.
    numerics
        Transcription, intervals, accuracy, tolerance.
    times
        (steps,) [s], kept with the steps.
    title
        Kept with the run.
    progress
        Called with the index and the step as each is done.
    obstacles
        What the body may touch, without friction; each step is followed from the last one, and the first from the
        unpressurised shape.

    Returns
    -------
    Run
        Its steps carry a pose, or a named status where there is none.

    Raises
    ------
    RobotError
        For a robot that is geometrically impossible; the rules that a scenario may lower are warnings here.
    InputError
        For pressures or loads of the wrong shape, not finite, or out of their ranges, and for obstacles that the robot
        overlaps at rest or that it cannot have.
    """
    warnings = check(robot, allow=LOWERABLE_RULES)
    P = pressure_table(pressures, robot.chamber_sets)
    loads = checked_loads(loads)
    if times is not None and len(times) != len(P):
        raise InputError(f"expected one time a step, got {len(times)} times for {len(P)} steps", key="times")
    solver = pose_solver(Model(robot, material, coefficients, conventions), numerics)
    among: Any = among_obstacles(solver, obstacles) if obstacles else solver
    steps = followed(lambda pressure, near: among.solve(pressure, loads, near), P, progress, times)
    if obstacles:
        steps = several_poses(steps, max(1e-6, 3 * numerics.accuracy) * float(robot.length))
    run = Run("forward", robot, material, coefficients, conventions, loads, steps, title, warnings)
    return replace(run, obstacles=tuple(obstacles))


def followed(
    solve: Callable[[Any, Any], tuple[Step, Any]],
    asked: Iterable[Any],
    progress: Callable[[int, Step], None] | None,
    times: Sequence[float] | None = None,
) -> tuple[Step, ...]:
    """Solve what is asked in order, each begun from the last that was found; each step is told, with its time."""
    steps: list[Step] = []
    near = None
    for k, one in enumerate(asked):
        step, found = solve(one, near)
        near = found or near
        if times is not None:
            step = replace(step, time=float(times[k]))
        steps.append(step)
        if progress is not None:
            progress(k, step)
    return tuple(steps)


def several_poses(steps: Sequence[Step], apart: float) -> tuple[Step, ...]:
    """Return steps, with a warning on each that has the pressures of one before and another pose.

    apart : of the tips, from which poses differ [m].
    """
    told: list[Step] = []
    for k, step in enumerate(steps):
        for j in range(k):
            before = steps[j].pose
            if step.pose is None or before is None or not np.array_equal(step.pressure, steps[j].pressure):
                continue
            distance = float(np.linalg.norm(step.pose.tip_position - before.tip_position))
            if distance > apart:
                text = (
                    f"the branch is not unique: step {j + 1} has the same pressures and another pose, whose tip is "
                    f"{distance / MILLIMETRE:.3g} mm from this one's"
                )
                step = replace(step, warnings=(*step.warnings, text))
                break
        told.append(step)
    return tuple(told)


def pressure_table(pressures: Any, sets: int) -> NDArray[np.float64]:
    """Return pressures as (steps, sets) floats, or raise `InputError`."""
    try:
        table = np.atleast_2d(np.asarray(pressures, dtype=float))
    except (TypeError, ValueError) as error:
        raise InputError(f"expected numbers, one column a chamber set: {error}", key="pressures") from error
    if table.ndim != 2 or table.shape[1] != sets or table.shape[0] == 0:
        raise InputError(f"expected (steps, {sets}), one column a chamber set, got {table.shape}", key="pressures")
    if not np.all(np.isfinite(table)):
        raise InputError("expected finite pressures", key="pressures")
    if np.any(table < 0):
        raise InputError(f"expected gauge pressures that are not negative, got {table.min():g} Pa", key="pressures")
    PRESSURE.require(table, "pressures")
    return table


def checked_loads(loads: Loads) -> Loads:
    """Return loads as arrays of three finite numbers, or raise `InputError` naming the one that is not."""
    checked = {}
    for name in ("tip_force", "tip_moment", "gravity"):
        try:
            value = np.asarray(getattr(loads, name), dtype=float)
        except (TypeError, ValueError) as error:
            raise InputError("expected three numbers", key=name) from error
        if value.shape != (3,) or not np.all(np.isfinite(value)):
            raise InputError(f"expected three finite numbers, got {value.tolist()}", key=name)
        LIMITS[name].require(np.abs(value), name)
        checked[name] = value
    return Loads(**checked)
