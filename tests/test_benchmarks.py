"""What benchmarks/ times side by side solves the same equations."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))  # benchmarks/ is not installed

from benchmarks import paper_method, structure
from benchmarks.numpy_field import numpy_field
from benchmarks.statics import CASES, FIXED, MODEL, PRESSURES, our_new_sequence, paper_sequence, rod_at


@pytest.mark.parametrize("case", CASES)
def test_both_methods_find_the_same_tips(case: str) -> None:
    chosen = PRESSURES[[4, 10]]
    theirs = paper_sequence([rod_at(P, CASES[case]) for P in chosen], CASES[case], "arc")
    ours = our_new_sequence(FIXED, CASES[case], chosen)
    assert np.linalg.norm(ours[1] - ours[0]) > 0.1 * MODEL.robot.length
    np.testing.assert_allclose(theirs, ours, atol=1e-7 * MODEL.robot.length)


@pytest.mark.parametrize("lengths", [False, True])
def test_the_field_is_the_same_in_arrays_and_in_floats(lengths: bool) -> None:
    rod = rod_at(PRESSURES[7], CASES["tip force and gravity"])
    rng = np.random.default_rng(5)
    Q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    y = np.concatenate([rng.normal(size=3), Q.ravel(), 0.1 * rng.normal(size=6), np.zeros(6 * lengths)])
    plain, arrays = (field(rod, lengths)(y) for field in (paper_method.field, numpy_field))
    assert np.abs(plain).max() > 0.1
    np.testing.assert_allclose(arrays, plain, rtol=1e-12, atol=1e-12)


def test_the_structure_is_counted_from_the_sources() -> None:
    """Known ones are found, and calls are counted from where they begin."""
    assert {"nlp.solver.Engine", "statics.solver.PoseSolver"} <= set(structure.solvers())
    assert "statics.branch" in structure.iterating()
    assert "model.section" not in structure.iterating()
    assert structure.floors() > structure.floors("studies") > 1
    assert structure.lines() == sum(len(f.read_text().splitlines()) for f in structure.PACKAGE.rglob("*.py"))

    def inner() -> None:
        np.linalg.solve(np.eye(2), np.ones(2))

    assert structure.frames(inner) == 0  # no frame of the package is open
    assert 3 <= structure.frames(structure.calls()["forward"]) <= 12
