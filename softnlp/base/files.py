"""Writing a file whole or not at all, and values as TOML."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from os import PathLike
from pathlib import Path
from typing import Any

from softnlp.base.errors import InputError


def write_whole(path: str | PathLike[str], content: bytes) -> Path:
    """Write a file under a temporary name beside it, then put it in place in one move; return its path.

    Raises
    ------
    InputError
        When the folder does not exist or cannot be written, the disk is full, or the path is a folder. What stood
        there before is then unchanged.
    """
    with placed_whole(path) as part:
        part.write_bytes(content)
    return Path(path)


@contextmanager
def placed_whole(path: str | PathLike[str]) -> Iterator[Path]:
    """Yield the name under which a file is to be written; at the end it is put in place in one move.

    Raises
    ------
    InputError
        As `write_whole`, for an OSError of writing it too.
    """
    target = Path(path)
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        yield part
        os.replace(part, target)
    except BaseException as error:
        with suppress(OSError, ValueError):  # the folder may refuse this too; the first error says why
            part.unlink(missing_ok=True)
        if isinstance(error, OSError) or (isinstance(error, ValueError) and "\0" in str(target)):
            raise InputError(f"cannot be written: {_reason(error)}", source=str(target)) from None
        raise


def make_folder(path: str | PathLike[str]) -> Path:
    """Make a folder and those above it where missing; return its path.

    Raises
    ------
    InputError
        When a file stands in the way or the folder above cannot be written.
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise InputError("expected a folder, got a file", source=str(folder)) from None
    except (OSError, ValueError) as error:
        raise InputError(f"cannot make this folder: {_reason(error)}", source=str(folder)) from None
    return folder


def _reason(error: OSError | ValueError) -> str:
    return getattr(error, "strerror", None) or str(error)


def toml_text(value: Any) -> str:
    """Return a value of a parsed TOML file as TOML, on one line."""
    if isinstance(value, Mapping):
        parts = ", ".join(f"{toml_key(key)} = {toml_text(item)}" for key, item in value.items())
        return f"{{ {parts} }}" if parts else "{}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return "[" + ", ".join(toml_text(item) for item in value) + "]"
    return json.dumps(value, ensure_ascii=False)


def toml_key(name: str) -> str:
    """Return a key as TOML writes it, in quotes where it needs them."""
    bare = name.replace("-", "").replace("_", "")
    return name if bare.isascii() and bare.isalnum() else json.dumps(name, ensure_ascii=False)
