"""Paths of the tip: pressures over time that follow targets within limits, one program over all of them."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.status import Status
from softnlp.base.units import BAR, DEGREE, MILLIMETRE
from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.numerics import Numerics
from softnlp.model.obstacles import Obstacle
from softnlp.model.quantities import Model
from softnlp.model.robot import LOWERABLE_RULES, SELF_INTERSECTION, Robot, check
from softnlp.model.rod import Loads
from softnlp.nlp.optimality import not_optimal
from softnlp.statics.margins import Margins
from softnlp.statics.obstacle_step import names_of
from softnlp.statics.step import ObstacleContact, Run, Step
from softnlp.studies.derivatives import PoseDerivatives
from softnlp.studies.forward import checked_loads
from softnlp.studies.inverse import checked_bounds, checked_targets
from softnlp.studies.trajectory_problem import Minimise, PathTask
from softnlp.studies.trajectory_solver import CLEARANCE_KEPT, OTHER_POSE, Found, Judged, PathSolver

Array = NDArray[np.float64]

STUDY = "trajectory"


def trajectory(
    robot: Robot,
    material: Material,
    *,
    times: Any,
    positions: Any = None,
    directions: Any = None,
    bounds: tuple[Any, Any] = (0.0, 1.5e5),
    rate: float | None = None,
    clearance: float = 0.0,
    obstacles: Sequence[Obstacle] = (),
    minimise: Minimise = "pressure",
    length_per_radian: float | None = None,
    loads: Loads = Loads(),
    coefficients: Coefficients = Coefficients(),
    conventions: Conventions = REPRODUCTION,
    numerics: Numerics = Numerics(),
    allow: Collection[str] = (),
    title: str = "",
    progress: Callable[[int, Step], None] | None = None,
) -> Run:
    """Find the pressures over time that lead the tip along targets, within limits on pressures, rates and distances.

    Parameters
    ----------
    robot, material
        As `softnlp.forward`.
    times
        (targets,) of the targets, each later than the one before [s].
    positions, directions
        As `softnlp.inverse`.
    bounds
        As `softnlp.inverse`.
    rate
        Largest rate of change of any pressure between targets [Pa/s]. None: any.
    clearance
        Least distance between the body and every obstacle [m].
    obstacles
        What the body keeps away from.
    minimise
        What is made small where pressures are left to choose: "pressure", the sum of their squares, or "rate", that of
        their changes over time.
    length_per_radian
        As `softnlp.inverse`.
    loads, coefficients, conventions, numerics
        As `softnlp.forward`; the loads act on every pose, and the engine is "auto" or "ipopt".
    allow
        As `softnlp.inverse`.
    title, progress
        As `softnlp.forward`; the steps are told when all are known.

    Returns
    -------
    Run
        A step a target, with its time, the pressures, the pose, how near it is in `aimed` and the `margins` at every
        limit. A target that is not met has status `out_of_reach`, and its pressures those of a pose near to it, within
        all limits.

    Raises
    ------
    RobotError
        For a robot that is geometrically impossible.
    InputError
        For targets, times, bounds, limits or loads of the wrong shape or out of range, an engine without IPOPT, and
        obstacles that the robot overlaps at rest, or that its base is too close to.
    """
    warnings = check(robot, allow={*LOWERABLE_RULES, *allow})
    lower, upper = checked_bounds(bounds, robot.chamber_sets)
    weight = float(robot.length) if length_per_radian is None else float(length_per_radian)
    if not (np.isfinite(weight) and weight > 0):
        raise InputError(f"expected a length above 0, got {weight}", key="length_per_radian")
    if minimise not in ("pressure", "rate"):
        raise InputError(f"expected 'pressure' or 'rate', got {minimise!r}", key="minimise")
    targets = checked_targets(positions, directions)
    task = PathTask(
        targets,
        _checked_times(times, len(targets)),
        lower,
        upper,
        None if rate is None else _checked(rate, "rate", above=True),
        _checked(clearance, "clearance"),
        minimise,
        weight,
        tuple(allow),
    )
    model = Model(robot, material, coefficients, conventions)
    loads = checked_loads(loads)
    steps = followed_path(PathSolver(model, numerics, loads, task, obstacles), progress)
    run = Run(STUDY, robot, material, coefficients, conventions, loads, steps, title, warnings)
    return replace(run, obstacles=tuple(obstacles), limits=limits_of(task))


def _checked(value: float, key: str, *, above: bool = False) -> float:
    """Return a finite number that is not negative, or above 0."""
    found = float(value)
    if not (np.isfinite(found) and (found > 0 if above else found >= 0)):
        raise InputError(f"expected a number {'above' if above else 'of at least'} 0, got {value}", key=key)
    return found


def _checked_times(times: Any, count: int) -> Array:
    """Return the times (T,) [s], or raise `InputError`."""
    try:
        found = np.asarray(times, dtype=float).ravel()
    except (TypeError, ValueError) as error:
        raise InputError("expected numbers, one a target", key="times") from error
    if found.size != count or not np.all(np.isfinite(found)):
        raise InputError(f"expected {count} finite numbers, one a target, got {found.size}", key="times")
    for k in np.flatnonzero(np.diff(found) <= 0)[:1] + 1:
        raise InputError(f"item {k + 1}: expected a time after {found[k - 1]:g}, got {found[k]:g}", key="times")
    return found


def limits_of(task: PathTask) -> dict[str, Any]:
    """Return what limits a path, by keys with their units, as results hold it."""
    pairs = np.column_stack([task.lower, task.upper]) / BAR
    return {
        "pressure_bar": pairs.tolist(),
        "rate_bar_per_s": None if task.rate is None else task.rate / BAR,
        "clearance_mm": task.clearance / MILLIMETRE,
        "minimise": task.minimise,
    }


def followed_path(solver: PathSolver, progress: Callable[[int, Step], None] | None) -> tuple[Step, ...]:
    """Solve a path and return its steps; they are told when all are known."""
    began = time.perf_counter()
    found, judged = solver.solve()
    steps = _steps(solver, found, judged) if judged else _none(solver, found)
    share = (time.perf_counter() - began) / len(steps)
    steps = [replace(step, solve_time=share) for step in steps]
    for k, step in enumerate(steps):
        if progress is not None:
            progress(k, step)
    return tuple(steps)


def _none(solver: PathSolver, found: Found) -> list[Step]:
    """Return steps without a solution: at no pressures is the whole within its limits."""
    text = (
        f"no path within the limits was found ({found.word}), with targets missed where they have to be; loosen "
        "clearance or rate, or begin the path elsewhere"
    )
    return [
        Step(
            solver.task.lower,
            Status.DIVERGED,
            text,
            time=float(at),
            iterations=found.iterations,
            aimed=aim.aimed(None),
        )
        for at, aim in zip(solver.task.times, solver.aims, strict=True)
    ]


def _steps(solver: PathSolver, found: Found, judged: Sequence[Judged]) -> list[Step]:
    """Return the steps of a path with what is to be said of each."""
    task, solution = solver.task, found.solution
    assert solution is not None
    pressure, tips = found.pressure, found.tips
    rates = np.abs(np.diff(pressure, axis=0)).max(axis=1) / np.diff(task.times) if len(judged) > 1 else np.zeros(0)
    steps = []
    for k, (one, aim, lost) in enumerate(zip(judged, solver.aims, found.missed, strict=True)):
        step = one.step
        rate = None
        if task.rate is not None:
            rate = task.rate - float(np.max(rates[max(k - 1, 0) : k + 1], initial=0.0))
        room = float(np.min(np.concatenate([pressure[k] - task.lower, task.upper - pressure[k]])))
        gap = float(np.min(one.gaps)) - task.clearance if one.gaps.size else None
        clearance = None if gap is None or not np.isfinite(gap) else gap
        aimed = aim.aimed(step.pose)
        choice = solver.redundant or bool(lost)
        warnings = list(step.warnings)
        if choice and step.pose is not None:
            aimed = replace(aimed, optimal=solution.optimal)
            if not solution.optimal:
                warnings.append(not_optimal(solution.kkt, solution.engine_status))
        step = replace(
            step,
            pressure=pressure[k],
            time=float(task.times[k]),
            iterations=found.iterations,
            aimed=aimed,
            engine=solver.numerics.engine if step.pose is not None else None,
            ipopt=solution.ipopt,
            margins=Margins(room, rate, clearance, _stiffness(solver, one)),
            contacts=_apart(solver, one),
            complementarity=0.0 if solver.obstacles else None,
            warnings=tuple(warnings),
        )
        if step.pose is not None:
            status, message = _verdict(solver, step, one, tips[k])
            step = replace(step, status=status, message=message)
        steps.append(step)
    return steps


def _apart(solver: PathSolver, one: Judged) -> tuple[ObstacleContact, ...]:
    """Return how far each obstacle is, which does not touch."""
    none = np.zeros((0, 3))
    return tuple(
        ObstacleContact(name, np.zeros(3), None, None, float(gap), np.zeros(0), none)
        for name, gap in zip(names_of(solver.obstacles), one.gaps, strict=True)
    )


def _verdict(solver: PathSolver, step: Step, one: Judged, tip: Array) -> tuple[Status, str]:
    """Return the status of a step with a pose, and what it means."""
    pose, aimed, accuracy = step.pose, step.aimed, solver.numerics.accuracy
    assert pose is not None
    assert aimed is not None
    if float(np.linalg.norm(pose.tip_position - tip)) > OTHER_POSE * solver.length:
        here, there = (", ".join(f"{x / MILLIMETRE:.6g}" for x in at) for at in (pose.tip_position, tip))
        text = f"{Status.DISPUTED.advice}; the tip is at ({here}) mm by itself and at ({there}) mm in the program"
        return Status.DISPUTED, text
    if step.margins is not None and step.margins.clearance is not None and step.margins.clearance < -CLEARANCE_KEPT:
        short = -step.margins.clearance / MILLIMETRE
        return Status.INACCURATE, f"the body comes {short:.3g} mm closer than the clearance between nodes of the grid"
    if pose.stable is False:
        return Status.OUT_OF_REACH, "the equilibrium that was found is not stable: a robot buckles away from it"
    if pose.fit.self_intersecting and SELF_INTERSECTION not in solver.task.allow:
        text = f'the shape that was found is none of a body: {pose.fit.warnings[-1]}; [robot] allow = ["'
        return Status.OUT_OF_REACH, f'{text}{SELF_INTERSECTION}"] accepts it'
    near = aimed.distance is None or aimed.distance <= accuracy * solver.length
    along = aimed.angle is None or aimed.angle <= accuracy
    if near and along:
        return Status.SOLVED, Status.SOLVED.advice
    left = [] if aimed.distance is None else [f"{aimed.distance / MILLIMETRE:.6g} mm away"]
    left += [] if aimed.angle is None else [f"{aimed.angle / DEGREE:.6g} degrees off"]
    text = f"no pressures within the limits of the path reach the target; the tip is {' and '.join(left)}"
    return Status.OUT_OF_REACH, text


def _stiffness(solver: PathSolver, one: Judged) -> float | None:
    """Return the least stiffness of the tip [N/m], None where the pose is not known to be stable."""
    pose, solved = one.step.pose, one.solved
    if pose is None or solved is None or not pose.stable:
        return None
    derivatives = PoseDerivatives(solver.poses).on_grid(solved.intervals, ("tip_force",))
    x, p = solved.solution.x, solved.solution.p
    try:
        compliance = derivatives.outputs(x, p)["tip_position"]
    except np.linalg.LinAlgError:
        return None
    size = float(np.linalg.norm(compliance, 2))
    return 1 / size if np.isfinite(size) and size > 0 else None
