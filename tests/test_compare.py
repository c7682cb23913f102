"""Comparisons with what is known: the model against itself, also with known errors, and what is published."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from comparisons import ECOFLEX, made_up
from hypothesis import given, settings
from hypothesis import strategies as st

from docs.figures import measured_angles
from softnlp import (
    COEFFICIENT_SETS,
    Loads,
    Measurements,
    Numerics,
    Variant,
    compare,
    forward,
    load_scenario,
    material,
    robot,
    run_scenario,
)
from softnlp.base.errors import InputError
from softnlp.base.status import Status
from softnlp.base.units import BAR, DEGREE, MILLIMETRE
from softnlp.cli import main
from softnlp.results.table import write_table
from softnlp.scenario.compare import Asked, compare_task
from softnlp.studies.variants import every_variant, labels

ROOT = Path(__file__).parents[1]
ANGLES, FORCES = (ROOT / "scenarios" / "compare" / f"{name}.toml" for name in ("angles", "forces"))
DATA = ROOT / "scenarios" / "files"
BOTH = ["--coefficients", "reproduction", "--coefficients", "calibrated"]
HEAD = 'robot = { name = "D25L60" }\nmaterial = { name = "Ecoflex 00-50", model = "mooney-rivlin" }\n'
COARSE = "solver = { intervals = 8 }"
HEADER = "p1_bar,p2_bar,p3_bar"


def scenario(folder: Path, study: str = "forward", more: str = "") -> Path:
    path = folder / f"{study}.toml"
    pressures = "workspace = { levels = 2, to_bar = 1 }" if study == "workspace" else ""
    pressures = pressures or "pressure = { sequence_bar = [[0.3, 0, 0], [0.9, 0.2, 0]] }"
    path.write_text(f'study = "{study}"\n{HEAD}{pressures}\n{more}\n')
    return path


def measured(folder: Path, header: str, *rows: str) -> Path:
    path = folder / "measured.csv"
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def told(capsys: pytest.CaptureFixture[str], *words: Any, status: int = 0) -> dict[str, Any]:
    """Return the document of a comparison."""
    assert main(["compare", *map(str, words), "--json"]) == status
    document: dict[str, Any] = json.loads(capsys.readouterr().out)
    return document


# --- what is published ---


@pytest.mark.thorough
def test_the_published_angles_are_as_far_as_documented(capsys: pytest.CaptureFixture[str]) -> None:
    document = told(capsys, ANGLES, DATA / "measured_angles.csv", *BOTH)
    reproduction, calibrated = (v["statistics"]["bending_angle_deg"] for v in document["variants"])
    assert (reproduction["count"], reproduction["unit"]) == (8, "deg")
    assert (round(reproduction["mean"]), round(calibrated["mean"])) == (44, 30)
    angles, _ = measured_angles.predictions()  # the table of the documentation
    for name in ("D25L60", "D20L60", "D15L60", "D10L60"):
        found = [
            row["simulated"]["bending_angle_deg"]
            for v in document["variants"]
            for row in v["rows"]
            if row["robot"] == name
        ]
        expected = [angles[label][name, sets] for label in ("reproduction", "calibrated") for sets in (1, 2)]
        assert found == pytest.approx(expected, abs=1e-3)
    assert document["best"]["coefficients"] == "calibrated"
    assert [v["by_robot"]["D10L60"]["bending_angle_deg"]["count"] for v in document["variants"]] == [2, 2]
    assert document["variants"][0]["by_robot"]["D25L60"]["bending_angle_deg"]["mean"] == pytest.approx(16.15, abs=0.01)


@pytest.mark.thorough
def test_the_published_forces_are_as_far_as_documented(capsys: pytest.CaptureFixture[str]) -> None:
    words = [*BOTH, "--closure", "free", "--closure", "compliant"]
    document = told(capsys, FORCES, DATA / "measured_forces.csv", *words)
    mapes = {
        (v["closure"], v["coefficients"]): v["statistics"]["blocked_force_N"]["mape_percent"]
        for v in document["variants"]
    }
    documented = {("free", "reproduction"): 43.2, ("compliant", "reproduction"): 6.5, ("compliant", "calibrated"): 7.7}
    assert {key: round(mapes[key], 1) for key in documented} == documented
    text = (ROOT / "docs" / "compare.md").read_text()
    for key in mapes:
        assert f"{mapes[key]:.1f} %" in text
    assert document["best"]["closure"] == "compliant"


# --- the model against itself ---


@pytest.mark.parametrize(
    ("study", "more", "words"),
    [
        ("forward", 'gravity = { direction = "-z" }\ntip_load = { force_N = [0.05, 0, 0] }\n' + COARSE, []),
        ("blocked-force", "contact = { offset_mm = -5, tip_cap_mm = 3 }\n" + COARSE, ["--shape", "blocked"]),
    ],
)
def test_results_compared_with_themselves_have_no_error(
    study: str, more: str, words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The table of a run is a file of measurements as it stands."""
    asked = scenario(tmp_path, study, more)
    if study == "blocked-force":
        asked.write_text(
            re.sub(r"sequence_bar = .*?\]\]", "sequence_bar = [[0.4, 0, 0], [0.9, 0, 0]]", asked.read_text())
        )
    table = write_table(run_scenario(load_scenario(asked)), tmp_path / "table.csv")
    document = told(capsys, asked, table, *words)
    found = document["variants"][0]["statistics"]
    expected = {"tip_position_mm", "x_mm", "y_mm", "z_mm", "bending_angle_deg", "elongation_mm", "tilt_deg"}
    assert set(found) == expected | ({"blocked_force_N"} if study == "blocked-force" else set())
    for s in found.values():
        assert s["count"] == len(document["variants"][0]["rows"])
        assert s["rmse"] < 1e-8
        assert s["max"] < 1e-8


def test_known_errors_are_found(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    P = BAR * np.array([[0.5, 0, 0], [0.2, 0.4, 0.0], [1.0, 0, 0.3]])
    poses = [s.pose for s in forward(robot("D15L60"), ECOFLEX, P).steps]
    rows = []
    for p, pose, angle, move in zip(P / BAR, poses, (2.0, -1.0, 3.0), ((3, 0, 4), (0, 0, 1), (0, -2, 0)), strict=True):
        assert pose is not None
        tip = pose.tip_position / MILLIMETRE - move
        numbers = [*p, *tip, pose.bending_angle / DEGREE - angle, pose.backbone_length / MILLIMETRE - 60 + 0.5]
        rows.append(",".join(f"{x:.12g}" for x in numbers))
    header = f"{HEADER},tip_x_mm,tip_position_y_mm,z_mm,bending_angle_deg,elongation_mm"
    file = measured(tmp_path, f"robot,{header}", *(f"D15L60,{row}" for row in rows))
    found = told(capsys, scenario(tmp_path), file)["variants"][0]["statistics"]
    angle = found["bending_angle_deg"]
    angles = np.array([float(row.split(",")[6]) for row in rows])
    assert angle["rmse"] == pytest.approx((14 / 3) ** 0.5, abs=1e-7)
    assert angle["mape_percent"] == pytest.approx(100 * np.mean(np.array([2, 1, 3]) / angles), rel=1e-7)
    assert [angle[k] for k in ("mean", "median", "max", "bias")] == pytest.approx([2, 2, 3, 4 / 3], abs=1e-7)
    assert found["elongation_mm"]["bias"] == pytest.approx(-0.5, abs=1e-8)
    tip = found["tip_position_mm"]
    assert [tip[k] for k in ("mean", "median", "max")] == pytest.approx([8 / 3, 2, 5], abs=1e-7)
    assert tip["mape_percent"] == pytest.approx(100 * 8 / 3 / 60)  # of the length
    assert tip["bias"] is None
    assert found["x_mm"]["bias"] == pytest.approx(1, abs=1e-7)
    assert found["z_mm"]["rmse"] == pytest.approx((17 / 3) ** 0.5, abs=1e-7)


def test_all_rows_at_once_are_the_rows_one_by_one() -> None:
    P = BAR * np.array([[0.3, 0, 0.1], [0.6, 0.6, 0], [0.9, 0.1, 0.2], [0.0, 0.8, 0.0]])
    given = Measurements(robot("D25L60"), P, tip_position=np.zeros((4, 3)), bending_angle=np.ones(4), tilt=np.ones(4))
    loads = Loads(gravity=(0, 0, -9.8))
    one, other = (compare(given, Variant(ECOFLEX), loads=loads, together=t) for t in (False, True))
    assert other.simulated[0][0].values == pytest.approx(one.simulated[0][0].values, abs=1e-6, nan_ok=True)
    assert np.isfinite(other.simulated[0][0].values[:, :4]).all()
    assert np.isnan(other.simulated[0][0].values[:, 4]).all()  # elongation was not measured
    assert other.simulated[0][0].status == (Status.SOLVED,) * 4


@pytest.mark.slow
def test_a_workspace_takes_its_wall_and_its_lane(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The numbers are those of docs/blocked-force.md and docs/model.md."""
    file = measured(tmp_path, f"{HEADER},blocked_force_N,bending_angle_deg", "1.5,0,0,1.18,107.67", "0.5,0,0,,")
    document = told(capsys, scenario(tmp_path, "workspace", "contact = {}\nsolver = { accuracy = 1e-4 }"), file)
    (variant,) = document["variants"]
    assert variant["closure"] == "compliant"
    assert [row["status"] for row in variant["rows"]] == ["solved", None]
    simulated = variant["rows"][0]["simulated"]
    assert simulated["blocked_force_N"] == pytest.approx(1.217, abs=6e-4)
    assert simulated["bending_angle_deg"] == pytest.approx(116.9, abs=0.06)
    assert "--shape blocked" in document["notes"][0]


def test_free_poses_are_solved_once_for_all_closures() -> None:
    P = BAR * np.array([[0.5, 0, 0], [0.8, 0, 0]])
    given = Measurements(robot("D10L40"), P, bending_angle=[1.0, 1.0], blocked_force=[0.1, np.nan])
    seen: list[tuple[int, int]] = []
    named = {"reproduction": COEFFICIENT_SETS["reproduction"]}
    variants = every_variant([ECOFLEX], named, closures=["free", "compliant"])
    coarse = Numerics(intervals=10)
    found = compare(given, variants, numerics=coarse, progress=lambda done, total: seen.append((done, total)))
    assert seen == [(k + 1, 4) for k in range(4)]
    free, compliant = (found.simulated[v][0].values for v in range(2))
    assert free[:, :6] == pytest.approx(compliant[:, :6], nan_ok=True)
    assert 0 < free[0, 6] < compliant[0, 6]
    assert np.isnan(free[1, 6])


# --- comparisons made up ---


@pytest.mark.thorough
@given(st.integers(2, 9), st.integers(0, 2**32 - 1), st.integers(1, 2))
@settings(max_examples=25, deadline=None)
def test_the_order_of_rows_changes_nothing(rows: int, seed: int, robots: int) -> None:
    random = np.random.default_rng(seed)
    values = random.normal(size=(rows, 7))
    values[random.random((rows, 7)) < 0.3] = np.nan
    values[0, :4] = 1.0
    simulated = random.normal(size=(2, rows, 7))
    order = random.permutation(rows)
    one, other = made_up(values, simulated), made_up(values[order], simulated[:, order], min(robots, rows))
    assert one.observables == other.observables
    for name in one.observables:
        for v in (0, 1):
            a, b = one.statistics(v, name), other.statistics(v, name)
            assert a.count == b.count
            for key in ("rmse", "mape", "mean", "median", "largest", "bias"):
                assert getattr(a, key) == pytest.approx(getattr(b, key), rel=1e-9, abs=1e-12, nan_ok=True)
    assert one.best == other.best


def test_the_best_misses_the_fewest_numbers_first() -> None:
    values = np.full((3, 7), np.nan)
    values[:, 3], values[:, 6] = [1, 2, 3], [10, 20, 30]
    near, far = values * 1.001, values * 1.5
    near[1] = np.nan
    found = made_up(values, np.stack([near, far]))
    assert (found.best, found.best_of("bending_angle"), found.lost(0)) == (1, 1, 1)
    assert found.statistics(0, "blocked_force").count == 2
    assert made_up(values, np.stack([values * 1.001, far])).best == 0
    assert made_up(values, np.full((1, 3, 7), np.nan)).best is None


def test_variants_are_named_by_what_differs() -> None:
    laws = [material("Ecoflex 00-50", law) for law in ("yeoh", "ogden")]
    assert labels(every_variant(laws, {"a": COEFFICIENT_SETS["reproduction"]})) == ["yeoh", "ogden"]
    assert labels(every_variant(laws[:1], {"a": COEFFICIENT_SETS["reproduction"]}, closures=["free"])) == [
        "yeoh, a, free"
    ]


# --- files ---


def test_rows_keep_their_order_and_their_columns(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = measured(
        tmp_path,
        f"note,robot,{HEADER},p4_bar,bending_deg,sigma_x,t_s",
        '"a, b",D15L60,0.5,0,0,,40,1,0',
        ",D25L60,0.5,0,0,0,20,,1",
        "c,,0.6,0,0,,,,2",
        ",D15L60,0.7,0,0,,50,é,3",
        ",D10L60,0.7,0,0,,,,4",
    )
    out = tmp_path / "out"
    words = ["compare", str(scenario(tmp_path, more=COARSE)), str(file), "--law", "yeoh", *BOTH]
    assert main([*words, "--out", str(out)]) == 0
    assert {f.name for f in out.iterdir()} == {
        *("comparison.json", "rows.csv", "summary.csv", "bending_angle.png", "versions.json"),
        *("scenario.toml", "measured.csv"),
    }
    with (out / "rows.csv").open(encoding="utf-8") as text:
        rows = list(csv.DictReader(text))
    with file.open(encoding="utf-8") as text:
        given = list(csv.DictReader(text))
    assert [{key: row[key] for key in given[0]} for row in rows] == given * 2
    assert [row["simulated_status"] for row in rows] == ["solved", "solved", "", "solved", ""] * 2
    assert {row["variant_law"] for row in rows} == {"yeoh"}
    for row in rows:
        if row["bending_deg"]:
            error = float(row["simulated_bending_angle_deg"]) - float(row["bending_deg"])
            assert float(row["error_bending_angle_deg"]) == pytest.approx(error, abs=1e-6)
        else:
            assert row["simulated_bending_angle_deg"] == row["error_bending_angle_deg"] == ""
    document = json.loads((out / "comparison.json").read_text())
    assert (document["count"], document["blank_count"]) == (5, {"bending_angle_deg": 2})
    assert [row.get("t_s") for row in document["variants"][0]["rows"]] == [0, 1, 2, 3, None]
    assert document["robots"] == ["D15L60", "D25L60"]
    assert set(document["variants"][0]["by_robot"]) == {"D15L60", "D25L60"}
    with (out / "summary.csv").open() as text:
        summary = list(csv.DictReader(text))
    assert [row["robot"] for row in summary] == ["all", "D15L60", "D25L60"] * 2
    first = document["variants"][0]["statistics"]["bending_angle_deg"]
    assert float(summary[0]["rmse"]) == pytest.approx(first["rmse"])
    assert (out / "measured.csv").read_text() == file.read_text()
    said = capsys.readouterr().out
    assert "mean error by robot [deg]" in said
    assert "least error:" in said


def test_a_row_without_a_solution_is_left_out_and_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = measured(tmp_path, f"{HEADER},bending_angle_deg", "0.5,0,0,25", "9,9,9,300", "0.6,0,0,32")
    words = ["compare", str(scenario(tmp_path)), str(file), "--coefficients", "none", "--law", "yeoh"]
    assert main([*words, "--out", str(tmp_path / "o")]) == 3
    assert "1 of 3 rows have no solution and no errors (1 unstable_material)" in capsys.readouterr().err
    document = json.loads((tmp_path / "o" / "comparison.json").read_text())
    (variant,) = document["variants"]
    assert (variant["unsolved"], variant["statistics"]["bending_angle_deg"]["count"]) == (1, 2)
    lost = variant["rows"][1]
    assert lost["status"] == "unstable_material"
    assert lost["simulated"] == lost["error"] == {"bending_angle_deg": None}
    assert lost["measured"] == {"bending_angle_deg": 300}
    assert [row["status"] for row in variant["rows"]][::2] == ["solved", "solved"]


def test_what_is_not_compared_is_said(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = measured(tmp_path, f"{HEADER},blocked_force_N,bending_angle_deg,elongation_m", "0.5,0,0,1,25,3")
    notes = told(capsys, scenario(tmp_path), file)["notes"]
    assert [note.partition(":")[0] for note in notes] == [
        "blocked_force_N is not compared",
        "column 'elongation_m' is not compared; did you mean 'elongation_mm'?",
    ]


def test_variants_are_those_that_are_named(tmp_path: Path) -> None:
    file = measured(tmp_path, f"{HEADER},elongation_mm", "0.2,0.2,0.2,2")
    task = compare_task(load_scenario(scenario(tmp_path)), file, Asked(laws=("all", "yeoh"), coefficients=("none",)))
    assert [v.law for v in task.variants] == ["linear", "neo-hookean", "mooney-rivlin", "yeoh", "ogden"]
    assert {(v.coefficients.elongation, v.coefficients.bending, v.named) for v in task.variants} == {(0, 0, "none")}
    own = tmp_path / "own.toml"
    law = 'model = "mine", formula = "c*(stretch-1)", constants = { c = 0.05 }'
    more = "stiffening = { elongation = 0.3 }\ncorrections = { inertia = 1.1 }"
    own.write_text(scenario(tmp_path, more=more).read_text().replace('model = "mooney-rivlin"', law))
    asked = Asked(laws=("all",), coefficients=("scenario", "calibrated"), conventions=("as-printed", "reproduction"))
    variants = compare_task(load_scenario(own), file, asked).variants
    assert [(v.law, v.named, v.conventions.name) for v in variants] == [
        ("mine", named, read) for named in ("scenario", "calibrated") for read in ("as_printed", "reproduction")
    ]
    assert [v.coefficients.elongation for v in variants] == [0.3, 0.3, 0.427, 0.427]
    assert {v.coefficients.inertia for v in variants} == {1.1}  # k_i is the scenario's in every set
    (by_default,) = compare_task(load_scenario(own), file).variants
    assert (by_default.named, by_default.closure) == ("scenario", None)


GOOD = f"{HEADER},bending_angle_deg"


@pytest.mark.parametrize(
    ("study", "more", "lines", "words", "said"),
    [
        ("forward", "", [GOOD, "1,0,0,x"], [], "measured.csv: line 2: bending_angle_deg: expected a number, got 'x'"),
        ("forward", "", [GOOD, "1,,0,3"], [], "line 2: p2_bar: expected a pressure"),
        ("forward", "", [GOOD, "-1,0,0,3"], [], "line 2: p1_bar: expected at least 0 and at most 100 bar, got -1 bar"),
        ("forward", "", [GOOD, "1,0,0,"], [], "something measured, got blank cells"),
        ("forward", "", [HEADER + ",bending", "1,0,0,3"], [], "it has p1_bar, p2_bar, p3_bar, bending"),
        ("forward", "", [HEADER + ",blocked_force_N", "1,0,0,3"], [], "has no wall"),
        ("forward", "", [HEADER + ",x_mm,tip_x_mm", "1,0,0,3,3"], [], "expected 'x_mm' once, got x_mm and tip_x_mm"),
        ("forward", "", ["robot," + GOOD, "D25L6,1,0,0,3"], [], "did you mean 'D25L60'"),
        ("forward", "", ["p4_bar," + GOOD, "1,1,0,0,3"], [], "p4_bar: expected 0 or nothing: D25L60 has 3 sets"),
        ("forward", "", [GOOD], [], "at least one row"),
        ("forward", "", ["t_s," + GOOD, "x,1,0,0,3"], [], "t_s: expected a number"),
        ("forward", "", [GOOD + ",error_x_mm", "1,0,0,3,3"], [], "'error_x_mm' is one that a comparison writes"),
        ("forward", "", [GOOD, "1,0,0,3"], ["--law", "yeo"], "--law: expected"),
        ("forward", "", [GOOD, "1,0,0,3"], ["--coefficients", "nne"], "did you mean 'none'"),
        ("forward", "", [GOOD, "1,0,0,3"], ["--conventions", "printed"], "did you mean 'as_printed'"),
        ("forward", "", [GOOD, "1,0,0,3"], ["--closure", "free"], "--closure: expected only where"),
        ("forward", "", [GOOD, "1,0,0,3"], ["--shape", "blocked"], "--shape: expected a wall"),
        ("blocked-force", "", [GOOD, "1,0,0,3"], ["--shape", "blockd"], "--shape: expected 'free' or 'blocked'"),
        ("blocked-force", "", [HEADER + ",force_N", "1,0,0,3"], ["--closure", "stiff"], "--closure: expected 'free'"),
        ("blocked-force", 'contact = { mode = "constrained" }', [GOOD, "1,0,0,3"], [], "[contact] mode"),
        (
            "workspace",
            "vary",
            [GOOD, "1,0,0,3"],
            [],
            "[workspace] vary",
        ),
    ],
)
def test_bad_input_is_one_line_and_writes_nothing(
    study: str,
    more: str,
    lines: list[str],
    words: list[str],
    said: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    asked = scenario(tmp_path, study, more.replace("vary", ""))
    if more == "vary":
        varied = 'to_bar = 1, vary = { "robot.length_mm" = { values = [50] } } }'
        asked.write_text(asked.read_text().replace("to_bar = 1 }", varied))
    file = measured(tmp_path, *lines)
    assert main(["compare", str(asked), str(file), "--out", str(tmp_path / "o"), *words]) == 2
    found = capsys.readouterr()
    assert said in found.err
    assert found.err.count("\n") == 1
    assert found.out == ""
    assert not (tmp_path / "o").exists()


def test_other_studies_and_missing_files_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", str(ROOT / "scenarios" / "inverse" / "point.toml"), "m.csv"]) == 2
    assert "study: expected 'forward', 'blocked-force' or 'workspace', got 'inverse'" in capsys.readouterr().err
    assert main(["compare", str(ANGLES), str(tmp_path / "none.csv")]) == 2
    assert capsys.readouterr().err == f"softnlp: {tmp_path / 'none.csv'}: no such file\n"


def test_a_comparison_that_is_stopped_writes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    @contextmanager
    def stopped(total: int, title: str) -> Iterator[tuple[Any, Any]]:
        assert total == 2
        yield done.append, lambda: len(done) == 1

    done: list[int] = []
    monkeypatch.setattr("softnlp.cli.compare.progress", stopped)
    file = measured(tmp_path, f"{HEADER},bending_angle_deg", "0.5,0,0,25", "0.6,0,0,30")
    out = tmp_path / "o"
    assert main(["compare", str(scenario(tmp_path, more=COARSE)), str(file), "--out", str(out)]) == 130
    assert capsys.readouterr() == ("", "softnlp: stopped\n")
    assert done == [1]
    assert not out.exists()


def test_python_arguments_are_checked() -> None:
    one, P = robot("D25L60"), [[BAR, 0, 0]]
    given = Measurements(one, P, bending_angle=[1.0])
    for wrong, words in (
        (lambda: compare([], Variant(ECOFLEX)), "measurements: expected measurements of at least one robot"),
        (lambda: compare(given, []), "variants: expected at least one variant"),
        (lambda: compare(given, Variant(ECOFLEX, closure="stiff")), "closure: expected one of free"),
        (lambda: compare(given, Variant(ECOFLEX), shape="bent"), "shape: expected one of free"),  # type: ignore[arg-type]
        (lambda: compare(Measurements(one, P), Variant(ECOFLEX)), "at least one number of"),
        (lambda: compare(Measurements(one, P, tilt=[1, 2]), Variant(ECOFLEX)), "tilt: expected the"),
    ):
        with pytest.raises(InputError, match=words):
            wrong()
