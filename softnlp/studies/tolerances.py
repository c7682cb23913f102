"""Error bars: what tolerances of dimensions, constants and pressures leave uncertain, to first order and sampled."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError, nearest
from softnlp.studies.derivatives import UNITS, entries_of
from softnlp.studies.sensitivity import Sensitivities

Array = NDArray[np.float64]

_FEWEST = 2


@dataclass(frozen=True)
class Scatter:
    """What scatters by itself, and moves one or several quantities together.

    Attributes
    ----------
    name
        Of the source.
    moves
        Standard deviation of quantities by name, or of one entry ("pressure.1"), all of which move at once [SI]; it may
        be negative.
    """

    name: str
    moves: Mapping[str, float]


Tolerances = Mapping[str, float] | Sequence[Scatter]


@dataclass(frozen=True, eq=False)
class ErrorBars:
    """Standard deviations of outputs by sources that scatter independently, to first order.

    Attributes
    ----------
    outputs, output_units
        As in `Sensitivities`.
    values
        (outputs,) in their units [SI].
    quantities
        Those with a tolerance, one name an entry; or the sources by name.
    tolerance
        (quantities,) their standard deviations [SI], 1 of a source.
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


def error_bars(sensitivities: Sensitivities, tolerances: Tolerances) -> ErrorBars:
    """Return first-order error bars.

    Parameters
    ----------
    sensitivities
        Of the outputs by the quantities that have a tolerance, and others.
    tolerances
        Standard deviation by name [SI]: of a quantity, for each of its entries ("pressure"), or of one entry
        ("pressure.1"); or sources, each of which may move several quantities at once.

    Returns
    -------
    ErrorBars
        Of every output.

    Raises
    ------
    InputError
        For a name that is not among the quantities, a tolerance that is negative or not finite, or none.
    """
    names, sizes, directions = _directions(sensitivities, tolerances)
    moved = np.flatnonzero(directions.any(axis=1))  # a quantity that does not scatter may have no derivative
    contribution = sensitivities.matrix[:, moved] @ directions[moved]
    return ErrorBars(
        outputs=sensitivities.outputs,
        output_units=sensitivities.output_units,
        values=sensitivities.values,
        quantities=names,
        tolerance=sizes,
        total=np.sqrt(np.sum(contribution**2, axis=1)),
        contribution=contribution,
    )


def monte_carlo(
    sensitivities: Sensitivities,
    tolerances: Tolerances,
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
    sources, _, directions = _directions(sensitivities, tolerances)
    point = sensitivities.point
    if point is None:
        raise InputError("expected a step with a solution to draw about", key="sensitivities")
    if samples < _FEWEST:
        raise InputError(f"expected at least {_FEWEST} samples, got {samples}", key="samples")
    names = [name for name in UNITS if entries_of(sensitivities.outputs, name)]
    half = np.random.default_rng(seed).standard_normal(((samples + 1) // 2, len(sources)))
    draws = np.concatenate([half, -half])[:samples] @ directions.T
    lower = np.concatenate([np.full(q.size, q.lower) for q in point.quantities])
    found = []
    for k, draw in enumerate(draws):
        solution = point.solved_at(np.maximum(point.theta + draw, lower))
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


def _directions(sensitivities: Sensitivities, tolerances: Tolerances) -> tuple[tuple[str, ...], Array, Array]:
    """Return the sources by name, their sizes, and what one deviation of each does to the quantities, a column each."""
    if not isinstance(tolerances, Mapping):
        known = sensitivities.quantities
        directions = np.zeros((len(known), len(tolerances)))
        for k, source in enumerate(tolerances):
            for name, size in source.moves.items():
                if not (entries := entries_of(known, name)) or not np.isfinite(size):
                    raise InputError(f"no such quantity here{nearest(name, known)}", key=name)
                directions[entries, k] += size
        return tuple(source.name for source in tolerances), np.ones(len(tolerances)), directions
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
    directions = np.zeros((len(sensitivities.quantities), len(sizes)))
    directions[list(sizes), np.arange(len(sizes))] = list(sizes.values())
    return tuple(sensitivities.quantities[k] for k in sizes), np.array(list(sizes.values())), directions
