"""What `python -m benchmarks` and its map of robustness compare is one and the same problem."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from euler_elastica import cantilever as elastica

sys.path.insert(0, str(Path(__file__).parents[1]))  # benchmarks/ is not installed

from benchmarks import __main__ as command
from benchmarks import (
    cantilever,
    peer_pyelastica,
    peer_soromox,
    race,
    robustness_map,
    robustness_report,
    scipy_bvp,
    table,
)
from benchmarks.paper_method import Rod, integrate, solve_pose
from benchmarks.robust_methods import Pose
from benchmarks.statics import CASES, PRESSURES, rod_at
from softnlp import Loads

C = cantilever.cantilever()
EXACT = cantilever.truth(C)


def error(tip: np.ndarray) -> float:
    return cantilever.tip_error(tip, EXACT)


# --- the cantilever --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("load", [0.5, 4.0, 10.0])
def test_the_truth_of_a_rod_that_neither_shears_nor_stretches_is_the_elastica(load: float) -> None:
    stiff = cantilever.Cantilever(2.0, 3.0, 1e11, 1e11, load * 3.0 / 4.0)
    np.testing.assert_allclose(cantilever.truth(stiff) / 2.0, elastica(load)[:2], atol=1e-9)


def test_shear_and_stretch_move_its_tip_as_the_slender_section_says() -> None:
    apart = np.linalg.norm(EXACT / C.length - elastica(cantilever.LOAD)[:2])
    assert 1e-5 < apart < 10 * (C.radius / C.length) ** 2


def test_ours_converges_to_the_truth_with_order_four() -> None:
    coarse, fine = (error(cantilever.ours(n)()) for n in (10, 40))
    assert coarse < 1e-5
    assert np.log2(coarse / fine) / 2 == pytest.approx(4, abs=0.3)


def test_the_paper_s_method_and_scipy_meet_the_truth() -> None:
    assert error(cantilever.paper(40)()) < 1e-7
    assert error(cantilever.bvp(1e-6)()) < 1e-7


def test_a_solid_round_section_has_the_stiffnesses_compared() -> None:
    area, moment = np.pi * C.radius**2, np.pi * C.radius**4 / 4
    np.testing.assert_allclose([C.youngs_modulus * area, C.youngs_modulus * moment, C.shear_modulus * area],
                               [C.EA, C.EI, C.GA], rtol=1e-12)  # fmt: skip


def test_pyelastica_comes_to_rest_at_the_truth_as_its_elements_shrink() -> None:
    pytest.importorskip("elastica")
    coarse, fine = (error(peer_pyelastica.simulate(C, n)) for n in (10, 20))
    assert fine < 0.05
    assert 0.8 < np.log2(coarse / fine) < 2.2


def test_soromox_converges_to_the_truth() -> None:
    pytest.importorskip("soromox")
    coarse, fine = (error(peer_soromox.piecewise_constant(C, n)()) for n in (4, 8))
    assert fine < 3e-3
    assert np.log2(coarse / fine) == pytest.approx(2, abs=0.3)


# --- scipy on a loaded robot -----------------------------------------------------------------------------------------


def test_scipy_solves_the_loaded_rod_of_the_paper_s_method() -> None:
    loads = CASES["tip force and gravity"]
    rod = rod_at(PRESSURES[10], loads)
    theirs = scipy_bvp.solve_pose(rod, loads.tip_force, loads.tip_moment, tolerance=1e-6)
    fine = solve_pose(rod, loads.tip_force, loads.tip_moment, start="arc", steps=160).tip.p
    np.testing.assert_allclose(theirs, fine, atol=1e-7 * rod.length)


def test_its_first_guess_is_the_unloaded_shape() -> None:
    rod: Rod = rod_at(PRESSURES[10], Loads())
    small, *_ = scipy_bvp._scaled(rod, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    guess = scipy_bvp.arc(small, np.linspace(0, 1, 11))
    base = np.concatenate([[0.0, 0.0, small.F_P], small.M_P])
    tip = integrate(small, base, 80)
    np.testing.assert_allclose(guess[:3, -1], tip.p, atol=1e-3)
    np.testing.assert_allclose(guess[3:, -1], np.concatenate([tip.R.ravel(), tip.n, tip.m]), atol=1e-6)


# --- the race and its table ------------------------------------------------------------------------------------------


def entries() -> list[race.Entry]:
    def fails() -> float:
        raise RuntimeError("it broke\nhere")

    return [
        race.Entry("a", "1", lambda: lambda: 2.0, reference=True, units=4),
        race.Entry("b", "1", lambda: lambda: 3.0, judged=False, once=True),
        race.Entry("c", "1", lambda: fails),
        race.Entry("d", "1", lambda: fails, module="no_such_module_anywhere"),
    ]


def test_a_race_has_a_row_for_what_failed_and_what_is_not_there() -> None:
    a, b, c, d = race.race("task", entries(), lambda x: x - 1.0, repeats=3, say=lambda text: None)
    assert (a.error, a.ratio, a.repeats, b.error, b.repeats) == (1.0, 1.0, 3, None, 1)
    assert (c.seconds, c.note) == (None, "failed: it broke")
    assert (d.seconds, d.note) == (None, "not installed: pip install 'softnlp[bench]'")


def test_the_table_says_the_same_as_its_json() -> None:
    rows = race.race("task", entries(), float, repeats=1, say=lambda text: None)
    headings = {"task": table.Heading("solve", "of the length")}
    page = table.markdown(rows, headings, {"processor": "a processor"}, 1.0)
    lines = [line for line in page.splitlines() if line.startswith("| ")][1:]
    assert [line.split(" | ")[0].strip("| *") for line in lines] == ["a", "b", "c", "d"]
    assert "pip install 'softnlp[bench]'" in lines[3]
    whole = json.loads(table.document(rows, headings, {"processor": "a processor"}, 1.0))
    assert [row["tool"] for row in whole["rows"]] == ["a", "b", "c", "d"]
    assert whole["rows"][0]["seconds"] > 0


@pytest.mark.parametrize(("seconds", "shown"), [(None, "–"), (12.34, "12.3 s"), (0.0123, "12.3 ms"), (4e-7, "0.4 µs")])
def test_times_have_a_unit_that_suits_them(seconds: float | None, shown: str) -> None:
    assert table.duration(seconds) == shown


def test_the_command_writes_its_two_files_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = command.Task("blocked force", "step", "force", entries()[:2], float)
    monkeypatch.setattr(command, "TASKS", {"blocked": lambda: made})
    (tmp_path / "page.md").write_text("by hand")
    command.main(["--out", str(tmp_path), "--repeats", "1"])
    assert sorted(path.name for path in tmp_path.iterdir()) == ["page.md", "table.json", "table.md"]
    assert (tmp_path / "page.md").read_text() == "by hand"
    assert "## Blocked force" in (tmp_path / "table.md").read_text()


# --- the map of robustness -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def mild() -> robustness_map.Tried:
    return robustness_map.try_pose(1.0, 0.5, np.array([0.6, 0.0, -0.8]))


@pytest.fixture(scope="module")
def column() -> robustness_map.Tried:
    return robustness_map.try_pose(0.0, 1.5, np.array([0.0, 0.0, -1.0]))


def test_every_way_finds_the_load_path_s_equilibrium_of_a_mild_pose(mild: robustness_map.Tried) -> None:
    assert mild.path_stable
    assert len(mild.outcomes) == 7
    for end in mild.outcomes:
        assert (end.solved, end.same, end.stable, end.words) == (True, True, True, ""), end.method
        assert 1 <= end.iterations < 50


def test_a_straight_robot_pressed_beyond_its_buckling_load_is_unstable(column: robustness_map.Tried) -> None:
    assert column.path_stable is False
    assert all(end.solved and not end.stable for end in column.outcomes if end.same)
    below = robustness_map.try_pose(0.0, 0.97, np.array([0.0, 0.0, -1.0]))
    assert below.path_stable


def test_what_is_no_solution_is_not_counted() -> None:
    ways = robustness_map.methods()
    pose = Pose(np.array([1e5, 0.0, 0.0]), Loads(tip_force=(0.05, 0.0, 0.0)))
    found = ways.multiple_shooting(pose)
    assert ways.residual(found, pose) <= robustness_map.RESIDUAL
    other = Pose(pose.pressure, Loads(tip_force=(0.06, 0.0, 0.0)))
    assert ways.residual(found, other) > 1e-3


def test_single_shooting_solves_the_same_equations() -> None:
    ways = robustness_map.methods()
    pose = Pose(np.array([1e5, 0.0, 0.0]), Loads(tip_force=(0.02, 0.03, -0.02)))
    one, many, squares = (way(pose) for way in (ways.single_shooting, ways.multiple_shooting, ways.paper))
    np.testing.assert_allclose(one.x, many.x, atol=1e-9)
    np.testing.assert_allclose(squares.x, many.x, atol=1e-9)


def test_the_report_counts_what_was_tried(mild: robustness_map.Tried, column: robustness_map.Tried,
                                          tmp_path: Path) -> None:  # fmt: skip
    failed = robustness_map.Outcome("softnlp", False, None, False, 9, "diverged after 12.5 %")
    worse = robustness_map.Tried(1.0, 1.5, (1.0, 0.0, 0.0), None, (*mild.outcomes[:-1], failed))
    flat = robustness_map.Tried(0.0, 0.5, (1.0, 0.0, 0.0), True, mild.outcomes)
    machine = dict.fromkeys(("processor", "cores", "Python", "casadi", "scipy", "date"), "?")
    page = robustness_report.markdown([flat, mild, column, worse], 0.1, machine, 1.0)
    assert "turns back in 1" in page
    assert "| softnlp | 75.0 % | 75.0 %" in page
    assert "| softnlp | 1 | diverged after … % |" in page
    robustness_report.figure([flat, mild, column, worse], 0.1, tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size > 10_000


# --- the documents ---------------------------------------------------------------------------------------------------

DOCS = Path(__file__).parents[1] / "docs"


def test_the_table_of_the_documents_is_made_of_its_json() -> None:
    whole = json.loads((DOCS / "benchmarks" / "table.json").read_text())
    rows = [race.Row(**row) for row in whole["rows"]]
    headings = {name: table.Heading(**heading) for name, heading in whole["tasks"].items()}
    page = table.markdown(rows, headings, whole["machine"], whole["seconds"])
    assert page == (DOCS / "benchmarks" / "table.md").read_text()
    assert len(headings) == len(command.TASKS)


def test_the_numbers_of_robustness_are_made_of_their_json() -> None:
    whole = json.loads((DOCS / "benchmarks" / "robustness.json").read_text())
    poses = [
        robustness_map.Tried(**{**pose, "outcomes": tuple(robustness_map.Outcome(**end) for end in pose["outcomes"])})
        for pose in whole["poses"]
    ]
    page = robustness_report.markdown(poses, whole["buckling_N"], whole["machine"], whole["seconds"])
    assert page == (DOCS / "benchmarks" / "robustness.md").read_text()


def test_the_documents_name_every_task_and_every_way() -> None:
    listed = [line.split(" | ")[0].strip("| ") for line in (DOCS / "robustness.md").read_text().splitlines()]
    assert set(robustness_map.methods().by_name) <= set(listed)
    text = (DOCS / "benchmarks.md").read_text()
    for task in json.loads((DOCS / "benchmarks" / "table.json").read_text())["tasks"]:
        assert f"| {task} |" in text or f"## The {task}" in text, task
