"""What can be compared, and measurements of one robot as a table of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from softnlp.base.columns import OUTPUTS, Output
from softnlp.base.errors import InputError
from softnlp.model.robot import LOWERABLE_RULES, Robot, check
from softnlp.studies.forward import pressure_table
from softnlp.studies.measurements import Measurements, number_array

Array = NDArray[np.float64]

NUMBERS = ("tip_x", "tip_y", "tip_z", "bending_angle", "elongation", "tilt", "blocked_force")
"""What is measured, one number each; m, rad, N. A row of a table holds them in this order."""

POSE = slice(0, 6)
FORCE = NUMBERS.index("blocked_force")
_TIP = "tip_position"


_WORDS = {_TIP: "distance of the tips", "tilt": "tilt of the tip", **{f"tip_{x}": f"tip along {x}" for x in "xyz"}}
OBSERVABLES: Mapping[str, Output] = {
    name: replace(OUTPUTS[name], words=_WORDS.get(name, "")) for name in (_TIP, *NUMBERS)
}
"""What errors are told of: `NUMBERS`, and how far apart the tips are."""

OF_LENGTH = (_TIP, *NUMBERS[:3])
"""Those whose errors are told in % of the robot's length, not of the number measured."""


@dataclass(frozen=True, eq=False)
class Observed:
    """Measurements of one robot.

    Attributes
    ----------
    robot
        Whose they are.
    label
        Of the robot in results.
    pressure
        (rows, sets) gauge [Pa].
    values
        (rows, 7) as `NUMBERS` [m, rad, N]; nan where nothing was measured.
    """

    robot: Robot
    label: str
    pressure: Array
    values: Array

    @property
    def has_pose(self) -> NDArray[np.bool_]:
        """(rows,) whether each has a number of a pose [1]."""
        return np.asarray(np.isfinite(self.values[:, POSE]).any(axis=1))

    @property
    def has_force(self) -> NDArray[np.bool_]:
        """(rows,) whether each has a blocked force [1]."""
        return np.asarray(np.isfinite(self.values[:, FORCE]))


def observed(given: Measurements) -> Observed:
    """Return measurements as a table, or raise `InputError` naming what is not right."""
    check(given.robot, allow=LOWERABLE_RULES)
    P = pressure_table(given.pressure, given.robot.chamber_sets)
    values = np.full((len(P), len(NUMBERS)), np.nan)
    if given.tip_position is not None:
        values[:, :3] = number_array(given.tip_position, (len(P), 3), _TIP)
    for k, name in enumerate(NUMBERS[3:], start=3):
        if (value := getattr(given, name)) is not None:
            values[:, k] = number_array(value, (len(P),), name)
    if not np.any(np.isfinite(values)):
        raise InputError(f"expected at least one number of {', '.join((_TIP, *NUMBERS[3:]))}", key="measurements")
    return Observed(given.robot, given.label or given.robot.name, P, values)


def differences(name: str, simulated: Array, measured: Array, length: float) -> tuple[Array, Array]:
    """Return the errors (rows,) of an observable and what each is compared with; nan where one of both is missing.

    simulated, measured : (rows, 7). length : L_0 [m].
    """
    if name == _TIP:
        distance = np.linalg.norm(simulated[:, :3] - measured[:, :3], axis=1)
        return np.asarray(distance), np.full(len(measured), length)
    k = NUMBERS.index(name)
    error = simulated[:, k] - measured[:, k]
    whole = np.full(len(measured), length) if name in OF_LENGTH else measured[:, k]
    return error, whole
