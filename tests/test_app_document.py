"""The scenario on the screen: comments stay, single keys change, every study gets the tables that it has."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

pytest.importorskip("tomlkit", reason="the extra gui is not installed")

from hypothesis import given
from hypothesis import strategies as st

from softnlp.app.document import Document
from softnlp.base.errors import InputError
from softnlp.scenario.check import SCHEMAS
from softnlp.scenario.read import scenario_from_text

COMMENTED = """\
# what I tried on Monday
title = "mine"
study = "forward"

[robot]
name = "D25L60"   # the long one

[material]
name = "Ecoflex 00-50"
model = "mooney-rivlin"  # as published

[pressure]
sequence_bar = [[0.8, 0.0, 0.0]]
"""
SCENARIOS = sorted((Path(__file__).parents[1] / "scenarios").rglob("*.toml"))


def test_changing_a_key_and_back_leaves_the_file_as_it_was() -> None:
    document = Document(COMMENTED)
    document.set("robot", "length_mm", 70.0)
    assert "length_mm = 70.0" in document.text()
    assert "# the long one" in document.text()
    document.set("robot", "length_mm", None)
    document.set("gravity", "direction", "-z")
    document.set("gravity", "direction", None)
    assert document.text() == COMMENTED


def test_replacing_a_table_keeps_the_comments_of_what_stays() -> None:
    document = Document(COMMENTED)
    document.replace("material", {"name": "Ecoflex 00-30", "model": "mooney-rivlin"})
    assert 'model = "mooney-rivlin"  # as published' in document.text()
    assert document.get("material", "name") == "Ecoflex 00-30"
    document.replace("material", None)
    assert "material" not in tomllib.loads(document.text())


def test_tables_of_other_studies_are_kept_aside() -> None:
    document = Document(COMMENTED)
    document.set("contact", "closure", "rigid")
    assert "contact" not in tomllib.loads(document.text())
    document.start("blocked-force")
    assert tomllib.loads(document.text())["contact"] == {"closure": "rigid"}
    document.start("forward")
    assert document.text() == COMMENTED
    assert "rigid" in document.source()


@pytest.mark.parametrize("study", ["forward", "blocked-force", "workspace", "inverse"])
def test_every_study_can_start_from_any_robot(study: str) -> None:
    document = Document(COMMENTED)
    document.start(study)
    assert scenario_from_text(document.text(), "x.toml").study == study


@pytest.mark.parametrize("file", SCENARIOS, ids=lambda f: f.name)
def test_a_shipped_scenario_is_written_as_it_was_read(file: Path) -> None:
    text = file.read_text()
    if "study" in text:
        assert Document(text).text() == text


@given(st.integers(1, 9), st.lists(st.lists(st.floats(0, 2), min_size=1, max_size=5), min_size=1, max_size=4))
def test_pressures_follow_the_number_of_sets(sets: int, rows: list[list[float]]) -> None:
    document = Document(COMMENTED)
    document.set("robot", "chamber_sets", sets)
    document.set("pressure", "sequence_bar", rows)
    document.fit_pressures()
    fitted = document.get("pressure", "sequence_bar")
    assert [len(row) for row in fitted] == [sets] * len(rows)
    for row, was in zip(fitted, rows, strict=True):
        kept = min(sets, len(was))
        assert row[:kept] == was[:kept]
        assert not any(row[kept:])


@pytest.mark.parametrize("text", ["= 3", "[robot", "a = 1\na = 2", "x = [" * 500, "\0"])
def test_what_is_not_toml_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="TOML"):
        Document(text)


def test_files_are_found_and_renamed_in_every_table() -> None:
    document = Document(
        'study = "identify"\n[measurements]\nfiles = ["../a.csv", "b.csv"]\n[material]\nfile = "c/d.toml"\n'
    )
    assert document.files() == ["../a.csv", "b.csv", "c/d.toml"]
    document.rename_files(lambda name: Path(name).name)
    assert document.files() == ["a.csv", "b.csv", "d.toml"]


def test_every_study_of_the_package_has_its_tables_filtered() -> None:
    document = Document(COMMENTED)
    for study, schema in SCHEMAS.items():
        assert set(tomllib.loads(document.text(study))) <= set(schema.model_fields)
