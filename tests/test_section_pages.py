"""What the pages on sections and obstacles show: programs run, scenarios are read."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from softnlp.scenario.read import scenario_from_text

DOCS = Path(__file__).parents[1] / "docs"
OF_EVERY = 'robot = { name = "D25L60" }\nmaterial = { name = "Ecoflex 00-50", model = "mooney-rivlin" }\n'
HEAD = 'study = "forward"\npressure = { sequence_bar = [[1, 0, 0]] }\n' + OF_EVERY
TO_TARGETS = 'study = "inverse"\n' + OF_EVERY
TO_TARGETS += '[[obstacle]]\nkind = "sphere"\ncentre_mm = [-30, 0, 40]\nradius_mm = 10\n'


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
            head = "" if "study" in code else TO_TARGETS if "[target]" in code else HEAD
            assert scenario_from_text(head + code, "x.toml").step_count > 0
