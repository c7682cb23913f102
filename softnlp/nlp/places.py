"""Searches that know only places z (k,) and what is said of them: where to start, without derivatives, in rounds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import product
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from softnlp.nlp.bounded import Limits

Array = NDArray[np.float64]

_STILL = 1e-6  # a move that the limits leave no longer than this is none
_NARROW = 1e-12  # of a bracket: what is left of it at a jump
S = TypeVar("S")
T = TypeVar("T")


def spread(limits: Limits, most: int) -> Array:
    """Return places (n, k) over the limits: a grid, or a low-discrepancy sequence for many unknowns."""
    moving = limits.upper > limits.lower
    count = int(moving.sum())
    if not count:
        return limits.lower[None, :].copy()
    levels = int(most ** (1 / count) + 1e-9)
    if levels >= 3 or count == 1:
        unit = _snake(max(levels, 2), count)
    else:
        from scipy.stats import qmc

        drawn = qmc.Sobol(count, seed=3).random_base2(int(np.log2(most)))
        unit = np.vstack([np.zeros((1, count)), np.eye(count), drawn])
    full = np.zeros((len(unit), limits.lower.size))
    full[:, moving] = unit
    z = limits.lower + full * (limits.upper - limits.lower)
    return np.array([limits.clip(row) for row in z])


def _snake(levels: int, count: int) -> Array:
    """Return a grid on 0..1 in an order in which neighbours follow each other."""
    index = np.array(list(product(range(levels), repeat=count)))
    for axis in range(1, count):
        flip = index[:, :axis].sum(axis=1) % 2 == 1
        index[flip, axis] = levels - 1 - index[flip, axis]
    made: Array = index / (levels - 1)
    return made


def each_from_the_last(places: Iterable[S], at: Callable[[S, T | None], T | None]) -> list[T | None]:
    """Return what is found at places in order, each from the one before, else from nothing."""
    found: list[T | None] = []
    near: T | None = None
    for place in places:
        one = None if near is None else at(place, near)
        one = one or at(place, None)
        found.append(one)
        near = one or near
    return found


def least_apart(costs: Array, places: Array, distance: Array, most: int) -> list[int]:
    """Return the places of least cost, best first, that differ by more than a distance (k,) in some entry."""
    chosen: list[int] = []
    for k in np.argsort(costs):
        if not np.isfinite(costs[k]) or len(chosen) == most:
            break
        if all(np.any(np.abs(places[k] - places[j]) > distance) for j in chosen):
            chosen.append(int(k))
    return chosen


def best_first(
    starts: Iterable[S],
    search: Callable[[S], T | None],
    *,
    enough: Callable[[T], bool],
    place: Callable[[T], Array],
    same: float,
    rank: Callable[[T], tuple[float, ...]],
) -> Iterator[T]:
    """Yield where searches end: those that are enough at once, then the others, of least rank first.

    same : of ends no further apart than this the first stands for all.
    """
    apart: list[T] = []
    for start in starts:
        found = search(start)
        if found is None:
            continue
        if enough(found):
            yield found
        if all(np.max(np.abs(place(found) - place(other))) > same for other in apart):
            apart.append(found)
    yield from (found for found in sorted(apart, key=rank) if not enough(found))


def in_rounds(
    start: S, judge: Callable[[S], T | None], improve: Callable[[T, T | None], tuple[T, S | None]], rounds: int
) -> T | None:
    """Judge a place, improve it by what the judgement says, judge again: return the best judgement, None without any.

    improve : of a judgement and the best one before it, which of them is better, and the next place or None.
    """
    best: T | None = None
    place: S | None = start
    for _ in range(rounds):
        judged = None if place is None else judge(place)
        if judged is None:
            break
        best, place = improve(judged, best)
    return best


def pattern_search(
    start: tuple[Array, float],
    cost: Callable[[Array], float],
    limits: Limits,
    *,
    first: float,
    last: float,
    most: int,
) -> Array:
    """Return the place of least cost that moves along the axes lead to from a start, whose cost is known.

    Nothing is asked of the cost but to be compared; inf where there is none. first, last : length of the moves, of the
    limits; it is halved where none helps. most : costs asked for, to within one round of moves.
    """
    (here, least), size, spent = start, first, 0
    moves = np.vstack([np.eye(here.size), -np.eye(here.size)]) * (limits.upper - limits.lower)
    while size > last and spent < most:
        for move in moves:
            z = limits.clip(here + size * move)
            if np.max(np.abs(z - here)) < _STILL:
                continue
            found = cost(z)
            spent += 1
            if found < least:
                here, least = z, found
                break
        else:
            size /= 2
    return here


def crossing(excess: Callable[[float], float], low: float, high: float, accuracy: float) -> float:
    """Return where a function that is below 0 at one end and not at the other is 0, by Brent's method.

    It ends where the function is within the accuracy of 0, or no number, else at a jump across 0.
    """
    from scipy.optimize import brentq

    def cut(argument: float) -> float:
        found = excess(argument)
        return found if abs(found) > accuracy else 0.0

    return float(brentq(cut, low, high, xtol=_NARROW * abs(high - low), rtol=_NARROW))
