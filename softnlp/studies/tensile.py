"""Tensile tests: the constants of a stress-stretch law from measured stress and stretch, with their uncertainty.

The misfit is that of the engineering stress, every point counting alike. Constants that the stress is linear in are
eliminated (variable projection), so a law that is linear in all of them is one linear least-squares problem, and for
another, such as Ogden's, only its other constants are searched, from many starts, with exact derivatives.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations_with_replacement, product
from typing import Any

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from softnlp.errors import InputError, MaterialError, nearest
from softnlp.evaluation.statistics import Statistics, statistics
from softnlp.laws import LAWS, Law
from softnlp.materials import DENSITY, Material
from softnlp.studies.fit_statistics import uncertainty

Array = NDArray[np.float64]

_EXPONENTS = (-20.0, -12.0, -8.0, -5.0, -3.0, -2.0, -1.0, -0.4, 0.4, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0)
_LARGEST_EXPONENT = 40.0
_FACTORS = (1.0, 0.2, 5.0, -1.0, 0.04, 25.0)  # of a start for a person's law
_MOST_GRID, _STARTS_A_SIGN = 1296, 3
_EXACT = 1e-26  # half the mean square of a misfit that is round-off, relative to the largest stress
_RANK = 1e-13  # relative size below which a direction of the linear constants is noise
_STRETCHES = 401
_LOOK_AHEAD = 1.5  # beyond the largest measured stretch, times its extension, stability is looked for


@dataclass(frozen=True, eq=False)
class LawFit:
    """A law fitted to a tensile test.

    Attributes
    ----------
    law
        What was fitted.
    constants, standard_errors
        By name, in law order [SI]; an error is inf where the data leave the constant open.
    correlation
        (n, n) of the estimates, in law order [1].
    condition
        Of the scaled Jacobian [1].
    r_squared
        Of the engineering stress [1].
    misfit
        Of the engineering stress: rmse in Pa, mape in %.
    fitted_stretch
        (2,) range of the data with 1 [1].
    unstable_from
        First stretch at which the tangent modulus is not positive [1], None where there is none up to 1.5 times the
        measured extension.
    material
        Ready to use, None where the fitted law is no material.
    problem
        Why it is none.
    warnings
        What the data leave open.
    """

    law: Law
    constants: Mapping[str, float]
    standard_errors: Mapping[str, float]
    correlation: Array
    condition: float
    r_squared: float
    misfit: Statistics
    fitted_stretch: tuple[float, float]
    unstable_from: float | None
    material: Material | None
    problem: str
    warnings: tuple[str, ...]

    @property
    def spread(self) -> float:
        """The standard deviation of the stress about the fitted law, which counts the law's constants [Pa]."""
        freedom = self.misfit.count - len(self.constants)
        return float("inf") if freedom <= 0 else self.misfit.rmse * float(np.sqrt(self.misfit.count / freedom))

    def stress(self, stretch: Any) -> Array:
        """Return the engineering stress of the fitted law.

        Parameters
        ----------
        stretch
            A number or (points,) [1].

        Returns
        -------
        array
            (points,) [Pa].
        """
        return _Curve(self.law).stress(np.asarray(stretch, float), np.array(list(self.constants.values())))


@dataclass(frozen=True, eq=False)
class TensileFit:
    """Laws fitted to the same test.

    Attributes
    ----------
    stretch
        (points,) [1].
    stress
        (points,) engineering stress [Pa].
    fits
        By law, as asked.
    """

    stretch: Array
    stress: Array
    fits: Mapping[str, LawFit]

    @property
    def best(self) -> LawFit | None:
        """The material with the smallest spread, None where no law gave one."""
        usable = [fit for fit in self.fits.values() if fit.material is not None]
        return min(usable, key=lambda fit: fit.spread) if usable else None


def fit_tensile(
    stretch: Any,
    stress: Any,
    laws: Iterable[str | Law] | str | Law = tuple(LAWS),
    *,
    true_stress: bool = False,
    name: str = "fitted",
    density: float = DENSITY,
    start: Mapping[str, float] | None = None,
) -> TensileFit:
    """Fit laws to a tensile test.

    Parameters
    ----------
    stretch
        (points,) axial stretch [1]; repeats are simply more points.
    stress
        (points,) engineering stress [Pa].
    laws
        Names of built-in laws or laws of your own, one or several; all built-in ones by default.
    true_stress
        Whether `stress` is true stress, which is divided by the stretch.
    name, density
        Of the material that comes out [kg/m^3].
    start
        First guess of the constants of a law of your own [SI]; needed where the stress is not linear in them.

    Returns
    -------
    TensileFit
        A fit for each law.

    Raises
    ------
    InputError
        For data that are no tensile test, too few of them, or an unknown law.

    """
    x, y = _checked(stretch, stress)
    y = y / x if true_stress else y
    asked = (laws,) if isinstance(laws, str | Law) else tuple(laws)
    fits = {}
    for asked_law in asked:
        if isinstance(asked_law, str) and asked_law not in LAWS:
            raise InputError(f"unknown law {asked_law!r}{nearest(asked_law, LAWS)}", key="laws")
        law = LAWS[asked_law] if isinstance(asked_law, str) else asked_law
        fits[law.name] = _fit(law, x, y, name, density, start)
    return TensileFit(x, y, fits)


def tensile_misfit(material: Material, stretch: Array, stress: Array) -> Statistics:
    """Return how far a material is from engineering stresses [Pa]."""
    return statistics(np.asarray(material.engineering_stress(stretch)) - stress, stress)


def _checked(stretch: Any, stress: Any) -> tuple[Array, Array]:
    """Return stretch and stress as arrays, or raise `InputError`."""
    columns = []
    for key, value in (("stretch", stretch), ("stress", stress)):
        try:
            column = np.asarray(value, dtype=float)
        except (TypeError, ValueError):
            raise InputError("expected a list of numbers", key=key) from None
        if column.ndim != 1 or not np.all(np.isfinite(column)):
            raise InputError("expected a list of finite numbers", key=key)
        columns.append(column)
    x, y = columns
    if x.size != y.size:
        raise InputError(f"expected one stress a stretch, got {y.size} for {x.size}", key="stress")
    if x.size == 0 or np.any(x <= 0):
        raise InputError("expected stretches above 0", key="stretch")
    if not np.max(x) > 1 + 1e-6:
        raise InputError("expected a tensile test: at least one stretch above 1", key="stretch")
    if not np.any(y):
        raise InputError("expected a stress that is not 0 everywhere", key="stress")
    return x, y


class _Curve:
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


def _fit(law: Law, x: Array, y: Array, name: str, density: float, start: Mapping[str, float] | None) -> LawFit:
    """Fit one law."""
    curve = _Curve(law)
    names = [c.name for c in law.constants]
    if x.size < len(names):
        raise InputError(f"law {law.name!r} has {len(names)} constants; got {x.size} points", key="stretch")
    size = float(np.max(np.abs(y)))
    c = _minimise(curve, x, y / size, size, _starts(curve, start))
    stress, slopes = curve.evaluate(x, c)
    residuals = stress - y
    constants = dict(zip(names, (float(v) for v in c * curve.units), strict=True))
    known = uncertainty([k.file_key for k in law.constants], slopes, residuals)
    errors = dict(zip(names, (float(v) for v in known.standard_errors * curve.units), strict=True))
    total = float(np.sum((y - np.mean(y)) ** 2))
    fitted = (float(min(1.0, np.min(x))), float(np.max(x)))
    fit = LawFit(
        law=law,
        constants=constants,
        standard_errors=errors,
        correlation=known.correlation,
        condition=known.condition,
        r_squared=1 - float(residuals @ residuals) / total if total > 0 else float("nan"),
        misfit=statistics(residuals, y),
        fitted_stretch=fitted,
        unstable_from=None,
        material=None,
        problem="",
        warnings=known.warnings,
    )
    try:
        made = Material(name, law, constants, density, fitted)
    except MaterialError as error:
        return replace(fit, problem=error.message, warnings=(*fit.warnings, f"no material: {error.message}"))
    lost = _unstable_from(made)
    if lost is not None and lost <= fitted[1]:
        note = f"the tangent modulus is not positive from a stretch of {lost:.3f} on, within the fitted range"
        fit = replace(fit, warnings=(*fit.warnings, note))
    return replace(fit, material=made, unstable_from=lost)


def _unstable_from(material: Material) -> float | None:
    """Return the first stretch from the lowest fitted one at which E_t is not positive, looking a little beyond."""
    low, high = material.fitted_stretch
    stretch = np.linspace(low, 1 + _LOOK_AHEAD * (high - 1), _STRETCHES)
    with np.errstate(all="ignore"):
        bad = np.flatnonzero(~(np.asarray(material.tangent_modulus(stretch)) > 0))
    return float(stretch[bad[0]]) if bad.size else None


def _starts(curve: _Curve, start: Mapping[str, float] | None) -> list[Array]:
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


def _minimise(curve: _Curve, x: Array, y: Array, size: float, starts: list[Array]) -> Array:
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
    reach = _LARGEST_EXPONENT if curve.law is LAWS["ogden"] else np.inf
    best, least = starts[order[0]], np.inf
    for k in order:
        c = starts[k]
        done = least_squares(
            lambda v, c=c: projected(v, c)[1],
            c[others],
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
