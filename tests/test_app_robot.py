"""The robot panel: what it says of any dimensions, its section to scale, and that it writes only what was changed."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace
from math import cos, hypot, inf, isclose, sin, sqrt

import pytest
from app_pages import control, drawn, put, use
from hypothesis import given, settings
from hypothesis import strategies as st
from nicegui.testing import User

from softnlp.app.document import Document
from softnlp.app.panels.robot import (
    OWN,
    RULE_FIELDS,
    changed_keys,
    library_table,
    own_table,
    placed_table,
    robot_panel,
    robot_state,
)
from softnlp.app.section_svg import section_svg
from softnlp.app.session import Session
from softnlp.base.errors import InputError, RobotError
from softnlp.base.units import MILLIMETRE
from softnlp.model.fit import free_ranges, mends
from softnlp.model.robot import DIMENSIONS, ROBOTS, Violation, violations
from softnlp.scenario.read import scenario_from_text

KEYS = [d.file_key for d in DIMENSIONS]
WILD = [-1, 0, 1e300, 10**400, float("nan"), float("inf"), 1e-5, 2.5, True, "wide", [1.0], {"a": 1}]


def document(**robot_keys: object) -> Document:
    found = Document()
    for key, value in robot_keys.items():
        found.set("robot", key, value)
    return found


@pytest.mark.parametrize("key", [*KEYS, "minimum_wall_mm"])
@pytest.mark.parametrize("value", WILD, ids=[str(v)[:8] for v in WILD])
def test_a_wild_value_is_said_beside_its_field_just_where_the_reader_refuses_it(key: str, value: object) -> None:
    changed = document(**{key: value})
    state = robot_state(changed)
    if state.robot is not None:
        ET.fromstring(section_svg(state.robot, state.red_chambers()))
    try:
        scenario_from_text(changed.text(), "scenario.toml")
        refused = False
    except InputError as error:
        # A lone change of the sets leaves pressures for others: no matter of the robot's.
        refused = error.table == "robot"
    assert bool(state.said_beside()) == refused


@settings(max_examples=25, deadline=None)
@given(st.sampled_from([k for k in KEYS if k.endswith("_mm")]), st.floats(0.05, 40.0), st.floats(1, 120))
def test_said_is_what_the_reader_refuses_for_any_size(key: str, size: float, angle: float) -> None:
    changed = document(**{key: size, "chamber_angle_deg": angle})
    state = robot_state(changed)
    try:
        read = scenario_from_text(changed.text(), "scenario.toml").robot
    except InputError:
        assert state.said_beside()
    else:
        assert not state.said_beside()
        assert state.robot is not None
        for dimension in DIMENSIONS:
            assert getattr(state.robot, dimension.field) == getattr(read, dimension.field)


def test_every_rule_is_said_beside_a_field_it_depends_on() -> None:
    wide = robot_state(document(chamber_diameter_mm=8.0))
    assert {v.rule for v in wide.broken} == set(RULE_FIELDS)
    assert set(wide.said_beside("chamber_diameter_mm")) == {"chamber_diameter_mm"}
    elsewhere = wide.said_beside("length_mm")  # on which no rule depends
    assert set(elsewhere) == {"outer_diameter_mm"}
    (told,) = elsewhere.values()
    assert told.startswith("3.2 mm too little wall and chambers 3 and 4 overlap and the chambers break through")
    assert told.endswith("bore at most 6.18 mm.")


@settings(max_examples=12)
@given(st.sampled_from(KEYS[:5]), st.floats(0.3, 2.5))
def test_what_mends_a_robot_alone_mends_it_and_no_less_does(key: str, factor: float) -> None:
    """The sizes of the message make a robot that can be made; a little nearer to what was typed it cannot."""
    field = next(d.field for d in DIMENSIONS if d.file_key == key)
    state = robot_state(document(**{key: factor * getattr(ROBOTS["D25L60"], field) / MILLIMETRE}))
    if state.robot is None or state.said:
        return
    found = mends(state.robot, state.minimum_wall)
    assert bool(state.broken) or not found
    for name, value in found.items():
        now = getattr(state.robot, name)
        nearer = value + 1e-4 * (now - value)
        assert not violations(replace(state.robot, **{name: value}), state.minimum_wall)
        assert violations(replace(state.robot, **{name: nearer}), state.minimum_wall)
    words = " ".join(state.said_beside(key).values())
    assert not any(letters in words for letters in ("Eq.", "delta_", "r_c", "_mm"))


@pytest.mark.parametrize("name", ["D25L60", "D10L40", "laparoscope-9"])
def test_between_its_limits_a_size_can_be_made_and_beyond_it_cannot(name: str) -> None:
    robot = ROBOTS[name]
    for field, ends in free_ranges(robot).items():
        now = getattr(robot, field)
        for end in ends:
            if 0 < end < inf:
                assert not violations(replace(robot, **{field: now + 0.999 * (end - now)}))
                assert violations(replace(robot, **{field: end + 1e-3 * (end - now)}))


def test_chambers_are_placed_where_they_have_most_room() -> None:
    table = placed_table({"name": "D25L60", "outer_diameter_mm": 30.0})
    assert table == {
        "name": "D25L60",
        "outer_diameter_mm": 30.0,
        "chamber_circle_diameter_mm": 19.5,
        "chamber_angle_deg": 60.0,
    }
    with pytest.raises(RobotError, match="outer diameter at least"):
        placed_table({"name": "D25L60", "outer_diameter_mm": 18.0})
    metres = robot_state(document(outer_diameter_mm=0.025)).said_beside()
    assert "looks like metres: 25 mm" in metres["outer_diameter_mm"]


@pytest.mark.parametrize("rule", RULE_FIELDS)
def test_a_rule_depends_on_its_fields_and_no_others(rule: str) -> None:
    """Each field, changed a little, moves the number in the rule's message; all others leave it."""
    sizes = {"wall_thickness": 7.0, "chamber_overlap": 7.0, "chambers_inside_wall": 8.0}

    def broken(**changed: object) -> Violation:
        state = robot_state(document(**{"chamber_diameter_mm": sizes[rule], "minimum_wall_mm": 2.0, **changed}))
        return next(v for v in state.broken if v.rule == rule)

    nudged = {
        **{d.file_key: getattr(ROBOTS["D25L60"], d.field) / MILLIMETRE + 0.01 for d in DIMENSIONS if d.scale},
        "chamber_diameter_mm": sizes[rule] + 0.01,
        "chamber_angle_deg": 50.5,
        "chamber_sets": 4,
        "chambers_per_set": 3,
        "minimum_wall_mm": 2.01,
    }
    moved = {key for key, value in nudged.items() if broken(**{key: value}).message != broken().message}
    assert moved == set(RULE_FIELDS[rule])


def test_an_allowed_rule_is_not_said_but_its_chambers_stay_red() -> None:
    state = robot_state(document(allow=["wall_thickness"], minimum_wall_mm=2.0))
    assert state.said_beside() == {}
    assert state.red_chambers() == set(range(6))


@pytest.mark.parametrize("name", ROBOTS)
def test_own_dimensions_are_those_of_the_library(name: str) -> None:
    table = own_table({"name": name, "minimum_wall_mm": 0.7})
    assert table["name"] == OWN
    assert table["minimum_wall_mm"] == 0.7
    for dimension in DIMENSIONS:
        value = table[dimension.file_key] * (dimension.scale or 1)
        assert isclose(value, getattr(ROBOTS[name], dimension.field), rel_tol=1e-15)
    assert library_table(table, name) == {"name": name, "minimum_wall_mm": 0.7}
    assert changed_keys(library_table(table, name)) == []
    assert changed_keys({"name": name, "length_mm": 41.5}) == ["length_mm"]


def circles(svg: str, kind: str) -> list[dict[str, float]]:
    found = ET.fromstring(svg).iter("{http://www.w3.org/2000/svg}circle")
    return [{k: float(c.attrib[k]) for k in ("cx", "cy", "r")} for c in found if c.attrib.get("class") == kind]


@pytest.mark.parametrize("stretch", [1.0, 1.3])
def test_the_section_is_to_scale(stretch: float) -> None:
    D25 = ROBOTS["D25L60"]
    svg = section_svg(D25, {2}, stretch)
    bores, threads = circles(svg, "bore"), circles(svg, "thread")
    assert len(bores) == len(threads) == 6
    scale = threads[0]["r"] / D25.chamber_radius  # the thread keeps its radius at any stretch
    r_ci = sqrt(D25.chamber_radius**2 - (D25.chamber_radius**2 - D25.bore_radius**2) / stretch)
    x_0 = sum(b["cx"] for b in bores) / 6
    y_0 = sum(b["cy"] for b in bores) / 6
    for theta, bore in zip(D25.chamber_angles(), bores, strict=True):
        d = D25.chamber_circle_radius / sqrt(stretch) * scale
        assert hypot(bore["cx"] - x_0 - d * cos(theta), bore["cy"] - y_0 + d * sin(theta)) < 5e-3
        assert bore["r"] == pytest.approx(r_ci * scale, abs=2e-3)
    broken = circles(svg, "broken")
    assert [(c["cx"], c["cy"]) for c in broken] == [(bores[2]["cx"], bores[2]["cy"])]


@pytest.mark.parametrize("name", ROBOTS)
def test_the_scale_bar_is_as_long_as_it_says(name: str) -> None:
    svg = section_svg(ROBOTS[name])
    texts = [t.text or "" for t in ET.fromstring(svg).iter("{http://www.w3.org/2000/svg}text")]
    millimetres = float(next(t for t in texts if t.endswith(" mm")).removesuffix(" mm"))
    start, end = svg.split('<path d="M4 ')[1].split("v4H")[1].split("v-4")[0], 4
    drawn_length = float(start) - end
    assert drawn_length == pytest.approx(
        millimetres * MILLIMETRE * circles(svg, "thread")[0]["r"] / ROBOTS[name].chamber_radius, rel=1e-3
    )


def test_chambers_that_touch_when_stretched_are_red() -> None:
    state = robot_state(Document())
    assert state.robot is not None
    assert not state.red_chambers(1.70)
    assert state.red_chambers(1.72) == set(range(6))


def test_a_name_is_no_markup() -> None:
    named = robot_state(document(**own_table({"name": "D25L60"}) | {"name": '<script>alert("1")</script>'})).robot
    assert named is not None
    assert "<script" not in section_svg(named)


# --- on a page --------------------------------------------------------------------------------------------------------


def test_a_dimension_writes_its_override_and_what_breaks_is_said_beside_it() -> None:
    async def person(user: User, session: Session) -> None:
        assert control(user, "robot.chamber_diameter_mm").value == 4.5
        put(user, "robot.chamber_diameter_mm", 8.0)
        assert session.document.table("robot") == {"name": "D25L60", "chamber_diameter_mm": 8.0}
        assert session.problem is not None
        said = control(user, "robot.chamber_diameter_mm.said")
        assert said.visible
        assert "too little wall" in said.text
        assert "bore at most 6.18 mm" in said.text
        assert control(user, "robot.chamber_diameter_mm").props["error"]
        assert "error-message" not in control(user, "robot.chamber_diameter_mm").props  # once is enough
        await drawn()
        assert control(user, "robot.section").content.count('class="broken"') == 6
        put(user, "robot.chamber_diameter_mm", 5.0)
        assert session.problem is None
        assert not said.visible
        assert "error" not in control(user, "robot.chamber_diameter_mm").props
        await drawn()
        assert 'class="broken"' not in control(user, "robot.section").content
        user.find(marker="robot.reset").click()
        assert session.document.table("robot") == {"name": "D25L60"}
        assert control(user, "robot.chamber_diameter_mm").value == 4.5

    use(robot_panel, person)


def test_a_rule_that_is_allowed_is_a_warning() -> None:
    async def person(user: User, session: Session) -> None:
        put(user, "robot.minimum_wall_mm", 2.0)
        assert session.problem is not None
        assert control(user, "robot.minimum_wall_mm.said").visible
        put(user, "robot.allow.wall_thickness", True)
        assert session.problem is None
        assert session.document.get("robot", "allow") == ["wall_thickness"]
        assert not control(user, "robot.minimum_wall_mm.said").visible
        assert "1.75 mm" in control(user, "robot.warning").text
        put(user, "robot.allow.wall_thickness", False)
        assert session.document.get("robot", "allow") is None

    use(robot_panel, person)


def test_a_robot_of_ones_own_has_every_dimension() -> None:
    async def person(user: User, session: Session) -> None:
        put(user, "robot.name", OWN)
        assert set(session.document.table("robot")) == {"name", *KEYS}
        assert session.problem is None
        put(user, "robot.own_name", "arm 3")
        assert session.scenario is not None
        assert session.scenario.robot.name == "arm 3"
        put(user, "robot.length_mm", None)
        assert "missing" in control(user, "robot.length_mm.said").text
        await drawn()
        assert "No section" in control(user, "robot.section").content
        put(user, "robot.length_mm", 55.0)
        put(user, "robot.name", "D10L40")
        assert session.document.table("robot") == {"name": "D10L40"}

    use(robot_panel, person)


def test_the_section_stretches_with_the_pose() -> None:
    async def person(user: User, session: Session) -> None:
        put(user, "robot.stretched", True)
        before = circles(control(user, "robot.section").content, "bore")[0]["r"]
        session.set_pressure(session.pressure + 1e5)
        await drawn()
        after = circles(control(user, "robot.section").content, "bore")[0]["r"]
        assert after > before * 1.01
        assert float(control(user, "robot.stretched").text.split(",")[1]) > 1.1

    use(robot_panel, person)


@pytest.mark.parametrize("value", [-1, 1e300, *(pytest.param(v, marks=pytest.mark.slow) for v in (0, 1e-300, 999999))])
def test_the_page_outlives_any_number(value: float) -> None:
    async def person(user: User, session: Session) -> None:
        for key in [*KEYS, "minimum_wall_mm"]:
            put(user, f"robot.{key}", value)
        await drawn()
        for key in [*KEYS, "minimum_wall_mm"]:
            put(user, f"robot.{key}", None)
        await drawn()
        assert session.problem is None
        assert "<svg" in control(user, "robot.section").content

    use(robot_panel, person)
