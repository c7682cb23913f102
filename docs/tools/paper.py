"""The pages that reproduce the paper, as docs.paper builds them."""

from __future__ import annotations

import os
from functools import cache as once
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from docs import paper
from docs.tools import cache
from docs.tools.work import Job

FOLDER = cache.FOLDER / "paper"
WANTED = "DOCS_WITHOUT_PAPER" not in os.environ  # for a build that has to be quick


def jobs() -> list[Job]:
    """Return what is to be done for the pages, the longest first; one that is kept takes no time."""
    return [(make_one, (name,)) for name in paper.PAGES if WANTED]


def make_one(name: str) -> None:
    """Build a page, if it is not kept."""
    paper.built(name, FOLDER)


@once
def made() -> dict[str, bytes]:
    """Return pages and images by their place in the site."""
    if not WANTED:
        return {}
    with TemporaryDirectory() as folder:
        paper.build(Path(folder), cache=FOLDER)
        return {f"paper/{path.name}": path.read_bytes() for path in sorted(Path(folder).iterdir())}


def navigation() -> list[dict[str, Any]]:
    """Return the entry of the navigation: the index, then each page under its title."""
    if not WANTED:
        return []
    entries: list[Any] = [f"paper/{paper.INDEX}.md"]
    entries += [{title: f"paper/{name}.md"} for name, title in paper.titles().items()]
    return [{"The paper": entries}]
