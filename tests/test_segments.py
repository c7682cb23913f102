"""[[segment]] and dimensions that vary: what is read, what is refused on one line, and what comes out."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from segment_files import scenario, segment, solved

from softnlp import InputError, load_scenario, run_scenario, save, to_dataset, to_json
from softnlp.cli import main
from softnlp.model.segments import SegmentedRobot
from softnlp.results import load_run

SIX = "[0.3, 0.0, 0.0, 0.0, 0.2, 0.0]"
SECOND = segment('name = "D20L40"\nlength_mm = 25.0', "Ecoflex 00-30")
CONE = (
    'name = "D25L60"\nouter_diameter_mm = [25.0, 24.5]\nchamber_wall_mm = {s = [0, 0.5, 1], value = [0.5, 0.45, 0.5]}'
)


def read(folder: Path, text: str) -> SegmentedRobot:
    file = folder / "scenario.toml"
    file.write_text(text)
    robot = load_scenario(file).robot
    assert isinstance(robot, SegmentedRobot)
    return robot


def test_segments_are_read_in_si_and_their_sets_are_counted_through(tmp_path: Path) -> None:
    own = 'connector_mm = 4.0\nlines = "slack"'
    found = read(
        tmp_path, scenario([segment(own=own), segment(own="turn_deg = 60.0"), SECOND], "[" + "0, " * 8 + "0.1]")
    )
    assert [s.robot.length for s in found.segments] == pytest.approx([0.03, 0.03, 0.025])
    assert (found.segments[0].connector, found.segments[0].lines) == (pytest.approx(4e-3), "slack")
    assert found.segments[1].turn == pytest.approx(np.pi / 3)
    assert (found.chamber_sets, found.chambers, found.set_of_chamber[6]) == (9, 18, 3)
    assert found.length == pytest.approx(0.089)
    assert found.material.name == "Ecoflex 00-50 + Ecoflex 00-30"


def test_one_uniform_segment_is_a_robot_like_any_other(tmp_path: Path) -> None:
    file = tmp_path / "scenario.toml"
    file.write_text(scenario([segment()], "[0.3, 0, 0]"))
    asked = load_scenario(file)
    assert not isinstance(asked.robot, SegmentedRobot)
    file.write_text(
        'study = "forward"\n[robot]\nname = "D25L60"\nlength_mm = 30.0\n[material]\nname = "Ecoflex 00-50"\n'
        'model = "mooney-rivlin"\n[pressure]\nsequence_bar = [[0.3, 0, 0]]\n'
    )
    one, other = (to_json(run_scenario(s))["steps"][0] for s in (asked, load_scenario(file)))
    assert one["tip_position_mm"] == other["tip_position_mm"]
    names = ("tip_position_mm", "tip_rotation", "stretch", "bending_angle_deg")
    assert one["segments"] == [{name: one[name] for name in names}]


def test_a_dimension_of_a_robot_may_vary_along_it(tmp_path: Path) -> None:
    text = f'study = "forward"\n[robot]\n{CONE}\n[material]\nname = "Ecoflex 00-50"\nmodel = "mooney-rivlin"\n'
    found = read(tmp_path, text + "[pressure]\nsequence_bar = [[0.3, 0, 0]]\n")
    s, value = found.segments[0].tables["robot.chamber_wall"]
    np.testing.assert_allclose(s, [0, 0.5, 1])
    np.testing.assert_allclose(value, [5e-4, 4.5e-4, 5e-4])
    (step,) = solved(tmp_path, text + "[pressure]\nsequence_bar = [[0.3, 0, 0]]\n")
    assert step["status"] == "solved"
    assert len(step["segments"]) == 1
    assert step["segments"][0]["tip_position_mm"] == step["tip_position_mm"]


REFUSED = [
    (segment("name = \"D25L60\"\nlength_mm = -1.0"), "segment.1.robot.length_mm: expected"),
    (segment("name = \"D25L66\""), "segment.1.robot.name: expected a robot of the library"),
    (segment("name = \"D25L60\"\nlenght_mm = 3.0"), "segment.1.robot.lenght_mm: unknown key; did you mean 'length_mm'"),
    (segment("name = \"D25L60\"\nlength_mm = [30.0, 20.0]"), "segment.1.robot.length_mm: expected a number"),
    (segment(material="Ecoflex 00-51"), "segment.1.material.name: "),
    (segment(own="connector_mm = -2.0"), "segment.1.connector_mm: expected a number of at least 0"),
    (segment(own='lines = "loose"'), "segment.1.lines: expected 'none', 'slack' or 'bonded', got 'loose'"),
    ('[[segment]]\n[segment.robot]\nname = "D25L60"\n', "segment.1.material: missing"),
    (
        segment("name = \"D25L60\"\nouter_diameter_mm = [25.0, 20.0]"),
        "segment.1.robot: at s = 1: wall_thickness: ",
    ),
    (segment("name = \"D25L60\"\nouter_diameter_mm = [25.0]"), "expected a number, or two, at the base and at the tip"),
    (
        segment("name = \"D25L60\"\nouter_diameter_mm = {s = [0, 0.5], value = [25, 25]}"),
        "segment.1.robot.outer_diameter_mm: expected s from 0 to 1, rising, got a list of 2",
    ),
    (
        segment("name = \"D25L60\"\nouter_diameter_mm = {s = [0, 1], value = [25, 25, 25]}"),
        "expected as many values as s has, 2, got 3",
    ),
    (
        segment(f"name = \"D25L60\"\nouter_diameter_mm = {{s = {[k / 60 for k in range(61)]}, value = {[25] * 61}}}"),
        "segment.1.robot.outer_diameter_mm: expected at most 50 fractions of the length, got 61",
    ),
]  # fmt: skip


@pytest.mark.parametrize(("text", "message"), REFUSED)
def test_what_is_wrong_in_a_segment_is_named_by_its_number(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, message: str
) -> None:
    file = tmp_path / "scenario.toml"
    file.write_text(scenario([text], "[0, 0, 0]"))
    assert main(["run", str(file)]) == 2
    said = capsys.readouterr().err
    assert message in said
    assert said.count("\n") == 1
    file.write_text(scenario([segment(), text], "[0, 0, 0, 0, 0, 0]"))
    with pytest.raises(InputError, match=message.split(":")[0].replace("segment.1", "segment.2").replace("[", r"\[")):
        load_scenario(file)


def test_a_robot_beside_segments_and_a_single_table_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "scenario.toml"
    beside = '[robot]\nname = "D25L60"\n[material]\nname = "Ecoflex 00-50"\nmodel = "mooney-rivlin"\n'
    file.write_text(scenario([segment(), segment()], SIX, beside))
    said = r"\[robot\]: expected either \[\[segment\]\] or .*, got both \(and 1 more: --all-errors\)"
    with pytest.raises(InputError, match=said):
        load_scenario(file)
    file.write_text(scenario([segment().replace("[[segment]]", "[segment]")], SIX))
    with pytest.raises(InputError, match=r"expected one table \[\[segment\]\], in two brackets"):
        load_scenario(file)
    file.write_text(scenario([segment(), segment()], "[0.3, 0, 0]"))
    with pytest.raises(InputError, match="expected 6 pressures"):
        load_scenario(file)
    file.write_text(scenario([segment(), segment()], "", study="identify"))
    with pytest.raises(InputError, match=r"study 'identify' takes \[robot\] and \[material\] so far"):
        load_scenario(file)


def test_what_comes_out_is_read_back_with_its_segments(tmp_path: Path) -> None:
    more = "[stiffening]\nelongation = 0.0\n[tip_load]\nforce_N = [0.02, 0.0, 0.0]\n"
    first, second = segment(own="connector_mm = 3.0"), segment(CONE.replace("60", "40"), own="turn_deg = 30")
    file = tmp_path / "scenario.toml"
    file.write_text(scenario([first, second], f"{SIX}, [0, 0, 0, 9, 9, 9]", more))
    run = run_scenario(load_scenario(file))
    document = to_json(run)
    json.dumps(document, allow_nan=False)
    good, bad = document["steps"]
    assert bad["status"] in ("no_equilibrium", "unstable_material")
    assert bad["message"].startswith("segment 2 at s = 0: ")
    assert bad["segments"] is None
    assert len(good["chamber_length_mm"]) == 12
    assert [table["connector_mm"] for table in document["segment"]] == [3.0, 0.0]
    assert document["segment"][1]["robot"]["outer_diameter_mm"] == {"s": [0.0, 1.0], "value": [25.0, 24.5]}
    data = to_dataset(run)
    np.testing.assert_allclose(data["segment_tip_position_mm"][0, 1], good["segments"][1]["tip_position_mm"])
    save(run, tmp_path / "out")
    view = load_run(tmp_path / "out")
    assert isinstance(view.robot, SegmentedRobot)
    body = view.bodies[0]
    assert body is not None
    base, tip = body.parts
    np.testing.assert_allclose(1e3 * base.position[-1], good["segments"][0]["tip_position_mm"], atol=1e-6)
    np.testing.assert_allclose(1e3 * tip.position[-1], good["tip_position_mm"], atol=1e-6)
    gap = tip.position[0] - base.position[-1]
    np.testing.assert_allclose(gap, 3e-3 * base.rotation[-1][:, 2], atol=1e-12)
    assert tip.radii.outer[-1] < tip.radii.outer[0]  # type: ignore[index]
