"""The scenarios that travel with the package."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any


def shipped_scenarios() -> dict[str, tuple[Path, dict[str, Any]]]:
    """Return file and content of every scenario of the package by name, those of the top folder first."""
    root = shipped_folder()
    found = {}
    for file in sorted(root.rglob("*.toml"), key=lambda path: (len(path.parts), path)):
        table = tomllib.loads(file.read_text(encoding="utf-8"))
        if "study" in table:
            found[file.relative_to(root).with_suffix("").as_posix()] = (file, table)
    return found


def shipped_folder() -> Path:
    """Return where the scenarios are: beside the package when installed, at the top level of a checkout."""
    package = Path(__file__).parents[1]
    installed = package / "scenarios"
    return installed if installed.is_dir() else package.parent / "scenarios"


def named_files(value: Any, folder: Path) -> Iterator[Path]:
    """Yield the shipped files that the texts in a scenario name, relative to its folder."""
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        for entry in value:
            yield from named_files(entry, folder)
    elif isinstance(value, str) and value.endswith((".csv", ".toml")):
        yield (folder / value).resolve()
