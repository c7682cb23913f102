"""`softnlp convert`: what two studies share stays, what the other does not use goes, what it needs is an example."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from softnlp.cli import main
from softnlp.scenario.check import SCHEMAS
from softnlp.scenario.read import load_scenario

SHIPPED = Path(__file__).parents[1] / "scenarios"
OF_STUDY = {
    "forward": "D25L60_loaded_tip",
    "blocked-force": "blocked/D25L60_weighted",
    "workspace": "workspace/D25L60_sequence",
    "inverse": "inverse/direction",
    "identify": "identify/measured_forces",
    "design": "design/laparoscope_paper",
}


@pytest.mark.parametrize("to", SCHEMAS)
@pytest.mark.parametrize(
    "study", [s if s == "blocked-force" else pytest.param(s, marks=pytest.mark.thorough) for s in OF_STUDY]
)
def test_every_study_becomes_every_other(
    study: str, to: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source, target = SHIPPED / f"{OF_STUDY[study]}.toml", tmp_path / "new.toml"
    if study == to:
        assert main(["convert", str(source), "--study", to, "--out", str(target)]) == 2
        assert "it is of study" in capsys.readouterr().err
        return
    assert main(["convert", str(source), "--study", to, "--out", str(target)]) == 0
    before, after = load_scenario(source), load_scenario(target)
    assert after.study == to
    assert after.material.name == before.material.name
    assert (after.loads.gravity, after.loads.tip_force) == (before.loads.gravity, before.loads.tip_force)
    if study != "identify":
        assert after.robot.name == before.robot.name
    told = capsys.readouterr().out
    old, new = (tomllib.loads(path.read_text()) for path in (source, target))
    for name in set(old) - set(new):
        assert f"dropped: [{name}], which study {to!r} does not use\n" in told
    for name in set(new) - set(old):
        assert f"missing: [{name}], filled by an example" in told
        assert f"# [{name}] was not in {source.name}" in target.read_text()


@pytest.mark.parametrize(
    "to", ["blocked-force", "inverse", "workspace", pytest.param("design", marks=pytest.mark.thorough)]
)
def test_segments_stay_where_the_study_takes_them(to: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, target = SHIPPED / "two_segments.toml", tmp_path / "new.toml"
    assert main(["convert", str(source), "--study", to, "--out", str(target)]) == 0
    after, told = load_scenario(target), capsys.readouterr().out
    kept = to != "design"
    assert ("dropped: [segment]" in told) is not kept
    assert (after.robot.chamber_sets == load_scenario(source).robot.chamber_sets) is kept


def test_comments_and_keys_of_shared_tables(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = tmp_path / "x.toml"
    text = (SHIPPED / "blocked/D25L60_weighted.toml").read_text().replace("[robot]", "# mine\n[robot] # here")
    source.write_text(text)
    assert main(["convert", str(source), "--study", "identify"]) == 0
    told = capsys.readouterr().out
    new = (tmp_path / "x_identify.toml").read_text()
    assert "# mine\n[robot] # here\n" in new
    assert "dropped: [contact] closure, which study 'identify' does not use\n" in told
    assert "closure" not in tomllib.loads(new)["contact"]
    assert (tmp_path / "x_identify_measured_angles.csv").is_file()
    assert source.read_text() == text


def test_files_are_found_from_the_new_folder(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "data/p.csv").write_text("p1_bar,p2_bar,p3_bar\n0,0,0\n0.25,0,0\n")
    head = 'study = "forward"\n[robot]\nname = "D25L60"\n[material]\nname = "Ecoflex 00-50"\nmodel = "yeoh"\n'
    (tmp_path / "x.toml").write_text(head + '[pressure]\nfile = "data/p.csv"\n')
    target = tmp_path / "a/b/y.toml"
    assert main(["convert", str(tmp_path / "x.toml"), "--study", "blocked-force", "--out", str(target)]) == 0
    assert load_scenario(target).pressures[1, 0] == 0.25e5


def test_nothing_is_written_where_something_is_wrong(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source = tmp_path / "x.toml"
    source.write_text('study = "forward"\n[robot]\nname = "D25L6"\n')
    assert main(["convert", str(source), "--study", "inverse", "--all-errors"]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 3
    assert main(["convert", str(source), "--study", "invers"]) == 2
    assert "--study: expected" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["x.toml"]
