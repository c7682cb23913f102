"""Where finished pages are kept, and the digest of everything that they depend on."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path

from docs.paper.published import ROOT

_LIBRARIES = ("casadi", "numpy", "scipy", "matplotlib")


def cache_folder() -> Path:
    """Return the folder of finished pages, of the user's cache."""
    base = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(base) / "softnlp" / "paper"


def digest() -> str:
    """Return a digest of the sources, scenarios and versions behind the pages."""
    found = hashlib.sha256("".join(f"{name} {version(name)}\n" for name in _LIBRARIES).encode())
    for file in sources():
        found.update(f"{file.relative_to(ROOT).as_posix()}\n".encode())
        found.update(file.read_bytes())
    return found.hexdigest()[:20]


def sources() -> Iterator[Path]:
    """Yield every file that a page may depend on, in a fixed order."""
    yield ROOT / "materials.toml"
    for folder, pattern in (
        ("softnlp", "*.py"),
        ("docs/paper", "*.py"),
        ("benchmarks", "*.py"),
        ("scenarios", "*.toml"),
        ("scenarios", "*.csv"),
    ):
        yield from sorted((ROOT / folder).rglob(pattern))
