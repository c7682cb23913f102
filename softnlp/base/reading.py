"""Reading people's text files, and quoting what they wrote on one printable line."""

from __future__ import annotations

import os
import re
import stat
import tomllib
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from softnlp.base.errors import InputError, nearest

LONGEST_QUOTE = 60
LONGEST_NAME = 200  # of a key or a file
LARGEST_DATA, LARGEST_TOML = 64_000_000, 1_000_000  # bytes of a file
IMPORTED = ".import.toml"  # what the name of an import's recipe ends with
DEEPEST = 16  # keys, tables and lists within each other
BACKSLASH_HINT = "a backslash in \"…\" begins an escape; write a path in single quotes '…' or with /"

_KINDS = (
    (stat.S_ISDIR, "a directory"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (lambda mode: not stat.S_ISREG(mode), "a device"),
)
_ESCAPES = {"\b": r"\b", "\t": r"\t", "\n": r"\n", "\f": r"\f", "\r": r"\r"}
# Strings and comments are passed over whole
_TOML_TOKEN = re.compile(
    r'"""(?:\\.|[^\\])*?"""|\'\'\'.*?\'\'\'|"(?:\\.|[^"\\\n])*+"|\'[^\'\n]*+\'|\#[^\n]*|[\[\]{}.=,\n]', re.DOTALL
)


def read_text(path: Path, largest: int = LARGEST_DATA) -> str:
    """Return the text of a UTF-8 file; a byte order mark is dropped.

    Raises
    ------
    InputError
        As `read_bytes`, and when it is binary or not UTF-8; the text does not name the file.
    """
    content = read_bytes(path, largest)
    if (nul := content.find(b"\0")) >= 0:
        raise InputError(f"expected UTF-8 text, got binary data (line {_line(content, nul)})")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        place = f"byte 0x{content[error.start]:02x} on line {_line(content, error.start)}"
        raise InputError(f"expected UTF-8 text, got {place}") from None


def read_bytes(path: Path, largest: int = LARGEST_DATA) -> bytes:
    """Return what is in a person's file of at most `largest` bytes; every such file is read here.

    Raises
    ------
    InputError
        When it is missing, too large, no regular file or cannot be read; the text does not name the file.
    """
    try:
        # Only looking at it: to open a pipe waits for who writes it, and a device may have no end.
        kind = next((name for is_kind, name in _KINDS if is_kind(path.stat().st_mode)), None)
        size, content = (0, b"") if kind else _read(path, largest)
    except FileNotFoundError:
        raise InputError(_missing(path)) from None
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}") from None
    except ValueError:  # a NUL character in the name
        raise InputError("not a possible file name") from None
    if kind:
        raise InputError(f"expected a file, got {kind}")
    if size > largest:
        raise InputError(f"too large: expected at most {largest / 1e6:g} MB, got a file of {size / 1e6:.8g} MB")
    if len(content) > size:
        raise InputError("expected a file, got one longer than its size (it grows, or is of /proc); copy it first")
    return content


def _read(path: Path, largest: int) -> tuple[int, bytes]:
    """Return the size of a file and what is in it, not much beyond the largest size."""
    with open(path, "rb", opener=_without_waiting) as file:
        size = os.fstat(file.fileno()).st_size
        return size, b"" if size > largest else file.read(size + 1) or b""


def _without_waiting(path: str, flags: int) -> int:
    """Open a file so that no read of it waits, as one of /proc may."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def toml_tables(text: str) -> dict[str, Any]:
    """Return the tables of TOML 1.0; raises `InputError` where the text is not, or is nested deeper than `DEEPEST`."""
    _refuse_deep(text)
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        line = re.search(r"at line (\d+)", str(error))  # else it is the last
        written = text.rstrip().split("\n")[: int(line[1]) if line else None][-1]
        hint = f"; {BACKSLASH_HINT}" if re.search(r'"[^"]*\\', written) else ""
        raise InputError(f"not valid TOML: {error}{hint}") from None
    except ValueError:  # of int
        raise InputError("not valid TOML: a number has thousands of digits") from None
    if _depth(tables) > DEEPEST:
        raise InputError(f"expected TOML nested at most {DEEPEST} deep, got tables and lists {_depth(tables)} deep")
    return tables


def _refuse_deep(text: str) -> None:
    """Raise InputError for brackets or dotted keys that a parser needs very long for, or too much memory."""
    depth = parts = 0
    for token in _TOML_TOKEN.finditer(text):
        mark = token[0]
        depth += (mark in "[{") - (mark in "]}")
        parts = parts + 1 if mark == "." else 0 if mark in "[{=,\n" else parts
        if depth + parts > DEEPEST:
            line = text.count("\n", 0, token.start()) + 1
            raise InputError(f"expected TOML nested at most {DEEPEST} deep, got more (at line {line})")


def _depth(value: Any) -> int:
    """Return how many tables and lists of a TOML file are within each other, the file itself counted as one."""
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list) else None
    return 0 if inner is None else 1 + max(map(_depth, inner), default=0)


def as_typed(text: str) -> str:
    """Return a TOML string with its control characters as the escapes that make them."""
    return "".join(c if c.isprintable() else _ESCAPES.get(c, f"\\u{ord(c):04x}") for c in text)


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


def _missing(path: Path) -> str:
    """Say that there is no such file: a link to nothing, or a name that is near another one."""
    for place in (path, *path.parents):
        if place.is_symlink() and not os.path.exists(place):
            link, to = (one_line(str(name), LONGEST_NAME) for name in (place, os.path.realpath(place)))
            return f"{link!r} is a link to something that does not exist: {to!r}"
    if "\\" in str(path) and Path(str(path).replace("\\", "/")).is_file():
        return "no such file; there is one with / in place of the backslash, which works everywhere"
    try:
        names = [p.name for p in path.parent.iterdir() if os.path.exists(p)]
    except OSError:
        return f"no such file (nor is there a folder {one_line(str(path.parent))!r})"
    close = get_close_matches(path.name, names, n=1, cutoff=0.7)
    return f"no such file; did you mean {shown(close[0])}?" if close else "no such file"
