"""NAME.csv and NAME.import.toml: measurements, and all that repeats their import to the byte."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from softnlp.base.errors import InputError, located, nearest
from softnlp.base.files import make_folder, write_whole
from softnlp.base.reading import (
    IMPORTED,
    LARGEST_TOML,
    LONGEST_NAME,
    one_line,
    read_bytes,
    read_text,
    shown,
    toml_tables,
)
from softnlp.laboratory.choices import flat
from softnlp.laboratory.formats import LARGEST
from softnlp.laboratory.imported import Imported
from softnlp.laboratory.importing import KINDS, import_files

_KEYS = ("kind", "files", "sha256", "settings", "registration")
_NOT_KEPT = ("as", "format")


@dataclass(frozen=True)
class Recipe:
    """kind, files, settings : as `import_files` takes them; the files count from `folder`. sums : of the files."""

    kind: str
    files: tuple[str, ...]
    settings: Mapping[str, Any]
    sums: tuple[str, ...]
    folder: Path

    def run(self) -> Imported:
        """Import the files again.

        Raises
        ------
        InputError
            As `import_files`, and for a file that is not the one of the first import.
        """
        for file, known in zip(self.files, self.sums, strict=False):
            with located(source=one_line(file, LONGEST_NAME)):
                if sha256(read_bytes(self.folder / file, LARGEST)).hexdigest() != known:
                    raise InputError("the file has changed since it was imported; import it again")
        return import_files(self.files, self.kind, self.settings, self.folder)


def read_recipe(path: Path) -> Recipe:
    """Return the import that a file describes; what it names is looked for in its folder.

    Raises
    ------
    InputError
        For a file that cannot be read, keys that are unknown or missing.
    """
    with located(source=one_line(str(path), LONGEST_NAME)):
        data = toml_tables(read_text(path, LARGEST_TOML))
        for key in data:
            if key not in _KEYS:
                raise InputError(f"unknown key{nearest(key, _KEYS)}", key=key)
        kind, files, sums = data.get("kind"), data.get("files"), data.get("sha256", [])
        if kind not in KINDS:
            raise InputError(f"expected {', '.join(KINDS)}, got {shown(kind)}", key="kind")
        for key, value in (("files", files), ("sha256", sums)):
            if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
                raise InputError("expected a list of texts", key=key)
        for key in ("settings", "registration"):
            if not isinstance(data.get(key, {}), dict):
                raise InputError("expected a table", key=key)
        settings = flat({**data.get("settings", {}), "registration": data.get("registration", {})})
    return Recipe(str(kind), tuple(files or ()), settings, tuple(sums), path.parent)


def recipe_text(imported: Imported, folder: Path, to: Path) -> str:
    """Return what `read_recipe` reads. folder : from which the import's files count. to : the folder of the recipe."""
    import tomlkit

    document = tomlkit.document()
    document.add(tomlkit.comment("softnlp import FILE writes the same CSV from this file again."))
    document.add("kind", tomlkit.item(imported.kind))
    files = [_relative(folder / file, to) for file in imported.files]
    sums = [sha256(read_bytes(folder / file, LARGEST)).hexdigest() for file in imported.files]
    document.add("files", tomlkit.item(files))
    document.add("sha256", tomlkit.item(sums))
    settings = tomlkit.table()
    choices = imported.choices
    for key in sorted(choices.used):
        if key not in _NOT_KEPT and key not in choices.varying:
            settings.add(tomlkit.key([key]) if "." in key else key, tomlkit.item(choices.used[key]))
    document.add("settings", settings)
    return tomlkit.dumps(document)


def _relative(path: Path, to: Path) -> str:
    try:
        return Path(os.path.relpath(path.resolve(), to.resolve())).as_posix()
    except ValueError:  # another drive
        return path.resolve().as_posix()


def write_import(imported: Imported, name: Path, folder: Path = Path(), force: bool = False) -> list[Path]:
    """Write NAME.csv and NAME.import.toml, each whole; return their paths.

    Raises
    ------
    InputError
        Where one of them stands there already and is not to be replaced, or is a file of the import itself.
    """
    made = name.with_name(f"{name.name}.csv"), name.with_name(f"{name.name}{IMPORTED}")
    sources = {(folder / file).resolve() for file in imported.files}
    for path in made:
        if path.resolve() in sources:
            raise InputError("this is a file of the import itself; choose another --out", source=str(path))
        if os.path.lexists(path) and not force:
            raise InputError("there is such a file already; --force replaces it", source=str(path))
    make_folder(name.parent)
    texts = imported.csv(), recipe_text(imported, folder, name.parent)
    return [write_whole(path, text.encode()) for path, text in zip(made, texts, strict=True)]
