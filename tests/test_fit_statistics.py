"""What data tell of constants, on Jacobians whose weak directions are known."""

from __future__ import annotations

import numpy as np
import pytest

from softnlp import InputError, robot
from softnlp.studies.fit_statistics import CLOSE, POORLY_CONDITIONED, uncertainty
from softnlp.studies.measurements import Measurements, checked_measurements

RNG = np.random.default_rng(4)
RESIDUALS = 0.01 * RNG.standard_normal(40)
COLUMNS = RNG.standard_normal((40, 4))


def test_three_constants_that_are_nearly_alike_are_no_close_pair_and_are_named() -> None:
    """Of three nearly equal columns two differences are all but open, so that no pair is correlated above one half."""
    J = COLUMNS.copy()
    J[:, 1:] = COLUMNS[:, :1] + 1e-5 * np.linalg.qr(COLUMNS)[0][:, 1:]
    found = uncertainty(["a", "b", "c", "d"], J, RESIDUALS)
    assert found.condition == pytest.approx(np.linalg.cond(J / np.linalg.norm(J, axis=0)), rel=1e-6)
    assert POORLY_CONDITIONED < found.condition < 1e10
    assert np.abs(found.correlation - np.eye(4)).max() < CLOSE
    (warning,) = found.warnings
    assert warning.startswith("the data hardly determine (condition number ")
    assert f"{found.condition:.2g}) " in warning
    assert np.isfinite(found.standard_errors).all()


def test_one_constant_that_nothing_depends_on_is_named_alone() -> None:
    J = COLUMNS.copy()
    J[:, 2] = 0.0
    found = uncertainty(["a", "b", "c", "d"], J, RESIDUALS)
    assert found.warnings == ("the data do not determine c: fix it, or add measurements that depend on it",)
    assert np.isinf(found.standard_errors).tolist() == [False, False, True, False]
    others = uncertainty(["a", "b", "d"], np.delete(J, 2, axis=1), RESIDUALS)  # are known as well as without it
    assert np.delete(found.standard_errors, 2) == pytest.approx(others.standard_errors, rel=1e-9)
    assert np.delete(np.delete(found.correlation, 2, 0), 2, 1) == pytest.approx(others.correlation, abs=1e-9)


P = [[1e5, 0, 0], [5e4, 0, 0]]


def test_a_tilt_is_compared_and_not_fitted() -> None:
    with pytest.raises(InputError, match="tilt: expected none"):
        checked_measurements(Measurements(robot("D25L60"), P, bending_angle=[1.0, 0.5], tilt=[1.0, 0.5]))


@pytest.mark.parametrize(("sigma", "right"), [(0.1, True), ([0.1, 0.2], True), ([0.1, 0.2, 0.3], False)])
def test_a_standard_deviation_is_one_number_or_one_a_row(sigma: object, right: bool) -> None:
    given = Measurements(robot("D25L60"), P, bending_angle=[1.0, 0.5], sigma={"bending_angle": sigma})
    if not right:
        with pytest.raises(InputError, match=r"sigma.bending_angle: expected a number or 2 of them"):
            checked_measurements(given)
        return
    data = checked_measurements(given)
    stated = data.sigma[np.isfinite(data.values)]
    assert stated == pytest.approx(np.broadcast_to(np.asarray(sigma, float), 2))
