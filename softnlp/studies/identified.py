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
    """What an identification found. SI units.

    status : solved, or why the model could not be compared with the measurements; `message` says where. free : names,
    start and bounds. constants : (n,) found, nan where nothing was. at_bound : names of those at a bound.
    uncertainty : of the constants. material, coefficients : with the constants found.
    data : the measurements; before, after : (rows, 6) each, the model at the start and at the end, in the order of
    `COLUMNS`, nan where nothing was measured. evaluations : how often all poses were solved.
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
