"""Every status that a step can have, with what it says and whether it carries a solution."""

from __future__ import annotations

from docs.figures._shared import markdown
from softnlp.base.status import Status


def text() -> str:
    """Return the table."""
    rows = [[f"`{status}`", "yes" if status.has_solution else "no", status.advice] for status in Status]
    return markdown(["status", "solution", "meaning, and what to do"], rows)


if __name__ == "__main__":
    print(text())
