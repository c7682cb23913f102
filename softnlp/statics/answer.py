"""Answers to a problem of your own: solved at given values, or followed along a path, and judged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import IllPosedError, InputError, nearest
from softnlp.base.status import Status
from softnlp.nlp.optimality import not_optimal
from softnlp.nlp.reduced import Reduced, held_states
from softnlp.nlp.solver import FROM_SOLUTION, EquationResidual, Solution, certificate, outputs
from softnlp.statics.case import pose_entries
from softnlp.statics.chain import Chain
from softnlp.statics.condensed import linear_solver
from softnlp.statics.guards import grid_error, hidden, off_branch, require_in_range
from softnlp.statics.pose_grid import HOPELESS
from softnlp.statics.posed import BOUNDS, Problem, followed

Array = NDArray[np.float64]
EngineName = Literal["auto", "ipopt", "newton"]

_CLOSE = 1e-6  # of a scaled unknown: how far IPOPT may move what Newton's method found


@dataclass(frozen=True, eq=False)
class Answer:
    """A point of a problem and what is known of it.

    Attributes
    ----------
    problem
        As solved.
    status, message
        "solved" where every equation, constraint and bound holds, evaluated again, and, where something is minimised,
        the first-order conditions do. What no robot can be is named as `softnlp.forward` names it: "no_equilibrium",
        "unstable_material", "inaccurate" for a grid that does not show the rod.
    values
        (entries,) every quantity by name, free or fixed [SI].
    outputs
        (entries,) of the cases by name, world frame; "<case>_<output>" where there are several cases. Empty without a
        solution [SI].
    residuals
        The largest error of each equation.
    multipliers
        (rows,) by name of the equations and constraints, and "bounds" of what is free, all of scaled rows; empty where
        nothing is minimised by an engine that has them [1].
    solution
        x, p and the engine's word.
    discretisation_error
        Estimated, of positions [L_0] and directions [1]: the grid is given, and not refined. None without a solution.
    """

    problem: Problem
    status: Status
    message: str
    values: Mapping[str, Array]
    outputs: Mapping[str, Array]
    residuals: tuple[EquationResidual, ...]
    multipliers: Mapping[str, Array]
    solution: Solution
    discretisation_error: float | None = None

    def __getitem__(self, name: str) -> Array:
        """Return a quantity or an output by name [SI] (entries,). Raises `KeyError` that names what is near."""
        for among in (self.values, self.outputs):
            if name in among:
                return among[name]
        raise KeyError(f"no quantity or output is named '{name}'{nearest(name, [*self.values, *self.outputs])}")

    def states(self, case: str, segment: int = 1) -> Array:
        """Return the states of a case, or of a segment of it, as they are in x.

        Parameters
        ----------
        case
            Its name.
        segment
            From 1, where there are several.

        Returns
        -------
        ndarray
            (n, states) p, R column by column, N, M, in lengths L_0, forces EI/L_0^2 and moments EI/L_0, EI at the base;
            of a section that varies the stretch and s of each part too, and its knots twice [1].
        """
        found = next((c for c in self.problem.cases if c.name == case), None)
        if found is None:
            raise KeyError(f"no case is named '{case}'{nearest(case, [c.name for c in self.problem.cases])}")
        chained = found.transcribed if isinstance(found, Chain) else (found.transcribed,)
        segment_of = [part.segment for part in found.parts] if isinstance(found, Chain) else [0]
        places = [self.problem.variables[f"{case}: {label}"] for label in found.labels if label.endswith("states")]
        parts = [
            self.solution.x[where].reshape(-1, transcribed.state_size).T
            for where, transcribed, k in zip(places, chained, segment_of, strict=True)
            if k == segment - 1
        ]
        return np.hstack(parts)


def solve(
    problem: Problem,
    values: Mapping[str, Any] | None = None,
    start: Mapping[str, Any] | Answer | None = None,
    *,
    engine: EngineName = "auto",
    tolerance: float = 1e-8,
    ipopt: Mapping[str, Any] | None = None,
) -> Answer:
    """Solve a problem at values of its fixed quantities.

    Parameters
    ----------
    problem
        Of `softnlp.problem`.
    values
        By name; what is not named keeps its nominal value [SI].
    start
        First guess of the free quantities by name, nominal where not named: each case is solved by itself there. Or an
        answer, which is near.
    engine
        "newton": Newton's method, inside a search of the free quantities where there is a choice; "ipopt": IPOPT on the
        whole program; "auto": Newton's method, from where IPOPT closes, or IPOPT alone where there is a choice.
    tolerance
        Of the scaled residuals, evaluated again [1].
    ipopt
        Its options.

    Returns
    -------
    Answer
        Never a plausible number: without a solution the status says so and `outputs` is empty.

    Raises
    ------
    IllPosedError
        For names that are not quantities of the problem, and values of another size or that are not finite.
    InputError
        For another engine, and pressures or loads outside the ranges of `softnlp.forward`.
    """
    if engine not in get_args(EngineName):
        raise InputError(f"expected one of {', '.join(get_args(EngineName))}, got {engine!r}", key="engine")
    values = _numbers(values or {})
    compiled = problem.compiled
    p = compiled.pack(values)
    if isinstance(start, Answer):
        if start.problem is not problem:
            raise IllPosedError("expected an answer of the same problem to start from")
        x = start.solution.x
    else:
        x = problem._start(values, _numbers(start or {}))
    require_in_range(problem, x, p)
    square, options = compiled.is_square, dict(ipopt or {})
    if engine == "newton" and not square:

        def made() -> Reduced:
            return Reduced(compiled, held_states(compiled, linear_solver), problem.residuals)

        reduced = problem._kept("reduced", made)
        return _judged(problem, reduced.minimise(p, x), x, tolerance)
    if engine == "newton":
        return _judged(problem, problem._engine(newton_only=True).solve(p, x), x, tolerance)
    if engine == "ipopt" or not square:
        return _judged(problem, problem._engine(ipopt_only=True, options=options).solve(p, x), x, tolerance)
    proposed = problem._engine(options=options).solve(p, x)
    answer = _judged(problem, proposed, x, tolerance)
    if answer.status is not Status.SOLVED:
        return answer
    found = problem._engine(ipopt_only=True, options={**FROM_SOLUTION, **options}).closed(proposed)
    answer = _judged(problem, found, x, tolerance)
    away = float(np.max(np.abs(found.x - proposed.x)))
    if away <= _CLOSE and answer.status is Status.SOLVED:
        return answer
    message = f"{Status.DISPUTED.advice}; the largest change of a scaled unknown is {away:.2g}"
    return replace(answer, status=Status.DISPUTED, message=message, outputs={})


def follow(
    problem: Problem, start: Answer, values: Mapping[str, Any], *, steps: int = 1, tolerance: float = 1e-8
) -> tuple[Answer, ...]:
    """Follow an answer of a square problem along a straight path to other values of its fixed quantities.

    Each of the steps is subdivided where Newton's method asks for it, so that the branch is kept.

    Parameters
    ----------
    problem
        Of `softnlp.problem`.
    start
        A solution, where the path begins.
    values
        By name, at its end; what is not named stays [SI].
    steps
        How many answers are wanted, equally spaced.
    tolerance
        As `softnlp.solve`.

    Returns
    -------
    tuple
        Answers (steps + 1,) with the start; fewer where the path ends before, the last one then with the status "fold",
        or that of a point which no robot can be, and without outputs.

    Raises
    ------
    IllPosedError
        For a problem that is not square, a start without a solution, and as `solve`.
    """
    if not problem.compiled.is_square or start.status is not Status.SOLVED or start.problem is not problem:
        raise IllPosedError("a path begins at a solution of this problem, which has as many equations as unknowns")
    if steps < 1:
        raise InputError(f"expected at least one step, got {steps}", key="steps")
    compiled, values = problem.compiled, _numbers(values)
    fixed = {q.name: start.values[q.name] for q in compiled.fixed}
    compiled.pack(values)  # for its errors
    begin, end = compiled.pack(fixed), compiled.pack({**fixed, **values})
    require_in_range(problem, start.solution.x, end)
    entries = _pose_entries(problem)
    answers = [start]
    for k in range(steps):
        a, b = (begin + (end - begin) * j / steps for j in (k, k + 1))
        found = followed(
            problem._engine(newton_only=True),
            lambda t, a=a, b=b: b if t >= 1.0 else a + t * (b - a),  # type: ignore[misc]
            answers[-1].solution.x,
            entries,
        )
        answer = _judged(problem, found.solution, answers[-1].solution.x, tolerance)
        if not found.arrived:
            message = f"{Status.FOLD.advice}; it was followed for {100 * (k + found.fraction) / steps:.3g} % of the way"
            answers.append(replace(answer, status=Status.FOLD, message=message, outputs={}))
            break
        answers.append(answer)
        if answer.status is not Status.SOLVED:
            break
    return tuple(answers)


def _numbers(values: Mapping[str, Any]) -> dict[str, Array]:
    """Return values by name as finite numbers, or raise `IllPosedError`."""
    found = {}
    for name, value in values.items():
        try:
            found[name] = np.asarray(value, float)
        except (TypeError, ValueError):
            found[name] = np.array(np.nan)
        if not np.all(np.isfinite(found[name])):
            raise IllPosedError(f"'{name}' takes finite numbers, got {value!r}")
    return found


def _pose_entries(problem: Problem) -> NDArray[np.intp]:
    start, found = problem.compiled.free_size, []
    for case in problem.cases:
        found.append(start + pose_entries(case))
        start += sum(symbol.numel() for symbol in case.symbols)
    return np.concatenate(found)


def _judged(problem: Problem, solution: Solution, start: Array, tolerance: float) -> Answer:
    """Return an answer by what its residual and first-order conditions say, evaluated again; start : x before it."""
    compiled = problem.compiled
    status, message = Status.SOLVED, Status.SOLVED.advice
    holds = solution.holds(tolerance)
    refusal = off_branch(problem, solution) if holds or not compiled.free else None
    error = grid_error(problem, solution, _pose_entries(problem)) if holds else None
    off = hidden(compiled, solution, start) if holds else ""
    if not holds and (refusal is None or refusal[0] is Status.DIVERGED):
        status = Status.DIVERGED
        message = f"no solution was found ({solution.engine_status}); start nearer, or follow a path from a solution"
    elif refusal is not None:
        status, message = refusal
    elif off:
        status, message = Status.DIVERGED, f"no solution was found: {off}"
    elif error is not None and error > HOPELESS:
        status = Status.INACCURATE
        message = f"the grid does not show the rod: its estimated error is {error:.2g} L_0; take more intervals"
    elif compiled.has_objective and not solution.optimal:
        status, message = Status.NOT_OPTIMAL, not_optimal(solution.kkt, solution.engine_status)
    multipliers: dict[str, Array] = {}
    if compiled.has_objective and solution.ipopt is not None and solution.ipopt.rows.size:
        multipliers = {e.name: solution.ipopt.rows[e.rows] for e in compiled.equations}
        multipliers[BOUNDS] = solution.ipopt.bounds[: compiled.free_size]
    return Answer(
        problem=problem,
        status=status,
        message=message,
        values=compiled.values(solution.x, solution.p),
        outputs=outputs(compiled, solution) if status is Status.SOLVED else {},
        residuals=certificate(compiled, solution),
        multipliers=multipliers,
        solution=solution,
        discretisation_error=error,
    )
