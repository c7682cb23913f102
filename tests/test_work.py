"""What single poses may cost, in counted work: iterations and sizes of grids, whatever the machine."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest

from softnlp import BAR, Coefficients, ContactSettings, Loads, Numerics, Step, blocked_force, forward, material, robot
from softnlp.base.status import Status
from softnlp.statics import kept, loadcase, solver
from softnlp.statics.blocked import BlockedSolver
from softnlp.statics.condensed import CondensedSolver

D25, DRAGON = robot("D25L60"), material("Dragon Skin 10", "linear")
NEWTON = Numerics(engine="newton")
NONE, STANDING = Loads(), Loads(gravity=(0.0, 0.0, -9.81))


@pytest.fixture
def swept(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Count the intervals of every linearised sweep over a rod."""
    intervals: list[int] = []
    tip_system = CondensedSolver.tip_system

    def counted(self: CondensedSolver, *given: Any) -> Any:
        intervals.append(self._shape[1] - 1)
        return tip_system(self, *given)

    monkeypatch.setattr(CondensedSolver, "tip_system", counted)
    return intervals


def blocked(bar: list[float], loads: Loads = NONE, **coefficients: float) -> Step:
    chosen = Coefficients(**coefficients)
    return blocked_force(
        D25, DRAGON, np.array(bar) * BAR, ContactSettings(), loads=loads, coefficients=chosen, numerics=NEWTON
    ).steps[0]


@pytest.mark.parametrize(
    ("bar", "loads", "reaction", "status", "most"),
    [
        ([12.0, 3.0, 0.0], STANDING, 1.45, Status.SOLVED, 18_000),
        ([2.0, 0.0, 0.0], NONE, 1000.0, Status.SOLVED, 1_300),
        ([12.0, 0.0, 0.0], STANDING, 1.45, Status.FOLD, 13_000),
    ],
    ids=["in space", "stiff chambers", "beyond a fold"],
)
def test_a_blocked_pose_takes_so_many_linearised_intervals(
    bar: list[float], loads: Loads, reaction: float, status: Status, most: int, swept: list[int]
) -> None:
    step = blocked(bar, loads, chamber_reaction=reaction)
    assert step.status is status
    assert 0 < sum(swept) <= most


def test_stiff_chambers_are_followed_to_the_force_that_less_stiff_ones_lead_to() -> None:
    """The forces tend to that of chambers that do not give at all, by ever smaller differences."""
    forces = [blocked([2.0, 0.0, 0.0], chamber_reaction=k).contact.force for k in (30.0, 100.0, 300.0, 1000.0)]  # type: ignore[union-attr]
    steps = np.diff(forces)
    assert np.all(np.abs(steps[1:]) < np.abs(steps[:-1]))


def test_a_wall_where_the_free_shape_goes_has_it_solved_once(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[Any] = []
    solve = solver.PoseSolver.solve

    def counted(self: solver.PoseSolver, pressure: Any, *given: Any) -> Any:
        asked.append(pressure)
        return solve(self, pressure, *given)

    monkeypatch.setattr(solver.PoseSolver, "solve", counted)
    assert blocked([1.0, 0.0, 0.0], STANDING).status is Status.SOLVED
    assert len(asked) == 1


def test_the_jacobian_for_ipopt_is_that_of_one_interval(monkeypatch: pytest.MonkeyPatch) -> None:
    """No expression of a whole grid is differentiated: what is differentiated is as large on any grid."""
    sizes: list[int] = []
    jacobian = ca.jacobian

    def counted(expression: Any, by: Any, *options: Any) -> Any:
        sizes.append(expression.numel())
        return jacobian(expression, by, *options)

    monkeypatch.setattr(ca, "jacobian", counted)
    step = forward(D25, DRAGON, [2e5, 0.0, 0.0], loads=STANDING, numerics=Numerics(intervals=226)).steps[0]
    assert step.status is Status.SOLVED
    assert step.ipopt is not None
    assert max(sizes) < 226


def test_a_branch_that_a_coarse_grid_lost_is_gone_on_with_from_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """The next grid does not begin at contact again, and its end is that of the branch."""
    ended: list[Any] = []
    followed = BlockedSolver._followed

    def kept(self: BlockedSolver, *given: Any) -> Any:
        found = followed(self, *given)
        ended.append(found)
        return found

    monkeypatch.setattr(BlockedSolver, "_followed", kept)
    thin, soft = robot("laparoscope-6"), material("Ecoflex 00-30", "mooney-rivlin")
    stiff = Coefficients(chamber_reaction=1000.0)
    step = blocked_force(thin, soft, [0.0, 0.0, 2.02e5], coefficients=stiff, numerics=NEWTON).steps[0]
    first, second = ended
    assert step.status is Status.DIVERGED
    assert second.iterations <= 0.8 * first.iterations
    assert second.situation.pressure == pytest.approx(first.situation.pressure, rel=5e-3)


@pytest.mark.parametrize("blocking", [False, True])
def test_a_first_pose_builds_what_its_rods_share_once(blocking: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """The section with the wall is that without; of a step of Runge-Kutta there is one for each field."""
    made: list[str] = []
    function, section = ca.Function, loadcase.section_function

    def counted(*given: Any) -> Any:
        made.append(given[0])
        return function(*given)

    def sections(*given: Any) -> Any:
        made.append("section of a rod")
        return section(*given)

    kept._KEPT.equations.clear()
    monkeypatch.setattr(ca, "Function", counted)
    monkeypatch.setattr(loadcase, "section_function", sections)
    pose = (
        blocked([1.0, 0.0, 0.0], STANDING) if blocking else forward(D25, DRAGON, [1e5, 0, 0], loads=STANDING).steps[0]
    )
    assert pose.status is Status.SOLVED
    assert made.count("section of a rod") == 1
    assert made.count("step") <= 2 * (1 + blocking)  # with the integrals and without
    assert made.count("transition") == 1
