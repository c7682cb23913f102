"""What nobody meant to write is refused on one line or gives a right answer: files made from valid ones by changes."""

from __future__ import annotations

from pathlib import Path

import pytest
from fuzz import MAIN, Case, as_toml, cases, outcome, small_scenarios, wrong_with

SEED, COUNT = 20261128, 2000
QUICK = 80


def all_cases() -> list[Case]:
    return list(cases(SEED, COUNT))


def check(case: Case, folder: Path) -> int:
    folder.mkdir()
    found = outcome(case, folder)
    assert wrong_with(case, found) is None, case.name
    return found.status


def test_the_cases_are_the_same_every_time() -> None:
    assert list(cases(SEED, 30)) == list(cases(SEED, 30))
    assert len(small_scenarios()) > 30


def test_every_file_is_valid_before_it_is_changed(tmp_path: Path) -> None:
    """A base that is refused as it is would hide what its changes do."""
    for number, (name, (tables, texts, _)) in enumerate(small_scenarios().items()):
        folder = tmp_path / str(number)
        folder.mkdir()
        files = {file: text.encode() for file, text in texts.items()}
        case = Case(name, {**files, MAIN: as_toml(tables).encode()}, ("check", MAIN))
        found = outcome(case, folder)
        assert found.status != 2, f"{name}: {found.err}"
    assert {"obstacle", "dynamic", "mould", "segment", "uncertainty"} <= {
        table for tables, _, _ in small_scenarios().values() for table in tables
    }


@pytest.mark.thorough
def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    """The changes that end in reading, and a few of the small ones that solve."""
    broken = [c for c in cases(SEED, 3 * QUICK) if _ends_in_reading(c)][:QUICK]
    assert len(broken) == QUICK
    found = [check(case, tmp_path / str(k)) for k, case in enumerate(broken)]
    assert found.count(2) > 0.9 * QUICK


def _ends_in_reading(case: Case) -> bool:
    words = (" odd ", " deep ", " nest ", " wrap ", ": separator", ": drop")
    return any(word in case.name for word in words)


@pytest.mark.slow
@pytest.mark.parametrize("part", range(20))
def test_every_case(part: int, tmp_path: Path) -> None:
    for k, case in enumerate(all_cases()[part::20]):
        check(case, tmp_path / str(k))
