"""Where commands write."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from softnlp.base.errors import InputError


def require_writable(folder: Path) -> None:
    """Refuse a folder that cannot be made or written before time is spent on a solve; nothing is made yet."""
    standing = next((p for p in (folder, *folder.parents) if os.path.lexists(p)), Path())
    if not standing.is_dir():
        raise InputError("expected a folder, got a file", source=str(standing))
    for name in folder.parts[len(standing.parts) :]:
        _require_possible(standing, name, folder)
    if not os.access(standing, os.W_OK | os.X_OK):
        raise InputError("this folder cannot be written", source=str(standing))
    try:
        with tempfile.TemporaryFile(dir=standing):  # what permissions do not tell: a kernel's folder, a full disk
            pass
    except OSError as error:
        raise InputError(f"this folder cannot be written: {error.strerror}", source=str(standing)) from None


def require_file(path: Path) -> None:
    """Refuse a file that cannot be written, as `require_writable` does a folder."""
    require_writable(path.parent)
    _require_possible(path.parent, path.name, path)
    if path.is_dir():
        raise InputError("expected a file, got a folder", source=str(path))


def _require_possible(standing: Path, name: str, asked: Path) -> None:
    """Refuse a name that the file system does not take, such as one that is too long."""
    try:
        os.lstat(standing / name)
    except (FileNotFoundError, NotADirectoryError):
        return
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"not a possible file name: {reason}", source=str(asked)) from None
