"""The judgement of models by what was measured: the published numbers, and the errors that documents state."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.judge import VARIANTS, Judgement, Variant, judge, report
from benchmarks.measured import ANGLES, CURVE, ELONGATIONS, FORCES, PRESSURE
from softnlp import Coefficients

REPRODUCTION, CALIBRATED, ENERGY = VARIANTS


def perfect() -> Judgement:
    angles = {(name, sets): pair[sets - 1] for name, pair in ANGLES.items() for sets in (1, 2)}
    forces = {name: tuple(force * p / PRESSURE for p in CURVE) for name, force in FORCES.items()}
    lengths = {name: np.mean(ELONGATIONS[name[-3:]]) for name in FORCES}
    return Judgement(REPRODUCTION, angles, lengths, forces, (115.0, 169.3, 0.34))


def test_a_model_that_gives_what_was_measured_has_no_error() -> None:
    errors = perfect().table
    assert errors.pop("constants fitted") == 3
    assert list(errors.values()) == pytest.approx([0] * len(errors), abs=1e-9)


def test_errors_count_as_they_are_named() -> None:
    best = perfect()
    angles = {key: value + (8 if key == ("D25L60", 1) else 0) for key, value in best.angles.items()}
    forces = {name: tuple(1.1 * f for f in curve) for name, curve in best.forces.items()}
    lengths = {name: ELONGATIONS[name[-3:]][1] + 0.5 for name in FORCES}
    errors = Judgement(REPRODUCTION, angles, lengths, forces, (110.0, 171.3, 0.357)).table
    assert list(errors.values()) == pytest.approx([1.0, 0.5, 10.0, 10.0, -5.0, 2.0, 5.0, 3.0])
    one = Judgement(REPRODUCTION, {}, {}, {"D25L60": (np.nan,) * 4 + (1.18,)}, (115.0, 169.3, 0.34))
    assert one.force_errors["D25L60"][-1] == pytest.approx(0)


def test_one_robot_is_judged_and_another_set_is_further_off() -> None:
    first = judge(Variant("first", 3), ["D25L60"])
    assert first.elongations["D25L60"] == pytest.approx(37.9, abs=0.05)
    assert first.angle_errors["D25L60", 1] == pytest.approx(9, abs=0.5)
    assert first.forces["D25L60"][-1] == pytest.approx(1.22, abs=0.005)
    assert "force errors at 1.5 bar [%]: D25L60 +3" in report([first])
    soft = judge(Variant("soft", 3, Coefficients(), set="srmd"), ["D25L60"])
    assert soft.angle_errors["D25L60", 1] > 60


@pytest.mark.thorough
def test_the_papers_sets_have_the_errors_that_are_stated() -> None:
    for variant, lengths, stated in (
        (REPRODUCTION, (37.9, 39.7, 35.6, 30.9), (44.5, 6.5, 16.2)),
        (CALIBRATED, (40.6, 43.0, 40.7, 39.1), (30.2, 7.7, 8.7)),
    ):
        found = judge(variant)
        assert [found.elongations[name] for name in ANGLES] == pytest.approx(lengths, abs=0.05)
        names = ("angles [deg]", "force at 1.5 bar [%]", "force along 0.3 to 1.5 bar [%]")
        assert [found.table[name] for name in names] == pytest.approx(stated, abs=0.06)


@pytest.mark.slow
def test_one_constant_has_the_errors_that_are_stated() -> None:
    found = judge(ENERGY).table
    assert found["angles [deg]"] == pytest.approx(24.3, abs=0.06)
    assert found["force at 1.5 bar [%]"] == pytest.approx(9.6, abs=0.06)
    assert found["force along 0.3 to 1.5 bar [%]"] == pytest.approx(10.4, abs=0.06)
