"""Error bars: what tolerances of dimensions, constants and pressures leave uncertain, to first order and sampled."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError, nearest
from softnlp.studies.derivatives import UNITS, entries_of
from softnlp.studies.sensitivity import Sensitivities

Array = NDArray[np.float64]

_FEWEST = 2


@dataclass(frozen=True, eq=False)
class ErrorBars:
    """Standard deviations of outputs whose quantities scatter independently, to first order.

    Attributes
    ----------
    outputs, output_units
        As in `Sensitivities`.
    values
        (outputs,) in their units [SI].
    quantities
        Those with a tolerance, one name an entry.
    tolerance
        (quantities,) their standard deviations [SI].
    total
        (outputs,) the root of the sum of squares of the contributions [SI].
    contribution
        (outputs, quantities) derivative times tolerance, with its sign [SI].
    """

    outputs: tuple[str, ...]
    output_units: tuple[str, ...]
    values: Array
    quantities: tuple[str, ...]
    tolerance: Array
    total: Array
    contribution: Array


@dataclass(frozen=True, eq=False)
class Sampled:
    """Standard deviations found by solving again for drawn quantities.

    Attributes
    ----------
    deviation
        (outputs,) [SI].
    mean_shift
        (outputs,) mean less nominal, what the first order does not see [SI].
    standard_error
        (outputs,) of the deviation, from so few samples [SI].
    solved, asked
        How many samples have a solution.
    """

    deviation: Array
    mean_shift: Array
    standard_error: Array
    solved: int
    asked: int


def error_bars(sensitivities: Sensitivities, tolerances: Mapping[str, float]) -> ErrorBars:
    """Return first-order error bars.

    Parameters
    ----------
    sensitivities
        Of the outputs by the quantities that have a tolerance, and others.
    tolerances
        Standard deviation by name [SI]: of a quantity, for each of its entries ("pressure"), or of one entry
        ("pressure.1").

    Returns
    -------
    ErrorBars
        Of every output.

    Raises
    ------
    InputError
        For a name that is not among the quantities, a tolerance that is negative or not finite, or none.
    """
    columns, sizes = _columns(sensitivities, tolerances)
    contribution = sensitivities.matrix[:, columns] * sizes
    return ErrorBars(
        outputs=sensitivities.outputs,
        output_units=sensitivities.output_units,
        values=sensitivities.values,
        quantities=tuple(sensitivities.quantities[k] for k in columns),
        tolerance=sizes,
        total=np.sqrt(np.sum(contribution**2, axis=1)),
        contribution=contribution,
    )


def monte_carlo(
    sensitivities: Sensitivities,
    tolerances: Mapping[str, float],
    samples: int = 1000,
    *,
    seed: int = 0,
    progress: Callable[[int], None] | None = None,
) -> Sampled:
    """Draw the quantities from independent normal distributions, solve each draw, and return what the outputs do.

    The draws are symmetric: each has its mirror image, so that the mean shift is of second order. A quantity with a
    lower bound of 0 that is drawn below it is set to 0.

    Parameters
    ----------
    sensitivities, tolerances
        As `softnlp.error_bars`.
    samples
        How many draws.
    seed
        Of the draws, the same ones each time.
    progress
        Called with the number of draws done.

    Returns
    -------
    Sampled
        Of every output; nan where fewer than 2 draws have a solution.

    Raises
    ------
    InputError
        As `error_bars`; where there is nothing to solve again; for fewer than 2 samples.
    """
    columns, sizes = _columns(sensitivities, tolerances)
    point = sensitivities.point
    if point is None:
        raise InputError("expected a step with a solution to draw about", key="sensitivities")
    if samples < _FEWEST:
        raise InputError(f"expected at least {_FEWEST} samples, got {samples}", key="samples")
    names = [name for name in UNITS if entries_of(sensitivities.outputs, name)]
    half = np.random.default_rng(seed).standard_normal(((samples + 1) // 2, len(columns)))
    draws = np.concatenate([half, -half])[:samples] * sizes
    lower = np.concatenate([np.full(q.size, q.lower) for q in point.quantities])
    found = []
    for k, draw in enumerate(draws):
        theta = point.theta.copy()
        theta[columns] += draw
        solution = point.solved_at(np.maximum(theta, lower))
        if point.is_solution(solution, 1e-8):
            row = np.full(len(sensitivities.outputs), np.nan)
            for name in names:
                row[entries_of(sensitivities.outputs, name)] = point.change(name, solution)
            found.append(row)
        if progress is not None:
            progress(k + 1)
    table = np.array(found).reshape(len(found), len(sensitivities.outputs))
    if len(table) < _FEWEST:
        nothing = np.full(len(sensitivities.outputs), np.nan)
        return Sampled(nothing, nothing, nothing, len(table), samples)
    deviation = np.std(table, axis=0, ddof=1)
    return Sampled(deviation, np.mean(table, axis=0), deviation / np.sqrt(2 * (len(table) - 1)), len(table), samples)


def _columns(sensitivities: Sensitivities, tolerances: Mapping[str, float]) -> tuple[list[int], Array]:
    """Return the columns that have a tolerance, and their tolerances."""
    if not tolerances:
        raise InputError("expected at least one tolerance", key="tolerances")
    sizes: dict[int, float] = {}
    for name, size in tolerances.items():
        if not (np.isfinite(size) and size >= 0):
            raise InputError(f"expected a number that is not negative, got {size}", key=name)
        entries = entries_of(sensitivities.quantities, name)
        if not entries:
            raise InputError(f"no such quantity here{nearest(name, sensitivities.quantities)}", key=name)
        sizes |= dict.fromkeys(entries, float(size))
    return list(sizes), np.array(list(sizes.values()))
