"""What docs/identify.md shows runs, and it lists every key."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from sybil import Document, Example
from sybil.parsers.markdown import CodeBlockParser, PythonCodeBlockParser

from softnlp.cli import main
from softnlp.scenario.identify import MeasurementsTable, SigmaTable, TensileTable
from softnlp.scenario.read import scenario_from_text
from softnlp.studies.identified import COEFFICIENTS

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "identify.md"


def run_commands(example: Example) -> None:
    for line in str(example.parsed).splitlines():
        if line.startswith("softnlp "):
            assert main(shlex.split(line)[1:]) == 0, line


def read_scenario(example: Example) -> None:
    assert scenario_from_text(str(example.parsed), "x.toml").task is not None


PARSERS = (
    PythonCodeBlockParser(),
    CodeBlockParser(language="bash", evaluator=run_commands),
    CodeBlockParser(language="toml", evaluator=read_scenario),
)
EXAMPLES = list(Document.parse(str(PAGE), *PARSERS).examples())


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda e: str(e.line))
def test_an_example_runs(
    example: Example, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scenarios").symlink_to(ROOT / "scenarios")
    example.evaluate()


def test_every_kind_of_example_was_found() -> None:
    kinds = re.findall(r"^```(\w+)$", PAGE.read_text(), re.MULTILINE)
    assert len(EXAMPLES) == len(kinds)
    assert {kind: kinds.count(kind) for kind in set(kinds)} == {"bash": 1, "toml": 2, "python": 2}


def test_every_key_is_documented() -> None:
    text = PAGE.read_text()
    shown = set(re.findall(r"`([^`\n]+)`", text))
    for table in (TensileTable, MeasurementsTable, SigmaTable):
        assert set(table.model_fields) <= shown
    assert set(COEFFICIENTS) <= shown
    for letter, c in COEFFICIENTS.items():
        assert re.search(rf"{c.upper:g} \([^)]*{letter}", text), letter


def test_links_lead_somewhere() -> None:
    for target in re.findall(r"\]\(([^)#]+)", PAGE.read_text()):
        assert target.startswith("http") or (PAGE.parent / target).exists(), target
