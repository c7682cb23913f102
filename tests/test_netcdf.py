"""What is written as netCDF is read by others too: ncdump, netCDF4 and Pint, every variable and attribute of it."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import netCDF4
import numpy as np
import pint
import pytest
import xarray as xr
from arc_runs import arc_step, ramp_run, run_of, weighted_run
from sweeps import made_up, plan

from softnlp.model.materials import Material, formula_law
from softnlp.model.robot import robot
from softnlp.results import load_run, netcdf_bytes, to_dataset, view_of_run
from softnlp.sweep.dataset import write_workspace
from softnlp.sweep.journal import Journal
from softnlp.sweep.read import load_workspace, read_column

UNITS = pint.UnitRegistry()
TITLE = "Übung № 1, ∂x"
LAW = Material("Knete ä", formula_law("mine", "c * (stretch - stretch**-2)", ["c"]), {"c": 0.03})
RUNS = {
    "all failed": ramp_run(steps=3, failed=(0, 1, 2), material=LAW, title=TITLE),
    "timed": run_of([arc_step(robot("laparoscope-9"), [1e4, 2e4, 0], time=3.0)], "laparoscope-9", title=""),
    "weighted": replace(weighted_run(), title=TITLE),
}
SWEEP = "sweep"
VARIED = (
    '[contact]\nclosure = "free"\n[workspace]\nlevels = 2\nto_bar = 1.0\n[workspace.vary]\nrobot.length_mm = '
    "{ values = [60] }\n"
    "tip_load.force_z_N = { values = [0.1, 0.2] }\ntip_load.moment_x_Nmm = { values = [0.1] }\n"
    "material.density_kg_m3 = { values = [1000] }\nmaterial.C10_MPa = { values = [0.01] }\n"
)


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Write runs with every kind of variable, and sweeps, with text that is not ASCII."""
    folder = tmp_path_factory.mktemp("netcdf")
    made = {}
    for k, (name, run) in enumerate(RUNS.items()):
        made[name] = folder / f"{k}.nc"
        made[name].write_bytes(netcdf_bytes(run))
    given, made[SWEEP] = plan(VARIED), folder / "sweep.nc"
    with Journal(folder / "journal.sqlite", given, "1", resume=False) as journal:
        for chunk in range(given.chunks):
            journal.add(made_up(given, chunk))
        journal.commit()
        write_workspace(made[SWEEP], given, journal, {"title": TITLE, "scenario": "é" * 100_000})
    return made


KINDS = (*RUNS, SWEEP)


@pytest.mark.parametrize("kind", KINDS)
def test_text_is_characters_and_ncdump_reads_all_of_it(kind: str, files: dict[str, Path]) -> None:
    if shutil.which("ncdump") is None:
        pytest.skip("ncdump is not installed (Debian: netcdf-bin)")
    done = subprocess.run(["ncdump", str(files[kind])], capture_output=True, check=True)
    text = done.stdout.decode()
    header, _, data = text.partition("\ndata:\n")
    assert not re.findall(r"^\s*string .*", header, re.MULTILINE)
    assert "char status(" in header
    if kind != "timed":
        assert f'title = "{TITLE}"' in header
    with netCDF4.Dataset(files[kind]) as file:
        for name, variable in file.variables.items():
            assert not variable.size or f"\n {name} =" in data, name


@pytest.mark.parametrize("kind", KINDS)
def test_every_attribute_is_of_a_fixed_length_or_a_number(kind: str, files: dict[str, Path]) -> None:
    """Of the file and of what is in it, h5py's view; netCDF's own are no text."""

    def judge(_: str, thing: Any) -> None:
        for name in thing.attrs:
            kept = h5py.check_string_dtype(thing.attrs.get_id(name).dtype)
            assert kept is None or kept.length is not None, (thing.name, name)

    with h5py.File(files[kind]) as file:
        judge("", file)
        file.visititems(judge)


@pytest.mark.parametrize("kind", KINDS)
def test_netcdf4_reads_what_xarray_reads(kind: str, files: dict[str, Path]) -> None:
    given = xr.load_dataset(files[kind], engine="h5netcdf")
    with netCDF4.Dataset(files[kind]) as file:
        assert {name: file.getncattr(name) for name in file.ncattrs() if file.getncattr(name)} == {
            name: value for name, value in given.attrs.items() if value
        }
        for name, variable in file.variables.items():
            assert variable.dtype is not str, name
            assert variable.units == given[name].attrs["units"]
            assert variable.long_name == given[name].attrs["long_name"]
            np.testing.assert_array_equal(np.ma.filled(variable[...], np.nan), given[name].values, err_msg=name)


@pytest.mark.parametrize("kind", KINDS)
def test_pint_reads_every_unit(kind: str, files: dict[str, Path]) -> None:
    found = xr.load_dataset(files[kind], engine="h5netcdf")
    for name, variable in found.variables.items():
        UNITS.Quantity(variable.values, variable.attrs["units"])
        assert name != "curvature_per_m" or UNITS.Unit(variable.attrs["units"]) == UNITS.Unit("1/metre")
        assert not str(name).endswith(("_N", "_Nmm", "_mm", "_Nm")) or UNITS.Unit(variable.attrs["units"]) in (
            UNITS.newton, UNITS.newton * UNITS.mm, UNITS.mm, UNITS.newton * UNITS.metre
        )  # fmt: skip


@pytest.mark.parametrize("kind", RUNS)
def test_what_comes_back_is_the_dataset_of_the_run(kind: str, files: dict[str, Path]) -> None:
    """Numbers, texts, coordinates and attributes; only the moment of writing differs."""
    wanted, found = to_dataset(RUNS[kind]), xr.load_dataset(files[kind], engine="h5netcdf")
    for dataset in (wanted, found):
        del dataset.attrs["created"]
    assert set(found.coords) == set(wanted.coords)
    xr.testing.assert_equal(found, wanted)
    assert {name: str(value) for name, value in found.attrs.items() if value} == {
        name: value for name, value in wanted.attrs.items() if value
    }
    assert load_run(files[kind]).title == RUNS[kind].title


def test_files_of_version_0_1_are_read_as_before(files: dict[str, Path], tmp_path: Path) -> None:
    """They had texts of type `string`, in variables and attributes."""
    old = tmp_path / "results.nc"
    to_dataset(RUNS["weighted"]).to_netcdf(old, engine="h5netcdf")
    one, other = load_run(old), view_of_run(RUNS["weighted"])
    assert (one.title, one.status, one.material) == (other.title, other.status, other.material)
    old = tmp_path / "workspace.nc"
    xr.load_dataset(files[SWEEP], engine="h5netcdf").pipe(_as_strings).to_netcdf(old, engine="h5netcdf")
    one, other = load_workspace(old), load_workspace(files[SWEEP])
    assert one.title == other.title == TITLE
    assert one.attributes["material"] == other.attributes["material"]
    np.testing.assert_array_equal(one.status, other.status)
    assert set(one.status) > {0}
    for name in ("blocked_force_N", "tip_position_x_mm", "p2_bar"):
        columns = [read_column(found, name) for found in (one, other)]
        assert columns[0].unit == columns[1].unit != "1"
        assert columns[0].meaning == columns[1].meaning
        np.testing.assert_array_equal(columns[0].values, columns[1].values)


def _as_strings(dataset: xr.Dataset) -> xr.Dataset:
    """Forget that the texts were characters."""
    for variable in dataset.variables.values():
        variable.encoding.clear()
    return dataset


def test_equations_stand_by_unit() -> None:
    """Each error in the variable of its unit, and in no other."""
    run = RUNS["weighted"]
    found = to_dataset(run)
    for k, step in enumerate(run.steps):
        for line in step.certificate:
            label = "certificate" if line.unit == "1" else f"certificate_{line.unit.replace(' ', '')}"
            assert found[label].sel(equation=line.equation).values[k] == line.value
            others = [n for n in found if re.fullmatch(r"certificate(_(?!scaled)\w+)?", str(n)) and n != label]
            assert all(np.isnan(found[n].sel(equation=line.equation).values[k]) for n in others)
    assert json.loads(found.attrs["contact"])["closure"] == "weighted"
