"""A blocked pose whose path is lost, refused or solved again: what is returned then, and how the branch is kept."""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from copy import copy
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from softnlp import BAR, Loads, Numerics, material, pressure_for_force, robot
from softnlp.base.status import Status
from softnlp.model.contact_settings import ClosureWeights, ContactSettings
from softnlp.model.quantities import Model
from softnlp.nlp.solver import Solution
from softnlp.statics import blocked, blocked_refine, grid_size, weighted
from softnlp.statics import joint as joint_problems
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.blocked_grid import Blocked, BlockedGrid
from softnlp.statics.blocked_refine import stepwise
from softnlp.statics.blocked_resume import Ended
from softnlp.statics.blocked_step import solved_step
from softnlp.statics.free_shape import FreeShapes
from softnlp.statics.multistart import other_equilibria
from softnlp.statics.step import Step
from softnlp.statics.wall import Situation, Wall, standing_wall
from softnlp.statics.weighted import Weighted
from softnlp.studies import force_inversion

D25, ECOFLEX = robot("D25L60"), material("Ecoflex 00-50")
OGDEN = material("Ecoflex 00-50", "ogden")
COARSE = Numerics(intervals=8)
WALL = Wall(np.zeros(3), np.array([1.0, 0.0, 0.0]))
FIRST = np.array([1.0, 0.0, 0.0])
WEIGHTS = ClosureWeights(2.0, 100.0, 30.0, None)


@cache
def shared() -> BlockedSolver:
    return BlockedSolver(Model(D25, ECOFLEX), COARSE, ContactSettings())


def of(numerics: Numerics = COARSE, **contact: Any) -> BlockedSolver:
    """Return a solver with other settings."""
    poses = shared().poses if numerics is COARSE else None
    return BlockedSolver(Model(D25, ECOFLEX), numerics, ContactSettings(**contact), poses=poses)


def copied() -> BlockedSolver:
    """Return the shared solver with grids of its own, so that what is changed of them stays here."""
    assert found_at(0.5).grid in shared().equations.grids.values()
    other = copy(shared())
    other.equations = replace(other.equations, grids=dict(other.equations.grids))
    return other


def solve(solver: BlockedSolver, bar: float, near: Blocked | None = None) -> tuple[Step, Blocked | None]:
    return solver.solve(bar * BAR * FIRST, Loads(), WALL, near)


def found_at(bar: float) -> Blocked:
    found = solve(shared(), bar)[1]
    assert found is not None
    return found


def force(step: Step) -> float:
    assert step.contact is not None, step.message
    return step.contact.force


def last_bar(step: Step) -> float:
    """Read the last pressure [bar] at which the branch was held."""
    return float(step.message.split(" is at ")[1].split(",")[0])


class Instead:
    """An engine with another `solve`."""

    def __init__(self, engine: Any, solve: Callable[[Any, Any], Solution]) -> None:
        self._engine, self.solve = engine, solve

    def __getattr__(self, name: str) -> Any:
        return getattr(self._engine, name)


def fails(p: Any, x: Any, **_: Any) -> Solution:
    return Solution(np.asarray(x), p, np.inf, 2, "gave up")


def with_engines(solver: BlockedSolver, **engines: Callable[[Any, Any], Solution]) -> None:
    """Put other engines into the compiled grids of a solver."""
    grids = solver.equations.grids
    for key, grid in grids.items():
        if isinstance(grid, BlockedGrid):
            new = {name: Instead(getattr(grid, name), solve) for name, solve in engines.items()}
            grids[key] = replace(grid, **new)


# --- the path --------------------------------------------------------------------------------------------------------


def test_another_closure_shares_the_free_shape_and_is_that_closure() -> None:
    other = shared().with_contact(ContactSettings(closure="free"))
    assert other.poses is shared().poses
    alone = of(closure="free")
    assert force(solve(other, 0.5)[0]) == pytest.approx(force(solve(alone, 0.5)[0]), rel=1e-9)
    assert force(solve(other, 0.5)[0]) < 0.9 * force(solve(shared(), 0.5)[0])
    assert shared().with_contact(ContactSettings(tip_cap=1e-3)).equations is shared().equations


def test_a_shape_away_from_the_wall_that_its_grid_cannot_hold_has_no_force() -> None:
    """The closed form has the coil of 10 bar, one interval does not: it is not said to be free of the wall."""
    solver = of(Numerics(intervals=1))
    far = Wall(np.array([-1.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]))
    step, found = solver.solve(10 * BAR * FIRST, Loads(), far)
    assert found is None
    assert step.status is Status.INACCURATE
    assert re.search(r"with 1 intervals it is [0-9.e+]+ L_0", step.message)
    assert step.contact is None
    assert shared().solve(1.0 * BAR * FIRST, Loads(), far)[0].status is Status.NO_CONTACT


@pytest.mark.parametrize("lost", [1, 2])
def test_a_path_that_is_lost_is_followed_once_more_on_a_finer_grid(lost: int, monkeypatch: pytest.MonkeyPatch) -> None:
    solver = of(Numerics())
    reference, exact = solve(solver, 0.3)
    assert exact is not None
    followed, sizes = BlockedSolver._followed, list[int]()

    def watched(self: BlockedSolver, grid: BlockedGrid, route: Any, end: Situation, *rest: Any) -> Blocked | Ended:
        sizes.append(grid.intervals)
        if len(sizes) <= lost:
            return Ended(Situation(0.25 * end.pressure, Loads(), WALL), folded=False, iterations=7)
        return followed(self, grid, route, end, *rest)

    monkeypatch.setattr(BlockedSolver, "_followed", watched)
    step, found = solve(solver, 0.3)
    assert sizes == [sizes[0], 2 * sizes[0]]
    if lost == 1:
        assert found is not None
        assert found.grid.intervals == 2 * sizes[0]
        assert force(step) == pytest.approx(force(reference), rel=1e-3)
    else:
        assert found is None
        assert step.status is Status.DIVERGED
        assert last_bar(step) == pytest.approx(0.25 * 0.3)
        assert step.iterations == 14


def test_a_fold_is_found_on_a_coarse_grid_and_a_shape_solved_on_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    solver, followed, sizes = of(Numerics()), BlockedSolver._followed, list[int]()

    def watched(self: BlockedSolver, grid: BlockedGrid, *rest: Any) -> Any:
        sizes.append(grid.intervals)
        return followed(self, grid, *rest)

    monkeypatch.setattr(BlockedSolver, "_followed", watched)
    folded = solve(solver, 6.0)[0]
    assert (folded.status, sizes) == (Status.FOLD, [20])
    monkeypatch.setattr(blocked, "_SURE", 0.0)  # the coarse grid's word is not taken
    again = solve(solver, 6.0)[0]
    assert (again.status, sizes) == (Status.FOLD, [20, 20, 55])
    assert last_bar(again) == pytest.approx(last_bar(folded), rel=0.01)
    sizes.clear()
    reference = solve(solver, 1.5)[0]
    assert sizes[0] > 8
    monkeypatch.setattr(grid_size, "_SEARCHED_ON", 8)
    sizes.clear()
    step, found = solve(solver, 1.5)
    assert sizes == [8]
    assert found is not None
    assert step.intervals == reference.intervals
    assert force(step) == pytest.approx(force(reference), rel=1e-9)


def test_a_fold_is_believed_on_a_grid_between_the_coarse_one_and_that_of_the_user(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    solver, followed, sizes = of(Numerics(intervals=320)), BlockedSolver._followed, list[int]()

    def watched(self: BlockedSolver, grid: BlockedGrid, *rest: Any) -> Any:
        sizes.append(grid.intervals)
        return followed(self, grid, *rest)

    monkeypatch.setattr(BlockedSolver, "_followed", watched)
    monkeypatch.setattr(blocked, "_SURE", 1e-6)
    folded = solve(solver, 6.0)[0]
    assert (folded.status, sizes) == (Status.FOLD, [20, 80])
    monkeypatch.setattr(blocked, "_SURE", 0.0)
    assert solve(solver, 6.0)[0].status is Status.FOLD
    assert sizes[2:] == [20, 80]  # both lose it at one place
    monkeypatch.setattr(blocked, "_SAME_PLACE", -1.0)
    again = solve(solver, 6.0)[0]
    assert sizes[4:] == [20, 80, 320]
    assert last_bar(again) == pytest.approx(last_bar(folded), rel=1e-3)


def test_without_a_finer_solution_a_coarse_one_is_inaccurate(monkeypatch: pytest.MonkeyPatch) -> None:
    solver = of(Numerics(accuracy=1e-7))
    monkeypatch.setattr(BlockedSolver, "_refined", lambda *_: None)
    step, found = solve(solver, 0.5)
    assert found is None
    assert step.status is Status.INACCURATE
    assert re.search(r"; with 10 intervals it is \d\S* L_0$", step.message)
    monkeypatch.undo()
    assert solve(solver, 0.5)[0].status is Status.SOLVED
    chosen = solve(of(Numerics(accuracy=1e-7, intervals=10)), 0.5)[0]  # that is what was asked for
    assert chosen.status is Status.SOLVED
    assert any("discretisation error" in warning for warning in chosen.warnings)


def test_a_neighbour_on_a_coarse_grid_does_not_decide_about_a_curled_shape() -> None:
    """From 0.3 bar straight to 10 there is a solution on ten intervals that no finer grid has."""
    solver = BlockedSolver(Model(D25, ECOFLEX), Numerics(engine="newton"), ContactSettings(closure="free"))
    low, high = 0.3 * BAR * FIRST[::-1], 10 * BAR * FIRST[::-1]
    wall = standing_wall(solver.poses, solver.contact, high[None, :], Loads())
    near = solver.solve(low, Loads(), wall)[1]
    assert near is not None
    assert near.grid.intervals < 20
    step, alone = (solver.solve(high, Loads(), wall, start)[0] for start in (near, None))
    assert (step.status, alone.status) == (Status.SOLVED, Status.SOLVED)
    assert step.discretisation_error is not None
    assert step.discretisation_error < 1e-6
    assert force(step) == pytest.approx(force(alone), rel=1e-6)


def test_a_finer_grid_that_leads_elsewhere_is_not_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    found, elsewhere = found_at(0.8), found_at(0.4)
    finer = shared().grid(16, shared().plane(found.situation))
    moved = replace(found, solution=replace(found.solution, x=elsewhere.solution.x))
    again = shared()._refined(moved, finer)  # far, but Newton's first step goes nearly all of the way
    right = shared()._refined(found, finer)
    assert again is not None
    assert right is not None
    assert again.solution.x == pytest.approx(right.solution.x, abs=1e-9)
    turned = replace(moved, determinants=(-moved.determinants[0], 1.0))
    assert shared()._refined(turned, finer) is None
    monkeypatch.setattr(blocked_refine, "_CONTRACTION", 0.0)
    assert shared()._refined(moved, finer) is None
    assert right.refinement_error < found.refinement_error / 4


def test_a_coarse_solution_far_from_its_limit_is_refined_by_grids_between(monkeypatch: pytest.MonkeyPatch) -> None:
    found = found_at(1.2)
    plane, asked = shared().plane(found.situation), list[int]()
    fine = shared().grid(80, plane)
    straight = shared()._refined(found, fine)
    assert straight is not None
    small = 30 * straight.refinement_error
    monkeypatch.setattr(blocked_refine, "_FINE", small)

    def refine(at: Blocked, grid: BlockedGrid) -> Blocked | None:
        asked.append(grid.intervals)
        if grid.intervals > 1.3 * at.grid.intervals and at.refinement_error > small:
            return None
        return shared()._refined(at, grid)

    by_steps = stepwise(found, fine, lambda size: shared().grid(size, plane), refine)
    assert by_steps is not None
    assert asked[0] == asked[-1] == 80
    assert len(asked) > 4
    assert by_steps.solution.x == pytest.approx(straight.solution.x, abs=1e-9)
    assert stepwise(found, fine, lambda size: shared().grid(size, plane), lambda *_: None) is None

    def refuse_jumps(at: Blocked, grid: BlockedGrid) -> Blocked | None:
        return None if grid.intervals > 1.3 * at.grid.intervals else shared()._refined(at, grid)

    monkeypatch.setattr(blocked_refine, "_FINE", 0.0)  # never fine enough to jump: the last grid comes by itself
    to_the_end = stepwise(found, fine, lambda size: shared().grid(size, plane), refuse_jumps)
    assert to_the_end is not None
    assert to_the_end.solution.x == pytest.approx(straight.solution.x, abs=1e-9)


def test_a_step_that_went_another_way_is_followed_instead(monkeypatch: pytest.MonkeyPatch) -> None:
    near = found_at(0.5)
    direct, arrived = solve(shared(), 0.55, near)
    assert arrived is not None
    strayed, asked = BlockedGrid.strayed, list[bool]()

    def at_first(self: BlockedGrid, predicted: Any, change: Any) -> float:
        asked.append(strayed(self, predicted, change) <= 1)
        return 0.0 if asked[-1] and len(asked) > 1 else 2.0

    monkeypatch.setattr(BlockedGrid, "strayed", at_first)
    step, found = solve(shared(), 0.55, near)
    assert found is not None
    assert len(asked) > 1
    assert asked[0]
    assert step.iterations > direct.iterations
    assert force(step) == pytest.approx(force(direct), rel=1e-9)


@pytest.mark.parametrize("begin", [None, 0.5])
def test_the_branch_ends_where_the_determinant_changes_its_sign(
    begin: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A determinant that goes through zero at 0.6 bar is a fold there, at once and on the way."""
    near = found_at(begin) if begin else None
    determinants = BlockedGrid.determinants

    def turned(self: BlockedGrid, solution: Solution, plane: Any) -> tuple[float, float]:
        inside, outside = determinants(self, solution, plane)
        return inside * (0.6 - solution.p[0] / BAR), outside

    monkeypatch.setattr(BlockedGrid, "determinants", turned)
    if near is not None:
        near = replace(near, determinants=turned(near.grid, near.solution, shared().plane(near.situation)))
    step, found = solve(shared(), 0.7, near)
    assert found is None
    assert step.contact is None
    assert step.status is Status.FOLD
    assert last_bar(step) == pytest.approx(0.6, abs=0.002)
    assert last_bar(step) <= 0.6


def test_a_path_that_arrives_but_is_not_solved_to_the_end_is_no_answer() -> None:
    solver = copied()
    with_engines(solver, engine=fails)
    step, found = solve(solver, 0.5)
    assert found is None
    assert step.status is Status.DIVERGED
    assert last_bar(step) == pytest.approx(0.5)


def test_a_path_that_cannot_be_begun_was_held_nowhere() -> None:
    solver = copied()
    with_engines(solver, stepper=fails)
    step, found = solve(solver, 0.5)
    assert found is None
    assert step.status is Status.DIVERGED
    assert last_bar(step) == pytest.approx(0.0, abs=1e-6)


def test_a_free_shape_that_is_not_found_is_guessed_as_the_arc(monkeypatch: pytest.MonkeyPatch) -> None:
    solver, grid = shared(), found_at(0.5).grid
    situation = Situation(0.5 * BAR * FIRST, Loads(tip_force=(0.02, 0.0, 0.0)), WALL)
    shapes = FreeShapes(solver.poses, solver.functions, 8, 0.0)
    with monkeypatch.context() as lost:
        lost.setattr(FreeShapes, "tip", lambda *_: (np.full(6, np.nan), np.full(3, np.nan)))
        guess = shapes.guess(situation, grid.case.transcribed.points)
    loaded = shapes.guess(situation, grid.case.transcribed.points)
    assert np.abs(grid.nodes(guess) - grid.nodes(loaded)).max() > 0.01
    unloaded = shapes.guess(replace(situation, loads=Loads()), grid.case.transcribed.points)
    np.testing.assert_array_equal(grid.nodes(guess), grid.nodes(unloaded))
    # the arc is the free shape: its tip is that of the unloaded pose
    pose = solver.poses.solve(situation.pressure, Loads())[0].pose
    assert pose is not None
    np.testing.assert_allclose(grid.nodes(guess)[:3, -1] * D25.length, pose.tip_position, atol=1e-4 * D25.length)


def test_a_wall_that_would_have_to_pull_is_no_solution() -> None:
    found, solver = found_at(0.5), shared()
    reference = solve(solver, 0.5)[0]
    x = found.solution.x.copy()
    x[-1] = -x[-1]
    assert reference.contact is not None
    pose = reference.contact.free
    pulled = replace(found, solution=replace(found.solution, x=x))
    step, pushed = (
        solved_step(solver.poses, solver.functions, solver.contact, f, pose, 3, time.perf_counter())
        for f in (pulled, found)
    )
    assert step.status is Status.DIVERGED
    assert step.contact is None
    assert float(step.message.split("pull with ")[1].split(" N")[0]) == pytest.approx(force(reference), rel=5e-3)
    assert force(pushed) == force(reference)


def test_another_equilibrium_is_told_with_its_force_and_tip() -> None:
    """Of a point that is none, first guesses elsewhere lead to the equilibrium, once."""
    found, solver = found_at(0.5), shared()
    reference = solve(solver, 0.5)[0]
    x = found.solution.x.copy()
    x[1:] *= 1.01
    (told,) = other_equilibria(solver, replace(found, solution=replace(found.solution, x=x)), 12)
    assert reference.pose is not None
    assert float(told.split("force of ")[1].split(" N")[0]) == pytest.approx(force(reference), rel=5e-3)
    tip = [float(v) for v in told.split("tip at (")[1].split(")")[0].split(",")]
    np.testing.assert_allclose(tip, 1e3 * reference.pose.tip_position, atol=0.06)
    assert other_equilibria(solver, found, 12) == ()


def test_beyond_every_equilibrium_a_wall_stands_where_it_would_at_rest() -> None:
    solver = BlockedSolver(Model(D25, OGDEN), COARSE, ContactSettings(offset=5e-3))
    walls = [
        standing_wall(solver.poses, solver.contact, bar * BAR * FIRST[None, :], Loads()) for bar in (1e3, 1e8, 0.0)
    ]
    np.testing.assert_array_equal(walls[1].point, walls[2].point)
    np.testing.assert_array_equal(walls[1].normal, walls[2].normal)
    assert np.any(walls[0].normal != walls[1].normal)  # a thousandth of that bends away from the offset


# --- the minimum of weighted squares ---------------------------------------------------------------------------------


@cache
def minimum() -> tuple[BlockedSolver, Blocked]:
    solver = BlockedSolver(
        Model(D25, ECOFLEX), Numerics(intervals=8), ContactSettings(closure="weighted", weights=WEIGHTS)
    )
    found = solve(solver, 0.3)[1]
    assert found is not None
    return solver, found


def test_the_minimum_in_the_plane_is_a_stationary_point_in_space() -> None:
    solver, found = minimum()
    spatial = solver.grid(8, None).engine.solve(found.solution.p, found.solution.x)
    assert spatial.holds(1e-9)
    np.testing.assert_allclose(spatial.x, found.solution.x, atol=1e-7)


def test_a_minimum_that_is_not_found_has_no_residual_to_believe(monkeypatch: pytest.MonkeyPatch) -> None:
    _, found = minimum()
    engine, p, x = found.grid.engine, found.solution.p, found.solution.x
    assert engine.solve(p, x).holds(1e-9)
    wild = engine.solve(p, 1e6 * x)
    assert not wild.holds(1e300)
    assert wild.engine_status == "Gauss-Newton diverged"
    monkeypatch.setattr(weighted, "_STEPS", 1)
    begun = found.solution.x.copy()
    begun[1:] *= 1.01
    stopped = engine.solve(p, begun)
    assert not stopped.holds(1e300)
    assert stopped.engine_status == "Gauss-Newton reached its iteration limit"
    assert stopped.iterations == 1


def test_by_collocation_a_minimum_needs_square_solutions_and_steps_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    contact = ContactSettings(closure="weighted", weights=WEIGHTS)
    solver = BlockedSolver(Model(robot("D25L40"), ECOFLEX), Numerics("collocation", intervals=3), contact)
    found = solve(solver, 0.1)[1]
    assert found is not None
    engine, p, x = found.grid.engine, found.solution.p, found.solution.x
    assert isinstance(engine, Weighted)
    again = engine.solve(p, x)
    assert again.holds(1e-8)
    monkeypatch.setattr(weighted, "_STEPS", 1)
    assert not engine.solve(p, np.append(x[:-1], 1.1 * x[-1])).holds(1e300)
    monkeypatch.undo()
    monkeypatch.setattr(engine, "_engine", Instead(engine._engine, fails))
    lost = engine.solve(p, x)
    assert not lost.holds(1e300)
    assert lost.iterations == 2


# --- the pressure of a force -----------------------------------------------------------------------------------------


def test_a_branch_that_ends_before_the_force_says_how() -> None:
    pressures, step = pressure_for_force(D25, OGDEN, [0], 100.0, highest=600 * BAR, numerics=COARSE)
    assert step.status is Status.UNSTABLE_MATERIAL
    assert np.all(np.isnan(pressures))
    assert np.max(step.pressure) == pytest.approx(100 * BAR)


@pytest.mark.parametrize(("closure", "joint"), [("free", "fails"), ("free", "off the branch"), ("weighted", "unused")])
def test_a_pressure_gives_its_force_also_where_both_shapes_are_not_solved_at_once(
    closure: str, joint: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    contact = ContactSettings(closure=closure, weights=WEIGHTS)  # type: ignore[arg-type]
    if joint == "fails":
        real = joint_problems.joint_engine
        monkeypatch.setattr(joint_problems, "joint_engine", lambda *a, **k: Instead(real(*a, **k), fails))
    if joint == "off the branch":
        plain, near = BlockedSolver.solve, list[float]()
        monkeypatch.setattr(force_inversion, "_jointly", lambda *a: near.append(1.02 * a[3]) or near[-1])

        def lost(self: BlockedSolver, P: Any, *rest: Any) -> tuple[Step, Blocked | None]:
            step, solved = plain(self, P, *rest)
            return (step, None) if near and P[0] == near[-1] else (step, solved)

        monkeypatch.setattr(BlockedSolver, "solve", lost)
    wanted = 0.05
    pressures, step = pressure_for_force(D25, ECOFLEX, [0], wanted, contact, highest=0.6 * BAR,
                                         numerics=COARSE)  # fmt: skip
    monkeypatch.undo()
    assert step.status is Status.SOLVED
    accuracy = 1e-9 if joint == "unused" else 1e-3
    assert force(step) == pytest.approx(wanted, rel=accuracy)
    again = solve(of(closure=closure, weights=WEIGHTS), pressures[0] / BAR)[0]
    assert force(again) == pytest.approx(wanted, rel=max(accuracy, 1e-6))
