"""TDMS and MAT files: named channels, tables and timetables; nothing that grows without limit."""

from __future__ import annotations

import zlib
from pathlib import Path

import numpy as np
import pytest
from laboratory_files import FOLDER, SPECIMEN, imported

from softnlp.base.errors import InputError

matio = pytest.importorskip("matio")
nptdms = pytest.importorskip("nptdms")
pandas = pytest.importorskip("pandas")


def test_channels_of_a_tdms_file_have_units_and_steps(tmp_path: Path) -> None:
    stretch = np.linspace(1, 2.2, 61)
    columns = {"Extension": (25 * (stretch - 1), "mm"), "Load": (0.24 * (stretch - stretch**-2), "N")}
    with nptdms.TdmsWriter(str(tmp_path / "a.tdms")) as writer:
        given = {"wf_increment": 0.1}
        for name, (values, unit) in columns.items():
            writer.write_segment([nptdms.ChannelObject("g", name, values, {"unit_string": unit, **given})])
    found = imported(str(tmp_path / "a.tdms"), **SPECIMEN)
    assert found.numbers["shear_modulus_MPa"] == pytest.approx(0.03)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("version", ["v7", "v7.3"])
def test_a_timetable_is_a_log(version: str, tmp_path: Path) -> None:
    times = pandas.to_timedelta(0.1 * np.arange(40), unit="s")
    table = pandas.DataFrame({"p1_kPa": 50.0 * (np.arange(40) % 8 > 3), "p2_kPa": np.zeros(40)}, index=times)
    matio.save_to_mat(str(tmp_path / "log.mat"), {"log": table}, version=version)
    found = imported(str(tmp_path / "log.mat"))
    assert found.kind == "pressure"
    assert found.columns["p1_bar"].max() == pytest.approx(0.5)
    np.testing.assert_allclose(found.columns["t_s"], 0.1 * np.arange(40), atol=1e-9)


def test_a_file_that_would_grow_too_large_is_refused(tmp_path: Path) -> None:
    head = (FOLDER / "workspace_v5.mat").read_bytes()[:128]
    large = zlib.compress(b"\0" * 170_000_000)
    (tmp_path / "large.mat").write_bytes(head + (15).to_bytes(4, "little") + len(large).to_bytes(4, "little") + large)
    with pytest.raises(InputError, match="more than 20000000 numbers"):
        imported(str(tmp_path / "large.mat"))
