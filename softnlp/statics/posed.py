"""Problems of your own: which quantities are free, what must hold beside the equations of cases, what is best."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import IllPosedError
from softnlp.base.quantity import Quantity, expression
from softnlp.nlp.constraint import Constraint
from softnlp.nlp.continuation import Followed, Path, follow, straight_path
from softnlp.nlp.optimality import Bounds
from softnlp.nlp.problem import CompiledProblem, compile_problem
from softnlp.nlp.solver import Engine
from softnlp.statics.case import alone, first_guess, own_quantities, pose_entries, unloaded_values
from softnlp.statics.chain import Chain
from softnlp.statics.condensed import linear_solver
from softnlp.statics.loadcase import LoadCase

Array = NDArray[np.float64]
T = TypeVar("T")

BOUNDS = "bounds"
"""What the multipliers of bounds stand under, beside the names of equations and constraints."""

_LARGEST_JUMP = (
    0.6  # of a position or direction cosine between a solution and its prediction: another branch is further
)


@dataclass(frozen=True, eq=False)
class Problem:
    """A problem on the whole transcription, compiled; what solves it is built at first use and kept.

    In x are the free quantities over their scales, then each case's unknowns: the stretch, the node states (and stages)
    in the units of the body, the forces that a wall adds. p holds the fixed quantities, SI.

    Attributes
    ----------
    compiled
        Its functions, names and bounds.
    cases
        As given.
    residuals
        Where half their sum of squares is all that is minimised.
    """

    compiled: CompiledProblem
    cases: tuple[LoadCase | Chain, ...]
    residuals: ca.MX | None = None

    @property
    def nlp(self) -> Mapping[str, ca.MX]:
        """x, p, f and g as expressions, which `casadi.nlpsol` takes."""
        return self.compiled.nlp

    @property
    def bounds(self) -> Bounds:
        """The bounds of x and of g."""
        return self.compiled.bounds

    @property
    def variables(self) -> dict[str, slice]:
        """Where in x each unknown stands: "pressure", "pose: states"; states are column by column."""
        found, start = {}, 0
        named = [(q.name, q.size) for q in self.compiled.free]
        for case in self.cases:
            sizes = [symbol.numel() for symbol in case.symbols]
            named += [(f"{case.name}: {label}", size) for label, size in zip(case.labels, sizes, strict=True)]
        for name, size in named:
            found[name] = slice(start, start + size)
            start += size
        return found

    @property
    def functions(self) -> dict[str, ca.Function]:
        """f, g, jacobian as functions of (x, p), and hessian of (x, p, lam): of f + lam g, the lower triangle too."""
        x, p, f, g = (self.nlp[key] for key in "xpfg")
        lam = ca.MX.sym("lam", g.numel())

        def hessian() -> ca.Function:
            return ca.Function("hessian", [x, p, lam], [ca.hessian(f + ca.dot(lam, g), x)[0]], ["x", "p", "lam"], ["H"])

        return {
            "f": ca.Function("f", [x, p], [f], ["x", "p"], ["f"]),
            "g": ca.Function("g", [x, p], [g], ["x", "p"], ["g"]),
            "jacobian": self.compiled.jacobian,
            "hessian": self._kept("hessian", hessian),
        }

    def _kept(self, key: Any, make: Callable[[], T]) -> T:
        """Return what was made under a key, making it at first use."""
        if key not in self._made:
            self._made[key] = make()
        found: T = self._made[key]
        return found

    @cached_property
    def _made(self) -> dict[Any, Any]:
        return {}

    def _engine(self, **settings: Any) -> Engine:
        """Return what solves the problem, with settings of `softnlp.nlp.solver.Engine`."""
        by_newton = not settings.get("ipopt_only") and self.compiled.is_square

        def make() -> Engine:
            linear = self._kept("linear", lambda: linear_solver(self.compiled)) if by_newton else None
            return Engine(self.compiled, linear=linear, **settings)

        return self._kept(repr(sorted(settings.items())), make)

    def _start(self, values: Mapping[str, Any], free: Mapping[str, Any]) -> Array:
        """Return x where each case is solved by itself, from its unloaded shape, at values of all quantities."""
        x = np.zeros(self.nlp["x"].numel())
        head = self.compiled.pack_free(free)
        x[: head.size] = head
        p = self.compiled.pack(values)
        at = head.size
        for k, case in enumerate(self.cases):
            own = self._own_values(k, x, p)
            size = sum(symbol.numel() for symbol in case.symbols)
            x[at : at + size] = self._alone(k, case, own)
            at += size
        return x

    def _own_values(self, k: int, x: Array, p: Array) -> dict[str, Array]:
        """Return the values of a case's quantities by key, SI."""
        given = self.cases[k].given

        def make() -> ca.Function:
            return self.compiled.function("given", [ca.vec(q.symbol) for q in given.values()])

        found = self._kept(("given", k), make).call([x, p])
        return {key: np.asarray(value).ravel() for key, value in zip(given, found, strict=True)}

    def _alone(self, k: int, case: LoadCase | Chain, values: Mapping[str, Array]) -> Array:
        """Return x of a case at given values: the last point of a path from its unloaded shape."""

        def make() -> tuple[Engine, NDArray[np.intp]]:
            problem = alone(case)
            return Engine(problem, linear=linear_solver(problem), newton_only=True, tolerance=1e-9), pose_entries(case)

        engine, entries = self._kept(("alone", k), make)
        resting = unloaded_values(case, values)
        guess = first_guess(case, resting)
        path = straight_path(engine.problem, resting, values)
        found = followed(engine, path, guess, entries)
        return found.solution.x if np.isfinite(found.solution.residual) else guess


def followed(engine: Engine, path: Path, start: Array, entries: NDArray[np.intp]) -> Followed:
    """Follow a solution along a path, at once where Newton's method allows. entries : of x that tell branches apart."""
    return follow(
        engine,
        path,
        start,
        distance=lambda change: float(np.max(np.abs(change[entries]), initial=0.0)),
        first_step=1.0,
        largest_jump=_LARGEST_JUMP,
    )


def problem(
    cases: Sequence[LoadCase | Chain],
    *,
    given: Sequence[Quantity] = (),
    free: Sequence[str] = (),
    constraints: Sequence[Constraint] = (),
    objective: ca.MX | None = None,
    residuals: Sequence[ca.MX] = (),
) -> Problem:
    """Pose one problem on cases: which quantities are free, what must hold beside their equations, and what is best.

    Parameters
    ----------
    cases
        Of `case`, at least one.
    given
        Quantities that no case declares: targets, weights, factors.
    free
        Names of the quantities that are unknown, within their bounds; the others are fixed.
    constraints
        lower <= expression <= upper, in expressions of the cases' outputs and of quantities' symbols.
    objective
        What is minimised, a scalar; None: the equations and constraints determine what is free.
    residuals
        Expressions whose half sum of squares is minimised, beside the objective where there is one.

    Returns
    -------
    Problem
        Compiled.

    Raises
    ------
    IllPosedError
        Where the equations cannot determine what is free, and for names that are not known or not unique.
    """
    if not cases:
        raise IllPosedError("expected at least one case")
    names = [c.name for c in cases]
    if len(set(names)) < len(names):
        raise IllPosedError(f"two cases are named '{next(n for n in names if names.count(n) > 1)}'")
    known = {q.symbol.__hash__(): q for q in [q for c in cases for q in own_quantities(c)] + list(given)}
    rows = [c.name for c in constraints]
    taken = [*rows, BOUNDS, *(prefix + e.name for c in cases for e in c.equations for prefix in ("", f"{c.name}: "))]
    for name in rows:
        if taken.count(name) > 1:
            raise IllPosedError(f"two constraints or equations are named '{name}'")
    _require_known(cases, known.values(), [
        *((f"constraint '{c.name}'", c.expression) for c in constraints),
        *([] if objective is None else [("objective", objective)]),
        *(("residual", r) for r in residuals),
        *((f"case '{c.name}'", c.residuals) for c in cases),
    ])  # fmt: skip
    if objective is not None and not objective.is_scalar():
        raise IllPosedError(f"objective: expected one number to minimise, got {objective.numel()}")
    column = ca.vertcat(*map(ca.vec, residuals)) if residuals else None
    alone = column if objective is None else None
    if column is not None:
        objective = ca.sumsqr(column) / 2 + (0 if objective is None else objective)
    compiled = compile_problem(list(known.values()), cases, free=free, constraints=constraints, objective=objective)
    return Problem(compiled, tuple(cases), alone)


def _require_known(
    cases: Sequence[LoadCase | Chain], quantities: Iterable[Quantity], used: Iterable[tuple[str, Any]]
) -> None:
    """Raise `IllPosedError` for what is no expression, or has a symbol that no case and no quantity declares."""
    known = {q.symbol.__hash__() for q in quantities} | {s.__hash__() for c in cases for s in c.symbols}
    for what, given in used:
        for symbol in ca.symvar(expression(given, what)):
            if symbol.__hash__() not in known:
                raise IllPosedError(f"{what}: '{symbol.name()}' is no quantity of the cases, nor in given=[...]")
