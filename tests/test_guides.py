"""The pages for people who look for a command, a word or a way out say what the code says."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from benchmarks.judge import VARIANTS, judge
from benchmarks.measured import ANGLES
from docs.figures import glossary, statuses
from softnlp.base.columns import OUTPUTS
from softnlp.base.status import Status
from softnlp.cli import _app
from softnlp.scenario.check import SCHEMAS
from softnlp.scenario.describe import keys_of

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
SOURCE = re.sub(r'"\s*f?"', "", "".join(path.read_text() for path in sorted((ROOT / "softnlp").rglob("*.py"))))


def rows(page: str, after: str) -> list[list[str]]:
    """Return the rows of the first table after a heading."""
    text = (DOCS / page).read_text()
    table = re.search(r"(?:^\|.*\n)+", text[text.index(after) :], re.MULTILINE)
    assert table is not None
    return [[cell.strip() for cell in line.strip("|").split(" | ")] for line in table[0].splitlines()[2:]]


def test_every_status_has_its_advice() -> None:
    table = statuses.text()
    for status in Status:
        assert f"| `{status}` | {'yes' if status.has_solution else 'no'} | {status.advice} |" in table


def test_every_number_and_key_is_in_the_glossary() -> None:
    table = glossary.text()
    for output in OUTPUTS.values():
        assert f"| `{output.key}` |" in table
    for schema in SCHEMAS.values():
        for one in keys_of(schema):
            if one.table is not None and not one.named:
                for key in keys_of(one.table):
                    assert f"| `[{one.name}] {key.name}` | {key.unit} |" in table


def test_every_message_is_one_that_the_code_says() -> None:
    for message, *_ in rows("troubleshooting.md", "## By message"):
        for part in re.findall(r"`([^`]+)`", message):
            words = [w.strip(" :;,.()") for w in re.split(r"\.\.\.|\bN more\b|[\d.]+ \w+|to_\w+(?: =)?", part)]
            for word in (w for w in words if len(w) > 4):
                assert word in SOURCE, word


@pytest.mark.parametrize("page", ["which.md", "troubleshooting.md", "from-matlab.md", "glossary.md", "trust.md"])
def test_every_command_and_option_is_there(page: str) -> None:
    app = _app()
    for command in re.findall(r"`softnlp ([^`]+)`", (DOCS / page).read_text()):
        name, *words = command.split()
        assert name in app, command
        help_text = "".join(path.read_text() for path in (ROOT / "softnlp" / "cli").glob("*.py"))
        for option in (word for word in words if word.startswith("--")):
            assert option.removeprefix("--").replace("-", "_") in help_text, command


def test_the_advice_on_trust_leads_to_what_it_names() -> None:
    closures = {row[0].split("`")[1] for row in rows("trust.md", "## Which closure")}
    assert closures == {"compliant", "none", "free", "weighted", "rigid"}
    for page in re.findall(r"\]\(([\w/-]+\.md)", (DOCS / "trust.md").read_text()):
        assert (DOCS / page).is_file()


@pytest.mark.slow
def test_the_errors_on_the_page_of_trust_are_those_of_the_judge() -> None:
    judged = [judge(variant) for variant in VARIANTS]
    fitted, *shown = [[float(cell) for cell in row[1:]] for row in rows("trust.md", "## How far off each was")]
    assert fitted == [one.variant.fitted for one in judged]
    names = [name for name in judged[0].table if name != "constants fitted"]
    for name, cells in zip(names, shown, strict=True):
        assert cells == pytest.approx([one.table[name] for one in judged], rel=6e-3)
    for one in judged:  # the order of the robots, which the page says of all of them
        for sets in (0, 1):
            by_model = sorted(ANGLES, key=lambda name, sets=sets, one=one: one.angles[name, sets + 1])
            assert by_model == sorted(ANGLES, key=lambda name, sets=sets: ANGLES[name][sets])
    longest = max(abs(error) for one in judged for error in one.elongation_errors.values())
    assert longest == pytest.approx(4.2, abs=0.05)
    worst = [abs(error) for error in judged[2].angle_errors.values()]
    assert (min(worst), max(worst)) == (pytest.approx(1, abs=0.5), pytest.approx(75, abs=0.5))
