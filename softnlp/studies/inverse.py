"""Inverse kinematics: the pressures that bring the tip to a target, within bounds, or the nearest point to it."""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.model.conventions import REPRODUCTION, Coefficients, Conventions
from softnlp.model.materials import Material
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.robot import LOWERABLE_RULES, Robot, check
from softnlp.model.rod import Loads
from softnlp.statics.step import Run, Step
from softnlp.studies.forward import checked_loads, followed
from softnlp.studies.inverse_solver import InverseKinematics
from softnlp.studies.targets import InverseTask, Target

Array = NDArray[np.float64]


def inverse(
    robot: Robot,
    material: Material,
    *,
    positions: Any = None,
    directions: Any = None,
    bounds: tuple[Any, Any] = (0.0, 1.5e5),
    length_per_radian: float | None = None,
    loads: Loads = Loads(),
    coefficients: Coefficients = Coefficients(),
    conventions: Conventions = REPRODUCTION,
    numerics: Numerics = Numerics(),
    allow: Collection[str] = (),
    method: Literal["newton", "nlp"] = "newton",
    title: str = "",
    progress: Callable[[int, Step], None] | None = None,
) -> Run:
    """Find the pressures for each target in order, each search begun from the last one's.

    Parameters
    ----------
    robot, material
        As `softnlp.forward`.
    positions
        (targets, 3) or (3,) of the tip [m]. None: any.
    directions
        (targets, 3) or (3,) of the tip's axis [1], normalised here. None: any. With both, rows belong together.
    bounds
        Lowest and highest gauge pressure [Pa], a number or one a set.
    length_per_radian
        What a radian of misfit counts for beside a distance, where position and direction cannot both be met [m];
        L_0 by default.
    loads, coefficients, conventions, numerics
        As `softnlp.forward`; the loads act on every pose.
    allow
        "self_intersection" accepts shapes that no body can take without passing through itself.
    method
        "newton": an active-set Gauss-Newton iteration in the pressures. "nlp": the pressures freed in the rod's own
        problem and solved by IPOPT, started from the same places; slower, and a check of the other.
    title, progress
        As `softnlp.forward`.

    Returns
    -------
    Run
        A step a target: the pressure found, its pose and how near it is in `aimed`. A target that no pressure meets
        has status `out_of_reach`: the pressure is that of the nearest point, in the message with its distance.

    Raises
    ------
    RobotError
        For a robot that is geometrically impossible.
    InputError
        For targets, bounds or loads of the wrong shape or out of range, or no target.
    """
    warnings = check(robot, allow={*LOWERABLE_RULES, *allow})
    loads = checked_loads(loads)
    lower, upper = checked_bounds(bounds, robot.chamber_sets)
    weight = float(robot.length) if length_per_radian is None else float(length_per_radian)
    if not (np.isfinite(weight) and weight > 0):
        raise InputError(f"expected a length above 0, got {weight}", key="length_per_radian")
    if method not in ("newton", "nlp"):
        raise InputError(f"expected 'newton' or 'nlp', got {method!r}", key="method")
    task = InverseTask(checked_targets(positions, directions), lower, upper, weight, tuple(allow))
    solver = InverseKinematics(Model(robot, material, coefficients, conventions), numerics, loads, task, method)
    steps = followed(solver.nearest, task.targets, progress)
    return Run("inverse", robot, material, coefficients, conventions, loads, steps, title, warnings)


def checked_bounds(bounds: Any, sets: int) -> tuple[Array, Array]:
    """Return the bounds of each set (sets,) [Pa], or raise `InputError`."""
    try:
        lower, upper = (np.broadcast_to(np.asarray(b, dtype=float), (sets,)).copy() for b in bounds)
    except (TypeError, ValueError) as error:
        text = f"expected a lowest and a highest pressure, one for all or {sets} each"
        raise InputError(text, key="bounds") from error
    if not (np.all(np.isfinite(lower)) and np.all(np.isfinite(upper))):
        raise InputError("expected finite pressures", key="bounds")
    if np.any(lower < 0):
        raise InputError(f"expected gauge pressures that are not negative, got {lower.min():g} Pa", key="bounds")
    if np.any(upper < lower):
        raise InputError("expected the highest pressure to be at least the lowest", key="bounds")
    return lower, upper


def checked_targets(positions: Any, directions: Any) -> tuple[Target, ...]:
    """Return the targets with unit directions, or raise `InputError`."""
    p, d = _rows(positions, "positions"), _rows(directions, "directions")
    if p is None and d is None:
        raise InputError("expected positions, directions or both", key="positions")
    if p is not None and d is not None and len(p) != len(d):
        raise InputError(f"expected one a position, got {len(d)} for {len(p)}", key="directions")
    if d is not None:
        sizes = np.linalg.norm(d, axis=1)
        if np.any(sizes == 0):
            raise InputError("expected directions, got a vector of length 0", key="directions")
        d = d / sizes[:, None]
    count = len(p) if p is not None else len(d) if d is not None else 0
    return tuple(Target(None if p is None else p[k].copy(), None if d is None else d[k].copy()) for k in range(count))


def _rows(values: Any, key: str) -> Array | None:
    """Return vectors as (targets, 3)."""
    if values is None:
        return None
    try:
        rows = np.atleast_2d(np.asarray(values, dtype=float))
    except (TypeError, ValueError) as error:
        raise InputError("expected rows of three numbers", key=key) from error
    if rows.ndim != 2 or rows.shape[1] != 3 or len(rows) == 0:
        raise InputError(f"expected (targets, 3), got {rows.shape}", key=key)
    if not np.all(np.isfinite(rows)):
        raise InputError("expected finite numbers", key=key)
    return rows
