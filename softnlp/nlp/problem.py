"""Problems: which quantities are free, what else must hold, what is best; compiled once, solved for many values."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import IllPosedError, nearest
from softnlp.base.quantity import Quantity
from softnlp.nlp.case import Case, Equation
from softnlp.nlp.constraint import Constraint
from softnlp.nlp.optimality import Bounds, slopes

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class CompiledProblem:
    """A problem as functions of its unknowns x (scaled) and its fixed values p (SI).

    x stacks the free quantities, then each case's unknowns; p stacks the fixed quantities. residual(x, p) stacks each
    case's equations, then the constraints over their scales, those that are not in the Hessian last. nlp holds x, p, f,
    g as expressions; of g, curved are the rows in the Hessian and left_out the others, if any. function(name,
    expressions) makes a function of (x, p) of expressions in the symbols of quantities and cases, `dense` or as they
    are. own_slope : makes the Jacobian where it is that of a case alone, or known in blocks. own_hessian : makes what
    `hessian` is, likewise.
    """

    cases: tuple[Case, ...]
    free: tuple[Quantity, ...]
    fixed: tuple[Quantity, ...]
    constraints: tuple[Constraint, ...]
    equations: tuple[Equation, ...]
    nlp: Mapping[str, ca.MX]
    curved: ca.MX
    left_out: ca.MX
    residual: ca.Function
    fine_residual: ca.Function
    si_scales: ca.Function
    outputs: ca.Function
    case_constants: ca.Function
    case_columns: ca.Function
    units: ca.Function
    lower_x: Array
    upper_x: Array
    lower_g: Array
    upper_g: Array
    is_square: bool
    function: Callable[..., ca.Function]
    own_slope: Callable[[], ca.MX] | None
    own_hessian: Callable[[], ca.Function] | None = None

    @cached_property
    def jacobian(self) -> ca.Function:
        """The Jacobian of the residual by x, as a function of (x, p); built at first use."""
        x, p, _ = (self.nlp[name] for name in "xpg")
        return ca.Function("jacobian", [x, p], [self.slope])

    @cached_property
    def slope(self) -> ca.MX:
        """The Jacobian of g by x as an expression.

        Those of the cases and of the constraints are made apart: a constraint may depend on every state of a rod, and
        one such row would take the sparse directions from all the others.
        """
        x, g = self.nlp["x"], self.curved
        if self.own_slope is not None:
            return self.own_slope()
        own = sum(case.residuals.numel() for case in self.cases)
        parts = [part for part in (g[:own], g[own:], self.left_out) if part.numel()]
        return ca.vertcat(*(ca.jacobian(part, x) for part in parts)) if parts else ca.jacobian(g, x)

    @cached_property
    def hessian(self) -> ca.Function:
        """(x, p, lam_f, lam_g) -> the upper triangle of the Lagrangian's, of the curved rows; built at first use."""
        if self.own_hessian is not None:
            return self.own_hessian()
        x, p, f, g = (self.nlp[name] for name in "xpfg")
        lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", g.numel())
        lagrangian = lam_f * f + ca.dot(lam_g[: self.curved.numel()], self.curved)
        return ca.Function("hess_lag", [x, p, lam_f, lam_g], [ca.triu(ca.hessian(lagrangian, x)[0])])

    @cached_property
    def slopes(self) -> ca.Function:
        """What the KKT error is judged by, see `softnlp.nlp.optimality.slopes`; built at first use."""
        return slopes(self.nlp)

    @property
    def bounds(self) -> Bounds:
        """The bounds of the unknowns and of the rows."""
        return Bounds(self.lower_x, self.upper_x, self.lower_g, self.upper_g)

    @property
    def has_objective(self) -> bool:
        """Whether something is minimised."""
        return not self.nlp["f"].is_constant()

    @cached_property
    def _fixed_column(self) -> _Column:
        return _column(self.fixed, "a fixed")

    @cached_property
    def _free_column(self) -> _Column:
        return _column(self.free, "a free")

    @property
    def free_size(self) -> int:
        """The number of entries of x that are free quantities."""
        return sum(q.size for q in self.free)

    def pack(self, values: Mapping[str, Any]) -> Array:
        """Return p from SI values by quantity name; what is not named keeps its nominal value.

        Raises `IllPosedError` for a name that is not a fixed quantity of this problem, or a value of another size.
        """
        return self._fixed_column.filled(values)

    def free_values(self, x: Array) -> dict[str, Array]:
        """Return the free quantities in x by name, SI."""
        places = self._free_column.places
        return {q.name: x[places[q.name]] * q.scale for q in self.free}

    def values(self, x: Array, p: Array) -> dict[str, Array]:
        """Return every quantity by name, SI."""
        found = {q.name: p[self._fixed_column.places[q.name]] for q in self.fixed}
        return {**self.free_values(x), **found}

    def pack_free(self, values: Mapping[str, Any]) -> Array:
        """Return the head of x from SI values of the free quantities; nominal where not named. Raises as `pack`."""
        scales = np.repeat([q.scale for q in self.free], [q.size for q in self.free])
        scaled: Array = self._free_column.filled(values) / scales
        return scaled


@dataclass(frozen=True, eq=False)
class _Column:
    """Where each of some quantities stands in a column, and the column of nominal values, SI."""

    places: Mapping[str, slice]
    nominal: Array
    kind: str

    def filled(self, values: Mapping[str, Any]) -> Array:
        """Return the column with values in place of the nominal ones."""
        column = self.nominal.copy()
        for name, given in values.items():
            if name not in self.places:
                raise IllPosedError(f"'{name}' is not {self.kind} quantity of this problem{nearest(name, self.places)}")
            value, place = np.asarray(given, float).ravel(), self.places[name]
            if value.size not in (1, place.stop - place.start):
                raise IllPosedError(f"'{name}' takes {place.stop - place.start} numbers, got {value.size}")
            column[place] = value
        return column


def _column(among: Sequence[Quantity], kind: str) -> _Column:
    """Stack quantities."""
    places, start = {}, 0
    for q in among:
        places[q.name] = slice(start, start + q.size)
        start += q.size
    return _Column(places, np.concatenate([np.zeros(0), *(q.nominal for q in among)]), kind)


def compile_problem(
    given: Sequence[Quantity],
    cases: Sequence[Case],
    *,
    free: Sequence[str] = (),
    constraints: Sequence[Constraint] = (),
    objective: ca.MX | None = None,
) -> CompiledProblem:
    """Fix or free the quantities and compile the problem.

    given : every quantity that the cases, constraints and objective use. free : names of those that are unknown.
    Raises `IllPosedError`, naming quantities and constraints, when the equations cannot determine the free quantities
    or when an objective has nothing left to choose.
    """
    by_name = {q.name: q for q in given}
    if len(by_name) < len(given):
        twice = next(q.name for q in given if by_name[q.name] is not q)
        raise IllPosedError(f"two quantities are named '{twice}'; a case's own quantity needs a name of its own")
    for name in free:
        if name not in by_name:
            raise IllPosedError(f"'{name}' cannot be freed: no such quantity{nearest(name, by_name)}")
    freed = tuple(by_name[name] for name in dict.fromkeys(free))
    fixed = tuple(q for q in given if q.name not in set(free))

    unknowns = [symbol for case in cases for symbol in case.symbols]
    free_size = sum(q.size for q in freed)
    x = ca.MX.sym("x", free_size + sum(symbol.numel() for symbol in unknowns))
    p = ca.MX.sym("p", sum(q.size for q in fixed))
    originals = [*(q.symbol for q in freed), *unknowns, *(q.symbol for q in fixed)]
    heads = [q.scale for q in freed] + [1.0] * len(unknowns)
    pieces = [scale * part for scale, part in zip(heads, _split(x, originals[: len(heads)]), strict=True)]
    pieces += _split(p, originals[len(heads) :])

    def function(
        name: str, expressions: Sequence[ca.MX], names: Sequence[str] | None = None, *, dense: bool = True
    ) -> ca.Function:
        inner = ca.Function(name, originals, [ca.densify(ca.MX(e)) if dense else ca.MX(e) for e in expressions])
        results = inner.call(pieces, True, False)
        return (
            ca.Function(name, [x, p], results, ["x", "p"], list(names)) if names else ca.Function(name, [x, p], results)
        )

    def slope() -> ca.MX:
        found: ca.MX = ca.Function("slope", originals, [cases[0].slope]).call(pieces, True, False)[0]
        return found

    constraints = sorted(constraints, key=lambda c: not c.in_hessian)
    scaled = [c.scaled() for c in constraints]
    rows = [row for row, _, _ in scaled]
    residual = function("residual", [ca.vertcat(*(case.residuals for case in cases), *rows)])
    fine = function("fine", [ca.vertcat(*(case.fine_residuals for case in cases), *rows)])
    cost = function("cost", [objective])(x, p) if objective is not None else ca.MX(0)
    curved, left_out = residual(x, p), ca.MX(0, 1)
    if not all(c.in_hessian for c in constraints):
        within = sum(c.in_hessian for c in constraints)
        groups = [*(case.residuals for case in cases), *rows[:within]], rows[within:]
        curved, left_out = (function("rows", [ca.vertcat(*group)])(x, p) for group in groups)
    g = ca.vertcat(curved, left_out)

    equations = _all_equations(cases, constraints)
    none = np.zeros(sum(case.residuals.numel() for case in cases))
    states = x.numel() - free_size
    compiled = CompiledProblem(
        cases=tuple(cases),
        free=freed,
        fixed=fixed,
        constraints=tuple(constraints),
        equations=equations,
        nlp={"x": x, "p": p, "f": cost, "g": g},
        curved=curved,
        left_out=left_out,
        residual=residual,
        fine_residual=fine,
        si_scales=function("si_scales", [ca.vertcat(*(e.si_scale for e in equations))]),
        outputs=_outputs(function, cases),
        case_constants=function("constants", [ca.vertcat(*(case.constants for case in cases))]),
        case_columns=function("columns", [case.column for case in cases]),
        units=function("units", [ca.vertcat(*(ca.vertcat(case.length_unit, case.force_unit) for case in cases))]),
        lower_x=np.concatenate([*(np.full(q.size, q.lower / q.scale) for q in freed), np.full(states, -np.inf)]),
        upper_x=np.concatenate([*(np.full(q.size, q.upper / q.scale) for q in freed), np.full(states, np.inf)]),
        lower_g=np.concatenate([none, *(lower for _, lower, _ in scaled)]),
        upper_g=np.concatenate([none, *(upper for _, _, upper in scaled)]),
        function=function,
        is_square=objective is None and g.numel() == x.numel() and all(c.is_equality for c in constraints),
        own_slope=slope if len(cases) == 1 and not (freed or constraints) else None,
    )
    if freed or constraints:  # load cases alone are square and well posed
        _refuse_ill_posed(compiled, objective is not None)
    return compiled


def _split(column: ca.MX, like: Sequence[ca.MX]) -> list[ca.MX]:
    """Cut a column into pieces of the sizes of `like`."""
    if not like:
        return []
    return list(ca.vertsplit(column, np.cumsum([0, *(s.numel() for s in like)]).tolist()))


def _outputs(function: Any, cases: Sequence[Case]) -> ca.Function:
    """Return the outputs of every case; names are prefixed by the case's name when there are several."""
    names = [key if len(cases) == 1 else f"{case.name}_{key}" for case in cases for key in case.outputs]
    made: ca.Function = function("outputs", [e for case in cases for e in case.outputs.values()], names)
    return made


def _all_equations(cases: Sequence[Case], constraints: Sequence[Constraint]) -> tuple[Equation, ...]:
    """Stack the equations of the cases and constraints, with rows counted in the whole residual."""
    every: list[Equation] = []
    start = 0
    for case in cases:
        prefix = "" if len(cases) == 1 else f"{case.name}: "
        every += [replace(e, name=prefix + e.name, rows=e.rows + start) for e in case.equations]
        start += case.residuals.numel()
    for c in constraints:
        every.append(Equation(c.name, start + np.arange(c.expression.numel()), c.unit, ca.MX(c.scale)))
        start += c.expression.numel()
    return tuple(every)


def _refuse_ill_posed(problem: CompiledProblem, has_objective: bool) -> None:
    """Raise `IllPosedError` where counting or the structure of the Jacobian shows that there is no isolated answer."""
    equal = problem.lower_g == problem.upper_g
    J = ca.jacobian_sparsity(problem.nlp["g"], problem.nlp["x"])
    added = sum(c.expression.numel() for c in problem.constraints if c.is_equality)
    freed = problem.free_size
    free_text = ", ".join(f"{q.name} ({q.size})" for q in problem.free) or "nothing"
    added_text = ", ".join(f"{c.name} ({c.expression.numel()})" for c in problem.constraints if c.is_equality) or "none"

    r, c = (np.asarray(index, dtype=int) for index in J.get_triplet())
    entries_in_row = np.bincount(r, minlength=J.size1())
    entries_in_column = np.bincount(c, minlength=J.size2())
    in_cost = ca.jacobian_sparsity(problem.nlp["f"], problem.nlp["x"]).get_triplet()[1]
    entries_in_cost = np.bincount(np.asarray(in_cost, dtype=int), minlength=J.size2())
    for equation in problem.equations[-len(problem.constraints) :] if problem.constraints else ():
        if not np.all(entries_in_row[equation.rows]):
            raise IllPosedError(
                f"constraint '{equation.name}' does not depend on anything unknown; free a quantity that moves it"
            )
    if added > freed:
        raise IllPosedError(
            f"too many equations: free are {free_text}, and the constraints add {added} equations: {added_text}; "
            "free more quantities, or make a constraint an objective"
        )
    if added < freed and not has_objective:
        raise IllPosedError(
            f"too few equations: free are {free_text}, and the constraints add {added} equations: {added_text}; "
            "fix a quantity, add a constraint or give an objective"
        )
    if added == freed and has_objective:
        raise IllPosedError(
            f"the objective has nothing to choose: free are {free_text}, and the constraints add as many equations: "
            f"{added_text}; free more quantities, or leave the objective out"
        )
    rows = np.flatnonzero(equal).tolist()
    equalities = J.sub(rows, list(range(J.size2())))[0]
    rank = ca.sprank(ca.DM(equalities, 1))
    if rank < len(rows):
        raise IllPosedError(
            f"the constraints {added_text} cannot all be met by freeing {free_text}: they move {len(rows) - rank} "
            "combination(s) of unknowns too few; free a quantity that enters them"
        )
    for q in problem.free:
        columns = problem._free_column.places[q.name]
        if not np.all(entries_in_column[columns] + entries_in_cost[columns]):
            raise IllPosedError(
                f"'{q.name}' is free but enters no equation and no objective, so nothing determines it; fix it"
            )
