"""Which pages the search of the site shows first: guides, then what is looked up, then the code and its evidence."""

from __future__ import annotations

_FIRST = ("tutorial.md", "how-to/", "troubleshooting.md", "nlp.md", "glossary.md", "trust.md")
_LAST = {
    **{"source/": 0.02, "mutation.md": 0.02, "changelog.md": 0.05, "benchmarks/": 0.1},
    **{"contributing.md": 0.2, "api/": 0.3},
}


def boost(uri: str) -> float:
    """Return the factor on what the search scores a page, by its place in docs/."""
    if uri.startswith(_FIRST):
        return 3.0
    return next((factor for start, factor in _LAST.items() if uri.startswith(start)), 1.0)
