"""A number that has to be plausible: its value, the ranges it is held against, and what to say of it."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite
from typing import Any

Range = tuple[float, float]


@dataclass(frozen=True)
class Check:
    """A number that has to be plausible.

    Attributes
    ----------
    name
        Of the number.
    value
        The number [1] or in `unit`.
    usual, possible
        (2,) lowest and highest: beyond the first it is warned of, beyond the second it fails [1] or in `unit`.
    likely
        What is wrong where it does.
    unit
        Of the number, "" for 1.
    """

    name: str
    value: float
    usual: Range
    possible: Range
    likely: str
    unit: str = ""

    @property
    def verdict(self) -> str:
        """Of "passed", "warned" and "failed"; no number fails."""
        for verdict, (low, high) in (("passed", self.usual), ("warned", self.possible)):
            if low <= self.value <= high:
                return verdict
        return "failed"

    @property
    def message(self) -> str:
        """What is wrong in one sentence, "" where nothing is."""
        if self.verdict == "passed":
            return ""
        low, high = self.possible if self.verdict == "failed" else self.usual
        between = f"{low:.4g} to {high:.4g}" if low < high < inf else f"{low:.4g}"
        expected = f"at least {low:.4g}" if isfinite(low) else f"at most {high:.4g}"
        expected = between if isfinite(low) and isfinite(high) else expected
        unit = self.unit and f" {self.unit}"
        return f"the {self.name} is {self.value:.4g}{unit}, expected {expected}{unit}: {self.likely}"

    def document(self) -> dict[str, Any]:
        """Return it as JSON has it.

        Returns
        -------
        dict
            Name, value, unit, ranges, verdict and message; an open end of a range is None.
        """
        return {
            "name": self.name,
            "value": _open(float(self.value)),
            "unit": self.unit or None,
            "usual": [_open(float(v)) for v in self.usual],
            "possible": [_open(float(v)) for v in self.possible],
            "verdict": self.verdict,
            "message": self.message,
        }


def _open(value: float) -> float | None:
    return value if isfinite(value) else None


def messages(checks: tuple[Check, ...], verdict: str) -> tuple[str, ...]:
    """Return what the checks of one verdict say."""
    return tuple(check.message for check in checks if check.verdict == verdict)
