"""Where commands write."""

from __future__ import annotations

import os
from pathlib import Path

from softnlp.base.errors import InputError


def require_writable(folder: Path) -> None:
    """Refuse a folder that cannot be written before time is spent on a solve; nothing is made yet."""
    standing = next((p for p in (folder, *folder.parents) if os.path.lexists(p)), Path())
    if not standing.is_dir():
        raise InputError("expected a folder, got a file", source=str(standing))
    if not os.access(standing, os.W_OK | os.X_OK):
        raise InputError("this folder cannot be written", source=str(standing))
