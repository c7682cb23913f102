"""Whether two-sigma intervals of constants, frame and sensor's place hold as often as they say, with fixed seeds."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from softnlp import BAR, Coefficients, Measurements, Numerics, forward, identify, material, robot
from softnlp.studies.registered import sensor_places
from softnlp.studies.registration import Registration

SILICONE, NEWTON = material("Ecoflex 00-50"), Numerics(engine="newton")
PLACED = Registration(
    rotation=Rotation.from_euler("ZYX", [120, 40, -75], degrees=True).as_matrix(),
    translation=(0.1, -0.05, -0.2),
    tip_offset=(1.5e-3, -1e-3, 8e-3),
)
NOISE = 3e-4


def held(draws: int, name: str, rows: int = 40) -> np.ndarray:
    """Return in how many draws the interval of each number holds the true one."""
    one = robot(name)
    P = 1.2 * BAR * np.random.default_rng(0).choice([0, 1 / 3, 2 / 3, 1.0], size=(rows, one.chamber_sets))
    run = forward(one, SILICONE, P, coefficients=Coefficients(elongation=0.55, bending=2.2), numerics=NEWTON)
    poses = [step.pose for step in run.steps if step.pose is not None]
    tips = np.array([pose.tip_position for pose in poses])
    turns = np.array([np.asarray(pose.tip_rotation).ravel(order="F") for pose in poses])
    seen, count = sensor_places(PLACED, tips, turns), 0
    for seed in range(draws):
        noisy = seen + np.random.default_rng(seed).normal(scale=NOISE, size=seen.shape)
        rows_of = Measurements(one, P, tip_position=noisy, sigma={"tip_position": NOISE})
        asked = Registration(fit=("frame", "tip_offset"))
        fit = identify(rows_of, SILICONE, ["k_e", "k_b"], registration=asked, numerics=NEWTON)
        assert fit.registration is not None
        x = fit.constants
        reference = np.asarray(fit.registration.rotation) @ _cayley(x[2:5]).T
        turn = 2 * np.tan(0.5 * _angle(reference)) * _axis(reference)
        true = np.concatenate([[0.55, 2.2], turn, PLACED.translation, PLACED.tip_offset])
        count = count + (np.abs(x - true) <= 2 * fit.uncertainty.standard_errors)
    return np.asarray(count)


def _cayley(turn: np.ndarray) -> np.ndarray:
    size = np.linalg.norm(turn)
    return Rotation.from_rotvec(2 * np.arctan(size / 2) * turn / size).as_matrix()


def _left(reference: np.ndarray) -> np.ndarray:
    return Rotation.from_matrix(reference.T @ PLACED.rotation).as_rotvec()


def _angle(reference: np.ndarray) -> float:
    return float(np.linalg.norm(_left(reference)))


def _axis(reference: np.ndarray) -> np.ndarray:
    return np.asarray(_left(reference) / _angle(reference))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["D25L60", "D20L40"])
def test_each_interval_holds_in_88_of_100_draws(name: str) -> None:
    assert np.all(held(100, name) >= 88)


def test_each_interval_holds_in_most_of_a_few_draws() -> None:
    assert np.all(held(8, "D25L60", rows=20) >= 6)
