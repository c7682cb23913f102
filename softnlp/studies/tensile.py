"""Tensile tests: the constants of a stress-stretch law from measured stress and stretch, with their uncertainty.

The misfit is that of the engineering stress, every point counting alike; `softnlp.studies.law_curve` finds its least.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError, MaterialError, nearest
from softnlp.base.statistics import Statistics, statistics
from softnlp.base.status import Status
from softnlp.model.laws import LAWS, Law
from softnlp.model.materials import DENSITY, Material
from softnlp.model.numerics import Numerics
from softnlp.nlp.solver import Ipopt
from softnlp.studies.check import Check, messages
from softnlp.studies.fit_statistics import constant_note, determined, open_constants, repeats, uncertainty
from softnlp.studies.law_curve import LawCurve, confirmed_constants, first_guesses, nearest_constants, one_term
from softnlp.studies.plausibility import curve_checks, law_checks, true_checks

Array = NDArray[np.float64]

_STRETCH, _STRESS = (1e-4, 1e4), 1e15  # [1], [Pa]: what is beyond is no measurement
_SAME_SUM = 1e-9  # relative, and of the largest stress: sums of squares that differ by less are the same
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
        (2,) range of the data widened to 1, where the stress of every law is 0 by construction [1].
    unstable_from
        First stretch at which the tangent modulus is not positive [1], None where there is none up to 1.5 times the
        measured extension.
    at_bound
        Names of the constants at a bound.
    checks
        Of the fitted law.
    status
        "solved", "implausible" where a check of the law or of the data failed, "unstable_material" where it is none,
        "disputed" where IPOPT finds a smaller sum of squares.
    material
        Ready to use, None where the fitted law is not solved.
    problem
        Why there is none.
    warnings
        What the data leave open.
    engine
        Which engine found the constants, of `Numerics`.
    ipopt
        What IPOPT said of them, where it took part.
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
    at_bound: tuple[str, ...]
    checks: tuple[Check, ...]
    status: str
    material: Material | None
    problem: str
    warnings: tuple[str, ...]
    engine: str = "newton"
    ipopt: Ipopt | None = None

    @property
    def determined(self) -> dict[str, bool | None]:
        """By name: whether a constant's standard error is within its value, None where it has none."""
        return {name: determined(value, self.standard_errors[name]) for name, value in self.constants.items()}

    @property
    def notes(self) -> dict[str, str]:
        """By name: whether a constant is at its bound or not determined, else ""."""
        return {name: constant_note(known, name in self.at_bound) for name, known in self.determined.items()}

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
        return LawCurve(self.law).stress(np.asarray(stretch, float), np.array(list(self.constants.values())))


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
    checks
        Of the test.
    """

    stretch: Array
    stress: Array
    fits: Mapping[str, LawFit]
    checks: tuple[Check, ...]

    @property
    def problems(self) -> tuple[str, ...]:
        """What failed: of the test, or else of each law by its name."""
        of_laws = tuple(f"{fit.law.name}: {fit.problem}" for fit in self.fits.values() if fit.problem)
        return messages(self.checks, "failed") or of_laws

    @property
    def warnings(self) -> tuple[str, ...]:
        """What is unusual of the test, and what it leaves open of each law, by its name."""
        of_laws = (f"{fit.law.name}: {warning}" for fit in self.fits.values() for warning in fit.warnings)
        return (*messages(self.checks, "warned"), *of_laws)

    @property
    def best(self) -> LawFit | None:
        """The material with the smallest spread, of those whose constants are determined where there are any."""
        usable = [fit for fit in self.fits.values() if fit.material is not None]
        sure = [fit for fit in usable if False not in fit.determined.values()]
        return min(sure or usable, key=lambda fit: fit.spread, default=None)


def fit_tensile(
    stretch: Any,
    stress: Any,
    laws: Iterable[str | Law] | str | Law = tuple(LAWS),
    *,
    true_stress: bool = False,
    name: str = "fitted",
    density: float = DENSITY,
    start: Mapping[str, float] | None = None,
    numerics: Numerics = Numerics(),
    read: Sequence[Check] = (),
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
    numerics
        Its engine: but for "newton" IPOPT closes each fit from its constants.
    read
        Checks of how the test was read, which count as its own.

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
    read = (*read, *(true_checks(x, y) if true_stress else ()))
    y = y / x if true_stress else y
    asked = (laws,) if isinstance(laws, str | Law) else tuple(laws)
    fits, checks = {}, curve_checks(x, y, read)
    for asked_law in asked:
        if isinstance(asked_law, str) and asked_law not in LAWS:
            raise InputError(f"unknown law {asked_law!r}{nearest(asked_law, LAWS)}", key="laws")
        law = LAWS[asked_law] if isinstance(asked_law, str) else asked_law
        fits[law.name] = _fit(law, x, y, name, density, start, messages(checks, "failed"), numerics)
    return TensileFit(x, y, fits, checks)


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
    for key, column, low, high in (("stretch", x, *_STRETCH), ("stress", y, -_STRESS, _STRESS)):
        for value in column[(column < low) | (column > high)][:1]:
            raise InputError(f"expected {low:g} to {high:g}, got {value:g}", key=key)
    if not np.max(x) > 1 + 1e-6:
        raise InputError("expected a tensile test: at least one stretch above 1 (stretch is 1 + strain)", key="stretch")
    if not np.any(y):
        raise InputError("expected a stress that is not 0 everywhere", key="stress")
    return x, y


def _fit(
    law: Law,
    x: Array,
    y: Array,
    name: str,
    density: float,
    start: Mapping[str, float] | None,
    failed: tuple[str, ...],
    numerics: Numerics,
) -> LawFit:
    """Fit one law. failed : what is wrong with the test itself."""
    curve = LawCurve(law)
    names = [c.name for c in law.constants]
    if x.size < len(names):
        raise InputError(f"law {law.name!r} has {len(names)} constants; got {x.size} points", key="stretch")
    size = float(np.max(np.abs(y)))
    c = nearest_constants(curve, x, y / size, size, first_guesses(curve, start))
    single = one_term(curve, x, y, c)
    c = c if single is None else single
    stress, slopes = curve.evaluate(x, c)
    residuals = stress - y
    constants = dict(zip(names, (float(v) for v in c * curve.units), strict=True))
    held = curve.at_bound(c)
    keys = [k.file_key for k in law.constants]
    fixed = held if single is None else [False, False, True, True]  # the second term is none
    known = uncertainty(keys, slopes, residuals, fixed, repeats(x, y), serial=True)
    errors = dict(zip(names, (float(v) for v in known.standard_errors * curve.units), strict=True))
    total = float(np.sum((y - np.mean(y)) ** 2))
    fitted = (float(min(1.0, np.min(x))), float(np.max(x)))
    r_squared = 1 - float(residuals @ residuals) / total if total > 0 else float("nan")
    fit = LawFit(
        law=law,
        constants=constants,
        standard_errors=errors,
        correlation=known.correlation,
        condition=known.condition,
        r_squared=r_squared,
        misfit=statistics(residuals, y),
        fitted_stretch=fitted,
        unstable_from=None,
        at_bound=tuple(n for n, h in zip(names, held, strict=True) if h),
        checks=law_checks(float("nan"), r_squared, x, y),
        status="unstable_material",
        material=None,
        problem="",
        warnings=(
            *known.warnings,
            *open_constants(keys, c, known.standard_errors, held),
            *(() if single is None else ("its two exponents are equal: one term describes the data, and mu2 is 0",)),
        ),
    )
    if numerics.engine != "newton" and single is None:
        said, better = confirmed_constants(curve, x, y, size, c, dict(numerics.ipopt))
        fit = replace(fit, engine=numerics.engine, ipopt=said)
        least = float(residuals @ residuals)
        if better < least * (1 - _SAME_SUM) - (_SAME_SUM * size) ** 2:
            text = f"{Status.DISPUTED.advice}; the sum of squares falls to {better / least:.9g} of it"
            return replace(fit, status=Status.DISPUTED.value, problem=text)
    try:
        made = Material(name, law, constants, density, fitted)
    except MaterialError as error:
        return replace(fit, problem=error.message)
    checks = law_checks(float(made.tangent_modulus(1.0)), r_squared, x, y)
    fit = replace(fit, status="implausible", checks=checks, warnings=(*fit.warnings, *messages(checks, "warned")))
    lost = _unstable_from(made)
    if lost is not None and lost <= fitted[1]:
        note = f"the tangent modulus is not positive from a stretch of {lost:.3f} on, within the fitted range"
        fit = replace(fit, warnings=(*fit.warnings, note))
    if problems := failed or messages(fit.checks, "failed"):
        return replace(fit, unstable_from=lost, problem="; ".join(problems))
    return replace(fit, status="solved", material=made, unstable_from=lost)


def _unstable_from(material: Material) -> float | None:
    """Return the first stretch from the lowest fitted one at which E_t is not positive, looking a little beyond."""
    low, high = material.fitted_stretch
    stretch = np.linspace(low, 1 + _LOOK_AHEAD * (high - 1), _STRETCHES)
    with np.errstate(all="ignore"):
        bad = np.flatnonzero(~(np.asarray(material.tangent_modulus(stretch)) > 0))
    return float(stretch[bad[0]]) if bad.size else None
