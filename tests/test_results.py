"""What a run leaves behind: the same in JSON, CSV and netCDF, nothing made up for failed steps, and written whole."""

from __future__ import annotations

import csv
import errno
import io
import json
import math
import os
import re
import resource
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from arc_runs import (
    POINTS,
    arc_pose,
    arc_step,
    blocked_run,
    blocked_step,
    failed_step,
    offset_run,
    ramp_run,
    run_of,
    weighted_run,
)
from hypothesis import given
from hypothesis import strategies as st
from rich.console import Console

from softnlp import load_scenario, run_scenario
from softnlp.base.errors import InputError
from softnlp.base.status import Status
from softnlp.cli import main
from softnlp.model.contact_settings import ClosureWeights, ContactSettings
from softnlp.model.materials import Material, formula_law, material_from_table
from softnlp.model.robot import DIMENSIONS, robot
from softnlp.model.rod import Loads
from softnlp.results import (
    json_text,
    load_run,
    netcdf_bytes,
    save,
    table_lines,
    table_text,
    to_dataset,
    to_json,
    view_of_dataset,
    view_of_run,
    write_table,
    write_whole,
)
from softnlp.scenario.blocked_force import contact_settings
from softnlp.scenario.schema import ContactTable
from softnlp.statics.step import Run, WeightSensitivity

STEP_KEYS = {
    *(
        "pressure_bar",
        "status",
        "message",
        "stretch",
        "stable",
        "self_intersecting",
        "tip_position_mm",
        "tip_displacement_mm",
    ),
    *("tip_rotation", "bending_angle_deg", "tilt_deg", "backbone_length_mm", "chamber_length_mm", "residual"),
    *("discretisation_error", "intervals", "iterations", "solve_time_s", "warnings", "certificate"),
    *("self_intersecting", "segments", "engine", "ipopt_status", "ipopt_iterations", "ipopt_multipliers"),
}
KEPT_UNSOLVED = {"pressure_bar", "t_s", "status", "message", "residual", "warnings", "certificate"}


@pytest.fixture
def mixed() -> Run:
    """Eleven steps of one set with time; the third and the last two have no solution."""
    run = ramp_run(failed=(2, 9, 10))
    return replace(run, steps=tuple(replace(s, time=0.5 * k) for k, s in enumerate(run.steps)), warnings=("one",))


# --- JSON ---


def test_json_has_the_contract_s_keys(mixed: Run) -> None:
    document = to_json(mixed)
    assert {"softnlp", "title", "study", "conventions", "steps"} <= document.keys()
    assert document["conventions"] == "reproduction"
    for step in document["steps"]:
        assert step.keys() == STEP_KEYS | {"t_s"}
    assert all("t_s" not in step for step in to_json(ramp_run(2))["steps"])


def test_json_numbers_are_the_pose_s_in_the_unit_of_the_key(mixed: Run) -> None:
    for step, entry in zip(mixed.steps, to_json(mixed)["steps"], strict=True):
        assert np.allclose(np.array(entry["pressure_bar"]) * 1e5, step.pressure)
        assert entry["status"] == str(step.status)
        if step.status is not Status.SOLVED:
            continue
        pose = step.pose
        assert pose is not None
        assert np.allclose(np.array(entry["tip_position_mm"]) / 1000, pose.tip_position, atol=0, rtol=1e-14)
        assert np.array_equal(entry["tip_rotation"], pose.tip_rotation)
        assert math.radians(entry["bending_angle_deg"]) == pytest.approx(pose.bending_angle)
        assert math.radians(entry["tilt_deg"]) == pytest.approx(pose.tilt)
        assert entry["backbone_length_mm"] == pytest.approx(1000 * pose.backbone_length)
        assert np.allclose(entry["chamber_length_mm"], 1000 * pose.chamber_length)
        assert (entry["intervals"], entry["iterations"]) == (10, 4)
        assert entry["stable"] is True
        assert entry["certificate"][1] == {"equation": "tip moment", "value": 1e-15, "unit": "N m", "scaled": 1.3e-12}


def test_unsolved_step_keeps_what_is_known_and_nulls_the_rest(mixed: Run) -> None:
    entry = to_json(mixed)["steps"][2]
    assert {key for key, value in entry.items() if value is None} == (STEP_KEYS | {"t_s"}) - KEPT_UNSOLVED
    assert entry["residual"] == 0.25
    assert "1.31 bar" in entry["message"]


def test_a_pose_on_a_failed_step_is_never_shown() -> None:
    body = robot("D25L60")
    guess = arc_pose(body, np.array([9e4, 0, 0]))
    run = run_of([failed_step([9e4, 0, 0], status=Status.DIVERGED, pose=guess)])
    assert to_json(run)["steps"][0]["tip_position_mm"] is None
    assert np.isnan(to_dataset(run).tip_position_mm).all()
    assert view_of_run(run).bodies == (None,)


def test_json_text_reads_back_as_the_document(mixed: Run) -> None:
    awkward = replace(mixed, title='a "title" [ with ] \\n, [\n 1\n ] and µ')
    assert json.loads(json_text(awkward)) == to_json(awkward)


def test_json_has_no_nan_or_infinity() -> None:
    step = arc_step(robot("D25L60"), [1e4, 0, 0], residual=math.inf, discretisation_error=math.nan)
    text = json_text(run_of([step]))
    assert not re.search(r"NaN|Infinity", text)
    entry = json.loads(text)["steps"][0]
    assert entry["residual"] is None
    assert entry["discretisation_error"] is None
    assert entry["stretch"] is not None


@given(st.lists(st.floats(0, 1e7), min_size=3, max_size=3))
def test_pressures_survive_to_rounding(pressure: list[float]) -> None:
    entry = to_json(run_of([failed_step(pressure)]))["steps"][0]
    assert np.allclose(np.array(entry["pressure_bar"]) * 1e5, pressure, rtol=1e-13, atol=1e-9)


def test_pressures_are_written_without_conversion_noise() -> None:
    run = run_of([failed_step([np.linspace(0, 1.5, 11)[k] * 1e5 for k in (2, 6, 7)])])
    assert to_json(run)["steps"][0]["pressure_bar"] == [0.3, 0.9, 1.05]


def test_document_says_what_was_asked() -> None:
    loads = Loads((0.1, 0, 0), (0, 2e-3, 0), (0, 0, -9.80665))
    document = to_json(ramp_run(2, loads=loads))
    assert document["loads"] == {
        "tip_force_N": [0.1, 0, 0],
        "tip_moment_Nmm": [0, 2, 0],
        "gravity_m_per_s2": [0, 0, -9.80665],
        "gravity": "standing, gravity towards the base (-z)",
    }
    assert document["robot"] == {"name": "D25L60"} | {
        "outer_diameter_mm": 25, "lumen_diameter_mm": 9, "chamber_circle_diameter_mm": 17, "chamber_diameter_mm": 4.5,
        "chamber_wall_mm": 0.5, "length_mm": 60, "chamber_sets": 3, "chambers_per_set": 2, "chamber_angle_deg": 50,
    }  # fmt: skip
    assert document["robot"].keys() - {"name"} == {d.file_key for d in DIMENSIONS}
    assert document["coefficients"]["elongation"] == 0.41
    assert document["material"]["constants"] == {"C10_MPa": 0.00376, "C01_MPa": 0.01558, "C20_MPa": 0.001047}


def test_material_table_is_one_that_a_scenario_accepts() -> None:
    run = ramp_run(1)
    again = material_from_table(to_json(run)["material"])
    assert again.engineering_stress(1.7) == pytest.approx(run.material.engineering_stress(1.7), rel=1e-12)


def test_constants_of_a_person_s_own_law_keep_their_names() -> None:
    law = formula_law("mine", "c * (stretch - stretch**-2)", ["c"])
    table = to_json(ramp_run(1, material=Material("mine", law, {"c": 0.03})))["material"]
    assert (table["model"], table["constants"]) == ("mine", {"c": 0.03})


# --- netCDF ---


def test_every_variable_and_coordinate_says_its_unit_and_meaning(mixed: Run) -> None:
    dataset = to_dataset(mixed)
    for name, variable in dataset.variables.items():
        assert variable.attrs.get("units"), name
        assert variable.attrs.get("long_name"), name
    suffixes = {"_mm": "mm", "_bar": "bar", "_N": "N", "_Nmm": "N mm", "_deg": "degree", "_s": "s", "_per_m": "1/m"}
    for name, variable in dataset.variables.items():
        for suffix, unit in suffixes.items():
            if str(name).endswith(suffix):
                assert variable.attrs["units"] == unit, name


def test_dataset_dimensions_and_shape_along_the_rod(mixed: Run) -> None:
    dataset = to_dataset(mixed)
    assert dataset.sizes == {
        "step": 11, "set": 3, "axis": 3, "row": 3, "col": 3, "chamber": 6, "s": POINTS, "equation": 2,
    }  # fmt: skip
    assert dataset.step[0] == dataset.set[0] == dataset.chamber[0] == 1
    assert dataset.chamber_set.values.tolist() == [1, 1, 2, 2, 3, 3]
    assert dataset.status.values.tolist() == [str(s.status) for s in mixed.steps]
    shape = mixed.steps[5].pose.shape  # type: ignore[union-attr]
    for name, values, scale in (
        ("position_mm", shape.position, 1e3),
        ("rotation", shape.rotation, 1),
        ("force_N", shape.force, 1),
        ("moment_Nmm", shape.moment, 1e3),
        ("shear_extension", shape.shear_extension, 1),
        ("curvature_per_m", shape.curvature, 1),
    ):
        assert np.allclose(dataset[name].sel(step=6), scale * values), name
    halfway = dataset.position_mm.sel(step=6, s=0.5, axis="z")
    assert float(halfway) == pytest.approx(1e3 * shape.position[POINTS // 2, 2])


def test_unsolved_steps_are_nan_with_their_status(mixed: Run) -> None:
    dataset = to_dataset(mixed)
    unsolved = dataset.status == "no_equilibrium"
    assert int(unsolved.sum()) == 3
    kept = {"pressure_bar", "residual", *(n for n in dataset if str(n).startswith("certificate"))}
    for name, variable in dataset.data_vars.items():
        if variable.dtype.kind == "f" and "step" in variable.dims and name not in kept:
            values = np.isnan(variable.values).reshape(11, -1)
            assert values[unsolved].all(), name
            assert not values[~unsolved].any(), name
    assert dataset.stable.values.tolist() == [-1 if u else 1 for u in unsolved]
    flags = dict(
        zip(dataset.stable.attrs["flag_meanings"].split(), dataset.stable.attrs["flag_values"].tolist(), strict=True)
    )
    assert flags == {"undefined": -1, "unstable": 0, "stable": 1}


def test_undefined_stability_is_null_and_not_false() -> None:
    undefined, tipping = (replace(arc_pose(robot("D25L60"), np.zeros(3)), stable=s) for s in (None, False))
    steps = [arc_step(robot("D25L60"), [0, 0, 0], pose=pose) for pose in (undefined, tipping)]
    run = run_of([*steps, failed_step([1e5, 0, 0])])
    assert [step["stable"] for step in to_json(run)["steps"]] == [None, False, None]
    assert to_dataset(run).stable.values.tolist() == [-1, 0, -1]
    assert to_dataset(run).stable.dtype == np.int8
    assert view_of_run(run).stable.tolist() == view_of_dataset(to_dataset(run)).stable.tolist() == [-1, 0, -1]
    rows = list(csv.DictReader(io.StringIO(table_text(run))))
    assert [row["stable"] for row in rows] == ["", "false", ""]
    console = Console(width=120, file=io.StringIO())
    console.print(table_lines(run))
    shown = console.file.getvalue()  # type: ignore[attr-defined]
    assert shown.count("undef.") == 1


def test_global_attributes_say_what_was_asked_and_by_what(mixed: Run) -> None:
    attributes = to_dataset(mixed).attrs
    document = to_json(mixed)
    assert (attributes["title"], attributes["study"], attributes["conventions"]) == (
        "a test",
        "forward",
        "reproduction",
    )
    for name in ("robot", "material", "coefficients", "loads", "warnings"):
        assert json.loads(attributes[name]) == document[name]
    assert json.loads(attributes["versions"]).keys() == {"softnlp", "python", "casadi", "numpy", "xarray", "platform"}
    assert json.loads(attributes["conventions_in_full"])["fibre_thickness_mm"] == 0
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\+00:00", attributes["created"])


def test_netcdf_file_reads_back_the_same(mixed: Run, tmp_path: Path) -> None:
    path = write_whole(tmp_path / "r.nc", netcdf_bytes(mixed))
    with xr.open_dataset(path, engine="h5netcdf") as read:
        expected = to_dataset(mixed)
        assert read.load().drop_attrs(deep=False).equals(expected.drop_attrs(deep=False))
        assert read.t_s.dtype == float
        for name, variable in expected.variables.items():
            assert read[name].attrs["long_name"] == variable.attrs["long_name"]


def test_steps_with_unlike_points_are_padded_at_the_tip() -> None:
    body = robot("D25L60")
    steps = [arc_step(body, [4e4, 0, 0], pose=arc_pose(body, np.array([4e4, 0, 0]), points=n)) for n in (5, 9)]
    dataset = to_dataset(run_of(steps))
    assert "s" not in dataset.coords
    assert dataset.arc.isel(step=0).values[:5].tolist() == [0, 0.25, 0.5, 0.75, 1]
    assert np.isnan(dataset.arc.isel(step=0).values[5:]).all()
    assert [len(b.position) for b in view_of_dataset(dataset).bodies if b] == [5, 9]


# --- CSV ---


def test_table_has_a_row_a_step_and_units_in_its_header(mixed: Run) -> None:
    rows = list(csv.DictReader(io.StringIO(table_text(mixed))))
    assert [row["step"] for row in rows] == [str(k) for k in range(1, 12)]
    for column in rows[0]:
        counted = re.fullmatch(
            r"step|status|message|warnings|stretch|stable|self_intersecting|intervals|iterations|residual", column
        )
        assert counted or re.search(r"_(mm|bar|deg|s|error|[xyz]{2})$", column), column
    assert {row["t_s"] for row in rows} == {str(0.5 * k) for k in range(11)}
    assert [float(row["p1_bar"]) for row in rows] == pytest.approx(np.linspace(0, 1.5, 11))


def test_table_and_json_agree(mixed: Run) -> None:
    rows = list(csv.DictReader(io.StringIO(table_text(mixed))))
    for row, entry in zip(rows, to_json(mixed)["steps"], strict=True):
        tip = [row[f"tip_position_{axis}_mm"] for axis in "xyz"]
        lengths = [row[f"chamber_length_{n}_mm"] for n in range(1, 7)]
        if entry["status"] == "solved":
            assert [float(v) for v in tip] == entry["tip_position_mm"]
            assert [float(v) for v in lengths] == entry["chamber_length_mm"]
            assert float(row["tip_rotation_xz"]) == entry["tip_rotation"][0][2]
            assert row["stable"] == "true"
        else:
            assert {*tip, *lengths, row["stable"], row["stretch"], row["iterations"]} == {""}
            assert row["message"] == entry["message"]


# --- files ---


def test_save_writes_every_file_whole(mixed: Run, tmp_path: Path) -> None:
    from softnlp.figures import run_figure

    folder = tmp_path / "made" / "here"
    written = save(mixed, folder, scenario_text='title = "µ"\n', figure=run_figure)
    assert [p.name for p in written] == [
        "results.nc", "table.csv", "results.json", "versions.json", "scenario.toml", "figure.png",
    ]  # fmt: skip
    assert sorted(os.listdir(folder)) == sorted(p.name for p in written)
    assert json.loads((folder / "results.json").read_text()) == to_json(mixed)
    assert (folder / "scenario.toml").read_text(encoding="utf-8") == 'title = "µ"\n'
    assert (folder / "figure.png").read_bytes().startswith(b"\x89PNG")
    assert json.loads((folder / "versions.json").read_text())["python"].startswith("3.")


def test_a_full_disk_is_one_line_and_leaves_the_old_file(tmp_path: Path) -> None:
    path = write_whole(tmp_path / "a.txt", b"old")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, hard))
    try:
        with pytest.raises(InputError, match=r"a\.txt: cannot be written: ") as caught:
            write_whole(path, b"new" * 1000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert "\n" not in str(caught.value)
    assert path.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["a.txt"]


def test_an_interrupted_move_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write_whole(tmp_path / "a.txt", b"old")

    def refuse(*_: object) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(os, "replace", refuse)
    with pytest.raises(InputError, match="Read-only file system"):
        write_whole(path, b"new")
    assert path.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["a.txt"]


def test_a_figure_that_fails_leaves_the_numbers(mixed: Run, tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError):
        save(mixed, tmp_path, figure=lambda view: 1 // 0)
    assert sorted(os.listdir(tmp_path)) == ["results.json", "results.nc", "table.csv", "versions.json"]


def test_save_where_nothing_can_be_written(tmp_path: Path) -> None:
    run = ramp_run(2)
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputError, match="expected a folder, got a file"):
        save(run, tmp_path / "file")
    with pytest.raises(InputError, match="cannot make this folder"):
        save(run, tmp_path / "file" / "below")
    (tmp_path / "out" / "table.csv").mkdir(parents=True)
    with pytest.raises(InputError, match=r"table\.csv: cannot be written: Is a directory"):
        save(run, tmp_path / "out")
    (tmp_path / "late" / "results.json").mkdir(parents=True)
    with pytest.raises(InputError, match=r"results\.json: cannot be written: Is a directory"):
        save(run, tmp_path / "late")
    for folder in ("out", "late"):  # nothing of it is written
        assert len(list((tmp_path / folder).iterdir())) == 1
    with pytest.raises(InputError, match="cannot be written: No such file"):
        write_table(run, tmp_path / "nowhere" / "t.csv")
    with pytest.raises(InputError, match="null"):
        save(run, tmp_path / "a\0b")
    with pytest.raises(InputError, match="null"):
        write_table(run, tmp_path / "a\0b.csv")
    assert (tmp_path / "file").read_text() == "mine"


# --- reading back ---


def assert_same_view(one: Any, other: Any) -> None:
    for name in ("title", "study", "material", "conventions", "status"):
        assert getattr(one, name) == getattr(other, name)
    for name in ("pressure", "stable", "stretch", "bending_angle", "backbone_length"):
        assert np.allclose(getattr(one, name), getattr(other, name), rtol=1e-14, atol=0, equal_nan=True), name
    assert (one.time is None) == (other.time is None)
    assert one.time is None or np.array_equal(one.time, other.time)
    assert one.solved == other.solved
    for k in one.solved:
        assert np.allclose(one.bodies[k].position, other.bodies[k].position, rtol=1e-14, atol=0)
        assert np.array_equal(one.bodies[k].rotation, other.bodies[k].rotation)
        assert one.bodies[k].radii.outer == pytest.approx(other.bodies[k].radii.outer, rel=1e-14)
        assert one.bodies[k].radii.chamber_circle == pytest.approx(other.bodies[k].radii.chamber_circle, rel=1e-14)
    for dimension in DIMENSIONS:
        assert getattr(one.robot, dimension.field) == pytest.approx(getattr(other.robot, dimension.field), rel=1e-13)
    for name in ("tip_force", "tip_moment", "gravity"):
        assert np.allclose(getattr(one.loads, name), getattr(other.loads, name), rtol=1e-13, atol=0)


@pytest.mark.parametrize(
    "run",
    [
        ramp_run(failed=(3,), loads=Loads((0.1, 0, 0), (0, 1e-3, 0), (0, 0, -9.80665))),
        ramp_run(steps=1),
        ramp_run(steps=3, failed=(0, 1, 2)),
        run_of([arc_step(robot("laparoscope-9"), [1e4, 2e4, 0], time=3.0)], "laparoscope-9", title=""),
    ],
    ids=["some failed", "single step", "all failed", "timed"],
)
def test_view_is_the_same_from_a_run_and_from_its_file(run: Run, tmp_path: Path) -> None:
    save(run, tmp_path)
    assert_same_view(view_of_run(run), load_run(tmp_path))
    assert_same_view(view_of_run(run), load_run(tmp_path / "results.nc"))
    assert json.loads(json_text(run)) == to_json(run)


def test_reading_what_is_not_a_run(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is none"):
        load_run(tmp_path)
    (tmp_path / "results.nc").write_text("not netCDF")
    with pytest.raises(InputError, match="this is not one"):
        load_run(tmp_path)
    (tmp_path / "results.nc").write_bytes(netcdf_bytes(ramp_run(2))[:3000])
    with pytest.raises(InputError, match="this is not one"):
        load_run(tmp_path)
    xr.Dataset({"a": ("x", [1.0])}).to_netcdf(tmp_path / "other.nc", engine="h5netcdf")
    with pytest.raises(InputError, match=r"other\.nc: expected a results\.nc of a run") as caught:
        load_run(tmp_path / "other.nc")
    assert "\n" not in str(caught.value)


# --- terminal ---


def printed(run: Run, width: int = 100) -> list[str]:
    text = io.StringIO()
    Console(file=text, width=width).print(table_lines(run))
    return text.getvalue().splitlines()


def test_terminal_table_holds_the_numbers(mixed: Run) -> None:
    lines = printed(mixed)
    row = next(line.split() for line in lines if line.split()[:1] == ["6"])
    pose = mixed.steps[5].pose
    assert pose is not None
    x, y, z = 1e3 * pose.tip_position
    assert row == [
        "6", "2.5", "0.75", "0.00", "0.00", "solved", f"{math.degrees(pose.bending_angle):.2f}", f"{x:.2f}",
        "0.00", f"{z:.2f}", f"{pose.stretch:.3f}", "yes", "1e-12", "3e-08", "0.012",
    ]  # fmt: skip
    assert abs(y) < 1e-9
    header = " ".join(lines[:2])
    assert all(unit in header for unit in ("[bar]", "[deg]", "[mm]", "[s]"))


def test_terminal_table_says_why_steps_failed_and_warns(mixed: Run) -> None:
    warned = [replace(s, warnings=(f"stretch {s.pressure[0]:.3g} is [bold]outside[/bold]",)) for s in mixed.steps[:2]]
    text = " ".join(" ".join(printed(replace(mixed, steps=(*warned, *mixed.steps[2:])))).split())
    assert "step 3 no_equilibrium: the stretch balance has no root" in text
    assert "steps 10-11 no_equilibrium:" in text
    assert "warning: one" in text
    assert "steps 1-2 warning: stretch 0 is [bold]outside[/bold] (numbers of step 1)" in text
    row = next(line.split() for line in printed(mixed) if line.split()[:1] == ["3"])
    assert row[6:12] == ["-"] * 6


@pytest.mark.parametrize("status", list(Status))
def test_terminal_table_fits_100_columns(status: Status) -> None:
    body = robot("D25L60")
    steps = [
        arc_step(body, [1.2345e5, 0, 1.1111e5], time=1234.56, solve_time=12.3),
        failed_step([1e5, 0, 0], status=status, time=0.01),
    ]
    lines = printed(run_of(steps))
    assert max(map(len, lines)) <= 100
    assert not any("…" in line for line in lines)


# --- a blocked force ---

CONTACT_KEYS = {
    *("blocked_force_N", "closure", "chamber_reaction_N", "gap_mm", "wall_point_mm", "wall_normal", "tip_cap_mm"),
    *("length_error_mm", "free_tip_position_mm", "free_bending_angle_deg"),
}


def test_json_of_a_blocked_force_has_its_keys_in_their_units() -> None:
    run = blocked_run(failed=(4,), tip_cap=0.005, offset=-0.002)
    document = to_json(run)
    for entry, step in zip(document["steps"], run.steps, strict=True):
        assert entry.keys() == STEP_KEYS | CONTACT_KEYS
        contact = step.contact
        if contact is None:
            assert {entry[key] for key in CONTACT_KEYS - {"closure"}} == {None}
            assert entry["closure"] == "compliant"  # it was asked for
            continue
        assert entry["blocked_force_N"] == contact.force
        assert entry["chamber_reaction_N"] == contact.chamber_reaction.tolist()
        assert len(entry["chamber_reaction_N"]) == 6
        assert entry["gap_mm"] == pytest.approx(1e3 * contact.gap)
        assert entry["wall_point_mm"] == [-2, 0, 0]
        assert entry["wall_normal"] == [1, 0, 0]
        assert entry["tip_cap_mm"] == 5
        assert entry["length_error_mm"] == pytest.approx(2)
        assert entry["free_tip_position_mm"] == pytest.approx((1e3 * contact.free.tip_position).tolist())
        assert math.radians(entry["free_bending_angle_deg"]) == pytest.approx(contact.free.bending_angle)
    assert document["steps"][0]["status"] == "no_contact"
    assert document["steps"][0]["blocked_force_N"] == 0
    assert len(run.failed) == 1
    assert document["contact"] == {"closure": "compliant", "tip_cap_mm": 0, "offset_mm": 0}
    assert not to_json(ramp_run(2))["steps"][0].keys() & CONTACT_KEYS


def test_what_was_asked_of_the_wall_is_a_table_that_a_scenario_accepts() -> None:
    settings = ContactSettings(
        tip_cap=3e-3,
        closure="weighted",
        wall_point=(1e-3, 0.0, 0.0),
        wall_normal=(0.8, 0.0, 0.6),
        weights=ClosureWeights(force=2.0, moment=30.0, length=4e3, position=5e3),
    )
    table = to_json(replace(weighted_run(), contact=settings))["contact"]
    again = contact_settings(ContactTable.model_validate(table))
    assert again.closure == "weighted"
    assert again.wall_normal == pytest.approx((0.8, 0, 0.6))
    assert again.wall_point == pytest.approx((1e-3, 0, 0))
    assert again.tip_cap == pytest.approx(3e-3)
    for name in ("force", "moment", "length", "position"):
        assert getattr(again.weights, name) == pytest.approx(getattr(settings.weights, name))


def test_sensitivity_to_the_weights_is_in_every_format_where_it_was_asked_for() -> None:
    run = weighted_run()
    assert not any("elasticity" in key for key in to_json(run)["steps"][0])
    contact = run.steps[1].contact
    assert contact is not None
    lines = (WeightSensitivity("force", 2.0, "1/N", 0.25), WeightSensitivity("length", 4e3, "1/m", -0.5))
    step = replace(run.steps[1], contact=replace(contact, sensitivity=lines))
    run = replace(run, steps=(run.steps[0], step, run.steps[2]))
    entries = [[s[f"force_elasticity_to_weight_{w}"] for w in ("force", "position")] for s in to_json(run)["steps"]]
    assert entries == [[None, None], [0.25, None], [None, None]]
    row = list(csv.DictReader(io.StringIO(table_text(run))))[1]
    assert (row["force_elasticity_to_weight_length"], row["force_elasticity_to_weight_position"]) == ("-0.5", "")
    found = to_dataset(run).force_elasticity_to_weight_length
    assert found.sel(step=2) == -0.5
    assert np.isnan(found.sel(step=[1, 3])).all()
    assert "step 2 force per 1 % of a weight: +0.250 % (force), -0.500 % (length)" in " ".join(printed(run))


def test_what_weighted_left_is_in_every_format_with_its_unit() -> None:
    run = weighted_run()
    entries = to_json(run)["steps"]
    assert entries[0]["weighted_residual"][1] == {"equation": "e_m", "value": 2e-3, "unit": "N m", "scaled": 0.4}
    assert entries[2]["weighted_residual"] == []
    rows = list(csv.DictReader(io.StringIO(table_text(run))))
    assert [row["weighted_residual_e_n_N"] for row in rows] == ["0.03", "0.03", ""]
    assert [row["weighted_residual_e_m_Nm"] for row in rows] == ["0.002", "0.002", ""]
    dataset = to_dataset(run)
    assert dataset.weighted_residual_Nm.sel(step=2, weighted_equation="e_m") == 2e-3
    assert np.isnan(dataset.weighted_residual_N.sel(step=2, weighted_equation="e_m"))
    assert np.isnan(dataset.weighted_residual_Nm.sel(step=3)).all()
    assert dataset.weighted_residual_unit.values.tolist() == ["N", "N m"]
    assert "weighted_residual_N" not in to_dataset(blocked_run())


def test_csv_and_netcdf_of_a_blocked_force_agree_with_json(tmp_path: Path) -> None:
    run = blocked_run(failed=(4,), tip_cap=0.005)
    path = write_whole(tmp_path / "r.nc", netcdf_bytes(run))
    rows = list(csv.DictReader(io.StringIO(table_text(run))))
    with xr.open_dataset(path, engine="h5netcdf") as dataset:
        for k, entry in enumerate(to_json(run)["steps"]):
            assert rows[k]["closure"] == dataset.closure.values[k] == entry["closure"]
            cells = {
                "blocked_force_N": ["blocked_force_N"],
                "gap_mm": ["gap_mm"],
                "chamber_reaction_N": [f"chamber_reaction_{n}_N" for n in range(1, 7)],
                "wall_normal": ["wall_normal_x", "wall_normal_y", "wall_normal_z"],
                "free_tip_position_mm": [f"free_tip_position_{axis}_mm" for axis in "xyz"],
            }
            for key, columns in cells.items():
                found = [rows[k][column] for column in columns]
                if entry[key] is None:
                    assert set(found) == {""}
                    assert np.isnan(dataset[key].values[k]).all()
                else:
                    assert [float(v) for v in found] == np.ravel(entry[key]).tolist()
                    assert np.array_equal(dataset[key].values[k], entry[key])
        for name, variable in dataset.variables.items():
            assert variable.attrs.get("units"), name
            assert variable.attrs.get("long_name"), name
        contact = run.steps[5].contact
        assert contact is not None
        assert np.allclose(dataset.free_position_mm.values[5], 1e3 * contact.free.shape.position)
        assert np.array_equal(dataset.free_rotation.values[5], contact.free.shape.rotation)


@pytest.mark.parametrize(
    "run", [blocked_run(failed=(4,), tip_cap=0.005), offset_run(), weighted_run()], ids=["ramp", "curve", "weighted"]
)
def test_the_wall_reads_back_from_the_file(run: Run, tmp_path: Path) -> None:
    save(run, tmp_path)
    one, other = view_of_run(run), load_run(tmp_path)
    assert_same_view(one, other)
    assert one.contact is not None
    assert other.contact is not None
    assert one.contact.closure == other.contact.closure
    assert one.contact.tip_cap == pytest.approx(other.contact.tip_cap)
    for name in ("force", "gap", "wall_point", "normal", "free_bending_angle"):
        a, b = getattr(one.contact, name), getattr(other.contact, name)
        assert np.allclose(a, b, rtol=1e-13, atol=0, equal_nan=True), name
    for mine, read in zip(one.contact.free, other.contact.free, strict=True):
        assert (mine is None) == (read is None)
        if mine is not None and read is not None:
            assert np.allclose(mine.position, read.position, rtol=1e-14, atol=0)
            assert np.array_equal(mine.rotation, read.rotation)
            assert mine.radii.outer == pytest.approx(read.radii.outer)


def test_a_blocked_force_without_a_wall_or_a_solution_can_be_kept(tmp_path: Path) -> None:
    """The chambers alone are constrained, or every step failed."""
    no_wall = replace(ramp_run(2), study="blocked-force")
    for run in (no_wall, blocked_run(3, failed=(0, 1, 2))):
        save(run, tmp_path)
        assert load_run(tmp_path).contact is view_of_run(run).contact is None
        assert to_json(run)["steps"][0]["blocked_force_N"] is None
        assert any(line.split()[:1] == ["1"] for line in printed(run))


def test_terminal_table_of_a_blocked_force() -> None:
    run = blocked_run(failed=(4,))
    lines = printed(run)
    contact = run.steps[5].contact
    assert contact is not None
    row = next(line.split() for line in lines if line.split()[:1] == ["6"])
    assert row[1:7] == ["1.5", "0.0", "0.0", "solved", "1.2000", f"{1e3 * contact.gap:.2f}"]
    assert next(line.split() for line in lines if line.split()[:1] == ["5"])[5:11] == ["-"] * 6
    header = " ".join(lines[:2])
    assert "force" in header
    assert "gap" in header
    assert "[N]" in header
    curve = printed(offset_run())
    assert "offset" in curve[0]
    assert next(line.split() for line in curve if line.split()[:1] == ["2"])[5:7] == ["-10.00", "0.8000"]
    # a wall given by a point: how far it was moved from it, the way it pushes
    wall = ContactSettings(wall_point=(0.02, 0.0, 0.0), wall_normal=(-1.0, 0.0, 0.0))
    moved = next(line.split() for line in printed(replace(offset_run(), contact=wall)) if line.split()[:1] == ["2"])
    contact = offset_run().steps[1].contact
    assert contact is not None
    assert moved[5] == f"{30 * -contact.normal[0]:.2f}"
    assert max(map(len, curve)) <= 80
    assert max(map(len, lines[:9])) <= 80
    body = robot("D25L60")
    wide = [
        blocked_step(body, [1.2345e5, 0.0, 1.1111e5], 12.34567, time=1234.56, solve_time=12.3) if k else
        replace(blocked_step(body, [0, 0, 0], 0.0), status=Status.NO_CONTACT, time=0.01)
        for k in range(2)
    ]  # fmt: skip
    assert max(map(len, printed(replace(run, steps=tuple(wide))))) <= 100


# --- imports ---


def test_only_what_is_used_is_imported() -> None:
    code = """
import sys
from arc_runs import ramp_run
from softnlp.results import to_json, view_of_run

run = ramp_run(3)
to_json(run)
assert not {"xarray", "matplotlib", "rich"} & sys.modules.keys()
from softnlp.figures import run_figure

run_figure(view_of_run(run))
assert not {"xarray", "matplotlib.pyplot"} & sys.modules.keys()
"""
    here = Path(__file__).parent
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(here), str(here.parent)])}
    subprocess.run([sys.executable, "-c", code], check=True, env=environment)


@pytest.mark.parametrize("name", ["identify/tensile", "identify/measured_angles", "design/laparoscope_paper"])
def test_the_document_of_any_study_is_what_its_command_prints(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    file = Path(__file__).parents[1] / "scenarios" / f"{name}.toml"
    asked = load_scenario(file)
    found = run_scenario(asked)
    document = to_json(found, asked)
    main([asked.study, str(file), "--json"])
    told = json.loads(capsys.readouterr().out)
    assert list(document) == list(told)
    assert json.loads(json.dumps(document, allow_nan=False)).get("laws") == told.get("laws")
    for take in (to_dataset, lambda r: save(r, "never")):
        with pytest.raises(InputError, match=r"takes a run, got .*; softnlp.to_json takes it"):
            take(found)
    assert not Path("never").exists()


def test_a_document_names_what_it_cannot_be_made_of() -> None:
    folder = Path(__file__).parents[1] / "scenarios"
    tensile = load_scenario(folder / "identify" / "tensile.toml")
    fit = run_scenario(tensile)
    with pytest.raises(InputError, match="takes a scenario of study 'identify', got a value of type NoneType"):
        to_json(fit)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="scenario of this fit"):
        to_json(fit, load_scenario(folder / "identify" / "measured_angles.toml"))  # type: ignore[arg-type]
    with pytest.raises(InputError, match="takes a run, got a value of type str"):
        to_json("results.json")  # type: ignore[arg-type]
    cloud = run_scenario(load_scenario(folder / "workspace" / "D25L60_sequence.toml"))
    with pytest.raises(
        InputError, match=r"softnlp.to_json takes a run, got .*Workspace; it is a netCDF file already: /"
    ):
        to_json(cloud)  # type: ignore[arg-type]
