"""Every check has a heading on docs/checks.md, where its message leads."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from softnlp.laboratory.imported import slug

ROOT = Path(__file__).parents[1]


def names() -> set[str]:
    """Return the names of all checks that the package makes."""
    found = set()
    for file in (
        f for f in (ROOT / "softnlp").rglob("*.py") if f.parent.name != "mould"
    ):  # which has checks of its own
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "Check":
                found |= {a.value for a in node.args[:1] if isinstance(a, ast.Constant) and isinstance(a.value, str)}
    return found


def test_every_check_has_its_place_on_the_page() -> None:
    headings = re.findall(r"^### (.*)$", (ROOT / "docs" / "checks.md").read_text(), re.MULTILINE)
    assert len(names()) > 30
    assert names() <= set(headings)
    for heading in headings:
        assert slug(heading) == re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-").replace("--", "-"), heading
