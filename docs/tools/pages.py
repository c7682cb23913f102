"""The code blocks of a page, and the files that it has its reader save."""

from __future__ import annotations

import re

from docs.tools.cache import ROOT

_BLOCK = re.compile(r"^```(?P<language>\w+)\n(?P<code>.*?)^```$", re.MULTILINE | re.DOTALL)
_SAVE_AS = re.compile(r"[Ss]ave this as `([\w.]+)`[^`]*$")


def blocks(page: str) -> list[tuple[str, str, str]]:
    """Return (name to save it under or "", language, code) of each block of a page of docs/, as "how-to/design"."""
    text = (ROOT / "docs" / f"{page}.md").read_text()
    found, end = [], 0
    for match in _BLOCK.finditer(text):
        name = _SAVE_AS.search(text[end : match.start()])
        found.append((name[1] if name else "", match["language"], match["code"]))
        end = match.end()
    return found


def saved(page: str) -> dict[str, str]:
    """Return the files of a page by their names, as they are when they are first saved."""
    return {name: code for name, _, code in blocks(page) if name}
