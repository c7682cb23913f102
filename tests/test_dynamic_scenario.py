"""`study = "dynamic"` from the file to the results: what is read, what is refused, what is written."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from softnlp.cli import main
from softnlp.results import load_run, view_of_run
from softnlp.scenario.dynamic import DynamicTask
from softnlp.scenario.read import load_scenario
from softnlp.scenario.run import partial_run, run_scenario

HEAD = """
title = "moves"
study = "dynamic"
[robot]
name = "D25L60"
[material]
name = "Ecoflex 00-50"
model = "mooney-rivlin"
"""
TABLES = """
[pressure]
sequence_bar = [[0.0, 0.0, 0.0], [0.4, 0.0, 0.0]]
t_s = [0.0, 0.02]
[dynamic]
duration_s = 0.04
damping_s = 0.004
lag_s = 0.01
dead_time_s = 0.005
output_step_s = 0.01
tip_mass_g = 2.0
"""


def scenario(folder: Path, text: str = TABLES, **files: str) -> Path:
    for name, content in files.items():
        (folder / f"{name}.csv").write_text(content)
    path = folder / "moves.toml"
    path.write_text(HEAD + text)
    return path


def test_a_run_leaves_its_files(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    import xarray as xr

    path, out = scenario(tmp_path), tmp_path / "out"
    assert main(["run", str(path), "--out", str(out)]) == 0
    assert "0.04" in capsys.readouterr().out
    document = json.loads((out / "results.json").read_text())
    assert [step["t_s"] for step in document["steps"]] == [0.0, 0.01, 0.02, 0.03, 0.04]
    assert all(step["status"] == "solved" and step["residual"] < 1e-8 for step in document["steps"])
    energy = document["energy"]
    assert {"kinetic", "elastic", "pressure_work", "dissipated", "numerical", "gravity", "imbalance"} <= set(energy)
    given = energy["pressure_work"] + energy["load_work"]
    kept = energy["kinetic"] + energy["elastic"] + energy["gravity"] + energy["dissipated"] + energy["numerical"]
    assert kept - given == pytest.approx(energy["imbalance"], abs=1e-12 * energy["exchanged"])
    last = document["steps"][-1]
    assert 0 < last["pressure_bar"][0] < last["regulator_bar"][0] == 0.4
    assert last["energy_kinetic_J"] == energy["kinetic"]
    dataset = xr.load_dataset(out / "results.nc", engine="h5netcdf")
    assert np.allclose(dataset["t_s"], [0.0, 0.01, 0.02, 0.03, 0.04])
    assert dataset["tip_velocity_mm_per_s"].dims == ("step", "axis")
    rows = list(csv.DictReader((out / "table.csv").open()))
    assert float(rows[-1]["tip_position_x_mm"]) == pytest.approx(last["tip_position_mm"][0])
    assert float(rows[-1]["regulator_p1_bar"]) == pytest.approx(0.4)
    view = load_run(out)
    assert view.moving is not None
    assert view.moving.energy["kinetic"][-1] == pytest.approx(energy["kinetic"])
    assert (out / "figure.png").stat().st_size > 10_000


@pytest.mark.parametrize(("engine", "closed"), [("auto", True), ("ipopt", True), ("newton", False)])
def test_each_step_says_its_engine(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], engine: str, closed: bool
) -> None:
    text = TABLES.replace("duration_s = 0.04", "duration_s = 0.02")
    options = "" if engine == "newton" else "ipopt.max_iter = 30\n"
    path = scenario(tmp_path, f'{text}[solver]\nengine = "{engine}"\n{options}')
    assert main(["run", str(path), "--json"]) == 0
    for step in json.loads(capsys.readouterr().out)["steps"]:
        assert step["engine"] == engine
        assert step["ipopt_status"] == ("Solve_Succeeded" if closed else None)
        assert (step["ipopt_iterations"] is not None) == closed
        assert step["residual"] < 1e-8


def test_what_is_stopped_is_kept(tmp_path: Path) -> None:
    """Ctrl-C ends a run between two outputs: those before are a run with a balance of its own."""
    asked = load_scenario(scenario(tmp_path))
    steps: list[Any] = []

    class Stop(Exception):
        pass

    def keep(count: int, step: Any) -> None:
        steps.append(step)
        if count == 2:
            raise Stop

    with pytest.raises(Stop):
        run_scenario(asked, keep)
    done = partial_run(asked, steps)
    assert len(done.steps) == 3
    assert done.energy["kinetic"] > 0
    assert "stopped by the user after 3 of 5 steps" in done.warnings
    assert view_of_run(done).moving is not None


ROWS = "t_s,p1_bar,p2_bar,p3_bar,fx_N\n0,0,0,0,0.02\n0.02,0.3,0,0,0.02\n0.02,0.3,0,0,0\n0.04,0.3,0,0,0\n"
FILE = '[pressure]\nfile = "rows.csv"\n[dynamic]\ndamping_s = 0.004\n'


def test_a_file_has_pressures_and_a_force_over_time(tmp_path: Path) -> None:
    asked = load_scenario(scenario(tmp_path, FILE, rows=ROWS))
    task = asked.task
    assert isinstance(task, DynamicTask)
    assert task.forces is not None
    assert task.asked.duration == 0.04
    assert asked.step_count == 101
    assert task.forces[:, 0].tolist() == [0.02, 0.02, 0.0, 0.0]
    assert not task.forces[:, 1:].any()
    run: Any = run_scenario(asked)
    assert run.steps[0].pose.tip_position[0] > 1e-4  # pulled at rest, before it moves
    assert run.energy["load_work"] != 0
    assert not run.failed


LOG = "t_s,p1_bar,p2_bar,p3_bar\n" + "".join(f"{k / 100},0.1,0,0\n" for k in range(40))


@pytest.mark.parametrize(
    ("text", "files", "said"),
    [
        (FILE, {"rows": ROWS.replace("0.04,", "0.01,")}, "line 5: t_s: expected a time of at least 0.02"),
        (FILE, {"rows": ROWS.replace("0.04,0.3", "0.04,nan")}, "line 5: p1_bar: expected a finite number, got nan"),
        (FILE, {"rows": ROWS.replace("0.04,", "nan,")}, "line 5: t_s: expected a finite number, got nan"),
        (FILE, {"rows": ROWS.replace("0.04,0.3", "0.04,")}, "line 5: p1_bar: expected a number, got ''"),
        (FILE, {"rows": LOG.replace("0.2,0.1,0,0\n0.21,0.1,0,0\n0.22,0.1,0,0\n", "")}, "got a gap of 0.04 s"),
        (FILE, {"rows": ROWS.replace("t_s", "time")}, "t_s"),
        (
            TABLES.replace("t_s = [0.0, 0.02]", ""),
            {},
            "[pressure] t_s: missing; expected the time of each of the 2 rows",
        ),
        (TABLES.replace("[0.0, 0.02]", "[0.02, 0.0]"), {}, "[pressure] t_s: item 2: expected a time of at least 0.02"),
        (TABLES.replace("[0.0, 0.02]", "[0.0]"), {}, "[pressure] t_s: expected 2 times, one a row, got 1"),
        (TABLES + '[[obstacle]]\nkind = "sphere"\n', {}, "[obstacle]: this table is not used by study 'dynamic'"),
        (TABLES + '[solver]\nengine = "newton"\nipopt.tol = 1e-9\n', {}, "not used with the engine 'newton'"),
        (TABLES.replace("lag_s", "leg_s"), {}, "leg_s"),
        (TABLES.replace("damping_s = 0.004", "damping_s = -1.0"), {}, "damping_s"),
        (TABLES.replace("damping_s", 'step_s = "small"\ndamping_s'), {}, "step_s: expected 'auto' or a number above 0"),
        (TABLES.replace("damping_s", "step_s = 5\ndamping_s"), {}, "step_s: expected at most the duration of"),
        (TABLES.replace("0.04\nda", "1e9\nda"), {}, "[dynamic] duration_s: expected at most 100000 s, got 1e+09 s"),
    ],
)
def test_what_is_wrong_is_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, files: dict[str, str], said: str
) -> None:
    assert main(["run", str(scenario(tmp_path, text, **files)), "--json"]) == 2
    shown = capsys.readouterr()
    assert not shown.out
    assert shown.err.count("\n") == 1
    assert said in shown.err


def test_rows_of_ones_own_may_be_as_far_apart_as_they_like(tmp_path: Path) -> None:
    rows = "t_s,p1_bar,p2_bar,p3_bar\n0,0,0,0\n0.01,0.1,0,0\n0.02,0.2,0,0\n3,0.2,0,0\n"
    asked = load_scenario(scenario(tmp_path, FILE, rows=rows))
    assert isinstance(asked.task, DynamicTask)
    assert asked.task.asked.duration == 3.0


def test_a_run_in_which_nothing_moves_warns_of_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its panels have no lines, and so no legends."""
    path = scenario(tmp_path, TABLES.replace("[0.4, 0.0, 0.0]", "[0.0, 0.0, 0.0]"))
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 0
    assert not capsys.readouterr().err
