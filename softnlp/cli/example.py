"""`softnlp example`: the scenarios that travel with the package, written where they can be run and changed."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from softnlp.base.errors import InputError, nearest
from softnlp.cli.console import say, say_rows
from softnlp.cli.study import require_writable


def example(name: str | None = None, /, *, out: Path = Path("scenarios"), all: bool = False) -> None:
    """Write a scenario of the package, and the files that it names, to be run as it is or changed.

    Without a name the scenarios are listed. A file that is there already is never replaced.

    Parameters
    ----------
    name
        As listed, such as D25L60_one_set or blocked/D25L60.
    out
        Folder for them; blocked/D25L60 becomes OUT/blocked/D25L60.toml.
    all
        Write every one of them.
    """
    known = shipped_scenarios()
    if name is None and not all:
        rows = [[key, table["study"], str(table.get("title", ""))] for key, (_, table) in known.items()]
        say_rows(["name", "study", "title"], rows)
        return
    if name is not None and all:
        raise InputError("expected a name or --all, got both", key="--all")
    if name is not None and name not in known:
        raise InputError(f"unknown example '{name}'{nearest(name, known)}", key="NAME")
    chosen = [known[name]] if name is not None else list(known.values())
    root = shipped_folder()
    wanted = {path.relative_to(root) for file, table in chosen for path in (file, *_named_files(table, file.parent))}
    require_writable(out)
    for place in sorted(wanted):
        if (out / place).exists():
            raise InputError("there is such a file already; choose another folder with --out", source=str(out / place))
    for place in sorted(wanted):
        (out / place).parent.mkdir(parents=True, exist_ok=True)
        (out / place).write_bytes((root / place).read_bytes())
    if name is not None:
        say(f"softnlp run {out / f'{name}.toml'}")
    else:
        say(f"{len(chosen)} scenarios in {out}")


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


def _named_files(value: Any, folder: Path) -> Iterator[Path]:
    """Yield the shipped files that the texts in a scenario name, relative to its folder."""
    if isinstance(value, dict):
        value = list(value.values())
    if isinstance(value, list):
        for entry in value:
            yield from _named_files(entry, folder)
    elif isinstance(value, str) and value.endswith((".csv", ".toml")):
        yield (folder / value).resolve()
