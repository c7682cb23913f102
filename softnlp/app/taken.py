"""Files that a person drops: what they are called here, and which of them are taken."""

from __future__ import annotations

from pathlib import PurePath

from softnlp.base.errors import InputError
from softnlp.base.reading import IMPORTED, shown

LARGEST_FILE = 5_000_000
"""Bytes of a file that is taken in."""


def plain_name(name: str) -> str:
    """Return the name of a file without its folders; raises `InputError` where nothing is left."""
    plain = PurePath(name.replace("\\", "/")).name
    if not plain or plain.startswith("."):
        raise InputError(f"expected a file with a name, got {shown(name)}")
    return plain


def checked_content(name: str, content: bytes) -> bytes:
    """Return the content of a file; raises `InputError` for one too large, and for a recipe of an import.

    That one names further files. A page reads what was dropped, and not what else the machine of its server has.
    """
    if name.endswith(IMPORTED):
        raise InputError(f"{shown(name)} names further files; take the CSV of the import, or import those files here")
    if len(content) > LARGEST_FILE:
        size = len(content) / 1e6
        raise InputError(f"{shown(name)} has {size:.0f} MB; expected a table of at most {LARGEST_FILE / 1e6:.0f} MB")
    return content
