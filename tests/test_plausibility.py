"""Tensile data of the wrong quantity are told by their numbers, and right ones pass."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from softnlp import fit_tensile, load_materials, material
from softnlp.cli import main
from softnlp.scenario.read import load_scenario
from softnlp.studies.check import Check, messages
from softnlp.studies.measurements import TensileTask
from softnlp.studies.plausibility import agreed, area_check, curve_checks, law_checks

STRETCH = np.linspace(1, 3, 41)
SILICONES = [(s, law) for s, entry in load_materials().items() for law in entry.models if law != "linear"]
SPECIMEN = "gauge_length_mm = 30\nwidth_mm = 6\nthickness_mm = 2"


def neo_hookean(x: Any, modulus: float = 0.031) -> Any:
    """Return engineering stress [MPa]."""
    return modulus * (x - x**-2)


def verdict(stretch: Any, stress: Any) -> str:
    checks = curve_checks(np.asarray(stretch, float), np.asarray(stress, float))
    return next((v for v in ("failed", "warned") if messages(checks, v)), "passed")


@pytest.mark.parametrize(("silicone", "law"), SILICONES)
@pytest.mark.parametrize("highest", [1.3, 2.0])
def test_right_tests_of_every_silicone_pass_and_wrong_ones_do_not(silicone: str, law: str, highest: float) -> None:
    x = np.linspace(1, highest, 41)
    stress = np.asarray(material(silicone, law).engineering_stress(x))
    assert verdict(x, stress) == "passed"
    assert verdict(x[8:], stress[8:]) == "passed"  # cut off
    assert verdict(x[2:], stress[2:]) != "failed"
    noise = np.max(stress) * np.random.default_rng(4).standard_normal(x.size)
    assert verdict(x, stress + 0.02 * noise) != "failed"
    for shift in (0.5, 1.0, 2.0):
        assert verdict(x + shift, stress) == "failed"
    assert verdict(x, stress + 0.1 * np.max(stress)) == "failed"
    assert verdict(100 * (x - 1)[1:], stress[1:]) == "failed"
    assert verdict(100 * x, stress) == "failed"
    assert verdict((x - 1)[1:], stress[1:]) == "failed"
    assert verdict(1 + (x - 1) / 1000, stress) == "failed"
    for factor in (1e3, 1e6, 1e-3):
        assert verdict(x, factor * stress) in ("failed", "warned")
    if highest == 2.0 and law != "ogden":  # whose bending may hide it
        assert verdict(x, stress * x) == "warned"


@pytest.mark.parametrize("modulus", [0.0025, 0.08, 1.9])
def test_soft_and_stiff_ones_with_noise_pass(modulus: float) -> None:
    stress = 1e6 * neo_hookean(STRETCH, modulus)
    random = np.random.default_rng(2)
    for part in (0.01, 0.05, 0.1):
        assert verdict(STRETCH, stress + part * np.max(stress) * random.standard_normal(41)) != "failed"
    assert verdict(STRETCH, stress) == "passed"


@pytest.mark.parametrize(("silicone", "law"), SILICONES)
def test_no_silicone_looks_slack_and_slack_is_measured(silicone: str, law: str) -> None:
    random = np.random.default_rng(3)
    x = np.linspace(1, 2, 31)
    made = material(silicone, law)
    for slack in (0.0, 0.08, 0.2):
        stress = np.asarray(made.engineering_stress(np.maximum(x - slack, 1)))
        stress += 0.01 * np.max(stress) * random.standard_normal(x.size)
        checks = {c.name.split(",")[0]: c for c in curve_checks(x, stress)}
        value, verdict = (checks["slack"].value, checks["slack"].verdict) if "slack" in checks else (0.0, "passed")
        assert value == pytest.approx(slack, abs=0.035)
        assert verdict == ("failed" if slack > 0.1 else "warned" if slack else "passed")
        assert not any("true stress" in c.message for c in checks.values())


def test_noise_is_not_named_as_something_else() -> None:
    """20 kPa on a silicone of 58 kPa at a stretch of 2: the growth at 1 cannot be told from it."""
    x = np.linspace(1, 2, 21)
    for seed in range(8):
        noise = 2e4 * np.random.default_rng(seed).standard_normal(x.size)
        said = messages(curve_checks(x, 1e6 * neo_hookean(x) + noise), "warned")
        assert not any("true stress" in words or "inf" in words for words in said)


def test_two_checks_that_one_mistake_explains_fail_together() -> None:
    low, high = (
        Check("cross-section", 1.0, (2, 3), (0, 9), ""),
        Check("shear modulus of the data", 5.0, (1, 2), (0, 9), ""),
    )
    assert [c.verdict for c in (low, high)] == ["warned", "warned"]
    assert [c.verdict for c in agreed((low, high))] == ["failed", "failed"]
    assert [c.verdict for c in agreed((low, replace(high, value=0.5)))] == ["warned", "warned"]
    assert [c.verdict for c in agreed((low, replace(high, value=1.5)))] == ["warned", "passed"]


def test_a_stiff_rubber_of_some_megapascals_is_only_warned_of() -> None:
    (check,) = (c for c in curve_checks(STRETCH, 1e6 * neo_hookean(STRETCH, 6.0)) if c.verdict != "passed")
    assert check.verdict == "warned"
    assert check.name == "shear modulus of the data"
    assert check.value == pytest.approx(6.0)


def test_unloadings_are_counted_and_repeats_are_none() -> None:
    stress = 1e6 * neo_hookean(STRETCH)
    for parts, count in (([1], 0), ([1, 1, 1], 0), ([1, -1], 1), ([1, -1, 1, -1, 1], 2)):
        x, y = (np.concatenate([column[::step] for step in parts]) for column in (STRETCH, stress))
        found = next(c for c in curve_checks(x, y) if c.name == "number of unloadings")
        assert (found.value, found.verdict) == (count, "warned" if count else "passed")


def test_a_check_says_its_number_its_range_and_what_is_likely() -> None:
    check = Check("width", 3.0, (1, 2), (0, 4), "looks like cm", "mm")
    assert check.message == "the width is 3 mm, expected 1 to 2 mm: looks like cm"
    assert Check("width", float("nan"), (1, 2), (0, 4), "").verdict == "failed"
    assert Check("width", 2.0, (1, 2), (0, 4), "").message == ""
    assert "expected at least 5" in Check("width", 1.0, (5, float("inf")), (5, float("inf")), "").message
    assert area_check(1.0).verdict == "warned"
    stress = 1e6 * neo_hookean(STRETCH)
    modulus, fit = law_checks(6e7, -0.5, STRETCH, stress)[::-1]
    assert (fit.verdict, modulus.verdict) == ("failed", "failed")
    assert modulus.value == pytest.approx(20)


# --- scenarios --------------------------------------------------------------------------------------------------------


def identified(
    folder: Path, capsys: pytest.CaptureFixture[str], columns: str, data: Any, table: str = ""
) -> tuple[int, Any, str]:
    """Return exit status, document (None where there is none) and what is on standard error."""
    rows = (",".join(f"{value:.6g}" for value in row) for row in zip(*data, strict=True))
    (folder / "t.csv").write_text("\n".join([columns, *rows]) + "\n")
    (folder / "t.toml").write_text(
        f'study = "identify"\n[tensile]\nfile = "t.csv"\nlaws = ["linear", "neo-hookean", "yeoh"]\n{table}\n'
    )
    status = main(["identify", str(folder / "t.toml"), "--json"])
    shown = capsys.readouterr()
    return status, json.loads(shown.out) if shown.out else None, shown.err


X = np.linspace(1, 2, 41)
Y = neo_hookean(X)
D, F = 30 * (X - 1), 12 * Y
WRONG = {
    "percent": ("stretch,stress_MPa", (100 * (X - 1)[1:], Y[1:]), "", 3, "largest stretch is 100", "strain_percent"),
    "stretch in percent": ("stretch,stress_MPa", (100 * X, Y), "", 3, "largest stretch is 200", "divide by 100"),
    "strain": ("stretch,stress_MPa", (2 * (X - 1)[1:], Y[1:]), "", 3, "smallest stretch is 0.05", "column strain"),
    "strain from 0": ("stretch,stress_MPa", (2 * (X - 1), Y), "", 2, "line 2: stretch", "column strain"),
    "strain below 1": ("stretch,stress_MPa", ((X - 1)[1:], Y[1:]), "", 2, "above 1", "1 + strain"),
    "stretch as strain": ("strain,stress_MPa", (X, Y), "", 3, "reduced stress at the smallest", "column strain"),
    "kPa": ("stretch,stress_MPa", (X, 1e3 * Y), "", 3, "shear modulus of the data is 31 MPa", "stress_kPa"),
    "Pa": ("stretch,stress_MPa", (X, 1e6 * Y), "", 3, "shear modulus of the data", "stress_Pa"),
    "kN": ("displacement_mm,force_N", (D, 1e-3 * F), SPECIMEN, 3, "shear modulus of the data is 3.1e-05", "kN"),
    "mN": ("displacement_mm,force_N", (D, 1e3 * F), SPECIMEN, 3, "shear modulus of the data", "mN"),
    "grips": ("displacement_mm,force_N", (30 + D, F), SPECIMEN, 3, "reduced stress", "between the grips"),
    "m": ("displacement_mm,force_N", (1e-3 * D, F), SPECIMEN, 3, "largest stretch is 1.001", "in m or cm"),
    "gauge in m": ("displacement_mm,force_N", (D, F), SPECIMEN.replace("30", "0.03"), 2, "gauge_length_mm", "like m"),
    "width in m": ("displacement_mm,force_N", (D, F), SPECIMEN.replace("6", "0.006"), 2, "width_mm", "like m"),
    "micrometres": ("displacement_mm,force_N", (D, F), SPECIMEN.replace("2", "2000"), 2, "thickness_mm", "microm"),
    "preload": ("stretch,stress_MPa", (X, Y + 0.01), "", 3, "stress at stretch 1", "not tared"),
    "sign": ("stretch,stress_MPa", (X, -Y), "", 3, "shear modulus of the data is -0.031", "sign"),
    "fraction": ("strain_percent,stress_MPa", (2 * (X - 1), Y), "", 3, "strain_percent is 1.02", "name it strain"),
    "fraction to 3": ("strain_percent,stress_MPa", (4 * (X - 1), Y), "", 3, "strain_percent is 1.04", "name it strain"),
    "inches": ("displacement_mm,force_N", (D / 25.4, F), SPECIMEN, 3, "largest stretch is 1.039", "or in inches"),
    "cm": ("displacement_mm,force_N", (0.05 * D, F), SPECIMEN, 3, "largest stretch is 1.05", "growth", "in cm or"),
    "radius": (
        *("displacement_mm,force_N", (D, F), SPECIMEN.replace("6", "0.4").replace("2", "0.2"), 3),
        "cross-section",
    ),
    "slack": ("stretch,stress_MPa", (X, neo_hookean(np.maximum(X - 0.15, 1))), "", 3, "begins at a stretch of 1.15"),
    "long slack": ("stretch,stress_MPa", (X, neo_hookean(np.maximum(X - 0.4, 1))), "", 3, "begins at a stretch of 1.4"),
    "break": ("stretch,stress_MPa", (np.append(X, [2.1, 2.2, 2.3]), np.append(Y, [0, 0, 0])), "", 3, "R^2", "[1, 2]"),
}


@pytest.mark.parametrize("kind", WRONG)
def test_a_wrong_quantity_stops_with_its_likely_name(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    columns, data, table, expected, *words = WRONG[kind]
    status, document, errors = identified(tmp_path, capsys, columns, data, table)
    assert status == expected
    assert all(word in errors for word in ("t.toml", "[tensile]", *words))
    if expected == 2:
        assert len(errors.splitlines()) == 1
        assert document is None
        return
    failed = [check for check in document["checks"] if check["verdict"] == "failed"]
    assert failed or kind == "break"
    for check in failed:
        assert check["message"] in errors
        assert not check["possible"][0] <= check["value"] <= (check["possible"][1] or np.inf)
    if failed:
        assert document["best"] is None
        assert {law["status"] for law in document["laws"]} <= {"implausible", "unstable_material"}
    for law in document["laws"]:
        assert law["message"]
        assert law["model"] != document["best"] or law["r_squared"] >= 0.5


CYCLES = np.concatenate([X, X[::-1], X])
WARNED = {
    "true stress": ("stretch,stress_MPa", (X, X * Y), "", "true stress"),
    "cycles": ("stretch,stress_MPa", (CYCLES, np.concatenate([Y, 0.8 * Y[::-1], 0.9 * Y])), "", "load cycles"),
    "1 mm2": ("displacement_mm,force_N", (D, F), "gauge_length_mm = 30\nwidth_mm = 1\nthickness_mm = 1", "left at 1"),
    "gram-force": ("displacement_mm,force_N", (D, 102 * F), SPECIMEN, "gram-force"),
    "no true stress": ("stretch,stress_MPa", (X, Y), 'stress = "true"', "engineering stress"),
    "a little slack": (
        "stretch,stress_MPa",
        (X, neo_hookean(np.maximum(X - 0.06, 1))),
        "",
        "begins at a stretch of 1.06",
    ),
    "short": (
        "stretch,stress_MPa",
        (1 + 0.04 * (X - 1), neo_hookean(1 + 0.04 * (X - 1))),
        "",
        "largest stretch is 1.04",
    ),
}


@pytest.mark.parametrize("kind", WARNED)
def test_what_may_be_right_is_warned_of_by_name(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    columns, data, table, word = WARNED[kind]
    status, document, _ = identified(tmp_path, capsys, columns, data, table)
    assert status == 0
    assert any(word in check["message"] for check in document["checks"] if check["verdict"] == "warned")


RIGHT = {
    "stretch": ("stretch,stress_MPa", (X, Y), ""),
    "strain": ("strain,stress_kPa", (X - 1, 1e3 * Y), ""),
    "percent": ("strain_percent,stress_Pa", (100 * (X - 1), 1e6 * Y), ""),
    "specimen": ("displacement_mm,force_N,stress_kPa", (D, F, 7 * Y), SPECIMEN),  # the third is ignored
    "true": ("stretch,stress_MPa", (X, X * Y), 'stress = "true"'),
}


@pytest.mark.parametrize("kind", RIGHT)
def test_columns_carry_their_unit(kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    status, document, errors = identified(tmp_path, capsys, *RIGHT[kind])
    assert (status, errors) == (0, "")
    law = document["laws"][1]
    assert law["status"] == "solved"
    assert law["constants"]["mu0_MPa"] == pytest.approx(0.031, rel=1e-4)
    assert {check["verdict"] for check in document["checks"]} == {"passed"}


def test_a_range_of_stretch_is_cut_and_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    broken = np.append(X, [2.1, 2.2, 2.3]), np.append(Y, [0, 0, 0])
    status, document, _ = identified(tmp_path, capsys, "stretch,stress_MPa", broken, "stretch = [1.1, 2]")
    assert (status, document["points"], document["dropped"], document["stretch_range"]) == (0, 37, 7, [1.1, 2.0])
    assert document["laws"][1]["constants"]["mu0_MPa"] == pytest.approx(0.031, rel=1e-4)
    task = load_scenario(tmp_path / "t.toml").task
    assert isinstance(task, TensileTask)
    assert task.stretch.min() == 1.1
    assert task.file_of_point.size == 37
    assert document["data_stretch"] == [1.1, 2.0]
    assert document["fitted_stretch"] == [1.0, 2.0]  # every law is exact at 1
    assert main(["identify", str(tmp_path / "t.toml"), "--out", str(tmp_path / "o")]) == 0
    made = (tmp_path / "o" / "material.toml").read_text()
    assert "fitted_stretch = [1.0, 2.0]\n" in made
    assert '37 points, stretch 1.1 to 2"\n' in made
    assert "37 points, stretch 1.1 to 2; 7 points outside stretch = [1.1, 2.0]" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ("[2, 1]", "highest above the lowest"),
        ("[0.5, 0.9]", "highest above the lowest and 1"),
        ("[1]", "stretch"),
        ("[-1, 2]", "stretch"),
        ("[3, 4]", "leaves 0 of 41 points, too few for law 'yeoh' with 2 constants; the data go from 1 to 2"),
        ("[0.9, 1.01]", "leaves 1 of 41 points"),
        ("[0.9, 1]", "highest above"),
    ],
)
def test_a_range_that_leaves_too_little_is_one_line(
    asked: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status, document, errors = identified(tmp_path, capsys, "stretch,stress_MPa", (X, Y), f"stretch = {asked}")
    assert (status, document) == (2, None)
    assert len(errors.splitlines()) == 1
    assert "[tensile] stretch" in errors
    assert said in errors


def test_a_law_with_an_open_constant_is_not_best_while_another_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    noise = 1e-6 * np.random.default_rng(4).standard_normal(X.size)  # [MPa]
    _, document, _ = identified(tmp_path, capsys, "stretch,stress_MPa", (X, Y + noise))
    closest = min(document["laws"], key=lambda law: law["rmse_MPa"])
    assert False in closest["determined"].values()
    assert document["best"] == "neo-hookean"
    alone = fit_tensile(X, 1e6 * (Y + noise), "yeoh")
    assert alone.best is not None  # the only one
    assert alone.best.determined["C20"] is False


def test_what_failed_is_said_first_with_the_path_as_typed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    asked = ("stretch,stress_MPa", (np.linspace(5, 200, 40), np.linspace(0, 0.1, 40)))
    identified(tmp_path, capsys, *asked)
    order: list[str] = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("softnlp.cli.identify.complain", lambda text: order.append(f"error: {text}"))
        patch.setattr("softnlp.cli.identify.say", order.append)
        assert main(["identify", str(tmp_path / "t.toml"), "--out", str(tmp_path / "o")]) == 3
    assert order[0].startswith(f"error: {tmp_path / 't.toml'}: [tensile] the largest stretch is 200")
    assert "40 points, stretch 5 to 200" in order[1]


def test_open_and_bounded_constants_are_named_in_document_table_and_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    noise = 1e-4 * np.random.default_rng(1).standard_normal(X.size)
    status, document, _ = identified(tmp_path, capsys, "stretch,stress_MPa", (X, Y + noise))
    yeoh = document["laws"][2]
    assert status == 0
    assert yeoh["determined"] == {"C10_MPa": True, "C20_MPa": False}
    assert any("C20_MPa is not determined" in warning for warning in yeoh["warnings"])
    assert main(["identify", str(tmp_path / "t.toml"), "--out", str(tmp_path / "o")]) == 0
    assert "(not determined)" in capsys.readouterr().out
    assert ", not determined" in (tmp_path / "o" / "material.toml").read_text()
    steep = fit_tensile(X, 1e-12 * (X**60 - 1), "ogden").fits["ogden"]  # beyond any exponent allowed
    assert set(steep.at_bound) == {"b1", "b2"}
    assert all(steep.notes[name] == "at its bound" for name in steep.at_bound)
    assert any("b1 ended at its bound 40" in warning for warning in steep.warnings)
