"""Laws fitted to tensile tests: constants recovered, their uncertainty, files and what is wrong with them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from softnlp import InputError, Numerics, fit_tensile, formula_law, load_materials, material
from softnlp.cli import main
from softnlp.figures import tensile_figure
from softnlp.model.laws import LAWS
from softnlp.scenario.read import load_scenario, scenario_from_text
from softnlp.studies.law_curve import LawCurve
from softnlp.studies.measurements import TensileTask
from softnlp.studies.tensile import LawFit

ROOT = Path(__file__).parents[1]
SCENARIOS = ROOT / "scenarios" / "identify"
STRETCH = np.linspace(1, 2, 41)
PUBLISHED = [(s, law) for s, entry in load_materials().items() for law in entry.models]


def fitted(stretch: Any, stress: Any, law: str, **options: Any) -> LawFit:
    return fit_tensile(stretch, stress, law, **options).fits[law]


@pytest.mark.parametrize(("silicone", "law"), PUBLISHED)
def test_a_law_is_refitted_from_its_own_curve(silicone: str, law: str) -> None:
    true = material(silicone, law)
    stress = np.asarray(true.engineering_stress(STRETCH))
    fit = fitted(STRETCH, stress, law)
    assert np.max(np.abs(fit.stress(STRETCH) - stress)) <= 1e-6 * np.max(np.abs(stress))
    if law != "ogden":  # whose constants are not unique
        assert [fit.constants[k] for k in true.constants] == pytest.approx(list(true.constants.values()), rel=1e-6)
    assert fit.r_squared == pytest.approx(1, abs=1e-9)
    assert fit.material is not None
    assert fit.fitted_stretch == (1.0, 2.0)


@pytest.mark.parametrize("grows", [False, True], ids=["equal noise", "noise that grows with the stress"])
@pytest.mark.parametrize("law", ["linear", "neo-hookean", "mooney-rivlin", "yeoh"])
def test_two_sigma_intervals_hold_the_constants(law: str, grows: bool) -> None:
    true = material("Ecoflex 00-50", law)
    stress = np.asarray(true.engineering_stress(STRETCH))
    random = np.random.default_rng(3)
    inside = []
    for _ in range(100):
        noise = 0.01 * random.standard_normal(STRETCH.size) * (stress if grows else np.max(stress))
        fit = fitted(STRETCH, stress + noise, law, numerics=Numerics(engine="newton"))
        inside.append([abs(fit.constants[k] - v) <= 2 * fit.standard_errors[k] for k, v in true.constants.items()])
    assert np.min(np.mean(inside, axis=0)) >= 0.9


def test_standard_errors_are_those_of_linear_regression() -> None:
    """Against scipy's regression through the origin, where the noise is of one size the larger estimate is near."""
    from scipy.optimize import curve_fit

    random = np.random.default_rng(5)
    stress = np.asarray(material("Ecoflex 00-30", "yeoh").engineering_stress(STRETCH)) + 100 * random.standard_normal(
        41
    )
    fit = fitted(STRETCH, stress, "yeoh")

    def law(x: Any, C10: float, C20: float) -> Any:
        return LAWS["yeoh"].formula(x, C10, C20)

    found, covariance = curve_fit(law, STRETCH, stress, p0=(1e4, -100.0))
    assert list(fit.constants.values()) == pytest.approx(found, rel=1e-6)
    for error, variance in zip(fit.standard_errors.values(), np.diag(covariance), strict=True):
        assert np.sqrt(variance) * 0.999 <= error <= 1.6 * np.sqrt(variance)
    assert fit.correlation[0, 1] == pytest.approx(covariance[0, 1] / np.sqrt(np.prod(np.diag(covariance))), rel=1e-3)


def test_a_law_of_ones_own_is_fitted_from_a_start() -> None:
    law = formula_law("exponential", "a * (exp(b * (stretch - 1)) - 1) / stretch", ("a", "b"))
    stress = np.asarray(LAWS["linear"].formula(STRETCH, 0.0)) + 1e6 * 0.05 * (np.exp(0.6 * (STRETCH - 1)) - 1) / STRETCH
    fit = fit_tensile(STRETCH, stress, law, start={"a": 0.2, "b": 2.0}).fits["exponential"]
    assert fit.constants == pytest.approx({"a": 0.05, "b": 0.6}, rel=1e-6)


def test_a_law_without_any_linear_constant_is_fitted() -> None:
    law = formula_law(
        "curved", "a * b * (stretch - 1 / stretch) + a**3 * (stretch - 1)**2 + b**2 * (stretch - 1)", ("a", "b")
    )
    assert not LawCurve(law).linear.any()
    a, b, x = 0.4, 0.15, STRETCH
    stress = 1e6 * (a * b * (x - 1 / x) + a**3 * (x - 1) ** 2 + b**2 * (x - 1))
    fit = fit_tensile(x, stress, law, start={"a": 0.3, "b": 0.2}).fits["curved"]
    assert fit.constants == pytest.approx({"a": a, "b": b}, rel=1e-6)


def test_starts_without_a_finite_stress_are_passed_over_and_none_at_all_is_refused() -> None:
    """An exponent too large for a number leaves no stress; smaller ones among the starts do, and one of them fits."""
    law = formula_law("steep", "a * (exp(b * (stretch - 1)) - 1)", ("a", "b"))
    stress = 1e4 * (np.exp(3.0 * (STRETCH - 1)) - 1)
    fit = fit_tensile(STRETCH, stress, law, start={"a": 0.01, "b": 900.0}).fits["steep"]
    assert fit.constants == pytest.approx({"a": 0.01, "b": 3.0}, rel=1e-5)
    nowhere = formula_law("nowhere", "a * log(-1 - b**2) * stretch", ("a", "b"))
    with pytest.raises(InputError, match="'nowhere' gives no finite stress at any start; give others"):
        fit_tensile(STRETCH, stress, nowhere)


def test_a_law_without_constants_has_nothing_to_fit() -> None:
    law = formula_law("given", "0.02 * (stretch - 1 / stretch**2)", ())
    with pytest.raises(InputError, match="law 'given' has no constant to fit"):
        fit_tensile(STRETCH, STRETCH - 1, law)


def test_true_stress_and_repeats_give_the_same_constants() -> None:
    true = material("Ecoflex 00-10", "yeoh")
    x = np.concatenate([STRETCH, STRETCH[::3]])
    engineering = fitted(x, true.engineering_stress(x), "yeoh")
    divided = fitted(x, true.true_stress(x), "yeoh", true_stress=True)
    assert divided.constants == pytest.approx(dict(engineering.constants), rel=1e-9)
    assert engineering.constants == pytest.approx(dict(true.constants), rel=1e-9)


def test_constants_that_the_data_cannot_tell_apart_are_named() -> None:
    """At small stretches Mooney-Rivlin shows C10 + C01 alone."""
    x = np.linspace(1, 1.02, 20)
    stress = np.asarray(material("Ecoflex 00-50").engineering_stress(x))
    fit = fitted(x, stress, "mooney-rivlin")
    assert any("C10_MPa" in w and "C01_MPa" in w for w in fit.warnings)
    one = fitted([1.0, 2.0, 2.0], [0.0, 5e4, 5.1e4], "yeoh")
    assert np.isinf(list(one.standard_errors.values())).all()
    assert "do not determine" in one.warnings[0]


def test_a_law_that_softens_within_the_range_says_so() -> None:
    x = np.linspace(1, 3, 41)
    fit = fitted(x, 3e4 * np.log(x) / x**1.5, "yeoh")
    assert fit.unstable_from is None or fit.unstable_from > 1
    falling = fitted(x, -2e4 * (x - 1), "linear")
    assert falling.material is None
    assert "tangent modulus" in falling.problem
    yeoh = material("Dragon Skin 10", "yeoh")
    far = np.linspace(1, 5, 41)
    soft = fitted(far, yeoh.engineering_stress(far), "yeoh")
    assert soft.unstable_from is not None
    assert float(yeoh.tangent_modulus(soft.unstable_from)) <= 0 < float(yeoh.tangent_modulus(soft.unstable_from - 0.02))
    assert any("not positive" in w for w in soft.warnings)


@pytest.mark.parametrize(
    ("stretch", "stress", "said"),
    [
        ([1.0, 1.5], [0.0], "one stress a stretch"),
        ([1.0, 0.9], [0.0, 1.0], "at least one stretch above 1"),
        ([1.0, -2.0, 3.0], [0.0, 1.0, 2.0], "above 0"),
        ([1.0, 1.5], [0.0, 0.0], "not 0 everywhere"),
        ([1.0, 1.5], [0.0, np.nan], "finite"),
        ([1.0, 1.5], ["a", "b"], "list of numbers"),
        ([1.0, 1e300], [0.0, 1.0], "expected 0.0001 to 10000, got 1e[+]300"),
        ([1.0, 1.5], [0.0, -1e300], "expected -1e[+]15 to 1e[+]15, got -1e[+]300"),
        ([1.0, 1.5], [0.0, 1.0], "3 constants"),
    ],
)
def test_what_is_no_tensile_test_is_refused(stretch: Any, stress: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        fit_tensile(stretch, stress, "mooney-rivlin")
    with pytest.raises(InputError, match="mooney-rivlin"):
        fit_tensile([1.0, 2.0], [0.0, 1.0], "mooney-rivlim")


@pytest.mark.parametrize(("noise", "unit"), [(0.0, "Pa"), (0.01, "Pa"), (500.0, "kPa")])
def test_residuals_are_drawn_in_a_unit_that_needs_no_power_of_ten(noise: float, unit: str) -> None:
    stress = 30e3 * (STRETCH - STRETCH**-2) + noise * np.random.default_rng(2).standard_normal(STRETCH.size)
    figure = tensile_figure(fit_tensile(STRETCH, stress, ["neo-hookean", "yeoh"]), "Batch 7")
    figure.canvas.draw()
    axes = figure.axes[1]
    assert axes.get_ylabel() == f"law - data [{unit}]"
    assert axes.yaxis.get_offset_text().get_text() == ""


# --- scenarios --------------------------------------------------------------------------------------------------------


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["tensile", "tensile_own_law"])
def test_a_shipped_tensile_test_runs(name: str, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert main(["run", str(SCENARIOS / f"{name}.toml"), "--out", str(out)]) == 0
    files = {path.name for path in out.iterdir()}
    assert files == {"identified.json", "table.csv", "material.toml", "figure.png", "versions.json", "scenario.toml"}
    document = json.loads((out / "identified.json").read_text())
    entry = load_materials(out / "material.toml")["Batch 7"]
    for law in document["laws"]:
        assert law["status"] == "solved"
        made = entry.models[law["model"]]
        assert {c.file_key: made.constants[c.name] / c.scale for c in made.law.constants} == law["constants"]
        assert made.fitted_stretch == (1.0, 2.0)
        assert law["r_squared"] > 0.9
    assert set(entry.models) == {law["model"] for law in document["laws"]}
    assert document["before"]["rmse_MPa"] > 0
    assert (out / "figure.png").stat().st_size > 10_000
    assert main(["materials", "--file", str(out / "material.toml")]) == 0


def test_the_fitted_material_file_is_ready_for_a_scenario(tmp_path: Path) -> None:
    assert main(["identify", str(SCENARIOS / "tensile.toml"), "--out", str(tmp_path)]) == 0
    text = (ROOT / "scenarios" / "own_materials_file.toml").read_text().split("[material]")[0]
    text += '[material]\nfile = "material.toml"\nname = "Batch 7"\nmodel = "ogden"\n'
    text += "[pressure]\nsequence_bar = [[1, 0, 0]]\n"
    assert scenario_from_text(text, tmp_path / "x.toml").material.name == "Batch 7"


def tensile_scenario(folder: Path, table: str, csv: str, more: str = "") -> Path:
    (folder / "t.csv").write_text(csv)
    path = folder / "t.toml"
    path.write_text(f'study = "identify"\n{more}\n[tensile]\nfile = "t.csv"\n{table}\n')
    return path


def test_force_and_displacement_are_stress_and_stretch(tmp_path: Path) -> None:
    csv = "note,displacement_mm,force_N\na,0,0\nb,10,1.5\nc,20,2.5\n"
    flat = load_scenario(tensile_scenario(tmp_path, "gauge_length_mm = 20\nwidth_mm = 5\nthickness_mm = 2", csv)).task
    assert isinstance(flat, TensileTask)
    assert flat.stretch == pytest.approx([1, 1.5, 2])
    assert flat.stress == pytest.approx([0, 0.15e6, 0.25e6])
    round_ = load_scenario(tensile_scenario(tmp_path, "gauge_length_mm = 20\ndiameter_mm = 4", csv)).task
    assert isinstance(round_, TensileTask)
    assert round_.stress[1] == pytest.approx(1.5 / (np.pi * 2e-3**2))


@pytest.mark.parametrize(
    ("table", "csv", "said"),
    [
        ("", "stretch,stress\n1,0\n", "missing column 'stress_MPa'"),
        ("", "a,b\n1,0\n", "expected columns stretch, stress_MPa or displacement_mm, force_N"),
        ("", "stretch,stress_MPa\n", "expected a header and rows"),
        ("", "stretch,stress_MPa\n1,x\n", "line 2: stress_MPa: expected a number, got 'x'"),
        ("", "stretch,stress_MPa\n1,nan\n", "finite number"),
        ("", "stretch,stress_MPa\n1,\n", "expected a number, got ''"),
        ("", "stretch,stress_MPa\n1,0,3\n", "line 2: expected 2 values"),
        ("", "stretch,stress_MPa\n0,0\n", "above 0"),
        ("", "displacement_mm,force_N\n1,0\n", "gauge_length_mm"),
        ("gauge_length_mm = 3", "displacement_mm,force_N\n1,0\n", "either diameter_mm, or width_mm"),
        ("gauge_length_mm = 3\nwidth_mm = 2", "displacement_mm,force_N\n1,0\n", "thickness_mm"),
        ('laws = ["yeo"]', "stretch,stress_MPa\n1,0\n", "did you mean 'yeoh'"),
        ("gauge_mm = 3", "stretch,stress_MPa\n1,0\n", "did you mean 'gauge_length_mm'"),
        ('files = ["t.csv"]', "stretch,stress_MPa\n1,0\n", "exactly one of file, files"),
    ],
)
def test_a_broken_tensile_scenario_is_one_line(
    table: str, csv: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["identify", str(tensile_scenario(tmp_path, table, csv)), "--json"]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert len(shown.err.splitlines()) == 1
    assert said in shown.err
    assert "t.toml" in shown.err


def test_tables_that_a_tensile_test_does_not_use_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    csv = "stretch,stress_MPa\n1,0\n1.5,0.03\n2,0.05\n"
    path = tensile_scenario(tmp_path, "", csv, '[gravity]\ndirection = "-z"\n')
    assert main(["identify", str(path)]) == 2
    assert "[gravity]" in capsys.readouterr().err
    assert not (tmp_path / "results").exists()


def test_a_law_that_is_no_material_ends_with_3_and_is_a_comment(tmp_path: Path) -> None:
    csv = "stretch,stress_MPa\n1,0\n1.5,-0.03\n2,-0.05\n"
    path = tensile_scenario(tmp_path, 'laws = ["linear", "neo-hookean"]', csv)
    assert main(["identify", str(path), "--out", str(tmp_path / "o")]) == 3
    text = (tmp_path / "o" / "material.toml").read_text()
    assert "# [My-silicone" in text or '# ["My silicone".linear]' in text
    document = json.loads((tmp_path / "o" / "identified.json").read_text())
    assert {law["status"] for law in document["laws"]} == {"unstable_material"}
    assert document["best"] is None


def test_ogden_with_equal_exponents_falls_to_one_term() -> None:
    stretch = np.linspace(1, 2, 41)
    noise = np.random.default_rng(0).normal(0, 100, 41)
    stress = 0.1e6 / 3 * (stretch**2 - stretch**-2.5) + noise
    fit = fit_tensile(stretch, stress, ["ogden"]).fits["ogden"]
    assert fit.constants["mu2"] == 0
    assert fit.constants["mu1"] == pytest.approx(0.1e6 / 3, rel=0.01)
    assert fit.constants["b1"] == pytest.approx(3, abs=0.05)
    assert fit.status == "solved"
    assert any("one term" in warning for warning in fit.warnings)


def test_the_same_points_ten_times_do_not_shrink_the_errors() -> None:
    stretch = np.linspace(1, 2, 41)
    stress = 0.03e6 * (stretch - stretch**-2) + np.random.default_rng(0).normal(0, 300, 41)
    once, often = (fit_tensile(np.tile(stretch, n), np.tile(stress, n), ["yeoh"]).fits["yeoh"] for n in (1, 10))
    assert often.standard_errors == pytest.approx(once.standard_errors)


def test_points_that_err_alike_count_as_fewer() -> None:
    stretch = np.linspace(1, 2, 400)
    alike = np.repeat(np.random.default_rng(0).normal(0, 300, 20), 20)
    stress = 0.03e6 * (stretch - stretch**-2)
    errors = [
        fit_tensile(stretch, stress + noise, ["neo-hookean"]).fits["neo-hookean"].standard_errors["mu0"]
        for noise in (alike, np.random.default_rng(1).permutation(alike))
    ]
    assert errors[0] > 3 * errors[1]
