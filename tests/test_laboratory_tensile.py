"""Tensile tests as machines write them: the right modulus or a question, and each wrong reading by its name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from laboratory_files import FOLDER, SPECIMEN, check_of, imported

from softnlp import material, run_scenario
from softnlp.base.errors import InputError
from softnlp.cli import main
from softnlp.cli.example import shipped_folder
from softnlp.laboratory.choices import AskError, settings_from_words
from softnlp.laboratory.signals import break_row
from softnlp.scenario.read import load_scenario
from softnlp.studies.cycles import legs


def modulus(**settings: object) -> float:
    """Return the neo-Hookean modulus [MPa] of what an import gives."""
    file = str(settings.pop("file"))
    found = imported(file, **settings).columns
    reduced = found["stretch"] - found["stretch"] ** -2
    return float(reduced @ found["stress_MPa"] / (reduced @ reduced))


@pytest.mark.parametrize(
    ("file", "settings", "truth"),
    [
        ("utm_units_row_quoted.csv", SPECIMEN, 0.03),
        ("utm_preamble_kN_percent.csv", {}, 0.03),
        ("utm_cyclic.csv", SPECIMEN, 0.03),
        ("utm_cyclic.csv", {**SPECIMEN, "cycle": 2}, 0.026),
        ("utm_cyclic.csv", {**SPECIMEN, "cycle": "unloading"}, 0.0243),
        ("utm_to_failure_four_columns.csv", {}, 0.03),
        ("stretch_stress_no_unit.csv", {"unit__stress": "kPa"}, 0.03),
        ("utm.xlsx", {"gauge_length_mm": 25}, 0.03),
    ],
)
def test_the_modulus_is_the_true_one(file: str, settings: dict[str, object], truth: float) -> None:
    assert modulus(file=file, **settings) == pytest.approx(truth, rel=0.01)


@pytest.mark.parametrize(
    ("file", "asked"),
    [
        ("utm_units_row_quoted.csv", ("gauge_length_mm", "area_mm2")),
        ("utm_cyclic.csv", ("gauge_length_mm", "area_mm2")),
        (
            "stretch_stress_no_unit.csv",
            ("in kPa the shear modulus is 0.03", "unit.stress=kPa", "which no silicone has"),
        ),
        ("utm.xlsx", ("gauge_length_mm",)),
    ],
)
def test_what_is_missing_is_asked_all_at_once(file: str, asked: tuple[str, ...]) -> None:
    with pytest.raises(AskError) as error:
        imported(file)
    assert all(word in str(error.value) for word in asked)


def test_a_stress_is_true_where_a_person_says_so() -> None:
    settings = settings_from_words(["stress=true", "unit.stress=kPa"])
    plain, true = (imported("stretch_stress_no_unit.csv", **more) for more in ({"unit__stress": "kPa"}, settings))
    assert settings == {"stress": "true", "unit.stress": "kPa"}
    assert true.columns["stress_MPa"] * true.columns["stretch"] == pytest.approx(plain.columns["stress_MPa"])


def test_guesses_have_reasons() -> None:
    found = imported("utm_to_failure_four_columns.csv")
    guesses = {guess.key: (guess.value, guess.reason) for guess in found.choices.guesses}
    assert guesses["unit.strain"] == ("1", "ln(1 + strain) is then the column of true strain")
    assert guesses["stretch"][0] == [1.0, 2.0]
    assert found.numbers["break_at_stretch"] == pytest.approx(8.840367892976587)
    assert found.choices.dropped["points after the break"] == 6


def test_cycles_are_told_apart() -> None:
    found = imported("utm_cyclic.csv", **SPECIMEN)
    assert found.numbers["loadings"] == 4
    assert found.numbers["hysteresis"] == pytest.approx(0.2, abs=0.005)
    assert found.numbers["first_cycle_loss"] == pytest.approx(1 - 0.026 / 0.03, abs=0.005)
    assert check_of(imported("utm_cyclic.csv", **SPECIMEN, cycle="all"), "load cycles taken as one test").value == 4


def test_crosshead_and_strain_are_compared() -> None:
    found = imported("utm_preamble_kN_percent.csv", gauge_length_mm=25)
    check = check_of(found, "crosshead strain over the strain taken")
    assert check.verdict == "warned"
    assert check.value == pytest.approx(0.82, abs=0.001)


def machine(tmp_path: Path, header: str, rows: object) -> str:
    """Write a file of a machine and return its name."""
    path = tmp_path / "machine.csv"
    np.savetxt(path, np.asarray(rows), delimiter=",", header=header, comments="", fmt="%.8g")
    return str(path)


STRETCH = np.linspace(1, 2.2, 61)
STRESS = 0.03 * (STRETCH - STRETCH**-2)  # [MPa]


@pytest.mark.parametrize(
    ("name", "strain"),
    [
        ("Log strain (-)", np.log(STRETCH)),
        ("Logarithmic strain [mm/mm]", np.log(STRETCH)),
        ("ln strain (1)", np.log(STRETCH)),
        ("Hencky strain (-)", np.log(STRETCH)),
        ("Green-Lagrange strain (-)", (STRETCH**2 - 1) / 2),
        ("Datalog strain (-)", STRETCH - 1),
    ],
)
def test_the_measure_of_a_strain_is_known_by_its_name(name: str, strain: np.ndarray, tmp_path: Path) -> None:
    file = machine(tmp_path, f"{name},Engineering stress (kPa)", np.column_stack([strain, 1e3 * STRESS]))
    assert modulus(file=file) == pytest.approx(0.03, rel=1e-3)


def test_the_whole_length_of_a_dumbbell_is_warned_of(tmp_path: Path) -> None:
    rows = np.column_stack([25 * (STRETCH - 1), 8 * STRESS])
    name = "gauge length over the width"
    for length, verdict in ((115, "warned"), (25, "passed")):
        preamble = f"Specimen length (mm),{length}\nWidth (mm),4\nThickness (mm),2\n"
        file = machine(tmp_path, f"{preamble}Extension (mm),Load (N)", rows)
        assert check_of(imported(file), name).verdict == verdict
    assert name not in [check.name for check in imported(file, gauge_length_mm=30).checks]


def test_a_setting_against_the_file_is_not_silent(tmp_path: Path) -> None:
    preamble = "Gauge length (mm),25\nWidth (mm),4\nThickness (mm),2\n"
    rows = np.column_stack([25 * (STRETCH - 1), 8 * STRESS])
    file = machine(tmp_path, f"{preamble}Extension (mm),Load (N)", rows)
    check = check_of(imported(file, area_mm2=80), "size that was set over that of the preamble")
    assert "area_mm2 is 80, and the file says 8" in check.message
    assert check_of(imported(file, area_mm2=8), check.name).verdict == "passed"
    with pytest.raises(InputError, match=r"'Load' is in N, got mN.*unit\.Load=mN"):
        imported(file, unit__force="mN")
    assert modulus(file=file, unit__force="N") == pytest.approx(0.03, rel=1e-3)
    assert imported(file, unit__Load="mN", accept="shear-modulus-of-the-data").columns["stress_MPa"][-1] < 1e-4


def test_a_crosshead_is_not_taken_before_an_extensometer(tmp_path: Path) -> None:
    rows = np.column_stack([26 * (STRETCH - 1), STRETCH - 1, 8 * STRESS])
    assert modulus(file=machine(tmp_path, "Crosshead,Extensometer,Load\nmm,mm/mm,N", rows), **SPECIMEN) == (
        pytest.approx(0.03, rel=1e-3)
    )


@pytest.mark.parametrize(
    ("moved", "message"), [(25 * (1 - STRETCH), "the stretch only falls"), (25 * STRETCH + 80, "looks like a slack")]
)
def test_a_position_that_is_no_extension_is_named(moved: np.ndarray, message: str, tmp_path: Path) -> None:
    file = machine(tmp_path, "Position (mm),Load (N)", np.column_stack([moved, 8 * STRESS]))
    with pytest.raises(InputError, match=message):
        imported(file, **SPECIMEN)


def test_two_lengths_are_asked_for(tmp_path: Path) -> None:
    preamble = "Grip to grip separation (mm),50\nGauge length (mm),25\n"
    rows = np.column_stack([50 * (STRETCH - 1), 8 * STRESS])
    file = machine(tmp_path, f"{preamble}Crosshead displacement (mm),Force (N)", rows)
    with pytest.raises(AskError, match=r"gauge_length_mm=50.*gauge_length_mm=25"):
        imported(file, area_mm2=8)
    assert modulus(file=file, area_mm2=8, gauge_length_mm=50) == pytest.approx(0.03, rel=1e-3)


@pytest.mark.parametrize("header", ["Compressive strain (-),Stress (kPa)", "Strain (-),Compressive stress (kPa)"])
def test_compression_is_no_tensile_test(header: str, tmp_path: Path) -> None:
    file = machine(tmp_path, header, np.column_stack([1 - 1 / STRETCH, 1e3 * STRESS]))
    with pytest.raises(InputError, match="of compression"):
        imported(file)


def test_side_by_side_specimens(tmp_path: Path) -> None:
    one = np.column_stack([25 * (STRETCH - 1), 8 * STRESS])
    file = machine(tmp_path, "Extension (mm),Load (N),Extension (mm),Load (N)", np.hstack([one, one * [1, 1.1]]))
    assert imported(file, **SPECIMEN).rows == 122
    assert modulus(file=file, **SPECIMEN, specimen=2) == pytest.approx(0.033, rel=1e-3)


@pytest.mark.parametrize(("area", "gauge"), [(16, 25), (8, 50)])
def test_each_block_has_its_own_sizes(area: float, gauge: float, tmp_path: Path) -> None:
    text = ""
    for number, (wide, long) in enumerate([(8, 25), (area, gauge)], start=1):
        head = f"Specimen {number}\nArea (mm^2),{wide}\nGauge length (mm),{long}\nExtension (mm),Load (N)\n"
        rows = zip(long * (STRETCH - 1), wide * STRESS, strict=True)
        text += head + "".join(f"{moved:.6f},{force:.8f}\n" for moved, force in rows) + "\n"
    file = tmp_path / "blocks.csv"
    file.write_text(text)
    for specimen in ("all", 1, 2):
        assert modulus(file=str(file), specimen=specimen) == pytest.approx(0.03, rel=1e-3)
    checks = imported(str(file), area_mm2=8, gauge_length_mm=25).checks
    assert "warned" in [
        check.verdict for check in checks if check.name == "size that was set over that of the preamble"
    ]
    out = tmp_path / "a"
    assert main(["import", str(file), "--out", str(out)]) == 0
    assert main(["import", f"{out}.import.toml", "--out", str(tmp_path / "b")]) == 0
    assert out.with_suffix(".csv").read_bytes() == (tmp_path / "b.csv").read_bytes()


def test_each_specimen_has_its_own_row_of_results(tmp_path: Path) -> None:
    sizes = [(2, 25), (3, 25), (2.5, 50)]
    table = "".join(f"{k},A-{k},{t},4.0,{gauge}\n" for k, (t, gauge) in enumerate(sizes, start=1))
    head = f"Results Table 1\n,Specimen label,Thickness,Width,Length\n,,(mm),(mm),(mm)\n{table}\n"
    curves = [np.column_stack([gauge * (STRETCH - 1), 4 * t * STRESS]) for t, gauge in sizes]
    names = ",".join(["Extension (mm),Load (N)"] * 3)
    assert modulus(file=machine(tmp_path, head + names, np.hstack(curves))) == pytest.approx(0.03, rel=1e-3)
    alone = machine(tmp_path, f"{head}Specimen 2\nExtension (mm),Load (N)", curves[1])
    with pytest.raises(AskError, match=r"gauge_length_mm.*area_mm2.*specimen="):
        imported(alone)
    assert modulus(file=alone, specimen=2) == pytest.approx(0.03, rel=1e-3)


def test_toe_tare_and_preload(tmp_path: Path) -> None:
    moved = 25 * (STRETCH - 1)
    slack = machine(tmp_path, "Extension (mm),Load (N)", np.column_stack([moved + 3, 8 * STRESS]))
    with pytest.raises(AskError, match="slack specimen"):
        imported(slack, **SPECIMEN)
    taut = imported(slack, gauge_length_mm=25, area_mm2=8, toe=1.12)
    assert taut.columns["stretch"][0] == pytest.approx(1.0)
    tared = machine(tmp_path, "Extension (mm),Load (N)", np.column_stack([moved, 8 * STRESS + 0.05]))
    assert modulus(file=tared, **SPECIMEN, tare=0.05) == pytest.approx(0.03, rel=1e-3)
    assert modulus(file=tared, **SPECIMEN, tare="start") == pytest.approx(0.03, rel=1e-3)
    assert imported(tared, **SPECIMEN, tare=0.05, preload_N=0.005).columns["stretch"][0] == 1.0


def test_a_small_preload_is_warned_of_and_noise_is_not(tmp_path: Path) -> None:
    name, random = "stress at stretch 1, relative to the largest,", np.random.default_rng(2)
    noise = np.clip(random.standard_normal(STRETCH.size), -2, 2) * 0.02 * STRESS.max()
    for more, verdict in ((0.018 * STRESS.max(), "warned"), (noise, "passed")):
        file = machine(tmp_path, "Extension (mm),Load (N)", np.column_stack([25 * (STRETCH - 1), 8 * (STRESS + more)]))
        assert check_of(imported(file, **SPECIMEN), name).verdict == verdict


WRONG = {
    "kN as N": ("Extension (mm),Load (N)", {**SPECIMEN}, "shear modulus of the data is 3e-05"),
    "kPa as MPa": ("Stretch,Stress (MPa)", {}, "stress in kPa"),
    "percent as stretch": ("Stretch,Stress (MPa)", {}, "largest stretch is 120"),
    "area of 1": (
        "Extension (mm),Load (N),Stress (MPa)",
        {"gauge_length_mm": 25},
        "area of the machine's stress is 1 ",
    ),
    "preload": ("Extension (mm),Load (N)", {**SPECIMEN}, "preload that was not tared"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_reading_is_stopped_by_name(name: str, tmp_path: Path) -> None:
    header, settings, message = WRONG[name]
    moved, force = 25 * (STRETCH - 1), 8 * STRESS
    rows = {
        "kN as N": lambda: np.column_stack([moved, force * 1e-3]),
        "kPa as MPa": lambda: np.column_stack([STRETCH, STRESS * 1e3]),
        "percent as stretch": lambda: np.column_stack([100 * (STRETCH[1:] - 1), STRESS[1:]]),
        "area of 1": lambda: np.column_stack([moved, force, force]),
        "preload": lambda: np.column_stack([moved, force + 0.05]),
    }[name]()
    with pytest.raises(AskError, match=message):
        imported(machine(tmp_path, header, rows), **settings)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("true", "true stress"),
        ("cycles", "several load cycles"),
        ("failure", "the points after the break is 5"),
        ("up to failure", "the largest stretch is 8.84, expected 1.1 to 3: the whole test, perhaps to failure"),
        ("area", "left at 1"),
        ("area alone", "left at 1"),
    ],
)
def test_a_wrong_reading_of_a_renamed_file_is_warned_by_name(
    name: str, message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    four = np.loadtxt(FOLDER / "utm_to_failure_four_columns.csv", delimiter=";", skiprows=7)
    cyclic = np.loadtxt(FOLDER / "utm_cyclic.csv", delimiter=",", skiprows=1)
    header, rows = {
        "true": ("strain,stress_MPa", four[four[:, 3] < 1.2][:, [3, 2]]),
        "cycles": ("displacement_mm,force_N", cyclic[:, 1:3]),
        "failure": ("strain,stress_MPa", four[:, 3:5]),
        "up to failure": ("strain,stress_MPa", four[: np.argmax(four[:, 4]) + 1, 3:5]),
        "area alone": ("stretch,stress_MPa", np.column_stack([STRETCH, 8 * STRESS])),
        "area": ("stretch,stress_MPa,force_N", np.column_stack([STRETCH, 8 * STRESS, 8 * STRESS])),
    }[name]
    machine(tmp_path, header, rows)
    sizes = "gauge_length_mm = 25\nwidth_mm = 4\nthickness_mm = 2\n" if name == "cycles" else ""
    text = f'study = "identify"\n[tensile]\nfile = "machine.csv"\nlaws = ["neo-hookean"]\n{sizes}'
    (tmp_path / "test.toml").write_text(text)
    main(["identify", str(tmp_path / "test.toml"), "--out", str(tmp_path / "out")])
    said = capsys.readouterr()
    assert message in said.out + said.err


def test_a_hold_is_warned_of(tmp_path: Path) -> None:
    held = np.column_stack([np.full(200, STRETCH[-1]), STRESS[-1] * (0.6 + 0.4 * np.exp(-np.arange(200) / 40))])
    rows = np.vstack([np.column_stack([STRETCH, STRESS]), held])
    file, name = machine(tmp_path, "Stretch,Stress (MPa)", rows), "share of rows in which the stress relaxes"
    assert check_of(imported(file), name).value == pytest.approx(200 / 261, abs=0.01)
    assert check_of(imported(file, stretch=[1, 2.19]), name).verdict == "passed"
    assert modulus(file=file, stretch=[1, 2.19]) == pytest.approx(0.03, rel=1e-3)
    for known in ("utm_cyclic.csv", "utm_to_failure_four_columns.csv"):
        settings = SPECIMEN if known == "utm_cyclic.csv" else {}
        assert check_of(imported(known, **settings), name).value == 0


def test_legs_and_breaks() -> None:
    rise, fall = np.linspace(0, 1, 30), np.linspace(1, 0, 30)
    assert [leg.rising for leg in legs(np.concatenate([rise, fall, rise, fall]))] == [True, False, True, False]
    assert break_row(np.concatenate([rise, [0.01, 0.0]])) == 29
    assert break_row(rise) == 30


@pytest.mark.parametrize(
    ("header", "factor", "settings"),
    [
        ("Elongation (%),Load (N)", (100, 1), {}),
        ("Elongation,Load (N)", (100, 1), {"unit.Elongation": "%"}),
        ("Travel [mm],Load [kgF]", (25, 1 / 9.80665), {"gauge_length_mm": 25}),
        ("Extension,Load\n(mm),(gf)", (25, 1e3 / 9.80665), {"gauge_length_mm": 25}),
        ("Strain (%),Stress (kgf/cm2)", (100, 1 / 8 / 0.0980665), {}),
        ("Hencky strain (1),Stress (true) (MPa)", (None, None), {}),
        ("Stretch (%),Stress (kPa)", (0, 1e3 / 8), {}),
        ("Extensometer (%),Load (N)", (100, 1), {}),
        ("Nominelle Dehnung,Kraft\nmm,N", (25, 1), {"gauge_length_mm": 25}),
        ("Distance (mm),Force (gf)", (25, 1e3 / 9.80665), {"gauge_length_mm": 25}),
        ("Déplacement (mm),Force (N)", (25, 1), {"gauge_length_mm": 25}),
        ("Déformation (%),Contrainte (kPa)", (100, 1e3 / 8), {}),
        ("Deformation,Force (N)", (25, 1), {"gauge_length_mm": 25, "unit.Deformation": "mm"}),
        ("Desplazamiento (mm),Fuerza (N)", (25, 1), {"gauge_length_mm": 25}),
        ("Allungamento [mm],Carico [N]", (25, 1), {"gauge_length_mm": 25}),
    ],
)
def test_units_of_machines(
    header: str, factor: tuple[float, float], settings: dict[str, object], tmp_path: Path
) -> None:
    along, across = factor
    columns = np.log(STRETCH), STRESS * STRETCH
    if along is not None:
        columns = (along * (STRETCH - 1) if along else 100 * STRETCH), across * 8 * STRESS
    file = machine(tmp_path, header, np.column_stack(columns))
    found = imported(file, **{key.replace(".", "__"): value for key, value in {"area_mm2": 8, **settings}.items()})
    assert found.numbers["shear_modulus_MPa"] == pytest.approx(0.03, rel=1e-3)


@pytest.mark.parametrize("name", ["Deformation", "Dehnung", "Elongation"])
def test_what_may_be_in_mm_or_percent_is_asked(name: str, tmp_path: Path) -> None:
    file = machine(tmp_path, f"{name},Load (N)", np.column_stack([25 * (STRETCH - 1), 8 * STRESS]))
    with pytest.raises(AskError, match=f"column '{name}' has no unit"):
        imported(file, **SPECIMEN)


@pytest.mark.parametrize("unit", ["kgx", "Nn"])
def test_a_unit_that_is_not_known_is_said_with_the_nearest(unit: str, tmp_path: Path) -> None:
    file = machine(tmp_path, f"Extension (mm),Load ({unit})", np.column_stack([25 * (STRETCH - 1), 8 * STRESS]))
    with pytest.raises(AskError, match=f"the unit '{unit}' is not known; did you mean '"):
        imported(file, **SPECIMEN)
    assert modulus(file=file, **SPECIMEN, unit__Load="N") == pytest.approx(0.03, rel=1e-3)
    with pytest.raises(InputError, match="expected a unit of force, got 'kgff'; did you mean 'kgf'"):
        imported(file, **SPECIMEN, unit__Load="kgff")


@pytest.mark.parametrize(
    ("label", "area"), [("Area (mm2)", 8.0), ("Specimen area (cm^2)", 0.08), ("Area (in2)", 8 / 645.16)]
)
def test_an_area_is_read_in_the_unit_of_its_label(label: str, area: float, tmp_path: Path) -> None:
    rows = np.column_stack([25 * (STRETCH - 1), 8 * STRESS])
    file = machine(tmp_path, f"{label},{area:.8g}\nGauge length (mm),25\nExtension (mm),Load (N)", rows)
    assert modulus(file=file) == pytest.approx(0.03, rel=1e-3)


def test_columns_that_are_not_used_are_named(tmp_path: Path) -> None:
    rows = np.column_stack([25 * (STRETCH - 1), 8 * STRESS, 0 * STRETCH])
    found = imported(machine(tmp_path, "Extension (mm),Load (N),Temperature", rows), **SPECIMEN)
    assert found.choices.notes == ["columns that are not used: Temperature"]


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("eps,sig (MPa)", "do not tell what it is; say --as tensile, pressure, tips, force"),
        ("Extension (mm),Load (N),p1 (bar)", "could be tensile or pressure; say --as"),
        ("x_mm,y_mm,z_mm,Fx (N),Fy (N),Fz (N)", "could be tips or force; say --as"),
        ("lambda,P (MPa)", "could be tensile or pressure; say --as"),
    ],
)
def test_kinds_that_are_both_possible_are_asked_for(header: str, message: str, tmp_path: Path) -> None:
    rows = np.column_stack([STRETCH] * len(header.split(",")))
    with pytest.raises(AskError, match=message):
        imported(machine(tmp_path, header, rows))


def test_the_shipped_file_of_a_machine_gives_the_silicone_that_it_was_made_with() -> None:
    fit = run_scenario(load_scenario(shipped_folder() / "identify" / "machine_test.toml"))
    assert len(fit.stretch) == 33  # the first of three cycles
    assert fit.fits["mooney-rivlin"].misfit.rmse == pytest.approx(200, rel=0.3)  # the noise [Pa]
    stretch = np.linspace(1, 1.8, 9)
    found, true = fit.fits["mooney-rivlin"].material, material("Ecoflex 00-50")
    np.testing.assert_allclose(found.engineering_stress(stretch), true.engineering_stress(stretch), atol=200)


def test_a_law_that_does_not_follow_the_data_is_warned_of(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    machine(tmp_path, "stretch,stress_MPa", np.column_stack([STRETCH, STRESS + 0.012 * np.sin(40 * STRETCH)]))
    (tmp_path / "test.toml").write_text('study = "identify"\n[tensile]\nfile = "machine.csv"\nlaws = ["neo-hookean"]\n')
    assert main(["identify", str(tmp_path / "test.toml"), "--out", str(tmp_path / "out")]) == 0
    assert "neo-hookean: the R^2 is 0." in capsys.readouterr().out
