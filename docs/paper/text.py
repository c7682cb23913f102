"""Markdown of the pages: tables, links to scenarios, and where a page comes from."""

from __future__ import annotations

import math
from collections.abc import Sequence

from docs.paper.published import citation

NONE = "–"
_WORDS = ("no", "one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve")


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table; the first column to the left, the others to the right."""
    lines = [header, [":--", *["--:"] * (len(header) - 1)], *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def fixed(value: float | None, digits: int = 1) -> str:
    """Return a number with so many decimals, or a dash for None and NaN."""
    return NONE if value is None or math.isnan(value) else f"{value:.{digits}f}"


def worded(count: int) -> str:
    """Return a small number as a word."""
    return _WORDS[count] if count < len(_WORDS) else str(count)


def between(low: float, high: float, digits: int = 1) -> str:
    """Return a range."""
    return f"{low:.{digits}f} to {high:.{digits}f}"


def scenario_link(name: str, folder: str = "paper") -> str:
    """Return a link to a scenario of a folder of `scenarios`, as it is seen from the page."""
    return f"[{name}.toml](../../scenarios/{folder}/{name}.toml)"


def figure(name: str, words: str) -> str:
    """Return the image of a file beside the page."""
    return f"![{words}]({name}.png)"


def page_text(title: str, *parts: str) -> str:
    """Return a page: heading, parts a line apart, and the source of what it compares with."""
    foot = f"Published and measured numbers: {citation()}. Every other number was computed when this page was built."
    return "\n\n".join([f"# {title}", *(part.strip() for part in parts), foot]) + "\n"
