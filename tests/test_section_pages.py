"""What the pages on sections and obstacles show: programs run, scenarios are read."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from softnlp.scenario.read import scenario_from_text

DOCS = Path(__file__).parents[1] / "docs"
HEAD = 'study = "forward"\nrobot = { name = "D25L60" }\npressure = { sequence_bar = [[1, 0, 0]] }\n'
HEAD += 'material = { name = "Ecoflex 00-50", model = "mooney-rivlin" }\n'


@pytest.mark.parametrize("page", ["energy", "obstacles"])
def test_a_page_shows_what_runs(page: str) -> None:
    text = (DOCS / f"{page}.md").read_text()
    blocks = re.findall(r"^```(\w+)\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert {kind for kind, _ in blocks} >= {"python", "toml"}
    for kind, code in blocks:
        if kind == "python":
            assert "assert" in code
            exec(compile(code, f"{page}.md", "exec"), {})
        elif kind == "toml":
            assert scenario_from_text(code if "study" in code else HEAD + code, "x.toml").step_count > 0
