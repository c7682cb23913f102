"""`softnlp import`: results that repeat to the byte, exit statuses, and scenarios that name files of laboratories."""

from __future__ import annotations

import json
import os
import pickle
import zipfile
from pathlib import Path

import h5py
import pytest
from laboratory_files import FOLDER

from softnlp.cli import main

SIZES = ["--set", "gauge_length_mm=25", "--set", "area_mm2=8"]


@pytest.mark.parametrize(
    "words",
    [
        ["utm_cyclic.csv", *SIZES],
        ["utm_to_failure_four_columns.csv"],
        ["force_torque_counts.csv", "pressure_log_mbar_absolute.csv"],
        ["daq.lvm"],
        ["pressure_log_mbar_absolute.csv", "daq.lvm"],
        ["workspace_v5.mat"],
        ["tracker_em_two_sensors.csv", "--set", "registration.frame=base sensor", "--set", "base_sensor_mm=[-30,0,0]"],
    ],
)
def test_an_import_repeats_to_the_byte(words: list[str], tmp_path: Path) -> None:
    files = [str(FOLDER / word) if (FOLDER / word).is_file() else word for word in words]
    before = sorted(FOLDER.iterdir())
    assert main(["import", *files, "--out", str(tmp_path / "a")]) == 0
    assert main(["import", str(tmp_path / "a.import.toml"), "--out", str(tmp_path / "b")]) == 0
    for ending in (".csv", ".import.toml"):
        assert (tmp_path / f"a{ending}").read_bytes() == (tmp_path / f"b{ending}").read_bytes()
    assert sorted(FOLDER.iterdir()) == before


def test_exit_statuses(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cyclic = str(FOLDER / "utm_cyclic.csv")
    assert main(["import", cyclic]) == 2
    assert main(["import", cyclic, *SIZES, "--set", "cycle=all"]) == 0
    assert main(["import", cyclic, *SIZES, "--set", "cycle=all", "--strict"]) == 3
    assert main(["import", cyclic, *SIZES, "--set", "cicle=all"]) == 2
    assert "cicle: this setting is not used here; did you mean 'cycle'?" in capsys.readouterr().err
    out = str(tmp_path / "a")
    assert main(["import", cyclic, *SIZES, "--out", out]) == 0
    assert main(["import", cyclic, *SIZES, "--out", out]) == 2
    assert main(["import", cyclic, *SIZES, "--out", out, "--force"]) == 0


def test_the_document(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["import", str(FOLDER / "utm_cyclic.csv"), *SIZES, "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert {"kind", "columns", "units", "rows", "dropped", "checks"} <= set(document)
    assert document["units"] == {"stretch": "1", "stress_MPa": "MPa"}
    assert {"name", "value", "verdict", "message"} <= set(document["checks"][0])


def test_a_changed_file_is_not_imported_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = tmp_path / "daq.lvm"
    source.write_bytes((FOLDER / "daq.lvm").read_bytes())
    assert main(["import", str(source), "--out", str(tmp_path / "a")]) == 0
    source.write_bytes(source.read_bytes() + b"\t1,0\t0,0\t21,5\r\n")
    assert main(["import", str(tmp_path / "a.import.toml")]) == 2
    assert "has changed since it was imported" in capsys.readouterr().err


def test_a_scenario_takes_a_raw_file_and_a_recipe(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["import", str(FOLDER / "utm_cyclic.csv"), *SIZES, "--out", str(tmp_path / "silicone")]) == 0
    found = []
    raw = f'file = "{FOLDER / "utm_cyclic.csv"}"\ngauge_length_mm = 25\narea_mm2 = 8\n'
    inline = f'file = "{FOLDER / "utm_cyclic.csv"}"\nimport = {{ gauge_length_mm = 25, area_mm2 = 8 }}\n'
    for k, file in enumerate((raw, inline, 'file = "silicone.import.toml"\n', 'file = "silicone.csv"\n')):
        (tmp_path / "test.toml").write_text(f'study = "identify"\n[tensile]\nlaws = ["neo-hookean"]\n{file}')
        capsys.readouterr()
        assert main(["identify", str(tmp_path / "test.toml"), "--json"]) == 0, k
        found.append(json.loads(capsys.readouterr().out)["laws"][0]["constants"]["mu0_MPa"])
    assert found == pytest.approx([found[0]] * 4, rel=1e-9)


def test_pressures_of_a_scenario_come_from_a_log(tmp_path: Path) -> None:
    from softnlp import load_scenario

    text = f"""study = "forward"
[robot]
name = "D25L60"
[material]
name = "Ecoflex 00-50"
model = "mooney-rivlin"
[pressure]
file = "{FOLDER / "pressure_log_mbar_absolute.csv"}"
"""
    (tmp_path / "log.toml").write_text(text)
    scenario = load_scenario(tmp_path / "log.toml")
    assert scenario.pressures.shape == (46, 3)
    assert scenario.pressures.max() == pytest.approx(1e5, rel=0.01)
    assert any("atmosphere_bar" in warning for warning in scenario.warnings)


def hostile(folder: Path) -> dict[str, Path]:
    """Write files that could hang, run or fill something."""
    made = {}

    def put(name: str, content: bytes) -> None:
        made[name] = folder / name
        made[name].write_bytes(content)

    put("line.csv", b"1,2," + b"3" * 5_000_000)
    put("columns.csv", b",".join(b"%d" % k for k in range(100_000)))
    put("blanks.csv", b"t_s,p1_bar\n0,1\n1,2\n" + (b"3,4" + b"," * 300_000 + b"\n") * 9)
    put("rows.csv", b"t_s,p1_bar\n" + b"\n" * 10_000_001)
    put("nul.csv", b"t,p1\n0,1\n" + b"\0" * 100_001)
    put("spaces.csv", b"length" + b" " * 300_000 + b"9\nx,y,z\n" + b"1e7,2e7,3e7\n" * 9)
    put("counts.csv", b"counts per N" + b" " * 300_000 + b"x\nFx,Fy,Fz\n" + b"1,2,3\n" * 9)
    put("pickle.csv", pickle.dumps([1, 2]))
    put("text.tdms", b"TDSm" + os.urandom(2000))
    put("cut.mat", (FOLDER / "workspace_v5.mat").read_bytes()[:400])
    with zipfile.ZipFile(folder / "bomb.xlsx", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("xl/workbook.xml", "<workbook/>")
        archive.writestr("xl/worksheets/sheet1.xml", "0" * 20_000_000)
    with zipfile.ZipFile(FOLDER / "utm.xlsx") as source, zipfile.ZipFile(folder / "entity.xlsx", "w") as archive:
        for name in source.namelist():
            head = b'<!DOCTYPE a [<!ENTITY b "c">]>' if name.endswith("sheet1.xml") else b""
            archive.writestr(name, head + source.read(name))
    with h5py.File(folder / "link.mat", "w") as file:
        file["x"] = h5py.ExternalLink("/etc/passwd", "/a")
    with h5py.File(folder / "huge.mat", "w") as file:
        file.create_dataset("z", shape=(10**10,), dtype="f8", chunks=(1000,))
    os.mkfifo(folder / "pipe.csv")
    names = ("bomb.xlsx", "entity.xlsx", "link.mat", "huge.mat", "pipe.csv")
    return made | {name: folder / name for name in names} | {"zero": Path("/dev/zero")}


def test_hostile_files_end_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, path in hostile(tmp_path).items():
        assert main(["import", str(path)]) == 2, name
        said = capsys.readouterr()
        assert said.err.count("\n") == 1, name
        assert said.out == ""
