"""Every kind of broken file is one line that names the file, the table and the key."""

from __future__ import annotations

from pathlib import Path

import pytest
from broken_files import BROKEN, CSV_PRESSURE, HEADER, Broken, scenario

from softnlp.base.errors import InputError
from softnlp.scenario.read import load_scenario, scenario_from_text


def test_the_files_are_broken_only_where_they_say(tmp_path: Path) -> None:
    """The scenario that the broken ones are made from, and its CSV, are accepted."""
    assert scenario_from_text(scenario(), tmp_path / "x.toml").pressures.shape == (3, 3)
    (tmp_path / "p.csv").write_text(HEADER + "0,0,0,0\n")
    assert scenario_from_text(scenario(pressure=CSV_PRESSURE), tmp_path / "x.toml").pressures.shape == (1, 3)


def test_the_names_are_unique() -> None:
    assert len({broken.name for broken in BROKEN}) == len(BROKEN)


@pytest.mark.parametrize("broken", BROKEN, ids=lambda broken: broken.name)
def test_broken_input_is_one_line_naming_the_place(broken: Broken, tmp_path: Path) -> None:
    path = broken.write(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(InputError) as caught:
        load_scenario(path)
    line = str(caught.value)
    assert line.isprintable()  # so on one line, and nothing reaches the terminal but text
    assert len(line) < 1000
    assert line.startswith(f"{path}: ")
    for name in broken.names:
        assert name in line
    assert sorted(tmp_path.rglob("*")) == before


def test_the_file_is_named_as_the_user_did(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("broken.toml").write_text("study = 5\n")
    with pytest.raises(InputError, match=r"^broken\.toml: study: expected "):
        load_scenario("broken.toml")
    with pytest.raises(InputError, match=r"^\./broken\.toml: study: expected "):
        load_scenario("./broken.toml")


def test_a_newline_in_the_file_name_stays_on_the_line(tmp_path: Path) -> None:
    path = tmp_path / "a\nb\x1b.toml"
    path.write_text("study = 5\n")
    with pytest.raises(InputError) as caught:
        load_scenario(path)
    assert str(caught.value).isprintable()
    assert "a\\nb\\x1b.toml" in str(caught.value)


def test_further_errors_are_counted() -> None:
    text = scenario(
        robot="[robot]\nname = 'D25L60'\nlength_mm = -1\n", more="[solver]\naccuracy = 'x'\ntolerance = 0\n"
    )
    with pytest.raises(InputError, match=r"^f: .*length_mm: .*got -1 \(and 2 more: --all-errors\)$"):
        scenario_from_text(text, "f")
    text = scenario(robot="[robot]\nname = 'D25'\n", material="[material]\nname = 'Ecoflex'\nmodel = 'yeoh'\n")
    with pytest.raises(InputError, match=r"^f: .*D25.* \(and 1 more: --all-errors\)$"):
        scenario_from_text(text, "f")


def test_a_misspelt_key_is_not_missing_as_well() -> None:
    text = scenario(robot="[robto]\nname = 'D25L60'\n")
    with pytest.raises(InputError, match=r"did you mean 'robot'\?$"):
        scenario_from_text(text, "f")
