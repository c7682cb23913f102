"""The silicone panel: its three forms, its curves, and where the pose stands on them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from app_pages import control, drawn, put, use
from nicegui import ui
from nicegui.testing import User

from softnlp.app.document import Document
from softnlp.app.live import LivePoses
from softnlp.app.live_view import PoseStretch
from softnlp.app.panels.material import material_panel
from softnlp.app.session import Session
from softnlp.app.silicone import (
    MEASURES,
    OWN_LAW,
    constants_form,
    constants_of_rows,
    fitted_range,
    formula_form,
    inline,
    known_silicones,
    library_form,
    material_figure,
    material_state,
)
from softnlp.app.theme import figure_config, on_dark
from softnlp.model.laws import LAWS
from softnlp.model.materials import load_materials, material, material_from_table
from softnlp.scenario.read import scenario_from_text

SCENARIOS = Path(__file__).parents[1] / "scenarios"
ECOFLEX = "Ecoflex 00-50"
LIBRARY = load_materials()
STRETCHES = np.linspace(1.0, 2.0, 11)


def document(**material_keys: object) -> Document:
    found = Document()
    found.replace("material", material_keys)
    return found


# --- forms ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("silicone", LIBRARY)
def test_own_constants_start_as_the_library_has_them(silicone: str, law: str) -> None:
    changed = document(**constants_form({"name": silicone, "density_kg_m3": 1100.0}, law, LIBRARY[silicone]))
    read = scenario_from_text(changed.text(), "scenario.toml").material
    expected = material(silicone, law)
    assert read.density == 1100.0
    np.testing.assert_allclose(read.engineering_stress(STRETCHES), expected.engineering_stress(STRETCHES), rtol=1e-11)
    assert material_state(changed, LIBRARY, Path()).form == "constants"


def test_an_own_formula_starts_as_neo_hookean() -> None:
    changed = document(**formula_form({"name": ECOFLEX}, LIBRARY[ECOFLEX]))
    read = scenario_from_text(changed.text(), "scenario.toml").material
    assert read.law.name == OWN_LAW
    expected = material(ECOFLEX, "neo-hookean")
    np.testing.assert_allclose(read.true_stress(STRETCHES), expected.true_stress(STRETCHES), rtol=1e-12)


def test_going_back_to_the_library_leaves_what_only_own_forms_have() -> None:
    own = formula_form({"name": ECOFLEX, "density_kg_m3": 1100.0}, LIBRARY[ECOFLEX]) | {"fitted_stretch": [1.0, 1.5]}
    back = library_form(own, LIBRARY[ECOFLEX])
    assert back == {"name": ECOFLEX, "model": "mooney-rivlin", "density_kg_m3": 1100.0}
    assert material_from_table(back).density == 1100.0


def test_a_set_is_chosen_with_the_law_where_it_has_it() -> None:
    second = library_form({"model": "yeoh", "set": "srmd"}, LIBRARY[ECOFLEX])
    assert second == {"name": ECOFLEX, "model": "yeoh", "set": "srmd"}
    assert library_form({"model": "ogden", "set": "srmd"}, LIBRARY[ECOFLEX])["model"] == "mooney-rivlin"
    assert library_form(second, LIBRARY["Ecoflex 00-20"]) == {"name": "Ecoflex 00-20", "model": "yeoh"}
    state = material_state(document(**second), LIBRARY, Path())
    assert state.material is not None
    assert state.material.set == "srmd"
    assert all(other.set == "srmd" for other in state.others.values())


def test_constants_stay_readable_in_a_file_with_a_table_of_them() -> None:
    changed = Document((SCENARIOS / "own_formula.toml").read_text())
    changed.set("material", "constants", inline({"a": 0.2, "b": 0.4}))
    assert "constants = {a = 0.2, b = 0.4}" in changed.text()
    assert "written here" in changed.text()  # its comment
    assert dict(scenario_from_text(changed.text(), "s.toml").material.constants) == {"a": 0.2, "b": 0.4}


@pytest.mark.parametrize(
    ("rows", "constants", "problem"),
    [
        ([("a", 1.0), ("b", -2.0)], {"a": 1.0, "b": -2.0}, ""),
        ([("a", 1.0), ("", None)], {"a": 1.0}, ""),
        ([("a", 1.0), ("", 2.0)], {"a": 1.0}, "a constant has no name"),
        ([("a", 1.0), ("a", 2.0)], {"a": 1.0}, "two constants are called 'a'"),
        ([("a", None)], {}, "the constant 'a' has no value"),
    ],
)
def test_rows_are_constants(rows: list[tuple[str, float | None]], constants: dict[str, float], problem: str) -> None:
    assert constants_of_rows(rows) == (constants, problem)


def test_a_cleared_end_of_the_fitted_range_is_its_default() -> None:
    assert fitted_range(None, None) is None
    assert fitted_range(None, 1.6) == [1.0, 1.6]
    assert fitted_range(1.1, None) == [1.1, 2.0]


OWN = {"name": "x", "model": "own", "formula": "a * (stretch - 1)", "constants": {"a": 0.1}}


@pytest.mark.parametrize(
    ("table", "key"),
    [
        ({"model": "yeoh"}, "name"),
        ({"name": "Ecoflex 99", "model": "yeoh"}, "name"),
        ({"name": ECOFLEX, "model": "yeo"}, "model"),
        ({"name": ECOFLEX, "model": "yeoh", "density_kg_m3": -1.0}, "density_kg_m3"),
        ({"name": ECOFLEX, "model": "yeoh", "constants": {"C10_MPa": 0.1}}, "constants.C20_MPa"),
        ({"name": ECOFLEX, "model": "yeoh", "constants": {"C10_MPa": -0.1, "C20_MPa": 0.0}}, "constants"),
        ({"name": ECOFLEX, "model": "yeoh", "constants": {"C10_MPa": 1e300, "C20_MPa": 1e308}}, "constants.C20_MPa"),
        ({**OWN, "model": "yeoh"}, "formula"),
        ({**OWN, "formula": ""}, "formula"),
        ({**OWN, "formula": "__import__('os').getcwd()"}, "formula"),
        ({**OWN, "formula": "a.real * stretch"}, "formula"),
        ({**OWN, "formula": "a * stretch"}, "formula"),  # not 0 at stretch 1
        ({**OWN, "formula": "a * (stretch - 1) / b"}, "formula"),
        ({**OWN, "formula": "(" * 500 + "a"}, "formula"),
        ({**OWN, "formula": "a * (stretch - 1) " * 500}, "formula"),
        ({**OWN, "formula": "a*(stretch-1)**9**9**9"}, "formula"),
        ({**OWN, "constants": {"a b": 1.0}}, "constants.a b"),
        ({**OWN, "fitted_stretch": [2.0, 1.0]}, "fitted_stretch"),
        ({**OWN, "fitted_stretch": [1.0, float("inf")]}, "fitted_stretch"),
    ],
)
def test_what_is_wrong_is_said_at_its_key_and_the_curves_of_others_stay(table: dict[str, object], key: str) -> None:
    state = material_state(document(**table), LIBRARY, Path())
    assert list(state.said) == [key]
    assert "\n" not in state.said[key]
    assert state.material is None
    assert len(state.others) == (5 if table.get("name") == ECOFLEX else 0)
    figure = material_figure(state.material, state.others, "true_stress", 1.2, False)
    assert len(figure["data"]) == len(state.others) + 1


# --- the figure -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("measure", MEASURES)
def test_the_bold_curve_is_the_chosen_law_and_the_pose_stands_on_it(measure: str) -> None:
    entry = LIBRARY["Ecoflex 00-10"]
    chosen = entry.models["yeoh"]
    figure = material_figure(chosen, entry.models, measure, 1.37, True)
    *curves, pose = figure["data"]
    assert len(curves) == 5
    bold = [c for c in curves if c["line"]["width"] > 2]
    assert [c["name"] for c in bold] == ["<b>Yeoh</b>"]
    expected = getattr(chosen, measure)(np.array(bold[0]["x"])) / 1e3
    np.testing.assert_allclose(bold[0]["y"], expected, rtol=2e-4, atol=1e-3)
    assert pose["x"] == [1.37]
    np.testing.assert_allclose(pose["y"], getattr(chosen, measure)(1.37) / 1e3, rtol=1e-4)
    assert "kPa" in figure["layout"]["yaxis"]["title"]["text"]
    shaded = figure["layout"]["shapes"][0]
    assert (shaded["x0"], shaded["x1"]) == chosen.fitted_stretch


def test_own_constants_are_drawn_beside_those_of_the_library() -> None:
    table = constants_form({"name": ECOFLEX}, "yeoh", LIBRARY[ECOFLEX])
    own = material_from_table({**table, "constants": {"C10_MPa": 0.03, "C20_MPa": 0.0}})
    names = [c["name"] for c in material_figure(own, LIBRARY[ECOFLEX].models, "true_stress", None, False)["data"]]
    assert names[-2:] == ["<b>Yeoh, own</b>", "pose"]
    assert "Yeoh" in names[:-2]


def test_a_curve_without_end_is_no_broken_figure() -> None:
    wild = material_from_table(
        {**OWN, "formula": "a * (exp(700 * (stretch - 1)) - 1)", "fitted_stretch": [1e-300, 1.2]}
    )
    json.dumps(material_figure(wild, {}, "tangent_modulus", 1e6, False), allow_nan=False)
    empty = material_figure(None, {}, "tangent_modulus", None, True)
    assert "null" not in json.dumps(empty["layout"], allow_nan=False), "plotly fails on it when it draws again"


def test_a_name_is_no_markup_and_nothing_leads_out() -> None:
    named = material_from_table({**OWN, "model": "<a href='http://x'>%{y}</a>"})
    curve = material_figure(named, {}, "true_stress", None, False)["data"][0]
    assert "<a" not in curve["name"]
    assert "%{y}" not in curve["name"]
    assert figure_config()["displaylogo"] is False
    assert not figure_config()["showLink"]


# --- the stretch ------------------------------------------------------------------------------------------------------


def test_the_stretch_is_that_of_the_solved_pose() -> None:
    session = Session()
    try:
        stretch = PoseStretch(session)
        for bar in (0.0, 0.6, 1.2):
            session.set_pressure(np.array([bar, 0.5 * bar, 0.0]) * 1e5)
            pose = LivePoses().pose(session.scenario, session.pressure)[0].steps[0].pose
            assert pose is not None
            assert stretch() == pytest.approx(pose.stretch, abs=1e-9)
        session.change("material", "model", "yeoh")
        session.change("stiffening", "elongation", 0.0)
        session.set_pressure(np.array([90.0, 90.0, 90.0]) * 1e5)
        assert stretch() is None  # beyond the limit pressure
    finally:
        session.close()


# --- on a page --------------------------------------------------------------------------------------------------------


def test_forms_are_changed_on_the_page_and_nothing_typed_is_lost() -> None:
    async def person(user: User, session: Session) -> None:
        put(user, "material.model", "ogden")
        put(user, "material.form", "constants")
        table = session.document.table("material")
        assert set(table["constants"]) == {"mu1_MPa", "b1", "mu2_MPa", "b2"}
        put(user, "material.model", "yeoh")
        put(user, "material.constants.C10_MPa", 0.02)
        assert session.document.table("material")["constants"] == {"C10_MPa": 0.02, "C20_MPa": -9.767e-5}
        assert session.scenario.material.constants["C10"] == pytest.approx(2e4)
        put(user, "material.form", "formula")
        put(user, "material.formula", "a * (stretch - 1) * b")
        assert "unknown name 'b'" in control(user, "material.formula").props["error-message"]
        user.find(marker="material.add").click()
        put(user, "material.constant-name", "b", 1)
        put(user, "material.constant-value", 0.5, 1)
        assert session.problem is None
        assert "error" not in control(user, "material.formula").props
        assert float(session.scenario.material.engineering_stress(2.0)) == pytest.approx(0.5 * 0.03091e6)
        put(user, "material.form", "library")
        assert session.document.table("material") == {"name": ECOFLEX, "model": "ogden"}
        put(user, "material.form", "formula")
        assert session.document.table("material")["constants"] == {"a": 0.03091, "b": 0.5}
        assert control(user, "material.constant-name", 1).value == "b"
        put(user, "material.form", "constants")
        assert control(user, "material.constants.C10_MPa").value == 0.02
        assert session.problem is None

    use(material_panel, person)


def test_the_page_offers_the_sets_of_a_silicone() -> None:
    async def person(user: User, session: Session) -> None:
        assert list(control(user, "material.set").options) == ["shi-2025", "srmd"]
        put(user, "material.model", "yeoh")
        put(user, "material.set", "srmd")
        assert session.document.table("material") == {"name": ECOFLEX, "model": "yeoh", "set": "srmd"}
        assert (
            session.scenario.material.constants["C10"] == LIBRARY[ECOFLEX].sets["srmd"].models["yeoh"].constants["C10"]
        )
        put(user, "material.name", "Ecoflex 00-20")
        assert not control(user, "material.set").visible
        assert session.document.table("material") == {"name": "Ecoflex 00-20", "model": "yeoh"}

    use(material_panel, person)


def test_a_silicone_is_said_to_be_wrong_while_the_robot_is_too() -> None:
    async def person(user: User, session: Session) -> None:
        session.change("robot", "length_mm", -1.0)
        put(user, "material.density_kg_m3", -5.0)
        assert session.problem is not None
        assert session.problem.table == "robot"
        assert "positive" in control(user, "material.density_kg_m3").props["error-message"]

    use(material_panel, person)


def test_a_formula_that_is_no_formula_leaves_the_page_alive() -> None:
    async def person(user: User, session: Session) -> None:
        put(user, "material.form", "formula")
        last = session.scenario.material
        for text in ["", "x", "__import__('os').system('true')", "a*" * 400, '"\\"', "stretch\x00", "\ud800"]:
            put(user, "material.formula", text)
            assert session.problem is not None
            assert control(user, "material.formula").props["error"]
            await drawn()
            assert session.scenario.material is last
            assert "No curve" in control(user, "material.caption").text
            json.dumps(control(user, "material.plot").figure, allow_nan=False)
        put(user, "material.formula", "a * (stretch - 1)")
        await drawn()
        assert session.problem is None
        assert "Fitted" in control(user, "material.caption").text

    use(material_panel, person)


def test_pressure_moves_the_point_and_leaves_the_curves() -> None:
    async def person(user: User, session: Session) -> None:
        plot = control(user, "material.plot")
        before, point = plot.figure["data"][0], plot.figure["data"][-1]["x"]
        session.set_pressure(session.pressure + 5e4)
        session.set_pressure(session.pressure + 5e4)
        await drawn()
        assert plot.figure["data"][0] is before
        assert plot.figure["data"][-1]["x"][0] > point[0]
        put(user, "material.measure", "tangent_modulus")
        assert "modulus" in plot.figure["layout"]["yaxis"]["title"]["text"]
        put(user, "material.name", "Dragon Skin 10")
        await drawn()
        assert plot.figure["data"][-1]["y"][0] == pytest.approx(
            session.scenario.material.tangent_modulus(plot.figure["data"][-1]["x"][0]) / 1e3, rel=1e-3
        )

    use(material_panel, person)


def test_the_curves_turn_dark_with_the_page() -> None:
    def page(session: Session) -> None:
        mode = ui.dark_mode().mark("dark")
        material_panel(session)
        on_dark(lambda: turned.append(mode.value))

    turned: list[object] = []

    async def person(user: User, session: Session) -> None:
        light = control(user, "material.plot").figure["layout"]["font"]["color"]
        put(user, "dark", True)
        assert control(user, "material.plot").figure["layout"]["font"]["color"] != light
        assert turned == [True]

    use(page, person)


def test_a_materials_file_beside_the_scenario_is_the_choice() -> None:
    opened = SCENARIOS / "own_materials_file.toml"

    async def person(user: User, session: Session) -> None:
        session.open_path(opened)
        assert session.problem is None
        assert control(user, "material.name").value == "My silicone"
        assert set(known_silicones(session.document, session.folder)) == {"My silicone"}
        await drawn()
        assert control(user, "material.plot").figure["data"][-2]["name"] == "<b>exponential</b>"
        put(user, "material.density_kg_m3", 1000.0)
        assert session.document.get("material", "file") == "my_silicone.toml"
        assert session.scenario.material.density == 1000.0
        put(user, "material.form", "formula")
        session.open((SCENARIOS / "D25L60_one_set.toml").read_text(), "another.toml")
        put(user, "material.form", "formula")
        put(user, "material.form", "library")
        assert session.document.table("material")["name"] == "Ecoflex 00-50"  # nothing of the first scenario is left
        assert control(user, "material.name").options == list(LIBRARY)

    use(material_panel, person)
