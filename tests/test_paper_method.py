"""The paper's method in benchmarks/ solves the witness's equations, so that timing it beside the package is fair."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from witness import shoot
from witness_blocked import Wall, follow
from witness_blocked import Weights as WitnessWeights
from witness_section import BODIES, Section, published, section

sys.path.insert(0, str(Path(__file__).parents[1]))  # benchmarks/ is not installed

from benchmarks.paper_blocked import Weights, solve_blocked
from benchmarks.paper_method import Rod, integrate, solve_pose

ECOFLEX_50 = published("Ecoflex 00-50")
GRAVITY = (0.0, 0.0, -9.80665)


def rod(sec: Section, gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Rod:
    fx, fy, fz = (1070 * sec.A * g for g in gravity)
    return Rod(sec.L, sec.EA, sec.GA, sec.EI, sec.GJ, sec.PA, sec.d, (fx, fy, fz))


@pytest.mark.parametrize("start", ["zeros", "arc"])
@pytest.mark.parametrize("robot", ["D25L60", "laparoscope-6"])
def test_it_agrees_with_the_witness_on_a_loaded_pose(robot: str, start: str) -> None:
    sec = section(BODIES[robot], ECOFLEX_50, [1.2e5, 3e4, 0])
    force, moment = (0.02, 0.01, -0.03), (1e-4, 0.0, 2e-4)
    exact = shoot(sec, force, moment, GRAVITY)
    answer = solve_pose(rod(sec, GRAVITY), force, moment, start=start)
    assert answer.residual < 1e-9
    np.testing.assert_allclose(answer.tip.p, exact.tip_position, atol=5e-6 * sec.L)
    np.testing.assert_allclose(answer.tip.R, exact.tip_rotation, atol=2e-5)
    np.testing.assert_allclose(answer.tip.lengths, exact.chamber_lengths, atol=5e-6 * sec.L)


def test_a_warm_start_needs_fewer_integrations() -> None:
    sec, near = (section(BODIES["D25L60"], ECOFLEX_50, [P, 0, 0]) for P in (1.0e5, 1.02e5))
    before = solve_pose(rod(sec, GRAVITY), start="arc")
    cold, warm = (solve_pose(rod(near, GRAVITY), start=s) for s in ("zeros", before.base))
    assert warm.evaluations < cold.evaluations
    np.testing.assert_allclose(warm.tip.p, cold.tip.p, atol=1e-9)


def test_its_integration_is_of_fourth_order() -> None:
    sec = section(BODIES["D10L60"], ECOFLEX_50, [1.2e5, 3e4, 0])
    r = rod(sec, GRAVITY)
    base = solve_pose(r, (0.01, 0, 0), start="arc").base
    coarse, fine, exact = (integrate(r, base, n).p for n in (20, 40, 1280))
    assert np.log2(np.abs(coarse - exact).max() / np.abs(fine - exact).max()) == pytest.approx(4, abs=0.3)


@pytest.mark.slow
@pytest.mark.parametrize("W_L", [0.0, 1.0, 5.0])
def test_in_the_plane_and_followed_its_blocked_force_is_the_witness_s(W_L: float) -> None:
    fractions = np.arange(1, 11) / 10
    weights = Weights(L=W_L)
    start, answers = None, []
    for f in fractions:
        r = rod(section(BODIES["D25L60"], ECOFLEX_50, [1.5e5 * f, 0, 0]))
        answers.append(solve_blocked(r, weights, start=start, planar=True))
        start = np.append(answers[-1].base, answers[-1].force)
    wall = Wall("weighted", weights=WitnessWeights(weights.n, weights.m, weights.L, weights.h))
    exact = follow(BODIES["D25L60"], ECOFLEX_50, [1.5e5, 0, 0], [1.0], wall, first_step=0.1, tolerance=1e-8)[0]
    assert answers[-1].force == pytest.approx(exact.force, rel=1e-4)
    assert answers[-1].e_L == pytest.approx(exact.e_L, abs=1e-6)


def test_in_space_its_minimum_leaves_the_plane() -> None:
    start = None
    for f in np.arange(1, 11) / 10:
        answer = solve_blocked(
            rod(section(BODIES["D25L60"], ECOFLEX_50, [1.5e5 * f, 0, 0])), Weights(L=5.0), start=start
        )
        # a push sideways of a micronewton, as rounding would give sooner or later
        start = np.append(answer.base, answer.force)
        start[1] += 1e-6
    assert abs(answer.tip.p[1]) > 0.03
    assert answer.force < 0.8
