"""Which of many random cases are left to `pytest -m slow`."""

from __future__ import annotations

from typing import Any

import pytest


def some_slow(cases: int, quick: int) -> list[Any]:
    """Return the numbers from 0 of so many cases; those after the first few are marked slow."""
    return [k if k < quick else pytest.param(k, marks=pytest.mark.slow) for k in range(cases)]
