"""Poses solved together: the same as the problem's own solutions, whatever runs the arithmetic."""

from __future__ import annotations

import numpy as np
import pytest

from softnlp import BAR, Loads, Numerics, material, robot
from softnlp.batch import shooting
from softnlp.batch.compiled import compiler
from softnlp.batch.reduced import reduced_rod
from softnlp.branch import branch_function, stretch_on_branch
from softnlp.contact_settings import ContactSettings
from softnlp.conventions import Coefficients
from softnlp.loadcase import rod_functions
from softnlp.quantities import Model
from softnlp.status import Status
from softnlp.studies.blocked_force import blocked_force
from softnlp.studies.statics import PoseSolver
from softnlp.workspace import pose_lane
from softnlp.workspace.chunk import ChunkSolver
from softnlp.workspace.plan import Plan, cells
from softnlp.workspace.pose_lane import PoseLane
from softnlp.workspace.poses import STATUSES, Lane, Rows

REPRODUCTION_SET = Coefficients()
LOADED = Loads(tip_force=(0.02, 0.01, -0.015), tip_moment=(1e-4, -2e-4, 1e-4), gravity=(0.0, 0.0, -9.80665))
needs_compiler = pytest.mark.skipif(compiler() is None, reason="no C compiler")


@pytest.fixture(autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Compile once for all tests of a worker, and small plans too."""
    folder = tmp_path_factory.getbasetemp() / "cache"
    folder.mkdir(exist_ok=True)
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
    monkeypatch.setattr(pose_lane, "WORTH_COMPILING", 0)
    monkeypatch.setattr("softnlp.workspace.blocked_lane.WORTH_COMPILING", 0)


def plan(
    pressures: np.ndarray,
    name: str = "D25L60",
    silicone: str = "Ecoflex 00-50",
    law: str = "mooney-rivlin",
    loads: Loads = LOADED,
    intervals: int | None = None,
    contact: ContactSettings | None = None,
    coefficients: Coefficients = REPRODUCTION_SET,
    **varied: np.ndarray,
) -> Plan:
    """Return a plan of one chunk over pressures [Pa], and what else varies by quantity (dots as __)."""
    names = ("pressure", *(key.replace("__", ".") for key in varied))
    values = np.hstack([pressures, *(np.asarray(v).reshape(len(pressures), -1) for v in varied.values())])
    model = Model(robot(name), material(silicone, law), coefficients)
    return Plan(model, loads, Numerics(intervals=intervals), contact, names, values, np.arange(len(values)), chunk=1024)


def random_pressures(count: int, highest: float, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0, highest * BAR, (count, 3))


@pytest.mark.parametrize(
    ("name", "silicone", "law", "highest", "loads"),
    [
        ("D25L60", "Ecoflex 00-50", "mooney-rivlin", 1.2, LOADED),
        ("D15L60", "Dragon Skin 10", "ogden", 0.8, Loads(gravity=(3.0, -4.0, 8.0))),
        ("laparoscope-9", "Ecoflex 00-30", "yeoh", 0.6, Loads(tip_force=(0.0, 0.02, 0.0))),
        ("D20L40", "Ecoflex 00-50", "linear", 1.0, Loads()),
    ],
)
def test_poses_are_those_of_the_problem(name: str, silicone: str, law: str, highest: float, loads: Loads) -> None:
    asked = plan(random_pressures(12, highest), name, silicone, law, loads)
    rows = ChunkSolver(asked).solve(0).rows
    assert (rows["lane"] == Lane.BATCH).all()
    assert rows["residual"].max() <= 1e-10
    assert rows["error"].max() <= 1e-6
    solver = PoseSolver(asked.model, Numerics(accuracy=1e-8))
    L = float(asked.model.robot.length)
    for row, pressure in zip(rows, asked.pressures(), strict=True):
        pose = solver.solve(pressure, loads)[0].pose
        assert pose is not None
        assert row["tip_position"] == pytest.approx(pose.tip_position, abs=1e-6 * L)
        assert row["tip_rotation"] == pytest.approx(pose.tip_rotation, abs=5e-6)
        assert row["chamber_length"] == pytest.approx(pose.chamber_length, abs=2e-6 * L)
        assert row["stretch"] == pytest.approx(pose.stretch, abs=1e-12)
        assert row["backbone_length"] == pytest.approx(pose.backbone_length, abs=2e-6 * L)
        assert np.linalg.norm(row["tip_position"] - pose.tip_position) / L == pytest.approx(
            row["error"], rel=0.2, abs=2e-8
        )


def test_reduced_nodes_solve_the_multiple_shooting_equations() -> None:
    """Three unknowns and a closed-form force meet all the equations of the compiled problem, at its own judgement."""
    asked = plan(random_pressures(5, 1.0), intervals=15)
    lane = PoseLane(asked)
    columns = asked.full_values(np.arange(5))
    found = lane.solve(columns, asked.values)
    solver = PoseSolver(asked.model, asked.numerics)
    problem = solver.grid(15).problem
    step = reduced_rod(rod_functions(asked.model)).value
    for k in range(5):
        c = found.sections.constants[:, k]
        F_0, L_0 = found.sections.force_unit[k], found.sections.length_unit[k]
        data = np.concatenate([c, np.array(LOADED.tip_force) / F_0, np.array(LOADED.tip_moment) / (F_0 * L_0)])
        state = np.concatenate([np.zeros(3), np.eye(3).ravel(), found.shot.base[:, k]])
        nodes = []
        for j in range(16):
            n = data[-6:-3] + c[11] * c[8:11] * (1 - j / 15) + c[5] * state[9:12]
            nodes.append(np.concatenate([state[:12], n, state[12:]]))
            state = np.asarray(step(state, data, j / 15, 1 / 15)).ravel()
        x = np.concatenate([[found.sections.stretch[k]], *nodes])
        assert float(np.max(np.abs(np.asarray(problem.residual(x, columns[:, k]))))) < 1e-10


@needs_compiler
def test_compiled_and_interpreted_numbers_are_the_same_to_the_last_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = plan(random_pressures(9, 1.0))
    first = ChunkSolver(asked).solve(0).rows
    monkeypatch.setattr(shooting, "library", lambda source, build: None)
    again = ChunkSolver(asked).solve(0).rows
    assert first.tobytes() == again.tobytes()


def test_dimensions_constants_and_loads_may_vary_too() -> None:
    rng = np.random.default_rng(3)
    varied = {
        "robot__length": rng.uniform(0.04, 0.06, 6),
        "material__C01": rng.uniform(0.014e6, 0.017e6, 6),
        "tip_force": rng.uniform(-0.02, 0.02, (6, 3)),
    }
    asked = plan(random_pressures(6, 1.0), **varied)
    rows = ChunkSolver(asked).solve(0).rows
    assert (rows["lane"] == Lane.BATCH).all()
    alone = ChunkSolver(asked)
    columns = asked.full_values(np.arange(6))
    for k in range(6):
        model, pressure, loads = alone._pose(columns[:, k])
        pose = PoseSolver(model, Numerics(accuracy=1e-8)).solve(pressure, loads)[0].pose
        assert pose is not None
        assert rows["tip_position"][k] == pytest.approx(pose.tip_position, abs=1e-6 * float(model.robot.length))


@pytest.mark.parametrize(
    ("silicone", "law"), [("Ecoflex 00-10", "yeoh"), ("Ecoflex 00-50", "ogden"), ("Dragon Skin 10", "mooney-rivlin")]
)
@pytest.mark.parametrize("shared", [True, False])
def test_stretches_are_those_of_the_branch(silicone: str, law: str, shared: bool) -> None:
    """Where the batch is certain it is right, and it is certain almost everywhere."""
    model = Model(robot("D25L60"), material(silicone, law))
    pressures = random_pressures(40, 2.0, seed=5)
    varied = {} if shared else {"robot__length": np.full(40, 0.06)}
    asked = plan(pressures, silicone=silicone, law=law, **varied)
    columns = asked.full_values(np.arange(40))
    sections, numbers = PoseLane(asked).sections(columns)
    branch = branch_function(model)
    points = [stretch_on_branch(branch, columns[:, k], pressures[k]) for k in range(40)]
    solved = [k for k in range(40) if points[k].status is Status.SOLVED]
    assert set(numbers) <= set(solved)
    assert len([k for k in solved if points[k].stretch < 2.5 and k not in numbers]) == 0
    assert sections.stretch == pytest.approx([points[k].stretch for k in numbers], abs=1e-11)


def test_what_cannot_be_solved_is_named() -> None:
    """Beyond the limit pressure, and beyond buckling, a pose is never a plausible number."""
    pressures = np.array([[0.2, 0, 0], [20.0, 0, 0], [0.3, 0.1, 0]]) * BAR
    asked = plan(pressures, law="yeoh", coefficients=Coefficients(elongation=0.0))
    block = ChunkSolver(asked).solve(0)
    statuses = [STATUSES[k] for k in block.rows["status"]]
    assert statuses[0] is Status.SOLVED
    assert statuses[1] in (Status.UNSTABLE_MATERIAL, Status.NO_EQUILIBRIUM)
    assert [number for number, _ in block.messages] == [1]
    assert np.isnan(block.rows["tip_position"][1]).all()
    assert block.rows["stable"].tolist() == [1, -1, 1]


def test_an_unstable_pose_is_left_to_the_problem() -> None:
    """A tall soft column under its own weight is straight and unstable; the batch must not call it stable."""
    asked = plan(np.zeros((1, 3)), "D10L60", "Ecoflex 00-10", loads=Loads(gravity=(0.0, 0.0, -9.80665)))
    columns = asked.full_values(np.arange(1))
    assert PoseLane(asked).solve(columns, asked.values).numbers.size == 0
    hanging = plan(np.zeros((1, 3)), "D10L60", "Ecoflex 00-10", loads=Loads(gravity=(0.0, 0.0, 9.80665)))
    assert PoseLane(hanging).solve(hanging.full_values(np.arange(1)), hanging.values).numbers.size == 1


def blocked_rows(closure: str, pressures: np.ndarray, loads: Loads, offset: float) -> tuple[Plan, Rows]:
    contact = ContactSettings(closure=closure, offset=offset, tip_cap=0.003)  # type: ignore[arg-type]
    asked = plan(pressures, loads=loads, contact=contact)
    return asked, ChunkSolver(asked).solve(0).rows


@needs_compiler
@pytest.mark.parametrize(
    ("closure", "loads", "offset"),
    [
        ("free", Loads(), 0.0),
        ("compliant", Loads(), -0.008),
        ("compliant", Loads(gravity=(0.0, 0.0, -9.80665), tip_force=(0.0, 0.0, -0.02)), 0.0),
        ("rigid", Loads(), 0.0),
    ],
)
def test_blocked_poses_are_those_of_the_study(closure: str, loads: Loads, offset: float) -> None:
    pressures = np.linspace(0, 1.4 * BAR, 5)[:, None] * np.array([1.0, 0, 0])
    asked, rows = blocked_rows(closure, pressures, loads, offset)
    assert asked.contact is not None
    run = blocked_force(asked.model.robot, asked.model.material, pressures, asked.contact, loads=loads)
    assert (rows["lane"] == Lane.BATCH).all()
    for row, step in zip(rows, run.steps, strict=True):
        assert step.contact is not None
        assert step.pose is not None
        assert STATUSES[row["status"]] is step.status
        assert row["blocked_force"] == pytest.approx(step.contact.force, rel=3e-6, abs=1e-8)
        assert row["gap"] == pytest.approx(step.contact.gap, abs=1e-7)
        assert row["tip_position"] == pytest.approx(step.pose.tip_position, abs=1e-7)
        assert row["chamber_length"] == pytest.approx(step.pose.chamber_length, abs=2e-7)


@pytest.mark.slow
@needs_compiler
def test_a_blocked_pose_out_of_the_walls_plane_is_solved_in_space() -> None:
    pressures = np.array([[1.0, 0.2, 0.0], [0.8, 0.0, 0.3]]) * BAR
    asked, rows = blocked_rows("compliant", pressures, Loads(), 0.0)
    assert asked.contact is not None
    run = blocked_force(asked.model.robot, asked.model.material, pressures[:1], asked.contact)
    assert run.steps[0].contact is not None
    assert rows["blocked_force"][0] == pytest.approx(run.steps[0].contact.force, rel=1e-5)
    assert abs(rows["tip_position"][0][1]) > 1e-4


def test_a_branch_that_turns_is_named() -> None:
    pressures = np.array([[1.5, 0.0, 0.0]]) * BAR
    contact = ContactSettings(closure="rigid")
    block = ChunkSolver(plan(pressures, contact=contact, loads=Loads())).solve(0)
    assert STATUSES[block.rows["status"][0]] is Status.FOLD
    assert np.isnan(block.rows["blocked_force"][0])


def test_chunks_are_compact_cells() -> None:
    grid = np.linspace(0, 1, 12)
    values = np.stack(np.meshgrid(grid, grid, grid, indexing="ij"), axis=-1).reshape(-1, 3)
    order = cells(values, 108)
    assert sorted(order) == list(range(len(values)))
    widest = [np.ptp(values[order[k : k + 108]], axis=0).max() for k in range(0, len(values), 108)]
    assert max(widest) < 0.7
