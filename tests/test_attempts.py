"""The ladder of attempts at one pose: what is tried, that all of it leads to the same pose, and snapping through."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from softnlp import BAR, Loads, Numerics, forward, material, robot
from softnlp.model.quantities import Model
from softnlp.statics import attempts as ladder
from softnlp.statics.attempts import LOADS, Attempt, Goal, Work, attempts
from softnlp.statics.solver import PoseSolver

BODY, SILICONE = robot("D10L60"), material("Ecoflex 00-50", "mooney-rivlin")
INTERVALS = 8
POSES = PoseSolver(Model(BODY, SILICONE), Numerics(intervals=INTERVALS))
GRID = POSES.grid(INTERVALS)
NO_LOADS = {name: np.zeros(3) for name in LOADS}
MILD = Loads(tip_force=(0.002, 0.001, -0.001), gravity=(0.0, 0.0, 9.8))
PRESSURE = np.array([0.4, 0.1, 0.0]) * BAR


def goal_of(pressure: np.ndarray, loads: Loads, near: np.ndarray | None = None) -> Goal:
    """Return a pose to reach, with the solution at another pressure under the same loads where that is asked for."""

    def arc(values: Mapping[str, Any]) -> np.ndarray:
        return POSES.arc_guess(GRID, GRID.problem.pack(values), stretch(values))

    def stretch(values: Mapping[str, Any]) -> float:
        return POSES._stretch(values)

    values = POSES.values(pressure, loads)
    neighbour = None
    if near is not None:
        solved = POSES.solve(near, loads)[1]
        assert solved is not None
        neighbour = POSES._neighbour(solved, GRID, GRID.problem.pack(values), stretch(values))
    return Goal(GRID, values, arc, neighbour)


def tip(attempt: Attempt) -> np.ndarray:
    return GRID.nodes(attempt.solution.x)[:3, -1]


@pytest.mark.parametrize(
    ("near", "count"),
    [(None, 7), (PRESSURE, 8), (0.8 * PRESSURE, 10)],
    ids=["from nothing", "from the pose itself", "from a neighbour"],
)
def test_every_attempt_leads_to_the_same_pose(near: np.ndarray | None, count: int) -> None:
    """Mild loads leave one equilibrium: guesses, paths from the neighbour and from rest, and IPOPT all end in it."""
    made = list(attempts(goal_of(PRESSURE, MILD, near), Work(1e9)))
    assert len(made) == count
    for attempt in made:
        assert attempt.fraction == 1.0
        assert attempt.solution.holds(1e-8)
        assert tip(attempt) == pytest.approx(tip(made[0]), abs=1e-8)
    assert sum(attempt.on_path for attempt in made) == (6 if count == 10 else 5)


def test_the_reference_is_tried_where_there_is_work_left_for_it() -> None:
    goal = goal_of(PRESSURE, MILD)
    by_ipopt = list(attempts(goal, Work(1e9)))[-1].solution.engine_status
    assert by_ipopt == "Solve_Succeeded"
    too_little = Work(0.99 * ladder._REFERENCE * GRID.iteration_cost)
    assert all("Newton" in a.solution.engine_status for a in attempts(goal, too_little))


def test_a_path_from_the_neighbour_ends_where_the_work_is_used_up() -> None:
    goal = goal_of(PRESSURE, MILD, 0.5 * PRESSURE)
    assert goal.near is not None
    near_tip = GRID.nodes(goal.near.x)[:3, -1]
    path = list(attempts(goal, Work(0.0)))[2]
    assert path.fraction == 0.0
    assert not path.on_path
    assert tip(path) == pytest.approx(near_tip, abs=1e-9)
    assert path.solution.p == pytest.approx(goal.near.p)


def test_a_column_pushed_over_by_a_load_snaps_to_the_side_to_which_it_is_bent() -> None:
    """Loaded beyond buckling to +x, then bent to -x by pressure: it gives way before the pressure is there."""
    rest = goal_of(np.zeros(3), Loads())
    unit = float(np.asarray(GRID.problem.units(rest.arc(rest.values), GRID.problem.pack(rest.values))).ravel()[1])
    loads = Loads(tip_force=(0.3 * unit, 0.0, -3.0 * unit))
    pressure = np.array([0.4, 0.0, 0.0]) * BAR
    goal = goal_of(pressure, loads)
    first = {**goal.values, "pressure": np.zeros(3)}
    lost, snapped, last = ladder._along(goal, [{**first, **NO_LOADS}, first, goal.values], Work(1e9))
    assert 0.5 < lost.fraction < 1.0  # in the second half of the path: the loads are applied, the pressure is not
    assert tip(lost)[0] > 0.3
    assert snapped.fraction == 1.0
    assert snapped.on_path
    assert snapped.solution.holds(1e-10)
    assert tip(snapped)[0] < -0.5
    assert last.fraction < 1.0  # and no other end
    pose = forward(BODY, SILICONE, pressure, loads=loads, numerics=Numerics(intervals=INTERVALS)).steps[0].pose
    assert pose is not None
    assert pose.stable
    assert tip(snapped) * BODY.length == pytest.approx(pose.tip_position, abs=1e-8)
