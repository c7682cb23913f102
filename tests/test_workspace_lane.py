"""Poses solved together: the same as the problem's own solutions, whatever runs the arithmetic."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from softnlp import BAR, Loads, Numerics, material, robot
from softnlp.base.status import Status
from softnlp.batch import newton
from softnlp.batch.alone import Alone
from softnlp.batch.chunk import ChunkSolver
from softnlp.batch.contact_newton import PATH, BlockedShot, ContactBatch, Stage
from softnlp.batch.grids import MOST_INTERVALS
from softnlp.batch.newton import Batch, BatchSolver, Shot
from softnlp.batch.plan import Plan, cells
from softnlp.batch.pose_lane import PoseLane
from softnlp.batch.poses import STATUSES, Lane, Rows
from softnlp.model.contact_settings import ContactSettings
from softnlp.model.conventions import COEFFICIENT_SETS, Coefficients
from softnlp.model.quantities import Model
from softnlp.model.tip import TipContact
from softnlp.native.jit import can_compile
from softnlp.statics import stretches
from softnlp.statics.branch import branch_function, stretch_on_branch
from softnlp.statics.loadcase import rod_functions
from softnlp.statics.reduced import reduced_rod
from softnlp.statics.solver import PoseSolver
from softnlp.studies.blocked_force import blocked_force
from softnlp.studies.forward import forward

REPRODUCTION_SET = Coefficients()
LOADED = Loads(tip_force=(0.02, 0.01, -0.015), tip_moment=(1e-4, -2e-4, 1e-4), gravity=(0.0, 0.0, -9.80665))
needs_compiler = pytest.mark.skipif(not can_compile(), reason="no llvmlite")


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


@needs_compiler
def test_compiled_and_interpreted_numbers_are_the_same_to_the_last_bit(monkeypatch: pytest.MonkeyPatch) -> None:
    asked = plan(random_pressures(9, 1.0))
    first = ChunkSolver(asked).solve(0).rows
    monkeypatch.setenv("SOFTNLP_COMPILE", "0")
    again = ChunkSolver(asked).solve(0).rows
    assert first.tobytes() == again.tobytes()


@pytest.mark.parametrize(
    ("name", "silicone", "law", "highest", "loads"),
    [
        ("D25L60", "Ecoflex 00-50", "mooney-rivlin", 1.2, LOADED),
        pytest.param(
            *("laparoscope-9", "Ecoflex 00-30", "yeoh", 0.6, Loads(tip_force=(0.0, 0.02, 0.0))),
            marks=pytest.mark.thorough,
        ),
        pytest.param(
            *("D15L60", "Dragon Skin 10", "ogden", 0.8, Loads(gravity=(3.0, -4.0, 8.0))), marks=pytest.mark.slow
        ),
        pytest.param("D20L40", "Ecoflex 00-50", "linear", 1.0, Loads(), marks=pytest.mark.slow),
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
    step = reduced_rod(rod_functions(asked.model)).onward
    for k in range(5):
        c = found.sections.constants[:, k]
        F_0, L_0 = found.sections.force_unit[k], found.sections.length_unit[k]
        data = np.concatenate([c, np.array(LOADED.tip_force) / F_0, np.array(LOADED.tip_moment) / (F_0 * L_0)])
        state = np.concatenate([np.zeros(3), np.eye(3).ravel(), found.shot.base[:, k]])
        nodes = []
        for j in range(16):
            n = data[-6:-3] + c[9] * c[8] * c[10:13] * (1 - j / 15)
            nodes.append(np.concatenate([state[:12], n, state[12:]]))
            state = np.asarray(step(np.concatenate([state, data, [j / 15, 1 / 15]]))).ravel()
        x = np.concatenate([[found.sections.stretch[k]], *nodes])
        assert float(np.max(np.abs(np.asarray(problem.residual(x, columns[:, k]))))) < 1e-10


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
    alone = Alone(asked, asked.numerics)
    columns = asked.full_values(np.arange(6))
    for k in range(6):
        model, pressure, loads = alone._pose(columns[:, k])
        pose = PoseSolver(model, Numerics(accuracy=1e-8)).solve(pressure, loads)[0].pose
        assert pose is not None
        assert rows["tip_position"][k] == pytest.approx(pose.tip_position, abs=1e-6 * float(model.robot.length))


@pytest.mark.parametrize(
    ("silicone", "law", "shared"),
    [
        ("Ecoflex 00-10", "yeoh", False),
        ("Ecoflex 00-50", "ogden", False),
        ("Dragon Skin 10", "mooney-rivlin", False),
        pytest.param("Ecoflex 00-10", "yeoh", True, marks=pytest.mark.slow),
        pytest.param("Ecoflex 00-50", "ogden", True, marks=pytest.mark.slow),
        pytest.param("Dragon Skin 10", "mooney-rivlin", True, marks=pytest.mark.thorough),
    ],
)
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
    untwisted = Loads(tip_force=LOADED.tip_force, gravity=LOADED.gravity)
    asked = plan(pressures, law="yeoh", loads=untwisted, coefficients=Coefficients(elongation=0.0))
    block = ChunkSolver(asked).solve(0)
    statuses = [STATUSES[k] for k in block.rows["status"]]
    assert statuses[0] is Status.SOLVED
    assert statuses[1] in (Status.UNSTABLE_MATERIAL, Status.NO_EQUILIBRIUM)
    assert [number for number, _ in block.messages] == [1]
    assert np.isnan(block.rows["tip_position"][1]).all()
    assert block.rows["stable"].tolist() == [1, -1, 1]


def test_a_stiffness_that_loses_its_sign_ends_the_batch_too() -> None:
    """D20L60 stretched beyond 3.26 has no torsional stiffness; the batch and the problem both say so."""
    pressures = np.array([[1.1, 1.1, 1.1], [1.2, 1.2, 1.2]]) * BAR
    asked = plan(pressures, "D20L60", "Ecoflex 00-30", law="yeoh", coefficients=Coefficients(elongation=0.0))
    columns = asked.full_values(np.arange(2))
    assert PoseLane(asked).sections(columns)[1].tolist() == [0]
    block = ChunkSolver(asked).solve(0)
    assert [STATUSES[k] for k in block.rows["status"]] == [Status.SOLVED, Status.UNSTABLE_MATERIAL]
    assert "GJ loses its sign" in block.messages[0][1]


def test_under_a_dead_tip_moment_no_pose_of_a_sweep_is_called_stable_or_not() -> None:
    pressures = np.array([[0.2, 0, 0], [0.4, 0.1, 0], [90.0, 90.0, 0]]) * BAR
    twisted = plan(pressures, law="ogden", loads=Loads(tip_moment=(0.0, 0.0, 1e-4)))
    block = ChunkSolver(twisted).solve(0)
    assert [STATUSES[k].has_solution for k in block.rows["status"]] == [True, True, False]
    assert block.rows["stable"].tolist() == [-1, -1, -1]


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


@pytest.mark.parametrize(
    ("closure", "loads", "offset"),
    [
        pytest.param("free", Loads(), 0.0, marks=pytest.mark.thorough),
        pytest.param(
            *("compliant", Loads(gravity=(0.0, 0.0, -9.80665), tip_force=(0.0, 0.0, -0.02)), 0.0),
            marks=pytest.mark.slow,
        ),
        pytest.param("compliant", Loads(), -0.008, marks=pytest.mark.slow),
        pytest.param("rigid", Loads(), 0.0, marks=pytest.mark.slow),
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


@pytest.mark.parametrize(
    ("contact", "loads", "bars"),
    [
        (None, Loads(tip_force=(0.002, 0.001, 0.0)), [[2.2, 0, 0], [1.0, 0, 0.2]]),
        pytest.param(
            ContactSettings(wall_point=(-3e-3, 0, 0), wall_normal=(1, 0, 0), closure="free"),
            Loads(),
            [[1.0, 0, 0], [1.8, 0, 0]],
            marks=pytest.mark.slow,
        ),
    ],
    ids=["free", "blocked"],
)
def test_poses_that_pass_through_themselves_are_those_of_the_problem(
    contact: ContactSettings | None, loads: Loads, bars: list[list[float]]
) -> None:
    pressures, calibrated = BAR * np.array(bars), COEFFICIENT_SETS["calibrated"]
    model = Model(replace(robot("D10L60"), length=0.08), material("Ecoflex 00-50"), calibrated)
    order = np.arange(len(bars))
    rows = ChunkSolver(Plan(model, loads, Numerics(), contact, ("pressure",), pressures, order)).solve(0).rows
    assert np.all(rows["lane"] == Lane.BATCH)
    study = forward if contact is None else partial(blocked_force, contact=contact)
    run = study(model.robot, model.material, pressures, loads=loads, coefficients=calibrated)
    wanted = [step.pose is not None and step.pose.fit.self_intersecting for step in run.steps]
    assert rows["self_intersecting"].tolist() == wanted
    assert {0, 1} == {*wanted}


@pytest.mark.slow
def test_a_blocked_pose_out_of_the_walls_plane_is_solved_in_space() -> None:
    pressures = np.array([[1.0, 0.2, 0.0], [0.8, 0.0, 0.3]]) * BAR
    asked, rows = blocked_rows("compliant", pressures, Loads(), 0.0)
    assert asked.contact is not None
    run = blocked_force(asked.model.robot, asked.model.material, pressures[:1], asked.contact)
    assert run.steps[0].contact is not None
    assert rows["blocked_force"][0] == pytest.approx(run.steps[0].contact.force, rel=1e-5)
    assert abs(rows["tip_position"][0][1]) > 1e-4


@pytest.mark.thorough
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


# --- what the batch gives up ------------------------------------------------------------------------------------------


def test_poses_whose_passes_run_out_are_left_to_the_problem(monkeypatch: pytest.MonkeyPatch) -> None:
    """One pass of Newton solves no bent and loaded pose; the numbers are those of the problem all the same."""
    pressures = np.array([[0.6, 0.2, 0.0], [0.4, 0.0, 0.1]]) * BAR
    asked = plan(pressures, intervals=15)
    together = ChunkSolver(asked).solve(0).rows
    assert (together["lane"] == Lane.BATCH).all()
    monkeypatch.setattr(newton, "_PASSES", 1)
    alone = ChunkSolver(asked).solve(0).rows
    assert (alone["lane"] == Lane.PROBLEM).all()
    assert alone["tip_position"] == pytest.approx(together["tip_position"], abs=2e-6 * 0.06)


def test_a_section_that_softens_with_its_stretch_is_left_to_the_problem() -> None:
    """Pressure takes stiffness away where a coefficient is negative: the unpressurised curve then shows no limit."""
    asked = plan(np.array([[0.3, 0.1, 0.0]]) * BAR, coefficients=Coefficients(elongation=-0.05))
    columns = asked.full_values(np.arange(1))
    assert PoseLane(asked).sections(columns)[1].size == 0
    (row,) = ChunkSolver(asked).solve(0).rows
    assert row["lane"] == Lane.PROBLEM
    pose = PoseSolver(asked.model, Numerics()).solve(asked.pressures()[0], LOADED)[0].pose
    assert pose is not None
    assert row["stretch"] == pytest.approx(pose.stretch, rel=1e-12)


@pytest.mark.parametrize("kernels", [pytest.param("compiled", marks=needs_compiler), "interpreted"])
def test_a_chunk_beyond_every_equilibrium_is_named_pose_by_pose(kernels: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOFTNLP_COMPILE", str(int(kernels == "compiled")))
    softening, pressures = Coefficients(elongation=0.0), np.array([[20.0, 0, 0], [30.0, 10.0, 0]]) * BAR
    asked = plan(pressures, coefficients=softening)
    block = ChunkSolver(asked).solve(0)
    ended = (Status.UNSTABLE_MATERIAL, Status.NO_EQUILIBRIUM)
    assert all(STATUSES[k] in ended for k in block.rows["status"])
    assert [number for number, _ in block.messages] == [0, 1]
    assert np.isnan(block.rows["tip_position"]).all()


def test_a_stretch_that_did_not_settle_is_not_certain(monkeypatch: pytest.MonkeyPatch) -> None:
    pressures = np.vstack([random_pressures(5, 1.0), np.zeros((1, 3))])
    asked = plan(pressures, robot__length=np.full(6, 0.06))
    lane, columns = PoseLane(asked), asked.full_values(np.arange(6))
    assert lane.sections(columns)[1].tolist() == [0, 1, 2, 3, 4, 5]
    monkeypatch.setattr(stretches, "_NEWTON_STEPS", 1)
    sections, numbers = lane.sections(columns)
    assert numbers.tolist() == [5]  # without pressure nothing has to settle
    assert sections.stretch == pytest.approx([1.0])


def test_poses_that_refinement_does_not_bring_to_the_target_keep_their_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """An error that falls by the first order only is asked for four times, on ever finer grids, and reported."""
    solver = BatchSolver(rod_functions(Model(robot("D25L60"), material("Ecoflex 00-50"))), None, 1e-4, None)  # type: ignore[arg-type]
    asked: list[int] = []

    def shoot(self: BatchSolver, batch: Batch, poses: np.ndarray, guess: np.ndarray, grids: np.ndarray) -> Shot:
        n, error = poses.size, 2e-2 / grids
        if n == 3:
            asked.append(int(grids.max()))
        known = np.zeros(n, np.int64)
        return Shot(
            guess, np.zeros((18, n)), np.zeros((8, n)), np.zeros(n), np.zeros(n), error, error, known > 0, grids, known
        )

    monkeypatch.setattr(BatchSolver, "_shoot", shoot)
    shot = solver.solve(Batch(np.zeros((20, 3)), np.full(3, 0.1)), np.arange(3.0)[:, None])
    assert len(asked) == 5  # the first grid and four finer ones
    assert asked == sorted(set(asked))
    assert (shot.intervals == asked[-1]).all()
    assert asked[-1] < MOST_INTERVALS
    assert shot.refinement_error == pytest.approx(np.full(3, 2e-2 / asked[-1]))
    assert (shot.refinement_error > 1e-4).all()


def test_blocked_poses_that_refinement_does_not_bring_to_the_target_keep_their_error(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    functions = rod_functions(Model(robot("D25L60"), material("Ecoflex 00-50")), (TipContact("compliant"),))
    batch = ContactBatch(functions, None, None)  # type: ignore[arg-type]
    asked: list[int] = []

    def shoot(
        self: ContactBatch, stage: Stage, guess: np.ndarray, grids: np.ndarray, tolerance: float, *, judge: bool
    ) -> BlockedShot:
        n, error = grids.size, 2e-2 / grids
        asked.append(int(grids[0]))
        fields = [np.zeros((2, n)), np.zeros(n), np.zeros(n), np.ones(n), error, error, grids, np.zeros(n, np.int64)]
        return BlockedShot(guess, np.zeros((21, n)), *fields)  # type: ignore[arg-type]

    monkeypatch.setattr(ContactBatch, "_shoot", shoot)
    n, held = 3, np.array([True, True, False])
    stage = Stage(*(np.zeros((2, n)) for _ in range(3)))
    shot, good = batch._refined(stage, np.zeros((7, n)), held, np.ones(n), np.full(n, 4), 1e-4, 21)
    assert len(asked) == 6  # the first grid and five finer ones
    assert asked == sorted(set(asked))
    assert shot.intervals.tolist() == [asked[-1], asked[-1], asked[0]]  # what was lost is not refined
    assert shot.worst_error == pytest.approx(2e-2 / shot.intervals)
    assert good.tolist() == held.tolist()
    assert (shot.iterations == 4).all()


def test_blocked_poses_that_are_lost_are_not_followed_further(monkeypatch: pytest.MonkeyPatch) -> None:
    """The one that makes contact first is lost at once; the path goes on where the other makes contact."""
    functions = rod_functions(Model(robot("D25L60"), material("Ecoflex 00-50")), (TipContact("compliant"),))
    batch = ContactBatch(functions, None, None)  # type: ignore[arg-type]
    followed: list[tuple[int, list[int]]] = []

    def stage_at(j: int, on: np.ndarray) -> Stage:
        followed.append((j, on.tolist()))
        return Stage(np.zeros((20, on.size)), np.zeros((3, on.size)), np.ones((2, on.size)))

    def shoot(
        self: ContactBatch, stage: Stage, guess: np.ndarray, grids: np.ndarray, tolerance: float, *, judge: bool
    ) -> BlockedShot:
        n, nothing = grids.size, np.zeros(grids.size)
        residual = np.where([len(followed) == 1] * n, np.inf, 0.0)
        fields = [np.zeros((2, n)), nothing, residual, np.ones(n), nothing, nothing, grids, np.ones(n, np.int64)]
        return BlockedShot(guess, np.zeros((21, n)), *fields)  # type: ignore[arg-type]

    monkeypatch.setattr(ContactBatch, "_shoot", shoot)
    last = len(PATH) - 1
    shot, held = batch.follow(stage_at, np.array([0, last - 1]), 1e-4)
    assert followed == [(0, [0]), (last - 1, [1]), (last, [1]), (last, [0, 1])]  # the last one judges
    assert held.tolist() == [False, True]
    assert shot.iterations.tolist() == [2, 3]
