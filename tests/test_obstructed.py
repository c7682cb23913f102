"""Poses among obstacles: closed forms, balances, the wall of a blocked force, the way in and out."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import casadi as ca
import h5netcdf
import numpy as np
import pytest
from designs import random_design
from scipy.optimize import fsolve

from softnlp import (
    BAR,
    ENERGY,
    Coefficients,
    ContactSettings,
    Loads,
    Numerics,
    blocked_force,
    forward,
    load_scenario,
    material,
    robot,
)
from softnlp.base.errors import InputError
from softnlp.base.status import Status
from softnlp.cli import main
from softnlp.figures import run_figure
from softnlp.model.conventions import REPRODUCTION
from softnlp.model.obstacles import Capsule, Cylinder, Obstacle, Plane, Sphere, Trocar, Tube
from softnlp.model.quantities import Model
from softnlp.results import load_run, view_of_run
from softnlp.scenario.workspace import plan_of
from softnlp.statics.kept import pose_solver
from softnlp.statics.loadcase import whole_weight
from softnlp.statics.obstacle_grid import Touched
from softnlp.statics.obstacle_slope import ObstacleSlope
from softnlp.statics.obstacle_solver import ObstacleSolver, among_obstacles
from softnlp.statics.step import Run
from softnlp.studies.blocked_obstacles import blocked_among
from softnlp.studies.forward import several_poses
from softnlp.studies.inverse_obstacles import InverseAmongObstacles
from softnlp.studies.targets import InverseTask, Target

SHIPPED = Path(__file__).parents[1] / "scenarios" / "contact"
SILICONE = material("Ecoflex 00-50")
NEWTON = Numerics(engine="newton")


def run(obstacles: list[Obstacle], bars: list[float], numerics: Numerics = NEWTON, **settings: object) -> Run:
    pressures = [[bar * BAR, 0, 0] for bar in bars]
    return forward(robot("D25L60"), SILICONE, pressures, obstacles=obstacles, numerics=numerics, **settings)  # type: ignore[arg-type]


@cache
def against_a_ball() -> Run:
    return run([Sphere(centre=(-0.03, 0, 0.04), radius=0.01)], [0.3, 0.6, 0.9, 0.6, 0.3])


def balance(solver: ObstacleSolver, found: Touched, loads: Loads, forces: np.ndarray) -> float:
    """Return the force at the base less all that acts on the rod [N]."""
    carried = found.before[12:15, 0] * found.units[1]
    weight = np.asarray(whole_weight(found.constants)).ravel() * found.units[1]
    assert solver.poses is not None
    return float(np.abs(carried - weight - np.asarray(loads.tip_force) - forces).max())


def test_a_plane_at_the_tip_s_axis_is_the_wall_of_a_blocked_force() -> None:
    plane = Plane(point=(-0.02, 0, 0), normal=(1, 0, 0), part="tip axis")
    pressed = run([plane], [0.3, 1.0, 1.4]).steps
    contact = ContactSettings(closure="free", wall_point=(-0.02, 0, 0), wall_normal=(1, 0, 0))
    walls = blocked_force(robot("D25L60"), SILICONE, [[b * BAR, 0, 0] for b in (0.3, 1.0, 1.4)], contact).steps
    assert walls[0].status is Status.NO_CONTACT
    assert pressed[0].contacts[0].arc.size == 0
    for one, other in zip(pressed[1:], walls[1:], strict=True):
        assert other.contact is not None
        assert one.contacts[0].force == pytest.approx([other.contact.force, 0, 0], abs=1e-6)
        assert one.pose is not None
        assert other.pose is not None
        assert one.pose.tip_position == pytest.approx(other.pose.tip_position, abs=1e-7)


def test_a_beam_on_a_ball_has_the_reaction_of_a_propped_cantilever() -> None:
    slender = replace(robot("D10L60"), length=0.4)
    r, a, F = slender.outer_diameter / 2, 0.2, 1e-5
    ball = Sphere(centre=(-r - 0.05, 0, a), radius=0.05)
    step = forward(slender, SILICONE, [[0, 0, 0]], loads=Loads(tip_force=(-F, 0, 0)), obstacles=[ball], numerics=NEWTON)
    (contact,) = step.steps[0].contacts
    assert contact.force[0] == pytest.approx(F * (3 * slender.length - a) / (2 * a), rel=5e-3)
    assert contact.arc == pytest.approx(np.full(contact.arc.size, a / slender.length), abs=5e-3)


def test_a_beam_lies_down_on_a_floor_where_timoshenko_s_does() -> None:
    slender = replace(robot("D10L60"), length=0.25)
    floor = Plane(point=(-slender.outer_diameter / 2 - 0.004, 0, 0), normal=(1, 0, 0))
    across = Loads(gravity=(-9.80665, 0, 0))
    free = forward(slender, SILICONE, [[0, 0, 0]], loads=across, numerics=NEWTON).steps[0].pose
    (step,) = forward(slender, SILICONE, [[0, 0, 0]], loads=across, obstacles=[floor], numerics=NEWTON).steps
    assert free is not None
    assert free.tip_position[0] < -0.02
    assert step.pose is not None
    lowest = step.pose.shape.position[:, 0].min()
    assert lowest == pytest.approx(-0.004, abs=2e-5)
    lying = step.contacts[0].arc
    assert lying[-1] > 0.99
    assert lying[0] < 0.7
    model = Model(slender, SILICONE)
    section = model.section.at(model.numbers, [0, 0, 0], 1.0)
    w, EI, GA = section.line_density * 9.80665, section.bending_stiffness[0], section.shear_stiffness
    a, moment = touch_down(w, EI, GA, 0.004)
    assert step.pose.shape.moment[0, 1] == pytest.approx(-moment, rel=1e-3)
    assert lying[0] * slender.length == pytest.approx(a, abs=5e-4)


def touch_down(w: float, EI: float, GA: float, drop: float) -> tuple[float, float]:
    """Return where Timoshenko's beam under its weight w lies down on a floor, and the moment at its clamped end.

    On the floor y' = theta + V / GA = 0, so that theta falls there as exp(-x sqrt(GA / EI)) and the push is spread.
    """

    def off(u: Any) -> list[float]:
        a, V, M = u[0], u[1] * w * u[0], u[2] * w * u[0] ** 2
        theta = (M * a - V * a**2 / 2 + w * a**3 / 6) / EI
        y = (M * a**2 / 2 - V * a**3 / 6 + w * a**4 / 24) / EI + (V * a - w * a**2 / 2) / GA
        there = M - V * a + w * a**2 / 2
        slope = theta + (V - w * a) / GA
        return [(y - drop) / drop, slope * a / drop, (there + np.sqrt(GA * EI) * theta) / (w * a**2)]

    a, _, M = fsolve(off, [(72 * EI * drop / w) ** 0.25, 2 / 3, 1 / 6])
    return float(a), float(M * w * a**2)


def test_pressed_in_and_pulled_out_the_poses_are_the_same() -> None:
    steps = against_a_ball().steps
    assert [s.status for s in steps] == [Status.SOLVED] * 5
    for there, back in ((0, 4), (1, 3)):
        a, b = steps[there].pose, steps[back].pose
        assert a is not None
        assert b is not None
        assert a.tip_position == pytest.approx(b.tip_position, abs=6e-8)
    assert np.linalg.norm(steps[2].contacts[0].force) > np.linalg.norm(steps[1].contacts[0].force) > 0.05
    for step in steps:
        assert step.contacts[0].gap > -2e-5
        assert step.complementarity == pytest.approx(0, abs=1e-8)


def test_two_poses_at_the_same_pressures_are_named() -> None:
    there, _, _, _, back = against_a_ball().steps
    assert not any("not unique" in warning for step in against_a_ball().steps for warning in step.warnings)
    assert back.pose is not None
    moved = replace(back, pose=replace(back.pose, tip_position=back.pose.tip_position + np.array([0, 0, 1e-3])))
    first, second = several_poses([there, moved], 1e-6)
    assert first.warnings == there.warnings
    assert second.warnings[-1].startswith("the branch is not unique: step 1 has the same pressures")
    assert "1 mm" in second.warnings[-1]


@pytest.mark.parametrize("engine", ["auto", "ipopt"])
def test_the_engines_agree(engine: str) -> None:
    step = run([Sphere(centre=(-0.03, 0, 0.04), radius=0.01)], [0.6], Numerics(engine=engine)).steps[0]  # type: ignore[arg-type]
    other = against_a_ball().steps[1]
    assert step.status is Status.SOLVED
    assert step.ipopt is not None
    assert step.pose is not None
    assert other.pose is not None
    assert step.pose.tip_position == pytest.approx(other.pose.tip_position, abs=1e-6 * 0.06)


def test_the_error_of_the_tip_is_what_finer_grids_show() -> None:
    ball = [Sphere(centre=(-0.03, 0, 0.04), radius=0.01)]
    tips = []
    for intervals in (10, 20, 80):
        (step,) = run(ball, [0.9], replace(NEWTON, intervals=intervals)).steps
        assert step.pose is not None
        tips.append(step.pose.tip_position)
    coarse, fine = (float(np.linalg.norm(tip - tips[-1])) / 0.06 for tip in tips[:2])
    assert fine < 2e-4
    assert coarse < 5e-3


def test_a_port_holds_the_robot_and_its_radius_grows_thin_with_stretch() -> None:
    wide = [Trocar(point=(0, 0, 0.03), axis=(0, 0, 1), radius=0.0127, length=0.004)]
    (step,) = run(wide, [0.6]).steps
    assert step.pose is not None
    at = np.argmin(np.abs(step.pose.shape.position[:, 2] - 0.03))
    room = 0.0127 - step.pose.radii.outer
    assert 0 < room < 0.0127 - 0.0125 + 5e-4
    assert np.hypot(*step.pose.shape.position[at, :2]) < 1.3 * room
    assert float(step.contacts[0].force[0]) > 0.1


def test_a_measuring_wall_stands_beside_obstacles() -> None:
    poses = pose_solver(Model(robot("D25L60"), SILICONE), NEWTON)
    wall = ContactSettings(closure="free", wall_point=(-0.025, 0, 0), wall_normal=(1, 0, 0))
    pressures = np.array([[0.3, 0, 0], [1.0, 0, 0]]) * BAR
    ball = Sphere(centre=(-0.024, 0, 0.03), radius=0.01)
    apart = blocked_among(poses, pressures, Loads(), wall, [Sphere(centre=(0.1, 0, 0.04), radius=0.01)])
    alone = blocked_force(robot("D25L60"), SILICONE, pressures, wall, numerics=NEWTON).steps
    beside = blocked_among(poses, pressures, Loads(), wall, [ball])
    assert apart[0].status is alone[0].status is Status.NO_CONTACT
    for steps in (apart, beside, alone):
        assert steps[1].contact is not None
    assert apart[1].contact.force == pytest.approx(alone[1].contact.force, abs=1e-6)  # type: ignore[union-attr]
    assert apart[1].contact.gap == pytest.approx(alone[1].contact.gap, abs=1e-7)  # type: ignore[union-attr]
    assert len(beside[1].contacts) == 1
    assert beside[1].contacts[0].force[0] > 0.01
    assert beside[1].contact.force != pytest.approx(alone[1].contact.force, abs=1e-3)  # type: ignore[union-attr]


def test_the_usual_measuring_wall_stands_where_the_free_shape_goes() -> None:
    poses = pose_solver(Model(robot("D25L60"), SILICONE), NEWTON)
    pressures, ball = np.array([[1.0, 0, 0]]) * BAR, Sphere(centre=(0.2, 0, 0.03), radius=0.01)
    for offset in (0.0, -2e-3):
        wall = ContactSettings(closure="free", offset=offset)
        (apart,) = blocked_among(poses, pressures, Loads(), wall, [ball])
        (alone,) = blocked_force(robot("D25L60"), SILICONE, pressures, wall, numerics=NEWTON).steps
        assert apart.contact is not None
        assert alone.contact is not None
        assert apart.contact.force == pytest.approx(alone.contact.force, abs=1e-6)
        assert apart.contact.gap == pytest.approx(alone.contact.gap, abs=1e-7)
    with pytest.raises(InputError, match="expected at most 0"):
        blocked_among(poses, pressures, Loads(), ContactSettings(closure="free", offset=2e-3), [ball])


def test_a_rim_pushes_further_out_than_the_axis() -> None:
    forces, bending = [], []
    for part in ("tip axis", "tip rim", "body"):
        wall = Plane(point=(-0.02, 0, 0), normal=(1, 0, 0), part=part)  # type: ignore[arg-type]
        (step,) = run([wall], [1.0]).steps
        assert step.pose is not None
        forces.append(step.contacts[0].force[0])
        bending.append(step.pose.bending_angle)
    assert forces[1] > 1.2 * forces[0]
    assert forces[2] == pytest.approx(forces[1], rel=0.05)  # the radius of the body is that of the stretched section
    assert bending[1] < bending[0]


@pytest.mark.parametrize("seed", [1, 3, pytest.param(5, marks=pytest.mark.slow)])
def test_forces_balance_and_nothing_overlaps(seed: int) -> None:
    check_random(seed)


@pytest.mark.slow
def test_hundreds_of_random_obstacles() -> None:
    ended = [check_random(seed) for seed in range(150)]
    energy, paper = ended[2::3], ended[0::3] + ended[1::3]
    assert paper.count(Status.SOLVED) >= 0.93 * len(paper)
    assert energy.count(Status.SOLVED) >= 0.65 * len(energy)  # it curls further at the same pressures


def random_case(seed: int) -> tuple[ObstacleSolver, Any, Loads]:
    """Return a random robot, one in three with the energy section, among one or two random obstacles."""
    rng = np.random.default_rng(seed)
    while True:
        design = random_design(rng)
        L, D = design.robot.length, design.robot.outer_diameter
        loads = Loads(design.loads.tip_force, (0, 0, 0), design.loads.gravity) if rng.random() < 0.5 else Loads()
        obstacles = [random_obstacle(rng, L, D) for _ in range(1 + int(rng.random() < 0.3))]
        energy = seed % 3 == 2
        conventions, coefficients = (ENERGY, Coefficients()) if energy else (REPRODUCTION, Coefficients())
        poses = pose_solver(Model(design.robot, design.material, coefficients, conventions), NEWTON)
        try:
            solver = among_obstacles(poses, obstacles)
        except InputError:  # it overlaps one at rest
            continue
        pressure = design.pressure
        while poses.branch_at(poses.values(pressure, loads)).status is not Status.SOLVED:
            pressure = pressure / 2  # the other section ends before
        return solver, pressure, loads


def check_random(seed: int) -> Status:
    """Solve a random robot among random obstacles and judge the answer."""
    solver, pressure, loads = random_case(seed)
    obstacles = solver.obstacles
    step, found = solver.solve(pressure, loads)
    if step.status is Status.SOLVED:
        assert found is not None
        assert step.residual is not None
        assert step.residual < 1e-8
        assert min(contact.gap for contact in step.contacts) > -2e-5
        forces = sum((contact.force for contact in step.contacts), np.zeros(3))
        assert balance(solver, found, loads, forces) < 1e-8 * max(1.0, found.units[1])
        assert step.pose is not None
        for obstacle in obstacles:  # the distance again, of points of the surface
            points = step.pose.shape.position[1:]
            if obstacle.part == "body":
                angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
                around = np.stack([np.cos(angles), np.sin(angles), np.zeros(24)])
                rings = step.pose.shape.rotation[1:] @ (step.pose.radii.outer * around)
                points = (points[:, :, None] + rings).transpose(0, 2, 1).reshape(-1, 3)
            else:
                points = points[-1:]
            assert outside(obstacle, points).min() > -2e-5, f"{obstacle}"
    return step.status


def outside(obstacle: Obstacle, points: np.ndarray) -> np.ndarray:
    """Return how far points (n, 3) are out of an obstacle [m], from its surfaces and edges by numpy alone."""
    if isinstance(obstacle, Plane):
        return (points - np.array(obstacle.point)) @ np.array(obstacle.normal)
    if isinstance(obstacle, Sphere):
        return np.linalg.norm(points - np.array(obstacle.centre), axis=1) - obstacle.radius
    *ends, radius = obstacle.numbers
    a, b = np.array(ends[:3]), np.array(ends[3:])
    length = float(np.linalg.norm(b - a))
    z = (points - a) @ (b - a) / length
    if isinstance(obstacle, Capsule):
        nearest = a + np.clip(z / length, 0, 1)[:, None] * (b - a)
        return np.linalg.norm(points - nearest, axis=1) - radius
    wide = np.linalg.norm(points - a - z[:, None] * (b - a) / length, axis=1)
    radial, beyond = (wide - radius) * (1 if isinstance(obstacle, Cylinder) else -1), np.maximum(-z, z - length)
    out = np.hypot(np.maximum(radial, 0), np.maximum(beyond, 0))
    return np.where(out > 0, out, np.maximum(radial, beyond))


def random_obstacle(rng: np.random.Generator, L: float, D: float) -> Obstacle:
    kind = rng.choice(["plane", "sphere", "cylinder", "capsule", "trocar", "tube"])
    a, z = rng.uniform(0, 2 * np.pi), rng.uniform(0.3, 1.1) * L
    e, up = np.array([np.cos(a), np.sin(a), 0.0]), np.array([0.0, 0.0, 1.0])
    gap = D / 2 + rng.uniform(0.02, 0.4) * L
    if kind == "plane":
        n = -e + rng.normal(size=3) * 0.3
        return Plane(point=e * gap + z * up, normal=n, part=rng.choice(["body", "tip axis", "tip rim"]))
    if kind == "sphere":
        radius = rng.uniform(0.05, 0.4) * L
        return Sphere(centre=e * (gap + radius) + z * up, radius=radius)
    if kind in ("cylinder", "capsule"):
        t = np.cross(e, up) + rng.normal(size=3) * 0.4
        radius = rng.uniform(0.05, 0.3) * L
        c = e * (gap + radius) + z * up
        ends = {"start": c - t * L, "end": c + t * L, "radius": radius}
        return Cylinder(**ends) if kind == "cylinder" else Capsule(**ends)
    radius = D / 2 * rng.uniform(1.02, 1.4)
    if kind == "trocar":
        return Trocar(point=0.8 * z * up, axis=up, radius=radius, length=rng.uniform(0.05, 0.3) * L)
    return Tube(start=0.05 * L * up, end=0.8 * z * up, radius=radius)


# --- scenarios --------------------------------------------------------------------------------------------------------

HEAD = 'study = "forward"\n[robot]\nname = "D25L60"\n[material]\nname = "Ecoflex 00-50"\nmodel = "mooney-rivlin"\n'
PRESSED = "[pressure]\nsequence_bar = [[0.5, 0, 0]]\n"
WORKSPACE = HEAD.replace("forward", "workspace") + "[workspace]\nlevels = 2\nto_bar = 0.6\nsets = [1]\n"
INVERSE = HEAD.replace("forward", "inverse") + "[target]\ntip_position_mm = [[-24, 5, 68]]\n"
BALL = '[[obstacle]]\nkind = "sphere"\ncentre_mm = [-30, 0, 40]\nradius_mm = 10\n'


def test_a_run_leaves_forces_in_every_file_and_its_figure_can_be_drawn_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "ball.toml"
    file.write_text(HEAD + PRESSED.replace("[0.5, 0, 0]", "[0.2, 0, 0], [0.6, 0, 0]") + BALL + 'name = "liver"\n')
    assert main(["run", str(file), "--out", str(tmp_path / "out")]) == 0
    capsys.readouterr()
    document = json.loads((tmp_path / "out" / "results.json").read_text())
    assert document["obstacles"] == [
        {"kind": "sphere", "centre_mm": [-30.0, 0.0, 40.0], "radius_mm": 10.0, "part": "body", "name": "liver"}
    ]
    away, touching = (step["contacts"][0] for step in document["steps"])
    assert away["from_s"] is None
    assert away["gap_mm"] > 1
    assert touching["obstacle"] == "liver"
    assert touching["force_N"][0] > 0.05
    assert 0.7 < touching["from_s"] <= touching["to_s"] < 0.9
    assert document["steps"][1]["complementarity_Nmm"] < 1e-6
    view = load_run(tmp_path / "out")
    assert [o.kind for o in view.obstacles] == ["sphere"]
    assert view.contact_force is not None
    assert view.contact_force[1, 0] == pytest.approx(np.linalg.norm(touching["force_N"]))
    assert "contact force [N]" in {axes.get_ylabel() for axes in run_figure(view).axes}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (HEAD + PRESSED + BALL.replace("-30,", "-20,"), "x.toml: [obstacle.1]: the robot overlaps sphere 1 by 2.5 mm"),
        (HEAD + PRESSED + BALL.replace("centre_mm", "center_mm"), "did you mean 'centre_mm'"),
        (HEAD + PRESSED + BALL.replace('"sphere"', '"ball"'), "[obstacle] kind: item 1: expected 'plane', 'sphere'"),
        (HEAD + PRESSED + BALL + "length_mm = 3\n", "[obstacle.1] length_mm: a sphere has none"),
        (HEAD + PRESSED + BALL + '[solver]\ntranscription = "collocation"\n', "multiple-shooting"),
        (HEAD.replace("forward", "blocked-force") + PRESSED + BALL, "expected 'free' beside [[obstacle]]"),
        (HEAD.replace("forward", "dynamic") + PRESSED + "[dynamic]\nduration_s = 1\n" + BALL, "obstacles stand in"),
        (WORKSPACE + '[workspace.vary]\n"robot.length_mm" = { values = [60] }\n' + BALL, "vary takes no [[obstacle]]"),
        (WORKSPACE + "[contact]\n" + BALL, "a wall takes no [[obstacle]] beside it"),
        (INVERSE + "contact_force_N = 0.1\n", "expected only with [[obstacle]]"),
        (HEAD + PRESSED + BALL + BALL + 'name = "sphere 1"\n', "two obstacles are called 'sphere 1'"),
        (HEAD + PRESSED + BALL + "[uncertainty]\nmaterial = 0.1\n", "beside [[obstacle]]"),
    ],
)  # fmt: skip
def test_obstacles_that_cannot_be_are_one_line(
    text: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "x.toml"
    file.write_text(text)
    assert main(["run", str(file), "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert said in error
    assert not (tmp_path / "out").exists()


def test_a_workspace_knows_what_touches(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "cavity.toml"
    file.write_text(WORKSPACE + '[solver]\nengine = "newton"\n' + BALL)
    assert main(["sweep", str(file), "--out", str(tmp_path / "out"), "--csv"]) == 0
    capsys.readouterr()
    with h5netcdf.File(tmp_path / "out" / "workspace.nc", "r") as found:
        force, gap = np.array(found["contact_force_N"]), np.array(found["contact_gap_mm"])
        tip = np.array(found["tip_position_mm"])
    other = against_a_ball().steps[1]
    assert other.pose is not None
    assert tip[1] == pytest.approx(1e3 * other.pose.tip_position, abs=1e-4)
    assert force[1, 0] == pytest.approx(other.contacts[0].force, abs=1e-5)
    assert np.linalg.norm(force[0]) < 1e-9
    assert gap[0, 0] > 1 > gap[1, 0]
    assert "contact_force_1_x_N" in (tmp_path / "out" / "workspace.csv").read_text().splitlines()[0]


@pytest.mark.parametrize("most", [None, pytest.param(0.03, marks=pytest.mark.thorough)])
def test_a_target_is_reached_with_no_more_force_than_is_allowed(most: float | None) -> None:
    task = InverseTask((Target(np.array([-0.024, 0.005, 0.068]), None),), np.zeros(3), np.full(3, 1.5e5), 0.06)
    ball = Sphere(centre=(-0.03, 0, 0.04), radius=0.01)
    asked = Model(robot("D25L60"), SILICONE), NEWTON, Loads(), replace(task, contact_force=most), [ball]
    step, _ = InverseAmongObstacles(*asked).nearest(task.targets[0], None)
    assert step.aimed is not None
    force = np.linalg.norm(step.contacts[0].force)
    if most is None:
        assert step.status is Status.SOLVED
        assert step.aimed.distance == pytest.approx(0, abs=1e-6 * 0.06)
        assert force == pytest.approx(0.0639, abs=1e-3)
    else:
        assert step.status is Status.OUT_OF_REACH
        assert "sphere 1 may not be pushed harder" in step.message
        assert force == pytest.approx(most, abs=1e-4)
        assert step.aimed.distance is not None
        assert 1e-4 < step.aimed.distance < 5e-3


def test_a_target_inside_an_obstacle_is_out_of_reach_with_any_force() -> None:
    ball = Sphere(centre=(-0.03, 0, 0.04), radius=0.01)
    target = Target(np.array(ball.centre), None)
    task = InverseTask((target,), np.zeros(3), np.full(3, 1.5e5), 0.06)
    step, _ = InverseAmongObstacles(Model(robot("D25L60"), SILICONE), NEWTON, Loads(), task, [ball]).nearest(
        target, None
    )
    assert step.status is Status.OUT_OF_REACH
    assert "mm away" in step.message


def test_the_jacobian_in_numbers_is_that_of_the_expressions() -> None:
    rng = np.random.default_rng(1)
    obstacles = [
        Sphere(centre=(-0.03, 0, 0.04), radius=0.01),
        Plane(point=(-0.03, 0, 0), normal=(1, 0, 0.1), part="tip rim"),
        Trocar(point=(0, 0, 0.03), axis=(0, 0, 1), radius=0.014, length=0.01),
    ]
    solver = among_obstacles(pose_solver(Model(robot("D25L60"), SILICONE), NEWTON), obstacles)
    _, found = solver.solve(np.array([0.9e5, 0.1e5, 0]), Loads((0.02, 0, 0), (0, 0, 0), (0, 0, -9.8)))
    assert found is not None
    grid, p = found.grid, found.solution.p
    x = found.solution.x + 1e-9 * rng.normal(size=found.solution.x.size)
    slope = grid.engine.linear
    assert isinstance(slope, ObstacleSlope)
    tried = 0
    while (blocks := slope.blocks(x, p)) is None and tried < 1000:
        tried += 1
    if blocks is None:
        pytest.skip("there is nothing to compile with")
    entries = slope._entries(x, p)
    assert entries is not None
    assert entries == pytest.approx(np.array(grid.problem.jacobian(x, p).nonzeros()), abs=1e-10)
    assert np.any(blocks.touch[:, -1] < 0.5)
    g = rng.normal(size=x.size)
    dx = slope._condensed(blocks, g)
    size = abs(np.asarray(ca.DM(grid.problem.jacobian(x, p)))) @ abs(dx)
    left = np.asarray(ca.DM(grid.problem.jacobian(x, p))) @ dx + g
    assert np.max(abs(left) / (size + 1)) < 1e-9


def test_the_shipped_scenario_touches_and_is_drawn() -> None:
    scenario = load_scenario(SHIPPED / "sphere.toml")
    (ball,) = scenario.obstacles
    assert isinstance(ball, Sphere)
    assert run_figure(view_of_run(against_a_ball())) is not None


def test_the_other_shipped_scenarios_ask_for_what_they_say() -> None:
    plan = plan_of(load_scenario(SHIPPED / "cavity.toml"))
    assert [type(o) for o in plan.obstacles] == [Tube, Sphere]
    assert plan.fingerprint() != replace(plan, obstacles=()).fingerprint()
    task = load_scenario(SHIPPED / "reach.toml").task
    assert isinstance(task, InverseTask)
    assert task.contact_force == 0.1
