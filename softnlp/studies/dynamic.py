"""Dynamics: the robot's motion under pressures and a tip force that change over time, or released from a load."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.ranges import FORCE
from softnlp.base.status import Status
from softnlp.dynamics.drive import Series
from softnlp.dynamics.grid import grid_of
from softnlp.dynamics.motion import Stepper
from softnlp.dynamics.pose import Poses
from softnlp.dynamics.rod import Acting, Rod
from softnlp.dynamics.sections import Failed, Sections
from softnlp.dynamics.simulation import Dynamics, Simulation
from softnlp.model.body import Body
from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.robot import LOWERABLE_RULES, Robot, check
from softnlp.model.rod import Loads
from softnlp.model.segments import body_of
from softnlp.statics.step import Run, Step
from softnlp.studies.forward import checked_loads, pressure_table

Array = NDArray[np.float64]

STUDY = "dynamic"
_GRIDS = (3, 6, 12, 24)
"""Intervals to a segment, the fewest first, of which the first is taken that shows the pose at rest well enough."""


def dynamic(
    robot: Robot,
    material: Material,
    pressures: Any,
    asked: Dynamics,
    *,
    times: Any = None,
    forces: Any = None,
    loads: Loads = Loads(),
    coefficients: Coefficients = Coefficients(),
    conventions: Conventions = REPRODUCTION,
    numerics: Numerics = Numerics(),
    title: str = "",
    progress: Callable[[int, Step], None] | None = None,
) -> Run:
    """Solve the motion of a robot over time.

    Parameters
    ----------
    robot, material
        From `softnlp.robot` and `softnlp.material`, or built in full.
    pressures
        (rows, sets) or (sets,) gauge pressures at the regulators [Pa], linear between rows; two rows of one time are a
        jump.
    asked
        Duration, steps, rule, damping, lag, start.
    times
        (rows,) [s], rising; not needed for one row, which is held.
    forces
        (rows, 3) at the tip, world frame, beside that of the loads [N].
    loads
        As `softnlp.forward`.
    coefficients, conventions
        As `softnlp.forward`.
    numerics
        Of which `intervals` (to a segment), `accuracy`, `tolerance` and the engine with its options count. With "auto"
        IPOPT closes the pose at the beginning, and the last step before about twenty of the outputs.
    title
        Kept with the run.
    progress
        Called with the index and the step as each is done.

    Returns
    -------
    Run
        A step for each output time; where the motion cannot be followed further the last one has a named status and
        says at which time.

    Raises
    ------
    RobotError
        For a robot that is geometrically impossible.
    InputError
        For pressures, times, forces or loads that do not fit, are not finite or out of their ranges.
    """
    warnings = check(robot, allow=LOWERABLE_RULES)
    P = pressure_table(pressures, robot.chamber_sets)
    loads = checked_loads(loads)
    t, F = series_of(times, forces, len(P))
    body = body_of(Model(robot, material, coefficients, conventions))
    steps: list[Step] = []

    def keep(step: Step) -> None:
        steps.append(step)
        if progress is not None:
            progress(len(steps) - 1, step)

    notes = _followed(body, loads, asked, (Series(t, P), Series(t, F)), numerics, keep)
    return Run(STUDY, robot, material, coefficients, conventions, loads, tuple(steps), title, (*warnings, *notes))


def series_of(times: Any, forces: Any, rows: int) -> tuple[Array, Array]:
    """Return times and forces of the rows, or raise `InputError`."""
    if times is None:
        if rows > 1:
            raise InputError(f"expected the time of each of {rows} rows", key="times")
        times = [0.0]
    t = np.asarray(times, float)
    if t.shape != (rows,) or not np.all(np.isfinite(t)) or np.any(np.diff(t) < 0):
        raise InputError(f"expected {rows} finite times that do not fall, one a row", key="times")
    F = np.zeros((rows, 3)) if forces is None else np.asarray(forces, float)
    if F.shape != (rows, 3) or not np.all(np.isfinite(F)):
        raise InputError(f"expected ({rows}, 3) finite forces", key="forces")
    FORCE.require(np.abs(F), "forces")
    return t, F


def _followed(
    body: Body,
    loads: Loads,
    asked: Dynamics,
    series: tuple[Series, Series],
    numerics: Numerics,
    keep: Callable[[Step], None],
) -> list[str]:
    """Give each step as it is solved; return what to know of the run."""
    began, last = time.perf_counter(), -1.0
    tolerance = min(numerics.tolerance, 1e-8) / 10
    outputs = asked.outputs
    try:
        intervals, error = chosen_intervals(body, loads, series, numerics)
        simulation = Simulation(
            body, loads, asked, *series, intervals=intervals, tolerance=tolerance, numerics=numerics
        )
        poses = Poses(simulation)
        for output in simulation.run():
            now = time.perf_counter()
            keep(poses.step(output, now - began, error))
            began, last = now, output.instant.time
    except Failed as failure:
        after = outputs[outputs > last + 1e-12]
        at = float(after[0]) if after.size else asked.duration
        keep(
            Step(
                pressure=np.asarray(series[0].at(at)),
                status=failure.status,
                message=sentence(failure),
                time=at,
                solve_time=time.perf_counter() - began,
            )
        )
        return [f"the motion could not be followed beyond {max(last, 0.0):g} s"]
    return simulation.warnings


def sentence(failure: Failed) -> str:
    """Return what ended a motion, in words."""
    if failure.status is Status.DIVERGED:
        return f"the motion could not be followed: {failure.message}"
    advice = failure.status.advice
    return failure.message if advice in failure.message else f"{advice}: {failure.message}"


def chosen_intervals(
    body: Body, loads: Loads, series: tuple[Series, Series], numerics: Numerics
) -> tuple[int, float | None]:
    """Return the intervals to a segment, and the estimated error of the tip at rest with them, of the length.

    It is estimated at the row of the largest pressures, by twice as many; None where there is no pose at rest.
    """
    P = series[0].values
    row = int(np.argmax(P.sum(axis=1)))
    acting = Acting(
        np.asarray(loads.tip_force, float) + series[1].values[row],
        np.asarray(loads.tip_moment, float),
        np.asarray(loads.gravity, float),
    )

    def tip(intervals: int) -> Array | None:
        grid = grid_of(body, intervals)
        sections = Sections(body, grid)
        stepper = Stepper(Rod(sections, grid))
        try:
            numbers = sections.at(P[row])
            found: Array = stepper.pose(numbers, acting).instant.at.position[-1]
            return found
        except Failed:  # a motion may go where no pose at rest is
            return None

    asked = (numerics.intervals,) if numerics.intervals else _GRIDS
    coarse = tip(asked[0])
    for intervals in asked:
        fine = tip(2 * intervals)
        if coarse is None or fine is None:
            return asked[0], None
        error = float(np.linalg.norm(fine - coarse)) / body.length
        if error <= numerics.accuracy or intervals == asked[-1]:
            return intervals, error
        coarse = fine
    raise AssertionError("unreachable")
