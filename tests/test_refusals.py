"""What the Python interface refuses before it solves anything: one line that names the argument."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from designs import silicone

from softnlp import (
    Coefficients,
    ContactSettings,
    InputError,
    Loads,
    Measurements,
    Numerics,
    blocked_force,
    compliance_ellipsoid,
    constrained_pose,
    force_against_offset,
    forward,
    identify,
    inverse,
    manipulability,
    monte_carlo,
    pressure_for_force,
    sensitivities,
    stiffness_ellipsoid,
    weight_sensitivity,
)
from softnlp.model.robot import ROBOTS

ROBOT, SOFT = ROBOTS["D20L40"], silicone("Ecoflex 00-50")
ONE = [1e5, 0.0, 0.0]
TWO = [ONE, ONE]
MEASURED = Measurements(ROBOT, [ONE], bending_angle=[0.5])


def weighted(**weights: Any) -> ContactSettings:
    from softnlp import ClosureWeights

    return ContactSettings(closure="weighted", weights=ClosureWeights(**weights))


REFUSED: list[tuple[str, str, Callable[[], Any]]] = [
    ("times", "got 1 times for 2 steps", lambda: forward(ROBOT, SOFT, TWO, times=[0.0])),
    ("pressures", "one column a chamber set", lambda: forward(ROBOT, SOFT, "much")),
    ("times", "got 1 times for 2 steps", lambda: blocked_force(ROBOT, SOFT, TWO, times=[0.0])),
    ("branches", "not negative, got -1", lambda: blocked_force(ROBOT, SOFT, ONE, branches=-1)),
    ("closure", "expected closure = 'weighted'", lambda: blocked_force(ROBOT, SOFT, ONE, weight_sensitivity=True)),
    ("pressure", "got 2 steps", lambda: force_against_offset(ROBOT, SOFT, TWO, [0.0])),
    ("offsets", "a list of finite offsets", lambda: force_against_offset(ROBOT, SOFT, ONE, [np.nan])),
    ("offsets", "a list of finite offsets", lambda: force_against_offset(ROBOT, SOFT, ONE, [])),
    ("pressure", "got 2 steps", lambda: constrained_pose(ROBOT, SOFT, TWO, Loads())),
    ("sets", "out of 0 to 2, got [3]", lambda: pressure_for_force(ROBOT, SOFT, [3], 0.1)),
    ("sets", "out of 0 to 2, got []", lambda: pressure_for_force(ROBOT, SOFT, [], 0.1)),
    ("force", "above 0, got 0", lambda: pressure_for_force(ROBOT, SOFT, [0], 0.0)),
    ("highest", "above 0, got nan", lambda: pressure_for_force(ROBOT, SOFT, [0], 0.1, highest=np.nan)),
    ("weights", "at least one weight", lambda: weight_sensitivity(ROBOT, SOFT, ONE, weighted())),
    ("pressure", "got 2 steps", lambda: weight_sensitivity(ROBOT, SOFT, TWO, weighted(force=1.0))),
    ("pressure", "got 2 steps", lambda: sensitivities(ROBOT, SOFT, TWO)),
    ("positions", "positions, directions or both", lambda: inverse(ROBOT, SOFT)),
    ("length_per_radian", "above 0", lambda: inverse(ROBOT, SOFT, positions=[0, 0, 0.05], length_per_radian=0.0)),
    ("directions", "a vector of length 0", lambda: inverse(ROBOT, SOFT, directions=[0, 0, 0])),
    ("directions", "got 2 for 1", lambda: inverse(ROBOT, SOFT, positions=[0, 0, 0.05], directions=np.eye(3)[:2])),
    (
        "bounds",
        "a lowest and a highest pressure",
        lambda: inverse(ROBOT, SOFT, positions=[0, 0, 0.05], bounds=(0, "x")),
    ),
    ("bounds", "finite pressures", lambda: inverse(ROBOT, SOFT, positions=[0, 0, 0.05], bounds=(0, np.inf))),
    ("bounds", "not negative", lambda: inverse(ROBOT, SOFT, positions=[0, 0, 0.05], bounds=(-1, 1e5))),
    ("bounds", "at least the lowest", lambda: inverse(ROBOT, SOFT, positions=[0, 0, 0.05], bounds=(2e5, 1e5))),
    ("measurements", "at least one robot", lambda: identify([], SOFT, ["k_b"])),
    ("free", "cannot determine 2 constants", lambda: identify(MEASURED, SOFT, ["k_b", "C10"])),
    ("measurements", "at least one number", lambda: identify(Measurements(ROBOT, [ONE]), SOFT, ["k_b"])),
    ("tip_force", "expected three numbers", lambda: forward(ROBOT, SOFT, ONE, loads=Loads(tip_force="much"))),
    ("gravity", "three finite numbers", lambda: forward(ROBOT, SOFT, ONE, loads=Loads(gravity=(0.0, 0.0)))),
    ("positions", "", lambda: inverse(ROBOT, SOFT, positions="there")),
    ("directions", "", lambda: inverse(ROBOT, SOFT, directions=[0.0, 1.0])),
    ("offset", "a finite length", lambda: blocked_force(ROBOT, SOFT, ONE, ContactSettings(offset=np.nan))),
    ("tip_cap", "not negative", lambda: blocked_force(ROBOT, SOFT, ONE, ContactSettings(tip_cap=-1e-3))),
    ("wall_normal", "or neither", lambda: blocked_force(ROBOT, SOFT, ONE, ContactSettings(wall_point=(0, 0, 0)))),
    ("weights.force", "a weight above 0", lambda: blocked_force(ROBOT, SOFT, ONE, weighted(force=0.0))),
    (
        "wall_point",
        "",
        lambda: blocked_force(ROBOT, SOFT, ONE, ContactSettings(wall_point=(0, 0), wall_normal=(1, 0, 0))),  # type: ignore[arg-type]
    ),
    ("weight", "not negative", lambda: identify(replace(MEASURED, weight=[-1.0]), SOFT, ["k_b"])),
    ("bending_angle", "", lambda: identify(replace(MEASURED, bending_angle="wide"), SOFT, ["k_b"])),
]


@pytest.mark.parametrize(("key", "reason", "call"), REFUSED, ids=[f"{k}-{r[:20]}" for k, r, _ in REFUSED])
def test_an_argument_is_refused_by_name(key: str, reason: str, call: Callable[[], Any]) -> None:
    with pytest.raises(InputError) as caught:
        call()
    assert caught.value.key == key
    assert reason in caught.value.message


def test_what_is_not_solved_has_no_ellipsoids_and_nothing_to_draw() -> None:
    # beyond the limit pressure there is no equilibrium: names and units are there, numbers are not
    lost = sensitivities(
        ROBOT,
        silicone("Ecoflex 00-30", "yeoh"),
        [5e6, 0, 0],
        outputs=("tip_position", "tip_rotation"),
        by=("pressure", "tip_force", "tip_moment"),
        coefficients=Coefficients(elongation=0.0),
    )
    assert not lost.step.status.has_solution
    assert not lost.solved
    assert lost.matrix.shape == (6, 9)
    found = manipulability(lost)
    assert np.isnan([found.measure, found.isotropy, *found.translation.semi_axes]).all()
    for ellipsoid in (
        compliance_ellipsoid(lost),
        stiffness_ellipsoid(lost),
        stiffness_ellipsoid(lost, rotation_held=True),
    ):
        assert np.isnan(ellipsoid.semi_axes).all()
        assert np.isnan(ellipsoid.axes).all()
    for tolerances, key, reason in (
        ({}, "tolerances", "at least one tolerance"),
        ({"pressure": 1e3}, "sensitivities", "a step with a solution"),
        ({"presure": 1e3}, None, "did you mean 'pressure"),
    ):
        with pytest.raises(InputError, match=reason) as caught:
            monte_carlo(lost, tolerances)
        assert key is None or caught.value.key == key


def test_a_blocked_force_without_an_equilibrium_says_so() -> None:
    soft = silicone("Ecoflex 00-30", "yeoh")
    free = Coefficients(elongation=0.0)
    run = blocked_force(ROBOT, soft, [5e6, 0, 0], coefficients=free, numerics=Numerics(intervals=8))
    assert [step.pose for step in run.failed] == [None]
    loaded = blocked_force(
        ROBOT, soft, [5e6, 0, 0], coefficients=free, loads=Loads((0.01, 0, 0)), numerics=Numerics(intervals=8)
    )
    assert loaded.steps[0].status is run.steps[0].status


def test_a_draw_needs_two_samples() -> None:
    found = sensitivities(ROBOT, SOFT, [1e4, 0, 0], numerics=Numerics(intervals=8))
    with pytest.raises(InputError, match="at least 2 samples, got 1"):
        monte_carlo(found, {"pressure": 1e2}, 1)
    seen: list[int] = []
    drawn = monte_carlo(found, {"pressure": 1e2}, 2, progress=seen.append)
    assert (drawn.asked, drawn.solved, seen) == (2, 2, [1, 2])
    assert np.isfinite(drawn.deviation).all()


def test_times_and_progress_go_with_each_blocked_step() -> None:
    seen: list[int] = []
    run = blocked_force(
        ROBOT,
        SOFT,
        [[0.0, 0.0, 0.0], [1e4, 0.0, 0.0]],
        numerics=Numerics(intervals=8),
        times=[0.0, 2.5],
        progress=lambda k, step: seen.append(k),
    )
    assert [step.time for step in run.steps] == [0.0, 2.5]
    assert seen == [0, 1]
    curve = force_against_offset(
        ROBOT, SOFT, [1e4, 0, 0], [-1e-3], numerics=Numerics(intervals=8), progress=lambda k, step: seen.append(k)
    )
    assert len(curve.steps) == 1
    assert seen == [0, 1, 0]
