"""The scenarios that travel with the package: listed, written whole, never over a person's own file."""

from __future__ import annotations

from pathlib import Path

import pytest

from softnlp.cli import main
from softnlp.scenario.examples import shipped_scenarios
from softnlp.scenario.read import load_scenario

CHECKOUT = Path(__file__).parents[1] / "scenarios"


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def written(folder: Path) -> set[str]:
    return {file.relative_to(folder).as_posix() for file in folder.rglob("*") if file.is_file()}


def test_every_scenario_is_listed_with_its_study(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["example"]) == 0
    lines = capsys.readouterr().out.splitlines()
    listed = {line.split()[0]: line.split()[1] for line in lines if line.split()[0] in shipped_scenarios()}
    # all scenarios of the checkout, but not the materials file that one of them names and the published numbers
    there = {file.relative_to(CHECKOUT).with_suffix("").as_posix() for file in CHECKOUT.rglob("*.toml")}
    assert set(listed) == there - {"files/my_silicone", "files/published"}
    assert listed["D25L60_one_set"] == "forward"
    assert listed["blocked/D25L60"] == "blocked-force"


def test_an_example_is_written_and_named_as_a_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["example", "D25L60_one_set"]) == 0
    assert capsys.readouterr().out == "softnlp run scenarios/D25L60_one_set.toml\n"
    assert written(Path("scenarios")) == {"D25L60_one_set.toml"}
    assert load_scenario("scenarios/D25L60_one_set.toml").robot.name == "D25L60"


def test_the_files_that_an_example_names_come_along() -> None:
    assert main(["example", "identify/measured_angles", "--out", "mine"]) == 0
    assert written(Path("mine")) == {"identify/measured_angles.toml", "files/measured_angles.csv"}
    assert main(["example", "own_materials_file", "--out", "soft"]) == 0
    assert written(Path("soft")) == {"own_materials_file.toml", "files/my_silicone.toml"}


def test_all_of_them_are_written_as_they_are_and_can_be_read() -> None:
    assert main(["example", "--all", "--out", "every"]) == 0
    there = written(CHECKOUT) - {"files/published.toml"}  # which no scenario names
    assert written(Path("every")) == there
    for name in there:
        assert Path("every", name).read_bytes() == (CHECKOUT / name).read_bytes()
    for name in shipped_scenarios():
        load_scenario(Path("every", f"{name}.toml"))


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (["D25L60_one_sat"], "did you mean 'D25L60_one_set'?"),
        (["D25L60_one_set", "--all"], "expected a name or --all, got both"),
        (["D25L60_one_set", "--out", "file"], "expected a folder, got a file"),
        (["D15L60_hanging", "--out", "full"], "there is such a file already"),
        (["--all", "--out", "full"], "there is such a file already"),
    ],
)
def test_what_cannot_be_written_is_one_line(words: list[str], reason: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("file").write_text("mine")
    Path("full").mkdir()
    Path("full/D15L60_hanging.toml").write_text("mine")
    assert main(["example", *words]) == 2
    out, line = capsys.readouterr()
    assert out == ""
    assert reason in line
    assert line.count("\n") == 1
    assert written(Path()) == {"file", "full/D15L60_hanging.toml"}
    assert Path("full/D15L60_hanging.toml").read_text() == "mine"
