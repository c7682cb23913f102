"""Comparisons of a workspace with errors that are known, files that are not right, and the command."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import h5py
import numpy as np
import pytest
from arc_workspaces import MODEL, arcs, grid, workspace_dataset, write_workspace

from softnlp.base.errors import InputError
from softnlp.base.statistics import groups, statistics
from softnlp.base.units import BAR, MILLIMETRE
from softnlp.cli import main
from softnlp.figures import comparison_figure
from softnlp.sweep.comparison import (
    compare_measured,
    compare_workspaces,
    comparison_rows,
    model_of,
)
from softnlp.sweep.measured import load_measured
from softnlp.sweep.read import Workspace, column_names, load_workspace, read_column

HEADER = "t_s,p1_bar,p2_bar,p3_bar,x_mm,y_mm,z_mm"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_workspace(tmp_path_factory.mktemp("sweep"), grid(5), failed={3: "diverged", 7: "fold"}, unstable=(20,))


@pytest.fixture(scope="module")
def space(folder: Path) -> Workspace:
    return load_workspace(folder)


def measured_file(path: Path, pressures: np.ndarray, error: np.ndarray, header: str = HEADER, extra: str = "") -> Path:
    """Write tips that are off the arcs by `error` [m]: the simulated tip is this one plus the error."""
    tips = (arcs(pressures)["tip_position"] - error) / MILLIMETRE
    rows = [header]
    for k, (P, tip) in enumerate(zip(pressures / BAR, tips, strict=True)):
        rows.append(",".join([str(k), *(f"{v:.12g}" for v in (*P, *tip))]) + extra)
    path.write_text("\n".join(rows) + "\n")
    return path


# --- reading a workspace ---


def test_a_workspace_is_read_in_si(space: Workspace) -> None:
    P = grid(5)
    expected = arcs(P)
    ok = space.solved
    assert (space.poses, int(ok.sum()), space.robot.name, space.title) == (125, 123, "D25L60", "arcs")
    assert space.pressure == pytest.approx(P)
    assert space.tip_position[ok] == pytest.approx(expected["tip_position"][ok], abs=1e-12)
    assert space.tip_axis[ok] == pytest.approx(expected["tip_rotation"][ok][:, :, 2])
    assert space.bending_angle[ok] == pytest.approx(expected["bending_angle"][ok])
    assert space.tilt[ok] == pytest.approx(expected["bending_angle"][ok])  # an arc in a plane, under 180 deg
    assert np.isnan(space.tip_position[[3, 7]]).all()
    assert (space.stable[20], space.stable[3], space.stable[0]) == (0, -1, 1)
    with pytest.raises(ValueError, match="read-only"):
        space.tip_position[0, 0] = 1.0


def test_columns_are_named_as_in_csv(space: Workspace) -> None:
    names = column_names(space)
    assert {"p1_bar", "tip_position_x_mm", "chamber_length_6_mm", "tip_rotation_x_z", "stretch", "residual"} <= set(
        names
    )
    assert not {"set_1", "pose", "status"} & set(names)
    P = read_column(space, "p2_bar")
    assert (P.values * BAR, P.unit) == (pytest.approx(space.pressure[:, 1]), "bar")
    length = read_column(space, "chamber_length_3_mm").values
    assert length[4] == pytest.approx(arcs(grid(5)[4:5])["chamber_length"][0, 2] / MILLIMETRE)
    assert np.isnan(length[3])
    assert read_column(space, "residual").values[3] == pytest.approx(0.3)  # known of a failed pose
    with pytest.raises(InputError, match=r"got 'bending'; did you mean 'bending_angle_deg'\?"):
        read_column(space, "bending")


def test_numbers_of_a_failed_pose_are_never_shown(tmp_path: Path) -> None:
    dataset = workspace_dataset(grid(2))
    dataset["status"][5] = "diverged"  # but the file has its numbers
    dataset.to_netcdf(tmp_path / "workspace.nc", engine="h5netcdf")
    found = load_workspace(tmp_path)
    assert np.isnan(found.tip_position[5]).all()
    assert np.isnan(read_column(found, "stretch").values[5])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda f: f.__delitem__("tip_rotation"), "this has no tip_rotation"),
        (lambda f: f["status"].__setitem__(2, "fine"), "unknown status 'fine'"),
        (lambda f: f.attrs.__delitem__("robot"), "robot"),
        (lambda f: f.attrs.__setitem__("material", "{"), "this is not one"),
        (lambda f: f["tip_position_mm"].__setitem__(0, np.nan), "solved but its numbers are missing"),
    ],
)
def test_a_damaged_file_is_one_line(tmp_path: Path, change, words: str) -> None:  # type: ignore[no-untyped-def]
    write_workspace(tmp_path, grid(2))
    with h5py.File(tmp_path / "workspace.nc", "r+") as file:
        change(file)
    with pytest.raises(InputError) as error:
        load_workspace(tmp_path)
    assert words in str(error.value)
    assert str(tmp_path / "workspace.nc") in str(error.value)
    assert "\n" not in str(error.value)


def test_other_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"expected a folder with workspace\.nc or such a file; there is none"):
        load_workspace(tmp_path)
    (tmp_path / "workspace.nc").write_text("no netCDF")
    with pytest.raises(InputError, match=r"expected a workspace\.nc of a sweep"):
        load_workspace(tmp_path)


# --- measured tips ---


def test_the_error_of_measured_tips_is_found_exactly(space: Workspace, tmp_path: Path) -> None:
    P = grid(5)[[0, 1, 31, 62, 124]]
    error = np.array([[3, 0, 4], [0, 0, 1], [-2, 0, 0], [0, 2, 0], [0, 0, 0]]) * MILLIMETRE
    measured = load_measured(measured_file(tmp_path / "m.csv", P, error), 3)
    found = compare_measured(space, measured)
    assert found.error == pytest.approx(error, abs=1e-12)
    assert found.distance == pytest.approx(np.array([5, 1, 2, 2, 0]) * MILLIMETRE, abs=1e-12)
    assert (found.rows, found.unmatched, found.unsolved, found.skipped) == (5, 0, 0, 0)
    assert not found.solved_again.any()
    told = statistics(found.distance)
    assert (told.count, told.mean, told.median, told.largest) == (
        5,
        pytest.approx(2e-3),
        pytest.approx(2e-3),
        pytest.approx(5e-3),
    )
    assert told.rmse == pytest.approx((34 / 5) ** 0.5 * 1e-3)
    assert statistics(np.zeros(0)).count == 0


def test_a_pressure_that_was_not_swept_is_solved(space: Workspace, tmp_path: Path) -> None:
    """The poses come from the rod's boundary value problem, the measurement from the arc that is its exact answer."""
    P = np.array([[0.35, 0.1, 0.0], [0.3, 0.0, 0.0], [0.77, 0.0, 0.5]]) * BAR
    error = np.tile([0.0, 0.0, MILLIMETRE], (3, 1))
    measured = load_measured(measured_file(tmp_path / "m.csv", P, error), 3)
    seen: list[tuple[int, int]] = []
    found = compare_measured(space, measured, progress=lambda done, total: seen.append((done, total)))
    assert found.solved_again.tolist() == [True, False, True]
    assert found.error == pytest.approx(error, abs=1e-6 * MODEL.robot.length)
    assert seen == [(1, 2), (2, 2)]
    without = compare_measured(space, measured, solve=False)
    assert (len(without.row), without.unmatched, without.row.tolist()) == (1, 2, [1])
    # a wider tolerance takes the nearest pose instead
    assert not compare_measured(space, measured, within=0.2 * BAR).solved_again.any()


def test_what_the_file_does_not_tell_is_not_guessed(tmp_path: Path) -> None:
    dataset = workspace_dataset(grid(3))
    law = json.loads(dataset.attrs["material"]) | {"model": "my law"}
    P = np.vstack([grid(3)[4], [0.1 * BAR] * 3])
    file = measured_file(tmp_path / "m.csv", P, np.zeros((2, 3)))
    for attribute, value, words in (
        ("material", law, "does not tell the model in full"),
        ("varied", ["pressure", "tip_force"], "varies tip_force too"),
        ("contact", {"closure": "free"}, "stands at a wall"),
    ):
        changed = dataset.assign_attrs({attribute: json.dumps(value)})
        changed.to_netcdf(tmp_path / "workspace.nc", engine="h5netcdf")
        space = load_workspace(tmp_path)
        with pytest.raises(InputError, match=words):
            model_of(space)
        found = compare_measured(space, load_measured(file, 3))
        assert (len(found.row), found.unmatched) == (1, 1)
        assert words in found.reason


def test_blanks_are_counted_and_other_columns_kept(space: Workspace, tmp_path: Path) -> None:
    P = grid(5)[:3]
    file = measured_file(tmp_path / "m.csv", P, np.zeros((3, 3)), HEADER + ",note", ",as is")
    lines = file.read_text().splitlines()
    cells = lines[2].split(",")
    lines[2] = ",".join([*cells[:4], " ", *cells[5:]])
    lines.insert(2, ",,,,,,,")
    file.write_text("\ufeff" + "\r\n".join(lines))
    measured = load_measured(file, 3)
    found = compare_measured(space, measured)
    assert (found.skipped, found.rows, found.row.tolist()) == (1, 3, [0, 1])
    header, made = comparison_rows(found, measured)
    rows = list(made)
    assert header[:8] == [*HEADER.split(","), "note"]
    assert rows[0][:8] == [*lines[1].split(",")]
    assert [row[header.index("t_s")] for row in rows] == ["0", "2"]
    assert {row[header.index("note")] for row in rows} == {"as is"}
    assert {row[-1] for row in rows} == {"workspace"}
    assert float(rows[1][header.index("error_mm")]) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "got an empty file"),
        (HEADER + "\n", "at least one row"),
        (HEADER + "\n0,0,0,0,,0,60\n", "1 rows have blanks"),
        (HEADER.replace("x_mm", "x") + "\n0,0,0,0,0,0,60\n", "missing column 'x_mm'"),
        (HEADER.replace("p3_bar", "p4_bar") + "\n0,0,0,0,0,0,60\n", "missing column 'p3_bar'"),
        (HEADER + ",p4_bar\n0,0,0,0,0,0,60,0\n", "pressures of 3 chamber sets, got a column 'p4_bar'"),
        (HEADER + ",x_mm\n0,0,0,0,0,0,60,0\n", "each column once, got 'x_mm' 2 times"),
        (HEADER + "\n0,0,0,0,0,60\n", "line 2: expected 7 values as in the header, got 6"),
        (HEADER + "\n0,0,0,0,0,0,60\n1,0,0,0,0,up,60\n", "line 3: y_mm: expected a number, got 'up'"),
        (HEADER + "\n0,0,0,0,nan,0,60\n", "1 rows have blanks"),
        (HEADER + "\n0,0,0,0,inf,0,60\n", "x_mm: expected a finite number"),
        (HEADER + "\n0,0,-0.1,0,0,0,60\n", "p2_bar: expected at least 0 and at most 100 bar, got -0.1"),
        (HEADER + "\n0,0,500,0,0,0,60\n", "p2_bar: expected at least 0 and at most 100 bar, got 500"),
    ],
)
def test_a_measured_file_that_is_wrong_is_one_line(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "m.csv"
    file.write_text(text)
    with pytest.raises(InputError) as error:
        load_measured(file, 3)
    assert words in str(error.value)
    assert str(file) in str(error.value)


def test_no_pair_is_an_error(space: Workspace, tmp_path: Path) -> None:
    file = measured_file(tmp_path / "m.csv", np.full((1, 3), 0.111 * BAR), np.zeros((1, 3)))
    with pytest.raises(InputError, match=r"no pose of .* is within 1e-05 bar of a pressure of m\.csv"):
        compare_measured(space, load_measured(file, 3), solve=False)


# --- two workspaces ---


def test_equal_pressures_are_paired_whatever_the_order(space: Workspace, tmp_path: Path) -> None:
    order = np.random.default_rng(0).permutation(125)[:60]
    move = np.random.default_rng(1).normal(size=(60, 3)) * MILLIMETRE
    other = load_workspace(write_workspace(tmp_path, grid(5)[order], failed={4: "diverged"}, move=move))
    found = compare_workspaces(space, other)
    kept = np.array([k for k in range(60) if k != 4 and order[k] not in (3, 7)])
    assert found.row.tolist() == kept.tolist()
    assert found.error == pytest.approx(-move[kept], abs=1e-9)
    assert found.angle == pytest.approx(np.zeros(len(kept)), abs=1e-12)
    assert found.unsolved == 60 - len(kept)
    header, made = comparison_rows(found)
    rows = list(made)
    assert (len(rows), len(rows[0])) == (len(kept), len(header))
    assert int(rows[5][0]) == kept[5] + 1


def test_pressures_that_do_not_tell_the_pose_are_refused(space: Workspace, tmp_path: Path) -> None:
    """A sweep of loads has several poses at a pressure; with the same rows in the same order they still pair."""
    P = np.repeat(grid(3), 2, axis=0)
    move = np.tile([[0, 0, 0], [MILLIMETRE, 0, 0]], (27, 1))
    loaded = load_workspace(write_workspace(tmp_path / "a", P, move=move))
    with pytest.raises(InputError, match="expected one pose at each pressure"):
        compare_workspaces(space, loaded)
    same = load_workspace(write_workspace(tmp_path / "b", P, move=2 * move))
    assert compare_workspaces(loaded, same).error == pytest.approx(-move, abs=1e-12)


def test_groups_are_the_sets_with_pressure() -> None:
    P = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1, 0, 1], [1, 1, 1]]) * BAR
    found = groups(P)
    assert [(name, mask.sum()) for name, mask in found] == [
        ("none", 1),
        ("set 1", 2),
        ("set 2", 1),
        ("sets 1+3", 1),
        ("sets 1+2+3", 1),
    ]
    many = np.array([[k >> j & 1 for j in range(4)] for k in range(16)]) * BAR
    assert [(name, mask.sum()) for name, mask in groups(many)] == [
        ("none", 1),
        ("1 set", 4),
        ("2 sets", 6),
        ("3 sets", 4),
        ("4 sets", 1),
    ]


# --- the figure and the command ---


def test_the_figure_has_the_quartiles_of_each_group(space: Workspace, tmp_path: Path) -> None:
    P = grid(5)
    move = np.random.default_rng(3).normal(size=(125, 3)) * MILLIMETRE
    found = compare_workspaces(space, load_workspace(write_workspace(tmp_path, P, move=move)))
    figure = comparison_figure(space, found)
    boxes = next(a for a in figure.axes if a.get_xlabel() == "distance of the tips [mm]" and a.patches)
    names = [t.get_text() for t in boxes.get_yticklabels()]
    assert names[-1] == "all  (123)"
    assert len(names) == 1 + len(groups(found.pressure))
    medians = [
        line.get_xdata()[0] for line in boxes.lines if line.get_linewidth() == 1.5 and len(line.get_xdata()) == 2
    ]
    assert medians[-1] == pytest.approx(np.median(found.distance) / MILLIMETRE)
    figure.canvas.draw()


@pytest.mark.thorough
def test_the_command_prints_and_writes(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    P = grid(5)[10:30]
    file = measured_file(tmp_path / "m.csv", P, np.tile([0, 0, 1e-3], (20, 1)))
    out, table = tmp_path / "out", tmp_path / "all.csv"
    assert main(["workspace", str(folder), "--against", str(file), "--out", str(out), "--csv", str(table)]) == 0
    said = capsys.readouterr().out
    assert {f.name for f in out.iterdir()} == {"workspace.png", "dexterity.png", "comparison.png", "comparison.csv"}
    for words in ("125", "123 (1 unstable)", "1 diverged, 1 fold", "convex hull", "cm^3", "worst residual", "1.667"):
        assert words in said
    rows = list(csv.DictReader((out / "comparison.csv").open()))
    assert len(rows) == 20
    assert float(rows[3]["error_z_mm"]) == pytest.approx(1.0, abs=1e-6)
    every = list(csv.DictReader(table.open()))
    assert (len(every), every[3]["status"], every[3]["stretch"], every[3]["p3_bar"]) == (125, "diverged", "", "0.9")
    assert float(every[124]["tip_position_z_mm"]) == pytest.approx(
        arcs(grid(5)[124:])["tip_position"][0, 2] / MILLIMETRE, rel=1e-9
    )


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--colour", "bending_deg"], "did you mean 'bending_angle_deg'"),
        (["--voxel-mm", "0"], "--voxel-mm: expected a number above 0"),
        (["--within-bar", "-1", "--against", "m.csv"], "--within-bar"),
        (["--against", "none.csv"], "no such file"),
    ],
)
def test_bad_input_writes_nothing(
    folder: Path, tmp_path: Path, words: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["workspace", str(folder), "--out", str(tmp_path / "o"), *words]) == 2
    found = capsys.readouterr().err
    assert said in found
    assert found.count("\n") == 1
    assert not (tmp_path / "o").exists()
