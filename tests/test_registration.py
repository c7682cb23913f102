"""Registration: frame, sensor's place and clock, fitted together with the constants; wrong ones are named."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from laboratory_files import FOLDER, TRUTH
from scipy.spatial.transform import Rotation

from benchmarks.identify_data import BASE, OFFSET
from softnlp import BAR, Coefficients, Loads, Measurements, Numerics, compare, forward, identify, material, robot
from softnlp import run_scenario as run
from softnlp.base.errors import InputError
from softnlp.cli.example import shipped_folder
from softnlp.results.comparison import comparison_document, rows_text
from softnlp.scenario.compare import compare_task, run_compare
from softnlp.scenario.read import load_scenario
from softnlp.studies.identified import Identified
from softnlp.studies.measurements import RobotTask
from softnlp.studies.registered import sensor_places
from softnlp.studies.registration import Registration
from softnlp.studies.variants import Variant

SILICONE = material("Ecoflex 00-50")
NEWTON = Numerics(engine="newton")
COLUMNS = ("p1_bar", "p2_bar", "p3_bar", "x_mm", "y_mm", "z_mm")


def measured(name: str, order: tuple[int, ...] = (0, 1, 2), times: int = 1) -> Measurements:
    """Return the rows of a file."""
    table = np.genfromtxt(FOLDER / f"registration_{name}.csv", delimiter=",", names=True)
    rows = np.tile(np.column_stack([table[column] for column in COLUMNS]), (times, 1))
    tips = 1e-3 * rows[:, 3:]
    return Measurements(robot("D25L60"), BAR * rows[:, list(order)], tip_position=tips, sigma={"tip_position": 3e-4})


def found(name: str, registration: Registration | None = None, numerics: Numerics = NEWTON, **how: Any) -> Identified:
    """Identify k_e and k_b from the rows of a file."""
    rows = measured(name, **how)
    return identify(rows, SILICONE, ["k_e", "k_b"], registration=registration, numerics=numerics)


WORLD = Registration(fit=("frame", "tip_offset"))
NONE, HERE = Loads(), Registration()
ACROSS, ALONG = Loads(tip_force=(0.1, 0.0, 0.0)), Loads(gravity=(0.0, 0.0, -9.81))
TRUE = Coefficients(elongation=0.55, bending=2.2)
FEW = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [0, 1, 1], [0.5, 0, 1], [1, 0.5, 0.5]]


def simulated(loads: Loads = NONE, order: tuple[int, ...] = (0, 1, 2), placed: Registration = HERE) -> Measurements:
    """Return what a sensor sees of D25L60 at a few pressures, and the columns of pressures in another order."""
    P = 1.2 * BAR * np.array(FEW)
    run = forward(robot("D25L60"), SILICONE, P, loads=placed.in_sets(loads), coefficients=TRUE, numerics=NEWTON)
    poses = [step.pose for step in run.steps if step.pose is not None]
    tips = np.array([pose.tip_position for pose in poses])
    turns = np.array([np.asarray(pose.tip_rotation).ravel(order="F") for pose in poses])
    return Measurements(robot("D25L60"), P[:, list(order)], tip_position=sensor_places(placed, tips, turns))


def said(measurements: Measurements, loads: Loads, registration: Registration | None = None) -> list[str]:
    """Return what the checks of an identification warn of."""
    fit = identify(measurements, SILICONE, ["k_e", "k_b"], loads=loads, registration=registration, numerics=NEWTON)
    return [check.message for check in fit.checks if check.verdict != "passed"]


@pytest.mark.parametrize("loads", [ALONG, ACROSS])
def test_a_mirrored_order_is_named_where_loads_act(loads: Loads) -> None:
    assert not said(simulated(loads), loads)
    (message,) = (words for words in said(simulated(loads, (1, 0, 2)), loads) if "order of the sets" in words)
    assert "set_order = [2, 1, 3] in [registration], the mirror" in message


def test_a_mirrored_order_is_named_where_the_frame_is_fitted() -> None:
    placed = Registration(rotation=Rotation.random(random_state=3).as_matrix(), translation=(0.1, 0.0, -0.2))
    assert not said(simulated(placed=placed), Loads(), WORLD)
    assert any("mirror image" in words for words in said(simulated(order=(0, 2, 1), placed=placed), Loads(), WORLD))


def test_two_sets_that_are_swapped_are_turned_by_half_a_turn_too_and_both_are_named() -> None:
    two = replace(robot("D25L60"), chamber_sets=2)
    P = BAR * np.array([[0, 0], [0.5, 0], [1, 0], [0, 0.4], [0, 0.8], [0.3, 0.9], [1, 0.5]])
    run = forward(two, SILICONE, P, coefficients=TRUE, numerics=NEWTON)
    tips = np.array([step.pose.tip_position for step in run.steps if step.pose is not None])
    (message,) = (w for w in said(Measurements(two, P[:, ::-1], tip_position=tips), NONE) if "clock of the sets" in w)
    assert "clock_deg = 180.0" in message.replace("-180.0", "180.0")
    assert "set_order = [2, 1], which leaves as little" in message


def test_one_plane_of_bending_leaves_the_place_across_it_open_and_says_what_to_measure() -> None:
    P = BAR * np.column_stack([np.linspace(0, 1.2, 9), np.zeros((9, 2))])
    run = forward(robot("D25L60"), SILICONE, P, coefficients=TRUE, numerics=NEWTON)
    tips = np.array([step.pose.tip_position for step in run.steps if step.pose is not None])
    rows = Measurements(
        robot("D25L60"), P, tip_position=tips + np.random.default_rng(0).normal(scale=1e-4, size=(9, 3))
    )
    fit = identify(rows, SILICONE, ["k_b"], registration=WORLD)
    assert fit.ipopt is not None  # which agrees on what the rows do tell
    errors = dict(zip(fit.free.names, fit.uncertainty.standard_errors, strict=True))
    assert np.isinf(errors["tip_offset_y"])
    assert abs(fit.constants[0] - 2.2) < 3 * errors["k_b"] < 1.0  # which is known all the same
    assert abs(fit.constants[fit.free.names.index("tip_offset_y")]) < 1e-3  # where it began
    assert any("bends in another plane" in words for words in fit.warnings)


def test_loads_keep_their_direction_where_the_sets_are_turned() -> None:
    placed = Registration(clock=np.deg2rad(40))
    rows = simulated(ACROSS, placed=placed)
    for registration, numerics in ((placed, NEWTON), (Registration(fit=("clock",)), Numerics())):
        fit = identify(rows, SILICONE, ["k_e", "k_b"], loads=ACROSS, registration=registration, numerics=numerics)
        np.testing.assert_allclose(fit.constants[:2], [0.55, 2.2], rtol=1e-5)
        assert fit.registration is not None
        assert fit.registration.clock == pytest.approx(placed.clock, abs=1e-6)
    assert fit.ipopt is not None  # it moved the loads with the clock
    variant = Variant(SILICONE, TRUE, named="scenario")
    assert compare(rows, variant, loads=ACROSS, registration=placed).statistics(0, "tip_position").largest < 1e-8
    with pytest.raises(InputError, match="identify fits it"):
        compare(rows, variant, loads=ACROSS, registration=Registration(fit=("clock",)))


def test_frame_place_and_constants_are_found_together() -> None:
    fit, truth = found("world", WORLD, Numerics()), TRUTH["registration_world.csv"]
    errors = fit.uncertainty.standard_errors
    assert np.all(errors[:2] < [0.03, 0.05])
    assert np.all(np.abs(fit.constants[:2] - [truth["k_e"], truth["k_b"]]) < 2 * errors[:2])
    assert fit.registration is not None
    np.testing.assert_allclose(1e3 * np.asarray(fit.registration.tip_offset), truth["tip_offset_mm"], atol=0.5)
    np.testing.assert_allclose(1e3 * np.asarray(fit.registration.translation), truth["translation_mm"], atol=0.6)
    R = Rotation.from_euler("ZYX", truth["euler_ZYX_deg"], degrees=True)
    assert (R.inv() * Rotation.from_matrix(fit.registration.rotation)).magnitude() < np.deg2rad(1)
    assert fit.ipopt is not None  # it closed the joint problem


def test_the_shipped_files_of_a_tracker_and_a_logger_give_what_they_were_made_with() -> None:
    fit = run(load_scenario(shipped_folder() / "identify" / "tracked_tips.toml"))
    errors = fit.uncertainty.standard_errors
    assert np.all(np.abs(fit.constants[:2] - [0.55, 2.2]) < 2 * errors[:2])
    assert np.all(np.abs(1e3 * (fit.constants[5:11]) - [*BASE[1], *OFFSET]) < 2 * 1e3 * errors[5:11])


def test_the_same_rows_ten_times_change_nothing() -> None:
    once, often = found("world", WORLD), found("world", WORLD, times=10)
    np.testing.assert_allclose(often.constants, once.constants, atol=1e-6)
    np.testing.assert_allclose(often.uncertainty.standard_errors, once.uncertainty.standard_errors, rtol=1e-4)


def test_the_clock_is_named_and_found() -> None:
    named = [check for check in found("clock_30deg").checks if check.verdict == "warned"]
    clock = next(check for check in named if check.name == "clock of the sets")
    assert clock.value == pytest.approx(30, abs=1)
    fit = found("clock_30deg", Registration(fit=("clock",)))
    assert np.rad2deg(fit.constants[2]) == pytest.approx(30, abs=0.3)
    assert not [check for check in fit.checks if check.verdict != "passed"]


def test_a_mirrored_order_is_named_and_corrected() -> None:
    swapped = found("none", order=(1, 0, 2))
    message = next(check.message for check in swapped.checks if check.name.startswith("order"))
    assert "set_order = [2, 1, 3]" in message
    assert "mirror" in message
    assert swapped.problems  # constants at their bounds
    ordered = Registration(set_order=(2, 1, 3)).ordered(np.array([[1.0, 2.0, 3.0]]))
    np.testing.assert_array_equal(ordered, [[2.0, 1.0, 3.0]])


def test_a_right_frame_passes_every_check_and_a_wrong_origin_is_named() -> None:
    assert all(check.verdict == "passed" for check in found("none").checks)
    given = measured("none")
    moved = Measurements(given.robot, given.pressure, tip_position=given.tip_position + np.array([2e-3, 0, 0]))
    rest = next(
        c for c in identify(moved, SILICONE, ["k_e", "k_b"], numerics=NEWTON).checks if c.name.startswith("rest tip")
    )
    assert rest.verdict == "warned"


def test_what_is_not_offered_together_is_one_line() -> None:
    rows = simulated(ACROSS)
    pushed = replace(rows, blocked_force=np.full(len(FEW), 0.1))
    for given, asked, words in (
        (pushed, Registration(fit=("clock",)), "a clock is not fitted to blocked forces"),
        (rows, Registration(fit=("tip_sensor",)), "expected quaternions of the sensor"),
    ):
        with pytest.raises(InputError, match=words):
            identify(given, SILICONE, ["k_e"], loads=ACROSS, registration=asked, numerics=NEWTON)


def test_slopes_are_those_of_differences() -> None:
    registration = Registration(rotation=Rotation.random(random_state=1).as_matrix(), fit=("frame", "tip_offset"))
    function = registration.function()
    random = np.random.default_rng(0)
    p, turned, g = (
        random.normal(size=3),
        Rotation.random(random_state=2).as_matrix().ravel(order="F"),
        random.normal(size=9),
    )
    parts = [np.asarray(part) for part in function(p, turned, g)]
    for k, x in enumerate((p, turned, g)):
        for j in range(len(x)):
            step = np.zeros(len(x))
            step[j] = 1e-6
            low, high = ([p, turned, g] for _ in range(2))
            low[k], high[k] = x - step, x + step
            slope = (np.asarray(function(*high)[0]) - np.asarray(function(*low)[0])).ravel() / 2e-6
            np.testing.assert_allclose(parts[k + 1][:, j], slope, atol=1e-8)


def oriented(name: str = "world", noise: float = 0.0, turned: Rotation | None = None, of: int = 4) -> Measurements:
    """Return the rows of a file with its quaternions, or the directions of the sensor's axis, in deg of noise."""
    table = np.genfromtxt(FOLDER / f"registration_{name}.csv", delimiter=",", names=True)
    q = Rotation.from_quat(np.column_stack([table[key] for key in ("qx", "qy", "qz", "qw")]))
    q = q * Rotation.from_rotvec(np.random.default_rng(4).normal(scale=np.deg2rad(noise), size=(len(table), 3)))
    q = q if turned is None else q * turned
    seen = q.as_quat() if of == 4 else q.as_matrix()[:, :, 2]
    sigma = {"tip_position": 3e-4, "orientation": np.deg2rad(max(noise, 0.1))}
    return replace(measured(name), orientation=seen, sigma=sigma)


@pytest.mark.parametrize(("of", "fit"), [(4, ()), (3, ()), (4, ("tip_sensor",))])
def test_orientations_beside_positions_make_the_constants_surer(of: int, fit: tuple[str, ...]) -> None:
    axes = Rotation.from_euler("xyz", [90, 20, -40], degrees=True)
    rows = oriented(noise=1.0, turned=axes if fit else None, of=of)
    asked = Registration(fit=("frame", "tip_offset", *fit))
    numerics = Numerics() if fit else NEWTON
    fit_with = identify(rows, SILICONE, ["k_e", "k_b"], registration=asked, numerics=numerics)
    errors, alone = fit_with.uncertainty.standard_errors, found("world", WORLD).uncertainty.standard_errors
    assert np.all(errors[:2] < [1, 0.95] * alone[:2])
    assert np.all(np.abs(fit_with.constants[:2] - [0.55, 2.2]) < 2 * errors[:2])
    assert all(check.verdict == "passed" for check in fit_with.checks)
    assert fit_with.errors()["orientation"].rmse == pytest.approx(np.deg2rad(1) * np.sqrt(of - 1), rel=0.2)
    if fit:
        assert fit_with.ipopt is not None
        assert fit_with.registration is not None
        off = axes.inv() * Rotation.from_matrix(fit_with.registration.tip_sensor)
        assert off.magnitude() < np.deg2rad(1.0)
    variant = Variant(fit_with.material, fit_with.coefficients, named="scenario")
    apart = compare(rows, variant, registration=asked).statistics(0, "orientation")
    assert apart.rmse == pytest.approx(fit_with.errors()["orientation"].rmse, rel=0.02)


@pytest.mark.parametrize("sigma", ["", "[sigma]\norientation_deg = 0.5\ntip_position_mm = 0.3\n"])
def test_a_file_of_orientations_is_fitted_where_their_noise_is_stated(sigma: str, tmp_path: Path) -> None:
    shutil.copy(FOLDER / "registration_world.csv", tmp_path / "tips.csv")
    text = """study = "identify"
[robot]
name = "D25L60"
[material]
name = "Ecoflex 00-50"
model = "mooney-rivlin"
[measurements]
file = "tips.csv"
free = ["k_e", "k_b"]
[registration]
frame = "fit"
tip_offset_mm = "fit"
"""
    (tmp_path / "s.toml").write_text(text + sigma)
    task = load_scenario(tmp_path / "s.toml").task
    assert isinstance(task, RobotTask)
    assert (task.measurements[0].orientation is not None) == bool(sigma)
    assert any("orientations are not fitted" in note for note in task.notes) == (not sigma)
    forward = text.replace('"identify"', '"forward"').replace('file = "tips.csv"\nfree = ["k_e", "k_b"]', "")
    forward = forward.replace("[measurements]", "[pressure]\nsequence_bar = [[0, 0, 0]]")
    turned = "" if not sigma else "tip_sensor_quat_xyzw = [0, 0, 0, 1]\n"
    (tmp_path / "f.toml").write_text(forward + turned)
    asked = compare_task(load_scenario(tmp_path / "f.toml"), tmp_path / "tips.csv")
    assert (asked.measurements[0].orientation is not None) == bool(sigma)
    if sigma:
        texts = comparison_document(asked, run_compare(asked)), rows_text(asked, run_compare(asked))
        assert all("orientation_deg" in json.dumps(text) for text in texts)


def test_a_wrong_order_of_quaternions_is_noticed_by_the_fit() -> None:
    rows = oriented()
    wrong = replace(rows, orientation=np.roll(rows.orientation, 1, axis=1))
    right, again = (identify(m, SILICONE, ["k_e", "k_b"], registration=WORLD, numerics=NEWTON) for m in (rows, wrong))
    assert all(check.verdict == "passed" for check in right.checks)
    assert "another order" in " ".join(c.message for c in again.checks if c.verdict == "warned")


def test_slopes_of_orientations_are_those_of_differences() -> None:
    R, S = (Rotation.random(random_state=k).as_matrix() for k in (1, 5))
    function = Registration(rotation=R, tip_sensor=S, fit=("frame", "clock", "tip_sensor")).orientation()
    random = np.random.default_rng(0)
    turned, axes = (Rotation.random(random_state=k).as_matrix().ravel(order="F") for k in (2, 3))
    g = random.normal(scale=0.3, size=10)
    for whole in (0.0, 1.0):
        _, *slopes = (np.asarray(part) for part in function(turned, axes, whole, g))
        for k, x in enumerate((turned, g)):
            for j in range(len(x)):
                low, high = ([turned, g] for _ in range(2))
                step = 1e-6 * np.eye(len(x))[j]
                low[k], high[k] = x - step, x + step
                ends = (np.asarray(function(at[0], axes, whole, at[1])[0]).ravel() for at in (high, low))
                np.testing.assert_allclose(slopes[k][:, j], np.subtract(*ends) / 2e-6, atol=1e-7)


def test_a_comparison_is_in_the_frame_that_was_measured_in() -> None:
    fit = found("world", WORLD)
    variant = Variant(fit.material, fit.coefficients, named="scenario")
    apart = compare(measured("world"), variant, registration=WORLD)
    assert apart.statistics(0, "tip_position").rmse == pytest.approx(fit.errors()["tip_position"].rmse, rel=1e-4)
