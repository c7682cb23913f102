"""The unknowns and the rows of a problem by name."""

from __future__ import annotations

from docs.figures._nlp import posed
from docs.figures._shared import markdown

UNKNOWNS = {
    "pressure": ("freed: one pressure per set", "bar"),
    "pose: stretch": ("λ, the axial stretch of the section", "1"),
    "pose: states": ("p, R column by column, N and M at each node", "L_0; 1; EI/L_0²; EI/L_0"),
}
MEANINGS = {
    "stretch balance": "the axial balance of the section, Eq. (23)",
    "base position": "p = 0 at the base",
    "base orientation": "R = 1 at the base",
    "continuity of position": "a node is where the interval before it ends, Eq. (2)",
    "continuity of rotation": "the same for R",
    "continuity of force": "the same for N, Eq. (8)",
    "continuity of moment": "the same for M, Eq. (17)",
    "tip force": "N at the tip is the tip force, Eq. (9)",
    "tip moment": "M at the tip is the tip moment, Eq. (9)",
    "bending angle": "the constraint of the problem",
}


def text() -> str:
    """Return the tables."""
    problem = posed()
    unknowns = [
        [f"`{name}`", f"`x[{where.start}:{where.stop}]`", where.stop - where.start, *UNKNOWNS[name]]
        for name, where in problem.variables.items()
    ]
    rows = [[f"`{e.name}`", len(e.rows), e.unit, MEANINGS[e.name]] for e in problem.compiled.equations]
    return "\n\n".join(
        (
            markdown(["unknown", "place in x", "entries", "what it is", "unit in x"], unknowns),
            markdown(["row", "entries", "unit of its residual", "what it says"], rows),
        )
    )


if __name__ == "__main__":
    print(text())
