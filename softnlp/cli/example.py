"""`softnlp example`: the scenarios that travel with the package, written where they can be run and changed."""

from __future__ import annotations

from pathlib import Path

from softnlp.base.errors import InputError, nearest
from softnlp.cli.console import say, say_rows
from softnlp.cli.study import require_writable
from softnlp.scenario.examples import named_files, shipped_folder, shipped_scenarios


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
    wanted = {path.relative_to(root) for file, table in chosen for path in (file, *named_files(table, file.parent))}
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
