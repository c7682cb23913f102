"""A number in a cell as machines write it: decimal point or comma, digits in groups, words for what is missing."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MISSING = frozenset(("nan", "na", "n/a", "-", "--", "---", "null", "none", "inf", "+inf", "-inf", "#n/a", "missing"))
_EXPONENT = r"(?:[eE][+-]?\d+)?"
_PLAIN = {
    ".": re.compile(rf"[+-]?(?:\d+\.?\d*|\.\d+){_EXPONENT}"),
    ",": re.compile(rf"[+-]?(?:\d+,?\d*|,\d+){_EXPONENT}"),
}
_GROUPED = {
    ".": re.compile(r"[+-]?[1-9]\d{0,2}(?:[, ']\d{3})+(?:\.\d*)?"),
    ",": re.compile(r"[+-]?[1-9]\d{0,2}(?:[. ']\d{3})+,\d+"),
}
_GROUPS = re.compile(r"[ ']")


def is_number(cell: str, decimal: str) -> bool:
    """Whether a cell is a number with this decimal sign; digits may stand in groups."""
    return bool(_PLAIN[decimal].fullmatch(cell) or _GROUPED[decimal].fullmatch(cell))


def is_grouped(cell: str, decimal: str) -> bool:
    """Whether a cell is a number only where a sign between its digits groups them."""
    return not _PLAIN[decimal].fullmatch(cell) and bool(_GROUPED[decimal].fullmatch(cell))


def number(cell: str, decimal: str) -> float:
    """Return the number of a cell, nan where it is missing or none."""
    text = cell.strip()
    if _GROUPED[decimal].fullmatch(text):
        text = _GROUPS.sub("", text.replace("," if decimal == "." else ".", ""))
    elif not _PLAIN[decimal].fullmatch(text):
        return float("nan")
    return float(text.replace(",", ".") if decimal == "," else text)


def numbers(cells: Sequence[str], decimal: str) -> tuple[Array, int]:
    """Return a column of cells as numbers, nan where there is none, and how many cells are wrong."""
    commas = decimal == ","
    try:
        every = "".join(cells)
        if "_" in every or (commas and "." in every):  # which Python's float would take
            raise ValueError
        plain = [cell.replace(",", ".") for cell in cells] if commas else cells
        values = np.fromiter(map(float, plain), float, len(cells))
    except ValueError:
        values = np.array([number(cell, decimal) for cell in cells])
    values[~np.isfinite(values)] = np.nan
    wrong = 0
    for k in np.flatnonzero(np.isnan(values)):
        text = cells[int(k)].strip().lower()
        wrong += bool(text) and text not in MISSING
    return values, wrong
