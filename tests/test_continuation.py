"""Following curves of solutions: where it ends, and around folds, on curves that are known in closed form."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from softnlp.nlp.continuation import _corrected, _Tangent, around_folds, follow
from softnlp.nlp.solver import Solution

START, END = np.array([0.0]), np.array([1.0])
ONE = np.ones(1)


class Curve:
    """The solutions of c(x) = p, with c and its slope known: problem, engine and linear solver in one."""

    def __init__(self, c: Any, slope: Any) -> None:
        self.c, self.slope, self.tolerance = c, slope, 1e-12
        self.problem = SimpleNamespace(residual=lambda x, p: c(x) - p)

    def solve(self, *given: Any) -> Any:
        if len(given) == 3:  # as a linear solver, from x, p, g
            x, _, g = given
            if self.slope(x)[0] == 0:
                raise np.linalg.LinAlgError("singular")
            return -g / self.slope(x)
        p, x = given
        for k in range(20):
            if abs((self.c(x) - p)[0]) < 1e-13:
                return Solution(x, p, 0.0, k, "")
            x = x - (self.c(x) - p) / self.slope(x)
        return Solution(x, p, np.inf, 20, "")


def path(t: float) -> np.ndarray:
    return START + t * (END - START)


def rising() -> Curve:
    return Curve(lambda x: x + x**3, lambda x: 1 + 3 * x**2)


def folded() -> Curve:
    """Return p = x^3 / 3 - 2 x^2 + 3 x: it turns back at x = 1 (p = 4/3) and forward again at x = 3 (p = 0)."""
    return Curve(lambda x: x**3 / 3 - 2 * x**2 + 3 * x, lambda x: (x - 1) * (x - 3))


@pytest.mark.parametrize("most", [1, 3, 400])
def test_following_ends_after_so_many_solves_where_it_is(most: int) -> None:
    curve = rising()
    followed = follow(curve, path, np.zeros(1), distance=lambda dx: float(np.abs(dx).max()), most_solves=most)  # type: ignore[arg-type]
    assert followed.arrived == (most == 400)
    x = followed.solution.x
    assert curve.c(x) == pytest.approx(path(followed.fraction), abs=1e-10)
    assert 0.125 <= followed.fraction <= 1.0
    assert (followed.fraction == 0.125) == (most == 1)


def passages(curve: Curve, start: float, fraction: float, **more: Any) -> tuple[list[float], int]:
    """Return x at every passage of the end, and the linear solves spent."""
    solution = Solution(np.array([start]), path(fraction), 0.0, 0, "")
    found: Iterator[tuple[Any, int]] = around_folds(curve, curve, path, solution, fraction, weight=ONE, **more)  # type: ignore[arg-type]
    told = list(found)
    assert told[-1][0] is None
    assert all(x is not None for x, _ in told[:-1])
    return [float(x[0]) for x, _ in told[:-1]], sum(spent for _, spent in told)


def test_every_passage_of_the_end_is_met_around_both_folds() -> None:
    """The snap through: forward to the first fold, back to the second, and forward again."""
    exact = np.sort(np.roots([1 / 3, -2, 3, -1]).real)
    found, spent = passages(folded(), 0.0, 0.0, largest_step=0.1)
    assert found == pytest.approx(exact, abs=5e-3)
    assert found == sorted(found)
    assert spent < 1500


def test_what_may_be_spent_ends_the_way_around() -> None:
    found, spent = passages(folded(), 0.0, 0.0, largest_step=0.1, most_solves=60)
    assert len(found) < 3
    assert 60 < spent < 100


def test_a_curve_that_is_singular_where_it_begins_goes_nowhere() -> None:
    assert passages(folded(), 1.0, 4 / 3) == ([], 0)


def test_a_plane_that_the_curve_does_not_meet_has_no_point() -> None:
    """A path that stands still has one point; a plane beside it along x, with no way along t, has none of them."""
    curve = rising()
    x = np.array([0.4])
    still = curve.c(x)
    point, iterations = _corrected(curve, curve, lambda t: still, x, 0.0, _Tangent(ONE, 0.0), 0.1, ONE)  # type: ignore[arg-type]
    assert point is None
    assert iterations == 0
    met, _ = _corrected(curve, curve, lambda t: still + t, x, 0.0, _Tangent(ONE, 0.0), 0.1, ONE)  # type: ignore[arg-type]
    assert met is not None
    assert met[0] == pytest.approx([0.5])
    assert still + met[1] == pytest.approx(curve.c(met[0]))


@pytest.mark.parametrize(("first_step", "lost"), [(0.07, 0.25), (0.03, 0.5), (1 / 7, 0.5), (0.1, 0.3)])
def test_a_step_that_cannot_be_made_smaller_ends_the_path(first_step: float, lost: float) -> None:
    """Wherever it is lost: the smallest step, found again as a difference of fractions, may be longer by a rounding."""
    asked: list[float] = []

    class Lost:
        tolerance = 1e-7

        def solve(self, p: np.ndarray, x: np.ndarray) -> Solution:
            asked.append(float(p[0]))
            return Solution(p, p, 0.0 if p[0] <= lost else 1.0, 1, "")

    engine: Any = Lost()
    followed = follow(
        engine, path, np.zeros(1), distance=lambda change: float(np.abs(change).max()), first_step=first_step
    )
    assert lost - 2 / 1024 <= followed.fraction <= lost
    assert len(asked) <= 60
    assert asked[-1] != asked[-2]
