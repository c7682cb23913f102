"""The figure of a problem's structure: which unknowns each equation and the Lagrangian's curvature know."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from softnlp.figures.style import GREY, INK, SMALL, TEXT, colour, in_own_style, new_figure, user_text
from softnlp.statics.posed import Problem

if TYPE_CHECKING:
    import casadi as ca
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_LABELLED = 24  # most names along an axis


@in_own_style
def sparsity_figure(problem: Problem, title: str = "Sparsity of the problem") -> Figure:
    """Draw the entries of the Jacobian of all equations, and of the Hessian of the Lagrangian, that are not zero.

    Rows are the equations by name, columns the unknowns by name; lines stand between them.
    """
    compiled = problem.compiled
    J, H = compiled.jacobian.sparsity_out(0), problem.functions["hessian"].sparsity_out(0)
    words = f"{J.size2()} unknowns, {J.size1()} equations, {J.nnz()} entries of the Jacobian, {H.nnz()} of the Hessian"
    figure = new_figure(11.0, 5.8, title, words)
    columns = [(name, where.start, where.stop) for name, where in problem.variables.items()]
    rows = [(e.name, int(e.rows.min()), int(e.rows.max()) + 1) for e in compiled.equations if e.rows.size]
    _panel(figure.add_axes((0.17, 0.17, 0.35, 0.66)), J, rows, columns, "Jacobian of the equations")
    _panel(figure.add_axes((0.63, 0.17, 0.35, 0.66)), H, columns, columns, "Hessian of the Lagrangian")
    return figure


def _panel(
    axes: Axes, of: ca.Sparsity, rows: list[tuple[str, int, int]], columns: list[tuple[str, int, int]], heading: str
) -> None:
    """Draw the entries of one matrix, with the names of its rows and columns where they begin."""
    r, c = (np.asarray(index, dtype=int) for index in of.get_triplet())
    axes.plot(c, r, ".", color=colour(0), markersize=max(0.6, min(3.0, 300 / max(of.size2(), 1))))
    axes.set_xlim(-0.5, of.size2() - 0.5)
    axes.set_ylim(of.size1() - 0.5, -0.5)
    axes.set_title(heading, size=TEXT, color=INK, loc="left")
    for names, axis, line in ((columns, axes.xaxis, axes.axvline), (rows, axes.yaxis, axes.axhline)):
        apart = [name for name in names if name[2] - name[1] < 0.5 * of.size2()]
        for _, start, _ in apart:
            line(start - 0.5, color=GREY, linewidth=0.3)
        shown, least, last = [], (of.size1() if axis is axes.yaxis else of.size2()) / _LABELLED, -np.inf
        for name, start, stop in names:  # one name to a place, else they lie on each other
            middle = (start + stop - 1) / 2
            if middle - last >= least:
                shown.append((middle, user_text(name, 26)))
                last = middle
        axis.set_ticks([at for at, _ in shown], [name for _, name in shown])
    axes.tick_params(labelsize=SMALL - 1.5, colors=INK, length=0)
    axes.tick_params(axis="x", rotation=60)
    for label in axes.get_xticklabels():
        label.set_horizontalalignment("right")
