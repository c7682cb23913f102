"""What a solution must be beside one of the equations, where problems are posed freely: as `softnlp.forward` asks.

Equations have solutions that no robot has: under pressures and loads out of every range, on another branch of the
stretch than that from zero pressure, past a stiffness that lost its sign, on a grid too coarse for the curl.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.ranges import FORCE, GRAVITY, MOMENT, PRESSURE, Range
from softnlp.base.status import Status
from softnlp.model.quantities import quantities
from softnlp.nlp.problem import CompiledProblem
from softnlp.nlp.solver import Solution, certificate, discretisation_correction
from softnlp.statics.branch import stretch_on_branch
from softnlp.statics.case import rods
from softnlp.statics.chain import Chain
from softnlp.statics.condensed import linear_solver
from softnlp.statics.loadcase import LoadCase
from softnlp.statics.posed import Problem

Array = NDArray[np.float64]

LIMITS: Mapping[str, Range] = {"pressure": PRESSURE, "tip_force": FORCE, "tip_moment": MOMENT, "gravity": GRAVITY}
"""The ranges of what acts on a robot, by key; directions do not matter."""

_ROUNDING = 1e-6  # in the unit of files: by how much an engine may leave a bound
_COUNTS = 1e-6  # of what a constraint is about
_SAME_STRETCH = 1e-3  # two roots are further apart, but next to where the branch ends, where they are one


def require_in_range(problem: Problem, x: Array, p: Array) -> None:
    """Raise `InputError` for pressures or loads of a case, at x and p, that no robot has or that are no numbers."""
    for _, key, refusal in _outside(problem, x, p):
        raise InputError(refusal, key=key)


def off_branch(problem: Problem, solution: Solution) -> tuple[Status, str] | None:
    """Return why no robot is at the pressures, loads and stretches of a solution: a status and a message, or None."""
    x, p = solution.x, solution.p
    for name, key, refusal in _outside(problem, x, p):
        return Status.DIVERGED, f"{name}no solution was found: {key}: {refusal}"
    start = problem.compiled.free_size
    for k, case in enumerate(problem.cases):
        size = sum(symbol.numel() for symbol in case.symbols)
        found = _case_off_branch(case, problem._own_values(k, x, p), x[start : start + size])
        if found is not None:
            return found[0], _prefix(problem, k) + found[1]
        start += size
    return None


def grid_error(problem: Problem, solution: Solution, entries: NDArray[np.intp]) -> float:
    """Return the largest estimated discretisation error of positions [L_0] and directions [1], inf where it has none.

    entries : where x has them.
    """
    compiled = problem.compiled
    linear = problem._kept("linear", lambda: linear_solver(compiled)) if compiled.is_square else None
    try:
        error = np.abs(discretisation_correction(compiled, solution, linear)[entries]).max(initial=0.0)
    except np.linalg.LinAlgError:
        return float("inf")
    return float(error) if np.isfinite(error) else float("inf")


def hidden(compiled: CompiledProblem, solution: Solution, start: Array) -> str:
    """Return which constraint is off by what counts in its own unit, though not over its scale; "" where none is.

    What counts is a millionth of its bounds, and of how much it changes with an unknown, there or at the start x.
    """
    count = len(compiled.constraints)
    if not count:
        return ""
    slopes = [np.abs(np.asarray(compiled.jacobian(at, solution.p))).max(axis=1) for at in (solution.x, start)]
    lines = zip(
        compiled.constraints, certificate(compiled, solution)[-count:], compiled.equations[-count:], strict=True
    )
    for constraint, line, equation in lines:
        scale = line.value / line.scaled if line.scaled else 0.0
        bounds = np.abs(np.append(np.ravel(constraint.lower), np.ravel(constraint.upper)))
        typical = float(
            np.fmax.reduce([*bounds[np.isfinite(bounds)], *(scale * s[equation.rows].max() for s in slopes)])
        )
        if line.value > _COUNTS * typical:
            return (
                f"constraint '{constraint.name}' is off by {line.value:.3g} {line.unit}, which its scale of "
                f"{scale:.3g} {line.unit} hides; take one of about {typical:.1g}"
            )
    return ""


def _case_off_branch(case: LoadCase | Chain, values: Mapping[str, Array], x: Array) -> tuple[Status, str] | None:
    """Return where a rod of a case, with its unknowns x, is not on the branch of the stretch from zero pressure."""
    every = list(rods(case, values))
    for k, (equations, own, at) in enumerate(every):
        column = np.concatenate([own[key] for key in quantities(equations.functions.model)])
        branch = stretch_on_branch(equations.branch, column, own["pressure"])
        segment = f"segment {k + 1}: " if len(every) > 1 else ""
        if branch.status is not Status.SOLVED:
            return branch.status, segment + branch.message
        if not abs(x[at] - branch.stretch) <= _SAME_STRETCH * branch.stretch:
            return Status.DIVERGED, (
                f"{segment}no solution was found on the branch from zero pressure, where the stretch is "
                f"{branch.stretch:.4g}, but one of stretch {x[at]:.4g}; start nearer, or follow a path from a solution"
            )
    return None


def _outside(problem: Problem, x: Array, p: Array) -> Iterator[tuple[str, str, str]]:
    """Yield whose, which and why for pressures and loads that are outside their ranges at x and p."""
    for k in range(len(problem.cases)):
        values: Mapping[str, Any] = problem._own_values(k, x, p)
        for key, limits in LIMITS.items():
            numbers = values[key] if key == "pressure" else np.abs(values[key])
            for number in np.ravel(numbers) / limits.scale:
                if not limits.low - _ROUNDING <= number <= limits.high + _ROUNDING:
                    yield _prefix(problem, k), key, limits.refusal(float(number))


def _prefix(problem: Problem, k: int) -> str:
    return f"{problem.cases[k].name}: " if len(problem.cases) > 1 else ""
