"""Inverse kinematics: round trips, nearest points, least pressures, and the nonlinear program as a witness."""

from __future__ import annotations

import json
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from softnlp import BAR, InputError, Loads, Numerics, Run, Status, forward, inverse, load_scenario, material, robot
from softnlp.cli import main
from softnlp.figures import run_figure
from softnlp.model.conventions import COEFFICIENT_SETS, Coefficients
from softnlp.model.quantities import Model
from softnlp.model.robot import Robot
from softnlp.nlp.bounded import Limits, Measured, least_norm, nearest, quadratic_step
from softnlp.nlp.places import spread
from softnlp.nlp.reduced import Point
from softnlp.results import load_run, to_json
from softnlp.statics.solver import PoseSolver
from softnlp.studies.derivatives import PoseDerivatives
from softnlp.studies.inverse_problem import Tips
from softnlp.studies.inverse_solver import InverseKinematics
from softnlp.studies.targets import Aim, InverseTask, Target, aim_of

Array = NDArray[np.float64]

FOLDER = Path(__file__).parents[1] / "scenarios" / "inverse"
D25, SILICONE = robot("D25L60"), material("Ecoflex 00-50", "mooney-rivlin")
LENGTH, HIGHEST = D25.length, 1.5 * BAR
LOADED = Loads((0.05, 0.02, 0.0), (0.0, 0.0, 1e-3), (0.0, 0.0, -9.8))
GRID = Numerics(intervals=8)
FAR = ((0.05, 0.02, 0.06), (0.0, 0.0, 0.16), (0.03, 0.0, -0.03))


AUTO = Numerics()
ANYWHERE = Aim(Target(np.zeros(3), np.array([0.0, 0.0, 1.0])), float(LENGTH), 1.0)
WIDE = Limits(np.zeros(3), np.full(3, 1.5), 4.5)


def tip_at(tips: Tips, z: Array, near: Point | None = None) -> Point | None:
    """Return the tip at pressures [bar], from the arc or from one nearby."""
    return tips.program(ANYWHERE).at(z, near)


def place(point: Point) -> Array:
    """Return the tip's position over the length; the residuals are those to the origin."""
    return point.r[:3]


@cache
def poses_of(numerics: Numerics, body: Robot) -> PoseSolver:
    return PoseSolver(Model(body, SILICONE), numerics)


def tips(pressures: Array, loads: Loads, numerics: Numerics = AUTO, body: Robot = D25) -> Array:
    """Return the tips of single forward steps, each solved from nothing."""
    found = []
    for P in pressures:
        pose = poses_of(numerics, body).solve(P, loads)[0].pose
        assert pose is not None
        found.append(pose.tip_position)
    return np.array(found)


@cache
def reached(loaded: bool) -> tuple[Array, Run]:
    """Return targets, tips at random pressures of which some are at a bound, and the run that aims at them."""
    loads = LOADED if loaded else Loads()
    rng = np.random.default_rng(5)
    P = rng.uniform(0, HIGHEST, (4, 3))
    P[0, 1], P[1, 2] = 0.0, HIGHEST
    positions = tips(P, loads)
    return positions, inverse(D25, SILICONE, positions=positions, loads=loads)


@pytest.mark.parametrize("loaded", [False, True])
def test_the_forward_pose_at_the_answer_meets_the_target(loaded: bool) -> None:
    positions, run = reached(loaded)
    assert len(run.steps) == len(positions) == 4
    for step in run.steps:
        assert step.status is Status.SOLVED
        assert step.pose is not None
        assert step.pose.stable is (None if loaded else True)  # a dead moment is among the loads
        assert any("stability is undefined" in warning for warning in step.warnings) is loaded
        assert (step.pressure >= 0).all()
        assert (step.pressure <= HIGHEST).all()
        assert step.residual is not None
        assert step.residual <= 1e-8
    again = tips(np.array([step.pressure for step in run.steps[:2]]), LOADED if loaded else Loads())
    assert np.linalg.norm(again - positions[:2], axis=1).max() < 1e-6 * LENGTH


@pytest.mark.thorough
def test_the_nearest_point_is_that_of_a_dense_search() -> None:
    run = inverse(D25, SILICONE, positions=FAR, numerics=GRID)
    table = Tips(poses_of(GRID, D25), Loads(), WIDE, GRID, None)
    levels = np.stack(np.meshgrid(*[np.linspace(0, 1.5, 13)] * 3), -1).reshape(-1, 3)
    dense = []
    near = None
    for z in levels:
        near = tip_at(table, z, near) or tip_at(table, z)
        assert near is not None
        dense.append(place(near) * LENGTH)
    for target, step in zip(FAR, run.steps, strict=True):
        assert step.aimed is not None
        assert step.aimed.distance is not None
        left = np.linalg.norm(np.array(dense) - target, axis=1).min()
        if step.status is Status.OUT_OF_REACH:
            assert f"{1e3 * step.aimed.distance:.6g} mm away" in step.message
            assert step.aimed.tip_position is not None
            assert np.linalg.norm(step.aimed.tip_position - target) == pytest.approx(step.aimed.distance)
        # No pose of the search is nearer but for the error of 8 intervals; it is coarse, so it is not as near either.
        assert left - 0.06 * LENGTH < step.aimed.distance <= left + 5e-4 * LENGTH
    assert run.steps[-1].status is Status.OUT_OF_REACH


def test_the_nearest_point_is_stationary() -> None:
    """No small change of a free pressure comes nearer: the distance is at right angles to what the tip can do."""
    step = inverse(D25, SILICONE, positions=FAR[0], numerics=GRID).steps[0]
    assert step.status is Status.OUT_OF_REACH
    assert step.aimed is not None
    here = float(step.aimed.distance or 0)
    moves = [step.pressure + 300.0 * sign * np.eye(3)[k] for k in range(3) for sign in (1, -1)]
    inside = np.array([P for P in moves if (P >= 0).all() and (P <= HIGHEST).all()])
    assert len(inside) >= 4
    away = np.linalg.norm(tips(inside, Loads(), GRID) - FAR[0], axis=1)
    assert (away > here).all()
    # Where a pressure is free, the change to both sides is of second order; at a bound it is of the first.
    free = (step.pressure > 1e3) & (step.pressure < HIGHEST - 1e3)
    slope = np.abs(away[0] - away[1]) / np.abs(away[:2] - here).max() if free[0] else 0.0
    assert free.sum() == 2
    assert slope < 0.1


@pytest.mark.slow
@pytest.mark.parametrize(
    ("loads", "asked"),
    [
        (Loads(), {"positions": [[0.012, -0.004, 0.072]]}),
        (Loads(), {"positions": [[0.0, 0.03, -0.03]]}),
        (LOADED, {"directions": [[-1.0, 0.3, 0.5]]}),
        (Loads(), {"positions": [[0.02, 0.01, 0.07]], "directions": [[1.0, 0.0, 1.0]]}),
    ],
    ids=["met", "out of reach", "smallest", "weighed"],
)
def test_the_nonlinear_program_agrees(loads: Loads, asked: dict[str, object]) -> None:
    """IPOPT with the pressures freed in the rod's own problem finds the same ones."""
    grid = Numerics(intervals=5)
    ours, theirs = (
        inverse(D25, SILICONE, loads=loads, numerics=grid, method=method, **asked).steps[0]  # type: ignore[arg-type]
        for method in ("newton", "nlp")
    )
    assert ours.status is theirs.status
    assert ours.pressure == pytest.approx(theirs.pressure, abs=5)  # of 1e5 Pa
    assert (theirs.pressure >= 0).all()
    assert (theirs.pressure <= HIGHEST).all()


def test_a_direction_takes_the_smallest_pressures() -> None:
    """With one pressure held elsewhere the others give the direction too, and all are larger."""
    towards = [-1.0, 0.3, 0.5]
    best = inverse(D25, SILICONE, directions=towards, loads=LOADED, numerics=GRID).steps[0]
    assert best.status is Status.SOLVED
    assert best.aimed is not None
    assert best.aimed.angle == pytest.approx(0, abs=1e-7)
    lower, upper = np.zeros(3), np.full(3, HIGHEST)
    lower[1] = upper[1] = 0.1 * BAR
    held = inverse(D25, SILICONE, directions=towards, bounds=(lower, upper), loads=LOADED, numerics=GRID).steps[0]
    assert held.status is Status.SOLVED
    assert held.pressure[1] == 0.1 * BAR
    assert np.linalg.norm(best.pressure) < np.linalg.norm(held.pressure)


def test_four_sets_leave_a_choice_that_is_made_smallest() -> None:
    four = Robot("four", 25e-3, 9e-3, 17e-3, 4.5e-3, 0.5e-3, 60e-3, 4, 1, 0.0)
    P = np.array([0.3, 0.9, 0.8, 0.5]) * BAR
    target = tips(P[None], Loads(), GRID, four)[0]
    step = inverse(four, SILICONE, positions=target, numerics=GRID).steps[0]
    assert step.status is Status.SOLVED
    assert np.linalg.norm(step.pressure) < np.linalg.norm(P)
    # Any change that keeps the tip, to first order, makes the pressures no smaller: z is in the rows of the Jacobian.
    J = PoseDerivatives(poses_of(GRID, four))
    solved = J.poses.solve(step.pressure, Loads())[1]
    assert solved is not None
    slope = J.at(solved, ["pressure"]).derivative("tip_position")
    free = (step.pressure > 0) & (step.pressure < HIGHEST)
    still = np.linalg.svd(slope)[2][-1]
    if free.all():
        assert abs(still @ step.pressure) < 1e-5 * np.linalg.norm(step.pressure)
    else:
        assert (step.pressure == 0).any()


def test_position_against_direction_is_weighed_by_a_length() -> None:
    target = {"positions": [0.02, 0.0, 0.07], "directions": [1.0, 0.0, 0.2]}
    left = []
    for length in (1e-3, 10.0):
        step = inverse(D25, SILICONE, **target, length_per_radian=length, numerics=GRID).steps[0]  # type: ignore[arg-type]
        assert step.status is Status.OUT_OF_REACH
        assert "mm away and" in step.message
        assert step.aimed is not None
        left.append((step.aimed.distance, step.aimed.angle))
    assert left[0][0] < left[1][0]  # type: ignore[operator]
    assert left[0][1] > left[1][1]  # type: ignore[operator]


def test_a_path_is_followed_without_jumps() -> None:
    run = load_and_run("circle")
    P = np.array([step["pressure_bar"] for step in run["steps"]])
    assert len(P) >= 20
    assert [step["status"] for step in run["steps"]] == ["solved"] * len(P)
    assert max(step["distance_mm"] for step in run["steps"]) < 1e-6 * 60
    assert not any(step["warnings"] for step in run["steps"])
    assert P[0] == pytest.approx(P[-1], abs=1e-6)
    # A third of the way round the sets have changed places.
    assert P[8] == pytest.approx(P[0][[2, 0, 1]], abs=5e-5)  # 1e-6 of the length is about as much
    assert np.abs(np.diff(P, axis=0)).max() < 0.1


def test_a_jump_along_a_path_is_said() -> None:
    """The second target is nearest with set 1 only, far from where the first one left the pressures."""
    run = inverse(D25, SILICONE, positions=[[0.09, 0.0, 0.0], [-0.02, 0.0, -0.09]], numerics=GRID)
    assert [step.status for step in run.steps] == [Status.OUT_OF_REACH] * 2
    alone = inverse(D25, SILICONE, positions=[[-0.02, 0.0, -0.09]], numerics=GRID).steps[0]
    assert run.steps[1].pressure == pytest.approx(alone.pressure, abs=1.0)
    jumped = any("the pressures jump" in text for text in run.steps[1].warnings)
    moved = np.abs(run.steps[1].pressure - run.steps[0].pressure).max() > 0.3 * HIGHEST
    assert moved
    assert jumped


def test_pressures_end_where_the_stretch_does() -> None:
    """Without stiffening this law has a limit pressure far below the bound: a target beyond it is out of reach."""
    yeoh, none = material("Dragon Skin 10", "yeoh"), Coefficients(elongation=0.0, bending=0.0)
    step = inverse(
        D25, yeoh, positions=[0.0, 0.0, 0.5], bounds=(0.0, 40 * BAR), coefficients=none, numerics=GRID
    ).steps[0]  # fmt: skip
    assert step.status is Status.OUT_OF_REACH
    assert "pressures end where the stretch does" in step.message
    assert step.pressure.sum() < 119 * BAR
    beyond = inverse(
        D25, yeoh, positions=[0.0, 0.0, 0.5], bounds=(39 * BAR, 40 * BAR), coefficients=none, numerics=GRID
    ).steps[0]  # fmt: skip
    assert beyond.status in (Status.NO_EQUILIBRIUM, Status.UNSTABLE_MATERIAL)
    assert beyond.aimed is not None
    assert beyond.aimed.distance is None


def test_an_unstable_equilibrium_is_no_answer() -> None:
    """A tall soft column cannot stand straight: the target on its axis is met by a pose that buckles only."""
    tall, soft = robot("D10L60"), material("Ecoflex 00-10", "mooney-rivlin")
    standing = Loads(gravity=(0.0, 0.0, -9.8))
    straight = tip_at(Tips(PoseSolver(Model(tall, soft), GRID), standing, WIDE, GRID, 8), np.zeros(3))
    assert straight is not None
    on_axis = place(straight) * tall.length
    assert np.hypot(on_axis[0], on_axis[1]) < 1e-9
    step = inverse(tall, soft, positions=on_axis, bounds=(0.0, 0.0), loads=standing, numerics=GRID).steps[0]
    assert step.status is Status.OUT_OF_REACH
    assert step.aimed is not None
    if step.aimed.tip_position is not None:  # leaning to a side, where it is stable
        assert step.aimed.distance is not None
        assert step.aimed.distance > 0.1 * tall.length


def test_a_shape_through_itself_is_no_answer_unless_it_is_allowed() -> None:
    body, rubber, loose = robot("D10L60"), material("Ecoflex 00-50"), COEFFICIENT_SETS["calibrated"]
    (step,) = forward(body, rubber, [2.2 * BAR, 2.2 * BAR, 0], coefficients=loose).steps
    assert step.pose is not None
    assert step.pose.fit.self_intersecting
    asked = {"positions": step.pose.tip_position, "directions": step.pose.tip_rotation[:, 2], "coefficients": loose}
    bounds = (step.pressure, step.pressure)  # there is no other shape
    (refused,) = inverse(body, rubber, bounds=bounds, **asked).steps
    assert refused.status is Status.OUT_OF_REACH
    assert "a shape that no body can take: the body passes through itself" in refused.message
    assert 'allow = ["self_intersection"]' in refused.message
    (accepted,) = inverse(body, rubber, bounds=bounds, allow=["self_intersection"], **asked).steps
    assert accepted.status is Status.SOLVED
    np.testing.assert_allclose(accepted.pressure, step.pressure, rtol=1e-4)
    assert any("passes through itself" in words for words in accepted.warnings)


@pytest.mark.parametrize("loaded", [False, True])
def test_the_tips_have_exact_slopes(loaded: bool) -> None:
    poses = poses_of(GRID, D25)
    tips = Tips(poses, LOADED, WIDE, GRID, 8) if loaded else Tips(poses, Loads(), WIDE, GRID, None)
    z = np.array([0.4, 0.9, 0.2])
    here = tip_at(tips, z)
    assert here is not None
    for k in range(3):
        ends = [tip_at(tips, z + s * 2e-4 * np.eye(3)[k], here) for s in (1, -1)]
        slope = (ends[0].r - ends[1].r) / 4e-4  # type: ignore[union-attr]
        assert slope == pytest.approx(here.r_slope[:, k], abs=1e-6 * np.abs(here.r_slope).max())


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_quadratic_step_obeys_the_conditions_of_its_optimum(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 5))
    root = rng.normal(size=(n, n))
    H, g = root @ root.T + 0.1 * np.eye(n), rng.normal(size=n)
    limits = Limits(-rng.uniform(0, 1, n), rng.uniform(0, 1, n), float(rng.uniform(0, n / 2)))
    A, b = limits.rows(np.zeros(n), 0.8)
    d = quadratic_step(H, g, A, b)
    assert (A @ d <= b + 1e-10).all()
    # No feasible point nearby is better, in directions drawn at random and cut to the limits.
    cost = g @ d + d @ H @ d / 2
    for _ in range(50):
        other = d + 10 ** rng.uniform(-4, 0) * rng.normal(size=n)
        if (A @ other <= b).all():
            assert g @ other + other @ H @ other / 2 >= cost - 1e-9


def _ring(z: Array, near: Measured | None = None) -> Measured:
    """Return the residual of being on a circle of radius 1 about (1, 0.3), as a map of two unknowns."""
    centre = np.array([1.0, 0.3])
    off = z - centre
    size = float(np.linalg.norm(off))
    return Measured(z, np.array([size - 1.0]), (off / size)[None, :], None)


def test_the_least_norm_on_a_circle_is_towards_the_origin() -> None:
    limits = Limits(np.full(2, -2.0), np.full(2, 3.0), 10.0)
    start, _ = nearest(_ring, _ring(np.array([1.5, 1.4])), limits)
    assert start.r == pytest.approx([0], abs=1e-9)
    end, _ = least_norm(_ring, start, limits)
    centre = np.array([1.0, 0.3])
    assert end.z == pytest.approx(centre * (1 - 1 / np.linalg.norm(centre)), abs=1e-6)
    held, _ = least_norm(_ring, _ring(np.array([1.0, 1.3])), Limits(np.array([0.5, -2]), np.full(2, 3.0), 10.0))
    assert held.z[0] == 0.5
    assert held.r == pytest.approx([0], abs=1e-8)


def test_the_least_norm_stops_where_the_map_ends() -> None:
    """Nothing can be measured beside the start, so it stands, after ever shorter steps."""
    tried: list[Array] = []

    def ends_here(z: Array, near: Measured) -> None:
        tried.append(z)

    start = _ring(np.array([1.0, 1.3]))
    limits = Limits(np.full(2, -2.0), np.full(2, 3.0), 10.0)
    end, _ = least_norm(ends_here, start, limits, np.zeros((2, 2)))
    assert end is start
    lengths = [np.abs(z - start.z).max() for z in tried]
    assert all(b < a / 2 for a, b in pairwise(lengths))
    assert lengths[-1] < 1e-7


def test_the_least_norm_without_curvature_has_it_nearly_when_its_steps_are_used_up() -> None:
    """Where the ring is as curved as this the steps only creep; what they leave is on the ring, and all but least."""
    centre, radius = np.array([1.0, 0.3]), 0.28
    measured = 0

    def ring(z: Array, near: Measured | None = None) -> Measured:
        nonlocal measured
        measured += 1
        off = z - centre
        size = float(np.linalg.norm(off))
        return Measured(z, np.array([size - radius]), (off / size)[None, :], None)

    limits = Limits(np.full(2, -2.0), np.full(2, 3.0), 10.0)
    start = ring(centre + np.array([0.0, radius]))
    end, _ = least_norm(ring, start, limits, np.zeros((2, 2)))
    assert measured == 61
    assert end.r == pytest.approx([0], abs=1e-9)
    assert end.z == pytest.approx(centre * (1 - radius / np.linalg.norm(centre)), abs=1e-6)


def test_limits_are_kept_to_the_last_bit() -> None:
    limits = Limits(np.array([0.0, 0.1]), np.array([1.0, 1.5]), 1.2)
    inside = limits.clip(np.array([1.0 - 1e-13, 5.0]))
    assert (inside >= limits.lower).all()
    assert inside.sum() <= 1.2
    assert limits.clip(np.array([1e-14, 0.3])).tolist() == [0.0, 0.3]
    for most in (64, 729):
        points = spread(Limits(np.zeros(3), np.ones(3), 2.5), most)
        assert points.sum(axis=1).max() <= 2.5
    many = spread(Limits(np.zeros(6), np.ones(6), 6.0), 64)
    assert len(many) == 64 + 7


def test_the_misfit_of_a_direction_grows_with_the_angle() -> None:
    aim = aim_of(InverseTask((), np.zeros(3), np.ones(3), 0.06), Target(None, np.array([0.0, 0.0, 1.0])), 0.06)
    tips = Tips(poses_of(GRID, D25), Loads(), WIDE, GRID, None)
    for angle in np.linspace(0, np.pi, 7):
        towards = np.array([np.sin(angle), 0.0, np.cos(angle)])
        turned = Aim(Target(None, towards), aim.length, 2.0)
        point = tips.program(turned).at(np.zeros(3))  # it points up
        assert point is not None
        assert np.linalg.norm(point.r) == pytest.approx(2.0 * 2 * np.sin(angle / 2), abs=1e-12)
    assert (aim.tangents.T @ np.array([0, 0, 1])).tolist() == [0, 0]


@cache
def load_and_run(name: str, folder: str | None = None) -> dict[str, object]:
    from softnlp.scenario.run import run_scenario

    return to_json(run_scenario(load_scenario(FOLDER / f"{name}.toml")))  # type: ignore[return-value]


def test_every_shipped_scenario_is_read() -> None:
    names = {path.stem: load_scenario(path) for path in FOLDER.glob("*.toml")}
    assert names.keys() >= {"point", "circle", "circle_loaded", "direction", "out_of_reach", "position_and_direction"}
    assert names["circle_loaded"].step_count == 25
    assert any(names["circle_loaded"].loads.gravity)
    task = names["position_and_direction"].task
    assert isinstance(task, InverseTask)
    assert task.upper.tolist() == [1.5 * BAR, 1.2 * BAR, 1.2 * BAR]
    assert task.length_per_radian == pytest.approx(0.01)


def test_out_of_reach_is_said_in_every_result(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["inverse", str(FOLDER / "out_of_reach.toml"), "--out", str(tmp_path)]) == 3
    shown = " ".join(capsys.readouterr().out.split())
    assert "no pressure within the bounds reaches the target" in shown
    document = json.loads((tmp_path / "results.json").read_text())
    first, second, third = document["steps"]
    assert first["status"] == "solved"
    assert first["distance_mm"] < 1e-6 * 60
    assert first["target_mm"] == pytest.approx([10.0, 0.0, 75.0])
    for step in (second, third):
        assert step["status"] == "out_of_reach"
        assert step["tip_position_mm"] is None
        assert np.linalg.norm(np.subtract(step["nearest_mm"], step["target_mm"])) == pytest.approx(step["distance_mm"])
        assert step["direction_error_deg"] is None
    table = (tmp_path / "table.csv").read_text().splitlines()
    assert "target_x_mm" in table[0]
    assert table[3].split(",")[table[0].split(",").index("distance_mm")] != ""
    view = load_run(tmp_path)
    assert view.targets is not None
    figure = run_figure(view)
    assert figure.axes[1].get_ylabel() == "distance left [mm]"
    assert 1e3 * view.targets.distance == pytest.approx([step["distance_mm"] for step in document["steps"]])
    assert (tmp_path / "figure.png").stat().st_size > 10_000


BOUNDS = "[target]\ntip_position_mm = [[0, 0, 1]]\n[bounds]\n"
BROKEN = {
    "": "[target]: missing",
    "[target]\n": "[target]: expected tip_position_mm, tip_direction or both, got none",
    "[target]\ntip_position_mm = [[1.0, 2.0]]\n": "[target] tip_position_mm",
    "[target]\ntip_positon_mm = [[1.0, 2.0, 3.0]]\n": "did you mean 'tip_position_mm'",
    "[target]\ntip_direction = [[0.0, 0.0, 0.0]]\n": "expected a direction, got a vector of length 0",
    "[target]\ntip_direction = [[0, 0, 1]]\nlength_per_radian_mm = 3.0\n": "length_per_radian_mm: expected only",
    "[target]\ntip_position_mm = [[0, 0, 1]]\ntip_direction = [[0, 0, 1], [0, 1, 0]]\n": "one direction a position",
    "[target]\ntip_position_mm = [[0, 0, 1]]\n[bounds]\npressure_bar = [1.0]\n": "pressure_bar: expected [lowest",
    "[target]\ntip_position_mm = [[0, 0, 1]]\n[bounds]\npressure_bar = [1.0, 0.5]\n": "highest pressure of at least",
    BOUNDS + "pressure_bar = [0, nan]\n": "pressure_bar: item 2: expected a finite number, got nan\n",
    BOUNDS + "pressure_bar = [0, true]\n": "pressure_bar: item 2: expected a number, got true\n",
    BOUNDS + "pressure_bar = [[0, 1], [0, -1], [0, 1]]\n": "row 2 column 2: expected a number of at least 0, got -1\n",
    BOUNDS + "pressure_bar = [0, [0, 1]]\n": "pressure_bar: item 1: expected a list, got 0\n",
    BOUNDS + "pressure_bar = 1.5\n": "pressure_bar: expected a list, got 1.5\n",
    "[target]\ntip_position_mm = [[0, 0, 1]]\n[bounds]\npressure_bar = [0.0, 150.0]\n": "at most 100 bar",
    "[target]\ntip_position_mm = [[0, 0, 1]]\n[bounds]\npressure_bar = [[0, 1], [0, 1]]\n": "3 such pairs",
    "[target]\ntip_position_mm = [[0, 0, 1]]\n[pressure]\nsequence_bar = [[0, 0, 0]]\n": "this table is not used",
}


@pytest.mark.parametrize("tables", BROKEN)
def test_a_broken_file_is_one_line(tables: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    head = 'study = "inverse"\n[robot]\nname = "D25L60"\n[material]\nname = "Ecoflex 00-50"\nmodel = "yeoh"\n'
    file = tmp_path / "x.toml"
    file.write_text(head + tables)
    assert main(["inverse", str(file)]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert BROKEN[tables] in told


def test_the_command_refuses_another_study(capsys: pytest.CaptureFixture[str]) -> None:
    other = FOLDER.parent / "D25L60_one_set.toml"
    assert main(["inverse", str(other)]) == 2
    assert "expected study 'inverse', got 'forward'" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        ({}, "positions: expected positions, directions or both"),
        ({"positions": [[1, 2]]}, r"positions: expected \(targets, 3\)"),
        ({"positions": [[0, 0, np.nan]]}, "positions: expected finite numbers"),
        ({"directions": [0, 0, 0]}, "directions: expected directions, got a vector of length 0"),
        ({"positions": [0, 0, 1], "directions": [[0, 0, 1]] * 2}, "directions: expected one a position"),
        ({"positions": [0, 0, 1], "bounds": (-1.0, 2.0)}, "bounds: expected gauge pressures that are not negative"),
        ({"positions": [0, 0, 1], "bounds": (3.0, 2.0)}, "bounds: expected the highest pressure"),
        ({"positions": [0, 0, 1], "bounds": ([0, 0], 2.0)}, "bounds: expected a lowest and a highest pressure"),
        ({"positions": [0, 0, 1], "length_per_radian": 0}, "length_per_radian: expected a length above 0"),
        ({"positions": [0, 0, 1], "method": "simplex"}, "method: expected 'newton' or 'nlp'"),
    ],
)
def test_what_cannot_be_aimed_at_is_refused(asked: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        inverse(D25, SILICONE, **asked)  # type: ignore[arg-type]


def test_solvers_keep_what_they_compiled() -> None:
    task = InverseTask((), np.zeros(3), np.full(3, HIGHEST), LENGTH)
    solver = InverseKinematics(Model(D25, SILICONE), GRID, Loads(), task, "newton")
    first = solver.nearest(Target(np.array([0.01, 0.0, 0.07]), None), None)
    second = solver.nearest(Target(np.array([0.01, 0.0, 0.07]), None), first[1])
    assert first[0].pressure == pytest.approx(second[0].pressure, abs=0.1)
    assert second[0].status is Status.SOLVED
