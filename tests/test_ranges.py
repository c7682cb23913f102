"""Each number of a file and of a function is in its physical range, and the noise of a regulator is no pressure."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from broken_files import MATERIAL, PRESSURE, ROBOT, STUDY, scenario

from softnlp import BAR, ContactSettings, InputError, Loads, Material, blocked_force, forward, material, robot
from softnlp.base.ranges import FORCE, RANGES, READING, Range, noise_note, range_of, without_noise
from softnlp.base.ranges import PRESSURE as PRESSURES
from softnlp.cli import main
from softnlp.model.laws import LAWS
from softnlp.model.robot import ROBOTS, check
from softnlp.scenario.compare import compare_task
from softnlp.scenario.read import load_scenario, scenario_from_text
from softnlp.studies.measurements import RobotTask
from softnlp.sweep.measured import load_measured

D25L60, SOFT = robot("D25L60"), material("Ecoflex 00-50")


@pytest.mark.parametrize("limits", RANGES, ids=lambda limits: limits.what)
def test_a_range_holds_its_ends_and_nothing_beyond(limits: Range) -> None:
    beyond = np.nextafter([limits.low - limits.noise, limits.high], [-np.inf, np.inf])
    assert limits.holds([limits.low - limits.noise, limits.high]).all()
    assert not limits.holds([*beyond, np.nan, np.inf, -np.inf]).any()
    limits.require([limits.low * limits.scale, limits.high * limits.scale], "x")
    with pytest.raises(InputError, match="x: expected at least"):
        limits.require(1.001 * limits.high * limits.scale, "x")


ABSURD = {
    "[tip_load]\nforce_N = [{}, 0, 0]": ("[tip_load] force_N: item 1", "at most 10000 N"),
    "[tip_load]\nmoment_Nmm = [0, {}, 0]": ("[tip_load] moment_Nmm: item 2", "at most 1e+06 N mm"),
    "[solver]\naccuracy = {}": ("[solver] accuracy", "at most 0.01 of L_0"),
    "[solver]\ntolerance = {}": ("[solver] tolerance", "at most 0.0001"),
    "[stiffening]\nelongation = {}": ("[stiffening] elongation", "at most 1000"),
    "[corrections]\narea = {}": ("[corrections] area", "at least 0.001 and at most 1000"),
}


@pytest.mark.parametrize("more", ABSURD)
def test_absurd_numbers_are_named_with_their_range(more: str) -> None:
    place, words = ABSURD[more]
    for number in ("1e300", "1e5" if "moment" not in more else "2e6", "-1e300"):
        with pytest.raises(InputError) as caught:
            scenario_from_text(scenario(more=more.format(number)), "f")
        assert str(caught.value).startswith(f"f: {place}: ")
        if not number.startswith("-"):
            assert f"{words}, got {float(number):g}" in str(caught.value)
    scenario_from_text(scenario(more=more.format("0.01" if "solver" not in more else "1e-5")), "f")


BLOCKED = scenario(top='study = "blocked-force"\n', more="[contact]\n")


@pytest.mark.parametrize(
    ("text", "place"),
    [
        (scenario(material=MATERIAL + "density_kg_m3 = NUMBER\n"), "[material] density_kg_m3"),
        (scenario(robot=ROBOT + "length_mm = NUMBER\n"), "[robot] length_mm"),
        (scenario(pressure="[pressure]\nsequence_bar = [[0, 0, NUMBER]]\n"), "[pressure] sequence_bar: row 1 column 3"),
        (
            scenario(pressure="[pressure]\nramp = { sets = [1], steps = 2, to_bar = NUMBER }\n"),
            "[pressure] ramp.to_bar",
        ),
        (BLOCKED + "offset_mm = NUMBER\n", "[contact] offset_mm"),
        (BLOCKED + "offsets_mm = [0, NUMBER]\n", "[contact] offsets_mm: item 2"),
        (BLOCKED + "tip_cap_mm = NUMBER\n", "[contact] tip_cap_mm"),
        (BLOCKED + "target_force_N = NUMBER\n", "[contact] target_force_N"),
        (BLOCKED + "wall_normal = [1, 0, 0]\nwall_point_mm = [0, NUMBER, 0]\n", "[contact] wall_point_mm: item 2"),
        (BLOCKED + "chamber_reaction = NUMBER\n", "[contact] chamber_reaction"),
        (BLOCKED + "closure = 'weighted'\nweight_force_per_N = NUMBER\n", "[contact] weight_force_per_N"),
        (f"study = 'inverse'\n{ROBOT}{MATERIAL}[target]\ntip_position_mm = [[0, 0, NUMBER]]\n", "[target]"),
        (f"study = 'workspace'\n{ROBOT}{MATERIAL}[workspace]\nlevels = 2\nto_bar = NUMBER\n", "[workspace] to_bar"),
        (
            f"study = 'design'\n{ROBOT}{MATERIAL}[choices.robot]\nlength_mm = {{ from = 1, to = NUMBER }}\n"
            "[actuation]\npressure_bar = 1\n[objective]\nmaximise = 'stretch'\n",
            "[choices] robot.length_mm.to",
        ),
        (
            f"study = 'design'\n{ROBOT}{MATERIAL}[choices.robot]\nlength_mm = [50, 60]\n[actuation]\npressure_bar = 1\n"
            "[objective]\nmaximise = 'stretch'\n[requirements]\nblocked_force_N = { at_least = NUMBER }\n",
            "[requirements] blocked_force_N.at_least",
        ),
        (
            "study = 'identify'\n[tensile]\nfile = 'none.csv'\nwidth_mm = NUMBER\n",
            "[tensile] width_mm",
        ),
        (
            f"study = 'identify'\n{MATERIAL}{ROBOT}[measurements]\nfile = 'none.csv'\nfree = ['k_b']\n"
            "[sigma]\ntip_position_mm = NUMBER\n",
            "[sigma] tip_position_mm",
        ),
    ],
    ids=lambda text: text[:40],
)
def test_absurd_numbers_everywhere(text: str, place: str) -> None:
    with pytest.raises(InputError) as caught:
        scenario_from_text(text.replace("NUMBER", "1e300"), "f")
    assert str(caught.value).startswith(f"f: {place}")
    assert "expected at least" in str(caught.value)
    assert "got 1e+300" in str(caught.value)


@pytest.mark.parametrize(
    ("key", "call"),
    [
        ("tip_force", lambda: forward(D25L60, SOFT, [0, 0, 0], loads=Loads(tip_force=(1e300, 0, 0)))),
        ("tip_moment", lambda: forward(D25L60, SOFT, [0, 0, 0], loads=Loads(tip_moment=(0, 0, -1001)))),
        ("gravity", lambda: forward(D25L60, SOFT, [0, 0, 0], loads=Loads(gravity=(0, 0, -1e4)))),
        ("pressures", lambda: forward(D25L60, SOFT, [101 * BAR, 0, 0])),
        ("offset", lambda: blocked_force(D25L60, SOFT, [0, 0, 0], ContactSettings(offset=11.0))),
        ("length", lambda: robot("D25L60", length=101.0)),
        ("density", lambda: material("Ecoflex 00-50", density=1e6)),
        ("E_l_MPa", lambda: Material("S", LAWS["linear"], {"E_l": 1e13})),
    ],
)
def test_the_python_interface_has_the_same_ranges(key: str, call: Callable[[], Any]) -> None:
    with pytest.raises(InputError, match="expected") as caught:
        call()
    assert caught.value.key == key


def test_a_load_that_bends_the_tip_over_ends_without_a_word_of_python(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    one = "[pressure]\nsequence_bar = [[0.5, 0, 0]]\n"
    Path("s.toml").write_text(scenario(pressure=one, more="[tip_load]\nforce_N = [10, 0, 0]\n"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert main(["run", "s.toml", "--json"]) in (0, 3)
    assert capsys.readouterr().err == ""


def test_which_range_a_key_has() -> None:
    assert range_of("contact", "weight_force_per_N") is not FORCE
    assert range_of("workspace", "vary", "tip_load.force_x_N", "from") is FORCE
    assert range_of("workspace", "vary", "robot.length_mm", "levels") is None
    assert range_of("p12_bar") is READING
    assert range_of("material", "constants", "weight") is not range_of("weight")
    assert range_of("note") is None


# --- noise of a regulator that is off ---------------------------------------------------------------------------------

HEADER = "p1_bar,p2_bar,p3_bar"


def test_readings_just_below_zero_are_zero() -> None:
    readings = np.array([[-0.05, -0.003, 0.0], [-0.0, 0.5, np.nan]])
    np.testing.assert_array_equal(without_noise(readings), [[0, 0, 0], [0, 0.5, np.nan]])
    assert not np.signbit(without_noise(readings)).any()
    (note,) = noise_note(readings)
    assert note.startswith("2 pressure readings below 0, the lowest -0.05 bar")
    assert noise_note(np.array([-0.0, 0.0, np.nan])) == ()


@pytest.mark.parametrize("study", ["forward", "blocked-force", "workspace"])
@pytest.mark.parametrize("source", ["file", "sequence"])
def test_noise_in_the_pressures_of_a_study(study: str, source: str, tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text(f"{HEADER}\n-0.003,0,0\n0.5,-0.0001,0\n")
    rows = "sequence_bar = [[-0.003, 0, 0], [0.5, -0.0001, 0]]\n" if source == "sequence" else "file = 'p.csv'\n"
    text = scenario(top=f"study = {study!r}\n", pressure=f"[pressure]\n{rows}")
    found = scenario_from_text(text, tmp_path / "s.toml")
    np.testing.assert_array_equal(found.pressures, [[0, 0, 0], [0.5 * BAR, 0, 0]])
    assert len(found.warnings) == 1
    assert "2 pressure readings below 0, the lowest -0.003 bar" in found.warnings[0]
    (tmp_path / "p.csv").write_text(f"{HEADER}\n-0.051,0,0\n")
    with pytest.raises(InputError, match=r"at least 0 .*, got -0.051 bar; readings down to -0.05 bar count as 0"):
        scenario_from_text(text.replace("-0.003", "-0.051"), tmp_path / "s.toml")


def test_noise_in_measurements(tmp_path: Path) -> None:
    table = tmp_path / "m.csv"
    table.write_text(f"{HEADER},bending_angle_deg,x_mm,y_mm,z_mm\n-0.003,0,0,1,0,0,60\n1,-0.01,0,50,-30,0,50\n")
    asked = tmp_path / "s.toml"
    asked.write_text(f"study = 'identify'\n{ROBOT}{MATERIAL}[measurements]\nfile = 'm.csv'\nfree = ['k_b']\n")
    task = load_scenario(asked).task
    assert isinstance(task, RobotTask)
    np.testing.assert_array_equal(task.measurements[0].pressure, [[0, 0, 0], [BAR, 0, 0]])
    assert [note[:21] for note in task.notes] == ["2 pressure readings b"]
    asked.write_text(STUDY + ROBOT + MATERIAL + PRESSURE)
    compared = compare_task(load_scenario(asked), table)
    np.testing.assert_array_equal(compared.measurements[0].pressure, [[0, 0, 0], [BAR, 0, 0]])
    assert len(compared.warnings) == 1
    assert "the lowest -0.01 bar" in compared.warnings[0]
    measured = load_measured(table, 3)
    np.testing.assert_array_equal(measured.pressure, [[0, 0, 0], [BAR, 0, 0]])
    assert len(measured.notes) == 1
    table.write_text(table.read_text().replace("-0.01", "-0.06"))
    for read in (lambda: load_measured(table, 3), lambda: compare_task(load_scenario(asked), table)):
        with pytest.raises(InputError, match=r"line 3: p2_bar: expected at least 0 .*got -0.06 bar"):
            read()


@pytest.mark.parametrize(("number", "shown"), [(100.0001, "100.0001"), (100.00000000001, "100.00000000001")])
def test_a_number_refused_is_not_shown_as_one_that_is_expected(number: float, shown: str) -> None:
    assert PRESSURES.refusal(number).startswith(f"expected at least 0 and at most 100 bar, got {shown} bar")


# --- a number in another unit -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("sequence_bar = [[0.5, 50, 0]]", "a pressure of 50 bar looks like kPa: 50 kPa are 0.5 bar"),
        ("ramp = { sets = [1], to_bar = 15, steps = 2 }", "a pressure of 15 bar looks like kPa: 15 kPa are 0.15 bar"),
        ("file = 'p.csv'", "a pressure of 100 bar looks like kPa: 100 kPa are 1 bar"),
        ("sequence_bar = [[0.5, 10, 0]]", None),
    ],
)
def test_a_pressure_in_kilopascals_is_told_of(source: str, said: str | None, tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text(f"{HEADER}\n100,0,0\n0.5,1,0\n")
    found = scenario_from_text(scenario(pressure=f"[pressure]\n{source}\n"), tmp_path / "s.toml")
    assert list(found.warnings) == ([said] if said else [])


def test_it_is_told_of_bounds_and_levels_too(tmp_path: Path) -> None:
    text = scenario(top="study = 'workspace'\n", pressure="[workspace]\nlevels = 2\nto_bar = 50\n")
    assert scenario_from_text(text, tmp_path / "s.toml").warnings == (
        "a pressure of 50 bar looks like kPa: 50 kPa are 0.5 bar",
    )


@pytest.mark.parametrize(("length", "said"), [(0.06e-3, "length 0.06 mm"), (60.0, "length 60000 mm"), (1e-3, "")])
def test_a_length_in_another_unit_is_told_of(length: float, said: str) -> None:
    found = check(replace(ROBOTS["D25L60"], length=length))
    assert [words.split(" is outside")[0] for words in found] == ([said] if said else [])
    if said:
        assert found[0].endswith("is outside 1 mm to 1000 mm: check its unit, mm in files")


def test_a_file_name_that_is_blank_or_an_escape_says_so(tmp_path: Path) -> None:
    for source, said in (
        ('file = " "', r"\[pressure\] file: expected a path, got ' '"),
        (r'file = "data\u0041.csv"', r"dataA\.csv: no such file; a backslash .* begins an escape"),
        ("file = 'dataA.csv'", r"dataA\.csv: no such file$"),
    ):
        with pytest.raises(InputError, match=said):
            scenario_from_text(scenario(pressure=f"[pressure]\n{source}\n"), tmp_path / "s.toml")


@pytest.mark.parametrize("separator", [";", "\t"])
def test_columns_that_are_not_separated_by_commas_are_named(separator: str, tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text(f"stretch{separator}stress_MPa\n1,0{separator}0,0\n1,5{separator}0,03\n")
    with pytest.raises(
        InputError, match=r"t\.csv: expected columns separated by commas, and a decimal point .*stretch"
    ):
        scenario_from_text('study = "identify"\n[tensile]\nfile = "t.csv"\n', tmp_path / "s.toml")
