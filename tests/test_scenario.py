"""Scenario files: every key of the format, its default, its unit, and where it arrives in SI."""

from __future__ import annotations

import time
from math import nextafter
from pathlib import Path

import numpy as np
import pytest
from broken_files import MATERIAL, OWN_ROBOT, PRESSURE, ROBOT, scenario
from hypothesis import given
from hypothesis import strategies as st

from softnlp.base.errors import InputError, MaterialError, RobotError
from softnlp.base.units import BAR, DEGREE
from softnlp.model.contact_settings import ClosureWeights, ContactSettings, ContactTask
from softnlp.model.conventions import AS_PRINTED, COEFFICIENT_SETS, REPRODUCTION
from softnlp.model.materials import material
from softnlp.model.numerics import Numerics
from softnlp.model.robot import DIMENSIONS, ROBOTS
from softnlp.scenario.read import Scenario, load_scenario, scenario_from_text

COEFFICIENTS = ("elongation", "bending", "area", "inertia", "bore_fraction", "chamber_reaction")


def read(text: str, folder: Path = Path("folder")) -> Scenario:
    return scenario_from_text(text, folder / "bend.toml")


def blocked(contact: str, more: str = "") -> Scenario:
    return read(scenario(top="study = 'blocked-force'\n", more=f"[contact]\n{contact}\n{more}"))


def with_pressure(text: str, folder: Path = Path("folder")) -> Scenario:
    return read(scenario(pressure=f"[pressure]\n{text}\n"), folder)


def coefficients(found: Scenario) -> tuple[float, ...]:
    return tuple(getattr(found.coefficients, name) for name in COEFFICIENTS)


# --- defaults --------------------------------------------------------------------------------------------------------


def test_defaults_of_everything_optional() -> None:
    found = read(scenario())
    assert found.study == "forward"
    assert found.title == "bend"  # the file's stem
    assert found.path == Path("folder/bend.toml")
    assert found.text == scenario()
    assert found.robot is ROBOTS["D25L60"] or found.robot.name == "D25L60"
    assert found.material.density == 1070.0
    assert found.material.fitted_stretch == (1.0, 2.0)
    assert coefficients(found) == (0.41, 1.23, 1.0, 1.0, 0.0, 1.45)
    assert found.conventions == REPRODUCTION
    assert found.loads.gravity == (0.0, 0.0, 0.0)
    assert found.loads.tip_force == (0.0, 0.0, 0.0)
    assert found.loads.tip_moment == (0.0, 0.0, 0.0)
    assert found.numerics == Numerics("multiple-shooting", None, 1e-6, 1e-8)
    assert found.times is None
    assert found.contact is None
    assert found.warnings == ()


def test_defaults_of_a_blocked_force() -> None:
    found = read(scenario(top="study = 'blocked-force'\n"))
    assert found.study == "blocked-force"
    assert found.contact == ContactSettings(0.0, 0.0, "compliant", None, None, ClosureWeights(None, None, None, None))
    assert found.coefficients.chamber_reaction == 1.45


def test_empty_tables_are_the_defaults() -> None:
    tables = ("stiffening", "corrections", "gravity", "tip_load", "solver")
    found = read(scenario(more="".join(f"[{table}]\n" for table in tables)))
    plain = read(scenario())
    assert coefficients(found) == coefficients(plain)
    assert (found.loads.gravity, found.loads.tip_force) == (plain.loads.gravity, plain.loads.tip_force)
    assert found.numerics == plain.numerics
    assert blocked("").contact == ContactSettings()


def test_the_example_of_the_format_is_read() -> None:
    text = """
title = "D25L60, one chamber pair"
study = "blocked-force"
[robot]
name = "D25L60"
[material]
name = "Ecoflex 00-50"
model = "mooney-rivlin"
density_kg_m3 = 1071
[stiffening]
elongation = 0.41
bending = 1.23
[corrections]
area = 1.0
inertia = 1.0
bore_fraction = 0.0
conventions = "reproduction"
[gravity]
direction = "off"
[tip_load]
force_N = [0.0, 0.0, 0.0]
moment_Nmm = [0.0, 0.0, 0.0]
[pressure]
sequence_bar = [[0.0, 0.0, 0.0], [0.15, 0.0, 0.0]]
[contact]
offset_mm = 0.0
tip_cap_mm = 0.0
closure = "compliant"
chamber_reaction = 1.45
[solver]
intervals = "auto"
accuracy = 1e-6
transcription = "multiple-shooting"
tolerance = 1e-8
"""
    found = read(text)
    assert found.title == "D25L60, one chamber pair"
    assert found.material.density == 1071
    assert found.pressures.tolist() == [[0, 0, 0], [0.15e5, 0, 0]]
    assert coefficients(found) == coefficients(read(scenario()))
    assert found.contact == ContactSettings()


# --- robot -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ROBOTS)
def test_library_robots_by_name_and_in_full_agree(name: str) -> None:
    known = ROBOTS[name]
    values = {d.file_key: getattr(known, d.field) / (d.scale or 1) for d in DIMENSIONS}
    full = "".join(f"{k} = {int(v) if k in ('chamber_sets', 'chambers_per_set') else v!r}\n" for k, v in values.items())
    by_name = read(scenario(robot=f"[robot]\nname = '{name}'\n")).robot
    by_size = read(scenario(robot=f"[robot]\n{full}")).robot
    for dimension in DIMENSIONS:
        assert getattr(by_name, dimension.field) == getattr(known, dimension.field)
        assert getattr(by_size, dimension.field) == pytest.approx(getattr(known, dimension.field), rel=1e-15)
    assert by_name.name == name
    assert by_size.name == "robot"


def test_own_robot_may_have_a_name() -> None:
    made = read(scenario(robot=OWN_ROBOT + "name = 'Arm  of\\tmine'\n".replace("'", '"'))).robot
    assert made.name == "Arm of mine"
    assert made.outer_diameter == 0.025
    assert made.chamber_angle == 50 * DEGREE


def test_single_dimensions_are_overridden() -> None:
    made = read(scenario(robot=ROBOT + "length_mm = 80\n")).robot
    assert made.length == 0.08
    assert made.name == "D25L60 (modified)"
    assert made.outer_diameter == ROBOTS["D25L60"].outer_diameter
    assert read(scenario(robot=ROBOT + "length_mm = 60\n")).robot.name == "D25L60"


def test_allowed_rules_are_warnings() -> None:
    crowded = ROBOT + "chamber_angle_deg = 30\n"
    with pytest.raises(RobotError, match=r"\[robot\].*chamber_overlap"):
        read(scenario(robot=crowded))
    (warning,) = read(scenario(robot=crowded + "allow = ['chamber_overlap', 'wall_thickness']\n")).warnings
    assert warning.startswith("chamber_overlap")
    assert read(scenario(robot=ROBOT + "minimum_wall_mm = 1.75\n")).warnings == ()


# --- material --------------------------------------------------------------------------------------------------------


def test_material_of_the_library() -> None:
    found = read(scenario(material=MATERIAL + "density_kg_m3 = 1000\n")).material
    assert found.name == "Ecoflex 00-50"
    assert found.density == 1000
    assert found.fitted_stretch == (1.0, 2.0)
    assert found.engineering_stress(1.5) == pytest.approx(material("Ecoflex 00-50").engineering_stress(1.5))


def test_material_of_a_file_beside_the_scenario(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text('["My silicone".neo-hookean]\nmu0_MPa = 0.05\n')
    text = scenario(material="[material]\nname = 'My silicone'\nmodel = 'neo-hookean'\nfile = 'mine.toml'\n")
    assert read(text, tmp_path).material.engineering_stress(2.0) == pytest.approx(0.05e6 * (2 - 1 / 4))


def test_material_given_in_the_scenario() -> None:
    inline = "[material]\nname = 'x'\nmodel = 'neo-hookean'\n[material.constants]\nmu0_MPa = 0.05\n"
    assert read(scenario(material=inline)).material.engineering_stress(2.0) == pytest.approx(0.05e6 * (2 - 1 / 4))


def test_material_given_as_a_formula() -> None:
    inline = (
        "[material]\nname = 'x'\nmodel = 'my-law'\nformula = 'mu * (stretch - stretch**-2)'\ndensity_kg_m3 = 990\n"
        "fitted_stretch = [1.0, 1.7]\n[material.constants]\nmu = 0.05\n"
    )
    found = read(scenario(material=inline)).material
    assert found.engineering_stress(2.0) == pytest.approx(0.05e6 * (2 - 1 / 4))
    assert (found.density, found.fitted_stretch) == (990, (1.0, 1.7))


def test_material_errors_keep_their_kind() -> None:
    with pytest.raises(MaterialError) as caught:
        read(scenario(material=MATERIAL.replace("00-50", "00-55")))
    assert (caught.value.source, caught.value.table) == ("folder/bend.toml", "material")


# --- coefficients, loads, numerics -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", COEFFICIENT_SETS)
def test_set_picks_every_coefficient(name: str) -> None:
    found = read(scenario(top="study = 'blocked-force'\n", more=f"[stiffening]\nset = '{name}'\n"))
    expected = {"reproduction": (0.41, 1.23, 1.0, 1.0, 0.0, 1.45), "calibrated": (0.427, 2.51, 1.0, 1.0, 0.369, 0.943)}
    assert coefficients(found) == expected[name]


@pytest.mark.parametrize(
    ("table", "key", "field"),
    [
        ("stiffening", "elongation", "elongation"),
        ("stiffening", "bending", "bending"),
        ("corrections", "area", "area"),
        ("corrections", "inertia", "inertia"),
        ("corrections", "bore_fraction", "bore_fraction"),
        ("contact", "chamber_reaction", "chamber_reaction"),
    ],
)
def test_one_key_overrides_one_coefficient_of_the_set(table: str, key: str, field: str) -> None:
    lines = {"stiffening": "set = 'calibrated'\n", "corrections": "", "contact": ""}
    lines[table] += f"{key} = 0.625\n"
    found = read(
        scenario(top="study = 'blocked-force'\n", more="".join(f"[{name}]\n{line}" for name, line in lines.items()))
    )
    for name in COEFFICIENTS:
        expected = 0.625 if name == field else getattr(COEFFICIENT_SETS["calibrated"], name)
        assert getattr(found.coefficients, name) == expected


def test_stiffening_can_be_switched_off() -> None:
    found = read(scenario(more="[stiffening]\nset = 'calibrated'\nelongation = 0\nbending = 0\n"))
    assert (found.coefficients.elongation, found.coefficients.bending) == (0, 0)


def test_conventions_as_printed() -> None:
    assert read(scenario(more="[corrections]\nconventions = 'as_printed'\n")).conventions == AS_PRINTED


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", ["-", "+"])
def test_gravity_along_an_axis(axis: int, sign: str) -> None:
    found = read(scenario(more=f"[gravity]\ndirection = '{sign}{'xyz'[axis]}'\n")).loads.gravity
    assert found[axis] == float(f"{sign}9.80665")
    assert [g for i, g in enumerate(found) if i != axis] == [0, 0]


@given(st.lists(st.floats(-1e150, 1e150), min_size=3, max_size=3).filter(lambda v: max(map(abs, v)) > 1e-300))
def test_gravity_along_a_vector_is_normalised(vector: list[float]) -> None:
    found = np.array(read(scenario(more=f"[gravity]\ndirection = {vector}\n")).loads.gravity)
    assert np.linalg.norm(found) == pytest.approx(9.80665)
    direction = np.array(vector) / np.max(np.abs(vector))
    assert np.cross(found, direction) == pytest.approx(0, abs=1e-12)
    assert found @ direction > 0


def test_gravity_along_a_vector_of_whole_numbers() -> None:
    assert read(scenario(more="[gravity]\ndirection = [0, 3, 4]\n")).loads.gravity == pytest.approx(
        (0, 5.88399, 7.84532)
    )


def test_tip_load_units() -> None:
    loads = read(scenario(more="[tip_load]\nforce_N = [1, 0.5, -2]\nmoment_Nmm = [10, 0, -3]\n")).loads
    assert loads.tip_force == (1.0, 0.5, -2.0)
    assert loads.tip_moment == pytest.approx((0.010, 0.0, -0.003))
    assert read(scenario(more="[tip_load]\nforce_N = [1, 0, 0]\n")).loads.tip_moment == (0, 0, 0)


def test_solver_settings() -> None:
    found = read(
        scenario(more="[solver]\nintervals = 2000\naccuracy = 1e-2\ntranscription = 'collocation'\ntolerance = 1e-4\n")
    )
    assert found.numerics == Numerics("collocation", 2000, 1e-2, 1e-4)


@pytest.mark.parametrize(("key", "largest"), [("accuracy", 1e-2), ("tolerance", 1e-4)])
def test_solver_limits_are_sharp(key: str, largest: float) -> None:
    assert getattr(read(scenario(more=f"[solver]\n{key} = {largest!r}\n")).numerics, key) == largest
    with pytest.raises(InputError, match=key):
        read(scenario(more=f"[solver]\n{key} = {nextafter(largest, 1)!r}\n"))


# --- pressures -------------------------------------------------------------------------------------------------------


def test_sequence() -> None:
    found = with_pressure("sequence_bar = [[0, 0, 0], [0.15, 0, 1]]")
    assert found.pressures.tolist() == [[0, 0, 0], [15000, 0, 100000]]
    assert found.pressures.dtype == np.float64


def test_ramp_has_equal_steps_from_zero() -> None:
    found = with_pressure("ramp = { sets = [1], to_bar = 1.5, steps = 11 }")
    assert found.pressures[:, 0] == pytest.approx(np.arange(11) * 0.15 * BAR)
    assert not found.pressures[:, 1:].any()
    assert found.times is None


@given(st.integers(2, 50), st.floats(0, 100), st.floats(0, 100), st.permutations([1, 2, 3]), st.integers(1, 3))
def test_ramp_ends_exactly(steps: int, start: float, end: float, order: list[int], count: int) -> None:
    sets = order[:count]
    found = with_pressure(f"ramp = {{ sets = {sets}, from_bar = {start!r}, to_bar = {end!r}, steps = {steps} }}")
    assert found.pressures.shape == (steps, 3)
    for column in range(3):
        expected = np.linspace(start, end, steps) * BAR if column + 1 in sets else np.zeros(steps)
        assert found.pressures[:, column] == pytest.approx(expected)
        assert found.pressures[-1, column] == (end * BAR if column + 1 in sets else 0)


def test_ramp_as_a_table_of_its_own() -> None:
    found = read(scenario(pressure="[pressure.ramp]\nsets = [2, 3]\nto_bar = 1\nsteps = 2\n"))
    assert found.pressures.tolist() == [[0, 0, 0], [0, 1e5, 1e5]]


def test_csv_columns_in_any_order(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("p3_bar, t_s, p1_bar, p2_bar\n0.3, 0, 0.1, 0.2\n0.6, 1.5, 0.4, 0.5\n")
    found = with_pressure("file = 'p.csv'", tmp_path)
    assert found.pressures == pytest.approx(np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]) * BAR)
    assert found.times is not None
    assert found.times.tolist() == [0, 1.5]


@pytest.mark.parametrize(
    "content",
    [
        b"p1_bar,p2_bar,p3_bar\n1,0,0\n",
        b"\xef\xbb\xbfp1_bar,p2_bar,p3_bar\r\n1,0,0\r\n\r\n",  # as spreadsheets write it
        b'"p1_bar","p2_bar","p3_bar"\n"1","0.0"," 0 "\n\n',
        b"\np1_bar,p2_bar,p3_bar\n\n1e0,-0.0,0",
    ],
)
def test_csv_dialects(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_bytes(content)
    found = with_pressure("file = 'p.csv'", tmp_path)
    assert found.pressures.tolist() == [[1e5, 0, 0]]
    assert found.times is None


def test_csv_in_a_folder_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "p.csv").write_text("p1_bar,p2_bar,p3_bar\n1,0,0\n")
    assert with_pressure("file = 'data/p.csv'", tmp_path).pressures.shape == (1, 3)
    assert with_pressure(f"file = '{tmp_path}/data/p.csv'").pressures.shape == (1, 3)


def test_equal_times_are_accepted(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text("t_s,p1_bar,p2_bar,p3_bar\n-1,0,0,0\n0,0,0,0\n0,1,0,0\n")
    found = with_pressure("file = 'p.csv'", tmp_path)
    assert found.times is not None
    assert found.times.tolist() == [-1, 0, 0]


def test_columns_follow_the_robots_sets(tmp_path: Path) -> None:
    sets = 12
    robot = OWN_ROBOT.replace("chamber_sets = 3", f"chamber_sets = {sets}").replace("_per_set = 2", "_per_set = 1")
    robot = robot.replace("chamber_diameter_mm = 4.5", "chamber_diameter_mm = 2")
    rng = np.random.default_rng(1)
    values = rng.uniform(0, 2, (5, sets)).round(3)
    order = rng.permutation(sets)
    rows = [",".join(f"p{k + 1}_bar" for k in order), *(",".join(map(str, row[order])) for row in values)]
    (tmp_path / "p.csv").write_text("\n".join(rows))
    found = read(scenario(robot=robot, pressure="[pressure]\nfile = 'p.csv'\n"), tmp_path)
    assert found.pressures == pytest.approx(values * BAR)


def test_many_rows_are_read_quickly(tmp_path: Path) -> None:
    rows = 100_000
    values = np.random.default_rng(0).uniform(0, 1.2, (rows, 3)).round(4)
    lines = (f"{i},{a},{b},{c}" for i, (a, b, c) in enumerate(values.tolist()))
    (tmp_path / "p.csv").write_text("t_s,p1_bar,p2_bar,p3_bar\n" + "\n".join(lines))
    start = time.perf_counter()
    found = with_pressure("file = 'p.csv'", tmp_path)
    assert time.perf_counter() - start < 5
    assert found.pressures == pytest.approx(values * BAR)


@pytest.mark.parametrize("highest", ["100", "100.0"])
def test_the_highest_pressure_is_accepted(highest: str) -> None:
    assert with_pressure(f"sequence_bar = [[{highest}, 0, 0]]").pressures.max() == 1e7


# --- contact ---------------------------------------------------------------------------------------------------------


def test_contact_units() -> None:
    found = blocked("offset_mm = -5\ntip_cap_mm = 3\nclosure = 'rigid'\nchamber_reaction = 2").contact
    assert found == ContactSettings(offset=-0.005, tip_cap=0.003, closure="rigid")


def test_a_wall_anywhere() -> None:
    found = blocked("wall_point_mm = [1, 2, 3]\nwall_normal = [0, -3, 4]").contact
    assert found is not None
    assert found.wall_point == pytest.approx((1e-3, 2e-3, 3e-3))
    assert found.wall_normal == pytest.approx((0, -0.6, 0.8))


def test_weights_arrive_per_si_unit() -> None:
    found = blocked(
        "closure = 'weighted'\nweight_force_per_N = 2\nweight_moment_per_Nmm = 3\nweight_length_per_mm = 4\n"
        "weight_position_per_mm = 5"
    ).contact
    assert found is not None
    # an error of 1 N mm = 1e-3 N m counts 3, one of 1 mm counts 4 or 5
    weights = found.weights
    assert weights.force == 2
    assert weights.moment == pytest.approx(3 / 1e-3)
    assert weights.length == pytest.approx(4 / 1e-3)
    assert weights.position == pytest.approx(5 / 1e-3)


@pytest.mark.parametrize("closure", ["free", "compliant", "weighted", "rigid"])
def test_closures(closure: str) -> None:
    found = blocked(f"closure = '{closure}'").contact
    assert found is not None
    assert found.closure == closure


def test_a_wall_that_the_tip_starts_behind_is_refused() -> None:
    leaning = "wall_point_mm = [0, 0, 50]\nwall_normal = [0, 0, -1]"
    told = r"\[contact\] wall_normal: the unbent tip at \(0, 0, 60\) mm starts 10 mm behind the wall"
    with pytest.raises(InputError, match=told):
        blocked(leaning)
    one = "[pressure]\nsequence_bar = [[1.5, 0, 0]]\n"
    task, _ = blocked_task(f"{leaning}\noffsets_mm = [-12, -10, 2]", one)  # moved in from in front of the tip
    assert task == ContactTask(offsets=(-0.012, -0.01, 0.002))
    sweep = "[workspace]\nlevels = 2\nto_bar = 1\nvary = { 'robot.length_mm' = { values = [50, 70] } }\n"
    wall = "[contact]\nwall_point_mm = [0, 0, 65]\nwall_normal = [0, 0, -1]\n"
    with pytest.raises(InputError, match=r"the unbent tip at \(0, 0, 70\) mm starts 5 mm behind"):
        read(scenario(top="study = 'workspace'\n", pressure=sweep, more=wall))


def blocked_task(contact: str, pressure: str = PRESSURE) -> tuple[ContactTask | None, int]:
    found = read(scenario(top="study = 'blocked-force'\n", pressure=pressure, more=f"[contact]\n{contact}\n"))
    return found.task, found.step_count


def test_what_is_asked_of_the_wall() -> None:
    one = "[pressure]\nsequence_bar = [[1.5, 0, 0]]\n"
    assert blocked_task("") == (ContactTask(), 3)
    assert blocked_task("mode = 'blocked'") == (ContactTask(), 3)
    assert blocked_task("mode = 'constrained'") == (ContactTask(constrained=True), 3)
    assert blocked_task("target_force_N = 0.3") == (ContactTask(target_force=0.3), 1)
    assert blocked_task("offsets_mm = [0, -5]", one) == (ContactTask(offsets=(0.0, -0.005)), 2)
    task, steps = blocked_task("offset_ramp = { from_mm = 0, to_mm = -30, steps = 4 }", one)
    assert steps == 4
    assert task is not None
    assert task.offsets == pytest.approx((0, -0.01, -0.02, -0.03))
    moved = "wall_point_mm = [-10, 0, 0]\nwall_normal = [1, 0, 0]\noffsets_mm = [0, -5]"
    assert blocked_task(moved, one) == (ContactTask(offsets=(0.0, -0.005)), 2)
    weighted = "closure = 'weighted'\nweight_force_per_N = 1\nweight_sensitivity = true"
    assert blocked_task(weighted) == (ContactTask(weight_sensitivity=True), 3)
    assert read(scenario()).task is None


# --- the file itself -------------------------------------------------------------------------------------------------


def test_load_scenario_keeps_the_text(tmp_path: Path) -> None:
    path = tmp_path / "my bend.toml"
    path.write_bytes(b"\xef\xbb\xbf" + scenario(more="# a note: \u00b5m\n").replace("\n", "\r\n").encode())
    found = load_scenario(str(path))
    assert found.title == "my bend"
    assert found.path == path
    assert found.text == scenario(more="# a note: \u00b5m\n").replace("\n", "\r\n")


def test_title_is_put_on_one_line() -> None:
    assert read(scenario(top='study = "forward"\ntitle = "two\\n  lines, \u00e4"\n')).title == "two lines, \u00e4"


def test_order_of_tables_does_not_matter() -> None:
    text = "study = 'forward'\n" + PRESSURE + MATERIAL + ROBOT
    assert (read(text).pressures == read(scenario()).pressures).all()


@given(st.text())
def test_any_text_is_a_scenario_or_one_line(text: str) -> None:
    with pytest.raises(InputError) as caught:
        scenario_from_text(text, "f.toml")
    assert str(caught.value).isprintable()


@given(st.text(max_size=30), st.sampled_from(["name", "length_mm", "allow", "\u00e9"]))
def test_any_value_is_accepted_or_one_line(value: str, key: str) -> None:
    quoted = '"' + "".join(f"\\U{ord(c):08x}" for c in value if not 0xD800 <= ord(c) < 0xE000) + '"'
    with pytest.raises(InputError) as caught:
        read(scenario(robot=f"[robot]\n'{key}' = {quoted}\n"))
    assert str(caught.value).isprintable()
    assert str(caught.value).startswith("folder/bend.toml: [robot]")


@pytest.mark.parametrize(
    ("given", "warned"),
    [
        ('model = "neo-hookean"\nconstants = { mu0_MPa = 0.03 }', None),
        ('model = "neo-hookean"\nconstants = { mu0_MPa = 30 }', "30 MPa"),
        ('model = "linear"\nconstants = { E_l_MPa = 0.09e6 }', "3e+04 MPa"),
        ('model = "own"\nformula = "a * (stretch - 1)"\nconstants = { a = 9e-8 }', "3e-08 MPa"),
    ],
    ids=["MPa", "kPa", "Pa", "a million times too soft"],
)
def test_constants_in_another_unit_are_warned_of(given: str, warned: str | None) -> None:
    read = scenario_from_text(scenario(material=f'[material]\nname = "batch 7"\n{given}\n'), "s.toml")
    said = [f"the shear modulus of batch 7 at stretch 1 is {warned}, expected 0.001 to 10 MPa"] if warned else []
    assert [warning.split(": ")[0] for warning in read.warnings] == said
