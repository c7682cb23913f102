"""Where the chambers go in the tutorial's robot."""

from __future__ import annotations

import re

from docs.figures._shared import command
from docs.tools.cache import ROOT


def text() -> str:
    """Return what the command of the page prints."""
    page = (ROOT / "docs" / "tutorial.md").read_text()
    line = re.search(r"^softnlp robots --fit .+$", page, re.MULTILINE)
    assert line is not None
    return command(line[0]).block


if __name__ == "__main__":
    print(text())
