"""What a person's number can mean: the physical range of each quantity, stated here once, in the unit of files.

The ranges are wide; they hold back what can only be a mistake, such as a force in the wrong unit. A quantity is known
by its key, or by the unit in which its key ends.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError
from softnlp.base.reading import shown
from softnlp.base.units import BAR, MEGAPASCAL, MILLIMETRE, NEWTON_MILLIMETRE

Array = NDArray[np.float64]

LOWEST_READING_BAR = -0.05  # of a regulator that is off: noise
HIGHEST_USUAL_BAR = 10.0  # soft robots of silicone take a bar or two


@dataclass(frozen=True)
class Range:
    """Where the numbers of a quantity lie, ends included.

    what : the quantity. unit : that of files, "" where there is none. scale : SI per unit. noise : how far below `low`
    a reading may be, which then counts as `low`. hint : what else to say of a number outside.
    """

    what: str
    unit: str
    low: float
    high: float
    scale: float = 1.0
    noise: float = 0.0
    hint: str = ""

    def holds(self, values: Any) -> NDArray[np.bool_]:
        """Return which numbers, in the unit of files, are in the range; nan is not."""
        numbers = np.asarray(values)
        inside: NDArray[np.bool_] = np.asarray((numbers >= self.low - self.noise) & (numbers <= self.high))
        return inside

    def refusal(self, value: float) -> str:
        """Return what to say of a number outside, in the unit of files."""
        unit = f" {self.unit}" if self.unit else ""
        noise = f"; readings down to {self.low - self.noise:g}{unit} count as 0" if self.noise and value < 0 else ""
        got = shown(value) if isinstance(value, int) else f"{value:g}"
        if not isinstance(value, int) and self.holds(float(got)):  # rounded, it would be a number that is expected
            got = repr(float(value))
        hints = f"{noise}{self.small(value)}{self.hint}"
        return f"expected at least {self.low:g} and at most {self.high:g}{unit}, got {got}{unit}{hints}"

    def small(self, value: float) -> str:
        """Return what to say of a number that is below the range and in it a thousand times as large, "" of others."""
        if self.unit != "mm" or not value < self.low <= 1000 * value:
            return ""
        return f"; {value:g} mm looks like metres: {1000 * value:g} mm"

    def require(self, values: Any, key: str) -> None:
        """Raise `InputError` with the key where a number, in SI, is outside."""
        numbers = np.ravel(np.asarray(values, dtype=float)) / self.scale
        # A number converted from a file and back may be beyond an end by a rounding.
        for number in numbers[~self.holds(numbers * (1 - 1e-12)) & ~self.holds(numbers * (1 + 1e-12))][:1]:
            raise InputError(self.refusal(float(number)), key=key)


PRESSURE_HINT = "; pressures are gauge, in bar: 1 bar = 100 kPa = 1000 mbar"
PRESSURE = Range("gauge pressure", "bar", 0, 100, BAR, hint=PRESSURE_HINT)
READING = Range("gauge pressure of a step, or measured", "bar", 0, 100, BAR, -LOWEST_READING_BAR, PRESSURE_HINT)
FORCE = Range("force", "N", -1e4, 1e4)
MOMENT = Range("moment", "N mm", -1e6, 1e6, NEWTON_MILLIMETRE)
GRAVITY = Range("gravity", "m/s^2", 0, 1000)
SIZE = Range("dimension of a robot or a specimen", "mm", 1e-3, 1e5, MILLIMETRE)
POSITION = Range("position, offset, other length", "mm", -1e4, 1e4, MILLIMETRE)
ANGLE = Range("angle", "deg", -36000, 36000)
DENSITY = Range("density", "kg/m^3", 1, 1e5)
STRETCH = Range("stretch", "", 0, 1e4)  # wide enough for percent, which the checks of tensile tests name
STRESS = Range("stress, constant of a law in MPa", "MPa", -1e6, 1e6, MEGAPASCAL)
CONSTANT = Range("constant without unit", "", -1e12, 1e12)
COEFFICIENT = Range("coefficient k_e, k_b, k_c", "", 0, 1000)
FACTOR = Range("factor k_a, k_i", "", 1e-3, 1000)
FRACTION = Range("fraction phi", "", 0, 1)
TIME = Range("time", "s", -1e12, 1e12)
WEIGHT = Range("weight of a closure", "", 1e-9, 1e9)
ROW_WEIGHT = Range("weight of a measured row", "", 0, 1e9)
DEVIATION = Range("standard deviation", "", 1e-9, 1e6)
LARGEST_SHARE = 10.0  # of what scatters, as a fraction
ACCURACY = Range("accuracy", "of L_0", 1e-12, 1e-2)
TOLERANCE = Range("tolerance", "", 1e-14, 1e-4)

_BY_UNIT: Mapping[str, Range] = {
    "_per_N": WEIGHT,  # before the units that it ends in
    "_per_Nmm": WEIGHT,
    "_per_mm": WEIGHT,
    "_bar": PRESSURE,
    "_N": FORCE,
    "_Nmm": MOMENT,
    "_mm": POSITION,
    "_deg": ANGLE,
    "_MPa": STRESS,
    "_s": TIME,
    "_kg_m3": DENSITY,
    "_m_per_s2": GRAVITY,
}
_SIZES = (
    *("outer_diameter_mm", "lumen_diameter_mm", "chamber_circle_diameter_mm", "chamber_diameter_mm"),
    *("chamber_wall_mm", "length_mm", "minimum_wall_mm", "length_per_radian_mm"),
    *("gauge_length_mm", "width_mm", "thickness_mm", "diameter_mm"),
)
_BY_KEY: Mapping[str, Range] = {
    **dict.fromkeys(_SIZES, SIZE),
    **{f"requirements.{key}": POSITION for key in _SIZES},  # at least 0 asks for nothing
    **dict.fromkeys(("stiffening.elongation", "stiffening.bending", "contact.chamber_reaction"), COEFFICIENT),
    **dict.fromkeys(("corrections.area", "corrections.inertia"), FACTOR),
    "corrections.bore_fraction": FRACTION,
    "sequence_bar": READING,
    "stretch": STRETCH,
    "fitted_stretch": STRETCH,
    "bounds": CONSTANT,
    "weight": ROW_WEIGHT,
    "solver.accuracy": ACCURACY,
    "solver.tolerance": TOLERANCE,
}
RANGES: tuple[Range, ...] = tuple(dict.fromkeys((*_BY_UNIT.values(), *_BY_KEY.values(), CONSTANT, DEVIATION)))
"""Every range, as docs/scenario.md lists them."""


def range_of(*keys: str) -> Range | None:
    """Return the range of the number at the keys of a file, tables first, or of a CSV column; None where none is known.

    What has no range of its own, as `from` in a choice of `length_mm`, has that of the key above it.
    """
    path = ".".join(keys).split(".")
    if path[0] == "uncertainty":  # read with what it is a deviation of
        return None
    if path[0] == "sigma" or path[0].startswith("sigma_"):
        return DEVIATION
    if "constants" in path:
        return STRESS if path[-1].endswith("_MPa") else CONSTANT
    for k in range(len(path) - 1, -1, -1):
        if path[k] in ("levels", "s"):
            break
        with_table = ".".join(path[max(k - 1, 0) : k + 1])
        units = (limits for unit, limits in _BY_UNIT.items() if path[k].endswith(unit))
        found = _BY_KEY.get(with_table) or _BY_KEY.get(path[k]) or next(units, None)
        if found is not None:
            return READING if re.fullmatch(r"p\d+_bar", path[k]) else found
    return None


def too_uncertain(size: float, share: bool) -> str:
    """Return what a standard deviation, in the unit of files or a fraction, is expected to be, "" where it is that."""
    most = LARGEST_SHARE if share else DEVIATION.high
    return "" if size <= most else f"expected at most {most:g}{f' ({100 * most:g}%)' if share else ''}"


def without_noise(readings: Array) -> Array:
    """Return pressures in which the readings of a regulator that is off are 0."""
    return np.where(readings <= 0, 0.0, readings)


def noise_note(readings_bar: Array) -> tuple[str, ...]:
    """Return one warning of the readings that count as 0, or none; nan is no reading."""
    below = readings_bar[readings_bar < 0]
    if not below.size:
        return ()
    count = "1 pressure reading" if below.size == 1 else f"{below.size} pressure readings"
    return (
        f"{count} below 0, the lowest {below.min():g} bar, taken as 0 (readings down to {LOWEST_READING_BAR:g} bar)",
    )


def unit_note(readings_bar: Array) -> tuple[str, ...]:
    """Return one warning where the largest pressure looks like kPa, or none; nan is no pressure."""
    largest = float(np.fmax.reduce(readings_bar, axis=None, initial=0.0))
    if largest <= HIGHEST_USUAL_BAR:
        return ()
    return (f"a pressure of {largest:g} bar looks like kPa: {largest:g} kPa are {largest / 100:g} bar",)


def file_unit_note(data: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the warning of `unit_note` for the pressures in the tables of a file."""
    found = [float(value) for _, value, limits in _numbers(data) if limits in (PRESSURE, READING)]
    return unit_note(np.array(found))


def numbers_outside(data: Mapping[str, Any]) -> list[tuple[tuple[int | str, ...], Any, str]]:
    """Return place, number and what to say of each finite number in the tables of a file that is outside its range."""
    return [(keys, value, limits.refusal(value)) for keys, value, limits in _numbers(data) if not limits.holds(value)]


def _numbers(value: Any, keys: tuple[int | str, ...] = ()) -> Iterator[tuple[tuple[int | str, ...], Any, Range]]:
    """Yield place, number and range of each finite number in the tables of a file that has a range."""
    if isinstance(value, Mapping | list):
        for key, part in value.items() if isinstance(value, Mapping) else enumerate(value):
            yield from _numbers(part, (*keys, key))
    elif not isinstance(value, bool) and isinstance(value, int | float) and abs(value) < inf:
        limits = range_of(*(key for key in keys if isinstance(key, str)))
        if limits is not None:
            yield keys, value, limits
