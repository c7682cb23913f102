"""How large a problem is by each transcription."""

from __future__ import annotations

from docs.figures._nlp import posed
from docs.figures._shared import markdown

METHODS = {
    "multiple shooting, 10 intervals": "MultipleShooting(10)",
    "multiple shooting, 40 intervals": "MultipleShooting(40)",
    "collocation, 10 intervals": "Collocation(10)",
}


def text() -> str:
    """Return the table."""
    rows = []
    for label, method in METHODS.items():
        problem = posed(method)
        J, H = problem.compiled.jacobian.sparsity_out(0), problem.functions["hessian"].sparsity_out(0)
        filled = f"{100 * J.nnz() / (J.size1() * J.size2()):.1f}"
        rows.append([label, J.size2(), J.size1(), J.nnz(), filled, H.nnz()])
    header = ["transcription", "unknowns", "rows", "entries of the Jacobian", "of all entries [%]", "of the Hessian"]
    return markdown(header, rows)


if __name__ == "__main__":
    print(text())
