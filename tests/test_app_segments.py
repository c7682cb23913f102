"""Several segments on the page: opened, edited one by one, added and taken away, drawn each, the command's numbers."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("nicegui", reason="the extra gui is not installed")

from app_pages import control, drawn, put, use
from nicegui.testing import User

from softnlp.app.examples import examples
from softnlp.app.files import mesh_bytes
from softnlp.app.history import changes
from softnlp.app.live import LivePoses
from softnlp.app.notes import note_words
from softnlp.app.panels.found import segment_rows
from softnlp.app.panels.material import material_panel
from softnlp.app.panels.robot import robot_panel
from softnlp.app.panels.segments import segments_panel
from softnlp.app.part import ALONG, Part, at_base, ends_of, place_of, with_base, with_end
from softnlp.app.pins import pin_of, recalled, stored
from softnlp.app.session import Session
from softnlp.app.view.frame import frame_message, frame_of, layout_of, pieces_message
from softnlp.base.errors import InputError
from softnlp.results import body_of_pose, to_json
from softnlp.scenario.read import scenario_from_text
from softnlp.scenario.run import run_scenario

SCENARIOS = Path(__file__).parents[1] / "scenarios"
TWO, CONE = (SCENARIOS / name for name in ("two_segments.toml", "cone.toml"))


def _segments(session: Session) -> list[dict[str, object]]:
    found: list[dict[str, object]] = tomllib.loads(session.text())["segment"]
    return found


@pytest.mark.parametrize("file", [TWO, CONE], ids=lambda f: f.stem)
def test_the_live_pose_is_that_of_the_command(file: Path) -> None:
    session, live = Session(), LivePoses()
    try:
        session.open_path(file)
        assert session.problem is None
        assert session.scenario is not None
        run, free = live.pose(session.scenario, session.pressure)
        session.set_pressure(session.pressure)
        asked = to_json(run_scenario(scenario_from_text(session.text(), "x.toml")))
        found, wanted = to_json(run)["steps"][0], asked["steps"][-1]
        assert np.allclose(found["tip_position_mm"], wanted["tip_position_mm"], atol=1e-4)
        assert [row[0] for row in segment_rows(run.steps[0])] == list(range(1, len(found["segments"]) + 1))
        for row, part in zip(segment_rows(run.steps[0]), wanted["segments"], strict=True):
            assert np.allclose(row[1:4], part["tip_position_mm"], atol=1e-3)
        loaded = any(np.any(getattr(session.scenario.loads, name)) for name in ("tip_force", "tip_moment", "gravity"))
        assert (free is not None) == loaded
    finally:
        session.close()


def test_every_segment_is_drawn_where_it_is_with_its_own_chambers() -> None:
    scenario = scenario_from_text(TWO.read_text(), "two.toml")
    run, _ = LivePoses().pose(scenario, scenario.pressures[-1])
    pose = run.steps[0].pose
    assert pose is not None
    frame = frame_of(scenario.robot, body_of_pose(pose), scenario.pressures[-1])
    assert len(frame.body.parts) == 2
    first, second = frame.body.pieces
    for tube, part in zip((first, second), pose.segments, strict=True):
        assert np.allclose(tube.position[-1], 1e3 * part.tip_position, atol=1e-6)
    gap = second.position[0] - first.position[-1]
    assert np.isclose(np.linalg.norm(gap), 3.0)  # the connector
    message = pieces_message(scenario.robot)
    assert [piece["before"] for piece in message["pieces"]] == [0, 3]
    assert message["pieces"][0]["sets"][0]["colour"] != message["pieces"][1]["sets"][0]["colour"]
    assert len(frame_message(frame, 1, 1.5)["body"]["parts"]) == 2
    assert len(layout_of(scenario.robot)) == 2
    pin = pin_of(run, _state(), "two", [])
    (again,) = recalled(stored([pin]))
    assert np.allclose(again.tube.parts[1].position, second.position, atol=1e-4)
    assert layout_of(again.robot) == layout_of(scenario.robot)


def test_the_radii_of_a_cone_fall_along_it() -> None:
    scenario = scenario_from_text(CONE.read_text(), "cone.toml")
    run, _ = LivePoses().pose(scenario, scenario.pressures[0])
    pose = run.steps[0].pose
    assert pose is not None
    frame = frame_of(scenario.robot, body_of_pose(pose), scenario.pressures[0])
    (tube,) = frame.body.pieces
    outer = np.asarray(tube.radii.outer)
    assert outer.shape == (len(tube.position),)
    assert np.all(np.diff(outer) < 0)
    radii = frame_message(frame, 1, 1.5)["body"]["parts"][0]["radii"]
    assert len(radii[0]) == len(tube.position)


def _state():  # type: ignore[no-untyped-def]
    session = Session()
    try:
        return session.state()
    finally:
        session.close()


def test_meshes_have_every_segment_and_a_mould_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("manifold3d", reason="the extra mesh is not installed")
    scenario = scenario_from_text(TWO.read_text(), "two.toml")
    run, _ = LivePoses().pose(scenario, scenario.pressures[0])
    assert mesh_bytes(scenario.robot, run.steps[0].pose, tmp_path / "two.glb").startswith(b"glTF")
    with pytest.raises(InputError, match="one uniform segment"):
        mesh_bytes(scenario.robot, None, tmp_path / "mould.stl")


def test_panels_show_and_change_the_chosen_segment_alone() -> None:
    def build(session: Session) -> None:
        session.open_path(TWO)
        part = Part(session)
        segments_panel(part)
        robot_panel(part)
        material_panel(part)

    async def person(user: User, session: Session) -> None:
        assert control(user, "robot.length_mm").value == 40
        put(user, "segment.choice", 1)
        await drawn()
        assert control(user, "material.name").value == "Ecoflex 00-30"
        put(user, "robot.length_mm", 33.0)
        put(user, "segment.turn_deg", 30.0)
        put(user, "material.name", "Ecoflex 00-50")
        assert session.problem is None
        first, second = _segments(session)
        assert second["robot"] == {"name": "D20L40", "length_mm": 33.0}
        assert second["turn_deg"] == 30.0
        assert second["material"]["name"] == "Ecoflex 00-50"  # type: ignore[index]
        assert first["robot"] == {"name": "D25L40"}
        put(user, "segment.choice", 0)
        await drawn()
        put(user, "segment.connector_mm", -1.0)
        assert "at least 0" in control(user, "segment.connector_mm").props["error-message"]
        put(user, "segment.connector_mm", 4.0)
        put(user, "segment.lines", "none")
        assert "lines" not in _segments(session)[0]
        put(user, "robot.lumen_diameter_mm", 30.0)
        assert session.problem is not None
        assert place_of(session.problem) == (0, "robot", "lumen_diameter_mm")
        put(user, "robot.lumen_diameter_mm", None)
        assert session.problem is None
        put(user, "segment.vary", "outer_diameter_mm")
        await drawn()
        put(user, "segment.outer_diameter_mm.tip", 24.0)
        assert _segments(session)[0]["robot"]["outer_diameter_mm"] == [25.0, 24.0]  # type: ignore[index]
        put(user, "robot.outer_diameter_mm", 26.0)
        assert _segments(session)[0]["robot"]["outer_diameter_mm"] == [26.0, 24.0]  # type: ignore[index]
        assert session.problem is None
        user.find(marker="segment.outer_diameter_mm.hold").click()
        await drawn()
        assert _segments(session)[0]["robot"]["outer_diameter_mm"] == 26.0  # type: ignore[index]

    use(build, person)


def test_a_robot_becomes_two_segments_and_one_again() -> None:
    session = Session()
    try:
        text, part = session.text(), Part(session)
        first = session.state()
        part.duplicate()
        assert session.problem is None
        assert len(_segments(session)) == 2
        assert session.scenario is not None
        assert session.scenario.robot.chamber_sets == len(session.pressure) == 6
        assert session.document.get("pressure", "sequence_bar") == [[0.8, 0.0, 0.0, 0.0, 0.0, 0.0]]
        assert "segment 1 added" in "; ".join(changes(first, session.state()))
        session.set_pressure(np.array([1e4, 2e4, 3e4, 4e4, 5e4, 6e4]))
        part.choose(0)
        assert part.pressure.tolist() == [1e4, 2e4, 3e4]
        part.duplicate()  # between the two
        assert session.pressure.tolist() == [1e4, 2e4, 3e4, 0, 0, 0, 4e4, 5e4, 6e4]
        part.remove()
        assert session.pressure.tolist() == [1e4, 2e4, 3e4, 4e4, 5e4, 6e4]
        part.choose(1)
        part.remove()
        assert session.scenario.robot.name == "D25L60"
        assert tomllib.loads(session.text())["robot"] == tomllib.loads(text)["robot"]
        session.restore(first)
        assert session.text() == text
    finally:
        session.close()


def test_what_varies_is_edited_at_its_ends() -> None:
    assert at_base("outer_diameter_mm", [25.0, 20.0]) == 25.0
    assert at_base("allow", ["wall_thickness"]) == ["wall_thickness"]
    table = {"s": [0.0, 0.5, 1.0], "value": [1.0, 2.0, 3.0]}
    assert ends_of(table) == (1.0, 3.0)
    assert with_end(table, -1, 4.0) == {"s": [0.0, 0.5, 1.0], "value": [1.0, 2.0, 4.0]}
    assert with_base(5.0, 6.0) == 6.0
    assert with_base([5.0, 6.0], 7.0) == [7.0, 6.0]
    assert "length_mm" not in ALONG


def test_tabs_say_what_they_cannot_do_with_segments() -> None:
    session = Session()
    try:
        session.open_path(TWO)
        for study in ("blocked-force", "workspace", "inverse"):
            session.choose(study)
            assert note_words(session, study, study) == ""
        for study, name in (("design", "design"), ("identify", "identify"), (None, "compare"), (None, "sensitivity")):
            if study is not None:
                session.choose(study)
            assert "does not take a robot of several segments" in note_words(session, study, name)
        session.open_path(SCENARIOS / "contact" / "sphere.toml")
        assert "does not take obstacles" in note_words(session, None, "sensitivity")
        assert note_words(session, "forward", "kinematics") == ""
    finally:
        session.close()
    assert {"two_segments", "cone", "contact/sphere"} <= set(examples())
