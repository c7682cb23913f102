"""The navigation of the site: pages that are not there yet are left out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

COMING = (
    *("compare.md", "app.md", "mesh.md", "view.md", "mutation.md", "peers.md"),
    *("benchmarks.md", "benchmarks/table.md", "robustness.md", "benchmarks/robustness.md"),
)
"""Pages that the navigation has a place for before they are written."""


def existing(docs: Path) -> set[str]:
    """Return the pages that may stand in the navigation; any other entry is an error that MkDocs reports."""
    return {name for name in COMING if (docs / name).is_file()}


def pruned(nav: list[Any], there: set[str]) -> list[Any]:
    """Return the navigation without pages that are still to come, and without sections that would be empty."""
    result = []
    for entry in nav:
        value = next(iter(entry.values())) if isinstance(entry, dict) else entry
        if isinstance(value, list):
            inner = pruned(value, there)
            if inner:
                result.append({next(iter(entry)): inner})
        elif value not in COMING or value in there:
            result.append(entry)
    return result
