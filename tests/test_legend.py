"""`--legend`: every column of a table is explained, from the registry that the table is made of."""

from __future__ import annotations

from pathlib import Path

import pytest

from softnlp.base.columns import LEGENDS, OUTPUTS, SYMBOLS, TABLES, WORDS, legend
from softnlp.cli import main

SHIPPED = Path(__file__).parents[1] / "scenarios"


def test_every_row_says_what_it_is() -> None:
    for study, names in LEGENDS.items():
        for row in legend(names):
            assert all(row[k] for k in (0, 1, 2, 4)), (study, row)
    assert set(SYMBOLS) <= set(OUTPUTS)
    assert not set(WORDS) & set(OUTPUTS)


@pytest.mark.parametrize("study", ["forward", "blocked-force", "inverse"])
def test_what_a_table_shows_is_in_its_legend(study: str) -> None:
    assert set(TABLES[study]) <= set(LEGENDS[study])


@pytest.mark.parametrize(
    ("words", "rows"),
    [
        (["run", "D25L60_one_set.toml"], ["bending", "bending_angle_deg", "deg"]),
        (["run", "blocked/D25L60.toml"], ["force", "blocked_force_N", "N", "F_b"]),
        (["sweep", "workspace/D25L60_grid.toml"], ["pressure", "pressure_bar", "bar", "P"]),
        (["inverse", "inverse/circle.toml"], ["left", "distance_mm", "mm"]),
        (["identify", "identify/tensile.toml"], ["R^2", "R^2", "-"]),
        (["design", "design/laparoscope_paper.toml"], ["length", "length_mm", "mm", "L_0"]),
        (["compare", "compare/angles.toml", str(SHIPPED / "files/measured_angles.csv")], ["mape_%", "mape_%", "%"]),
    ],
)
def test_a_command_prints_it_and_solves_nothing(
    words: list[str],
    rows: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main([words[0], str(SHIPPED / words[1]), *words[2:], "--legend"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split() == ["column", "key", "unit", "symbol", "meaning"]
    assert any(line.split()[: len(rows)] == rows for line in lines), lines
    assert not list(tmp_path.iterdir())


def test_the_columns_that_are_printed_are_in_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["identify", str(SHIPPED / "identify/tensile.toml")]) == 0
    header = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("law "))
    assert set(header.split()) <= {row[0] for row in legend(LEGENDS["identify"])}
    assert main(["compare", str(SHIPPED / "compare/angles.toml"), str(SHIPPED / "files/measured_angles.csv")]) == 0
    header = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("variant "))
    assert set(header.split()) <= {row[0] for row in legend(LEGENDS["compare"])}
