"""The pages that reproduce the paper, once the package docs.paper is there: `build(folder)` writes Markdown and PNG."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any

from docs.tools import cache

PACKAGE = cache.ROOT / "docs" / "paper"


def _folder() -> Path:
    return cache.kept("paper", PACKAGE.rglob("*.py"))


def make() -> None:
    """Build the pages, if they are not kept."""
    if (PACKAGE / "__init__.py").is_file():
        cache.make(_folder(), lambda folder: import_module("docs.paper").build(folder))


def _files() -> dict[str, Path]:
    if not (PACKAGE / "__init__.py").is_file():
        return {}
    folder = _folder()
    found = (path for path in sorted(folder.rglob("*")) if path.suffix in (".md", ".png", ".svg", ".csv"))
    return {f"paper/{path.relative_to(folder).as_posix()}": path for path in found}


def made() -> dict[str, bytes]:
    """Return pages and images by their place in the site."""
    return {uri: path.read_bytes() for uri, path in _files().items()}


def navigation() -> list[dict[str, Any]]:
    """Return the entry of the navigation: the index first, if there is one; each page under its heading."""
    pages = {uri: path for uri, path in _files().items() if uri.endswith(".md")}
    order = sorted(pages, key=lambda uri: (not uri.endswith(("/index.md", "/README.md")), uri))
    entries = [{_heading(pages[uri]): uri} for uri in order]
    return [{"The paper": entries}] if entries else []


def _heading(page: Path) -> str:
    match = re.search(r"^# (.+)$", page.read_text(), re.MULTILINE)
    return match[1] if match else page.stem
