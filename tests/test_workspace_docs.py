"""The shipped sweeps and the document about them hold what they say."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sweeps import HEAD, QUICK, made_up, plan

from softnlp import load_scenario
from softnlp.base.units import BAR
from softnlp.scenario.read import scenario_from_text
from softnlp.scenario.workspace import WorkspaceTable, plan_of, run_sweep
from softnlp.sweep.columns import columns
from softnlp.sweep.dataset import write_workspace
from softnlp.sweep.journal import Journal

ROOT = Path(__file__).parents[1]
DOCUMENT = (ROOT / "docs" / "workspace.md").read_text()
SHIPPED = {path.stem: path for path in sorted((ROOT / "scenarios" / "workspace").glob("*.toml"))}
CODE = set(re.findall(r"`([^`\n]+)`", DOCUMENT))


@pytest.mark.parametrize(
    ("name", "poses", "highest"),
    [
        ("D25L60_grid", 10_648, 1.2),
        ("D25L60_sequence", 260, 1.2),
        ("D25L60_samples", 4096, 1.2),
        ("D25L60_lengths", 500, 1.2),
        pytest.param("D25L60_blocked", 80, 1.5, marks=pytest.mark.thorough),
    ],
)
def test_a_shipped_sweep_solves(name: str, poses: int, highest: float, tmp_path: Path) -> None:
    """Three poses of each, the first and the last among them."""
    whole = plan_of(load_scenario(SHIPPED[name]))
    assert whole.poses == poses
    assert whole.pressures().max() == pytest.approx(highest * BAR, rel=1e-3)
    some = np.array([0, poses // 2, poses - 1])
    times = None if whole.times is None else whole.times[some]
    summary = run_sweep(replace(whole, values=whole.values[some], order=np.arange(3), times=times), tmp_path)
    assert (summary.poses, summary.failed) == (3, 0)


def test_every_shipped_sweep_is_tested() -> None:
    assert set(SHIPPED) == {"D25L60_grid", "D25L60_sequence", "D25L60_samples", "D25L60_lengths", "D25L60_blocked"}


def test_the_sequence_is_one_point_a_second_and_smooth() -> None:
    sequence = load_scenario(SHIPPED["D25L60_sequence"])
    assert sequence.times is not None
    assert sequence.times.tolist() == list(range(260))
    assert sequence.pressures.max(axis=0) == pytest.approx([1.2 * BAR] * 3, rel=1e-3)
    assert np.abs(np.diff(sequence.pressures, axis=0)).max() < 0.08 * BAR


def test_the_example_of_a_scenario_is_one() -> None:
    (text,) = re.findall(r"```toml\n(.*?)```", DOCUMENT, re.DOTALL)
    assert scenario_from_text(text, "x.toml").step_count == 6**3 * 5 * 2


def test_the_python_example_runs(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("small.toml").write_text(HEAD + QUICK + "[workspace]\nlevels = 2\nto_bar = 0.4\n")
    (code,) = re.findall(r"```python\n(.*?)```", DOCUMENT, re.DOTALL)
    exec(code, {})
    rate, lowest = map(float, capsys.readouterr().out.split())
    assert rate > 0
    assert 50 < lowest < 61


def test_every_key_is_documented() -> None:
    first = re.search(r"key of `\[workspace\]`.*?\n\n", DOCUMENT, re.DOTALL)
    assert first
    named = set(re.findall(r"^\| (.*?) \|", first[0], re.MULTILINE))
    listed = {key for cell in named for key in re.findall(r"`([a-z_]+)`", cell)}
    assert listed == set(WorkspaceTable.model_fields)


def test_every_variable_is_documented(tmp_path: Path) -> None:
    vary = "[workspace.vary]\nrobot.length_mm = { values = [60] }\ntip_load.force_z_N = { values = [0.1] }\n"
    everything = plan("[contact]\n[workspace]\nlevels = 2\nto_bar = 1.0\n" + vary)
    names = {column.name for column in columns(everything)} - {"tip_load_force_x_N", "tip_load_force_y_N"}
    assert names <= CODE
    with Journal(tmp_path / "journal.sqlite", everything, "1", resume=False) as journal:
        for chunk in range(everything.chunks):
            journal.add(made_up(everything, chunk))
        journal.commit()
        write_workspace(tmp_path / "w.nc", everything, journal, {})
    import h5netcdf

    with h5netcdf.File(tmp_path / "w.nc", "r") as file:
        coordinates = {"pose", "set", "chamber", "axis", "row", "col"}
        assert set(file.variables) - coordinates - {"tip_load_force_x_N", "tip_load_force_y_N"} <= CODE


def test_every_option_is_documented(capsys: pytest.CaptureFixture[str]) -> None:
    from softnlp.cli import main

    assert main(["sweep", "--help"]) == 0
    options = set(re.findall(r"--[a-z][a-z-]+", capsys.readouterr().out)) - {"--help", "--version"}
    assert options >= {"--out", "--workers", "--cluster", "--resume", "--csv"}
    assert options <= CODE


def test_links_lead_somewhere() -> None:
    for target in re.findall(r"\]\(([^)]+)\)", DOCUMENT):
        name, _, anchor = target.partition("#")
        file = ROOT / "docs" / name
        assert file.exists(), target
        if anchor:
            headings = re.findall(r"^#+ (.*)$", file.read_text(), re.MULTILINE)
            assert anchor in {re.sub(r"[^\w\- ]", "", h.lower()).replace(" ", "-") for h in headings}, target
