"""One problem at many instants: copies of it side by side, joined by linear rows and by a quadratic objective.

Each copy has unknowns, equations, bounds and fixed values of its own. The Jacobian and the Hessian are made of the
blocks of one copy, so that the whole is evaluated in the time of its copies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.nlp.case import Equation
from softnlp.nlp.optimality import Bounds
from softnlp.nlp.problem import CompiledProblem

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Link:
    """Rows between copies: lower <= matrix x <= upper, with x the unknowns of all copies, one behind the other.

    name : of the rows in certificates. unit, scale : of a row, SI value = scale * row.
    """

    name: str
    matrix: ca.DM
    lower: Array
    upper: Array
    unit: str = "1"
    scale: float = 1.0


def joined(
    one: CompiledProblem, count: int, *, links: Sequence[Link] = (), quadratic: ca.DM | None = None
) -> CompiledProblem:
    """Return `count` copies of a problem as one.

    x, p and the rows of the copies stand one behind the other, the rows of the links behind all of them. The objective
    is the sum of those of the copies, and x^T Q x / 2. Nothing is free by name: free quantities are at the head of each
    copy, see `CompiledProblem.free_size` of `one`. Fixed values have no names: p stacks what `one.pack` returns.
    """
    n, m, k = one.nlp["x"].numel(), one.nlp["g"].numel(), one.nlp["p"].numel()
    x, p = ca.MX.sym("x", n * count), ca.MX.sym("p", k * count)
    X, P = ca.reshape(x, n, count), ca.reshape(p, k, count)
    own = ca.Function("own", [one.nlp["x"], one.nlp["p"]], [one.nlp["f"], one.nlp["g"]])
    costs, rows = own.map(count)(X, P)
    A = ca.vertcat(*(link.matrix for link in links)) if links else ca.DM(0, n * count)
    Q = ca.DM(n * count, n * count) if quadratic is None else quadratic
    f = ca.sum2(costs) + ca.dot(x, ca.mtimes(Q, x)) / 2
    linked = ca.mtimes(A, x) if links else ca.MX(0, 1)

    def slope() -> ca.MX:
        return ca.vertcat(_blocks(one.jacobian, count, X, P), A)

    def hessian() -> ca.Function:
        lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", m * count + A.shape[0])
        own = _of_objective(one) if any(case.once_differentiable for case in one.cases) else one.hessian
        multipliers = ca.reshape(lam_g[: m * count], m, count)
        blocks = _blocks(own, count, X, P, ca.repmat(lam_f, 1, count), multipliers)
        return ca.Function("hess_lag", [x, p, lam_f, lam_g], [blocks + lam_f * ca.triu(Q)])

    def each(function: ca.Function, name: str, more: ca.MX | None = None, names: Sequence[str] = ()) -> ca.Function:
        found = [ca.vec(part) for part in function.map(count).call([X, P])]
        found = found if more is None else [ca.vertcat(*found, more)]
        return ca.Function(name, [x, p], found, ["x", "p"], list(names)) if names else ca.Function(name, [x, p], found)

    first = ca.Function("first", [x, p], [X[:, 0], P[:, 0]])(x, p)
    g = ca.vertcat(ca.vec(rows), linked)
    return CompiledProblem(
        cases=one.cases,
        free=(),
        fixed=(),
        constraints=(),
        equations=_equations(one.equations, m, count, links),
        nlp={"x": x, "p": p, "f": f, "g": g},
        curved=g,
        left_out=ca.MX(0, 1),
        residual=each(one.residual, "residual", linked),
        fine_residual=each(one.fine_residual, "fine", linked),
        si_scales=ca.Function(
            "si_scales", [x, p], [ca.vertcat(one.si_scales(*first), ca.DM([link.scale for link in links]))]
        ),
        outputs=each(one.outputs, "outputs", names=one.outputs.name_out()),
        case_constants=each(one.case_constants, "constants"),
        case_columns=each(one.case_columns, "columns"),
        units=each(one.units, "units"),
        lower_x=np.tile(one.lower_x, count),
        upper_x=np.tile(one.upper_x, count),
        lower_g=np.concatenate([np.tile(one.lower_g, count), *(link.lower for link in links)]),
        upper_g=np.concatenate([np.tile(one.upper_g, count), *(link.upper for link in links)]),
        is_square=False,
        function=lambda name, expressions: ca.Function(name, [x, p], list(expressions)),
        own_slope=slope,
        own_hessian=hessian,
    )


def with_bounds(problem: CompiledProblem, bounds: Bounds) -> CompiledProblem:
    """Return a problem within other bounds, which say which rows are equations and which unknowns are held."""
    return replace(
        problem, lower_x=bounds.lower_x, upper_x=bounds.upper_x, lower_g=bounds.lower_g, upper_g=bounds.upper_g
    )


def _blocks(function: ca.Function, count: int, *columns: ca.MX) -> ca.MX:
    """Return what a function gives for each column as the blocks of a diagonal."""
    every = function.map(count)(*columns)
    found: ca.MX = ca.sparsity_cast(every, ca.diagcat(*[function.sparsity_out(0)] * count))
    return found


def _of_objective(one: CompiledProblem) -> ca.Function:
    """Return the Hessian of the objective alone, as `CompiledProblem.hessian`: of rows that have no second derivative.

    The step is then Gauss and Newton's, which converges where the rows are not curved much against the objective.
    """
    x, p, f, g = (one.nlp[name] for name in "xpfg")
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", g.numel())
    return ca.Function("hess_lag", [x, p, lam_f, lam_g], [ca.triu(ca.hessian(lam_f * f, x)[0])])


def _equations(of_one: Sequence[Equation], rows: int, count: int, links: Sequence[Link]) -> tuple[Equation, ...]:
    """Return the equations of all copies under the names of one, and those of the links."""
    starts = rows * np.arange(count)[:, None]
    found = [replace(e, rows=(e.rows + starts).ravel()) for e in of_one]
    at = rows * count
    for link in links:
        found.append(Equation(link.name, at + np.arange(link.lower.size), link.unit, ca.MX(link.scale)))
        at += link.lower.size
    return tuple(found)
