"""Following a solution along a path of fixed values: by steps of the path, and around its folds by arc length."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.nlp.linear import LinearSolver
from softnlp.nlp.problem import CompiledProblem
from softnlp.nlp.solver import Engine, Solution

Array = NDArray[np.float64]
Path = Callable[[float], Array]

_CORRECTIONS = 8
_CALM = 3  # steps after a refused one before they grow again
_ROUNDED = 1 + 1e-9  # a step is the difference of two fractions
_CONTRACTION = 0.1  # of a correction by the next ones, below which Newton's method is on the branch it began at


@dataclass(frozen=True, eq=False)
class Followed:
    """How far a path was followed: the last solution, the fraction 0..1 it belongs to, and all iterations spent."""

    solution: Solution
    fraction: float
    iterations: int

    @property
    def arrived(self) -> bool:
        """Whether the end of the path was reached."""
        return self.fraction >= 1.0


def follow(
    engine: Engine,
    path: Path,
    start: Array,
    *,
    distance: Callable[[Array], float],
    first_step: float = 0.125,
    smallest_step: float = 1 / 1024,
    largest_jump: float = 0.6,
    most_solves: int = 400,
    most_iterations: int | None = None,
    most_steps: int | None = None,
    same_branch: Callable[[float, Solution], bool] | None = None,
    predict: Callable[[Array, Array], Array] | None = None,
    strayed: Callable[[Array, Array], float] | None = None,
) -> Followed:
    """Follow a solution along p = path(t) from t = 0, where `start` is a solution or close to one, to t = 1.

    The step is cut when a solve fails or lands further than `largest_jump` (scaled) from its prediction, which is
    how another branch shows, and grows again after success. The predictor is the secant, or predict(x, p) of a solution
    x and the values p of the next one. strayed(predicted change, change) refuses a step above 1 unless Newton's method
    contracted from a prediction; with it what the predictor missed in the last step is added to the next.
    `distance` measures a change of x. A solve counts when it meets ten times the engine's own tolerance, so an engine
    for a path may be a loose one. `most_iterations` bounds what is spent, `most_steps` one solve.
    `same_branch(t, solution)` may refuse a solution that the distance does not tell from the branch.
    """
    tolerance = 10 * engine.tolerance
    left: dict[str, int] = {} if most_steps is None else {"most_steps": most_steps}
    if most_iterations is not None and most_steps is None:
        left["most_steps"] = max(most_iterations, 1)
    current = engine.solve(path(0.0), start, **left)
    iterations = current.iterations
    if not current.holds(tolerance):
        return Followed(current, 0.0, iterations)
    done, step = 0.0, first_step
    previous: tuple[float, Array] | None = None
    missed: tuple[float, Array] | None = None
    calm = 0
    for _ in range(most_solves):
        if most_iterations is not None and iterations >= most_iterations:
            break
        if most_iterations is not None and most_steps is None:
            left["most_steps"] = most_iterations - iterations
        target = min(1.0, done + step)
        step, p, guess = target - done, path(target), current.x
        predicted = predict is not None or previous is not None
        base, scale = guess, step
        if predict is not None:
            base, scale = predict(current.x, p), step**2
        elif previous is not None:
            before = done - previous[0]
            base, scale = guess + (guess - previous[1]) * (step / before), step * (step + before)
        guess = base if missed is None else base + missed[1] * (scale / missed[0])
        corrected = guess
        if predict is not None:
            corrected = predict(guess, p)
            iterations += 1
        nearby = distance(corrected - guess) <= 2 * largest_jump  # else Newton leads elsewhere, if anywhere
        trial = engine.solve(p, corrected, **(left if nearby else {"most_steps": 0}))
        iterations += max(trial.iterations, 1)
        found = trial.holds(tolerance) and distance(trial.x - guess) <= largest_jump
        change = 1.6 if trial.iterations <= 4 else 1.0
        if found and predicted and strayed is not None:
            off = strayed(guess - current.x, trial.x - current.x)
            if predict is not None:
                off = min(off, distance(trial.x - corrected) / max(_CONTRACTION * distance(trial.x - guess), 1e-300))
            found, change = off <= 1.0, float(np.clip(np.cbrt(0.5 / max(off, 1e-3)), 0.1, 2.0))
        if found and (same_branch is None or same_branch(target, trial)):
            if predicted and strayed is not None:
                missed = scale, trial.x - base
            previous, current, done = (done, current.x), trial, target
            if done >= 1.0:
                break
            step *= change if not calm else min(change, 1.0)
            calm = max(calm - 1, 0)
        else:
            calm = _CALM
            if step <= smallest_step * _ROUNDED:
                break
            step = max(step * min(change, 0.5), smallest_step)
    return Followed(current, done, iterations)


def straight_path(problem: CompiledProblem, start: Mapping[str, Any], end: Mapping[str, Any]) -> Path:
    """Return p(t) along the straight line between two sets of values of the fixed quantities."""
    a, b = problem.pack(start), problem.pack(end)
    return lambda t: b if t >= 1.0 else a + t * (b - a)


@dataclass(frozen=True, eq=False)
class _Tangent:
    """A unit direction of the curve (x, t) in the metric that `weight` gives to x."""

    x: Array
    t: float


def around_folds(
    engine: Engine,
    linear: LinearSolver,
    path: Path,
    start: Solution,
    fraction: float,
    *,
    weight: Array,
    first_step: float = 0.02,
    largest_step: float = 0.3,
    smallest_step: float = 1e-5,
    most_solves: int = 1500,
    target: float = 1.0,
) -> Iterator[tuple[Array | None, int]]:
    """Follow the curve of solutions (x, t) by arc length from t = `fraction`; yield x near every passage of a target.

    Where a load path turns back, its curve goes on through unstable equilibria and often turns forward again: the robot
    snaps through. weight : per entry of x, for the arc length. Yields also the linear solves spent since the last
    passage; those after the last one come with None. It ends after `most_solves` in all.
    """
    x, t, step, spent, told = start.x, fraction, first_step, 0, 0
    tangent: _Tangent | None = None
    while spent <= most_solves and -1.0 <= t <= 2.0:
        try:
            heading = _tangent(engine.problem, linear, path, x, t, weight, tangent)
        except np.linalg.LinAlgError:
            break
        spent += 1
        while step >= smallest_step:
            corrected, steps_taken = _corrected(engine, linear, path, x, t, heading, step, weight)
            spent += 2 * steps_taken
            if corrected is not None:
                break
            step /= 2
        else:
            break
        x_new, t_new = corrected
        if (t - target) * (t_new - target) <= 0.0 and t_new != t:
            yield x + (x_new - x) * (target - t) / (t_new - t), spent - told
            told = spent
        x, t, tangent = x_new, t_new, heading
        step = min(largest_step, step * (1.5 if steps_taken <= 3 else 1.0))
    yield None, spent - told


def _slope(problem: CompiledProblem, path: Path, x: Array, t: float) -> Array:
    """Return dg/dt along the path by central differences; Newton needs it to a few digits only."""
    h = 1e-6
    ahead, behind = (np.asarray(problem.residual(x, path_value(path, t + s))).ravel() for s in (h, -h))
    with np.errstate(over="ignore", invalid="ignore"):  # of absurd loads: the step from there fails, and is named
        return (ahead - behind) / (2 * h)


def path_value(path: Path, t: float) -> Array:
    """Return the straight path beyond its ends as well."""
    a, b = path(0.0), path(1.0)
    return a + t * (b - a)


def _tangent(
    problem: CompiledProblem,
    linear: LinearSolver,
    path: Path,
    x: Array,
    t: float,
    weight: Array,
    before: _Tangent | None,
) -> _Tangent:
    """Return the direction of the curve at a solution, onwards from `before` (or towards larger t)."""
    slope = linear.solve(x, path_value(path, t), _slope(problem, path, x, t))
    size = float(np.sqrt(np.sum(weight * slope**2) + 1.0))
    tangent = _Tangent(slope / size, 1.0 / size)
    if before is not None and np.sum(weight * tangent.x * before.x) + tangent.t * before.t < 0:
        return _Tangent(-tangent.x, -tangent.t)
    return tangent


def _corrected(
    engine: Engine,
    linear: LinearSolver,
    path: Path,
    x_start: Array,
    t_start: float,
    heading: _Tangent,
    step: float,
    weight: Array,
) -> tuple[tuple[Array, float] | None, int]:
    """Return the point of the curve on the plane a step ahead, normal to the heading, or None; and the iterations."""
    problem = engine.problem
    x, t = x_start + step * heading.x, t_start + step * heading.t
    for k in range(_CORRECTIONS):
        p = path_value(path, t)
        g = np.asarray(problem.residual(x, p)).ravel()
        size = float(np.max(np.abs(g)))
        if not size < 1e4:
            return None, k
        off = float(np.sum(weight * heading.x * (x - x_start)) + heading.t * (t - t_start) - step)
        if size <= engine.tolerance and abs(off) <= 1e-6:
            return (x, t), k
        try:
            a, b = linear.solve(x, p, g), linear.solve(x, p, _slope(problem, path, x, t))
        except np.linalg.LinAlgError:
            return None, k
        along = float(np.sum(weight * heading.x * b) + heading.t)
        d_t = -(off + float(np.sum(weight * heading.x * a))) / along if along else np.inf
        if not np.isfinite(d_t):
            return None, k
        x, t = x + a + b * d_t, t + d_t
    return None, _CORRECTIONS
