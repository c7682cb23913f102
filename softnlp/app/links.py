"""A link that opens the app with a state in it: what a tab keeps, packed into the address."""

from __future__ import annotations

import base64
import binascii
import json
import zlib

from softnlp.base.errors import InputError

MOST_CHARACTERS = 6000
"""Of an address: longer ones are cut by mail programs and proxies."""
_MOST_UNPACKED = 3_000_000
_BAD = "expected the whole address that the app gave; a part of it is missing or changed"


def packed(kept: str, files: str) -> str:
    """Return a state as part of an address.

    Raises
    ------
    InputError
        Where files that the scenario names make it too long.
    """
    code = base64.urlsafe_b64encode(zlib.compress(json.dumps([kept, files]).encode(), 9)).decode().rstrip("=")
    if len(code) > MOST_CHARACTERS:
        raise InputError(
            f"the link would have {len(code)} characters, more than {MOST_CHARACTERS}, since files belong to the "
            "scenario; save it and hand on the archive"
        )
    return code


def unpacked(code: str) -> tuple[str, str]:
    """Return what `packed` was given; raises `InputError` for anything else."""
    try:
        raw = base64.urlsafe_b64decode(code + "=" * (-len(code) % 4))
        unpacking = zlib.decompressobj()
        text = unpacking.decompress(raw, _MOST_UNPACKED)
        kept, files = json.loads(text)
    except (binascii.Error, zlib.error, ValueError, TypeError):
        raise InputError(_BAD) from None
    if not isinstance(kept, str) or not isinstance(files, str) or not unpacking.eof:
        raise InputError(_BAD)
    return kept, files
