"""What an import comes to: columns under this package's names, what was chosen and why, and what was checked."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import inf

import numpy as np
from numpy.typing import NDArray

from softnlp.laboratory.choices import AskError, Choices
from softnlp.studies.check import Check

Array = NDArray[np.float64]

_CHUNK = 20_000
ANY = (-inf, inf)
PAGE = "docs/checks.md"


@dataclass(frozen=True, eq=False)
class Imported:
    """Measurements in the units that their names carry.

    kind : "tensile", "pressure", "tips" or "force". files : as they were named. columns : (rows,) by the names that
    scenarios take. checks : of them. choices : what decided. numbers : what is said of them besides, such as the
    hysteresis. path : (points, 2) of the whole curve for figures, where there is one.
    """

    kind: str
    files: tuple[str, ...]
    columns: Mapping[str, Array]
    checks: tuple[Check, ...]
    choices: Choices
    numbers: Mapping[str, float] = field(default_factory=dict)
    path: Array | None = None

    @property
    def rows(self) -> int:
        """How many rows there are."""
        return len(next(iter(self.columns.values())))

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is unusual, each with the name of its check and its page."""
        return tuple(told(check) for check in self.checks if check.verdict == "warned")

    def csv(self) -> str:
        """Return the columns as the project's CSV; a number has ten digits, seconds since 1970 have more."""
        table = np.column_stack(list(self.columns.values()))
        form = ",".join("%.15g" if size > 1e6 else "%.10g" for size in np.nanmax(np.abs(table), axis=0))
        parts = [",".join(self.columns)]
        for first in range(0, len(table), _CHUNK):  # a list of all numbers would take ten times their memory
            parts.append("\n".join(form % tuple(row) for row in table[first : first + _CHUNK].tolist()))
        text = "\n".join(parts) + "\n"
        return text.replace("nan", "") if np.isnan(table).any() else text

    def document(self) -> dict[str, object]:
        """Return what `softnlp import --json` prints."""
        return {
            "kind": self.kind,
            "files": list(self.files),
            "columns": list(self.columns),
            "units": {name: _unit_of(name) for name in self.columns},
            "rows": self.rows,
            "dropped": dict(self.choices.dropped),
            "numbers": dict(self.numbers),
            "settings": dict(self.choices.used),
            "notes": list(self.choices.notes),
            "guesses": [vars(guess) for guess in self.choices.guesses],
            "checks": [check.document() for check in self.checks],
        }


def _unit_of(name: str) -> str:
    """Return the unit that a column's name ends with, "1" where it has none."""
    last = name.rpartition("_")[2]
    return last if last in ("s", "mm", "bar", "MPa", "N", "Nmm", "deg") else "1"


def told(check: Check) -> str:
    """Return what a check says, with its page."""
    return f"{check.message} ({PAGE}#{slug(check.name)})"


def slug(name: str) -> str:
    """Return the anchor of a check's heading."""
    return "-".join(re.sub(r"[^\w\- ]", "", name.lower()).split())


def require_possible(checks: Iterable[Check], choices: Choices) -> None:
    """Raise `AskError` for the first check that failed, but those that the setting `accept` names."""
    accepted = choices.get("accept", [])
    accepted = accepted if isinstance(accepted, list) else [accepted]
    for check in checks:
        if check.verdict == "failed" and check.name not in accepted and slug(check.name) not in accepted:
            raise AskError(f"{told(check)}; --set accept={slug(check.name)} takes it all the same")
