"""Problems of one robot or several states of loading, as the studies build them, and a first guess for each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from softnlp.base.quantity import Quantity
from softnlp.model.quantities import Model, quantities
from softnlp.nlp.constraint import Constraint
from softnlp.nlp.problem import CompiledProblem, compile_problem
from softnlp.nlp.solver import Engine, Solution, outputs
from softnlp.nlp.transcription import MultipleShooting, Transcription
from softnlp.statics.branch import branch_function, stretch_on_branch
from softnlp.statics.loadcase import LoadCase, RodFunctions, load_case, rod_functions

Build = Callable[[Sequence[LoadCase], Mapping[str, Quantity]], Any]
METHOD = MultipleShooting(24)


@dataclass(frozen=True, eq=False)
class Posed:
    """A compiled problem whose load cases all belong to one model; `given[k]` holds the quantities of case k."""

    model: Model
    functions: RodFunctions
    given: Sequence[Mapping[str, Quantity]]
    problem: CompiledProblem

    def start(self, values: Mapping[str, Any]) -> np.ndarray:
        """Return x of the unloaded arcs at the given values (SI, by name) of free and fixed quantities."""
        branch = branch_function(self.model)
        parts = [self.problem.pack_free({k: v for k, v in values.items() if k in {q.name for q in self.problem.free}})]
        for case, given in zip(self.problem.cases, self.given, strict=True):
            column = np.concatenate([np.ravel(values.get(q.name, q.nominal)) for q in given.values()])
            stretch = stretch_on_branch(branch, column, np.ravel(values.get(given["pressure"].name, 0.0))).stretch
            arcs = np.asarray(self.functions.arc(column, stretch, case.transcribed.points[None, :]))
            parts += [np.array([stretch]), arcs.T.ravel()]
        return np.concatenate(parts)

    def solve(
        self, values: Mapping[str, Any], guess: Mapping[str, Any] | None = None, *, max_iterations: int = 100
    ) -> Solution:
        """Solve with IPOPT at the fixed values, from `guess` for the free ones (nominal where not named)."""
        nominal = {q.name: q.nominal for q in self.problem.free} | dict(guess or {})
        engine = Engine(self.problem, max_iterations=max_iterations)
        return engine.solve(self.problem.pack(values), self.start({**values, **nominal}))

    def outputs(self, solution: Solution) -> dict[str, np.ndarray]:
        return outputs(self.problem, solution)


def pose(
    model: Model,
    *,
    free: Sequence[str] = (),
    constraints: Build | None = None,
    objective: Build | None = None,
    extra: Sequence[Quantity] = (),
    own: Sequence[Mapping[str, Quantity]] = ({},),
    method: Transcription = METHOD,
) -> Posed:
    """Compile a problem with a load case for each entry of `own`, which holds the quantities that are the case's own.

    constraints, objective : called with the cases and the shared quantities. extra : further quantities.
    """
    shared = quantities(model)
    functions = rod_functions(model)
    given = [shared | dict(changes) for changes in own]
    names = ["pose"] if len(own) == 1 else [f"case{k}" for k in range(len(own))]
    cases = [load_case(name, functions, g, method) for name, g in zip(names, given, strict=True)]
    known = shared | {q.name: q for q in extra}
    owned = {q.name: q for changes in own for q in changes.values()}
    every = [*(q for q in shared.values() if q.name not in owned), *owned.values(), *extra]
    problem = compile_problem(
        every,
        cases,
        free=free,
        constraints=constraints(cases, known) if constraints else (),
        objective=objective(cases, known) if objective else None,
    )
    return Posed(model, functions, given, problem)


def equals(name: str, expression: ca.MX, target: Any, unit: str = "1", scale: float = 1.0) -> Constraint:
    """Return the constraint expression = target."""
    return Constraint(name, expression - target, 0.0, 0.0, unit, scale)
