"""How the files and tables of silicones are read: every error is one line with its file, its table and its key."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from numbers import Real
from os import PathLike
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from softnlp.base.errors import InputError, MaterialError, nearest
from softnlp.base.ranges import Range
from softnlp.base.reading import LARGEST_TOML, read_text, toml_tables
from softnlp.model.formula import shown
from softnlp.model.laws import SYMBOLS


@contextmanager
def located(*, source: str | None = None, table: str | None = None, key: str | None = None) -> Iterator[None]:
    """Add the place to a `MaterialError` that passes; one that names its file knows its table already."""
    try:
        yield
    except MaterialError as error:
        raise (error if error.source else error.located(source=source, table=table, key=key)) from None


def file_label(file: Any) -> str:
    """Return how an error names a file."""
    text = str(file)
    return text if isinstance(file, str | PathLike) and text.isprintable() else shown(file)


def shipped_file() -> Path:
    """Return the library's file: beside the package when installed, at the top level of a checkout."""
    package = Path(__file__).parents[1]
    installed = package / "materials.toml"
    return installed if installed.is_file() else package.parent / "materials.toml"


def read_table(file: Any) -> dict[str, Any]:
    """Return the tables of a TOML file, or raise `MaterialError`."""
    if not isinstance(file, str | PathLike):
        raise MaterialError("expected the path of a TOML file")
    try:
        return toml_tables(read_text(Path(file), LARGEST_TOML))
    except InputError as error:
        raise MaterialError(error.message) from None


def quoted(name: str) -> str:
    """Return a key as TOML writes it."""
    if re.fullmatch(r"[A-Za-z0-9_-]+", name):
        return name
    return json.dumps(name, ensure_ascii=not name.isprintable())


def check_keys(table: Any, required: Iterable[str], optional: Iterable[str] = (), *, what: str = "key") -> None:
    """Raise `MaterialError` for a key that is unknown or missing."""
    if not isinstance(table, Mapping):
        raise MaterialError(f"expected a table, got {shown(table)}")
    required = list(required)
    known = [*required, *optional]
    for key in table:
        if key not in known:
            raise MaterialError(f"unknown {what}{nearest(str(key), known)}", key=quoted(str(key)))
    for key in required:
        if key not in table:
            raise MaterialError(f"missing {what}; expected {', '.join(required)}", key=key)


def text_of(table: Mapping[str, Any], key: str) -> str:
    """Return a text that is not empty, or raise `MaterialError`."""
    value = table[key]
    if not isinstance(value, str) or not value.strip():
        raise MaterialError(f"expected text, got {shown(value)}", key=key)
    return str(value)


def number(value: Any, key: str, *, positive: bool = False) -> Any:
    """Return a finite number as a float, an array of them as one of floats, a symbol as it is."""
    if isinstance(value, SYMBOLS):
        return value
    if isinstance(value, ca.DM):
        value = value.full() if value.numel() > 1 else float(value)
    expected = "a positive number" if positive else "a finite number"
    is_array = isinstance(value, np.ndarray) and value.dtype.kind in "iuf"
    if not is_array and (isinstance(value, bool) or not isinstance(value, Real)):
        raise MaterialError(f"expected {expected}, got {shown(value)}", key=key)
    try:
        number = value.astype(float) if is_array else float(value)
    except OverflowError:  # an integer beyond the largest float
        number = np.inf
    if not np.all(np.isfinite(number)) or (positive and not np.all(number > 0)):
        raise MaterialError(f"expected {expected}, got {shown(value)}", key=key)
    return number


def within(limits: Range, value: Any, key: str) -> None:
    """Raise `MaterialError` for a number, or one of an array, outside its range; a symbol is none."""
    if not isinstance(value, SYMBOLS):
        try:
            limits.require(value, key)
        except InputError as error:
            raise MaterialError(error.message, key=error.key) from None


def stretch_range(value: Any) -> tuple[float, float]:
    """Return a low and a high stretch, the high above 1, or raise `MaterialError`."""
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise MaterialError(f"expected two stretches such as [1.0, 2.0], got {shown(value)}", key="fitted_stretch")
    low, high = (number(bound, "fitted_stretch", positive=True) for bound in value)
    if not low < high or not high > 1:
        raise MaterialError(
            f"expected a low and a high stretch, the high above 1, got {shown(value)}", key="fitted_stretch"
        )
    return low, high
