"""`softnlp new`: a scenario of each study in which every key is explained, and which runs as it is."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pydantic import BaseModel, ValidationError

from softnlp.cli import main
from softnlp.model.robot import ROBOTS, robot
from softnlp.scenario.check import SCHEMAS
from softnlp.scenario.describe import Key, keys_of
from softnlp.scenario.read import load_scenario, scenario_from_text
from softnlp.scenario.template import examples, template


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def every_key(table: type[BaseModel], place: str = "") -> Iterator[tuple[str, type[BaseModel], Key]]:
    for key in keys_of(table):
        yield f"{place}{key.name}", table, key
        if key.table is not None:
            yield from every_key(key.table, f"{place}{key.name}.")


ALL = {(place, table): (table, key) for s in SCHEMAS.values() for place, table, key in every_key(s)}


def test_every_key_says_what_it_is() -> None:
    silent = [place for (place, _), (_, key) in ALL.items() if key.table is None and not key.meaning]
    assert not silent, f"no line `KEY : MEANING` in the docstring of the table of {silent}"


def refused(table: type[BaseModel], name: str, value: Any) -> list[Any]:
    """Return what the schema has against a value of one key; that others are missing does not count."""
    try:
        table.model_validate({name: value})
    except ValidationError as error:
        return [e for e in error.errors() if e["loc"][0] == name]
    return []


def test_the_example_of_a_key_fits_the_key() -> None:
    for (place, _), (table, key) in ALL.items():
        if key.named or place in ("study", "title"):
            continue
        text = examples(robot("D25L60")).get(place, key.example)
        assert not refused(table, key.name, tomllib.loads(f"x = {text}")["x"]), f"{place} = {text}"


@pytest.mark.parametrize("study", SCHEMAS)
def test_every_key_of_a_study_stands_in_its_scenario(study: str) -> None:
    text = template(study)
    for place, _, key in every_key(SCHEMAS[study]):
        if key.table is None and not place.startswith("requirements."):
            assert key.comment in text, place
        assert key.name in text or place.endswith(".at_most"), place


def uncommented(text: str, table: str) -> str:
    """Return a scenario with one table that was left out: its header, and its last key that has a value of its own."""
    lines = text.splitlines()
    start = next(k for k, line in enumerate(lines) if line.startswith(f"# [{table}]"))
    return "\n".join(
        [*lines[:start], lines[start].removeprefix("# "), lines[start + 1].removeprefix("# "), *lines[start + 2 :]]
    )


@pytest.mark.parametrize("table", ["stiffening", "corrections", "gravity", "tip_load", "solver", "registration"])
def test_a_table_is_used_by_taking_the_marks_away(table: str) -> None:
    asked = scenario_from_text(uncommented(template("blocked-force"), table), "x.toml")
    assert table in tomllib.loads(asked.text)


@pytest.mark.parametrize("name", ROBOTS)
def test_scenarios_of_every_robot_are_read(name: str) -> None:
    for study in SCHEMAS:
        if study != "identify":
            assert scenario_from_text(template(study, name), "x.toml").robot.name == name


STUDIES = [study if study == "forward" else pytest.param(study, marks=pytest.mark.thorough) for study in SCHEMAS]


@pytest.mark.parametrize("study", STUDIES)
def test_it_runs_as_it_is(study: str) -> None:
    assert main(["new", study, "--robot", "D20L40"]) == 0
    assert main(["run", f"{study}.toml", "--json"]) == 0


def test_data_are_written_beside_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", "identify", "--out", "some/fit.toml"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "wrote some/fit.toml",
        "wrote some/fit_measured_angles.csv",
        "softnlp run some/fit.toml",
    ]
    task: Any = load_scenario("some/fit.toml").task
    assert sum(len(m.pressure) for m in task.measurements) == 8


def test_nothing_is_replaced_without_force(capsys: pytest.CaptureFixture[str]) -> None:
    data = Path("identify_measured_angles.csv")
    data.write_text("mine")
    assert main(["new", "identify"]) == 2
    assert capsys.readouterr().err == f"softnlp: {data}: there is such a file already; --force replaces it\n"
    assert data.read_text() == "mine"
    assert not Path("identify.toml").exists()
    assert main(["new", "identify", "--force"]) == 0
    assert data.read_text().startswith("robot,")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["forwards"], "STUDY: expected 'forward', 'blocked-force', "),
        (["forward", "--robot", "D25L6"], "name: expected a robot of the library, got 'D25L6'; did you mean 'D25L60'?"),
        (["forward", "--out", "/"], "/: expected a file, got a folder"),
    ],
)
def test_what_cannot_be_meant_is_one_line(words: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["new", *words]) == 2
    assert told in capsys.readouterr().err
    assert not list(Path().iterdir())
