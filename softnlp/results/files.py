"""Writing a file whole or not at all."""

from __future__ import annotations

import os
from contextlib import suppress
from os import PathLike
from pathlib import Path

from softnlp.errors import InputError


def write_whole(path: str | PathLike[str], content: bytes) -> Path:
    """Write a file under a temporary name beside it, then put it in place in one move; return its path.

    Raises
    ------
    InputError
        When the folder does not exist or cannot be written, the disk is full, or the path is a folder. What stood
        there before is then unchanged.
    """
    target = Path(path)
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        part.write_bytes(content)
        os.replace(part, target)
    except (OSError, ValueError) as error:  # ValueError: a NUL character in the name
        with suppress(OSError, ValueError):  # the folder may refuse this too; the first error says why
            part.unlink(missing_ok=True)
        raise InputError(f"cannot be written: {_reason(error)}", source=str(target)) from None
    return target


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
