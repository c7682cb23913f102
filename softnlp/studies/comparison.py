"""A finished comparison: measured rows, what each variant of the model says of them, and how far they are apart."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from softnlp.base.columns import OUTPUTS, Output
from softnlp.base.statistics import Statistics, statistics
from softnlp.base.status import Status
from softnlp.model.contact_settings import ContactSettings
from softnlp.studies.measurements import Observed
from softnlp.studies.registration import Registration
from softnlp.studies.variants import Variant, labels

Array = NDArray[np.float64]

NUMBERS = ("tip_x", "tip_y", "tip_z", "bending_angle", "elongation", "tilt", "blocked_force", "orientation")
"""What is measured, one number each; m, rad, N, in the order of a row of a table.

An orientation is the angle from the one measured."""

_TIP = "tip_position"

_WORDS = {_TIP: "distance of the tips", "tilt": "tilt of the tip", **{f"tip_{x}": f"tip along {x}" for x in "xyz"}}
OBSERVABLES: Mapping[str, Output] = {
    name: replace(OUTPUTS[name], words=_WORDS.get(name, "")) for name in (_TIP, *NUMBERS)
}
"""What errors are told of: `NUMBERS`, and how far apart the tips are."""

OF_LENGTH = (_TIP, *NUMBERS[:3])
"""Those whose errors are told in % of the robot's length, not of the number measured."""

AXES = NUMBERS[:3]


@dataclass(frozen=True, eq=False)
class Solved:
    """What came of rows.

    Attributes
    ----------
    values
        (rows, 8) as `NUMBERS` [m, rad, N]; nan where there is no solution, the force also
        where there is no wall.
    status
        Of each row; None of one that nothing was asked of.
    message
        Of each row; "" of one that nothing was asked of.
    self_intersecting
        The rows whose shape passes through itself.
    turns
        (rows, 9) rotation of the free tip by columns [1], where it was kept.
    registration
        Where the tips were taken, with what was fitted of it.
    """

    values: Array
    status: tuple[Status | None, ...]
    message: tuple[str, ...]
    self_intersecting: frozenset[int] = frozenset()
    turns: Array | None = None
    registration: Registration | None = None


@dataclass(frozen=True, eq=False)
class Comparison:
    """Variants of the model against measurements of robots. SI units, world frame.

    Attributes
    ----------
    observed
        Of each robot.
    variants
        What was simulated.
    simulated
        For each variant, of each robot; numbers are nan where nothing was measured or the row has no solution.
    contact
        The wall of blocked forces.
    shape
        "free" or "blocked", the shape that poses are taken of.
    """

    observed: tuple[Observed, ...]
    variants: tuple[Variant, ...]
    simulated: tuple[tuple[Solved, ...], ...]
    contact: ContactSettings
    shape: str

    @cached_property
    def labels(self) -> list[str]:
        """What tells each variant from the others."""
        return labels(self.variants)

    @cached_property
    def observables(self) -> tuple[str, ...]:
        """The names of `OBSERVABLES` that something was measured of."""
        return tuple(
            name for name in OBSERVABLES if any(np.isfinite(self._measured(name, o)).any() for o in self.observed)
        )

    @cached_property
    def main_observables(self) -> tuple[str, ...]:
        """Those that stand for themselves: without the axes where whole tips were measured."""
        whole = "tip_position" in self.observables
        return tuple(name for name in self.observables if not (whole and name in AXES))

    @property
    def rows(self) -> int:
        """The number of rows measured."""
        return sum(len(o.pressure) for o in self.observed)

    def measured(self, name: str, robot: int | None = None) -> int:
        """Return how many numbers were measured of an observable, of one robot or of all.

        Parameters
        ----------
        name
            Of `OBSERVABLES`.
        robot
            Its index in `observed`; None for all.

        Returns
        -------
        int
            The number.
        """
        return sum(int(np.isfinite(self._measured(name, o)).sum()) for o in self._of(robot))

    def errors(self, variant: int, name: str, robot: int | None = None) -> tuple[Array, Array]:
        """Return the errors (M,), simulated less measured, and what each is compared with; of one robot or of all.

        The error of "tip_position" is a distance. Numbers without a solution are left out.

        Parameters
        ----------
        variant
            Its index in `variants`.
        name
            Of `OBSERVABLES`.
        robot
            Its index in `observed`; None for all.

        Returns
        -------
        tuple
            Two arrays (M,) [m, rad or N].
        """
        pairs = [self._errors(variant, name, k) for k in self._which(robot)]
        error, whole = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
        kept = np.isfinite(error)
        return error[kept], whole[kept]

    def statistics(self, variant: int, name: str, robot: int | None = None) -> Statistics:
        """Return the statistics of the errors; a distance has no bias.

        Parameters
        ----------
        variant
            Its index in `variants`.
        name
            Of `OBSERVABLES`.
        robot
            Its index in `observed`; None for all.

        Returns
        -------
        Statistics
            Of the errors of `errors` [m, rad or N].
        """
        found = statistics(*self.errors(variant, name, robot))
        return replace(found, bias=float("nan")) if name in (_TIP, "orientation") else found

    def lost(self, variant: int) -> int:
        """Return how many rows of a variant have no solution.

        Parameters
        ----------
        variant
            Its index in `variants`.

        Returns
        -------
        int
            The number.
        """
        return sum(not s.has_solution for solved in self.simulated[variant] for s in solved.status if s is not None)

    def self_intersecting(self, variant: int) -> int:
        """Return in how many rows of a variant the simulated shape passes through itself.

        Parameters
        ----------
        variant
            Its index in `variants`.

        Returns
        -------
        int
            The number.
        """
        return sum(len(solved.self_intersecting) for solved in self.simulated[variant])

    @cached_property
    def best(self) -> int | None:
        """The variant with the least error over all that was measured, None where no variant has a number.

        Of those that miss the fewest numbers, the one whose root mean square errors, each divided by the root mean
        square of what it is compared with, have the least mean.
        """
        return self._least(self.main_observables)

    def best_of(self, name: str) -> int | None:
        """Return the variant with the least root mean square error of one observable, as `best`.

        Parameters
        ----------
        name
            Of `OBSERVABLES`.

        Returns
        -------
        int or None
            Its index in `variants`.
        """
        return self._least((name,))

    def _least(self, names: tuple[str, ...]) -> int | None:
        told = []
        for v in range(len(self.variants)):
            found = [self.statistics(v, name) for name in names]
            missing = sum(self.measured(name) - s.count for name, s in zip(names, found, strict=True))
            relative = [s.rmse / self._size(name) for name, s in zip(names, found, strict=True) if s.count]
            if relative:
                told.append((missing, float(np.mean(relative)), v))
        return min(told)[2] if told else None

    def _size(self, name: str) -> float:
        """Return the root mean square of what errors are compared with, over all that was measured."""
        if name in OF_LENGTH:
            sizes = [np.full(self.measured(name, k), float(o.robot.length)) for k, o in enumerate(self.observed)]
        else:
            if name == "orientation":  # measured as none: as large as a right angle
                return np.pi / 2
            sizes = [o.values[np.isfinite(self._measured(name, o)), NUMBERS.index(name)] for o in self.observed]
        return float(np.sqrt(np.mean(np.concatenate(sizes) ** 2))) or 1.0

    def _errors(self, variant: int, name: str, robot: int) -> tuple[Array, Array]:
        o = self.observed[robot]
        return differences(name, self.simulated[variant][robot].values, o.values, float(o.robot.length))

    @staticmethod
    def _measured(name: str, o: Observed) -> Array:
        """Return what was measured of an observable; of a tip something finite where all three numbers are."""
        return o.values[:, :3].sum(axis=1) if name == "tip_position" else o.values[:, NUMBERS.index(name)]

    def _which(self, robot: int | None) -> range:
        return range(len(self.observed)) if robot is None else range(robot, robot + 1)

    def _of(self, robot: int | None) -> list[Observed]:
        return [self.observed[k] for k in self._which(robot)]


def differences(name: str, simulated: Array, measured: Array, length: float) -> tuple[Array, Array]:
    """Return the errors (rows,) of an observable and what each is compared with; nan where one of both is missing.

    simulated, measured : (rows, 8). length : L_0 [m].
    """
    if name == _TIP:
        distance = np.linalg.norm(simulated[:, :3] - measured[:, :3], axis=1)
        return np.asarray(distance), np.full(len(measured), length)
    k = NUMBERS.index(name)
    error = simulated[:, k] - measured[:, k]
    whole = np.full(len(measured), length) if name in OF_LENGTH else measured[:, k]
    return error, whole
