"""What an identification found, and how far the model is from the measurements before and after."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softnlp.conventions import Coefficients
from softnlp.evaluation.statistics import Statistics, statistics
from softnlp.materials import Material
from softnlp.status import Status
from softnlp.studies.fit_statistics import Uncertainty
from softnlp.studies.free_constants import FreeConstants
from softnlp.studies.measurements import OBSERVABLES, Data, column_slice

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Identified:
    """What an identification found.

    Attributes
    ----------
    status, message
        Solved, or why the model could not be compared with the measurements, and where.
    free
        Names, start and bounds.
    constants
        (n,) found [SI], nan where nothing was.
    at_bound
        Names of those at a bound.
    uncertainty
        Of the constants.
    material, coefficients
        With the constants found.
    data
        The measurements as they were checked, one entry a robot.
    before, after
        (rows, 6) for each robot, the model at the start and at the end, in the order of `COLUMNS` [m, rad or N]; nan
        where
        nothing was measured.
    evaluations
        How often all poses were solved.
    warnings
        What the data leave open, and bounds that were reached.
    """

    status: Status
    message: str
    free: FreeConstants
    constants: Array
    at_bound: tuple[str, ...]
    uncertainty: Uncertainty
    material: Material
    coefficients: Coefficients
    data: tuple[Data, ...]
    before: tuple[Array, ...]
    after: tuple[Array, ...]
    evaluations: int
    warnings: tuple[str, ...]

    def errors(self, after: bool = True) -> dict[str, Statistics]:
        """Return the misfit by observable over all robots [m, rad, N].

        A tip position's error is a distance, compared with the robot's length; others are compared with the number
        measured.

        Parameters
        ----------
        after
            With the constants found, or else with those at the start.

        Returns
        -------
        dict
            `Misfit` by observable, in m, rad or N.
        """
        return observable_misfits(self.data, self.after if after else self.before)


def observable_misfits(data: Sequence[Data], predicted: Sequence[Array]) -> dict[str, Statistics]:
    """Return the misfit of predictions by observable, see `Identified.errors`."""
    found = {}
    for observable in OBSERVABLES:
        errors, sizes = [], []
        for d, values in zip(data, predicted, strict=True):
            difference = (values - d.values)[:, column_slice(observable)]
            rows = np.any(np.isfinite(d.of(observable)), axis=1)
            errors.append(np.sqrt(np.nansum(difference[rows] ** 2, axis=1)))
            length = np.full(int(np.sum(rows)), float(d.robot.length))
            sizes.append(length if observable == "tip_position" else d.of(observable)[rows, 0])
        if sum(e.size for e in errors):
            found[observable] = statistics(np.concatenate(errors), np.concatenate(sizes))
    return found
