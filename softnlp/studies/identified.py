"""What an identification found, and how far the model is from the measurements before and after."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from softnlp.base.statistics import Statistics, statistics
from softnlp.base.status import Status
from softnlp.model.conventions import Coefficients
from softnlp.model.materials import Material
from softnlp.nlp.solver import Ipopt
from softnlp.studies.fit_statistics import Uncertainty, constant_note, determined
from softnlp.studies.free_constants import FreeConstants
from softnlp.studies.measurements import OBSERVABLES, Data, column_slice

Array = NDArray[np.float64]

UNEXPLAINED = 0.5  # of what was measured; a model that misses by more does not follow the data
GROWN = 1e-3  # relative; an error that grew by less is the same


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
    engine
        Which engine found them, of `Numerics`; None without a solution.
    ipopt
        What IPOPT said of them, where it took part.
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
    engine: str | None = None
    ipopt: Ipopt | None = None

    @property
    def determined(self) -> dict[str, bool | None]:
        """By name: whether a constant's standard error is within its value, None where it has none."""
        pairs = zip(self.constants, self.uncertainty.standard_errors, strict=True)
        return dict(zip(self.free.names, (determined(*pair) for pair in pairs), strict=True))

    @property
    def notes(self) -> dict[str, str]:
        """By name: whether a constant is at its bound or not determined, else ""."""
        return {name: constant_note(known, name in self.at_bound) for name, known in self.determined.items()}

    def weighted_rms(self, after: bool = True) -> float:
        """Return the root mean square of what is minimised, (model - measured) / sigma with the weights of rows [1].

        Parameters
        ----------
        after
            With the constants found, or else with those at the start.

        Returns
        -------
        float
            The root mean square, nan where a pose was not found [1].
        """
        parts = []
        for d, values in zip(self.data, self.after if after else self.before, strict=True):
            fitted = d.measured & (d.root_weight[:, None] > 0)
            parts.append(((values - d.values) / d.sigma * d.root_weight[:, None])[fitted])
        return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))

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


def without_constants(found: Identified, status: Status, message: str) -> Identified:
    """Return an identification without a result, which keeps the measurements and the model at the start."""
    n = len(found.free.names)
    return replace(
        found,
        status=status,
        message=message,
        constants=np.full(n, np.nan),
        at_bound=(),
        uncertainty=Uncertainty(np.full(n, np.nan), np.full((n, n), np.nan), np.nan, ()),
        after=tuple(np.full_like(values, np.nan) for values in found.before),
        warnings=(),
    )


def grown_errors(found: Identified) -> list[str]:
    """Say which observables are further from what was measured than at the start, and why."""
    before, after = found.errors(False), found.errors()
    grown = [
        f"{key.replace('_', ' ')} rose by {100 * (after[key].rmse / before[key].rmse - 1):.3g} %"
        for key in after
        if after[key].rmse > before[key].rmse * (1 + GROWN)
    ]
    if not grown:
        return []
    weighted = f"from {found.weighted_rms(False):.4g} to {found.weighted_rms():.4g}"
    return [
        f"the rms error of the {' and of the '.join(grown)} from the start on, while what is minimised, the rms of the "
        f"errors divided by sigma, went {weighted}: say in [sigma] what each observable is worth"
    ]


def unexplained(found: Identified) -> list[str]:
    """Say of which observables the constants found leave more than half: another unit or sign is likely."""
    sizes = observable_misfits(found.data, [np.zeros_like(d.values) for d in found.data])
    left = {key: 100 * after.rmse / sizes[key].rmse for key, after in found.errors().items() if sizes[key].rmse > 0}
    return [
        f"the rms error of the {key.replace('_', ' ')} that is left is {percent:.3g} % of what was measured: the model "
        "does not follow these data; check their unit and sign, the pressures and the robot"
        for key, percent in left.items()
        if percent > 100 * UNEXPLAINED
    ]


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
