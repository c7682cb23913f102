"""Paths: limits that are kept, targets that are met, and those that cannot be; from the study to the files."""

from __future__ import annotations

import csv
import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from softnlp import (
    BAR,
    MILLIMETRE,
    InputError,
    Loads,
    Numerics,
    Plane,
    Run,
    Segment,
    Sphere,
    Status,
    Trocar,
    inverse,
    load_scenario,
    material,
    robot,
    segmented_robot,
    trajectory,
)
from softnlp.cli import main
from softnlp.results import load_run, save, to_json, view_of_run
from softnlp.scenario.run import partial_run
from softnlp.statics.clearance import NodeGaps, beside_nodes

Array = NDArray[np.float64]

D25, SILICONE = robot("D25L60"), material("Ecoflex 00-50", "mooney-rivlin")
LENGTH = float(D25.length)
GRID = Numerics(intervals=10, accuracy=1e-5)
HEAD = """
study = "trajectory"
[robot]
name = "D25L60"
[material]
name = "Ecoflex 00-50"
model = "mooney-rivlin"
"""


def circle(count: int, radius: float = 12.0, height: float = 72.0) -> Array:
    """Return points of a circle about the axis [m]."""
    angle = 2 * np.pi * np.arange(count) / count
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.full(count, height)]) * MILLIMETRE


def pressures(run: Run) -> Array:
    """Return the pressures of a run [bar]."""
    return np.array([step.pressure for step in run.steps]) / BAR


@cache
def free() -> Run:
    """Return a circle that no limit is in the way of."""
    return trajectory(D25, SILICONE, times=np.arange(6.0), positions=circle(6), numerics=GRID)


def test_a_circle_has_the_symmetry_of_the_robot() -> None:
    """Turned by a third, the robot is itself with its sets in another order."""
    P = pressures(free())
    assert all(step.status is Status.SOLVED for step in free().steps)
    assert np.allclose(P[2:4], np.roll(P[:2], 1, axis=1), atol=1e-7)
    assert np.allclose(P[4:], np.roll(P[:2], 2, axis=1), atol=1e-7)
    assert np.ptp(P[0]) > 0.1


def test_where_no_limit_is_active_a_path_is_what_its_points_are_alone() -> None:
    loads = Loads(tip_force=(0.02, 0.0, -0.03), gravity=(0.0, 0.0, -9.80665))
    both = {"positions": circle(3), "loads": loads, "numerics": GRID}
    path = trajectory(D25, SILICONE, times=[0.0, 1.0, 2.5], **both)
    alone = inverse(D25, SILICONE, **both)
    assert np.allclose(pressures(path), pressures(alone), atol=1e-5)
    for one, other in zip(path.steps, alone.steps, strict=True):
        assert one.pose is not None
        assert other.pose is not None
        assert np.linalg.norm(one.pose.tip_position - other.pose.tip_position) < 1e-6 * LENGTH
        assert one.ipopt is not None
        assert one.ipopt.status == "Solve_Succeeded"
        assert one.margins is not None
        assert one.margins.stiffness is not None
        assert one.margins.stiffness > 0


def test_a_path_that_is_too_fast_is_followed_as_fast_as_pressures_may_change() -> None:
    """A target to the side, between two equal ones, is left out as far as the rate demands, and only that."""
    points = np.array([[0.0, 0.0, 70.0], [0.0, 0.0, 70.0], [9.0, 0.0, 70.0], [0.0, 0.0, 70.0], [0.0, 0.0, 70.0]])
    times = np.array([0.0, 1.0, 2.0, 3.0, 4.0])
    asked: dict[str, Any] = {"times": times, "positions": points * MILLIMETRE, "numerics": GRID}
    unlimited = trajectory(D25, SILICONE, **asked)
    wanted = float(np.abs(np.diff(pressures(unlimited), axis=0)).max())
    limit = 0.6 * wanted
    run = trajectory(D25, SILICONE, rate=limit * BAR, **asked)
    rates = np.abs(np.diff(pressures(run), axis=0))
    assert rates.max() <= limit * (1 + 1e-9)
    assert rates.max() > limit * (1 - 1e-6)  # the limit is what holds the tip back
    assert [step.status for step in run.steps][2] is Status.OUT_OF_REACH
    least = min(step.margins.rate for step in run.steps if step.margins is not None and step.margins.rate is not None)
    assert abs(least) <= 1e-9 * limit * BAR
    distance = [step.aimed.distance for step in run.steps if step.aimed is not None]
    assert max(d for d in distance if d is not None) == distance[2]
    assert sum(step.status is Status.SOLVED for step in run.steps) >= 2


def test_a_body_keeps_its_clearance_by_a_witness() -> None:
    """The distance of the axis from the ball's centre, less both radii, as the shape of the pose has it."""
    ball = Sphere(centre=(0.030, 0.0, 0.045), radius=0.010)
    asked: dict[str, Any] = {"times": np.arange(3.0), "positions": circle(12)[[11, 0, 1]], "numerics": GRID}

    def gaps(run: Run) -> Array:
        found = []
        for step in run.steps:
            assert step.pose is not None
            apart = np.linalg.norm(step.pose.shape.position - ball.centre, axis=1)
            found.append(apart.min() - ball.radius - step.pose.radii.outer)
        return np.array(found)

    without = gaps(trajectory(D25, SILICONE, **asked))
    clearance = float(without.max()) + 0.5 * MILLIMETRE
    run = trajectory(D25, SILICONE, obstacles=[ball], clearance=clearance, **asked)
    kept = gaps(run)
    assert np.all(kept > clearance - 0.01 * MILLIMETRE)
    assert kept.min() < clearance + 0.05 * MILLIMETRE  # and is what keeps the tip away
    assert all(step.status is Status.OUT_OF_REACH for step in run.steps)
    for step, gap in zip(run.steps, kept, strict=True):
        assert step.margins is not None
        assert step.margins.clearance == pytest.approx(gap - clearance, abs=0.01 * MILLIMETRE)
        assert step.contacts[0].gap == pytest.approx(gap, abs=0.01 * MILLIMETRE)


def test_targets_out_of_reach_leave_the_others_as_they_are() -> None:
    points = np.vstack([circle(6)[:2], [[0.0, 0.0, 0.2]], circle(6)[2:4]])
    run = trajectory(D25, SILICONE, times=np.arange(5.0), positions=points, numerics=GRID)
    status = [step.status for step in run.steps]
    assert status == [Status.SOLVED, Status.SOLVED, Status.OUT_OF_REACH, Status.SOLVED, Status.SOLVED]
    met = np.delete(pressures(run), 2, axis=0)
    assert np.allclose(met, pressures(free())[:4], atol=1e-7)
    alone = inverse(D25, SILICONE, positions=points[2], numerics=GRID).steps[0]
    lost = run.steps[2]
    assert lost.aimed is not None
    assert alone.aimed is not None
    assert lost.aimed.distance == pytest.approx(alone.aimed.distance, rel=1e-6)
    table = to_json(run)["steps"][2]
    assert table["tip_position_mm"] is None
    assert table["distance_mm"] > 1
    assert table["margin_pressure_bar"] == pytest.approx(0.0, abs=1e-6)


def test_a_target_inside_an_obstacle_leaves_the_others_as_they_are() -> None:
    ball = Sphere(centre=(0.04, 0.0, 0.05), radius=0.01)
    points = np.vstack([circle(6)[:1], [ball.centre]])
    run = trajectory(D25, SILICONE, times=np.arange(2.0), positions=points, obstacles=[ball], numerics=GRID)
    assert [step.status for step in run.steps] == [Status.SOLVED, Status.OUT_OF_REACH]
    assert np.allclose(run.steps[0].pressure, free().steps[0].pressure, atol=1e-7 * BAR)
    lost = run.steps[1]
    assert lost.aimed is not None
    assert lost.aimed.distance is not None
    assert lost.aimed.distance > ball.radius  # the tip is outside the ball
    assert all(step.margins is not None and (step.margins.clearance or 0.0) > -1e-5 for step in run.steps)


def test_a_set_to_spare_takes_the_least_pressures_or_the_smoothest() -> None:
    """Directions alone leave one of three sets free; as many squeezes of pressure as there are points to choose."""
    angle = np.array([0.0, 0.5, 1.2, 2.0])
    tilted = np.column_stack([0.4 * np.cos(angle), 0.4 * np.sin(angle), np.ones(4)])
    asked: dict[str, Any] = {"directions": tilted, "numerics": GRID, "bounds": (0.05 * BAR, 1.5 * BAR)}
    times = np.array([0.0, 1.0, 2.5, 3.0])
    least, smooth = (
        trajectory(D25, SILICONE, times=times, minimise=kind, **asked)  # type: ignore[arg-type]
        for kind in ("pressure", "rate")
    )
    assert all(step.status is Status.SOLVED for step in (*least.steps, *smooth.steps))
    assert all(step.aimed is not None and step.aimed.optimal for step in (*least.steps, *smooth.steps))
    assert np.allclose(pressures(least), pressures(inverse(D25, SILICONE, **asked)), atol=1e-5)
    rates = [np.diff(pressures(run), axis=0) ** 2 / np.diff(times)[:, None] for run in (least, smooth)]
    assert np.sum(rates[1]) < 0.98 * np.sum(rates[0])
    assert np.sum(pressures(least) ** 2) < np.sum(pressures(smooth) ** 2)


@pytest.mark.slow
def test_two_segments_keep_away_from_a_port_and_a_ball_and_meet_every_target() -> None:
    """Sets to spare move the body aside; without obstacles it would be in the ball."""
    half = robot("D25L60", length=0.03)
    two = segmented_robot([Segment(half, SILICONE), Segment(half, SILICONE)])
    ball = Sphere(centre=(0.027, 0.0, 0.045), radius=0.010)
    port = Trocar(point=(0, 0, 0.012), axis=(0, 0, 1), radius=0.014, length=0.006)
    asked: dict[str, Any] = {"times": np.arange(4.0), "positions": circle(12)[:4]}
    run = trajectory(two, two.material, obstacles=[port, ball], clearance=MILLIMETRE, rate=0.2 * BAR, **asked)
    free = trajectory(two, two.material, **asked)
    assert all(step.status is Status.SOLVED for step in (*run.steps, *free.steps))

    def gap(run: Run) -> float:
        apart = [
            np.linalg.norm(step.pose.shape.position - ball.centre, axis=1).min() for step in run.steps if step.pose
        ]
        return float(min(apart)) - ball.radius

    radius = min(float(np.min(step.pose.outline.outer)) for step in run.steps if step.pose and step.pose.outline)
    assert gap(run) > radius + 0.99 * MILLIMETRE
    assert gap(free) < gap(run) - 0.1 * MILLIMETRE
    assert np.abs(np.diff(pressures(run), axis=0)).max() <= 0.2 * (1 + 1e-9)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"times": [0.0, 1.0, 1.0]}, "expected a time after 1"),
        ({"times": [0.0, 1.0]}, "expected 3 finite numbers"),
        ({"minimise": "sum"}, "expected 'pressure' or 'rate'"),
        ({"rate": 0.0}, "above 0"),
        ({"clearance": -1.0}, "at least 0"),
        ({"numerics": Numerics(engine="newton")}, "expected 'auto' or 'ipopt'"),
        ({"obstacles": [Sphere(centre=(0.0, 0.0, 0.03), radius=0.01)]}, "overlaps sphere 1"),
        ({"obstacles": [Plane(point=(-0.014, 0, 0), normal=(1, 0, 0))], "clearance": 0.002}, "at most 1.5 mm"),
        ({"obstacles": [Plane(point=(-0.1, 0, 0), normal=(1, 0, 0), part="tip axis")]}, "expected 'body'"),
    ],
)
def test_what_cannot_be_meant_is_refused(more: dict[str, Any], words: str) -> None:
    asked: dict[str, Any] = {"times": [0.0, 1.0, 2.0], "positions": circle(3), **more}
    with pytest.raises(InputError, match=words):
        trajectory(D25, SILICONE, **asked)


@given(at=st.floats(0.001, 0.999), nodes=st.integers(2, 12))
@settings(max_examples=30, deadline=None)
def test_what_is_too_close_between_two_nodes_is_told_to_both(at: float, nodes: int) -> None:
    arc = np.arange(1, nodes + 1) / nodes
    gaps = NodeGaps(np.zeros(0), arc, np.zeros(nodes, int))  # type: ignore[arg-type]
    s = np.linspace(0, 1, 400)
    closer = np.where(np.arange(400) == np.argmin(np.abs(s - at)), 2.0, -1.0)[None]
    place = s[np.argmin(np.abs(s - at))]
    expected = np.where(np.abs(arc - place) < 1 / nodes + 1e-9, 2.0, 0.0)
    found = beside_nodes(gaps, s, closer)
    between = np.abs(np.abs(arc - place) - 1 / nodes) < 1e-6  # just at a node either may be meant
    assert np.all((found == expected) | between)


# --- files ------------------------------------------------------------------------------------------------------------

ROWS = "t_s,x_mm,y_mm,z_mm\n0,12,0,72\n1,11,4,72\n2,9,7,72\n"
FAST = '[trajectory]\nfile = "path.csv"\nrate_bar_per_s = 0.5\n[solver]\nintervals = 10\naccuracy = 1e-5\n'


def written(folder: Path, tables: str = FAST, rows: str = ROWS) -> Path:
    """Write a scenario and its path."""
    (folder / "path.csv").write_text(rows)
    (folder / "s.toml").write_text(HEAD + tables)
    return folder / "s.toml"


def test_a_run_leaves_what_a_regulator_and_figures_need(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path)
    assert main(["run", str(path), "--out", str(tmp_path / "out"), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["limits"] == {
        "pressure_bar": [[0.0, 1.5]] * 3,
        "rate_bar_per_s": 0.5,
        "clearance_mm": 0.0,
        "minimise": "pressure",
    }
    steps = document["steps"]
    assert [step["t_s"] for step in steps] == [0.0, 1.0, 2.0]
    assert [step["target_mm"] for step in steps] == [[12.0, 0.0, 72.0], [11.0, 4.0, 72.0], [9.0, 7.0, 72.0]]
    assert all(step["distance_mm"] < 1e-5 * 60 and step["stable"] for step in steps)
    least = min(step["margin_pressure_bar"] for step in steps)
    assert document["least_margins"]["margin_pressure_bar"] == least
    with (tmp_path / "out" / "path.csv").open() as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["t_s", "p1_bar", "p2_bar", "p3_bar"]
    assert [[float(cell) for cell in row[1:]] for row in rows[1:]] == [step["pressure_bar"] for step in steps]
    again = written(tmp_path, '[pressure]\nfile = "out/path.csv"\n').read_text().replace("trajectory", "forward")
    path.write_text(again)
    assert load_scenario(path).times is not None
    view = load_run(tmp_path / "out")
    assert view.limits == document["limits"]
    assert (tmp_path / "out" / "figure.png").stat().st_size > 10_000


def test_a_target_that_is_not_met_is_exit_status_3(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, rows="t_s,x_mm,y_mm,z_mm\n0,12,0,72\n1,60,0,90\n")
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 3
    assert "out_of_reach" in capsys.readouterr().out
    assert len((tmp_path / "out" / "path.csv").read_text().splitlines()) == 3


WRONG = {
    "t_s,x_mm,y_mm,z_mm\n0,12,0,72\n0,11,4,72\n": "line 3: t_s: expected a time after 0, that of the row before, got 0",
    "t_s,x_mm,y_mm,z_mm\n1,12,0,72\n0,11,4,72\n": "line 3: t_s: expected a time after 1",
    "t_s,x_mm,y_mm,z_mm\n0,12,nan,72\n": "line 2: y_mm: expected a finite number",
    "t_s,x_mm,y_mm,z_mm\n0,12,,72\n": "line 2: y_mm: expected a number, got",
    "t_s,x_mm,y_mm,z_mm\n0,12,0\n": "line 2: expected 4 values as in the header, got 3",
    "t_s,x_mm,y_mm\n0,12,0\n": "missing column 'z_mm'",
    "t_s,x_mm,y_mm,z_mm\n": "expected a header and rows of numbers",
    "": "got an empty file",
    "t_s,x_mm,y_mm,z_mm,dx\n0,12,0,72,1\n": "missing column 'dy', beside 'dx'",
    "t_s,x_mm,y_mm,z_mm,dx,dy,dz\n0,12,0,72,0,0,0\n": "line 2: dx: expected a direction, got zeros",
    "t_s;x_mm;y_mm;z_mm\n0;12;0;72\n": "expected columns separated by commas",
}


@pytest.mark.parametrize("rows", WRONG)
def test_a_file_that_is_wrong_is_one_line(rows: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path, rows=rows)
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert WRONG[rows] in said
    assert "path.csv" in said
    assert not (tmp_path / "out").exists()


TABLES = {
    "[trajectory]\n": "[trajectory]: expected exactly one of tip_position_mm, file, got none",
    '[trajectory]\nfile = "path.csv"\ntip_position_mm = [[0, 0, 70]]\n': "got tip_position_mm and file",
    '[trajectory]\nfile = "path.csv"\nduration_s = 1.0\n': "duration_s: expected in the file only",
    '[trajectory]\nfile = "path.csv"\nclearance_mm = 1.0\n': "clearance_mm: expected only beside [[obstacle]]",
    '[trajectory]\nfile = "path.csv"\nlength_per_radian_mm = 1.0\n': "expected only where directions are given",
    "[trajectory]\ntip_position_mm = [[0, 0, 70], [0, 0, 71]]\nrate_bar_per_s = 1.0\n": "duration_s: missing",
    "[trajectory]\ntip_position_mm = [[0, 0, 70]]\ntip_direction = [[0, 0, 1], [0, 0, 1]]\n": "position, got 2 for 1",
    '[trajectory]\nfile = "path.csv"\nminimise = "speed"\n': "minimise: expected 'pressure' or 'rate'",
    '[trajectory]\nfile = "path.csv"\n[solver]\nengine = "newton"\n': "[solver] engine: a path is one program",
    '[trajectory]\nfile = "path.csv"\n[pressure]\nsequence_bar = [[0, 0, 0]]\n': "not used by study 'trajectory'",
}


@pytest.mark.parametrize("tables", TABLES)
def test_tables_that_do_not_fit_are_one_line(tables: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", str(written(tmp_path, tables)), "--json"]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert TABLES[tables] in said


def test_positions_alone_are_even_in_time(tmp_path: Path) -> None:
    rows = "tip_position_mm = [[12, 0, 72], [11, 4, 72], [9, 7, 72]]\n"
    for duration, expected in (("", [0.0, 1.0, 2.0]), ("duration_s = 5.0\n", [0.0, 2.5, 5.0])):
        task: Any = load_scenario(written(tmp_path, f"[trajectory]\n{rows}{duration}")).task
        assert task.times.tolist() == expected


def test_a_view_of_a_run_is_that_of_its_file() -> None:
    view = view_of_run(free())
    assert view.targets is not None
    assert view.limits["minimise"] == "pressure"
    assert np.nanmax(view.targets.distance) < 1e-5 * LENGTH


def test_a_path_that_was_stopped_leaves_no_part_for_a_regulator(tmp_path: Path) -> None:
    scenario = load_scenario(written(tmp_path))
    save(partial_run(scenario, free().steps[:2]), tmp_path / "out")
    assert (tmp_path / "out" / "table.csv").is_file()
    assert not (tmp_path / "out" / "path.csv").exists()
    save(free(), tmp_path / "out")
    assert len((tmp_path / "out" / "path.csv").read_text().splitlines()) == 7
