"""Studies of several segments: inverse kinematics with sets to spare, and sweeps of pressures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from segment_files import scenario, segment, solved

from softnlp import BAR, InputError, load_scenario, run_scenario
from softnlp.nlp.reduced import Reduced
from softnlp.studies import blocked_chain, inverse_solver
from softnlp.sweep.read import load_workspace

BASE = segment(own="connector_mm = 3.0")
TOP = segment('name = "D20L40"\nlength_mm = 30.0', own="turn_deg = 60.0")
HANGING = '[gravity]\ndirection = "hanging"\n'


def test_a_pose_that_six_sets_reach_takes_the_least_pressures(tmp_path: Path) -> None:
    """Position and direction are five conditions: the pressures are across the sixth direction, which moves nothing."""
    target = "[target]\ntip_position_mm = [[4.0, 3.0, 65.0]]\ntip_direction = [[0.1, 0.1, 1.0]]\n"
    (found,) = solved(tmp_path, scenario([BASE, TOP], "", HANGING + target, study="inverse"))
    assert (found["status"], found["optimal"]) == ("solved", True)
    np.testing.assert_allclose(found["tip_position_mm"], [4, 3, 65], atol=1e-6 * 63)
    axis = np.array(found["tip_rotation"])[:, 2]
    np.testing.assert_allclose(axis, np.array([0.1, 0.1, 1]) / np.sqrt(1.02), atol=1e-6)
    P = np.array(found["pressure_bar"])
    assert np.all((P > 0) & (P < 1.5))
    h = 1e-3
    rows = [P, *(P + h * e for e in np.eye(6))]
    steps = solved(tmp_path, scenario([BASE, TOP], ", ".join(str(row.tolist()) for row in rows), HANGING))
    np.testing.assert_allclose(steps[0]["tip_position_mm"], [4, 3, 65], atol=1e-6 * 63)  # as a forward run has it
    reached = np.array([[*s["tip_position_mm"], *(60 * np.array(s["tip_rotation"])[:, 2])] for s in steps])
    J = (reached[1:] - reached[0]).T / h
    still = np.linalg.svd(J)[2][-1]
    assert np.linalg.norm(J @ still) < 2e-2 * np.linalg.norm(J, 2)
    assert abs(still @ P) < 2e-3 * np.linalg.norm(P)


@pytest.mark.slow
def test_a_shape_that_a_body_can_take_is_looked_for_where_the_first_ones_cross_themselves(tmp_path: Path) -> None:
    thin = segment('name = "D10L60"', "Ecoflex 00-30")
    target = '[target]\ntip_position_mm = [[10.0, 0.0, 90.0]]\n[solver]\nengine = "newton"\n'
    (found,) = solved(tmp_path, scenario([thin, thin], "", target, study="inverse"))
    assert (found["status"], found["self_intersecting"]) == ("solved", False), found["message"]
    np.testing.assert_allclose(found["tip_position_mm"], [10, 0, 90], atol=1e-6 * 120)


def test_bounds_beyond_the_last_pressure_of_a_segment_are_refused(tmp_path: Path) -> None:
    bounds = "[stiffening]\nelongation = 0.0\n[bounds]\npressure_bar = [0, 50]\n"
    more = "[target]\ntip_position_mm = [[4.0, 3.0, 65.0]]\n" + bounds
    file = tmp_path / "scenario.toml"
    file.write_text(scenario([BASE, TOP], "", more, study="inverse"))
    with pytest.raises(InputError, match=r"scenario.toml: \[bounds\] pressure_bar: expected lower ones: segment 1: "):
        run_scenario(load_scenario(file))


def test_a_sweep_has_the_poses_of_single_runs_and_is_audited(tmp_path: Path) -> None:
    file = tmp_path / "scenario.toml"
    text = scenario([BASE, TOP], "", HANGING + "[workspace]\nsamples = 3\nto_bar = 0.5\n", study="workspace")
    file.write_text(text)
    found = run_scenario(load_scenario(file), folder=tmp_path / "out")
    again = load_workspace(tmp_path / "out")
    assert again.robot.chamber_sets == 6
    assert again.attributes["audited"] >= 1
    rows = ", ".join(str(row.tolist()) for row in found.pressure / BAR)  # type: ignore[union-attr]
    steps = solved(tmp_path, scenario([BASE, TOP], rows, HANGING))
    for tip, step in zip(again.tip_position, steps, strict=True):
        np.testing.assert_allclose(1e3 * tip, step["tip_position_mm"], atol=1e-6 * 63)
    for table in ("[workspace.vary]\nlength_mm = [30.0, 40.0]\n", "[contact]\noffset_mm = 0.0\n"):
        file.write_text(text + table)
        with pytest.raises(InputError, match="takes a robot of one uniform segment so far"):
            load_scenario(file)


def test_the_blocked_force_of_two_halves_is_that_of_the_whole(tmp_path: Path) -> None:
    wall = "[contact]\nclosure = \"free\"\ntip_cap_mm = 2.0\noffset_mm = {}\n[solver]\naccuracy = 1e-8\n"  # fmt: skip
    half = segment()
    for offset, load in ((0.0, ""), (-4.0, '[gravity]\ndirection = "-z"\n')):
        more = load + wall.format(offset)
        rows = "[0.1, 0, 0, 0.1, 0, 0], [0.5, 0, 0, 0.5, 0, 0]"
        two = solved(tmp_path, scenario([half, half], rows, more, "blocked-force"))
        whole = [segment('name = "D25L60"')]
        one = solved(tmp_path, scenario(whole, "[0.1, 0, 0], [0.5, 0, 0]", more, "blocked-force"))
        for a, b in zip(two, one, strict=True):
            assert a["status"] == b["status"]
            assert a["blocked_force_N"] == pytest.approx(b["blocked_force_N"], abs=1e-6)
            np.testing.assert_allclose(a["tip_position_mm"], b["tip_position_mm"], atol=1e-5)
            assert a["gap_mm"] == pytest.approx(b["gap_mm"], abs=1e-5)
            assert a["length_error_mm"] == pytest.approx(b["length_error_mm"], abs=1e-5)
        assert two[1]["blocked_force_N"] > 0.1
        assert two[1]["stable"] is None


def test_a_blocked_force_does_not_depend_on_the_grids_of_its_way(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Alone it is followed on a coarse grid, after another on that one's, else on its own from first contact."""
    wall = '[contact]\nclosure = "free"\n[solver]\nengine = "newton"\n'
    less, more = "[1.5, 0, 0, 0, 0, 0]", "[2.5, 0, 0, 0, 0, 0]"
    alone = solved(tmp_path, scenario([BASE, TOP], more, wall, "blocked-force"))[0]
    after = solved(tmp_path, scenario([BASE, TOP], f"{less}, {more}", wall, "blocked-force"))[1]
    given = solved(tmp_path, scenario([BASE, TOP], more, wall + "intervals = 120\n", "blocked-force"))[0]
    assert given["blocked_force_N"] > 0.1
    monkeypatch.setattr(blocked_chain, "_SAME", 0.0)
    followed = solved(tmp_path, scenario([BASE, TOP], f"{less}, {more}", wall, "blocked-force"))[1]
    for one in (alone, after, followed):
        assert one["status"] == "solved"
        assert one["blocked_force_N"] == pytest.approx(given["blocked_force_N"], rel=3e-6)
        np.testing.assert_allclose(one["tip_position_mm"], given["tip_position_mm"], atol=1e-6 * 93)


def test_the_search_for_a_target_out_of_reach_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = '[target]\ntip_position_mm = [[300.0, 20.0, 20.0]]\n[solver]\nengine = "newton"\n'
    points, at = [], Reduced.at
    monkeypatch.setattr(Reduced, "at", lambda *given: points.append(1) or at(*given))
    found = {}
    for most in (inverse_solver._MOST_WORK, 1):
        monkeypatch.setattr(inverse_solver, "_MOST_WORK", most)
        points.clear()
        (step,) = solved(tmp_path, scenario([BASE, TOP], "", target, study="inverse"))
        assert step["status"] == "out_of_reach"
        assert ("the search was stopped, since it took too long" in step["message"]) == (most == 1)
        found[most] = len(points), step["distance_mm"]
    (all_points, least), (few_points, more) = found.values()
    assert few_points < all_points - 20
    assert least <= more < 300


def test_a_wall_of_segments_stands_also_where_the_last_pressure_has_no_shape(tmp_path: Path) -> None:
    """The wall stands where the free shape goes, of which a thousandth of the pressure tells as much."""
    law = 'model = "soft"\nformula = "0.03 * (stretch - 1) - 0.01 * (stretch - 1) ** 2"\n'
    soft = BASE.split("[segment.material]")[0] + f'[segment.material]\nname = "soft"\n{law}'
    wall = '[contact]\nclosure = "free"\n[solver]\nengine = "newton"\n'
    rows = "[0.02, 0, 0, 0, 0, 0], [9, 0, 0, 0, 0, 0]"
    held, beyond = solved(tmp_path, scenario([soft, TOP], rows, wall, "blocked-force"))
    assert held["blocked_force_N"] > 1e-3
    assert held["wall_normal"] == pytest.approx([1, 0, 0], abs=1e-9)
    assert beyond["status"] in ("unstable_material", "no_equilibrium")
    assert beyond["message"].count("segment 1") == 1


def test_a_wall_takes_closure_free_with_segments(tmp_path: Path) -> None:
    file = tmp_path / "scenario.toml"
    file.write_text(scenario([BASE, TOP], "[0.1, 0, 0, 0, 0, 0]", "[contact]\n", study="blocked-force"))
    with pytest.raises(InputError, match=r"\[contact\] closure: expected 'free' with several segments"):
        load_scenario(file)
    curve = '[contact]\nclosure = "free"\noffsets_mm = [0.0]\n'
    file.write_text(scenario([BASE, TOP], "[0.1, 0, 0, 0, 0, 0]", curve, "blocked-force"))
    with pytest.raises(InputError, match="offsets_mm: expected only with one uniform segment so far"):
        load_scenario(file)
