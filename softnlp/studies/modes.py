"""Natural frequencies, shapes and damping of a robot about a pose at rest, and its linear system there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.status import Status
from softnlp.dynamics.drive import Series
from softnlp.dynamics.grid import grid_of
from softnlp.dynamics.modes import Vibration, vibration
from softnlp.dynamics.motion import Stepper
from softnlp.dynamics.rod import Acting, Rod
from softnlp.dynamics.sections import Failed, Sections
from softnlp.dynamics.simulation import require_number
from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.robot import LOWERABLE_RULES, Robot, check
from softnlp.model.rod import Loads
from softnlp.model.segments import body_of, segments_of
from softnlp.studies.dynamic import chosen_intervals
from softnlp.studies.forward import checked_loads, pressure_table

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Modes:
    """Small motions about a pose at rest.

    Attributes
    ----------
    status, message
        "solved", or why there is no pose.
    pressure
        (sets,) in the chambers [Pa].
    found
        Modes and linear system, None without a pose.
    warnings
        Of the robot, and of a pose that buckles.
    """

    status: Status
    message: str
    pressure: Array
    found: Vibration | None
    warnings: tuple[str, ...]


def modes(
    robot: Robot,
    material: Material,
    pressure: Any,
    *,
    loads: Loads = Loads(),
    damping: float = 0.0,
    lag: float = 0.0,
    tip_mass: float = 0.0,
    coefficients: Coefficients = Coefficients(),
    conventions: Conventions = REPRODUCTION,
    numerics: Numerics = Numerics(),
) -> Modes:
    """Return natural frequencies, shapes, damping and the linear system about the pose at a pressure.

    Parameters
    ----------
    robot, material
        From `softnlp.robot` and `softnlp.material`, or built in full.
    pressure
        (sets,) gauge [Pa].
    loads
        As `softnlp.forward`.
    damping
        Kelvin-Voigt time of all strains [s].
    lag
        Of the chambers behind the regulators; with one the pressures in the chambers are states [s].
    tip_mass
        Beside the silicone's own [kg].
    coefficients, conventions, numerics
        As `softnlp.forward`; of the numerics `intervals` (to a segment), `accuracy` and the engine count.

    Returns
    -------
    Modes
        All that the grid has, lowest first; those of more waves than it has intervals are not those of the rod.

    Raises
    ------
    RobotError
        For a robot that is geometrically impossible.
    InputError
        For pressures or loads that do not fit, and a damping, lag or mass that is negative or no number.
    """
    warnings = check(robot, allow=LOWERABLE_RULES)
    for key, value in {"damping": damping, "lag": lag, "tip_mass": tip_mass}.items():
        require_number(key, value)
    P = pressure_table(pressure, robot.chamber_sets)[-1]
    loads = checked_loads(loads)
    body = body_of(Model(robot, material, coefficients, conventions))
    force, moment, gravity = (np.asarray(part, float) for part in (loads.tip_force, loads.tip_moment, loads.gravity))
    acting = Acting(force, moment, gravity, tip_mass)
    rows = Series(np.zeros(1), P[None]), Series(np.zeros(1), np.zeros((1, 3)))
    try:
        intervals, _ = chosen_intervals(body, loads, rows, numerics)
        grid = grid_of(body, intervals)
        radius = max(float(own.outer_diameter) for own, _ in segments_of(robot)) / 2
        rod = Rod(Sections(body, grid), grid, damping)
        stepper = Stepper(rod, engine=numerics.engine, accuracy=numerics.accuracy, options=numerics.ipopt)
        found = vibration(stepper, P, acting, radius, lag)
    except Failed as failure:
        advice = failure.status.advice
        message = failure.message if advice in failure.message else f"{advice}: {failure.message}"
        return Modes(failure.status, message, P, None, tuple(warnings))
    notes = [] if found.stable else ["this pose is not stable: it buckles, and a mode of frequency 0 says which way"]
    return Modes(Status.SOLVED, Status.SOLVED.advice, P, found, (*warnings, *notes))
