"""Statistics of errors against numbers worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from softnlp.base.statistics import statistics

NUMBERS = st.floats(-1e3, 1e3).filter(lambda x: x == 0 or abs(x) > 1e-3)
ERRORS = st.integers(1, 12).flatmap(lambda n: st.tuples(*[arrays(float, n, elements=NUMBERS)] * 2))


def test_statistics_are_those_worked_out_by_hand() -> None:
    found = statistics(np.array([3.0, -1.0, 2.0, -4.0]), np.array([30.0, 10.0, 0.0, -16.0]))
    assert (found.count, found.left_out) == (4, 1)
    assert found.rmse == pytest.approx(math.sqrt(30 / 4))
    assert found.mape == pytest.approx((10 + 10 + 25) / 3)
    assert (found.mean, found.median, found.largest, found.bias) == (2.5, 2.5, 4.0, 0.0)
    assert statistics(np.array([1.0, -5.0, 3.0])).median == 3


def test_nothing_has_no_statistics() -> None:
    nothing = statistics(np.zeros(0), np.zeros(0))
    assert (nothing.count, nothing.left_out) == (0, 0)
    assert all(math.isnan(x) for x in (nothing.rmse, nothing.mape, nothing.mean, nothing.largest, nothing.bias))
    zeros = statistics(np.array([1.0, 2.0]), np.zeros(2))
    assert math.isnan(zeros.mape)
    assert (zeros.left_out, zeros.mean) == (2, 1.5)
    assert math.isnan(statistics(np.array([1.0])).mape)


def test_next_to_nothing_is_left_out_of_the_mape_alone() -> None:
    found = statistics(np.array([1.0, 1.0]), np.array([1e-9, 100.0]))
    assert (found.count, found.left_out, found.mape) == (2, 1, pytest.approx(1))


@given(ERRORS, st.randoms(use_true_random=False))
def test_the_order_changes_nothing(pair: tuple[np.ndarray, np.ndarray], random) -> None:  # type: ignore[no-untyped-def]
    order = list(range(len(pair[0])))
    random.shuffle(order)
    one, other = statistics(*pair), statistics(pair[0][order], pair[1][order])
    for name in ("count", "left_out", "median", "largest"):
        assert getattr(one, name) == getattr(other, name)
    for name in ("rmse", "mape", "mean", "bias"):
        assert getattr(one, name) == pytest.approx(getattr(other, name), rel=1e-12, abs=1e-12, nan_ok=True)


@given(ERRORS, st.floats(0.1, 10))
def test_sizes_are_in_order_and_scale(pair: tuple[np.ndarray, np.ndarray], scale: float) -> None:
    one, other = statistics(*pair), statistics(scale * pair[0], scale * pair[1])
    slack = 1e-9 * one.largest
    assert abs(one.bias) <= one.mean + slack
    assert one.mean <= one.rmse + slack
    assert one.rmse <= one.largest + slack
    assert one.median <= one.largest
    assert other.rmse == pytest.approx(scale * one.rmse, rel=1e-9, abs=1e-300)
    assert other.mape == pytest.approx(one.mape, rel=1e-9, nan_ok=True)
