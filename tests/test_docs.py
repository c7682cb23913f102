"""What the documents show runs, and what they list is what there is."""

from __future__ import annotations

import json
import re
import shlex
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import xarray as xr
from broken_files import CSV_PRESSURE, MATERIAL, PRESSURE, ROBOT, STUDY, scenario
from pydantic import BaseModel
from sybil import Document, Example
from sybil.parsers.markdown import CodeBlockParser, PythonCodeBlockParser

from softnlp import load_materials
from softnlp.base.ranges import RANGES
from softnlp.base.status import Status
from softnlp.cli import main
from softnlp.model.conventions import COEFFICIENT_SETS, CONVENTIONS
from softnlp.model.formula import FUNCTIONS
from softnlp.model.ipopt_options import IPOPT_OPTIONS
from softnlp.model.laws import LAWS
from softnlp.scenario.check import SCHEMAS
from softnlp.scenario.obstacle_schema import ObstacleTable
from softnlp.scenario.read import scenario_from_text
from softnlp.scenario.schema import BlockedForceFile, OffsetRampTable, RampTable
from softnlp.scenario.segments import SegmentTable

ROOT = Path(__file__).parents[1]
README, SCENARIO, MODEL = ROOT / "README.md", ROOT / "docs" / "scenario.md", ROOT / "docs" / "model.md"
ONE_SET = ROOT / "scenarios" / "D25L60_one_set.toml"


@pytest.fixture(autouse=True)
def folder_with_scenarios(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run in an empty folder from which scenarios/ is reached as from the repository."""
    monkeypatch.chdir(tmp_path)
    Path("scenarios").symlink_to(ROOT / "scenarios")


def run_commands(example: Example) -> None:
    """Run the lines of a shell block that start with softnlp; setting up is what .ci/run does."""
    for line in str(example.parsed).splitlines():
        if line.startswith("softnlp "):
            assert main(shlex.split(line)[1:]) == 0, line


def read_toml(example: Example) -> None:
    """Read a block as a materials file, a scenario, or a table of one."""
    text = str(example.parsed)
    data = tomllib.loads(text)
    if text.startswith("# my_silicone.toml"):
        Path("my_silicone.toml").write_text(text)
        assert len(load_materials("my_silicone.toml")["My silicone"].models) == 2
    elif "study" in data:
        assert scenario_from_text(text, "x.toml") is not None
    else:
        parts = {"robot": ROBOT, "material": MATERIAL, "pressure": PRESSURE}
        assert set(data) <= set(parts)
        scenario_from_text(STUDY + text + "".join(part for key, part in parts.items() if key not in data), "x.toml")


def read_csv(example: Example) -> None:
    """Read a block as a file of pressures."""
    Path("p.csv").write_text(str(example.parsed))
    assert len(scenario_from_text(scenario(pressure=CSV_PRESSURE), "x.toml").pressures) == 2


def compare_step(example: Example) -> None:
    """Compare a block with the last step of the scenario that the documents run."""
    real = one_set()["steps"][-1]
    for key, value in json.loads(str(example.parsed)).items():
        assert real[key] == (pytest.approx(value, abs=6e-4) if isinstance(value, float | list) else value), key


PARSERS = (
    PythonCodeBlockParser(),
    CodeBlockParser(language="bash", evaluator=run_commands),
    CodeBlockParser(language="toml", evaluator=read_toml),
    CodeBlockParser(language="csv", evaluator=read_csv),
    CodeBlockParser(language="json", evaluator=compare_step),
)


EXAMPLES = [
    pytest.param(example, id=f"{path.name}:{example.line}", marks=[pytest.mark.thorough] * (path == README))
    for path in (README, SCENARIO, MODEL)
    for example in Document.parse(str(path), *PARSERS).examples()
]


@pytest.mark.parametrize("example", EXAMPLES)
def test_an_example_of_the_documents_runs(example: Example, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    example.evaluate()
    if example.path.endswith("README.md"):
        left = {path.name for path in tmp_path.iterdir()}
        assert left <= {"scenarios", "results", "one"}, "what is left goes under results/, which git ignores"


def test_every_kind_of_example_was_found() -> None:
    text = README.read_text() + SCENARIO.read_text()
    kinds = re.findall(r"^```(\w+)$", text, re.MULTILINE)
    assert {kind: kinds.count(kind) for kind in set(kinds)} == {"bash": 3, "python": 1, "toml": 6, "csv": 1, "json": 1}
    assert len(EXAMPLES) == len(kinds)


@cache
def one_set() -> dict[str, Any]:
    """Return the document of the scenario that the README runs."""
    folder = Path("one")
    assert main(["run", str(ONE_SET), "--out", str(folder)]) == 0
    document: dict[str, Any] = json.loads((folder / "results.json").read_text())
    with xr.open_dataset(folder / "results.nc", engine="h5netcdf") as dataset:
        document["variables"] = sorted(map(str, dataset.data_vars))
    document["files"] = sorted(path.name for path in folder.iterdir())
    return document


def documented(path: Path) -> set[str]:
    """Return what a document shows as code, and its headings of tables."""
    text = path.read_text()
    return set(re.findall(r"`([^`\n]+)`", text)) | set(re.findall(r"\[[a-z_]+\]", text))


def tables(model: type[BaseModel]) -> Iterator[tuple[str, type[BaseModel]]]:
    for name, field in model.model_fields.items():
        if isinstance(field.annotation, type) and issubclass(field.annotation, BaseModel):
            yield name, field.annotation


def keys_of_tables() -> set[str]:
    found = {key for _, table in tables(BlockedForceFile) for key in table.model_fields}
    found |= set(SegmentTable.model_fields) - {"robot", "material"} | set(ObstacleTable.model_fields)
    return found | set(IPOPT_OPTIONS) | set(RampTable.model_fields) | set(OffsetRampTable.model_fields)


def test_every_table_and_key_of_a_scenario_is_documented() -> None:
    shown = documented(SCENARIO)
    assert {f"[{name}]" for name, _ in tables(BlockedForceFile)} <= shown
    assert keys_of_tables() <= shown
    assert {"study", "title", *LAWS, *(f'"{law}"' for law in LAWS)} <= shown
    assert {c.file_key for law in LAWS.values() for c in law.constants} <= shown
    assert all(function in SCENARIO.read_text() for function in FUNCTIONS)


def test_no_key_is_documented_that_is_not_there() -> None:
    """A key of a table in a table row of the documents."""
    known = {*keys_of_tables(), "study", "title", "set", *Status, *LAWS}
    scenario_part = SCENARIO.read_text().split("\n## Results")[0]
    first_cells = re.findall(r"^\| (`[^|]+`) \|(?: (`[^|]+`) \|)?", scenario_part, re.MULTILINE)
    keys = {key for cells in first_cells for cell in cells for key in re.findall(r"`([a-z]\w*)`", cell)}
    assert keys >= {"elongation", "force_N", "steps", "accuracy"}  # they were found
    assert keys - set(LAWS) <= known | {c.file_key for law in LAWS.values() for c in law.constants}


def test_defaults_are_documented_as_they_are() -> None:
    text = SCENARIO.read_text()
    solver = dict(tables(BlockedForceFile))["solver"]
    for key in ("accuracy", "tolerance"):
        row = re.search(rf"\| `{key}` \| ([^ ]+) \|", text)
        assert row
        assert float(row[1]) == solver.model_fields[key].default
    for key in ("elongation", "bending", "bore_fraction", "chamber_reaction"):
        row = re.search(rf"`{key}` \|[^|\n]*?(?:\|)? ?the set's: ([\d.]+) or ([\d.]+) ", text)
        assert row, key
        assert [float(v) for v in row.groups()] == [getattr(c, key) for c in COEFFICIENT_SETS.values()]
    for name, c in COEFFICIENT_SETS.items():
        row = re.search(
            rf"^\| `{name}`[^|]*\| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \|", MODEL.read_text(), re.M
        )
        assert row
        assert [float(v) for v in row.groups()] == [c.elongation, c.bending, c.bore_fraction, c.chamber_reaction]
    assert set(CONVENTIONS) <= documented(MODEL)


def test_every_range_is_documented_as_it_is() -> None:
    section = SCENARIO.read_text().split("\n## Ranges")[1].split("\n## ")[0]
    rows = re.findall(r"^\| ([^|]+) \| ?([^|]*) \| (\S+) \| (\S+) \|$", section, re.MULTILINE)[1:]
    assert [(what, unit.strip(), float(low), float(high)) for what, unit, low, high in rows if low != "---"] == [
        (r.what, r.unit, r.low, r.high) for r in RANGES
    ]


def test_every_status_is_documented() -> None:
    section = SCENARIO.read_text().split("## Statuses")[1]
    assert re.findall(r"^\| `(\w+)` \|", section, re.MULTILINE) != []
    assert set(re.findall(r"^\| `(\w+)` \|", section, re.MULTILINE)) == set(Status)


def test_every_result_is_documented() -> None:
    shown, document = documented(SCENARIO), one_set()
    assert set(document["files"]) <= shown
    assert set(document["variables"]) <= shown
    assert set(document["steps"][0]) <= shown


def test_links_lead_somewhere() -> None:
    for path in (README, ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))):
        for target in re.findall(r"\]\(([^)]+)\)", path.read_text()):
            if target.startswith("http"):
                continue
            name, _, anchor = target.partition("#")
            file = (path.parent / name) if name else path
            assert file.exists(), f"{path.name}: {target}"
            headings = re.findall(r"^#+ (.*)$", file.read_text(), re.MULTILINE) if anchor else []
            anchors = {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
            assert not anchor or anchor in anchors, f"{path.name}: {target}"


def test_the_studies_that_run_are_those_of_the_documents() -> None:
    line = next(line for line in SCENARIO.read_text().splitlines() if line.startswith("| `study`"))
    assert set(SCHEMAS) == set(re.findall(r'"([a-z-]+)"', line))
