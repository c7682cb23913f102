"""Trackers and loggers: frames, quaternions, missing rows, gauge pressures, the lag between clocks."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from laboratory_files import FOLDER, TRUTH, check_of, imported
from scipy.spatial.transform import Rotation

from softnlp.laboratory.choices import AskError
from softnlp.laboratory.poses import motion_axis
from softnlp.laboratory.signals import lag_between, plateaus

EM = TRUTH["tracker_em_two_sensors.csv"]
BASE = {"frame": "base sensor", "base_sensor_mm": [-30, 0, 0], "tip_offset_mm": EM["tip_offset_mm"]}
GIVEN = {
    "rotation_world_from_base_quat_xyzw": EM["rotation_world_from_base_quat_xyzw"],
    "translation_mm": EM["translation_mm"],
    "tip_offset_mm": EM["tip_offset_mm"],
}
AXES = ("x_mm", "y_mm", "z_mm")


def tips(found: object) -> np.ndarray:
    """Return the tips of an import."""
    return np.column_stack([found.columns[name] for name in AXES])  # type: ignore[attr-defined]


def test_both_trackers_give_the_same_tips_with_the_rest_tip_on_the_axis() -> None:
    em = imported("tracker_em_two_sensors.csv", **BASE)
    optical = imported("tracker_optical_states.csv", **GIVEN)
    np.testing.assert_allclose(tips(em), tips(optical), atol=0.02)
    for found in (
        em,
        optical,
        imported("tracker_optical_states.csv", frame="rest", length_mm=60, tip_offset_mm=[3, -1, 8]),
    ):
        np.testing.assert_allclose(np.median(tips(found)[:19], axis=0), [0, 0, 60], atol=0.2)
        assert found.choices.dropped == {"rows in which the sensor was not seen": EM["missing_rows"]}
        assert check_of(found, "lost share").value == pytest.approx(0.05)


def test_the_frame_of_a_file_with_a_base_sensor_is_asked() -> None:
    with pytest.raises(AskError, match=r"frame='base sensor'.*frame=given"):
        imported("tracker_em_two_sensors.csv")


def test_a_wrong_order_of_a_quaternion_is_noticed() -> None:
    found = imported("tracker_em_two_sensors.csv", **BASE, quaternion="xyzw", length_mm=60)
    assert "quaternion=wxyz" in check_of(found, "quaternion order").message
    assert check_of(found, "rest tip, away from (0, 0, length)").verdict == "warned"
    assert check_of(imported("tracker_em_two_sensors.csv", **BASE), "quaternion order").verdict == "passed"


@pytest.mark.parametrize("lost", [-3.697314e28, -9999.0, 999.99])
@pytest.mark.parametrize("unit", ["", " (mm)"])
def test_numbers_that_stand_for_a_lost_sensor_are_no_tips(lost: float, unit: str, tmp_path: Path) -> None:
    rows = np.array([0.0, 0.0, 60.0]) + np.random.default_rng(1).normal(scale=2.0, size=(60, 3))
    rows[[3, 40]] = lost
    header = ",".join(f"{axis}{unit}" for axis in "xyz")
    np.savetxt(tmp_path / "tips.csv", rows, delimiter=",", header=header, comments="")
    found = imported(str(tmp_path / "tips.csv"))
    assert found.choices.dropped == {"rows in which the sensor was not seen": 2}
    assert np.max(np.abs(tips(found))) < 100


def test_whole_numbers_without_a_unit_may_be_counts(tmp_path: Path) -> None:
    counts = 101 + np.round(np.column_stack([80 * np.abs(np.sin(np.arange(60) / 9 + k)) for k in range(3)]))
    counts[:5] = 101
    file = tmp_path / "log.csv"
    np.savetxt(file, np.column_stack([np.arange(60) * 50, counts]), "%d", ",", header="millis,p1,p2,p3", comments="")
    with pytest.raises(AskError, match="calibration="):
        imported(str(file), kind="pressure")
    found = imported(str(file), kind="pressure", calibration=[101, 0.01])
    assert found.columns["p1_bar"] == pytest.approx((counts[:, 0] - 101) / 100)


def test_centimetres_are_not_taken_for_millimetres(tmp_path: Path) -> None:
    bend = np.linspace(0.01, 1.2, 60)
    rows = 6 * np.column_stack([(1 - np.cos(bend)) / bend, 0 * bend, np.sin(bend) / bend])
    np.savetxt(tmp_path / "tips.csv", rows, delimiter=",", header="x,y,z", comments="")
    with pytest.raises(AskError, match=r"within 5.*unit\.position=mm, or cm"):
        imported(str(tmp_path / "tips.csv"))
    assert tips(imported(str(tmp_path / "tips.csv"), unit__position="cm"))[0, 2] == pytest.approx(60, abs=0.1)
    np.savetxt(tmp_path / "tips.csv", 10 * rows, delimiter=",", header="x,y,z", comments="")
    assert tips(imported(str(tmp_path / "tips.csv")))[0, 2] == pytest.approx(60, abs=0.1)


@pytest.mark.parametrize("sense", [1, -1])
def test_turns_of_the_other_sense_are_warned_of(sense: int, tmp_path: Path) -> None:
    bend = np.linspace(0.01, 1.2, 60)
    tip = 60 * np.column_stack([(1 - np.cos(bend)) / bend, 0 * bend, np.sin(bend) / bend])
    R = Rotation.from_rotvec(np.outer(bend, [0, 1, 0]))
    q = R.as_quat() * [sense, sense, sense, 1]
    header = "x_mm,y_mm,z_mm,qx,qy,qz,qw"
    rows = np.column_stack([tip + R.apply([0, 0, 8]), q])
    np.savetxt(tmp_path / "tips.csv", rows, delimiter=",", header=header, comments="")
    found = imported(str(tmp_path / "tips.csv"), tip_offset_mm=[0, 0, 8])
    check = check_of(found, "cosine between the tip's motion and its turn")
    assert check.value == pytest.approx(sense, abs=0.05)
    assert check.verdict == ("passed" if sense > 0 else "warned")
    assert np.allclose(tips(found), tip, atol=1e-3) == (sense > 0)


def test_metres_and_an_upward_y(tmp_path: Path) -> None:
    found = imported("tracker_optical_states.csv", **GIVEN)
    turn = Rotation.from_rotvec([-np.pi / 2, 0, 0])  # z up to y up
    q = np.column_stack([found.columns[name] for name in ("qx", "qy", "qz", "qw")])
    rows = np.column_stack([turn.apply(tips(found)) / 1e3, (turn * Rotation.from_quat(q)).as_quat()])
    np.savetxt(tmp_path / "m.csv", rows, delimiter=",", header="x,y,z,qx,qy,qz,qw", comments="", fmt="%.9f")
    again = imported(str(tmp_path / "m.csv"), up="y")
    assert again.choices.used["unit.position"] == "m"
    np.testing.assert_allclose(tips(again), tips(found), atol=1e-4)


def test_a_log_becomes_gauge() -> None:
    found = imported("pressure_log_mbar_absolute.csv")
    assert (found.choices.used["unit.pressure"], found.choices.used["zero"]) == ("mbar", "absolute")
    P = np.column_stack([found.columns[f"p{k}_bar"] for k in (1, 2, 3)])
    assert np.abs(P[:4]).max() < 0.01
    np.testing.assert_allclose(P[7:11, 0], 1.0, atol=0.01)
    assert check_of(found, "offset between two clocks of a file").value == pytest.approx(0.35, abs=0.01)


@pytest.mark.parametrize("other", ["force_torque_counts.csv", "daq.lvm"])
def test_the_lag_between_two_files(other: str) -> None:
    files = (other, "pressure_log_mbar_absolute.csv")
    found = imported(*(files if other.startswith("force") else reversed(files)))
    assert found.numbers["lag_s"] == pytest.approx(TRUTH["pressure_log_mbar_absolute.csv"]["clock_offset_s"], abs=0.05)


def test_forces_lose_their_bias_and_take_the_pressures_of_plateaus() -> None:
    alone = imported("force_torque_counts.csv")
    np.testing.assert_allclose(alone.choices.used["tare_N"], TRUTH["force_torque_counts.csv"]["bias_N"], atol=0.01)
    both = imported("force_torque_counts.csv", "pressure_log_mbar_absolute.csv")
    np.testing.assert_allclose(both.columns["fx_N"], -0.9 * both.columns["p1_bar"], atol=0.01)
    assert both.rows == 11
    warned = [check.name for check in both.checks if check.verdict == "warned"]
    assert warned == ["offset between two clocks of a file", "lag between two files"]  # not that two sets push nothing


def test_a_log_without_header_and_one_of_labview() -> None:
    names = ["t_ms", "p1_V", "p2_V"]
    with pytest.raises(AskError, match="calibration"):
        imported("pressure_log_no_header.csv", columns=names)
    found = imported("pressure_log_no_header.csv", columns=names, calibration=[0.5, 0.8])
    assert np.max(found.columns["p1_bar"]) == pytest.approx(2.0)
    lvm = imported("daq.lvm")
    assert list(lvm.columns) == ["t_s", "p1_bar", "p2_bar"]
    assert lvm.columns["t_s"][-1] == pytest.approx(2.19)


def test_a_mat_file_holds_pressures_and_tips() -> None:
    found = imported("workspace_v5.mat")
    assert list(found.columns) == ["p1_bar", "p2_bar", "p3_bar", *AXES]
    np.testing.assert_allclose(tips(found)[0], [0, 0, 60], atol=0.1)


def test_a_pointer_is_named() -> None:
    with pytest.raises(Exception, match="Git LFS pointer to a file of 12345 bytes"):
        imported("lfs_pointer.csv")


def test_plateaus_and_lags_of_a_known_signal() -> None:
    random = np.random.default_rng(0)
    levels = np.repeat(random.uniform(0, 1, (10, 2)), 20, axis=0)
    time = 0.05 * np.arange(200)
    response = levels @ random.uniform(-1, 1, (2, 3)) + random.normal(0, 1e-3, (200, 3))
    assert [len(rows) for rows in plateaus(response)] == [16] * 10
    lag, error, quality = lag_between(time, response, time + 0.4, levels)
    assert abs(lag - 0.4) <= max(error, 0.05)
    assert quality > 0.99


def test_the_lag_of_a_long_record_with_short_plateaus_is_found() -> None:
    random = np.random.default_rng(1)
    time = 0.5 * np.arange(4000)
    held = random.choice([0, 0.4, 0.8, 1.2], size=(1001, 3))[(time / 2).astype(int)]
    response = held @ random.uniform(-20, 20, (3, 3)) + random.normal(scale=0.2, size=(4000, 3))
    lag, error, quality = lag_between(time, response, time + 7.3, held)
    assert abs(lag - 7.3) <= error <= 0.5
    assert quality > 0.99


def test_files_of_the_folder_are_those_of_the_truth() -> None:
    assert all((FOLDER / name).is_file() for name in TRUTH)


LOG = 640 + 1000 * np.repeat(np.array([[0, 0], [0.5, 0], [1, 0], [0, 0.7], [0, 0]]), 20, axis=0)


def log_file(folder: Path, cells: list[str], name: str = "Time", values: np.ndarray = LOG) -> str:
    """Write a log of two pressures [mbar] with these cells of its clock."""
    rows = [f"{cell},{a:.1f},{b:.1f}" for cell, (a, b) in zip(cells, values, strict=True)]
    (folder / "log.csv").write_text("\n".join([f"{name},p1 (mbar),p2 (mbar)", *rows]) + "\n")
    return str(folder / "log.csv")


def test_a_rest_at_neither_0_nor_the_air_is_asked_about(tmp_path: Path) -> None:
    file = log_file(tmp_path, [f"{k / 10}" for k in range(100)], "Time (s)")
    with pytest.raises(
        AskError, match=r"level at which all sets rest is 0\.64 bar, expected at most 0\.1.*zero=absolute"
    ):
        imported(file)
    for zero, rest in (("absolute", 0.0), ("tare", 0.0), (0.6, 0.04), ("gauge", 0.64)):
        assert imported(file, zero=zero).columns["p1_bar"][0] == pytest.approx(rest, abs=1e-6)


@pytest.mark.parametrize("form", ["%H:%M:%S.%f", "%I:%M:%S %p", "%m/%d/%Y %H:%M:%S", "ms"])
def test_a_clock_goes_on_past_midnight(form: str, tmp_path: Path) -> None:
    start = datetime(2025, 4, 3, 23, 58, 0)
    moments = [start + timedelta(seconds=3 * k) for k in range(100)]
    since = [(m - m.replace(hour=0, minute=0, second=0)).total_seconds() for m in moments]
    cells = [f"{1000 * s:.0f}" if form == "ms" else m.strftime(form) for m, s in zip(moments, since, strict=True)]
    name = "Timestamp (ms since midnight)" if form == "ms" else "Time"
    found = imported(log_file(tmp_path, cells, name, LOG - 640))
    np.testing.assert_allclose(np.diff(found.columns["t_s"]), 3.0)
    assert any("begins again at midnight, in row 41" in note for note in found.choices.notes)


BEND = np.column_stack([np.linspace(0.01, 1.2, 90)] * 3) * np.repeat([1, 0.7, 0.4], 30)[:, None]
TURN = np.linspace(0, 12 * np.pi, 90)
CAP = 60 * np.column_stack([(1 - np.cos(BEND[:, 0])) * np.cos(TURN), (1 - np.cos(BEND[:, 0])) * np.sin(TURN), 0 * TURN])
CAP = CAP / BEND + 60 * np.sin(BEND) / BEND * [0, 0, 1]
PLANE = 60 * np.column_stack(
    [(1 - np.cos(BEND[:30, 0])) / BEND[:30, 0], 0 * BEND[:30, 0], np.sin(BEND[:30, 0]) / BEND[:30, 0]]
)


@pytest.mark.parametrize("tip", [CAP, PLANE], ids=["all around", "in a plane"])
@pytest.mark.parametrize(("up", "turn"), [("z", 0.0), ("y", -np.pi / 2), ("-y", np.pi / 2)])
def test_a_robot_that_is_not_along_z_is_named(tip: np.ndarray, up: str, turn: float, tmp_path: Path) -> None:
    rows = Rotation.from_rotvec([turn, 0, 0]).apply(tip) + np.random.default_rng(0).normal(0, 0.03, tip.shape)
    np.savetxt(tmp_path / "tips.csv", rows, delimiter=",", header="x_mm,y_mm,z_mm", comments="")
    found = imported(str(tmp_path / "tips.csv"))
    names = ("angle between the robot by its motion and z", "angle between the rest tip and z")
    told = [check_of(found, name) for name in names]
    assert [check.verdict for check in told] == ["passed" if up == "z" else "warned"] * 2
    if up != "z":
        assert f"--set up={up}" in told[1].message
        again = imported(str(tmp_path / "tips.csv"), up=up)
        assert [check_of(again, name).verdict for name in names] == ["passed"] * 2
        np.testing.assert_allclose(tips(again), tip, atol=0.2)


def test_two_tips_tell_no_axis() -> None:
    assert motion_axis(np.array([[0.0, 0.0, 0.06], [0.02, 0.0, 0.05]]), np.array([0.0, 0.0, 0.06])) is None


@pytest.mark.parametrize(
    ("name", "first", "step"),
    [("ms", 0.0, 50.0), ("Unix Time", 1.74e9, 0.05), ("Time", 45720.0, 0.05 / 86400), ("Temps (s)", 0.0, 0.05)],
)
def test_clocks_have_many_names_and_counts(name: str, first: float, step: float, tmp_path: Path) -> None:
    file = log_file(tmp_path, [f"{first + k * step:.15g}" for k in range(100)], name, LOG + 373)
    time = np.genfromtxt(imported(file).csv().splitlines(), delimiter=",", names=True)["t_s"]
    np.testing.assert_allclose(time - time[0], 0.05 * np.arange(100), atol=2e-4)


def test_a_small_level_at_rest_is_warned_of(tmp_path: Path) -> None:
    found = imported(log_file(tmp_path, [f"{k / 10}" for k in range(100)], "Time (s)", LOG - 580))
    assert check_of(found, "level at which all sets rest").verdict == "warned"


def test_a_robot_that_only_grows_longer_is_not_turned_round(tmp_path: Path) -> None:
    p = np.random.default_rng(0).uniform(0, 1, (300, 3)) * (np.arange(300) > 0)[:, None]
    rows = np.column_stack([20 * p[:, 0] - 10 * (p[:, 1] + p[:, 2]), 17 * (p[:, 1] - p[:, 2]), 60 + p.sum(axis=1)])
    np.savetxt(tmp_path / "tips.csv", rows, delimiter=",", header="x_mm,y_mm,z_mm", comments="")
    check = check_of(imported(str(tmp_path / "tips.csv")), "angle between the robot by its motion and z")
    assert check.verdict == "passed"


def test_a_sensor_that_was_never_seen_is_asked_about(tmp_path: Path) -> None:
    header = "x (m),y (m),z (m)"
    np.savetxt(tmp_path / "tips.csv", CAP, delimiter=",", header=header, comments="", fmt="%.4f")
    with pytest.raises(AskError, match=r"seen in no row, or only beyond 10 m.*unit\.NAME=mm"):
        imported(str(tmp_path / "tips.csv"))
    found = imported(str(tmp_path / "tips.csv"), unit__x="mm", unit__y="mm", unit__z="mm")
    np.testing.assert_allclose(tips(found), CAP, atol=1e-3)


def test_one_unit_for_all_sensors_and_tools_by_number(tmp_path: Path) -> None:
    rows = [
        f"{s},{k / 10},{','.join(f'{v:.4f}' for v in (tip if s == 2 else 0 * tip + 0.1))}"
        for k, tip in enumerate(CAP)
        for s in (1, 2)
    ]
    (tmp_path / "tips.csv").write_text("\n".join(["Sensor,Time (s),X,Y,Z", *rows]))
    found = imported(str(tmp_path / "tips.csv"), frame="given")
    assert (found.choices.used["unit.position"], found.choices.used["base"]) == ("mm", "1")
    np.testing.assert_allclose(tips(found), CAP, atol=1e-3)
    (tmp_path / "cm.csv").write_text(
        "Take 1,Length Units,Centimeters\n\nX,Y,Z\n" + "\n".join(f"{a:.5f},{b:.5f},{c:.5f}" for a, b, c in CAP / 10)
    )
    np.testing.assert_allclose(tips(imported(str(tmp_path / "cm.csv"))), CAP, atol=1e-3)
