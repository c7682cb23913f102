"""A law's stress at many stretches, and the constants that bring it nearest to measured ones.

Constants that the stress is linear in are eliminated (variable projection), so a law that is linear in all of them is
one linear least-squares problem, and for another, such as Ogden's, only its other constants are searched, from many
starts, with exact derivatives.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations_with_replacement, product
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.quantity import quantity
from softnlp.model.laws import LAWS, Law
from softnlp.nlp.problem import compile_problem
from softnlp.nlp.solver import FROM_SOLUTION, Engine, Ipopt

Array = NDArray[np.float64]

_EXPONENTS = (-20.0, -12.0, -8.0, -5.0, -3.0, -2.0, -1.0, -0.4, 0.4, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0)
_EQUAL = 1e-2  # relative; exponents that differ by less are one
_LARGEST_EXPONENT, _AT_BOUND = 40.0, 1 - 1e-6
_FACTORS = (1.0, 0.2, 5.0, -1.0, 0.04, 25.0)  # of a start for a person's law
_MOST_GRID, _STARTS_A_SIGN = 1296, 3
_EXACT = 1e-26  # half the mean square of a misfit that is round-off, relative to the largest stress
_RANK = 1e-13  # relative size below which a direction of the linear constants is noise


class LawCurve:
    """A law's stress and its derivative by the constants at many stretches, and which constants it is linear in."""

    def __init__(self, law: Law) -> None:
        self.law = law
        self.units = np.array([c.scale for c in law.constants])
        n = len(law.constants)
        stretch, c = ca.SX.sym("stretch"), ca.SX.sym("c", n)
        scaled = [c[k] * self.units[k] for k in range(n)]
        stress = law.functions.engineering_stress(stretch, *scaled)
        self._function = ca.Function("curve", [stretch, c], [stress, ca.jacobian(stress, c)])
        curved = np.asarray(ca.DM(ca.hessian(stress, c)[0].sparsity(), 1)) != 0
        self.linear = np.zeros(n, bool)
        for k in np.argsort(np.sum(curved, axis=0), kind="stable"):
            self.linear[k] = not np.any(curved[k, self.linear]) and not curved[k, k]
        if n == 0:
            raise InputError(f"law {law.name!r} has no constant to fit", key="laws")

        self.reach = np.where(self.linear, np.inf, _LARGEST_EXPONENT) if law is LAWS["ogden"] else np.full(n, np.inf)

    def symbolic(self, stretch: Array, c: ca.MX) -> ca.MX:
        """Return the stress (points, 1) of constants that are expressions, in file units."""
        return self._function(ca.DM(stretch).T, c)[0].T

    def at_bound(self, c: Array) -> list[bool]:
        """Return whether each constant, in file units, is at a bound of the search."""
        return [bool(v) for v in np.abs(c) > _AT_BOUND * self.reach]

    def evaluate(self, stretch: Array, c: Array) -> tuple[Array, Array]:
        """Return stress (points,) and its derivative (points, n) by the constants in file units."""
        stress, slopes = self._function(stretch[None, :], c)
        return np.asarray(stress).ravel(), np.asarray(slopes).reshape(stretch.size, -1)

    def stress(self, stretch: Array, constants: Array) -> Array:
        """Return the stress for constants in SI."""
        flat, _ = self.evaluate(np.ravel(stretch), constants / self.units)
        return flat.reshape(stretch.shape)

    def project(self, stretch: Array, y: Array, c: Array) -> tuple[Array, Array, Array]:
        """Return the constants with the linear ones at their best, residuals, and their derivative by the others."""
        if not np.any(self.linear):
            stress, slopes = self.evaluate(stretch, c)
            return c, stress - y, slopes
        at_zero = np.where(self.linear, 0.0, c)
        offset, slopes = self.evaluate(stretch, at_zero)
        basis = slopes[:, self.linear]
        lengths = np.linalg.norm(basis, axis=0)
        lengths = np.where((lengths > 0) & np.isfinite(lengths), lengths, 1.0)
        if not np.all(np.isfinite(basis)):
            return c, np.full(stretch.size, np.nan), np.full((stretch.size, int(np.sum(~self.linear))), np.nan)
        U, s, Vt = np.linalg.svd(basis / lengths, full_matrices=False)
        kept = s > _RANK * s[0]
        U, s, Vt = U[:, kept], s[kept], Vt[kept]
        found = at_zero.copy()
        found[self.linear] = (Vt.T @ ((U.T @ (y - offset)) / s)) / lengths
        stress, slopes = self.evaluate(stretch, found)
        others = slopes[:, ~self.linear]
        return found, stress - y, others - U @ (U.T @ others)


def one_term(curve: LawCurve, stretch: Array, y: Array, c: Array) -> Array | None:
    """Return constants of Ogden's law with one term, None where its two exponents differ.

    Two terms of equal exponents are one: only the sum of their moduli is determined, and each grows without limit.
    y : the stress (points,), in the unit that c gives.
    """
    if curve.law is not LAWS["ogden"] or any(curve.at_bound(c)) or abs(c[1] - c[3]) > _EQUAL * max(1.0, abs(c[1])):
        return None
    from scipy.optimize import minimize_scalar

    def fitted(b: float) -> tuple[float, Array]:
        shape = curve.evaluate(stretch, np.array([1.0, b, 0.0, b]))[0]
        modulus = float(shape @ y / (shape @ shape))
        return float(np.sum((modulus * shape - y) ** 2)), np.array([modulus, b, 0.0, b])

    middle = float(c[1])
    limits = middle - 2, middle + 2
    done = minimize_scalar(lambda b: fitted(b)[0], bounds=limits, options={"xatol": 1e-10}, method="bounded")
    return fitted(float(done.x))[1]


def first_guesses(curve: LawCurve, start: Mapping[str, float] | None) -> list[Array]:
    """Return first guesses, in file units; what is linear is left at 0 or at the start given."""
    names = [c.name for c in curve.law.constants]
    given = {} if start is None else {k: v for k, v in start.items() if k in names}
    first = np.array([given.get(k, 0.0) for k in names]) / curve.units
    others = np.flatnonzero(~curve.linear)
    if others.size == 0:
        return [first]
    if curve.law is LAWS["ogden"]:
        grids: Iterable[Sequence[float]] = combinations_with_replacement(_EXPONENTS, others.size)
    else:
        middle = [first[k] or 1.0 for k in others]
        scaled = [[v * f for f in _FACTORS] for v in middle]
        grids = (g for g, _ in zip(product(*scaled), range(_MOST_GRID), strict=False))
    found = [first] if given else []
    for grid in grids:
        c = first.copy()
        c[others] = grid
        found.append(c)
    return found


def nearest_constants(curve: LawCurve, x: Array, y: Array, size: float, starts: list[Array]) -> Array:
    """Return the constants (file units) with the least sum of squares that any of the best starts leads to."""
    from scipy.optimize import least_squares

    others = np.flatnonzero(~curve.linear)
    if others.size == 0:
        return curve.project(x, y * size, starts[0])[0]

    def projected(values: Array, c: Array) -> tuple[Array, Array, Array]:
        trial = c.copy()
        trial[others] = values
        with np.errstate(all="ignore"):
            found, r, J = curve.project(x, y * size, trial)
        return found, r / size, J / size

    sums = []
    for c in starts:
        r = projected(c[others], c)[1]
        value = float(r @ r)
        sums.append(value if np.isfinite(value) else np.inf)
    order = _promising(sums, [c[others] for c in starts])
    if not order:
        raise InputError(f"law {curve.law.name!r} gives no finite stress at any start; give others", key="start")
    reach = curve.reach[others]
    best, least = starts[order[0]], np.inf
    for k in order:
        c = starts[k]
        done = least_squares(
            lambda v, c=c: projected(v, c)[1],
            np.clip(c[others], -reach, reach),
            jac=lambda v, c=c: projected(v, c)[2],
            bounds=(-reach, reach),
            x_scale="jac",
            ftol=1e-15,
            xtol=1e-15,
            gtol=1e-15,
            max_nfev=300,
        )
        if done.cost < least:
            best, least = projected(done.x, c)[0], float(done.cost)
        if least < _EXACT * x.size:
            break
    return best


def confirmed_constants(
    curve: LawCurve, x: Array, y: Array, size: float, c: Array, options: Mapping[str, Any]
) -> tuple[Ipopt | None, float]:
    """Return IPOPT's word on constants (file units), from which it starts, and the sum of squares that it ends at.

    options : of IPOPT, which have the last word.
    """
    free = [
        quantity(constant.name, "1", value, scale=abs(value) or 1.0, lower=-reach, upper=reach)
        for constant, value, reach in zip(curve.law.constants, c, curve.reach, strict=True)
    ]
    misfit = (curve.symbolic(x, ca.vertcat(*(q.symbol for q in free))) - y) / size
    problem = compile_problem(free, [], free=[q.name for q in free], objective=ca.sumsqr(misfit) / (2 * x.size))
    found = Engine(problem, options={**FROM_SOLUTION, **options}).solve(problem.pack({}), problem.pack_free({}))
    there, _ = curve.evaluate(x, np.concatenate([*problem.free_values(found.x).values()]))
    return found.ipopt, float(np.sum((there - y) ** 2))


def _promising(sums: Sequence[float], starts: Sequence[Array]) -> list[int]:
    """Return the best few starts of each combination of signs: constants seldom change their sign on the way."""
    taken: dict[bytes, int] = {}
    chosen = []
    for k in np.argsort(sums, kind="stable"):
        signs = np.sign(starts[k]).tobytes()
        if np.isfinite(sums[k]) and taken.get(signs, 0) < _STARTS_A_SIGN:
            taken[signs] = taken.get(signs, 0) + 1
            chosen.append(int(k))
    return chosen
