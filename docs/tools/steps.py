"""The numbered steps of a page, as a reader takes them one after the other."""

from __future__ import annotations

import re
from dataclasses import dataclass
from textwrap import dedent

from docs.tools.cache import ROOT

_STEP = re.compile(r"^\d+\. (?P<text>.*?)(?=^\d+\. |^(?!\s)\S(?<!\d)|\Z)", re.MULTILINE | re.DOTALL)
_BLOCK = re.compile(r"^ *```(?P<language>\w+)\n(?P<code>.*?)^ *```$", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Step:
    """One step: its words, and the block of code below them with its language, "" without one."""

    words: str
    language: str
    code: str


def steps(page: str, heading: str) -> list[Step]:
    """Return the numbered steps below a heading of a page of docs/, as "how-to/first-tasks"."""
    text = (ROOT / "docs" / f"{page}.md").read_text()
    part = text.split(f"\n## {heading}\n", 1)[1].split("\n## ", 1)[0]
    found = []
    for match in _STEP.finditer(part):
        block = _BLOCK.search(match["text"])
        words = " ".join(match["text"][: block.start() if block else None].split())
        found.append(Step(words, block["language"] if block else "", dedent(block["code"]) if block else ""))
    return found


def action(step: Step) -> tuple[str, str, str]:
    """Return what a step in the app asks for: a verb, the name of what it is done to, and a number to type or "".

    Raises
    ------
    ValueError
        For words that name nothing to press.
    """
    found = re.match(r"(Press|Open the tab|Choose|Put)(?: ([\d.]+) into the field of)? \*([^*]+)\*", step.words)
    if found is None:
        raise ValueError(f"no verb and no name: {step.words}")
    return found[1], found[3], found[2] or ""
