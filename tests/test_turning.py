"""Moving the states of a rod: to first order sums and differences, and exact for a body that only turns."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from softnlp import BAR, Loads, material, robot
from softnlp.model.numerics import Numerics
from softnlp.model.quantities import Model
from softnlp.model.turning import carried, change, moved
from softnlp.nlp.solver import Engine
from softnlp.statics.solver import PoseSolver

POINTS = 5
RNG = np.random.default_rng(3)


def states(R: np.ndarray, force: np.ndarray, moment: np.ndarray, stretch: float = 1.2) -> np.ndarray:
    """Return x of rotations (points, 3, 3), forces and moments (points, 3), at some positions."""
    columns = R.transpose(0, 2, 1).reshape(POINTS, 9)
    return np.concatenate([[stretch], np.hstack([RNG.normal(size=(POINTS, 3)), columns, force, moment]).ravel()])


def rotations(x: np.ndarray) -> np.ndarray:
    return x[1:].reshape(POINTS, 18)[:, 3:12].reshape(POINTS, 3, 3).transpose(0, 2, 1)


def loads(x: np.ndarray) -> np.ndarray:
    return x[1:].reshape(POINTS, 18)[:, 12:].reshape(POINTS, 2, 3)


def anything() -> np.ndarray:
    return states(Rotation.random(POINTS, random_state=7).as_matrix(), *RNG.normal(size=(2, POINTS, 3)))


def turned(x: np.ndarray, by: np.ndarray) -> np.ndarray:
    """Return x with everything but the positions turned by one rotation."""
    found = x.copy()
    rows = found[1:].reshape(POINTS, 18)
    rows[:, 3:12] = (by @ rotations(x)).transpose(0, 2, 1).reshape(POINTS, 9)
    rows[:, 12:] = (loads(x) @ by.T).reshape(POINTS, 6)
    return found


def test_to_first_order_it_is_the_sum() -> None:
    x, dx = anything(), RNG.normal(size=1 + 18 * POINTS)
    off = [np.abs(moved(x, h * dx) - (x + h * dx)).max() for h in (1e-3, 1e-4)]
    assert off[0] < 1e-4
    assert off[1] < 0.011 * off[0]  # by the square of the step


def test_a_body_that_turns_keeps_turning_without_a_change_of_its_own() -> None:
    x, axis = anything(), np.array([0.3, -0.5, 0.8])
    once, twice = (turned(x, Rotation.from_rotvec(k * 1.1 * axis).as_matrix()) for k in (1, 2))
    onwards = moved(once, change(x, once))
    np.testing.assert_allclose(rotations(onwards), rotations(twice), atol=1e-14)
    np.testing.assert_allclose(loads(onwards), loads(twice), atol=1e-13)
    np.testing.assert_allclose(moved(x, change(x, x)), x, atol=1e-15)


def test_a_change_of_shape_is_carried_over_in_the_body_frame() -> None:
    a, b, turn = anything(), anything(), Rotation.from_rotvec([0.4, 1.0, -0.7]).as_matrix()
    np.testing.assert_allclose(carried(a, a, b), b, atol=1e-14)
    on_the_turned = carried(turned(a, turn), a, b)
    np.testing.assert_allclose(rotations(on_the_turned), turn @ rotations(b), atol=1e-14)
    np.testing.assert_allclose(loads(on_the_turned), loads(b) @ turn.T, atol=1e-13)


@pytest.mark.parametrize("size", [1e5, 1e200])
def test_steps_out_of_all_proportion_raise_nothing(size: float) -> None:
    x = anything()
    assert moved(x, np.full(x.size, size)).shape == x.shape


def test_a_curled_loaded_pose_is_reached_from_the_arc_by_composing_and_not_by_adding() -> None:
    solver = PoseSolver(Model(robot("D10L60"), material("Ecoflex 00-30", "linear")), Numerics())
    values = solver.values(np.array([1.35 * BAR, 0.0, 0.0]), Loads(tip_moment=(0.0, -2.2e-4, 2.6e-4)))
    grid = solver.grid(80)
    p = grid.problem.pack(values)
    arc = solver.arc_guess(grid, p, solver._stretch(values))
    assert np.linalg.norm(arc[-18:-15]) < 0.3  # of the length: the robot is curled up
    composed = grid.engine.solve(p, arc)
    added = Engine(grid.problem, linear=grid.engine.linear, newton_only=True).solve(p, arc)
    assert composed.holds(1e-10)
    assert composed.iterations <= 8
    assert not added.holds(1e-3)
