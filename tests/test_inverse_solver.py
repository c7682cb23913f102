"""Inverse kinematics where it is hard: programs against searches, poses that are lost or not stable, jumps, limits."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from softnlp import BAR, Coefficients, Loads, Numerics, Status, inverse, material, robot
from softnlp.model.quantities import Model
from softnlp.model.robot import Robot
from softnlp.nlp import bounded
from softnlp.nlp.bounded import Limits
from softnlp.nlp.reduced import Point, Reduced
from softnlp.nlp.solver import Solution
from softnlp.statics.attempts import Work
from softnlp.statics.branch import stretch_on_branch
from softnlp.statics.solver import PoseSolver
from softnlp.statics.step import Step
from softnlp.studies.inverse_problem import Program, Tips
from softnlp.studies.inverse_solver import InverseKinematics, Reached
from softnlp.studies.targets import Aim, InverseTask, Target, aim_of

Array = NDArray[np.float64]

D25, SILICONE = robot("D25L60"), material("Ecoflex 00-50", "mooney-rivlin")
FOUR = Robot("four", 25e-3, 9e-3, 17e-3, 4.5e-3, 0.5e-3, 60e-3, 4, 1, 0.0)
LENGTH, HIGHEST = D25.length, 1.5 * BAR
GRID = Numerics(intervals=2)
SEARCH = GRID.without_ipopt()  # what is looked at here are the proposals
LOADED = Loads((0.05, 0.02, 0.0), (0.0, 0.0, 1e-3), (0.0, 0.0, -9.8))
TALL, SOFT = robot("D10L60"), material("Ecoflex 00-10", "mooney-rivlin")
STANDING = Loads(gravity=(0.0, 0.0, -9.8))


@cache
def poses_of(body: Robot) -> PoseSolver:
    return PoseSolver(Model(body, SILICONE), GRID)


def solver_of(method: str = "newton", loads: Loads | None = None, highest: Any = HIGHEST) -> InverseKinematics:
    task = InverseTask((), np.zeros(3), np.broadcast_to(highest, 3).astype(float), float(LENGTH))
    return InverseKinematics(Model(D25, SILICONE), SEARCH, loads or Loads(), task, method)  # type: ignore[arg-type]


@cache
def unloaded() -> InverseKinematics:
    return solver_of()


def at_arc(tips: Tips, aim: Aim, z: Array) -> tuple[Program, Point]:
    """Return the program of a target and the tip at pressures [bar] that the arc leads to."""
    program = tips.program(aim)
    point = program.at(z)
    assert point is not None
    return program, point


def at(x: float, y: float, z: float) -> Target:
    return Target(np.array([x, y, z]), None)


TOWARDS = np.array([-1.0, 0.3, 0.5]) / np.linalg.norm([-1.0, 0.3, 0.5])
WIDE = Limits(np.zeros(3), np.full(3, 1.5), 4.5)


@pytest.mark.parametrize(
    ("body", "target", "limits", "meets"),
    [
        (D25, at(0.012, -0.004, 0.072), WIDE, False),
        (D25, at(0.012, -0.004, 0.072), Limits(np.array([0.0, 0.2, 0.0]), np.array([0.4, 0.3, 0.2]), 0.9), False),
        (D25, at(0.012, -0.004, 0.090), Limits(np.zeros(3), np.full(3, 1.5), 1.2), False),
        (D25, Target(np.array([0.02, 0.01, 0.07]), TOWARDS), WIDE, False),
        (D25, Target(None, TOWARDS), WIDE, True),
        (FOUR, at(0.006, 0.008, 0.075), Limits(np.zeros(4), np.full(4, 1.5), 6.0), True),
    ],
    ids=["met", "bounds of each set", "largest sum", "weighed", "direction", "position with a choice"],
)
def test_the_program_and_the_search_find_the_same_pressures(
    body: Robot, target: Target, limits: Limits, meets: bool
) -> None:
    """IPOPT on all unknowns of the rod, and the search in the pressures alone, from the same pose of the same grid."""
    aim = Aim(target, float(body.length), 0.5)
    tips = Tips(poses_of(body), LOADED, limits, GRID, 2)
    program, begin = at_arc(tips, aim, limits.clip(np.full(limits.lower.size, 0.3)))
    end, _ = program.searched(begin)
    if meets:
        assert np.linalg.norm(end.r) < 1e-9
        met = end
        program = tips.program(aim, meets=True)
        end, _ = program.searched(program.again(end))
        assert np.linalg.norm(end.theta) <= np.linalg.norm(met.theta) + 1e-9
    solution = program.engine().solve(program.p, np.concatenate([end.theta * 0.9 + begin.theta * 0.1, end.states]))
    assert solution.holds(GRID.tolerance)
    z = limits.clip(solution.x[: end.theta.size])
    assert z == pytest.approx(end.theta, abs=2e-5)
    assert (z >= limits.lower).all()
    assert (z <= limits.upper).all()
    assert z.sum() <= limits.largest_sum
    binding = np.sum((z == limits.lower) | (z == limits.upper)) + (z.sum() > limits.largest_sum - 1e-9)
    assert binding >= (limits.largest_sum < 4.5)  # where there is a narrow limit, it is what holds the answer


def test_an_answer_says_whether_nothing_nearby_is_better(monkeypatch: pytest.MonkeyPatch) -> None:
    """A direction leaves three sets a choice, out of reach there is a nearest tip, and a place leaves nothing."""
    far = at(0.06, 0.03, 0.09)
    for target, optimal in ((Target(None, TOWARDS), True), (far, True), (at(0.012, -0.004, 0.072), None)):
        step, _ = unloaded().nearest(target, None)
        assert step.aimed is not None
        assert step.aimed.optimal is optimal
        assert not [words for words in step.warnings if "not optimal" in words]
    monkeypatch.setattr(bounded, "_STEPS", 1)
    step, _ = unloaded().nearest(far, None)
    assert step.aimed is not None
    assert step.aimed.optimal is False
    assert [words for words in step.warnings if words.startswith("feasible, not optimal")]


def test_a_run_by_the_program_is_that_of_the_search() -> None:
    asked = at(0.012, -0.004, 0.072)
    by_search, _ = unloaded().nearest(asked, None)
    by_program, _ = solver_of("nlp").nearest(asked, None)
    assert by_search.status is by_program.status is Status.SOLVED
    assert by_program.pressure == pytest.approx(by_search.pressure, abs=1)  # of 1e5 Pa
    assert by_program.aimed is not None
    assert by_program.aimed.distance is not None
    assert by_program.aimed.distance < 1e-6 * LENGTH


@pytest.mark.parametrize("lost", ["program", "pose"])
def test_where_the_grid_has_no_better_one_the_answer_of_the_arcs_stands(
    lost: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is said of it is its own misfit on the grid, not that of the search on arcs."""

    class Fails:
        @staticmethod
        def solve(p: Array, x: Array) -> Solution:
            return Solution(x, p, float("inf"), 300, "Maximum_Iterations_Exceeded")

    if lost == "program":
        monkeypatch.setattr(Program, "engine", lambda *_: Fails)
    else:
        monkeypatch.setattr(Tips, "moved", lambda *_: np.full(55, np.nan))
    solver = solver_of("nlp" if lost == "program" else "newton")
    asked = np.array([0.012, -0.004, 0.072])
    step, reached = solver.nearest(Target(asked, None), None)
    assert reached is not None
    aim = aim_of(solver.task, Target(asked, None), float(LENGTH))
    arc = at_arc(solver._arcs, aim, step.pressure / BAR)[1]
    assert arc.r == pytest.approx(np.zeros(3), abs=1e-6)
    assert step.pose is not None
    assert step.aimed is not None
    assert step.aimed.distance == pytest.approx(np.linalg.norm(step.pose.tip_position - asked), rel=1e-9)
    assert step.status is Status.OUT_OF_REACH  # two intervals are too few for the answer of the arcs


def test_a_direction_out_of_reach_is_so_many_degrees_off() -> None:
    step = inverse(D25, SILICONE, directions=[0.0, 0.0, -1.0], bounds=(0.0, 0.1 * BAR), numerics=GRID).steps[0]
    assert step.status is Status.OUT_OF_REACH
    assert step.aimed is not None
    assert step.aimed.distance is None
    assert step.aimed.angle is not None
    assert f"the nearest tip is {np.degrees(step.aimed.angle):.6g} degrees off, at (" in step.message
    assert step.pose is not None
    assert step.aimed.angle == pytest.approx(np.pi - step.pose.tilt, abs=1e-9)


@pytest.mark.thorough
def test_no_stable_pose_is_nearer_than_that_at_the_edge_of_stability() -> None:
    """A column that stands on its axis only unstably is bent just enough by one set to be stable."""
    grid = Numerics(intervals=2)
    target = [0.0, 0.0, 0.055]
    (first,) = inverse(
        TALL, SOFT, positions=target, bounds=(0.0, [0.1 * BAR, 0.0, 0.0]), loads=STANDING, numerics=grid
    ).steps
    assert first.status is Status.OUT_OF_REACH
    assert "nearer equilibria are not stable or not found" in first.message
    assert first.pose is not None
    assert first.pose.stable
    poses = PoseSolver(Model(TALL, SOFT), grid)
    for part in (0.5, 0.97):
        less = poses.solve(part * first.pressure, STANDING)[0].pose
        assert less is not None
        assert not less.stable
    more = poses.solve(1.5 * first.pressure, STANDING)[0].pose
    assert more is not None
    assert more.stable
    assert first.aimed is not None
    assert first.aimed.distance is not None
    assert np.linalg.norm(more.tip_position - target) > first.aimed.distance


def test_a_jump_is_said_also_where_the_last_pressure_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    """The search cannot begin where the last one ended; then nothing continues it, whatever it finds first."""
    solver = solver_of()
    first, last = solver.nearest(Target(np.array([0.012, -0.004, 0.072]), None), None)
    assert first.pose is not None
    assert last is not None
    far = Target(np.array([-0.04, 0.0, 0.06]), None)
    alone, _ = solver.nearest(far, None)
    assert not any("jump" in text for text in alone.warnings)
    followed, _ = solver.nearest(far, last)
    assert not any("jump" in text for text in followed.warnings)
    place = Reduced.at

    def lost(self: Reduced, z: Array, p: Array, near: Point | Array | None = None) -> Point | None:
        return None if z == pytest.approx(last.pressure / BAR, abs=1e-12) else place(self, z, p, near)

    monkeypatch.setattr(Reduced, "at", lost)
    step, _ = solver.nearest(far, last)
    assert step.pressure == pytest.approx(alone.pressure, abs=1)
    assert np.abs(step.pressure - last.pressure).max() > 0.3 * HIGHEST
    (said,) = [text for text in step.warnings if "jump" in text]
    assert said.startswith("the pressures jump from (0.516, 0.767, 0.686) to (")


def test_a_stable_pose_far_off_does_not_hide_a_nearer_one() -> None:
    """Up is met by the column that stands unstably alone. The search that ends curled up at full pressure is no end."""
    bounds, grid = (0.0, [0.5 * BAR, 0.0, 0.0]), Numerics(intervals=3)
    step = inverse(TALL, SOFT, directions=[0.0, 0.0, 1.0], bounds=bounds, loads=STANDING, numerics=grid).steps[0]
    assert step.status is Status.OUT_OF_REACH
    assert step.aimed is not None
    assert step.aimed.angle is not None
    poses = PoseSolver(Model(TALL, SOFT), grid)
    tried = [poses.solve(np.array([bar, 0.0, 0.0]) * BAR, STANDING)[0].pose for bar in (0.01, 0.1, 0.25, 0.5)]
    tilts = [pose.tilt for pose in tried if pose is not None and pose.stable]
    assert len(tilts) == 4
    assert step.aimed.angle <= min(tilts)
    assert max(tilts) > 2.0


class Fenced:
    """Stands in for the judge of poses: the misfit grows from a corner that is not stable; z [bar] by its pressures."""

    def __init__(self, solver: InverseKinematics, like: Reached, stable_from: float) -> None:
        self.asked: list[Array] = []
        self._limits, self._like, self._stable_from = solver.limits, like, stable_from

    def __call__(self, aim: Aim, pressure: Array) -> Reached | Step:
        z = pressure / BAR
        assert (z >= self._limits.lower).all()
        assert (z <= self._limits.upper).all()
        self.asked.append(z)
        if z.sum() < self._stable_from:
            return Step(pressure, Status.OUT_OF_REACH, "not stable")
        return replace(self._like, pressure=pressure, cost=float(np.linalg.norm(z + np.array([0.0, 0.1, 0.2]))))


def reached_at(solver: InverseKinematics, z: Array) -> tuple[Aim, Reached]:
    target = at(0.0, 0.0, 0.06)
    aim = aim_of(solver.task, target, float(LENGTH))
    judged = solver._at(aim, z * BAR)
    assert isinstance(judged, Reached)
    return aim, judged


def test_what_no_path_led_to_is_a_jump_where_the_pressures_are_far_apart_alone() -> None:
    solver = unloaded()
    _, last = reached_at(solver, np.array([0.5, 0.5, 0.5]))
    _, next_to_it = reached_at(solver, np.array([0.9, 0.5, 0.5]))  # 0.3 of the bounds are 0.45 bar
    _, far = reached_at(solver, np.array([1.0, 0.5, 0.5]))
    assert solver._jumped(next_to_it, None, last) == []
    (said,) = solver._jumped(far, None, last)
    assert said.startswith("the pressures jump from (0.5, 0.5, 0.5) to (1, 0.5, 0.5) bar")
    assert solver._jumped(far, None, None) == []


@pytest.mark.parametrize("begun", [False, True], ids=["from the table", "from a stable pose"])
def test_the_search_among_stable_poses_ends_at_the_fence(begun: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """The least cost on the plane where stability ends: no pose that it asks for is stable and nearer."""
    solver = unloaded()
    aim, like = reached_at(solver, np.full(3, 0.5))
    solver.nearest(at(0.012, -0.004, 0.072), None)  # which tabulates the tips
    judge = Fenced(solver, like, 0.4)
    monkeypatch.setattr(solver, "_at", judge)
    start = judge(aim, np.array([0.9, 0.2, 0.4]) * BAR) if begun else None
    assert not isinstance(start, Step)
    found = solver._searched(aim, start, Work(np.inf))
    assert found is not None
    if start is not None:
        assert found.cost < start.cost
    z = found.pressure / BAR
    assert z.sum() >= 0.4
    step = 1e-3 * 1.5 * 2  # of the last moves along the axes
    for axis in np.eye(3):
        worse = judge(aim, np.maximum(z - step * axis, 0.0) * BAR)
        assert isinstance(worse, Step) or worse.cost >= found.cost
    asked = [judged for z in judge.asked if isinstance(judged := Fenced(solver, like, 0.4)(aim, z * BAR), Reached)]
    assert found.cost == min(judged.cost for judged in asked)
    assert len(judge.asked) <= 160


def test_where_no_pose_of_the_table_is_stable_there_is_no_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    solver = unloaded()
    aim, like = reached_at(solver, np.full(3, 0.5))
    solver.nearest(at(0.012, -0.004, 0.072), None)
    judge = Fenced(solver, like, 99.0)
    monkeypatch.setattr(solver, "_at", judge)
    assert solver._searched(aim, None, Work(np.inf)) is None
    assert len(judge.asked) > 3
    assert all(np.abs(a - b).max() > 0.3 for k, a in enumerate(judge.asked) for b in judge.asked[:k])


@pytest.mark.parametrize(
    ("costs", "best", "rounds"),
    [
        ([5e-2, 4e-2, 3e-2, 2e-2, 1e-2], 2e-2, 4),  # always nearer: after so many rounds the last one stands
        ([5e-2, 4e-2, 6e-2, 1e-2], 4e-2, 3),  # a finer grid led away: the better one stands
        ([5e-2, 4e-2, None, 1e-2], 4e-2, 3),  # the pose was lost: the last that was found stands
        ([None, 1e-2], None, 1),
    ],
    ids=["ever nearer", "further", "lost", "lost at once"],
)
def test_an_answer_is_refined_while_it_comes_nearer(
    costs: list[float | None], best: float | None, rounds: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    solver = unloaded()
    aim, like = reached_at(solver, np.full(3, 0.5))
    found = next(solver._ends(aim, None, Work(np.inf)))
    found = replace(found, cost=0.0)
    judged: list[Array] = []

    def judge(aim: Aim, pressure: Array) -> Reached | Step:
        cost = costs[len(judged)]
        judged.append(pressure)
        if cost is None:
            return Step(pressure, Status.DIVERGED, "lost")
        return replace(like, pressure=pressure, cost=cost)

    monkeypatch.setattr(solver, "_at", judge)
    monkeypatch.setattr(solver, "_refined", lambda *_: np.full(3, 0.5 + 0.01 * len(judged)) * BAR)
    answer = solver._finished(aim, found)
    assert len(judged) == rounds
    if best is None:
        assert isinstance(answer, Step)
        assert answer.status is Status.DIVERGED
    else:
        assert isinstance(answer, Reached)
        assert answer.cost == best
        assert answer.pressure is judged[costs.index(best)]


def test_a_pose_that_is_lost_is_no_answer_and_no_number(monkeypatch: pytest.MonkeyPatch) -> None:
    solver = solver_of(highest=0.0)
    lost = Step(np.zeros(3), Status.DIVERGED, "lost on the way")
    monkeypatch.setattr(solver.poses, "solve", lambda pressure, loads: (lost, None))
    step, reached = solver.nearest(at(0.0, 0.0, 0.06), None)
    assert reached is None
    assert step.status is Status.DIVERGED
    assert step.message == "lost on the way"
    assert step.aimed is not None
    assert step.aimed.distance is None
    assert step.aimed.position is not None
    assert aim_of(solver.task, at(0.0, 0.0, 0.06), 0.06).cost(step.aimed) == np.inf


def test_of_two_answers_the_nearer_one_is_taken() -> None:
    """On two intervals no pose is as near as its arc, so the next place where the search on arcs ended is tried."""
    solver = unloaded()
    asked = np.array([0.0, 0.0, -0.03])
    aim = aim_of(solver.task, Target(asked, None), float(LENGTH))
    ends = [solver._finished(aim, found) for found in solver._ends(aim, None, Work(np.inf))]
    costs = [end.cost for end in ends if isinstance(end, Reached)]
    assert len(costs) > 1
    assert costs.index(min(costs)) < len(costs) - 1
    step, reached = solver.nearest(Target(asked, None), None)
    assert step.status is Status.OUT_OF_REACH
    assert reached is not None
    assert reached.cost == pytest.approx(min(costs), rel=1e-3)


def test_a_lost_start_leaves_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """The arc nearest to the target leads to no pose on the grid; the tips tabulated on the grid do."""
    poses = poses_of(D25)
    wanted = np.array([0.7, 0.0, 0.0]) * BAR
    pose = poses.solve(wanted, LOADED)[0].pose
    assert pose is not None
    solver = solver_of(loads=LOADED, highest=[HIGHEST, 0.0, 0.0])
    place, lost = Reduced.at, []

    def at_first_lost(self: Reduced, z: Array, p: Array, near: Point | Array | None = None) -> Point | None:
        if near is None and self.held.problem.nlp["x"].numel() > 1 and not lost:
            lost.append(z * BAR)
            return None
        return place(self, z, p, near)

    monkeypatch.setattr(Reduced, "at", at_first_lost)
    step, _ = solver.nearest(Target(pose.tip_position, None), None)
    assert abs(lost[0][0] - wanted[0]) < 0.2 * BAR
    assert step.status is Status.SOLVED
    assert step.pressure == pytest.approx(wanted, abs=10)


def test_smaller_pressures_that_leave_the_target_are_not_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    """A search for the least pressures that gives way on the target is put aside: the target comes first."""

    def gives_way(self: Reduced, p: Array, start: Point, limits: Limits, *_: Any, **__: Any) -> tuple[Point, Array]:
        far = self.at(np.zeros(3), p, np.ones(1))
        assert far is not None
        return far, np.zeros((3, 3))

    solver = solver_of()
    aim = Aim(Target(None, TOWARDS), float(LENGTH), 1.0)
    monkeypatch.setattr(Reduced, "minimum_norm", gives_way)
    found = solver._search(aim, Work(np.inf), (np.array([0.9, 0.1, 0.3]), None, False))
    assert found is not None
    assert found.met
    met = at_arc(solver._arcs, aim, found.point.theta)[1]
    assert met.r == pytest.approx(np.zeros(3), abs=1e-6)
    assert np.linalg.norm(found.point.theta) > 0.1


WEAK = Model(D25, material("Ecoflex 00-20", "yeoh"), Coefficients(elongation=0.0))


def test_beyond_the_last_equilibrium_there_is_no_tip() -> None:
    """The branch from zero pressure ends: no map finds a tip there, from nothing or from the last one before."""
    poses = PoseSolver(WEAK, GRID)
    beyond = np.full(3, 9.0) * BAR
    branch = stretch_on_branch(poses.branch, poses.column({"pressure": beyond}), beyond)
    assert branch.status in (Status.NO_EQUILIBRIUM, Status.UNSTABLE_MATERIAL)
    last = 0.99 * branch.fraction * beyond / BAR
    aim = Aim(Target(np.zeros(3), None), float(D25.length), 1.0)
    for tips in (Tips(poses, Loads(), WIDE, GRID, None), Tips(poses, STANDING, WIDE, GRID, 2)):
        program, near = at_arc(tips, aim, last)
        assert program.at(beyond / BAR) is None
        if tips.intervals is None:
            assert program.at(beyond / BAR, near) is None
    task = InverseTask((), np.zeros(3), np.full(3, 9.0) * BAR, 0.06)
    solver = InverseKinematics(WEAK, GRID, Loads(), task, "newton")
    assert solver.limits.largest_sum == pytest.approx(branch.fraction * 27.0, rel=1e-5)
