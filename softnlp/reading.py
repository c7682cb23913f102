"""Reading people's text files, and quoting what they wrote on one printable line."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from softnlp.errors import InputError, nearest

LONGEST_QUOTE = 60
LONGEST_NAME = 200  # of a key or a file


def read_text(path: Path) -> str:
    """Return the text of a UTF-8 file; a byte order mark is dropped.

    Raises
    ------
    InputError
        When it is missing, a directory, a device, unreadable, binary or not UTF-8; the text does not name the file.
    """
    try:
        device = path.is_char_device() or path.is_block_device()  # may have no end
        content = b"" if device else path.read_bytes()
    except FileNotFoundError:
        raise InputError(f"no such file{_similar_file(path)}") from None
    except IsADirectoryError:
        raise InputError("expected a file, got a directory") from None
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}") from None
    except ValueError:  # a NUL character in the name
        raise InputError("not a possible file name") from None
    if device:
        raise InputError("expected a file, got a device")
    if (nul := content.find(b"\0")) >= 0:
        raise InputError(f"expected UTF-8 text, got binary data (line {_line(content, nul)})")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        place = f"byte 0x{content[error.start]:02x} on line {_line(content, error.start)}"
        raise InputError(f"expected UTF-8 text, got {place}") from None


def one_line(text: str, longest: int | None = None) -> str:
    """Return text, cut if asked, with all that is not printable (newlines, escapes, lone surrogates) escaped."""
    if longest is not None and len(text) > longest:
        text = f"{text[:longest]}…"
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in text)


def shown(value: Any) -> str:
    """Return a value of a TOML file as a short printable quotation."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return "a table"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if isinstance(value, str):
        return repr(value if len(value) <= LONGEST_QUOTE else f"{value[:LONGEST_QUOTE]}…")
    if isinstance(value, int):
        # a long hexadecimal number has no decimal text
        return str(value) if value.bit_length() <= 4 * LONGEST_QUOTE else "a huge whole number"
    return one_line(str(value))


def choices(names: Iterable[str]) -> str:
    """Quote alternatives as a person would: 'a', 'b' or 'c'."""
    *others, last = [repr(name) for name in names]
    return f"{', '.join(others)} or {last}" if others else last


def did_you_mean(word: str, names: Iterable[str]) -> str:
    """Return "; did you mean 'x'?" where a name is near, for a message that lists the names already."""
    return nearest(word, names).partition("; known")[0]


def _line(content: bytes, position: int) -> int:
    """Line of a byte, counted from 1."""
    return content.count(b"\n", 0, position) + 1


def _similar_file(path: Path) -> str:
    """Name the file of the same folder whose name is nearest, if one is near."""
    try:
        close = get_close_matches(path.name, [p.name for p in path.parent.iterdir()], n=1, cutoff=0.7)
    except OSError:
        return f" (nor is there a folder {one_line(str(path.parent))!r})"
    return f"; did you mean {shown(close[0])}?" if close else ""
