"""The problem that docs/nlp.md looks into: the least pressures that bend a loaded robot by 60 degrees."""

from __future__ import annotations

from docs.tools.pages import blocks
from softnlp import Problem


def posed(method: str = "MultipleShooting(10)") -> Problem:
    """Return the problem of the page's first block of code, by another transcription where one is given."""
    code = next(code for _, language, code in blocks("nlp") if language == "python")
    names: dict[str, object] = {}
    exec(code.replace("MultipleShooting(10)", method), names)
    made = names["posed"]
    assert isinstance(made, Problem)
    return made
