"""What an identification frees, what it found, and how far the model is from the measurements before and after."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from softnlp.base.errors import InputError, nearest
from softnlp.base.statistics import Statistics, statistics
from softnlp.base.status import Status
from softnlp.base.units import MEGAPASCAL
from softnlp.model.conventions import Coefficients
from softnlp.model.materials import Material
from softnlp.nlp.solver import Ipopt
from softnlp.studies.check import Check, messages
from softnlp.studies.fit_statistics import Uncertainty, constant_note, determined
from softnlp.studies.measurements import OBSERVABLES, Data, column_slice
from softnlp.studies.plausibility import SHEAR_MODULUS
from softnlp.studies.registration import NAMES as REGISTRATION_NAMES
from softnlp.studies.registration import Registration, unit_of

Array = NDArray[np.float64]

UNEXPLAINED = 0.5  # of what was measured; a model that misses by more does not follow the data
GROWN = 1e-3  # relative; an error that grew by less is the same


@dataclass(frozen=True)
class Coefficient:
    """A coefficient that may be freed. quantity : its name in `softnlp.model.quantities`. field : of `Coefficients`."""

    quantity: str
    field: str
    lower: float
    upper: float


COEFFICIENTS: Mapping[str, Coefficient] = MappingProxyType(
    {
        "k_e": Coefficient("stiffening.elongation", "elongation", 0.0, 20.0),
        "k_b": Coefficient("stiffening.bending", "bending", 0.0, 50.0),
        "k_a": Coefficient("corrections.area", "area", 0.05, 20.0),
        "k_i": Coefficient("corrections.inertia", "inertia", 0.05, 20.0),
        "phi": Coefficient("corrections.bore_fraction", "bore_fraction", 0.0, 1.0),
        "c_m": Coefficient("corrections.modulus_factor", "modulus_factor", 0.05, 20.0),
        "k_c": Coefficient("contact.chamber_reaction", "chamber_reaction", 0.0, 100.0),
    }
)
"""By the letter of the equations."""


@dataclass(frozen=True, eq=False)
class FreeConstants:
    """Constants to identify, in order. start, lower, upper, scale : SI, one each; scale is a typical size.

    names : as asked. quantities : their names in `softnlp.model.quantities`.
    """

    names: tuple[str, ...]
    quantities: tuple[str, ...]
    start: Array
    lower: Array
    upper: Array
    scale: Array

    def values(self, x: Array) -> dict[str, float]:
        """Return values [SI] by quantity."""
        return dict(zip(self.quantities, (float(v) for v in x), strict=True))

    def those(self, wanted: NDArray[np.bool_]) -> FreeConstants:
        """Return some of the constants (n,)."""
        at = np.flatnonzero(wanted)
        names, quantities = (tuple(every[int(k)] for k in at) for every in (self.names, self.quantities))
        return FreeConstants(names, quantities, self.start[at], self.lower[at], self.upper[at], self.scale[at])

    def applied(self, x: Array, material: Material, coefficients: Coefficients) -> tuple[Material, Coefficients]:
        """Return material and coefficients with these values; raises `MaterialError` where they are no material."""
        fields = {c.quantity: c.field for c in COEFFICIENTS.values()}
        values = self.values(x)
        own = {fields[name]: value for name, value in values.items() if name in fields}
        constants = {n.removeprefix("material."): v for n, v in values.items() if n.startswith("material.")}
        made = replace(material, constants={**material.constants, **constants}, set="") if constants else material
        return made, replace(coefficients, **own)


def free_constants(
    free: Sequence[str],
    material: Material,
    coefficients: Coefficients,
    bounds: Mapping[str, tuple[float, float]] | None = None,
) -> FreeConstants:
    """Return the constants of the given names: a letter of `COEFFICIENTS`, or a constant of the material's law.

    bounds : by name, SI; a material's constants have none of their own. A start outside its bounds is moved to them.
    Raises `InputError` for an unknown name, one given twice, or bounds that are none.
    """
    known = {n: c.quantity for n, c in COEFFICIENTS.items()}
    for constant in material.law.constants:
        name = constant.name if constant.name not in known else f"material.{constant.name}"
        known[name] = f"material.{constant.name}"
    if not free:
        raise InputError(f"expected at least one of {', '.join(known)}", key="free")
    for k, name in enumerate(free):
        if name not in known:
            raise InputError(f"unknown constant {name!r}{nearest(str(name), known)}", key="free")
        if name in free[:k]:
            raise InputError(f"expected each constant once, got {name!r} twice", key="free")
    for name, pair in (bounds or {}).items():
        if name not in free:
            raise InputError(f"expected a constant that is free{nearest(str(name), free)}", key=f"bounds.{name}")
        if len(pair) != 2 or not pair[0] < pair[1]:
            raise InputError(f"expected a lower and an upper bound, got {list(pair)}", key=f"bounds.{name}")
    start, limits, scale = [], [], []
    for name in free:
        if of_material := known[name].startswith("material."):
            value, limit = float(material.constants[known[name].removeprefix("material.")]), (-np.inf, np.inf)
        else:
            letter = COEFFICIENTS[name]
            value, limit = float(getattr(coefficients, letter.field)), (letter.lower, letter.upper)
        low, high = (bounds or {}).get(name, limit)
        start.append(min(max(value, low), high))
        limits.append((low, high))
        scale.append(abs(value) if of_material and value else 1.0)
    lower, upper = np.array(limits, float).T
    return FreeConstants(
        tuple(free), tuple(known[n] for n in free), np.array(start, float), lower, upper, np.array(scale)
    )


def file_name(name: str, material: Material) -> tuple[str, float]:
    """Return the key that files have for a constant, or for a number of a registration, and its unit there in SI."""
    if name in REGISTRATION_NAMES:
        return unit_of(name)
    plain = name.removeprefix("material.")
    for c in material.law.constants:
        if c.name == plain and name not in COEFFICIENTS:
            return c.file_key, c.scale
    return name, 1.0


def constants_text(keys: Sequence[tuple[str, float]], x: Array, form: str = ".4g") -> str:
    """Return values [SI] in words; keys : of files with their units, of `file_name`."""
    return ", ".join(f"{key} = {value / unit:{form}}" for (key, unit), value in zip(keys, x, strict=True))


@dataclass(frozen=True, eq=False)
class Identified:
    """What an identification found.

    Attributes
    ----------
    status, message
        Solved, or why the model could not be compared with the measurements, and where.
    free
        Names, start and bounds.
    constants
        (n,) found [SI], nan where nothing was.
    at_bound
        Names of those at a bound.
    uncertainty
        Of the constants.
    material, coefficients
        With the constants found.
    data
        The measurements as they were checked, one entry a robot.
    before, after
        (rows, 6) for each robot, the model at the start and at the end, in the order of `COLUMNS` [m, rad or N]; nan
        where
        nothing was measured.
    evaluations
        How often all poses were solved.
    warnings
        What the data leave open, and bounds that were reached.
    engine
        Which engine found them, of `Numerics`; None without a solution.
    ipopt
        What IPOPT said of them, where it took part.
    registration
        With the numbers found, None where the tips are those of the model.
    checks
        Of the constants, and of the tips that were measured.
    """

    status: Status
    message: str
    free: FreeConstants
    constants: Array
    at_bound: tuple[str, ...]
    uncertainty: Uncertainty
    material: Material
    coefficients: Coefficients
    data: tuple[Data, ...]
    before: tuple[Array, ...]
    after: tuple[Array, ...]
    evaluations: int
    warnings: tuple[str, ...]
    engine: str | None = None
    ipopt: Ipopt | None = None
    registration: Registration | None = None
    checks: tuple[Check, ...] = ()

    @property
    def problems(self) -> tuple[str, ...]:
        """What cannot be true of the constants found."""
        return messages(self.checks, "failed")

    @property
    def determined(self) -> dict[str, bool | None]:
        """By name: whether a constant's standard error is within its value, None where it has none."""
        triples = zip(self.free.names, self.constants, self.uncertainty.standard_errors, strict=True)
        return {n: determined(np.inf if n in REGISTRATION_NAMES else c, error) for n, c, error in triples}

    @property
    def notes(self) -> dict[str, str]:
        """By name: whether a constant is at its bound or not determined, else ""."""
        return {name: constant_note(known, name in self.at_bound) for name, known in self.determined.items()}

    def weighted_rms(self, after: bool = True) -> float:
        """Return the root mean square of what is minimised, (model - measured) / sigma with the weights of rows [1].

        Parameters
        ----------
        after
            With the constants found, or else with those at the start.

        Returns
        -------
        float
            The root mean square, nan where a pose was not found [1].
        """
        return float(np.sqrt(np.mean(weighted_residuals(self.data, self.after if after else self.before) ** 2)))

    def errors(self, after: bool = True) -> dict[str, Statistics]:
        """Return the misfit by observable over all robots [m, rad, N].

        A tip position's error is a distance, compared with the robot's length; others are compared with the number
        measured.

        Parameters
        ----------
        after
            With the constants found, or else with those at the start.

        Returns
        -------
        dict
            `Misfit` by observable, in m, rad or N.
        """
        return observable_misfits(self.data, self.after if after else self.before)


def weighted_residuals(data: Sequence[Data], predicted: Sequence[Array]) -> Array:
    """Return the weighted residuals of all numbers measured; nan where a pose was not found."""
    pairs = zip(data, predicted, strict=True)
    return np.concatenate([((v - d.values) / d.sigma * d.root_weight[:, None])[d.fitted] for d, v in pairs])


def without_constants(found: Identified, status: Status, message: str) -> Identified:
    """Return an identification without a result, which keeps the measurements and the model at the start."""
    n = len(found.free.names)
    return replace(
        found,
        status=status,
        message=message,
        constants=np.full(n, np.nan),
        at_bound=(),
        uncertainty=Uncertainty(np.full(n, np.nan), np.full((n, n), np.nan), np.nan, ()),
        after=tuple(np.full_like(values, np.nan) for values in found.before),
        warnings=(),
    )


def further_measurements(names: Collection[str]) -> str:
    """Return which measurements would tell constants apart."""
    if any(name in REGISTRATION_NAMES for name in names):
        if any(name.startswith(("tip_sensor", "clock")) for name in names):
            return "rows in which the robot bends in another plane"
        return "rows in which the robot bends in another plane and further, or quaternions of the sensor"
    advice = (
        ("k_c", "blocked forces at other pressures and offsets, beside free poses"),
        ("k_e", "rows with all sets at one pressure, which only lengthen the robot, beside rows that bend it"),
        ("k_b", "rows that bend the robot by other sets and pressures, beside rows that only lengthen it"),
        ("phi", "blocked forces, or rows at other pressures beside a tensile test of the silicone"),
    )
    if any(name not in COEFFICIENTS for name in names):
        return "a tensile test of the silicone, which settles its constants"
    return next((words for name, words in advice if name in names), "blocked forces, or a robot of other dimensions")


def constant_checks(found: Identified) -> tuple[Check, ...]:
    """Return the checks of the constants: how many ended at a bound, and the stiffness of a fitted material."""
    names = ", ".join(file_name(name, found.material)[0] for name in found.at_bound)
    likely = (
        f"{names}: the model leaves its range to follow these data; check their frame, units and sets, or the bounds"
    )
    checks = []
    if any(np.any(d.measured[:, :3]) for d in found.data):  # a few angles may leave a constant at 0
        checks.append(Check("number of constants at a bound", len(found.at_bound), (0, 0), (0, 0), likely))
    if any(name.startswith("material.") for name in found.free.quantities):
        size = float(found.material.shear_modulus(1.0)) / MEGAPASCAL
        likely = "no silicone is so soft or so stiff: check the unit of the pressures and of what was measured"
        checks.append(Check("shear modulus of the constants found", size, *SHEAR_MODULUS, likely, "MPa"))
    return tuple(checks)


def grown_errors(found: Identified) -> list[str]:
    """Say which observables are further from what was measured than at the start, and why."""
    before, after = found.errors(False), found.errors()
    grown = [
        f"{key.replace('_', ' ')} rose by {100 * (after[key].rmse / before[key].rmse - 1):.3g} %"
        for key in after
        if after[key].rmse > before[key].rmse * (1 + GROWN)
    ]
    if not grown:
        return []
    weighted = f"from {found.weighted_rms(False):.4g} to {found.weighted_rms():.4g}"
    return [
        f"the rms error of the {' and of the '.join(grown)} from the start on, while what is minimised, the rms of the "
        f"errors divided by sigma, went {weighted}: say in [sigma] what each observable is worth"
    ]


def unexplained(found: Identified) -> list[str]:
    """Say of which observables the constants found leave more than half: another unit or sign is likely."""
    sizes = observable_misfits(found.data, [np.zeros_like(d.values) for d in found.data])
    left = {key: 100 * after.rmse / sizes[key].rmse for key, after in found.errors().items() if sizes[key].rmse > 0}
    return [
        f"the rms error of the {key.replace('_', ' ')} that is left is {percent:.3g} % of what was measured: the model "
        "does not follow these data; check their unit and sign, the pressures and the robot"
        for key, percent in left.items()
        if percent > 100 * UNEXPLAINED
    ]


def observable_misfits(data: Sequence[Data], predicted: Sequence[Array]) -> dict[str, Statistics]:
    """Return the misfit of predictions by observable, see `Identified.errors`."""
    found = {}
    for observable in OBSERVABLES:
        errors, sizes = [], []
        for d, values in zip(data, predicted, strict=True):
            difference = (values - d.values)[:, column_slice(observable)]
            rows = np.any(np.isfinite(d.of(observable)), axis=1)
            errors.append(np.sqrt(np.nansum(difference[rows] ** 2, axis=1)))
            length = np.full(int(np.sum(rows)), float(d.robot.length))
            sizes.append(length if observable == "tip_position" else d.of(observable)[rows, 0])
        if sum(e.size for e in errors):
            found[observable] = statistics(np.concatenate(errors), np.concatenate(sizes))
    return found
