"""Whether a tensile test and the laws fitted to it can be true: numbers, their ranges, and what is likely wrong.

The reduced stress sigma / (stretch - stretch^-2) (Mooney 1940) of a rubber is its shear modulus at a stretch near 1 and
falls or stays from there on; a quantity that was read for another one shows in it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf, isfinite

import numpy as np
from numpy.typing import NDArray

from softnlp.base.units import MEGAPASCAL
from softnlp.model.materials import load_materials
from softnlp.studies.check import Check, Range, messages
from softnlp.studies.cycles import unloadings

Array = NDArray[np.float64]


LARGEST_STRETCH: tuple[Range, Range] = (1.1, 3.0), (1.01, 10.0)
SMALLEST_STRETCH: tuple[Range, Range] = (0.3, inf), (0.3, inf)
STRESS_AT_1: tuple[Range, Range] = (-0.03, 0.03), (-0.3, 0.05)  # a slack specimen is common and pardoned for longer
AT_1 = 0.01  # where points are at stretch 1 themselves
SHEAR_MODULUS: tuple[Range, Range] = (0.002, 2.0), (0.001, 10.0)  # [MPa]
FIRST: tuple[Range, Range] = (0.3, 5.0), (0.15, inf)
SLACK: tuple[Range, Range] = (0.0, 0.03), (0.0, 0.1)  # of a tenth makes the modulus a quarter too small
GROWTH: tuple[Range, Range] = (-1.5, 0.5), (-inf, inf)
TRUE_GROWTH: tuple[Range, Range] = (0.3, inf), (-inf, inf)  # 1 for a neo-Hookean silicone, 0 where it is engineering
IN_PERCENT: tuple[Range, Range] = (1.1, inf), (1.05, inf)  # a test of 5 % of a silicone is none, but a fraction is
UNLOADINGS: tuple[Range, Range] = (0, 0), (0, inf)
R_SQUARED: tuple[Range, Range] = (0.9, 1.0), (0.5, 1.0)
AREA: tuple[Range, Range] = (1.5, 2000.0), (0.0, inf)  # [mm^2]

_ERRORS = 3.0  # standard errors of a number by which its range is widened
_FEWEST = 5  # points that a line is laid through
_NEAR, _NEARER = 0.08, 0.1  # of extension, and of the largest: a test that begins within both tells of stretch 1
_AT_1 = 1e-3  # of stretch
_NOTHING = 1e-30  # [Pa], in place of a stress of 0
_STIFF = 2.0  # times the stiffest silicone of the library
_SAME = 0.02  # relative, of areas
_SLACKEST, _TRIED, _CLEARLY = 0.6, 61, 20.0  # of the extension; how many are tried; F of one that is seen
_MOST = 2000  # points by which slack is looked for
_READINGS = (
    (1e6, "stress in Pa (name its column stress_Pa), or a specimen's width and thickness in m"),
    (1e3, "stress in kPa (name its column stress_kPa), or force in mN"),
    (145.0, "stress in psi"),
    (102.0, "force in gram-force"),
    (1e-3, "stress in GPa, or force in kN"),
)  # the modulus is this many times the true one

_BROKEN = "the specimen broke; leave out what follows the largest stress, or cut the range with stretch = [1, 2]"
_BEGINS_LATER = (
    "the stress begins at a larger stretch than 1: looks like a slack specimen, like the distance between the grips in "
    "displacement_mm, or like stretch in a column strain; take off what it begins at"
)
_REACH, _MODULUS, _CROSS = "largest stretch", "shear modulus of the data", "cross-section"
_GROWS = "growth of the reduced stress with the stretch"
_AGREEING = (
    ((_REACH, False), (_GROWS, False)),
    ((_REACH, False), (_MODULUS, True)),
    ((_CROSS, False), (_MODULUS, True)),
    ((_CROSS, True), (_MODULUS, False)),
)  # pairs of checks, and whether their numbers are high: one mistake in a unit makes both unusual


def agreed(checks: Sequence[Check]) -> tuple[Check, ...]:
    """Return checks of which two that are unusual in a way that one mistake explains fail."""
    unusual = {check.name: bool(check.value > check.usual[1]) for check in checks if check.verdict == "warned"}
    both = {name for pair in _AGREEING if all(unusual.get(name) is high for name, high in pair) for name, _ in pair}
    return tuple(replace(check, possible=check.usual) if check.name in both else check for check in checks)


def curve_checks(stretch: Array, stress: Array, read: Sequence[Check] = ()) -> tuple[Check, ...]:
    """Return the checks of a tensile test (points,) [1], [Pa]; those that need an earlier one end at its failure.

    read : what is to be said of how it was read, told with them.
    """
    reach = float(np.max(stretch))
    checks = [
        *read,
        Check(_REACH, reach, *LARGEST_STRETCH, _largest(stretch)),
        Check(
            "smallest stretch",
            float(np.min(stretch)),
            *SMALLEST_STRETCH,
            "looks like strain; name its column strain, or strain_percent where it is in percent",
        ),
        Check(
            "number of unloadings",
            unloadings(stretch),
            *UNLOADINGS,
            "looks like several load cycles, whose loading and unloading differ; keep one loading of each specimen",
        ),
    ]
    top = int(np.argmax(stress))
    lost = (stretch > stretch[top]) & (stress < 0.5 * stress[top])
    if np.any(lost):
        checks.append(Check("points after the break", float(np.sum(lost)), *UNLOADINGS, _BROKEN))
    for more in (_beginning, _slack, _shear_modulus, _growth):
        if messages(tuple(checks), "failed"):
            break
        with np.errstate(all="ignore"):  # a number that cannot be represented fails
            checks += more(stretch, stress)
    return agreed(checks)


def law_checks(modulus: float, r_squared: float, stretch: Array, stress: Array) -> tuple[Check, ...]:
    """Return the checks of a law: E_t at stretch 1 [Pa], nan where there is none, and R^2 of the test fitted to."""
    likely = "the law does not follow the data; cut their range, such as with stretch = [1, 2], or take another law"
    found = [Check("R^2", r_squared, *R_SQUARED, likely)]
    if isfinite(modulus):
        size = modulus / 3 / MEGAPASCAL
        likely = "the data near stretch 1 do not hold the law there; leave it out, or add points"
        if messages(tuple(_shear_modulus(stretch, stress)), "passed") != ("",):
            likely = _unit_of(size)
        found.append(Check("shear modulus at stretch 1", size, *(SHEAR_MODULUS[1],) * 2, likely, "MPa"))
    return tuple(found)


def modulus_notes(name: str, modulus: float) -> tuple[str, ...]:
    """Return the warning of a law that was given, where no silicone is so soft or so stiff.

    name : of the silicone. modulus : its shear modulus at stretch 1 [Pa].
    """
    size, (low, high) = modulus / MEGAPASCAL, SHEAR_MODULUS[1]
    if low <= size <= high:
        return ()
    return (
        f"the shear modulus of {name} at stretch 1 is {size:.4g} MPa, expected {low:g} to {high:g} MPa: check the unit "
        "of its constants; a stress is in MPa",
    )


def divisor_checks(force: Array, stress: Array, area: float | None = None) -> tuple[Check, ...]:
    """Return the check of the area that a machine divided a force [N] by for its stress [Pa], in mm^2.

    area : of the specimen [m^2], None where it is not known.
    """
    with np.errstate(all="ignore"):
        large = np.abs(stress) > 0.1 * np.nanmax(np.abs(stress))
        divisor = float(np.nanmedian(np.where(large, force / stress, np.nan))) * MEGAPASCAL
    usual, possible = AREA
    likely = "the machine divided by another area than the specimen's; take the force and the specimen's size"
    if abs(divisor - 1) < _SAME:
        possible = usual
        likely = "the machine's stress equals the force, over an area left at 1; take the force and the specimen's size"
    elif area is not None:
        usual = area * MEGAPASCAL * (1 - _SAME), area * MEGAPASCAL * (1 + _SAME)
    return (Check("area of the machine's stress", divisor, usual, possible, likely, "mm^2"),)


def stiffness_checks(stretch: Array, stress: Array) -> tuple[Check, ...]:
    """Return the check of a test that is far stiffer than every silicone of the library, none for another."""
    reduced = _reduced(stretch)
    with np.errstate(all="ignore"):
        size = float(reduced @ stress / (reduced @ reduced))
    models = (model for silicone in load_materials().values() for model in silicone.models.values())
    ratio = size / max(float(model.shear_modulus(1.0)) for model in models)
    if not (ratio > _STIFF and size < SHEAR_MODULUS[1][1] * MEGAPASCAL):
        return ()
    likely = (
        "looks like a machine's stress over an area left at 1 mm^2, or another specimen; some silicones are so stiff"
    )
    return (
        Check("shear modulus over that of the stiffest silicone of the library", ratio, (0, _STIFF), (0, inf), likely),
    )


def percent_check(stretch: Array) -> Check:
    """Return the check of a column of strain in percent, by the stretch that was read from it (points,) [1]."""
    likely = "looks like strain as a fraction in a column strain_percent; name it strain"
    return Check("largest stretch of strain_percent", float(np.max(stretch)), *IN_PERCENT, likely)


def true_checks(stretch: Array, stress: Array) -> tuple[Check, ...]:
    """Return the check of a stress that is said to be true (points,) [1], [Pa], before it is divided by the stretch."""
    found = _reduced_growth(stretch, stress)
    if found is None:
        return ()
    (low, high), possible = TRUE_GROWTH
    likely = 'looks like engineering stress; leave out stress = "true" where it is'
    return (
        Check("growth of the reduced true stress with the stretch", found[0], (low - found[1], high), possible, likely),
    )


def area_check(area: float) -> Check:
    """Return the check of a specimen's cross-section [mm^2]."""
    return Check(_CROSS, area, *AREA, "looks like a size that was left at 1 or is not in mm", "mm^2")


def _largest(stretch: Array) -> str:
    """Return what a largest stretch out of range looks like."""
    if np.max(stretch) < 2:
        return "looks like displacement_mm in m or cm, or in inches, or strain in a column strain_percent"
    if np.max(stretch) <= LARGEST_STRETCH[1][1]:
        return (
            "the whole test, perhaps to failure: robots stretch less, and a law fits the range it is used in; cut it "
            "with stretch = [1, 2]"
        )
    if np.min(stretch) > LARGEST_STRETCH[1][1]:
        return "looks like stretch in percent, or a length in mm; divide by 100, or by the length before the test"
    return (
        "looks like strain in percent (name its column strain_percent) or, with displacement_mm, a gauge_length_mm in "
        "m or cm; where it was so large cut it with stretch = [1, 2]"
    )


def _reduced(stretch: Array) -> Array:
    """Return stretch - stretch^-2, the neo-Hookean stress of a shear modulus of 1."""
    reduced: Array = stretch - stretch**-2
    return reduced


def _from_1(stretch: Array) -> bool:
    """Whether a test begins so near to 1 that its first points tell of there."""
    return bool(np.min(stretch) - 1 <= min(_NEAR, _NEARER * (np.max(stretch) - 1)))


def _line(A: Array, y: Array) -> tuple[Array, Array]:
    """Return the least-squares coefficients of the columns of A and their standard errors."""
    found = np.linalg.lstsq(A, y, rcond=None)[0]
    r = y - A @ found
    covariance = np.linalg.pinv(A.T @ A) * float(r @ r) / (len(y) - A.shape[1])
    errors: Array = np.sqrt(np.abs(np.diag(covariance)))
    return np.asarray(found, float), errors


def _beginning(stretch: Array, stress: Array) -> list[Check]:
    """Return the check of the stress at stretch 1, as a part of the largest, by the points next to it.

    Where a test begins further from 1, it is the check of the reduced stress there, which is then not near 0.
    """
    away = np.abs(stretch - 1)
    if away.size < _FEWEST:
        return []
    if not _from_1(stretch):
        first = np.argsort(stretch, kind="stable")[: max(_FEWEST, stretch.size // 10)]
        later = stretch[first] - stretch[first[0]]
        begins = _line(np.column_stack([np.ones(later.size), later]), stress[first])[0][0]
        reduced = _reduced(stretch)
        size = float(np.median(stress / reduced) * reduced[first[0]]) or _NOTHING
        usual, (low, high) = FIRST
        possible = low - 2 * _noise(stretch, stress) / abs(size), high
        name = "reduced stress at the smallest stretch, relative to its median,"
        return [Check(name, float(begins / size), usual, possible, _BEGINS_LATER)]
    near = away <= max(0.5 * np.max(away), np.partition(away, _FEWEST - 1)[_FEWEST - 1])
    reduced = _reduced(stretch[near])
    (offset, slope), (error, _) = _line(np.column_stack([np.ones(reduced.size), reduced]), stress[near])
    size = float(np.max(np.abs(stress)))
    more = _ERRORS * error / size
    usual, possible = ((low - more, high + more) for low, high in STRESS_AT_1)
    likely = "looks like a preload that was not tared; take its stress or force off every row"
    if np.min(stretch) < 0.9 and np.all(stress[stretch < 0.9] >= 0):
        likely = "looks like strain; name its column strain, or strain_percent where it is in percent"
    elif offset < 0 and slope > 0:
        likely = _BEGINS_LATER
    name = "stress at stretch 1, relative to the largest,"
    by_line = Check(name, offset / size, usual, possible, likely)
    there = stress[away <= _AT_1]
    if by_line.verdict != "passed" or not there.size:
        return [by_line]
    most = AT_1 + _ERRORS * _noise(stretch, stress) / size
    return [Check(name, float(np.median(there)) / size, (-most, most), (-inf, inf), likely)]


def _noise(stretch: Array, stress: Array) -> float:
    """Return the standard deviation of a stress about a smooth curve, by its second differences."""
    return float(np.sqrt(np.mean(np.diff(stress[np.argsort(stretch, kind="stable")], 2) ** 2) / 6))


def _shear_modulus(stretch: Array, stress: Array) -> list[Check]:
    """Return the check of the modulus that fits all points."""
    reduced = _reduced(stretch)
    size = float(reduced @ stress / (reduced @ reduced)) / MEGAPASCAL
    return [Check(_MODULUS, size, *SHEAR_MODULUS, _unit_of(size), "MPa")]


def _unit_of(modulus: float) -> str:
    """Return what a modulus [MPa] out of range looks like: the readings that would make it a usual one."""
    if modulus <= 0:
        return "looks like a force or stress with its sign turned, or no tensile test"
    low, high = SHEAR_MODULUS[0]
    likely = [what for factor, what in _READINGS if low <= modulus / factor <= high]
    return f"looks like {'; or '.join(likely)}" if likely else "check the units of stress, force, lengths and specimen"


def _slack(stretch: Array, stress: Array) -> list[Check]:
    """Return the check of how far a specimen is pulled before it bears, where the fit shows that: what to take off.

    The stress is fitted up to a stretch of 2 by its reduced stress, constant and growing.
    """
    low = (stretch > 0.8) & (stretch <= 2)
    if np.sum(low) < _FEWEST or not _from_1(stretch):
        return []
    thin = slice(None, None, 1 + int(np.sum(low)) // _MOST)
    x, y = stretch[low][thin], stress[low][thin]
    extension = float(np.max(x)) - 1

    def misfit(slack: float) -> float:
        beyond = np.maximum(x - slack * extension, np.minimum(x, 1))
        A = np.column_stack([_reduced(beyond), _reduced(beyond) * (beyond - 1)])
        found = np.linalg.lstsq(A, y, rcond=None)[0]
        r = y - A @ found
        return float(r @ r) if found[0] > 0 else inf

    tried = np.linspace(0, _SLACKEST, _TRIED)
    misfits = np.array([misfit(slack) for slack in tried])
    best = int(np.argmin(misfits))
    if not misfits[0] - misfits[best] > _CLEARLY * misfits[best] / max(x.size - 3, 1):
        return []
    begins = f"the stress begins at a stretch of {1 + tried[best] * extension:.3g}"
    likely = f"{begins}: looks like a slack specimen; take what it begins at off every row"
    return [Check("slack, relative to the largest extension,", float(tried[best]), *SLACK, likely)]


def _reduced_growth(stretch: Array, stress: Array) -> tuple[float, float] | None:
    """Return how the reduced stress grows with the stretch up to 2, over its value at 1, and what noise leaves open.

    None where the test does not tell: it begins too late, or its stress near 1 is noise or none.
    """
    low = (stretch > 0.8) & (stretch <= 2)
    if np.sum(low) < _FEWEST or not _from_1(stretch):
        return None
    reduced = _reduced(stretch[low])
    A = np.column_stack([np.ones(reduced.size), reduced, reduced * (stretch[low] - 1)])
    (_, first, growth), (_, doubt, error) = _line(A, stress[low])
    return (growth / first, _ERRORS * error / first) if first > _ERRORS * doubt else None


def _growth(stretch: Array, stress: Array) -> list[Check]:
    """Return the check of how the reduced stress grows with the stretch; true stress makes it grow as that."""
    found = _reduced_growth(stretch, stress)
    if found is None or any(check.message for check in _slack(stretch, stress)):  # of a slack one it says nothing
        return []
    value, more = found
    likely = 'looks like true stress; write stress = "true" where it is'
    if value < 0:
        likely = (
            "looks like a stretch too near to 1, of displacement_mm in cm or inches, or strain in a column "
            "strain_percent"
        )
    usual = GROWTH[0][0] - more, GROWTH[0][1] + more
    return [Check(_GROWS, value, usual, GROWTH[1], likely)]
