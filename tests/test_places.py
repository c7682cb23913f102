"""Searches that know only places: brackets, starts, rounds, and moves along the axes."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from softnlp.nlp.bounded import Limits
from softnlp.nlp.places import best_first, crossing, each_from_the_last, in_rounds, least_apart, pattern_search

Array = NDArray[np.float64]
SQUARE = Limits(np.zeros(2), np.ones(2), 1.5)


def test_a_bracket_is_closed_to_the_accuracy_asked_for() -> None:
    asked: list[float] = []

    def curve(x: float) -> float:
        asked.append(x)
        return x**5 - 5.0

    root = crossing(curve, 0.0, 2.0, 5e-10)
    assert root == pytest.approx(5**0.2, rel=1e-10)
    assert root == asked[-1]
    assert len(asked) < 17


def test_a_jump_is_closed_in_on_and_what_is_no_number_ends_the_search() -> None:
    calls: list[float] = []

    def jumps(x: float) -> float:
        calls.append(x)
        return -1.0 if x < 1 / 3 else 1.0

    assert crossing(jumps, 0.0, 1.0, 1e-3) == pytest.approx(1 / 3, abs=1e-11)
    assert len(calls) < 50
    lost = crossing(lambda x: {0.0: -1.0, 1.0: 1.0}.get(x, float("nan")), 0.0, 1.0, 1e-3)
    assert 0 < lost < 1


def test_places_are_followed_from_the_last_that_was_found() -> None:
    def at(place: int, near: int | None) -> int | None:
        if place == 2:
            return None
        return place if near is None or place - near == 1 else None

    assert each_from_the_last([0, 1, 2, 3], at) == [0, 1, None, 3]


def test_starts_are_apart_and_the_best_first() -> None:
    places = np.array([[0.0, 0.0], [0.1, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.5]])
    costs = np.array([2.0, 1.0, 3.0, np.inf, 4.0])
    assert least_apart(costs, places, np.array([0.3, 0.3]), 9) == [1, 2, 4]
    assert least_apart(costs, places, np.array([0.3, 0.3]), 2) == [1, 2]


def test_ends_that_are_enough_come_at_once_and_the_others_in_order() -> None:
    searched: list[float] = []

    def search(start: float) -> float | None:
        searched.append(start)
        return None if start < 0 else start

    ends = best_first(
        [5.0, -1.0, 3.0, 3.0, 0.1, 4.0],
        search,
        enough=lambda x: x < 1,
        place=lambda x: np.array([x]),
        same=0.5,
        rank=lambda x: (x,),
    )
    assert next(ends) == 0.1
    assert searched == [5.0, -1.0, 3.0, 3.0, 0.1]
    assert list(ends) == [3.0, 4.0, 5.0]


def test_rounds_end_where_nothing_improves_or_is_found() -> None:
    def improve(judged: float, best: float | None) -> tuple[float, float | None]:
        nearer = judged if best is None or judged < best else best
        return nearer, None if judged < 1 else judged / 2

    assert in_rounds(8.0, lambda x: x, improve, 3) == 2.0
    assert in_rounds(8.0, lambda x: x, improve, 9) == 0.5
    assert in_rounds(8.0, lambda x: x if x > 3 else None, improve, 9) == 4.0
    assert in_rounds(8.0, lambda x: None, improve, 9) is None


def test_moves_along_the_axes_end_at_the_best_place_within_the_limits() -> None:
    asked: list[Array] = []

    def cost(z: Array) -> float:
        asked.append(z)
        return np.inf if z[0] > 0.8 else float(np.abs(z - np.array([0.9, 0.3])).max())

    start = np.array([0.1, 0.1])
    found = pattern_search((start, cost(start)), cost, SQUARE, first=0.25, last=1e-3, most=500)
    assert cost(found) == min(map(cost, list(asked)))
    assert found[0] == pytest.approx(0.8, abs=2e-3)
    assert all(z.sum() <= 1.5 and (z >= 0).all() and (z <= 1).all() for z in asked)
    few = pattern_search((start, cost(start)), cost, SQUARE, first=0.25, last=1e-3, most=3)
    assert cost(few) > cost(found)
